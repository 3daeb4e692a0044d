//! A polynomial through four values at equal distances.
//! source   Lagrange's interpolation
//! symbols  x place among the values, whose places are 0, 1, 2 and 3 [1]
#define_import_path veduta::math::cubic

/// Weights of four values for the place `x` among them; of the two nearest where there are `few`.
///
/// domain  x in [0, 3] 1 lin
/// range   [-0.5, 1.1] 1
/// error   1e-6 abs of reference::math::cubic_weights
/// outside undefined
/// source  Lagrange1795
fn cubic_weights(x: f32, few: bool) -> vec4<f32> {
    let a = x - 1.0;
    let b = x - 2.0;
    let c = x - 3.0;
    let line = max(1.0 - abs(vec4<f32>(x, a, b, c)), vec4<f32>(0.0));
    return select(vec4<f32>(a * b * c * -0.16666667, x * b * c * 0.5, x * a * c * -0.5, x * a * b * 0.16666667), line, few);
}
