//! Where the blocks are: the elimination order, the places of the given pairs, and how the factor fills in.

use super::block::{Block, transposed};

/// The pattern of a symmetric matrix over `variables` unknowns in elimination order, and of its factor
/// (Davis 2006, section 4). It does not depend on the block size.
pub(crate) struct Pattern {
    /// Place of each variable in the elimination order.
    pub(super) position: Vec<usize>,
    /// Row `k` of the lower triangle holds `columns[row_start[k]..row_start[k + 1]]`, ascending, diagonal apart.
    pub(super) row_start: Vec<usize>,
    pub(super) columns: Vec<usize>,
    /// The elimination tree; a root is its own parent.
    pub(super) parent: Vec<usize>,
    /// Column `j` of the factor holds `column_start[j]..column_start[j + 1]`, diagonal apart.
    pub(super) column_start: Vec<usize>,
    /// For each given pair, its place in `columns`.
    slot: Vec<usize>,
}

impl Pattern {
    /// The pattern of a matrix with the given off-diagonal `pairs` (any order, repeats allowed, never a
    /// variable with itself). O(factor).
    pub(crate) fn new(variables: usize, pairs: &[[usize; 2]]) -> Self {
        let position = minimum_degree(variables, pairs);
        let entries: Vec<[usize; 2]> = pairs
            .iter()
            .map(|&[a, b]| {
                let (p, q) = (position[a], position[b]);
                [p.max(q), p.min(q)]
            })
            .collect();
        let mut sorted = entries.clone();
        sorted.sort_unstable();
        sorted.dedup();
        let mut row_start = vec![0; variables + 1];
        for entry in &sorted {
            row_start[entry[0] + 1] += 1;
        }
        for k in 0..variables {
            row_start[k + 1] += row_start[k];
        }
        let slot = entries.iter().map(|entry| sorted.partition_point(|e| e < entry)).collect();
        let columns: Vec<usize> = sorted.iter().map(|entry| entry[1]).collect();
        let parent = elimination_tree(&row_start, &columns);
        let mut pattern = Self { position, row_start, columns, parent, column_start: Vec::new(), slot };
        pattern.column_start = pattern.count_columns();
        pattern
    }

    /// Number of unknowns.
    pub(crate) fn variables(&self) -> usize {
        self.position.len()
    }

    /// Off-diagonal blocks of the factor.
    pub(crate) fn factor_blocks(&self) -> usize {
        self.column_start.last().copied().unwrap_or(0)
    }

    /// The columns of row `k` of the factor, in an order in which each comes after those it depends on.
    /// `mark` must hold no `k` before; `reach` is overwritten.
    pub(super) fn reach(&self, k: usize, mark: &mut [usize], reach: &mut Vec<usize>, path: &mut Vec<usize>) {
        reach.clear();
        mark[k] = k;
        // Paths up the tree are found from the leaves; later ones end in earlier ones, so they go in front.
        for &column in self.columns[self.row_start[k]..self.row_start[k + 1]].iter().rev() {
            path.clear();
            let mut j = column;
            while mark[j] != k {
                mark[j] = k;
                path.push(j);
                j = self.parent[j];
            }
            reach.extend(path.iter().rev());
        }
        reach.reverse();
    }

    fn count_columns(&self) -> Vec<usize> {
        let n = self.variables();
        let mut start = vec![0; n + 1];
        let (mut mark, mut reach, mut path) = (vec![usize::MAX; n], Vec::new(), Vec::new());
        for k in 0..n {
            self.reach(k, &mut mark, &mut reach, &mut path);
            for &j in &reach {
                start[j + 1] += 1;
            }
        }
        for j in 0..n {
            start[j + 1] += start[j];
        }
        start
    }
}

/// A symmetric matrix of blocks over a [`Pattern`]: the diagonal and the lower triangle.
pub(crate) struct SymmetricBlocks<const B: usize> {
    pub(super) diagonal: Vec<Block<B>>,
    pub(super) lower: Vec<Block<B>>,
}

impl<const B: usize> SymmetricBlocks<B> {
    /// All zero.
    pub(crate) fn zero(pattern: &Pattern) -> Self {
        Self {
            diagonal: vec![[[0.0; B]; B]; pattern.variables()],
            lower: vec![[[0.0; B]; B]; pattern.columns.len()],
        }
    }

    /// Back to zero.
    pub(crate) fn clear(&mut self) {
        self.diagonal.fill([[0.0; B]; B]);
        self.lower.fill([[0.0; B]; B]);
    }

    /// The diagonal block of a variable.
    pub(crate) fn diagonal_mut(&mut self, pattern: &Pattern, variable: usize) -> &mut Block<B> {
        &mut self.diagonal[pattern.position[variable]]
    }

    /// The diagonal entries of a variable's block.
    pub(crate) fn diagonal_of(&self, pattern: &Pattern, variable: usize) -> [f64; B] {
        let block = &self.diagonal[pattern.position[variable]];
        std::array::from_fn(|k| block[k][k])
    }

    /// Adds `block`, which stands in row `a` and column `b` of the pair number `pair`, `[a, b]`.
    pub(crate) fn add_pair(&mut self, pattern: &Pattern, pair: usize, [a, b]: [usize; 2], block: &Block<B>) {
        let below = pattern.position[a] > pattern.position[b];
        let block = if below { *block } else { transposed(block) };
        let target = &mut self.lower[pattern.slot[pair]];
        for r in 0..B {
            for c in 0..B {
                target[r][c] += block[r][c];
            }
        }
    }
}

/// An approximate minimum degree order (Amestoy, Davis & Duff 1996): the place of each variable. Where the crate
/// returns an error the given order is kept, which is slower but correct.
fn minimum_degree(variables: usize, pairs: &[[usize; 2]]) -> Vec<usize> {
    let mut entries: Vec<[usize; 2]> = pairs.iter().flat_map(|&[a, b]| [[a, b], [b, a]]).collect();
    entries.extend((0..variables).map(|k| [k, k]));
    entries.sort_unstable();
    entries.dedup();
    let natural = || (0..variables).collect();
    if i32::try_from(2 * entries.len() + variables).is_err() {
        return natural();
    }
    let mut start = vec![0i32; variables + 1];
    for entry in &entries {
        start[entry[0] + 1] += 1;
    }
    for k in 0..variables {
        start[k + 1] += start[k];
    }
    let rows: Vec<i32> = entries.iter().map(|entry| entry[1] as i32).collect();
    let Ok((order, _, _)) = amd::order(variables as i32, &start, &rows, &amd::Control::default()) else {
        return natural();
    };
    let mut position = vec![usize::MAX; variables];
    for (place, &variable) in order.iter().enumerate() {
        match usize::try_from(variable).ok().and_then(|v| position.get_mut(v)) {
            Some(p) if *p == usize::MAX => *p = place,
            _ => return natural(),
        }
    }
    if order.len() == variables { position } else { natural() }
}

/// The parent of each column in the elimination tree (Liu 1986), with path compression.
fn elimination_tree(row_start: &[usize], columns: &[usize]) -> Vec<usize> {
    let n = row_start.len() - 1;
    let mut parent: Vec<usize> = (0..n).collect();
    let mut ancestor: Vec<usize> = (0..n).collect();
    for k in 0..n {
        for &column in &columns[row_start[k]..row_start[k + 1]] {
            let mut j = column;
            while ancestor[j] != k {
                let next = ancestor[j];
                ancestor[j] = k;
                if next == j {
                    parent[j] = k;
                    break;
                }
                j = next;
            }
        }
    }
    parent
}
