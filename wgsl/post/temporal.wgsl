//! Parts of temporal anti-aliasing: how much a sample tells of a pixel, how a history is read between its pixels, and how far it may differ from what is seen now.
//! source   Yang2009, Karis2014, Salvi2016 (box of moments), Keys1981 (cubic convolution)
//! symbols  x distance in pixels, or the share between two of them [1]
#define_import_path veduta::post::temporal

/// Weights of four neighbours in a row for a place between the second and the third: Keys's cubic with a = -1/2, which keeps quadratics.
///
/// domain  x in [0, 1] 1 lin
/// range   [-0.125, 1] 1
/// error   3e-7 abs of reference::post::catmull_rom
/// outside undefined
/// source  Keys1981, section II
fn catmull_rom(x: f32) -> vec4<f32> {
    let y = 1.0 - x;
    let a = -0.5 * x * y;
    return vec4<f32>(a * y, 1.0 + x * x * (1.5 * x - 2.5), 1.0 + y * y * (1.5 * y - 2.5), a * x);
}

/// How much a sample counts for a pixel whose middle is `x` pixels away along one axis: a pixel's square, with edges as wide as a fifth of it.
///
/// domain  x in [-4, 4] 1 lin
/// range   [0, 1] 1
/// error   1e-6 abs of reference::post::pixel_share
/// source  ours
fn pixel_share(x: f32) -> f32 {
    return clamp((0.6 - abs(x)) * 5.0, 0.0, 1.0);
}

/// Factor on a colour's difference from the mean of its neighbours that brings it into a box of `bound` standard deviations a side.
///
/// domain  difference in [-1e4, 1e4] 1 lin
/// domain  deviation in [0, 1e4] 1 lin
/// domain  bound in [0.1, 100] 1 log
/// range   [0, 1] 1
/// error   1e-6 rel of reference::post::box_share
/// outside undefined
/// source  Salvi2016; along the line to the mean as Karis2014 does
fn box_share(difference: vec3<f32>, deviation: vec3<f32>, bound: f32) -> f32 {
    let most = abs(difference) / (bound * deviation + 1e-6);
    return 1.0 / max(1.0, max(most.x, max(most.y, most.z)));
}
