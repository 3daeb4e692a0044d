//! What a new ground is given over its field: shapes and smoothing.
//! source   weather digest 10.2 (names and behaviour); forms: ours
//! symbols  share of the relief [1]
#define_import_path veduta::ground::shape

/// A smooth bump of height 1 that ends at 1.
///
/// domain  r in [-2, 2] 1 lin
/// range   [0, 1] 1
/// error   1e-6 abs of reference::ground::bump
/// source  ours
fn bump(r: f32) -> f32 {
    let t = clamp(1.0 - abs(r), 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

/// Share of the relief of a plain that falls by half of it along x, with a winding river bed, half of it deep, at a place of the unit square.
///
/// domain  x in [0, 1] 1 lin
/// domain  z in [0, 1] 1 lin
/// range   [-1, 0] 1
/// error   1e-5 abs of reference::ground::bed_share
/// source  ours
fn bed_share(x: f32, z: f32) -> f32 {
    let middle = 0.2 * sin(12.566371 * x);
    return -0.5 * x - 0.5 * bump(((2.0 * z - 1.0) - middle) * 10.0);
}

/// A height smoothed: the mean of itself, its neighbours at the sides and those at the corners, weighted by 4, 2 and 1.
///
/// domain  height in [-1e4, 1e4] m lin
/// domain  sides in [-1e4, 1e4] m lin
/// domain  corners in [-1e4, 1e4] m lin
/// range   [-1.001e4, 1.001e4] m
/// error   4e-3 abs of reference::ground::smoothed_height
/// source  ours
fn smoothed_height(height: f32, sides: vec4<f32>, corners: vec4<f32>) -> f32 {
    let side = (sides.x + sides.y) + (sides.z + sides.w);
    let corner = (corners.x + corners.y) + (corners.z + corners.w);
    return (4.0 * height + 2.0 * side + corner) * 0.0625;
}
