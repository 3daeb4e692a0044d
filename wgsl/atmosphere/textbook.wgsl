//! Light of one scattering along a ray through the air, by marching towards the eye's ray and from every sample to the sun.
//! source   Leitner2022 alg. 7, Afra eq. 2.11; accumulation by Gauss's implicit rule, exact shadow: ours
//! symbols  t distance from the ray's start [m] · a step has two samples, at 0.211 and 0.789 of its length
#define_import_path veduta::atmosphere::textbook

#import veduta::atmosphere::medium::{Air, Lanes, air_densities, air_extinction, air_scattering, air_phases}
#import veduta::atmosphere::ray::{AirRay, AirLight, air_ray, ray_altitude, ray_sun_cosine, lowest_distance}
#import veduta::atmosphere::columns::{path_to_top, sun_depth}
#import veduta::atmosphere::diffuse::{diffuse_moments, diffuse_source}
#import veduta::planet::shell::{altitude_along}

/// Place of the first of the two samples of a step, as a share of it: (1 - 1/sqrt(3)) / 2.
const FIRST: f32 = 0.21132487;

/// Place of the second.
const SECOND: f32 = 0.7886751;

/// What a sample's own density adds to the depth before it, in units of the step: half of its share. With the next two the
/// rule is Gauss's of two stages, whose error falls with the fourth power of the step.
const OWN: f32 = 0.25;

/// What the second sample's density adds before the first: 1/4 - sqrt(3)/6.
const LATER: f32 = -0.038675135;

/// What the first sample's density adds before the second: 1/4 + sqrt(3)/6.
const EARLIER: f32 = 0.53867513;

/// Densities of all layers times lengths, summed over a step on a rising line: from altitude `h` with zenith cosine `mu`,
/// between the distances `near` and `far`.
///
/// internal
fn rising_step(air: Air, h: f32, mu: f32, near: f32, far: f32) -> Lanes {
    let size = far - near;
    let first = air_densities(air, altitude_along(air.ground_radius, h, mu, near + FIRST * size));
    let second = air_densities(air, altitude_along(air.ground_radius, h, mu, near + SECOND * size));
    return Lanes((first.low + second.low) * (0.5 * size), (first.high + second.high) * (0.5 * size));
}

/// Optical depth from a lit place in the air at altitude `h` to the sun at the zenith cosine `sun_mu`, per channel; the steps
/// grow with the square of the distance from the lowest point. A sun below the horizon is taken as just above it, one within 1e-12 of level as level.
///
/// domain  h in [0, 1e5] m lin
/// domain  sun_mu in [-1, 1] 1 lin
/// domain  steps in [1, 512] 1 lin
/// range   [0, 1e6] 1
/// error   2e-5 rel of reference::textbook::march_sun_depth
/// outside undefined
/// source  Leitner2022 alg. 7, the inner loop; departs: squared spacing, Gauss's rule
fn march_sun_depth(air: Air, h: f32, sun_mu: f32, steps: i32) -> vec3<f32> {
    let radius = air.ground_radius;
    // The path first falls to its lowest point, if the sun stands below the level, and then rises to the top.
    let level = abs(sun_mu) < 1e-12;
    let path = path_to_top(radius, air.top, h, select(sun_mu, 0.0, level));
    let mu = select(max(sun_mu, 0.0), 0.0, level);
    let share = 1.0 / f32(max(steps, 1));
    var column = Lanes(vec4<f32>(0.0), vec4<f32>(0.0));
    for (var i = 0; i < max(steps, 1); i++) {
        let near = f32(i) * share;
        let far = f32(i + 1) * share;
        let step = rising_step(air, path.lowest, mu, path.rises * near * near, path.rises * far * far);
        column.low += step.low;
        column.high += step.high;
        if path.falls > 0.0 {
            let fall = rising_step(air, path.lowest, 0.0, path.falls * near * near, path.falls * far * far);
            column.low += fall.low;
            column.high += fall.high;
        }
    }
    return air_extinction(air, column);
}

/// A step of a march: where its two samples are, and how long it is.
struct PairStep {
    /// Distances of the samples from the ray's start [m].
    samples: vec2<f32>,
    /// Length of the step [m].
    size: f32,
}

/// Optical depths from the ray's start.
struct PairDepths {
    /// To the first sample of a step.
    first: vec3<f32>,
    /// To the second.
    second: vec3<f32>,
    /// To the end of the step.
    after: vec3<f32>,
}

