//! Nodes and weights of Gauss's quadrature on [0, 1].
//! source   Abramowitz1964 table 25.4
//! symbols  u node · w weight; the weights of one rule sum to 1
#define_import_path veduta::math::gauss

const FOUR: array<vec2<f32>, 4> = array<vec2<f32>, 4>(
    vec2<f32>(0.069431844, 0.173927423), vec2<f32>(0.330009478, 0.326072577),
    vec2<f32>(0.669990522, 0.326072577), vec2<f32>(0.930568156, 0.173927423),
);

const FIVE: array<vec2<f32>, 5> = array<vec2<f32>, 5>(
    vec2<f32>(0.046910077, 0.118463443), vec2<f32>(0.230765345, 0.239314335), vec2<f32>(0.5, 0.284444444),
    vec2<f32>(0.769234655, 0.239314335), vec2<f32>(0.953089923, 0.118463443),
);

/// Node and weight number `i` of the rule with four points; exact for polynomials up to degree 7.
///
/// domain  i in [0, 3] 1 lin
/// range   [0, 1] 1
/// error   6e-8 abs of reference::quadrature::gauss_four
/// source  Abramowitz1964 table 25.4
fn gauss_four(i: i32) -> vec2<f32> {
    var nodes = FOUR;
    return nodes[clamp(i, 0, 3)];
}

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
