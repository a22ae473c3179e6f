//! The dense kernels on one block. All loops have constant bounds, rows first, so that the compiler unrolls
//! and vectorizes the innermost one; sums run in a fixed order, so that results are the same bytes everywhere.

/// A dense `B x B` block, rows first.
pub(crate) type Block<const B: usize> = [[f64; B]; B];

/// The transposed block.
#[inline(always)]
pub(crate) fn transposed<const B: usize>(a: &Block<B>) -> Block<B> {
    std::array::from_fn(|r| std::array::from_fn(|c| a[c][r]))
}

/// `x -= a b`.
#[inline(always)]
pub(super) fn subtract_product<const B: usize>(x: &mut Block<B>, a: &Block<B>, b: &Block<B>) {
    for r in 0..B {
        let mut row = x[r];
        for k in 0..B {
            for c in 0..B {
                row[c] -= a[r][k] * b[k][c];
            }
        }
        x[r] = row;
    }
}

/// `x -= a v` for a vector.
#[inline(always)]
pub(super) fn subtract_times<const B: usize>(x: &mut [f64; B], a: &Block<B>, v: &[f64; B]) {
    for r in 0..B {
        for c in 0..B {
            x[r] -= a[r][c] * v[c];
        }
    }
}

/// The lower triangle `L` of `a = L L^T`; the row and the pivot where `a` is not positive definite (a pivot is not above
/// `least` times its diagonal entry, or not finite).
pub(crate) fn cholesky<const B: usize>(
    a: &Block<B>,
    diagonal: &[f64; B],
    least: f64,
) -> Result<Block<B>, (usize, f64)> {
    let mut l = [[0.0; B]; B];
    for c in 0..B {
        let pivot = a[c][c] - (0..c).map(|k| l[c][k] * l[c][k]).sum::<f64>();
        if !(pivot.is_finite() && pivot > least * diagonal[c]) {
            return Err((c, pivot));
        }
        l[c][c] = pivot.sqrt();
        for r in c + 1..B {
            let sum = (0..c).map(|k| l[r][k] * l[c][k]).sum::<f64>();
            l[r][c] = (a[r][c] - sum) / l[c][c];
        }
    }
    Ok(l)
}

/// `y` with `L y = b`.
#[inline(always)]
pub(super) fn solve_lower<const B: usize>(l: &Block<B>, b: &[f64; B]) -> [f64; B] {
    let mut y = *b;
    for r in 0..B {
        for k in 0..r {
            y[r] -= l[r][k] * y[k];
        }
        y[r] /= l[r][r];
    }
    y
}

/// `x` with `L^T x = y`.
#[inline(always)]
pub(super) fn solve_lower_transposed<const B: usize>(l: &Block<B>, y: &[f64; B]) -> [f64; B] {
    let mut x = *y;
    for r in (0..B).rev() {
        for k in r + 1..B {
            x[r] -= l[k][r] * x[k];
        }
        x[r] /= l[r][r];
    }
    x
}
