//! Phase functions: how much light turns from one direction into another; each integrates to 1 over the sphere.
//! source   Leitner2022 eq. 3.9 to 3.19; denominators rewritten without cancellation
//! symbols  mu cosine between view ray and direction to the light, +1 when looking into the light [1] · g asymmetry [1]
#define_import_path veduta::lighting::phase

const PI: f32 = 3.14159265;

/// The floor under a denominator, so that g = 1 at mu = 1 gives 0 and not a NaN.
const SMALLEST: f32 = 1e-12;

/// 1 + g^2 - 2 g mu as a sum of two non-negative terms.
///
/// internal
fn lobe_denominator(mu: f32, g: f32) -> f32 {
    let strength = abs(g);
    let aligned = select(mu, -mu, g < 0.0);
    return max((1.0 - strength) * (1.0 - strength) + 2.0 * strength * (1.0 - aligned), SMALLEST);
}

/// Isotropic phase function.
///
/// range   [0.07957747, 0.07957748] 1/sr
/// error   1e-8 abs of reference::phase::phase_isotropic
/// source  Leitner2022 eq. 3.9
fn phase_isotropic() -> f32 {
    return 0.25 / PI;
}

/// Rayleigh's phase function, for particles much smaller than the wavelength.
///
/// domain  mu in [-1, 1] 1 lin
/// range   [0.0596, 0.1194] 1/sr
/// error   3e-7 rel of reference::phase::phase_rayleigh
/// source  Leitner2022 eq. 3.17
fn phase_rayleigh(mu: f32) -> f32 {
    return 3.0 / (16.0 * PI) * (1.0 + mu * mu);
}

/// Henyey and Greenstein's phase function; its mean cosine is g.
///
/// domain  mu in [-1, 1] 1 lin
/// domain  g in [-0.99, 0.99] 1 lin
/// range   [0, 1600] 1/sr
/// error   1e-6 rel of reference::phase::phase_henyey_greenstein
/// source  Leitner2022 eq. 3.10; floor 1e-12 under the denominator
fn phase_henyey_greenstein(mu: f32, g: f32) -> f32 {
    let d = lobe_denominator(mu, g);
    return (1.0 - g) * (1.0 + g) / (4.0 * PI * d * sqrt(d));
}

/// Mixture of a forward and a backward Henyey-Greenstein lobe.
///
/// domain  mu in [-1, 1] 1 lin
/// domain  g_forward in [0, 0.99] 1 lin
/// domain  g_backward in [-0.99, 0] 1 lin
/// domain  backward_share in [0, 1] 1 lin
/// range   [0, 1600] 1/sr
/// error   1e-6 rel of reference::phase::phase_double_henyey_greenstein
/// source  Leitner2022 eq. 3.11
fn phase_double_henyey_greenstein(mu: f32, g_forward: f32, g_backward: f32, backward_share: f32) -> f32 {
    return (1.0 - backward_share) * phase_henyey_greenstein(mu, g_forward)
        + backward_share * phase_henyey_greenstein(mu, g_backward);
}

/// Schlick's fit to Henyey-Greenstein without a fractional power; |g| must stay below 0.938, where k reaches 1.
///
/// domain  mu in [-1, 1] 1 lin
/// domain  g in [-0.9, 0.9] 1 lin
/// range   [0, 20] 1/sr
/// error   3e-6 rel of reference::phase::phase_schlick
/// source  Leitner2022 eq. 3.12
fn phase_schlick(mu: f32, g: f32) -> f32 {
    let strength = abs(g);
    let aligned = select(mu, -mu, g < 0.0);
    let k = strength * (1.55 - 0.55 * strength * strength);
    let one_minus_k = (1.0 - strength) * (1.0 - 0.55 * strength - 0.55 * strength * strength);
    let d = one_minus_k + k * (1.0 - aligned);
    return one_minus_k * (1.0 + k) / max(4.0 * PI * d * d, SMALLEST);
}

/// Cornette and Shanks' phase function for aerosols; its mean cosine is larger than g.
///
/// domain  mu in [-1, 1] 1 lin
/// domain  g in [-0.99, 0.99] 1 lin
/// range   [0, 1600] 1/sr
/// error   1e-6 rel of reference::phase::phase_cornette_shanks
/// source  Leitner2022 eq. 3.19
fn phase_cornette_shanks(mu: f32, g: f32) -> f32 {
    let d = lobe_denominator(mu, g);
    return 3.0 / (8.0 * PI) * ((1.0 - g) * (1.0 + g)) * (1.0 + mu * mu) / ((2.0 + g * g) * d * sqrt(d));
}