/// The ends of the stretches of a ray in order: its lowest point, the edges of the planet's shadow, its end. A ray without a
/// shadow has it at its end.
///
/// internal
fn stretch_ends(low: f32, dark: vec2<f32>, length: f32) -> vec4<f32> {
    return vec4<f32>(min(low, dark.x), clamp(low, dark.x, dark.y), max(low, dark.y), length);
}

/// The edges of the shadow within the ray.
///
/// internal
fn dark_stretch(ray: AirRay) -> vec2<f32> {
    let edges = clamp(vec2<f32>(ray.dark_from, ray.dark_to), vec2<f32>(0.0), vec2<f32>(ray.length));
    return select(vec2<f32>(ray.length), edges, ray.dark_from < ray.dark_to);
}

/// Step number `i` of `count` in a stretch: steps grow with the square of the distance from the stretch's lower end, which is
/// its own end where the ray `falls`.
///
/// internal
fn pair_step(begin: f32, end: f32, falls: bool, i: i32, count: i32) -> PairStep {
    var near = f32(i) / f32(count);
    var far = f32(i + 1) / f32(count);
    if falls {
        near = 1.0 - near;
        far = 1.0 - far;
    }
    near *= near;
    far *= far;
    let base = select(begin, end, falls);
    let side = select(end - begin, begin - end, falls);
    return PairStep(base + side * vec2<f32>(mix(near, far, FIRST), mix(near, far, SECOND)), abs(far - near) * (end - begin));
}

/// Optical depths at the samples of a step, before which `depth` has been passed; a loss is the extinction at a sample times
/// the step's length.
///
/// internal
fn pair_depths(depth: vec3<f32>, loss_first: vec3<f32>, loss_second: vec3<f32>) -> PairDepths {
    return PairDepths(
        depth + max(OWN * loss_first + LATER * loss_second, vec3<f32>(0.0)),
        depth + EARLIER * loss_first + OWN * loss_second,
        depth + 0.5 * (loss_first + loss_second),
    );
}

/// Light of a sun of irradiance 1 that is scattered once into a ray, and the ray's transmittance. The ray is cut at its
/// lowest point and at the edges of the planet's shadow; each stretch has `steps` steps of two samples, whose lengths grow
/// with the square of the distance from its lowest end, and each lit sample a march of `light_steps` steps to the sun.
///
/// Some devices end all loops of a function after 65,535 rounds, those of neighbours counted together and the end of a loop
/// as one: keep 4 steps (2 light_steps + 3) below that.
///
/// domain  ray.altitude in [0, 1e5] m lin
/// domain  ray.mu in [-1, 1] 1 lin
/// domain  steps in [1, 512] 1 lin
/// domain  light_steps in [1, 64] 1 lin
/// range   [0, 1e6] 1/sr
/// error   8e-6 abs of reference::textbook::march_air
/// outside undefined
/// source  Leitner2022 alg. 7, Afra eq. 2.11; departs: Gauss's rule, squared spacing, planet's shadow in closed form
fn march_air(air: Air, ray: AirRay, steps: i32, light_steps: i32) -> AirLight {
    let count = max(steps, 1);
    let low = lowest_distance(air.ground_radius, ray);
    let dark = dark_stretch(ray);
    var ends = stretch_ends(low, dark, ray.length);
    let phases = air_phases(air, ray.nu);
    var depth = vec3<f32>(0.0);
    var light = vec3<f32>(0.0);
    var begin = 0.0;
    for (var k = 0; k < 4; k++) {
        let end = ends[k];
        if end > begin {
            let middle = 0.5 * (begin + end);
            let lit = middle < dark.x || middle > dark.y;
            for (var i = 0; i < count; i++) {
                let step = pair_step(begin, end, middle < low, i, count);
                let h_first = max(ray_altitude(air.ground_radius, ray, step.samples.x), 0.0);
                let h_second = max(ray_altitude(air.ground_radius, ray, step.samples.y), 0.0);
                let first = air_densities(air, h_first);
                let second = air_densities(air, h_second);
                let passed = pair_depths(depth, air_extinction(air, first) * step.size, air_extinction(air, second) * step.size);
                if lit {
                    let mu_first = ray_sun_cosine(air.ground_radius, ray, h_first, step.samples.x);
                    let mu_second = ray_sun_cosine(air.ground_radius, ray, h_second, step.samples.y);
                    let sun_first = exp(-(passed.first + march_sun_depth(air, h_first, mu_first, light_steps)));
                    let sun_second = exp(-(passed.second + march_sun_depth(air, h_second, mu_second, light_steps)));
                    light += (0.5 * step.size) * (sun_first * air_scattering(air, first, phases)
                        + sun_second * air_scattering(air, second, phases));
                }
                depth = passed.after;
            }
            begin = end;
        }
    }
    return AirLight(light, exp(-depth));
}

