//! Light scattered into a ray, with the sun's light and the air's own glow read from tables: what the tables of sky and air are made by.
//! source   Nishita1993; energy-conserving steps Hillaire2015; split at shadow, lowest point and ends: ours
//! symbols  t distance along the ray [m] · peaked light: that of layers with a peaked phase function, over the phase function of Air.peak
#define_import_path veduta::atmosphere::scatter

#import veduta::atmosphere::medium::{Air, FourLayers, Lanes, air_densities, air_extinction, air_scattering, air_phases, peak_phase}
#import veduta::atmosphere::ray::{AirRay, ray_altitude, ray_sun_cosine, lowest_distance}
#import veduta::atmosphere::columns::{sun_depth, sun_above_horizon}
#import veduta::atmosphere::diffuse::{diffuse_moments, diffuse_source}
#import veduta::math::squared::{squared_node}

/// Light scattered into a ray.
struct Scattered {
    /// Radiance but for peaked light [1/sr].
    smooth_light: vec3<f32>,
    /// Radiance of peaked light over the peaked phase function [1].
    peaked_light: vec3<f32>,
    /// What is left of the light behind.
    transmittance: vec3<f32>,
}

/// Sources of light at a place of a ray.
struct AirSource {
    /// But for peaked light [1/(sr m)].
    smooth_light: vec3<f32>,
    /// Peaked light over the peaked phase function [1/m].
    peaked_light: vec3<f32>,
    /// Extinction [1/m].
    extinction: vec3<f32>,
}

/// The phase functions of a ray, split into those of smooth and peaked layers.
struct SplitPhases {
    /// 0 for peaked lanes [1/sr].
    smooth_lanes: Lanes,
    /// Over the peaked phase function, 0 for smooth lanes [1].
    peaked_lanes: Lanes,
}

/// Splits the phase functions for a cosine `nu` of the scattering angle.
///
/// domain  nu in [-1, 1] 1 lin
/// range   [0, 1e4] 1
/// error   1e-5 rel of reference::air_tables::split_phases
/// outside undefined
/// source  ours
fn split_phases(air: Air, nu: f32) -> SplitPhases {
    let phases = air_phases(air, nu);
    let over = 1.0 / max(peak_phase(air, nu), 1e-9);
    return SplitPhases(
        Lanes(phases.low * (1.0 - air.low.peaked), phases.high * (1.0 - air.high.peaked)),
        Lanes(phases.low * air.low.peaked * over, phases.high * air.high.peaked * over),
    );
}

/// Light that the air scatters at altitude `h` into a direction of zenith cosine `mu` with the cosine `nu` to the sun, whose own
/// zenith cosine is `sun_mu`. Without `all_orders` only light straight from the sun counts.
///
/// domain  h in [0, 1e5] m lin
/// domain  mu in [-1, 1] 1 lin
/// domain  sun_mu in [-1, 1] 1 lin
/// domain  nu in [-1, 1] 1 lin
/// domain  angular_radius in [0, 0.1] rad lin
/// range   [0, 10] 1/m
/// error   0.02 rel of reference::sky::Sky::single_scatter
/// source  ours
fn air_source(columns: texture_2d_array<f32>, moments: texture_2d_array<f32>, linear: sampler, air: Air, phases: SplitPhases, h: f32, mu: f32, sun_mu: f32, nu: f32, angular_radius: f32, all_orders: bool) -> AirSource {
    let densities = air_densities(air, h);
    var source = AirSource(vec3<f32>(0.0), vec3<f32>(0.0), air_extinction(air, densities));
    let lit = sun_above_horizon(air.ground_radius, h, sun_mu, angular_radius);
    if lit > 0.0 {
        let sun = lit * exp(-sun_depth(columns, linear, air, h, sun_mu));
        source.smooth_light = sun * air_scattering(air, densities, phases.smooth_lanes);
        source.peaked_light = sun * air_scattering(air, densities, phases.peaked_lanes);
    }
    if all_orders {
        let glow = diffuse_moments(moments, linear, air.top, h, sun_mu);
        source.smooth_light += diffuse_source(air, densities, glow, mu, sun_mu, nu);
    }
    return source;
}

/// Mean transmittance within a step of the optical depth `depth`, of which `left` = exp(-depth) is left at its end.
///
/// domain  depth in [0, 100] 1 lin
/// domain  left in [0, 1] 1 lin
/// range   [-1, 10] 1
/// error   2e-6 rel of reference::air_tables::step_share
/// outside undefined
/// source  Hillaire2015; series at small optical depth
fn step_share(depth: vec3<f32>, left: vec3<f32>) -> vec3<f32> {
    let series = 1.0 - depth * (0.5 - depth * (0.16666667 - depth * 0.041666667));
    return select((1.0 - left) / max(depth, vec3<f32>(1e-6)), series, depth < vec3<f32>(0.1));
}

/// What the air along a ray leaves of light from space: all of it where the ray misses the air, nothing where it meets the ground.
///
/// domain  ray.altitude in [0, 1e5] m lin
/// domain  ray.mu in [-1, 1] 1 lin
/// domain  ray.length in [0, 2e6] m lin
/// range   [0, 1] 1
/// error   5e-3 abs of reference::air_tables::sun_depth
/// source  elementary
fn space_transmittance(columns: texture_2d_array<f32>, linear: sampler, air: Air, ray: AirRay) -> vec3<f32> {
    let left = exp(-sun_depth(columns, linear, air, ray.altitude, ray.mu));
    return select(select(left, vec3<f32>(0.0), ray.meets_ground != 0u), vec3<f32>(1.0), ray.length <= 0.0);
}

