//! What a pass looks for on its lines.

use super::layout::Layout;
use super::min_plus::{Features, Found, LANES, Panels, Row, min_plus, min_plus_boxes, min_plus_features};

/// A search along lines of bricks of type `B`.
pub(crate) trait LineSearch<B, const D: usize>: Sync {
    /// A run of bricks of a line, made ready for the search.
    type Line: Default;
    /// Whether features are carried.
    const FEATURES: bool;
    /// Bricks that are made ready on either side of what is there.
    const MARGIN: i32 = 0;

    /// Makes the line ready for `length` cells, with nothing on it.
    fn clear(&self, line: &mut Self::Line, layout: &Layout, length: usize);

    /// Puts a brick on the line, from row `first` on.
    fn put(&self, line: &mut Self::Line, brick: &B, first: usize, layout: &Layout, length: usize);

    /// Finds the eight rows from `first` on, no further than `reach` rows away, beginning with what is found already.
    fn find(&self, line: &mut Self::Line, length: usize, first: usize, reach: usize, found: &mut Found);
}

/// The values and features of one brick, in the layout of the pass that reads them.
pub(crate) trait Source: Sync {
    /// May be put together in `scratch`.
    fn values<'s>(&'s self, scratch: &'s mut [Vec<f32>; 2]) -> &'s [f32];

    /// Empty where none are carried.
    fn features(&self) -> &[u32] {
        &[]
    }
}

/// A brick of an earlier pass.
#[derive(Clone, Copy)]
pub(crate) struct Planes<'a> {
    pub(crate) values: &'a [f32],
    /// Empty where none are carried.
    pub(crate) features: &'a [u32],
}

impl Source for Planes<'_> {
    fn values<'s>(&'s self, _: &'s mut [Vec<f32>; 2]) -> &'s [f32] {
        self.values
    }

    fn features(&self) -> &[u32] {
        self.features
    }
}

/// A [`LineSearch`] over rows of samples, whatever [`Source`] they are read from.
pub(crate) trait RowSearch: Copy + Sync {
    /// Whether features are carried.
    const FEATURES: bool;
    /// The sample of cells that no brick holds.
    const BLANK: f32;
    /// Whether bricks without a seed differ from such cells.
    const EMPTY_BRICKS: bool = false;
    /// Bricks of such cells on either side of what is there.
    const MARGIN: i32;

    /// The least for the eight rows from `first` on, no further than `reach` rows away.
    fn least(self, rows: Panels<'_>, first: usize, reach: usize, found: &mut Found);
}

/// The least sum of a sample and its squared offset.
#[derive(Clone, Copy)]
pub(crate) struct FromCenters;

/// The same, with the [`super::Feature`] of the least, to which the way along this axis is added.
#[derive(Clone, Copy)]
pub(crate) struct FromFeatures {
    pub(crate) axis: usize,
}

/// The least sum of a sample and its squared offset less half a cell; cells without a brick are samples of 0.
#[derive(Clone, Copy)]
pub(crate) struct FromBoxes;

impl RowSearch for FromCenters {
    const FEATURES: bool = false;
    const BLANK: f32 = f32::INFINITY;
    const MARGIN: i32 = 0;

    fn least(self, rows: Panels<'_>, first: usize, reach: usize, found: &mut Found) {
        min_plus(rows, first, reach, found);
    }
}

impl RowSearch for FromFeatures {
    const FEATURES: bool = true;
    const BLANK: f32 = f32::INFINITY;
    const MARGIN: i32 = 0;

    fn least(self, rows: Panels<'_>, first: usize, reach: usize, found: &mut Found) {
        min_plus_features(rows, first, reach, 10 * self.axis as u32, found);
    }
}

impl RowSearch for FromBoxes {
    const FEATURES: bool = false;
    const BLANK: f32 = 0.0;
    const EMPTY_BRICKS: bool = true;
    const MARGIN: i32 = 1;

    fn least(self, rows: Panels<'_>, first: usize, reach: usize, found: &mut Found) {
        min_plus_boxes(rows, first, reach, found);
    }
}

/// Panels of rows of a run of bricks.
#[derive(Default)]
pub(crate) struct RowLines {
    values: Vec<Row>,
    features: Vec<Features>,
    /// Of a source.
    brick: [Vec<f32>; 2],
}

impl<K: RowSearch, S: Source, const D: usize> LineSearch<S, D> for K {
    type Line = RowLines;
    const FEATURES: bool = K::FEATURES;
    const MARGIN: i32 = K::MARGIN;

    fn clear(&self, line: &mut RowLines, layout: &Layout, length: usize) {
        // Lanes without a line are done at once.
        let blank: Row = std::array::from_fn(|lane| if lane < layout.lines { K::BLANK } else { 0.0 });
        line.values.clear();
        line.values.resize(layout.panels * length, blank);
        line.features.resize(if K::FEATURES { layout.panels * length } else { 0 }, [0; LANES]);
    }

    fn put(&self, line: &mut RowLines, source: &S, first: usize, layout: &Layout, length: usize) {
        let RowLines { values, features, brick } = line;
        layout.spread(source.features(), first, length, features);
        layout.spread(source.values(brick), first, length, values);
    }

    fn find(&self, line: &mut RowLines, length: usize, first: usize, reach: usize, found: &mut Found) {
        let rows = Panels { values: &line.values, features: &line.features, rows: length };
        self.least(rows, first, reach, found);
    }
}
