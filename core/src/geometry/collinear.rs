//! Are three corners on one line? Exactly.

/// Exactly collinear (or coincident) corners. Nearly all triangles are told apart by their normal in f32: with differences and
/// products rounded to 2⁻²⁴ each, its error is below 2⁻²¹ of the product of the two sides. What over- or underflows does not pass and
/// is decided exactly. (Written without arrays, which would be stored and loaded again in other widths.)
#[inline]
pub(crate) fn is_collinear(a: &[f32; 3], b: &[f32; 3], c: &[f32; 3]) -> bool {
    let (ux, uy, uz) = (b[0] - a[0], b[1] - a[1], b[2] - a[2]);
    let (vx, vy, vz) = (c[0] - a[0], c[1] - a[1], c[2] - a[2]);
    let (nx, ny, nz) = (uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx);
    let bound = (ux * ux + uy * uy + uz * uz) * (vx * vx + vy * vy + vz * vz) * 1e-12;
    !(nx * nx + ny * ny + nz * nz > bound && bound > f32::MIN_POSITIVE) && is_collinear_exact(a, b, c)
}

#[cold]
fn is_collinear_exact(a: &[f32; 3], b: &[f32; 3], c: &[f32; 3]) -> bool {
    [[0, 1], [1, 2], [2, 0]].iter().all(|[x, y]| {
        let p = |v: &[f32; 3]| robust::Coord { x: f64::from(v[*x]), y: f64::from(v[*y]) };
        robust::orient2d(p(a), p(b), p(c)) == 0.0
    })
}