#ifdef AIR_EIGHT_LANES
/// The next place along a ray, beyond the distance `start` and before `end`, where the density of a lane of ramps that scatters has a bend at one of the altitudes `levels`.
///
/// internal
fn next_bend(ray: AirRay, ground_radius: f32, levels: vec4<f32>, start: f32, end: f32) -> f32 {
    let r = ground_radius + ray.altitude;
    let low_at = -r * ray.mu;
    let lowest = ray.altitude - r * (ray.mu * ray.mu) / (1.0 + ray.sine);
    let aside = sqrt(max((levels - lowest) * (2.0 * ground_radius + levels + lowest), vec4<f32>(0.0)));
    let none = vec4<f32>(end);
    let past = vec4<f32>(start + 1.0);
    let met = select(none, min(select(none, low_at - aside, low_at - aside > past), select(none, low_at + aside, low_at + aside > past)), levels > vec4<f32>(lowest));
    return min(min(min(met.x, met.y), min(met.z, met.w)), end);
}

/// The next bend of four lanes.
///
/// internal
fn next_bend_of_four(layers: FourLayers, ray: AirRay, ground_radius: f32, start: f32, end: f32) -> f32 {
    let scatters = layers.scattering_red + layers.scattering_green + layers.scattering_blue > vec4<f32>(0.0);
    var next = end;
    for (var k = 0; k < 4; k++) {
        if layers.rise[k] > 0.0 && scatters[k] {
            let offsets = vec4<f32>(-layers.rise_offset[k], 1.0 - layers.rise_offset[k], 1.0 - layers.sink_offset[k], -layers.sink_offset[k]);
            let levels = offsets / vec4<f32>(layers.rise[k], layers.rise[k], layers.sink[k], layers.sink[k]);
            next = next_bend(ray, ground_radius, levels, start, next);
        }
    }
    return next;
}
#endif

/// Light scattered into a ray and its optical depth, over its whole length. `steps` are put on every stretch between
/// the start, the lowest point, the edges of the planet's shadow and the end; with AIR_EIGHT_LANES also between the bends of lanes of ramps that scatter, so that no layer
/// is thinner than a step.
///
/// domain  steps in [1, 64] 1 lin
/// domain  angular_radius in [0, 0.1] rad lin
/// range   [0, 1e4] 1
/// error   0.03 rel of reference::sky::Sky::single_scatter
/// source  Nishita1993; veduta::math::squared
fn scatter_along(columns: texture_2d_array<f32>, moments: texture_2d_array<f32>, linear: sampler, air: Air, ray: AirRay, angular_radius: f32, all_orders: bool, steps: i32) -> Scattered {
    let phases = split_phases(air, ray.nu);
    let lowest = lowest_distance(air.ground_radius, ray);
    // The inner edges of the stretches in order.
    let dark_to = max(ray.dark_from, ray.dark_to);
    let first = min(lowest, ray.dark_from);
    let third = max(lowest, dark_to);
    let second = clamp(lowest, ray.dark_from, dark_to);
    let second_or = select(second, select(ray.dark_from, dark_to, lowest > dark_to), lowest < ray.dark_from || lowest > dark_to);
    var result = Scattered(vec3<f32>(0.0), vec3<f32>(0.0), vec3<f32>(1.0));
    var from_edge = 0.0;
    // Every lane has at most eight bends on a ray.
    var stretch = 0;
    for (var edge = 0; edge < 68 && stretch < 4; edge++) {
        var to_edge = ray.length;
        if stretch == 0 {
            to_edge = first;
        } else if stretch == 1 {
            to_edge = second_or;
        } else if stretch == 2 {
            to_edge = third;
        }
#ifdef AIR_EIGHT_LANES
        let whole = to_edge;
        to_edge = next_bend_of_four(air.low, ray, air.ground_radius, from_edge, to_edge);
        to_edge = next_bend_of_four(air.high, ray, air.ground_radius, from_edge, to_edge);
        stretch += select(0, 1, to_edge >= whole);
#else
        stretch++;
#endif
        let long = to_edge - from_edge;
        if long > 0.0 {
            let falling = to_edge <= lowest;
            for (var i = 0; i < steps; i++) {
                let node = squared_node(steps, select(i, steps - 1 - i, falling));
                let share = node.x;
                let t = select(from_edge + long * share, to_edge - long * share, falling);
                let distance = long * node.y;
                let h = max(ray_altitude(air.ground_radius, ray, t), 0.0);
                let mu = clamp(((air.ground_radius + ray.altitude) * ray.mu + t) / (air.ground_radius + h), -1.0, 1.0);
                let sun_mu = ray_sun_cosine(air.ground_radius, ray, h, t);
                let source = air_source(columns, moments, linear, air, phases, h, mu, sun_mu, ray.nu, angular_radius, all_orders);
                let depth = source.extinction * distance;
                let left = exp(-depth);
                let weight = result.transmittance * step_share(depth, left) * distance;
                result.smooth_light += source.smooth_light * weight;
                result.peaked_light += source.peaked_light * weight;
                result.transmittance *= left;
            }
        }
        from_edge = max(from_edge, to_edge);
    }
    return result;
}

/// Radiance of scattered light for a cosine `nu` of the angle to the sun.
///
/// domain  scattered.smooth_light in [0, 100] 1 lin
/// domain  scattered.peaked_light in [0, 100] 1 lin
/// domain  scattered.transmittance in [0, 1] 1 lin
/// domain  nu in [-1, 1] 1 lin
/// range   [0, 1e8] 1/sr
/// error   1e-5 rel of reference::air_tables::scattered_radiance
/// outside undefined
/// source  elementary
fn scattered_radiance(air: Air, scattered: Scattered, nu: f32) -> vec3<f32> {
    return scattered.smooth_light + scattered.peaked_light * peak_phase(air, nu);
}
