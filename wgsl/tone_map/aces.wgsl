//! Fits to the ACES reference rendering and output transforms for a display of Rec. 709 and 100 cd/m^2.
//!
//! `aces_hill` is Hill's: a matrix into the rendering space, desaturated, one curve a channel, and a matrix back; bright
//! colours turn white. `aces_narkowicz` is Narkowicz's: one curve a channel of Rec. 709, so that bright colours keep their
//! hue at the cost of it. Neither is the transform itself; Narkowicz's is brighter, as if exposed by 1/0.6.
//!
//! Hill's curve is below 0 for greys under 0.0033 and is cut off there.
//!
//! source   Hill2016 ACES fit (BakingLab); Narkowicz2015 ACES filmic tone mapping curve
//! symbols  color linear radiance [1] · exposure sensitivity of the camera, lower is darker [1]
#define_import_path veduta::tone_map::aces

/// The most that a curve is asked for: its square is still a number.
const MOST: f32 = 1e15;

/// Hill's curve, for channels in the rendering space.
///
/// internal
fn hill_curve(v: vec3<f32>) -> vec3<f32> {
    return (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081);
}

/// Display light after Hill's fit, in [0, 1]; negative radiance counts as 0.
///
/// domain  color in [1e-6, 1e6] 1 log
/// domain  exposure in [1e-3, 1e3] 1 log
/// range   [0, 1] 1
/// error   1e-6 abs of reference::tone_map::aces_hill
/// source  Hill2016
fn aces_hill(color: vec3<f32>, exposure: f32) -> vec3<f32> {
    let x = clamp(color * exposure, vec3<f32>(0.0), vec3<f32>(MOST));
    let v = hill_curve(vec3<f32>(
        dot(vec3<f32>(0.59719, 0.35458, 0.04823), x),
        dot(vec3<f32>(0.07600, 0.90834, 0.01566), x),
        dot(vec3<f32>(0.02840, 0.13383, 0.83777), x),
    ));
    let display = vec3<f32>(
        dot(vec3<f32>(1.60475, -0.53108, -0.07367), v),
        dot(vec3<f32>(-0.10208, 1.10813, -0.00605), v),
        dot(vec3<f32>(-0.00327, -0.07276, 1.07602), v),
    );
    return clamp(display, vec3<f32>(0.0), vec3<f32>(1.0));
}

/// Display light after Narkowicz's fit, in [0, 1] per channel; negative radiance counts as 0.
///
/// domain  color in [1e-6, 1e6] 1 log
/// domain  exposure in [1e-3, 1e3] 1 log
/// range   [0, 1] 1
/// error   6e-7 rel of reference::tone_map::aces_narkowicz
/// monotone color
/// source  Narkowicz2015
fn aces_narkowicz(color: vec3<f32>, exposure: f32) -> vec3<f32> {
    let x = clamp(color * exposure, vec3<f32>(0.0), vec3<f32>(MOST));
    let display = (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14);
    return min(display, vec3<f32>(1.0));
}
