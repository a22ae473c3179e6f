//! Where the values and features of bricks are written.

/// Where the values and features of outputs go, brick by brick; `features` is empty where none are carried.
#[derive(Default)]
pub(super) struct PlanesMut<'a> {
    pub(super) values: &'a mut [f32],
    pub(super) features: &'a mut [u32],
}

impl<'a> PlanesMut<'a> {
    /// The planes of the first `cells`, and the rest.
    pub(super) fn split(self, cells: usize) -> (Self, Self) {
        let (values, values_behind) = self.values.split_at_mut(cells);
        let (features, features_behind) = self.features.split_at_mut(cells.min(self.features.len()));
        (Self { values, features }, Self { values: values_behind, features: features_behind })
    }

    /// The planes of brick `n`.
    pub(super) fn brick(&mut self, n: usize, cells: usize) -> PlanesMut<'_> {
        let cells = n * cells..(n + 1) * cells;
        let features = self.features.get_mut(cells.clone()).unwrap_or_default();
        PlanesMut { features, values: &mut self.values[cells] }
    }
}
