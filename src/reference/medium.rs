//! Attenuation of light in a medium.

use super::math::one_minus_exp_over_x;

/// Transmittance of an optical depth, per channel.
pub fn beer_lambert(optical_depth: [f64; 3]) -> [f64; 3] {
    optical_depth.map(|tau| (-tau).exp())
}

/// Integral of the transmittance over a step of constant extinction (m).
pub fn step_integral(extinction: f64, distance: f64) -> f64 {
    distance * one_minus_exp_over_x(extinction * distance)
}
