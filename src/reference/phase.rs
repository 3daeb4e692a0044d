//! Phase functions; `mu` is the cosine between the view ray and the direction to the light. All in 1/sr.

use std::f64::consts::PI;

/// Isotropic.
pub fn phase_isotropic() -> f64 {
    1.0 / (4.0 * PI)
}

/// Rayleigh.
pub fn phase_rayleigh(mu: f64) -> f64 {
    3.0 / (16.0 * PI) * (1.0 + mu * mu)
}

/// Henyey and Greenstein.
pub fn phase_henyey_greenstein(mu: f64, g: f64) -> f64 {
    (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * mu).powf(1.5))
}

/// A forward and a backward lobe of Henyey and Greenstein.
pub fn phase_double_henyey_greenstein(
    mu: f64,
    g_forward: f64,
    g_backward: f64,
    backward_share: f64,
) -> f64 {
    (1.0 - backward_share) * phase_henyey_greenstein(mu, g_forward)
        + backward_share * phase_henyey_greenstein(mu, g_backward)
}

/// Schlick's fit to Henyey and Greenstein.
pub fn phase_schlick(mu: f64, g: f64) -> f64 {
    let k = 1.55 * g - 0.55 * g * g * g;
    (1.0 - k * k) / (4.0 * PI * (1.0 - k * mu).powi(2))
}

/// Cornette and Shanks.
pub fn phase_cornette_shanks(mu: f64, g: f64) -> f64 {
    3.0 / (8.0 * PI) * (1.0 - g * g) * (1.0 + mu * mu)
        / ((2.0 + g * g) * (1.0 + g * g - 2.0 * g * mu).powf(1.5))
}

/// Draine.
pub fn phase_draine(mu: f64, g: f64, alpha: f64) -> f64 {
    phase_henyey_greenstein(mu, g) * (1.0 + alpha * mu * mu)
        / (1.0 + alpha * (1.0 + 2.0 * g * g) / 3.0)
}

/// The lobes of water droplets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DropletPhase {
    /// 1 - g of Henyey and Greenstein's lobe.
    pub sharp_gap: f64,
    /// 1 - g of Draine's lobe.
    pub broad_gap: f64,
    /// Draine's alpha.
    pub alpha: f64,
    /// Share of Draine's lobe.
    pub broad_share: f64,
}

/// The lobes of droplets of a diameter in metres.
pub fn droplet_phase(diameter: f64) -> DropletPhase {
    let d = (diameter * 1e6).clamp(5.0, 50.0);
    DropletPhase {
        sharp_gap: 1.0 - (-0.0990567 / (d - 1.67154)).exp(),
        broad_gap: 1.0 - (-2.20679 / (d + 3.91029) - 0.428934).exp(),
        alpha: (3.62489 - 8.29288 / (d + 5.52825)).exp(),
        broad_share: (-0.599085 / (d - 0.641583) - 0.665888).exp(),
    }
}

/// Water droplets of the given lobes.
pub fn phase_droplets(mu: f64, lobes: DropletPhase) -> f64 {
    (1.0 - lobes.broad_share) * phase_henyey_greenstein(mu, 1.0 - lobes.sharp_gap)
        + lobes.broad_share * phase_draine(mu, 1.0 - lobes.broad_gap, lobes.alpha)
}

/// Water droplets of a diameter in metres.
pub fn phase_henyey_greenstein_draine(mu: f64, diameter: f64) -> f64 {
    phase_droplets(mu, droplet_phase(diameter))
}
