//! Light that one step of a march through a cloud adds.
//! source   Hillaire2015 (energy-conserving step); light that changes along the step: ours
//! symbols  depth optical depth of the step [1] · near, far depth towards the light at its ends [1]
#define_import_path veduta::clouds::integral

#import veduta::math::series::{one_minus_exp_over_x}

/// Share of the light that a step of even extinction scatters towards its start, for an albedo and a phase function of 1, where
/// the depth towards the light changes evenly from `near` to `far`: exact however thick the step is.
///
/// domain  depth in [1e-6, 1e4] 1 log
/// domain  near in [0, 60] 1 lin
/// domain  far in [0, 60] 1 lin
/// range   [0, 1.0001e4] 1
/// error   2e-5 rel of reference::clouds::step_light
/// outside undefined
/// source  integral of depth exp(-depth s - near - (far - near) s) over s from 0 to 1
fn step_light(depth: f32, near: f32, far: f32) -> f32 {
    let end = depth + far;
    return depth * exp(-min(near, end)) * one_minus_exp_over_x(abs(end - near));
}

/// Mean of a step's density that changes evenly from `here` to `next`, where what is below 0 is no cloud.
///
/// domain  here in [-10, 1] 1 lin
/// domain  next in [-10, 1] 1 lin
/// range   [0, 1] 1
/// error   1e-6 abs of reference::clouds::mean_density
/// outside undefined
/// source  elementary
fn mean_density(here: f32, next: f32) -> f32 {
    let full = max(here, 0.0) + max(next, 0.0);
    return 0.5 * full * full / max(abs(here) + abs(next), 1e-9);
}
