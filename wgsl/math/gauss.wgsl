//! Nodes and weights of Gauss's quadrature on [0, 1].
//! source   Abramowitz1964 table 25.4
//! symbols  u node · w weight; the weights of one rule sum to 1
#define_import_path veduta::math::gauss

const FIVE: array<vec2<f32>, 5> = array<vec2<f32>, 5>(
    vec2<f32>(0.046910077, 0.118463443), vec2<f32>(0.230765345, 0.239314335), vec2<f32>(0.5, 0.284444444),
    vec2<f32>(0.769234655, 0.239314335), vec2<f32>(0.953089923, 0.118463443),
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
