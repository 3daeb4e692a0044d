//! A quadrature on [0, 1] that is dense where it begins, for what changes fastest there.
//! source   midpoint rule after a change of variable whose slope vanishes at both ends (Sag1964), squared: ours
//! symbols  t node in (0, 1) · w weight; the weights sum to 1
#define_import_path veduta::math::squared

/// Node and weight number `i` of `count`: midpoints x of equal parts, at t = (x^2 (3 - 2 x))^2. The weights are exact for a constant; for smooth functions
/// the error falls with the fourth power of the count.
///
/// domain  count in [1, 512] 1 log
/// domain  i in [0, count) 1 lin
/// range   [0, 1] 1
/// error   6e-7 abs of reference::quadrature::squared_node
/// outside undefined
/// source  Sag1964; sum of the weights in closed form: ours
fn squared_node(count: i32, i: i32) -> vec2<f32> {
    let n = f32(max(count, 1));
    let x = (f32(i) + 0.5) / n;
    let u = x * x * (3.0 - 2.0 * x);
    let surplus = select(0.0, 0.5 / (n * n), i == count - 1);
    return vec2<f32>(u * u, 12.0 * u * x * (1.0 - x) / n - surplus);
}
