//! Whether two corners of a cube are connected inside it.

/// Whether corner `a` and corner `b`, of one sign, lie in one connected part of the cube where the trilinear
/// interpolant of `d` has that sign.
///
/// A plane across the cube at height z sees a bilinear field with a value `v_i(z)`, linear in z, at each of the four
/// upright edges. Its part of one sign consists of corners joined along sides, and of two diagonal corners joined where
/// their product is the larger one. That changes only where some `v_i` or `v_0 v_3 - v_1 v_2`, a quadratic, is zero: at
/// six heights at most. Between two of them one plane determines the connections, and from one interval to the next parts
/// are connected along every edge that keeps its sign. The result is exact for the interpolant, up to rounding of the
/// heights. (The classical interior test *(Chernyaev 1995)* uses one height only, and is wrong in some cubes
/// *(Custodio et al. 2013)*.)
pub(super) fn connected(d: &[f32; 8], a: u8, b: u8) -> bool {
    let sign = if d[a as usize] < 0.0 { -1.0 } else { 1.0 };
    let low: [f64; 4] = std::array::from_fn(|i| sign * f64::from(d[i]));
    let slope: [f64; 4] = std::array::from_fn(|i| sign * f64::from(d[i + 4]) - low[i]);
    let mut heights = [0.0, 1.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0];
    for i in 0..4 {
        heights[2 + i] = -low[i] / slope[i];
    }
    let square = slope[0] * slope[3] - slope[1] * slope[2];
    let linear = low[0] * slope[3] + low[3] * slope[0] - low[1] * slope[2] - low[2] * slope[1];
    let constant = low[0] * low[3] - low[1] * low[2];
    [heights[6], heights[7]] = roots(square, linear, constant);
    // Heights outside 0 to 1, NaN and infinity included, are discarded.
    heights.iter_mut().filter(|z| !(**z >= 0.0 && **z <= 1.0)).for_each(|z| *z = 2.0);
    heights.sort_unstable_by(f64::total_cmp);

    // Node 4 k + i: edge i in interval k.
    let mut parts: [u8; 28] = std::array::from_fn(|n| n as u8);
    let mut unite = |m: usize, n: usize| {
        let (low, high) = (parts[m].min(parts[n]), parts[m].max(parts[n]));
        parts.iter_mut().filter(|p| **p == high).for_each(|p| *p = low);
    };
    let mut before = [false; 4];
    let (mut k, mut last) = (0, 0);
    for pair in heights.windows(2).filter(|p| p[0] < p[1] && p[1] <= 1.0) {
        let z = 0.5 * (pair[0] + pair[1]);
        let v: [f64; 4] = std::array::from_fn(|i| low[i] + slope[i] * z);
        let has = v.map(|v| v > 0.0);
        for (i, j) in [(0, 1), (1, 3), (3, 2), (2, 0)] {
            if has[i] && has[j] {
                unite(4 * k + i, 4 * k + j);
            }
        }
        if has[0] && has[3] && v[0] * v[3] > v[1] * v[2] {
            unite(4 * k, 4 * k + 3);
        }
        if has[1] && has[2] && v[1] * v[2] > v[0] * v[3] {
            unite(4 * k + 1, 4 * k + 2);
        }
        for i in 0..4 {
            if k > 0 && has[i] && before[i] {
                unite(4 * k - 4 + i, 4 * k + i);
            }
        }
        before = has;
        last = k;
        k += 1;
    }
    let node = |corner: u8| usize::from(corner & 3) + if corner < 4 { 0 } else { 4 * last };
    parts[node(a)] == parts[node(b)]
}

/// Real roots of `a x² + b x + c`, computed without cancellation; 2 for each missing root.
fn roots(a: f64, b: f64, c: f64) -> [f64; 2] {
    let discriminant = b * b - 4.0 * a * c;
    if !(discriminant >= 0.0) {
        return [2.0; 2];
    }
    let q = -0.5 * (b + discriminant.sqrt().copysign(b));
    [q / a, c / q]
}
