//! Light of one scattering along a ray through the air, by marching towards the eye's ray and from every sample to the sun.
//! source   Leitner2022 alg. 7, Afra eq. 2.11; accumulation by Gauss's implicit rule, exact shadow: ours
//! symbols  t distance from the ray's start [m] · a step has two samples, at 0.211 and 0.789 of its length
#define_import_path veduta::atmosphere::textbook

#import veduta::atmosphere::medium::{Air, Lanes, air_densities, air_extinction, air_scattering, air_phases}
#import veduta::atmosphere::ray::{AirRay, AirLight, ray_altitude, ray_sun_cosine, lowest_distance}
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
/// grow with the square of the distance from the lowest point. A sun below the horizon is taken as just above it.
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
    let r = radius + h;
    let down = min(sun_mu, 0.0);
    let sine = sqrt(max((1.0 - down) * (1.0 + down), 0.0));
    // The path first falls to its lowest point, if the sun stands below the level, and then rises to the top.
    let below = min(r * (down * down) / (1.0 + sine), h);
    let lowest = h - below;
    let mu = max(sun_mu, 0.0);
    let falls = -r * down;
    // What the path rises by is a sum; the difference of top and lowest point would lose a short path at the top of the air.
    let rise = max((air.top - h) + below, 0.0);
    let square = rise * (2.0 * radius + air.top + lowest);
    let along = (radius + lowest) * mu;
    let rises = square / max(along + sqrt(along * along + square), 1e-20);
    let share = 1.0 / f32(max(steps, 1));
    var column = Lanes(vec4<f32>(0.0), vec4<f32>(0.0));
    for (var i = 0; i < max(steps, 1); i++) {
        let near = f32(i) * share;
        let far = f32(i + 1) * share;
        let step = rising_step(air, lowest, mu, rises * near * near, rises * far * far);
        column.low += step.low;
        column.high += step.high;
        if falls > 0.0 {
            let fall = rising_step(air, lowest, 0.0, falls * near * near, falls * far * far);
            column.low += fall.low;
            column.high += fall.high;
        }
    }
    return air_extinction(air, column);
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
    let dark = ray.dark_from < ray.dark_to;
    let dark_from = select(ray.length, clamp(ray.dark_from, 0.0, ray.length), dark);
    let dark_to = select(ray.length, clamp(ray.dark_to, 0.0, ray.length), dark);
    // The ends of the stretches in order.
    var ends = vec4<f32>(min(low, dark_from), clamp(low, dark_from, dark_to), max(low, dark_to), ray.length);
    let phases = air_phases(air, ray.nu);
    var depth = vec3<f32>(0.0);
    var light = vec3<f32>(0.0);
    var begin = 0.0;
    for (var k = 0; k < 4; k++) {
        let end = ends[k];
        let size = end - begin;
        if size > 0.0 {
            let middle = 0.5 * (begin + end);
            let lit = middle < dark_from || middle > dark_to;
            let falls = middle < low;
            for (var i = 0; i < count; i++) {
                var near = f32(i) / f32(count);
                var far = f32(i + 1) / f32(count);
                if falls {
                    near = 1.0 - near;
                    far = 1.0 - far;
                }
                // Distances from the lower end, squared.
                near *= near;
                far *= far;
                let share = abs(far - near);
                let base = select(begin, end, falls);
                let side = select(size, -size, falls);
                let step = share * size;
                let t_first = base + side * mix(near, far, FIRST);
                let t_second = base + side * mix(near, far, SECOND);
                let h_first = max(ray_altitude(air.ground_radius, ray, t_first), 0.0);
                let h_second = max(ray_altitude(air.ground_radius, ray, t_second), 0.0);
                let first = air_densities(air, h_first);
                let second = air_densities(air, h_second);
                let loss_first = air_extinction(air, first) * step;
                let loss_second = air_extinction(air, second) * step;
                if lit {
                    let sun_first = march_sun_depth(air, h_first, ray_sun_cosine(air.ground_radius, ray, h_first, t_first), light_steps);
                    let sun_second = march_sun_depth(air, h_second, ray_sun_cosine(air.ground_radius, ray, h_second, t_second), light_steps);
                    let passed_first = depth + max(OWN * loss_first + LATER * loss_second, vec3<f32>(0.0)) + sun_first;
                    let passed_second = depth + EARLIER * loss_first + OWN * loss_second + sun_second;
                    light += (0.5 * step) * (exp(-passed_first) * air_scattering(air, first, phases)
                        + exp(-passed_second) * air_scattering(air, second, phases));
                }
                depth += 0.5 * (loss_first + loss_second);
            }
            begin = end;
        }
    }
    return AirLight(light, exp(-depth));
}
