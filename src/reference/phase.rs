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
