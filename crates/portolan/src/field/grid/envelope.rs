//! The lower envelope of parabolas along one line.

/// Scratch of [`lower_envelope`], kept from line to line.
#[derive(Clone, Debug, Default)]
pub(super) struct Envelope {
    /// Roots of the parabolas on the envelope.
    root: Vec<u32>,
    /// `f(p) + p^2` of each.
    height: Vec<f64>,
    /// Where each begins to be the lowest.
    start: Vec<f64>,
}

/// Replaces `f(q)` by `min over p of (q - p)^2 + f(p)` (Felzenszwalb & Huttenlocher 2012, section 2.1).
/// Theta(n).
///
/// Infinite samples carry no parabola and are skipped, where the textbook gives them a large number: a line
/// without a finite sample stays infinite, and no obstacle is ever reported at the distance of the number.
pub(super) fn lower_envelope(f: &mut [f64], scratch: &mut Envelope) {
    let Envelope { root, height, start } = scratch;
    root.clear();
    height.clear();
    start.clear();
    for (q, &value) in f.iter().enumerate() {
        if value == f64::INFINITY {
            continue;
        }
        let x = q as f64;
        let h = value + x * x;
        let mut from = f64::NEG_INFINITY;
        while let (Some(&p), Some(&hp), Some(&begins)) = (root.last(), height.last(), start.last()) {
            from = (h - hp) / (2.0 * (x - f64::from(p)));
            if from > begins {
                break;
            }
            // The new parabola hides the last one before that one begins.
            root.pop();
            height.pop();
            start.pop();
            from = f64::NEG_INFINITY;
        }
        root.push(q as u32);
        height.push(h);
        start.push(from);
    }
    if root.is_empty() {
        return;
    }
    start.push(f64::INFINITY);
    let mut q = 0usize;
    for k in 0..root.len() {
        let end = start[k + 1];
        let (p, h) = (f64::from(root[k]), height[k]);
        let base = h - p * p; // f(p); written so because f is overwritten from the left
        while q < f.len() && (q as f64) <= end {
            let d = q as f64 - p;
            f[q] = d * d + base;
            q += 1;
        }
    }
}
