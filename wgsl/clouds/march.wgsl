//! Single scattering of sunlight in the cloud layer, with a march to the sun from every sample.
//! source   Leitner2022 ch. 4.5 and eq. 3.14; planet shadow and eyes in or above the layer: ours
//! symbols  t distance along the view ray [m] · s distance within the layer [m] · jitter start of the samples in their steps, in [0, 1)
#define_import_path veduta::clouds::march

#import veduta::planet::shell::{altitude_along, direction_cosine_along, sphere_span, top_distance, ground_distance, shell_segment, clip_segment, segment_length, segment_distance}
#import veduta::lighting::phase::{phase_double_henyey_greenstein}
#import veduta::clouds::field::{CloudLayer, cloud_density}

/// Light of the clouds along a ray.
struct CloudLight {
    /// Radiance scattered into the ray, for a sun of irradiance 1 at the layer [1/sr].
    scatter: f32,
    /// Transmittance of the ray.
    transmittance: f32,
    /// Mean distance of what is seen of the clouds [m]; the layer's entry where there are none.
    mean_distance: f32,
    /// Density samples on the view ray.
    density_samples: i32,
    /// Density samples towards the sun.
    light_samples: i32,
}

/// Distance from a point within the layer to the layer's edge.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  altitude in [4000, 5500] m lin
/// domain  mu in [-1, 1] 1 lin
/// range   [0, 1.2e6] m
/// error   1e-4 rel of reference::clouds::layer_exit
/// outside undefined
/// source  elementary
fn layer_exit(layer: CloudLayer, ground_radius: f32, altitude: f32, mu: f32) -> f32 {
    let inner = sphere_span(ground_radius, layer.bottom, altitude, mu);
    let upper = top_distance(ground_radius, layer.bottom + layer.thickness, altitude, mu);
    return select(upper, max(inner.near, 0.0), mu < 0.0 && inner.far >= inner.near);
}

/// Optical depth of the layer from a point within it towards the sun, up to the layer's edge, by the midpoint rule;
/// `mu` is the sun's zenith cosine at the point.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  relative in [-1e5, 1e5] m lin
/// domain  altitude in [4000, 5500] m lin
/// domain  to_sun in [-1, 1] 1 lin
/// domain  mu in [-1, 1] 1 lin
/// domain  steps in [1, 64] 1 lin
/// range   [0, 8e4] 1
/// error   1e-2 rel of reference::clouds::sun_depth
/// outside undefined
/// source  Leitner2022 ch. 4.5 (secondary march)
fn sun_depth(layer: CloudLayer, ground_radius: f32, relative: vec3<f32>, altitude: f32, to_sun: vec3<f32>, mu: f32, steps: i32) -> f32 {
    let count = max(steps, 1);
    let ds = layer_exit(layer, ground_radius, altitude, mu) / f32(count);
    var sum = 0.0;
    for (var i = 0; i < count; i++) {
        let s = (f32(i) + 0.5) * ds;
        sum += cloud_density(layer, relative + to_sun * s, altitude_along(ground_radius, altitude, mu, s));
    }
    return sum * ds * layer.extinction;
}

