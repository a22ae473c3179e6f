//! The factor `L L^T` of a symmetric positive definite matrix of blocks, row by row (the up-looking
//! algorithm, Davis 2006, section 4.7, with blocks for numbers), and the solution with it.

use super::block::{
    Block, cholesky, solve_lower, solve_lower_transposed, subtract_product, subtract_times, transposed,
};
use super::pattern::{Pattern, SymmetricBlocks};

/// A factor and the scratch to make it, reused from one factorization to the next.
pub(crate) struct Cholesky<const B: usize> {
    /// Lower triangles of the diagonal blocks.
    diagonal: Vec<Block<B>>,
    /// Rows of the blocks of each column, ascending.
    rows: Vec<usize>,
    /// The blocks of each column, *transposed*, so that the innermost loop of the product runs over neighbors.
    blocks: Vec<Block<B>>,
    /// How far each column is filled.
    end: Vec<usize>,
    work: Vec<Block<B>>,
    mark: Vec<usize>,
}

impl<const B: usize> Cholesky<B> {
    /// Room for factors over `pattern`.
    pub(crate) fn new(pattern: &Pattern) -> Self {
        let (n, blocks) = (pattern.variables(), pattern.factor_blocks());
        Self {
            diagonal: vec![[[0.0; B]; B]; n],
            rows: vec![0; blocks],
            blocks: vec![[[0.0; B]; B]; blocks],
            end: vec![0; n],
            work: vec![[[0.0; B]; B]; n],
            mark: vec![usize::MAX; n],
        }
    }

    /// Factors `a` with `damping` times its diagonal added to it; `None` where that is not positive definite.
    /// O(sum over columns of the square of their number of blocks).
    pub(crate) fn factor(&mut self, pattern: &Pattern, a: &SymmetricBlocks<B>, damping: f64) -> Option<()> {
        let n = pattern.variables();
        self.end.copy_from_slice(&pattern.column_start[..n]);
        self.mark.fill(usize::MAX);
        self.work.fill([[0.0; B]; B]);
        let (mut reach, mut path) = (Vec::new(), Vec::new());
        for k in 0..n {
            let row = pattern.row_start[k]..pattern.row_start[k + 1];
            for (&column, block) in pattern.columns[row.clone()].iter().zip(&a.lower[row]) {
                self.work[column] = *block;
            }
            let mut diagonal = a.diagonal[k];
            for c in 0..B {
                diagonal[c][c] += damping * diagonal[c][c];
            }
            let before = std::array::from_fn(|c| diagonal[c][c]);
            pattern.reach(k, &mut self.mark, &mut reach, &mut path);
            for &j in &reach {
                let done = pattern.column_start[j]..self.end[j];
                let l_kj = self.work[j].map(|r| solve_lower(&self.diagonal[j], &r));
                self.work[j] = [[0.0; B]; B];
                for (&i, l_ij) in self.rows[done.clone()].iter().zip(&self.blocks[done]) {
                    subtract_product(&mut self.work[i], &l_kj, l_ij);
                }
                let l_jk = transposed(&l_kj);
                subtract_product(&mut diagonal, &l_kj, &l_jk);
                self.rows[self.end[j]] = k;
                self.blocks[self.end[j]] = l_jk;
                self.end[j] += 1;
            }
            self.diagonal[k] = cholesky(&diagonal, &before, 1e-14).ok()?;
        }
        Some(())
    }

