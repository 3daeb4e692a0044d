//! Attenuation of light in a medium, and the air as the device has it: lanes, of which those not used hold 0.

use super::math::one_minus_exp_over_x;
use crate::atmosphere::{Atmosphere, Lane, MOST_LANES};

/// A number of every lane.
fn of_lanes(air: &Atmosphere, value: impl Fn(&Lane) -> f64) -> [f64; MOST_LANES] {
    let mut numbers = [0.0; MOST_LANES];
    for (number, lane) in numbers.iter_mut().zip(air.lanes()) {
        *number = value(&lane);
    }
    numbers
}

/// Densities of all lanes at an altitude (m).
pub fn air_densities(air: &Atmosphere, h: f64) -> [f64; MOST_LANES] {
    of_lanes(air, |lane| lane.profile.density(h))
}

/// Extinction of amounts, per channel.
pub fn air_extinction(air: &Atmosphere, amounts: [f64; MOST_LANES]) -> [f64; 3] {
    let lanes = air.lanes();
    std::array::from_fn(|c| {
        let pairs = lanes.iter().zip(amounts);
        pairs
            .map(|(lane, amount)| lane.extinction[c] * amount)
            .sum()
    })
}

/// Scattering of amounts, each lane times its weight, per channel.
pub fn air_scattering(
    air: &Atmosphere,
    amounts: [f64; MOST_LANES],
    weights: [f64; MOST_LANES],
) -> [f64; 3] {
    let weighted = std::array::from_fn(|k| amounts[k] * weights[k]);
    let lanes = air.lanes();
    std::array::from_fn(|c| {
        let pairs = lanes.iter().zip::<[f64; MOST_LANES]>(weighted);
        pairs
            .map(|(lane, amount)| lane.scattering[c] * amount)
            .sum()
    })
}

/// Phase functions of all lanes (1/sr).
pub fn air_phases(air: &Atmosphere, nu: f64) -> [f64; MOST_LANES] {
    of_lanes(air, |lane| lane.lobe.map_or(0.0, |lobe| lobe.value(nu)))
}

/// The phase function of the most peaked lane (1/sr); 0 without one.
pub fn peak_phase(air: &Atmosphere, nu: f64) -> f64 {
    air.peak().map_or(0.0, |lobe| lobe.value(nu))
}

/// Transmittance of an optical depth, per channel.
pub fn beer_lambert(optical_depth: [f64; 3]) -> [f64; 3] {
    optical_depth.map(|tau| (-tau).exp())
}

/// Integral of the transmittance over a step of constant extinction (m).
pub fn step_integral(extinction: f64, distance: f64) -> f64 {
    distance * one_minus_exp_over_x(extinction * distance)
}
