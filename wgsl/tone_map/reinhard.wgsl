//! Reinhard's tone maps: the simple one, and the extended one with a white point.
//! source   Reinhard2002 eq. 3 and 4, per channel
//! symbols  color linear radiance [1] · exposure sensitivity of the camera, lower is darker [1]
//! symbols  white the exposed radiance that becomes 1 [1]
#define_import_path veduta::tone_map::reinhard

/// The largest number below 1: very bright colours round to it, so that the result never reaches 1.
const BELOW_ONE: f32 = 0.99999994;

/// Display light x / (1 + x) with x = exposure color, in [0, 1) per channel; negative radiance counts as 0, and x stops at 1e30.
///
/// domain  color in [1e-6, 1e6] 1 log
/// domain  exposure in [1e-3, 1e3] 1 log
/// range   [0, 0.99999994] 1
/// error   4e-7 rel of reference::tone_map::reinhard
/// monotone color
/// source  Reinhard2002 eq. 3
fn reinhard(color: vec3<f32>, exposure: f32) -> vec3<f32> {
    let x = clamp(color * exposure, vec3<f32>(0.0), vec3<f32>(1e30));
    return min(x / (1.0 + x), vec3<f32>(BELOW_ONE));
}

/// Display light x (1 + x / white^2) / (1 + x) with x = exposure color, per channel: 1 at `white` and above; negative
/// radiance counts as 0.
///
/// domain  color in [1e-6, 1e6] 1 log
/// domain  exposure in [1e-3, 1e3] 1 log
/// domain  white in [0.5, 1e6] 1 log
/// range   [0, 1] 1
/// error   6e-7 rel of reference::tone_map::reinhard_extended
/// monotone color
/// source  Reinhard2002 eq. 4
fn reinhard_extended(color: vec3<f32>, exposure: f32, white: f32) -> vec3<f32> {
    let x = clamp(color * exposure, vec3<f32>(0.0), vec3<f32>(white));
    return min(x * (1.0 + (x / white) / white) / (1.0 + x), vec3<f32>(1.0));
}
