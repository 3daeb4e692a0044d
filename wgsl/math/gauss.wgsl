//! Nodes and weights of Gauss's quadrature on [0, 1].
//! source   Abramowitz1964 table 25.4
//! symbols  u node · w weight; the weights of one rule sum to 1
#define_import_path veduta::math::gauss

const FIVE: array<vec2<f32>, 5> = array<vec2<f32>, 5>(
    vec2<f32>(0.046910077, 0.118463443), vec2<f32>(0.230765345, 0.239314335), vec2<f32>(0.5, 0.284444444),
    vec2<f32>(0.769234655, 0.239314335), vec2<f32>(0.953089923, 0.118463443),
);

const EIGHT: array<vec2<f32>, 8> = array<vec2<f32>, 8>(
    vec2<f32>(0.019855072, 0.050614268), vec2<f32>(0.101666761, 0.111190517),
    vec2<f32>(0.237233795, 0.156853323), vec2<f32>(0.408282679, 0.181341892),
    vec2<f32>(0.591717321, 0.181341892), vec2<f32>(0.762766205, 0.156853323),
    vec2<f32>(0.898333239, 0.111190517), vec2<f32>(0.980144928, 0.050614268),
);

/// Node and weight number `i` of the rule with five points; exact for polynomials up to degree 9.
///
/// domain  i in [0, 4] 1 lin
/// range   [0, 1] 1
/// error   6e-8 abs of reference::quadrature::gauss_five
/// source  Abramowitz1964 table 25.4
fn gauss_five(i: i32) -> vec2<f32> {
    var nodes = FIVE;
    return nodes[clamp(i, 0, 4)];
}

/// Node and weight number `i` of the rule with eight points on each of `panels` equal parts of [0, 1]; `i` runs from 0 to
/// 8 panels - 1.
///
/// domain  panels in [1, 8] 1 lin
/// domain  i in [0, 7] 1 lin
/// range   [0, 1] 1
/// error   6e-8 abs of reference::quadrature::gauss_eight
/// source  Abramowitz1964 table 25.4
fn gauss_eight(panels: i32, i: i32) -> vec2<f32> {
    var nodes = EIGHT;
    let node = nodes[i & 7];
    return vec2<f32>(f32(i >> 3u) + node.x, node.y) / f32(panels);
}
