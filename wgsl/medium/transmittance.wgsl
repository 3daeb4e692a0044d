//! Attenuation of light in an absorbing and scattering medium.
//! source   Jarosz2008 (Beer-Lambert law); exact step integral: elementary
//! symbols  tau optical depth [1] · sigma_t extinction [1/m] · d distance [m]
#define_import_path veduta::medium::transmittance

#import veduta::math::series::{one_minus_exp_over_x}

/// Transmittance of an optical depth, per colour channel.
///
/// domain  optical_depth in [0, 80] 1 lin
/// range   [0, 1] 1
/// error   3e-7 abs of reference::medium::beer_lambert
/// monotone optical_depth
/// outside undefined
/// source  Leitner2022 eq. 3.1
fn beer_lambert(optical_depth: vec3<f32>) -> vec3<f32> {
    return exp(-optical_depth);
}

/// Integral of the transmittance over a step of constant extinction: (1 - exp(-extinction d)) / extinction, d at zero extinction.
///
/// domain  extinction in [1e-9, 10] 1/m log
/// domain  distance in [1e-3, 1e6] m log
/// range   [0, 1e6] m
/// error   6e-7 rel of reference::medium::step_integral
/// monotone distance
/// outside undefined
/// source  Hillaire2015 energy-conserving step; series at small optical depth
fn step_integral(extinction: f32, distance: f32) -> f32 {
    return distance * one_minus_exp_over_x(extinction * distance);
}