    /// `x` with `A x = b`, by variable. O(blocks of the factor).
    pub(crate) fn solve(&self, pattern: &Pattern, b: &[[f64; B]]) -> Vec<[f64; B]> {
        let n = pattern.variables();
        let mut x = vec![[0.0; B]; n];
        for (variable, value) in b.iter().enumerate() {
            x[pattern.position[variable]] = *value;
        }
        for j in 0..n {
            x[j] = solve_lower(&self.diagonal[j], &x[j]);
            let solved = x[j];
            for p in pattern.column_start[j]..pattern.column_start[j + 1] {
                subtract_times(&mut x[self.rows[p]], &transposed(&self.blocks[p]), &solved);
            }
        }
        for j in (0..n).rev() {
            let mut rest = x[j];
            for p in pattern.column_start[j]..pattern.column_start[j + 1] {
                subtract_times(&mut rest, &self.blocks[p], &x[self.rows[p]]);
            }
            x[j] = solve_lower_transposed(&self.diagonal[j], &rest);
        }
        pattern.position.iter().map(|&place| x[place]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Random pairs; diagonally dominant, hence positive definite. The oracle is the product `A x`.
    fn solves<const B: usize>(n: usize, pairs: &[[usize; 2]], seed: &[f64]) {
        let pairs: Vec<_> = pairs.iter().map(|p| p.map(|v| v % n)).filter(|p| p[0] != p[1]).collect();
        let pattern = Pattern::new(n, &pairs);
        let mut a = SymmetricBlocks::<B>::zero(&pattern);
        let mut draw = seed.iter().copied().cycle();
        let mut next = || draw.next().unwrap_or(0.5);
        let x: Vec<[f64; B]> = (0..n).map(|_| std::array::from_fn(|_| next())).collect();
        let mut b = vec![[0.0; B]; n];
        let heavy = 1.0 + (pairs.len() * B) as f64;
        for k in 0..n {
            for c in 0..B {
                a.diagonal_mut(&pattern, k)[c][c] = heavy;
                b[k][c] += heavy * x[k][c];
            }
        }
        for (number, &[r, c]) in pairs.iter().enumerate() {
            let block: Block<B> = std::array::from_fn(|_| std::array::from_fn(|_| next()));
            a.add_pair(&pattern, number, [r, c], &block);
            let mut minus = [0.0; B];
            subtract_times(&mut minus, &block, &x[c]);
            b[r] = std::array::from_fn(|q| b[r][q] - minus[q]);
            minus = [0.0; B];
            subtract_times(&mut minus, &transposed(&block), &x[r]);
            b[c] = std::array::from_fn(|q| b[c][q] - minus[q]);
        }
        let mut factor = Cholesky::new(&pattern);
        for _ in 0..2 {
            factor.factor(&pattern, &a, 0.0).unwrap();
        }
        let found = factor.solve(&pattern, &b);
        for (f, t) in found.iter().flatten().zip(x.iter().flatten()) {
            assert!((f - t).abs() < 1e-9, "{f} {t}");
        }
    }

    proptest! {
        #[test]
        fn solves_random_systems(
            n in 1usize..40,
            pairs in proptest::collection::vec([0usize..40, 0usize..40], 0..120),
            seed in proptest::collection::vec(-1.0..1.0f64, 7..50),
        ) {
            solves::<1>(n, &pairs, &seed);
            solves::<3>(n, &pairs, &seed);
            solves::<6>(n, &pairs, &seed);
        }
    }

    #[test]
    fn refuses_what_is_not_positive_definite() {
        let pattern = Pattern::new(2, &[[0, 1]]);
        let mut a = SymmetricBlocks::<1>::zero(&pattern);
        *a.diagonal_mut(&pattern, 0) = [[1.0]];
        *a.diagonal_mut(&pattern, 1) = [[1.0]];
        a.add_pair(&pattern, 0, [0, 1], &[[1.0]]);
        let mut factor = Cholesky::new(&pattern);
        assert!(factor.factor(&pattern, &a, 0.0).is_none());
        assert!(factor.factor(&pattern, &a, 1e-3).is_some());
    }

    #[test]
    fn nothing_to_solve() {
        let pattern = Pattern::new(0, &[]);
        let mut factor = Cholesky::<3>::new(&pattern);
        assert!(factor.factor(&pattern, &SymmetricBlocks::zero(&pattern), 0.0).is_some());
        assert!(factor.solve(&pattern, &[]).is_empty());
    }
}
