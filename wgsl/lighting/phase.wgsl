//! Phase functions: how much light turns from one direction into another; each integrates to 1 over the sphere.
//! source   Leitner2022 eq. 3.9 to 3.19; denominators rewritten without cancellation
//! source   Draine2003; JendersieDEon2023 An approximate Mie scattering function for fog and cloud rendering
//! symbols  mu cosine between view ray and direction to the light, +1 when looking into the light [1] · g asymmetry [1]
#define_import_path veduta::lighting::phase

#import veduta::math::series::{one_minus_exp}

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
/// outside undefined
/// source  Leitner2022 eq. 3.17
fn phase_rayleigh(mu: f32) -> f32 {
    return 3.0 / (16.0 * PI) * (1.0 + mu * mu);
}

/// Henyey and Greenstein's phase function; its mean cosine is g.
///
/// domain  mu in [-1, 1] 1 lin
/// domain  g in [-0.999, 0.999] 1 lin
/// range   [0, 1.6e5] 1/sr
/// error   1e-6 rel of reference::phase::phase_henyey_greenstein
/// outside undefined
/// source  Leitner2022 eq. 3.10; floor 1e-12 under the denominator
fn phase_henyey_greenstein(mu: f32, g: f32) -> f32 {
    let d = lobe_denominator(mu, g);
    return (1.0 - g) * (1.0 + g) / (4.0 * PI * d * sqrt(d));
}

/// Mixture of a forward and a backward Henyey-Greenstein lobe.
///
/// domain  mu in [-1, 1] 1 lin
/// domain  g_forward in [0, 0.999] 1 lin
/// domain  g_backward in [-0.999, 0] 1 lin
/// domain  backward_share in [0, 1] 1 lin
/// range   [0, 1.6e5] 1/sr
/// error   1e-6 rel of reference::phase::phase_double_henyey_greenstein
/// outside undefined
/// source  Leitner2022 eq. 3.11
fn phase_double_henyey_greenstein(mu: f32, g_forward: f32, g_backward: f32, backward_share: f32) -> f32 {
    return (1.0 - backward_share) * phase_henyey_greenstein(mu, g_forward)
        + backward_share * phase_henyey_greenstein(mu, g_backward);
}

/// Schlick's fit to Henyey-Greenstein without a fractional power; |g| must stay below 0.938, where k reaches 1.
///
/// domain  mu in [-1, 1] 1 lin
/// domain  g in [-0.9, 0.9] 1 lin
/// range   [0, 27] 1/sr
/// error   3e-6 rel of reference::phase::phase_schlick
/// outside undefined
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
/// domain  g in [-0.999, 0.999] 1 lin
/// range   [0, 1.6e5] 1/sr
/// error   1e-6 rel of reference::phase::phase_cornette_shanks
/// outside undefined
/// source  Leitner2022 eq. 3.19
fn phase_cornette_shanks(mu: f32, g: f32) -> f32 {
    let d = lobe_denominator(mu, g);
    return 3.0 / (8.0 * PI) * ((1.0 - g) * (1.0 + g)) * (1.0 + mu * mu) / ((2.0 + g * g) * d * sqrt(d));
}

/// Draine's phase function: `alpha` 0 is Henyey and Greenstein's, 1 Cornette and Shanks'.
///
/// domain  mu in [-1, 1] 1 lin
/// domain  g in [-0.999, 0.999] 1 lin
/// domain  alpha in [0, 100] 1 lin
/// range   [0, 1.6e5] 1/sr
/// error   1e-6 rel of reference::phase::phase_draine
/// outside undefined
/// source  Draine2003
fn phase_draine(mu: f32, g: f32, alpha: f32) -> f32 {
    let tilt = (1.0 + alpha * mu * mu) / (1.0 + alpha * ((1.0 + 2.0 * g * g) / 3.0));
    return tilt * phase_henyey_greenstein(mu, g);
}

/// What the light that water droplets of one size scatter looks like: a lobe of Henyey and Greenstein's and one of
/// Draine's. Their asymmetries are so near to 1 that they are kept as what is missing to it.
struct DropletPhase {
    /// 1 - g of Henyey and Greenstein's lobe [1].
    sharp_gap: f32,
    /// 1 - g of Draine's lobe [1].
    broad_gap: f32,
    /// Draine's alpha [1].
    alpha: f32,
    /// Share of Draine's lobe [1].
    broad_share: f32,
}

/// The lobes of the droplets of fog and clouds of a diameter, a fit to Mie's theory. Outside its domain the diameter is
/// held at the ends.
///
/// domain  diameter in [5e-6, 5e-5] m log
/// range   [0, 40] 1
/// error   1e-6 rel of reference::phase::droplet_phase
/// source  JendersieDEon2023, 5 to 50 micrometres
fn droplet_phase(diameter: f32) -> DropletPhase {
    let d = clamp(diameter * 1e6, 5.0, 50.0);
    return DropletPhase(
        one_minus_exp(0.0990567 / (d - 1.67154)),
        one_minus_exp(2.20679 / (d + 3.91029) + 0.428934),
        exp(3.62489 - 8.29288 / (d + 5.52825)),
        exp(-0.599085 / (d - 0.641583) - 0.665888),
    );
}

/// Henyey and Greenstein's phase function of 1 - g, for g from 0 to 1.
///
/// internal
fn phase_of_gap(mu: f32, gap: f32) -> f32 {
    let d = max(gap * gap + 2.0 * (1.0 - gap) * (1.0 - mu), SMALLEST);
    return gap * (2.0 - gap) / (4.0 * PI * d * sqrt(d));
}

/// Phase function of water droplets; `droplet_phase` makes the lobes, once for all directions.
///
/// domain  mu in [-1, 1] 1 lin
/// domain  lobes.sharp_gap in [0.002, 0.03] 1 log
/// domain  lobes.broad_gap in [0.3, 0.5] 1 lin
/// domain  lobes.alpha in [15, 40] 1 lin
/// domain  lobes.broad_share in [0, 1] 1 lin
/// range   [0, 40000] 1/sr
/// error   1.2e-6 rel of reference::phase::phase_droplets
/// outside undefined
/// source  JendersieDEon2023
fn phase_droplets(mu: f32, lobes: DropletPhase) -> f32 {
    let g = 1.0 - lobes.broad_gap;
    let tilt = (1.0 + lobes.alpha * mu * mu) / (1.0 + lobes.alpha * ((1.0 + 2.0 * g * g) / 3.0));
    let broad = tilt * phase_of_gap(mu, lobes.broad_gap);
    let sharp = phase_of_gap(mu, lobes.sharp_gap);
    return (1.0 - lobes.broad_share) * sharp + lobes.broad_share * broad;
}

/// Phase function of water droplets of a diameter, a mixture of Henyey and Greenstein's and of Draine's.
///
/// domain  mu in [-1, 1] 1 lin
/// domain  diameter in [5e-6, 5e-5] m log
/// range   [0, 40000] 1/sr
/// error   2e-6 rel of reference::phase::phase_henyey_greenstein_draine
/// outside undefined
/// source  JendersieDEon2023
fn phase_henyey_greenstein_draine(mu: f32, diameter: f32) -> f32 {
    return phase_droplets(mu, droplet_phase(diameter));
}
