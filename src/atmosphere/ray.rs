//! Rays inside the air, made in `f64`.

use super::probe::ProbeRay;

/// A ray inside the air, as `veduta::atmosphere::ray::AirRay` has it. It starts at the eye, or where it enters when the eye
/// is above the air.
///
/// Its members are rounded to `f32` last. A direction of three `f32` cannot say where a ray from far above the air runs: from
/// 36,000 km its rounding moves the lowest point by up to a metre.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AirRay {
    /// Altitude of the start in m.
    pub altitude: f32,
    /// Zenith cosine at the start.
    pub mu: f32,
    /// Zenith sine at the start.
    pub sine: f32,
    /// Cosine between the ray and the direction to the sun.
    pub nu: f32,
    /// Zenith cosine of the sun at the start.
    pub sun_mu: f32,
    /// Distance from the eye to the start in m.
    pub from_eye: f32,
    /// Distance from the start to the end: the top of the air, the ground sphere or the greatest distance; 0 when the ray
    /// misses the air in m.
    pub length: f32,
    /// Where the ray enters the planet's shadow in m.
    pub dark_from: f32,
    /// Where it leaves the shadow again; the ray is lit throughout when this is not above `dark_from` in m.
    pub dark_to: f32,
    /// 1 when the ray ends on the ground, else 0.
    pub meets_ground: u32,
}

/// The share of a ray that a place inside the air sees; all in `f64`.
struct Inside {
    ground_radius: f64,
    top: f64,
    altitude: f64,
    mu: f64,
    sine: f64,
    /// Parts of the direction to the sun: along the ray, towards the zenith of the ray's lowest point, aside.
    sun: [f64; 3],
}

impl Inside {
    fn ray(&self, from_eye: f64, max_distance: f64) -> AirRay {
        let (ground, top, h, mu) = (self.ground_radius, self.top, self.altitude, self.mu);
        let r = ground + h;
        let along = r * mu;
        let lowest = h - r * mu * mu / (1.0 + self.sine);
        let half_top = ((top - lowest) * (2.0 * ground + top + lowest))
            .max(0.0)
            .sqrt();
        let meets = mu < 0.0 && lowest < 0.0;
        let end = if meets {
            let half_ground = (-lowest * (2.0 * ground + lowest)).max(0.0).sqrt();
            h * (2.0 * ground + h) / (half_ground - along)
        } else if mu < 0.0 {
            half_top - along
        } else if top > h {
            (top - h) * (2.0 * ground + top + h) / (half_top + along)
        } else {
            0.0
        };
        let length = end.min(max_distance).max(0.0);
        let [nu, rise, _] = self.sun;
        let sun_mu = mu * nu + self.sine * rise;
        let dark = self.shadow(lowest, along, length, r * sun_mu);
        AirRay {
            altitude: h as f32,
            mu: mu as f32,
            sine: self.sine as f32,
            nu: nu as f32,
            sun_mu: sun_mu as f32,
            from_eye: from_eye as f32,
            length: length as f32,
            dark_from: dark.0 as f32,
            dark_to: dark.1 as f32,
            meets_ground: u32::from(meets && end <= max_distance),
        }
    }

    /// The stretch in the planet's shadow: the part within the cylinder about the planet, if that lies behind it.
    fn shadow(&self, lowest: f64, along: f64, length: f64, start: f64) -> (f64, f64) {
        let [nu, rise, aside] = self.sun;
        let low = lowest / self.ground_radius;
        let across = rise * rise + aside * aside;
        let square = rise * rise - aside * aside * low * (2.0 + low);
        let (enter, leave) = if across < 1e-28 {
            if lowest >= 0.0 {
                return (length, length);
            }
            (0.0, length)
        } else if square <= 0.0 {
            return (length, length);
        } else {
            let middle = (1.0 + low) * rise * nu;
            let larger = middle + square.sqrt().copysign(middle);
            let product = low * (2.0 + low) - ((1.0 + low) * rise).powi(2);
            let roots = [larger / across, product / larger];
            let at = |root: f64| (root * self.ground_radius - along).clamp(0.0, length);
            (at(roots[0].min(roots[1])), at(roots[0].max(roots[1])))
        };
        if leave > enter && start + 0.5 * (enter + leave) * nu < 0.0 {
            (enter, leave)
        } else {
            (length, length)
        }
    }
}

impl AirRay {
    /// The ray in the air of a planet of radius `ground_radius`, up to the altitude `top`. Directions are unit vectors in
    /// `f64`; an altitude below 0 counts as 0. A ray that misses the air has length 0.
    pub fn new(ground_radius: f64, top: f64, ray: &ProbeRay) -> AirRay {
        let h = ray.altitude.max(0.0);
        let (d, s) = (ray.dir, ray.to_sun);
        let horizontal = d[0].hypot(d[2]);
        // Of the two parts the smaller has the finer digits.
        let (mu, sine) = if d[1] * d[1] < 0.5 {
            (d[1], ((1.0 - d[1]) * (1.0 + d[1])).sqrt())
        } else {
            let cosine = ((1.0 - horizontal) * (1.0 + horizontal)).max(0.0).sqrt();
            (cosine.copysign(d[1]), horizontal.min(1.0))
        };
        let forward = if horizontal > 0.0 {
            [d[0] / horizontal, d[2] / horizontal]
        } else {
            [1.0, 0.0]
        };
        let ahead = forward[0] * s[0] + forward[1] * s[2];
        let aside = forward[0] * s[2] - forward[1] * s[0];
        let sun = [
            (mu * s[1] + sine * ahead).clamp(-1.0, 1.0),
            sine * s[1] - mu * ahead,
            aside,
        ];
        let inside = Inside {
            ground_radius,
            top,
            altitude: h,
            mu,
            sine,
            sun,
        };
        if h <= top {
            return inside.ray(0.0, ray.distance);
        }
        let r = ground_radius + h;
        let lowest = if mu * mu < 0.5 {
            h - r * mu * mu / (1.0 + sine)
        } else {
            r * sine - ground_radius
        };
        if mu >= 0.0 || lowest >= top {
            return AirRay {
                altitude: top as f32,
                mu: mu as f32,
                sine: sine as f32,
                nu: sun[0] as f32,
                sun_mu: s[1] as f32,
                ..AirRay::default()
            };
        }
        let half_top = ((top - lowest) * (2.0 * ground_radius + top + lowest)).sqrt();
        let from_eye = (h - top) * (2.0 * ground_radius + h + top) / (half_top - r * mu);
        Inside {
            altitude: top,
            mu: -(half_top / (ground_radius + top)).min(1.0),
            sine: (sine * r / (ground_radius + top)).min(1.0),
            ..inside
        }
        .ray(from_eye, ray.distance - from_eye)
    }

    /// The bytes of the structure in a storage buffer.
    pub fn bytes(&self) -> [u8; AirRay::SIZE] {
        let words = [
            self.altitude.to_bits(),
            self.mu.to_bits(),
            self.sine.to_bits(),
            self.nu.to_bits(),
            self.sun_mu.to_bits(),
            self.from_eye.to_bits(),
            self.length.to_bits(),
            self.dark_from.to_bits(),
            self.dark_to.to_bits(),
            self.meets_ground,
        ];
        let mut bytes = [0; AirRay::SIZE];
        for (to, word) in bytes.chunks_exact_mut(4).zip(words) {
            to.copy_from_slice(&word.to_le_bytes());
        }
        bytes
    }

    /// Size of the structure in bytes.
    pub const SIZE: usize = 40;
}