/// Light of the cloud layer along a view ray up to `max_distance`: `steps` equal steps within the layer, and at each of
/// them, cloudy or not, a march of `light_steps` to the sun. No step is skipped and none is left out at the end.
/// Scattering is first order in a step's optical depth: too bright by half of it where the layer is homogeneous.
/// The error holds for `scatter` and `transmittance`; that of `mean_distance` is 1e-3 of itself.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  eye_altitude in [0, 1e5] m lin
/// domain  dir in [-1, 1] 1 lin
/// domain  to_sun in [-1, 1] 1 lin
/// domain  max_distance in [0, 1e5] m lin
/// domain  steps in [1, 512] 1 lin
/// domain  light_steps in [1, 64] 1 lin
/// domain  jitter in [0, 1] 1 lin
/// range   [0, 1e6] 1/sr
/// error   3e-4 abs of reference::clouds::march_clouds
/// outside undefined
/// source  Leitner2022 ch. 4.5 and eq. 3.14
fn march_clouds(layer: CloudLayer, ground_radius: f32, eye_altitude: f32, dir: vec3<f32>, to_sun: vec3<f32>, max_distance: f32,
    steps: i32, light_steps: i32, jitter: f32) -> CloudLight {
    let count = max(steps, 1);
    let nu = dot(dir, to_sun);
    let whole = shell_segment(ground_radius, layer.bottom, layer.bottom + layer.thickness, eye_altitude, dir.y);
    let segment = clip_segment(whole, max_distance);
    let ds = segment_length(segment) / f32(count);
    var transmittance = 1.0;
    var scatter = 0.0;
    var weight = 0.0;
    var weighted = 0.0;
    for (var i = 0; i < count; i++) {
        let t = segment_distance(segment, (f32(i) + jitter) * ds);
        let altitude = altitude_along(ground_radius, eye_altitude, dir.y, t);
        let relative = dir * t;
        let mu = direction_cosine_along(ground_radius, eye_altitude, altitude, to_sun.y, nu, t);
        let density = cloud_density(layer, relative, altitude);
        let depth = sun_depth(layer, ground_radius, relative, altitude, to_sun, mu, light_steps);
        let light = select(0.0, exp(-depth), ground_distance(ground_radius, altitude, mu) < 0.0);
        let step_depth = density * layer.extinction * ds;
        let left = transmittance * exp(-step_depth);
        scatter += transmittance * step_depth * light;
        weight += transmittance - left;
        weighted += (transmittance - left) * t;
        transmittance = left;
    }
    let phase = phase_double_henyey_greenstein(nu, layer.g_forward, layer.g_backward, layer.backward_share);
    return CloudLight(scatter * layer.albedo * phase, transmittance,
        select(segment.near, weighted / max(weight, 1e-12), weight > 1e-12), count, count * max(light_steps, 1));
}

/// The same light with less work: the march to the sun runs only where there is cloud and sun, and the view march ends
/// when less than `min_transmittance` is left, which bounds the error beside the rounding below (given at 1e-4).
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  eye_altitude in [0, 1e5] m lin
/// domain  dir in [-1, 1] 1 lin
/// domain  to_sun in [-1, 1] 1 lin
/// domain  max_distance in [0, 1e5] m lin
/// domain  steps in [1, 512] 1 lin
/// domain  light_steps in [1, 64] 1 lin
/// domain  min_transmittance in [0, 0.1] 1 lin
/// domain  jitter in [0, 1] 1 lin
/// range   [0, 1e6] 1/sr
/// error   3e-4 abs of reference::clouds::march_clouds
/// outside undefined
/// source  Leitner2022 ch. 4.5 and eq. 3.14; skipping: ours
fn march_clouds_skip(layer: CloudLayer, ground_radius: f32, eye_altitude: f32, dir: vec3<f32>, to_sun: vec3<f32>, max_distance: f32,
    steps: i32, light_steps: i32, min_transmittance: f32, jitter: f32) -> CloudLight {
    let nu = dot(dir, to_sun);
    let whole = shell_segment(ground_radius, layer.bottom, layer.bottom + layer.thickness, eye_altitude, dir.y);
    let segment = clip_segment(whole, max_distance);
    let size = segment_length(segment);
    let count = select(0, max(steps, 1), size > 0.0);
    let ds = size / f32(max(count, 1));
    var transmittance = 1.0;
    var scatter = 0.0;
    var weight = 0.0;
    var weighted = 0.0;
    var samples = vec2<i32>(0);
    for (var i = 0; i < count && transmittance > min_transmittance; i++) {
        let t = segment_distance(segment, (f32(i) + jitter) * ds);
        let altitude = altitude_along(ground_radius, eye_altitude, dir.y, t);
        let relative = dir * t;
        let density = cloud_density(layer, relative, altitude);
        samples.x += 1;
        if density > 0.0 {
            let mu = direction_cosine_along(ground_radius, eye_altitude, altitude, to_sun.y, nu, t);
            let step_depth = density * layer.extinction * ds;
            let left = transmittance * exp(-step_depth);
            if ground_distance(ground_radius, altitude, mu) < 0.0 {
                let depth = sun_depth(layer, ground_radius, relative, altitude, to_sun, mu, light_steps);
                samples.y += max(light_steps, 1);
                scatter += transmittance * step_depth * exp(-depth);
            }
            weight += transmittance - left;
            weighted += (transmittance - left) * t;
            transmittance = left;
        }
    }
    let phase = phase_double_henyey_greenstein(nu, layer.g_forward, layer.g_backward, layer.backward_share);
    return CloudLight(scatter * layer.albedo * phase, transmittance,
        select(segment.near, weighted / max(weight, 1e-12), weight > 1e-12), samples.x, samples.y);
}
