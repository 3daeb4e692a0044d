//! Orders of scattering: the moments of the light around a place, out of the sun or out of the moments of the order before.
//! source   successive orders of scattering (Hansen1974), with the curvature of the planet along every ray: ours
//! symbols  h altitude [m] · sun_mu zenith cosine of the sun · mu zenith cosine of a direction
#define_import_path veduta::atmosphere::orders

#import veduta::atmosphere::medium::{Air, air_densities, air_extinction, air_scattering, air_phases}
#import veduta::atmosphere::columns::{horizon_cosine, sun_depth, sun_above_horizon}
#import veduta::atmosphere::diffuse::{Moments, diffuse_moments, diffuse_source, level_irradiance}
#import veduta::atmosphere::scatter::{step_share}
#import veduta::planet::shell::{altitude_along, top_distance, ground_distance}
#import veduta::math::gauss::{gauss_four, gauss_five}
#import veduta::math::squared::{squared_node}

/// Radiance that the ground reflects where the sun's zenith cosine is `sun_mu`: of light straight from the sun, or of the light whose moments are given.
///
/// internal
fn ground_light(columns: texture_2d_array<f32>, moments: texture_2d_array<f32>, linear: sampler, air: Air, sun_mu: f32, from_sun: bool) -> vec3<f32> {
    var irradiance = vec3<f32>(0.0);
    if from_sun {
        if sun_mu > 0.0 {
            irradiance = exp(-sun_depth(columns, linear, air, 0.0, sun_mu)) * sun_mu;
        }
    } else {
        irradiance = level_irradiance(diffuse_moments(moments, linear, air.top, 0.0, sun_mu));
    }
    return air.ground_albedo * irradiance * 0.31830989;
}

/// Moments of light scattered or reflected just once more: out of the sun's own light, or out of the light whose moments the table holds.
///
/// domain  h in [0, 1e5] m lin
/// domain  sun_mu in [-0.4, 1] 1 lin
/// range   [-10, 10] 1
/// error   0.12 rel of reference::air_tables::diffuse_moments
/// source  ours
fn order_moments(columns: texture_2d_array<f32>, moments: texture_2d_array<f32>, linear: sampler, air: Air, h: f32, sun_mu: f32, from_sun: bool) -> Moments {
    let r = air.ground_radius + h;
    let horizon = horizon_cosine(air.ground_radius, h);
    // What is divided by the sine needs one well above rounding: a sun in the zenith stands 1.8 degrees beside it.
    let sun_sine = sqrt(max(1.0 - sun_mu * sun_mu, 1e-3));
    var whole = vec3<f32>(0.0);
    var up = vec3<f32>(0.0);
    var level = vec3<f32>(0.0);
    var aside = vec3<f32>(0.0);
    // The first order has more detail than the others, most of all behind the planet's shadow.
    let polar_count = select(4, 5, from_sun);
    let steps = select(6, select(8, 14, sun_mu < 0.02), from_sun);
    // At dusk light comes from a narrow band over the horizon: the upper half has two parts of nodes each.
    let panels = select(1, 2, sun_mu < 0.02 && from_sun);
    let above_count = panels * polar_count;
    for (var i = 0; i < above_count + polar_count; i++) {
        let below = i >= above_count;
        let point = select(i % polar_count, i - above_count, below);
        let share = select(1.0 / f32(panels), 1.0, below);
        let first = select(f32(i / polar_count) * share, 0.0, below);
        let node = select(gauss_four(point), gauss_five(point), from_sun);
        let polar = vec2<f32>(first + share * node.x, share * node.y);
        // Dense at the horizon on both of its sides.
        let span = select(1.0 - horizon, -1.0 - horizon, below);
        let mu = horizon + span * (polar.x * polar.x);
        let sine = sqrt(max(1.0 - mu * mu, 0.0));
        let solid = abs(span) * 2.0 * polar.x * polar.y * 2.0943951;
        var end = top_distance(air.ground_radius, air.top, h, mu);
        if below {
            // A ray just below the horizon meets the ground where it runs level.
            let met = ground_distance(air.ground_radius, h, mu);
            end = select(met, -r * mu, met < 0.0);
        }
        for (var j = 0; j < 3; j++) {
            let cos_phi = 0.8660254 * f32(1 - j);
            let nu = mu * sun_mu + sine * sun_sine * cos_phi;
            let phases = air_phases(air, nu);
            var left = vec3<f32>(1.0);
            var light = vec3<f32>(0.0);
            for (var k = 0; k < steps; k++) {
                let place = squared_node(steps, k);
                let t = end * place.x;
                let distance = end * place.y;
                let altitude = max(altitude_along(air.ground_radius, h, mu, t), 0.0);
                let there_mu = clamp((r * mu + t) / (air.ground_radius + altitude), -1.0, 1.0);
                let there_sun = clamp((r * sun_mu + t * nu) / (air.ground_radius + altitude), -1.0, 1.0);
                let densities = air_densities(air, altitude);
                let extinction = air_extinction(air, densities);
                var source = vec3<f32>(0.0);
                if from_sun {
                    let lit = sun_above_horizon(air.ground_radius, altitude, there_sun, air.sun_radius);
                    if lit > 0.0 {
                        let sun = lit * exp(-sun_depth(columns, linear, air, altitude, there_sun));
                        source = sun * air_scattering(air, densities, phases);
                    }
                } else {
                    let glow = diffuse_moments(moments, linear, air.top, altitude, there_sun);
                    source = diffuse_source(air, densities, glow, there_mu, there_sun, nu);
                }
                let depth = extinction * distance;
                let passed = exp(-depth);
                light += source * left * step_share(depth, passed) * distance;
                left *= passed;
            }
            if below {
                let there_sun = clamp((r * sun_mu + end * nu) / air.ground_radius, -1.0, 1.0);
                light += left * ground_light(columns, moments, linear, air, there_sun, from_sun);
            }
            let weighted = light * solid;
            let x = sine * cos_phi / sun_sine;
            whole += weighted;
            up += weighted * mu;
            level += weighted * (1.5 * mu * mu - 0.5);
            aside += dot(weighted, vec3<f32>(1.0)) * vec3<f32>(x, mu * x, sine * sine * (2.0 * cos_phi * cos_phi - 1.0) / (sun_sine * sun_sine));
        }
    }
    let over = 1.0 / max(whole, vec3<f32>(1e-30));
    return Moments(whole, up * over, level * over, aside / max(dot(whole, vec3<f32>(1.0)), 1e-30));
}

/// Light of all orders from one on, when `last` is its light and `before` that of the order before: a geometric series, whose ratio is at most 0.95.
///
/// domain  before.whole in [0, 10] 1 lin
/// domain  last.whole in [0, 10] 1 lin
/// domain  before.up in [-1, 1] 1 lin
/// domain  last.up in [-1, 1] 1 lin
/// domain  before.level in [-1, 1] 1 lin
/// domain  before.aside in [-1, 1] 1 lin
/// domain  last.level in [-1, 1] 1 lin
/// domain  last.aside in [-1, 1] 1 lin
/// range   [-10, 200] 1
/// error   2e-6 rel of reference::air_tables::further_orders
/// outside undefined
/// source  geometric series
fn further_orders(before: Moments, last: Moments) -> Moments {
    let ratio = clamp(last.whole / max(before.whole, vec3<f32>(1e-30)), vec3<f32>(0.0), vec3<f32>(0.95));
    return Moments(last.whole / (1.0 - ratio), last.up, last.level, last.aside);
}