/// As `march_air`, but in one loop: what lies before a sample is added up on the way, and what lies between it and the sun is
/// read from the table of columns; with `all_orders` the light that the air has scattered before is added from the table of
/// diffuse light. The sun is a point. Twice as many samples as `steps` on each stretch.
///
/// domain  steps in [1, 512] 1 lin
/// range   [0, 1e6] 1/sr
/// error   5e-3 rel of reference::sky::Sky::single_scatter
/// outside undefined
/// source  Afra2007 sec. 3, joint integration; departs: Gauss's rule, squared spacing, planet's shadow in closed form
fn march_air_columns(columns: texture_2d_array<f32>, moments: texture_2d_array<f32>, linear: sampler, air: Air, ray: AirRay, all_orders: bool, steps: i32) -> AirLight {
    let count = max(steps, 1);
    let low = lowest_distance(air.ground_radius, ray);
    let dark = dark_stretch(ray);
    var ends = stretch_ends(low, dark, ray.length);
    let phases = air_phases(air, ray.nu);
    let r = air.ground_radius + ray.altitude;
    var depth = vec3<f32>(0.0);
    var light = vec3<f32>(0.0);
    var begin = 0.0;
    for (var k = 0; k < 4; k++) {
        let end = ends[k];
        if end > begin {
            let middle = 0.5 * (begin + end);
            let lit = select(0.0, 1.0, middle < dark.x || middle > dark.y);
            for (var i = 0; i < count; i++) {
                let step = pair_step(begin, end, middle < low, i, count);
                let h_first = max(ray_altitude(air.ground_radius, ray, step.samples.x), 0.0);
                let h_second = max(ray_altitude(air.ground_radius, ray, step.samples.y), 0.0);
                let first = air_densities(air, h_first);
                let second = air_densities(air, h_second);
                let sun_first = ray_sun_cosine(air.ground_radius, ray, h_first, step.samples.x);
                let sun_second = ray_sun_cosine(air.ground_radius, ray, h_second, step.samples.y);
                var source_first = air_scattering(air, first, phases) * (lit * exp(-sun_depth(columns, linear, air, h_first, sun_first)));
                var source_second = air_scattering(air, second, phases) * (lit * exp(-sun_depth(columns, linear, air, h_second, sun_second)));
                if all_orders {
                    let mu_first = clamp((r * ray.mu + step.samples.x) / (air.ground_radius + h_first), -1.0, 1.0);
                    let mu_second = clamp((r * ray.mu + step.samples.y) / (air.ground_radius + h_second), -1.0, 1.0);
                    let glow_first = diffuse_moments(moments, linear, air.top, h_first, sun_first);
                    let glow_second = diffuse_moments(moments, linear, air.top, h_second, sun_second);
                    source_first += diffuse_source(air, first, glow_first, mu_first, sun_first, ray.nu);
                    source_second += diffuse_source(air, second, glow_second, mu_second, sun_second, ray.nu);
                }
                let passed = pair_depths(depth, air_extinction(air, first) * step.size, air_extinction(air, second) * step.size);
                light += (0.5 * step.size) * (exp(-passed.first) * source_first + exp(-passed.second) * source_second);
                depth = passed.after;
            }
            begin = end;
        }
    }
    return AirLight(light, exp(-depth));
}

/// Light of a sun of irradiance 1 that is scattered once towards an eye at an altitude [m], from the direction `dir`.
///
/// internal
fn march_sky(air: Air, altitude: f32, dir: vec3<f32>, to_sun: vec3<f32>, steps: i32, light_steps: i32) -> vec3<f32> {
    return march_air(air, air_ray(air.ground_radius, air.top, altitude, dir, to_sun, 1e9), steps, light_steps).in_scatter;
}

/// As `march_sky`, but paths to the sun are read from the table of columns, Afra's optical depth table, and light of all orders is added.
///
/// internal
fn march_sky_columns(columns: texture_2d_array<f32>, moments: texture_2d_array<f32>, linear: sampler, air: Air, altitude: f32, dir: vec3<f32>, to_sun: vec3<f32>, steps: i32) -> vec3<f32> {
    return march_air_columns(columns, moments, linear, air, air_ray(air.ground_radius, air.top, altitude, dir, to_sun, 1e9), true, steps).in_scatter;
}
