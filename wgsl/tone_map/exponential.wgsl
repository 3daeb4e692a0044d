//! The exponential tone map, like film that saturates.
//! source   Leitner2022 ch. 5.6
//! symbols  color linear radiance [1] · exposure sensitivity of the camera, lower is darker [1]
#define_import_path veduta::tone_map::exponential

#import veduta::math::series::{one_minus_exp}

/// The largest number below 1: very bright colours round to it, so that the result never reaches 1.
const BELOW_ONE: f32 = 0.99999994;

/// Display light 1 - exp(-exposure color), in [0, 1) per channel; negative radiance counts as 0.
///
/// domain  color in [1e-6, 1e6] 1 log
/// domain  exposure in [1e-3, 1e3] 1 log
/// range   [0, 0.99999994] 1
/// error   6e-7 rel of reference::tone_map::exponential
/// monotone color
/// source  Leitner2022 ch. 5.6
fn exponential(color: vec3<f32>, exposure: f32) -> vec3<f32> {
    let x = clamp(color * exposure, vec3<f32>(0.0), vec3<f32>(80.0));
    return min(vec3<f32>(one_minus_exp(x.x), one_minus_exp(x.y), one_minus_exp(x.z)), vec3<f32>(BELOW_ONE));
}
