//! What lights a layer under an air: the sun behind it, the sky above, sky and ground below.

use glam::Vec3;

use super::directions::directions;
use super::{CloudDeck, Orders, ProbePath};
use crate::atmosphere::{Atmosphere, ProbeOptions, ProbeRay, probe};
use crate::device::Gpu;
use crate::error::Error;

/// What lights a layer, for a sun of irradiance 1 at the top of the air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AirLights {
    /// Irradiance of the sun across its rays at the middle of the layer; 0 where the planet hides it.
    pub sun: Vec3,
    /// Mean radiance that comes from above to the layer's upper sphere, without the sun's own.
    pub above: Vec3,
    /// Mean radiance that comes from below to its lower sphere: the air's, and the ground's through it.
    pub below: Vec3,
}

impl AirLights {
    /// The lights of a layer under an air, from the fast tables of the sky. Clouds neither shade the ground nor light the air. Submits and waits.
    ///
    /// # Errors
    /// Those of [`crate::atmosphere::probe()`].
    pub fn find(
        gpu: &Gpu,
        air: &Atmosphere,
        deck: &CloudDeck,
        to_sun: [f64; 3],
    ) -> Result<AirLights, Error> {
        let ray = |altitude: f64, dir: [f64; 3]| ProbeRay {
            altitude,
            dir,
            to_sun,
            distance: f64::INFINITY,
        };
        let middle = deck.bottom + 0.5 * deck.thickness;
        let mut rays = vec![ray(middle, to_sun), ray(0.0, to_sun)];
        let all = directions();
        let half = |up: bool| all.iter().filter(move |d| (d[1] > 0.0) == up).copied();
        rays.extend(half(true).map(|d| ray(deck.bottom + deck.thickness, d)));
        rays.extend(half(true).map(|d| ray(0.0, d)));
        rays.extend(half(false).map(|d| ray(deck.bottom, d)));
        let options = ProbeOptions {
            path: ProbePath::Fast,
            orders: Orders::All,
            ..Default::default()
        };
        let found = probe(gpu, air, &rays, &options)?;
        let count = half(true).count();
        let share = 1.0 / count as f32;
        // The sun behind the air, or behind the planet.
        let lit = |at: usize, altitude: f64| {
            let cosine = deck.planet_radius / (deck.planet_radius + altitude);
            if to_sun[1] > -(1.0 - cosine * cosine).max(0.0).sqrt() {
                Vec3::from(found[at].transmittance)
            } else {
                Vec3::ZERO
            }
        };
        let lights = found.get(2..).unwrap_or_default();
        let (top, rest) = lights.split_at(count.min(lights.len()));
        let (ground, down) = rest.split_at(count.min(rest.len()));
        let above: Vec3 = top.iter().map(|l| share * Vec3::from(l.in_scatter)).sum();
        let sky: Vec3 = ground
            .iter()
            .zip(half(true))
            .map(|(l, d)| std::f32::consts::TAU * share * d[1] as f32 * Vec3::from(l.in_scatter))
            .sum();
        let albedo = Vec3::from(air.ground_albedo.map(|a| a as f32));
        let sent =
            albedo * std::f32::consts::FRAC_1_PI * (lit(1, 0.0) * to_sun[1].max(0.0) as f32 + sky);
        let below = down
            .iter()
            .map(|l| share * (Vec3::from(l.in_scatter) + Vec3::from(l.transmittance) * sent))
            .sum();
        Ok(AirLights {
            sun: lit(0, middle),
            above,
            below,
        })
    }
}
