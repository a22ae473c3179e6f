//! The nearest and the farthest reading in any window of pixels, also over an image's border and a turn's seam.

use super::range_pyramid::RangePyramid;

/// Readings of an image, without their sign; what has none, in the image or outside of it, counts as 0.
#[derive(Clone, Debug, Default)]
pub(super) struct WindowReadings {
    pyramid: RangePyramid,
    columns: i64,
    rows: i64,
    /// Columns of a full turn, whether the image has all of them or not; `None`: the sensor does not turn.
    turn: Option<i64>,
}

impl WindowReadings {
    /// Takes in the values of an image of `columns` a row. Its memory is kept from image to image.
    pub(super) fn fill(&mut self, values: &[f32], columns: usize, turn: Option<usize>) {
        let rows = values.len() / columns.max(1);
        self.pyramid.build(columns.max(1), values, false);
        (self.columns, self.rows) = (columns as i64, rows as i64);
        self.turn = turn.map(|turn| turn as i64);
    }

    /// Bounds of the nearest and the farthest reading of all pixels up to the finite `halves` (columns, rows) from a pixel
    /// coordinate, and of those between which its ends lie. `None`: none of them is in the image.
    #[inline(always)]
    pub(super) fn extremes(&self, [column, row]: [f32; 2], halves: [f32; 2]) -> Option<[f32; 2]> {
        let (columns, rows) = (self.columns, self.rows);
        // Far outside of any image, and no sum of two overflows.
        let pixel = |v: f32| v.clamp(-1e12, 1e12) as i64;
        let span = |at: f32, half: f32| [pixel((at - half).floor()), pixel((at + half).ceil())];
        let [top, bottom] = span(row, halves[1]);
        let [mut left, mut right] = span(column, halves[0]);
        let mut is_whole = top >= 0 && bottom < rows;
        let mut over_the_seam = None;
        match self.turn {
            // All around.
            Some(turn) if right - left >= turn.min(columns) => {
                is_whole &= columns >= turn;
                [left, right] = [0, columns - 1];
            }
            Some(turn) => {
                let turns = left.div_euclid(turn) * turn;
                [left, right] = [left - turns, right - turns];
                is_whole &= right < columns || columns >= turn;
                over_the_seam = (right >= columns.max(turn)).then_some(right - turn);
            }
            None => is_whole &= left >= 0 && right < columns,
        }
        if bottom < 0 || top >= rows || right < 0 {
            return None;
        }
        let within = |v: i64, n: i64| v.clamp(0, n - 1) as usize;
        let rows = [within(top, rows), within(bottom, rows)];
        let part =
            |from: i64, to: i64| self.pyramid.extremes([within(from, columns), within(to, columns)], rows);
        let before = (left < columns).then(|| part(left, right));
        let beyond = over_the_seam.map(|end| part(0, end));
        let [nearest, farthest] = match (before, beyond) {
            (Some(a), Some(b)) => [a[0].min(b[0]), a[1].max(b[1])],
            (Some(one), None) | (None, Some(one)) => one,
            (None, None) => return None,
        };
        Some([if is_whole { nearest } else { 0.0 }, farthest])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const COLUMNS: usize = 60;
    const ROWS: usize = 20;

    proptest! {
        /// Bounds hold for every pixel of the window, one by one: outside of the image, over the seam, in the gap of a turn that has
        /// more columns than the image, and all around.
        #[test]
        fn bounds_hold_for_every_pixel(
            values in prop::collection::vec(prop_oneof![400 => 1.0f32..9.0, 1 => Just(0.0), 99 => -9.0f32..-1.0], COLUMNS * ROWS),
            turn in prop_oneof![Just(None), Just(Some(COLUMNS)), Just(Some(COLUMNS + 13))],
            at in (-90.0f32..150.0, prop_oneof![2 => 5.0f32..15.0, 1 => -12.0f32..32.0]),
            halves in (prop_oneof![2 => 0.0f32..9.0, 1 => 0.0f32..50.0], prop_oneof![2 => 0.0f32..4.0, 1 => 0.0f32..14.0]),
        ) {
            let mut readings = WindowReadings::default();
            readings.fill(&values[..COLUMNS], COLUMNS, None);
            readings.fill(&values, COLUMNS, turn);
            let span = |at: f32, half: f32| (at - half).floor() as i64..=(at + half).ceil() as i64;
            let (mut exact, mut any) = ([f32::INFINITY, 0.0f32], false);
            for row in span(at.1, halves.1) {
                for column in span(at.0, halves.0) {
                    let column = turn.map_or(column, |turn| column.rem_euclid(turn as i64));
                    let inside = (0..COLUMNS as i64).contains(&column) && (0..ROWS as i64).contains(&row);
                    let value = if inside { values[row as usize * COLUMNS + column as usize].abs() } else { 0.0 };
                    any |= inside;
                    exact = [exact[0].min(value), exact[1].max(value)];
                }
            }
            let found = readings.extremes([at.0, at.1], [halves.0, halves.1]);
            prop_assert_eq!(found.is_some(), any);
            if let Some([nearest, farthest]) = found {
                prop_assert!(nearest <= exact[0] && farthest >= exact[1], "{found:?} {exact:?}");
            }
        }
    }

    #[test]
    fn of_equal_readings_the_bounds_are_these() {
        let mut readings = WindowReadings::default();
        readings.fill(&[3.0; COLUMNS * ROWS], COLUMNS, Some(COLUMNS));
        assert_eq!(readings.extremes([59.0, 9.0], [5.0, 4.0]), Some([3.0, 3.0]));
        assert_eq!(readings.extremes([-0.4, 9.0], [500.0, 4.0]), Some([3.0, 3.0]));
        assert_eq!(readings.extremes([30.0, 1.0], [2.0, 4.0]), Some([0.0, 3.0]));
        readings.fill(&[3.0; COLUMNS * ROWS], COLUMNS, None);
        assert_eq!(readings.extremes([59.0, 9.0], [5.0, 4.0]), Some([0.0, 3.0]));
        assert_eq!(readings.extremes([1e30, 9.0], [5.0, 4.0]), None);
    }
}
