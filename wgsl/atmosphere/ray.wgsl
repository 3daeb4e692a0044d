//! Rays inside the air of a planet: where they start and end, how high they run, and which stretch lies in the planet's shadow.
//! source   geometry of circles, arranged so that no two radii are subtracted: ours
//! symbols  h altitude [m] · mu zenith cosine [1] · nu cosine between the ray and the direction to the sun [1] · t distance from the ray's start [m]
#define_import_path veduta::atmosphere::ray

/// A ray inside the air. It starts at the eye, or where it enters when the eye is above the air.
struct AirRay {
    /// Altitude of the start [m].
    altitude: f32,
    /// Zenith cosine at the start.
    mu: f32,
    /// Zenith sine at the start.
    sine: f32,
    /// Cosine between the ray and the direction to the sun.
    nu: f32,
    /// Zenith cosine of the sun at the start.
    sun_mu: f32,
    /// Distance from the eye to the start [m].
    from_eye: f32,
    /// Distance from the start to the end: the top of the air, the ground sphere or the greatest distance; 0 when the ray misses the air [m].
    length: f32,
    /// Where the ray enters the planet's shadow [m].
    dark_from: f32,
    /// Where it leaves the shadow again; the ray is lit throughout when this is not above dark_from [m].
    dark_to: f32,
    /// 1 when the ray ends on the ground, else 0.
    meets_ground: u32,
}

/// What a ray through the air brings: light of a sun of irradiance 1, and what is left of the light behind.
struct AirLight {
    /// Radiance scattered into the ray [1/sr].
    in_scatter: vec3<f32>,
    /// Share of light from the ray's end that reaches its start.
    transmittance: vec3<f32>,
}

/// The leading half of a number's digits; products of two such are exact.
///
/// internal
fn leading_half(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) & 0xfffff000u);
}

/// A number of [-1, 1] cut off after 12 bits behind the point.
///
/// internal
fn twelve_bits(x: f32) -> f32 {
    return trunc(x * 4096.0) * 0.000244140625;
}

/// Zenith cosine and sine of a unit vector. Of its vertical and its horizontal part the smaller is taken as exact, since it
/// has the finer digits.
///
/// domain  dir in [-1, 1] 1 lin
/// range   [-1, 1] 1
/// error   3e-7 abs of reference::air_ray::zenith_parts
/// source  elementary
fn zenith_parts(dir: vec3<f32>) -> vec2<f32> {
    let aside = min(length(dir.xz), 1.0);
    let y = clamp(dir.y, -1.0, 1.0);
    if y * y < 0.5 {
        return vec2<f32>(y, sqrt((1.0 - y) * (1.0 + y)));
    }
    let cosine = sqrt((1.0 - aside) * (1.0 + aside));
    return vec2<f32>(select(cosine, -cosine, y < 0.0), aside);
}

/// Altitude of the point of a straight line that is closest to the planet's centre, for a unit vector `dir` at altitude `h`:
/// right to a metre near the planet, from anywhere. A line through the centre gives -ground_radius.
///
/// domain  ground_radius in [3e6, 1e7] m log
/// domain  h in [0, 1e8] m lin
/// domain  dir in [-1, 1] 1 lin
/// range   [-1e7, 1e8] m
/// error   16 abs of reference::air_ray::tangent_altitude
/// outside undefined
/// source  r sin - R with the leading halves of both products subtracted first: ours
fn tangent_altitude(ground_radius: f32, h: f32, dir: vec3<f32>) -> f32 {
    if dir.y * dir.y < 0.5 {
        let sine = sqrt((1.0 - dir.y) * (1.0 + dir.y));
        return h - (ground_radius + h) * (dir.y * dir.y) / (1.0 + sine);
    }
    // h sine - R (1 - sine), in which products of heads are exact, as is what sine lacks to be the root of x^2 + z^2.
    let sine = length(dir.xz);
    let sine_head = twelve_bits(sine);
    let x_head = twelve_bits(dir.x);
    let z_head = twelve_bits(dir.z);
    let heads = (x_head * x_head - sine_head * sine_head) + z_head * z_head;
    let tails = (dir.x - x_head) * (dir.x + x_head) + (dir.z - z_head) * (dir.z + z_head)
        - (sine - sine_head) * (sine + sine_head);
    let rest = (sine - sine_head) + 0.5 * (heads + tails) / max(sine, 1e-20);
    let gap_head = 1.0 - sine_head;
    let h_head = leading_half(h);
    let radius_head = leading_half(ground_radius);
    let head = h_head * sine_head - radius_head * gap_head;
    let tail = (h - h_head) * sine_head - (ground_radius - radius_head) * gap_head;
    return max(head + (tail + (ground_radius + h) * rest), -ground_radius);
}

/// A ray from a place in the air, up to `max_distance`. The unit vectors are given in a frame with y up at the start: `dir` by
/// its parts x and y, `to_sun` by x, y and z.
///
/// domain  ground_radius in [3e6, 1e7] m log
/// domain  top in [5e4, 2e5] m lin
/// domain  h in [0, top] m lin
/// domain  dir in [-1, 1] 1 lin
/// domain  to_sun in [-1, 1] 1 lin
/// domain  max_distance in [1, 1e9] m log
/// range   [-1, 1e9] 1
/// error   1e-6 abs of reference::air_ray::ray_inside
/// source  Bruneton2017 (boundary distances); shadow of the ground sphere: ours
fn ray_inside(ground_radius: f32, top: f32, h: f32, dir: vec2<f32>, to_sun: vec3<f32>, max_distance: f32) -> AirRay {
    let mu = clamp(dir.y, -1.0, 1.0);
    let sine = min(abs(dir.x), 1.0);
    let sun_forward = select(to_sun.x, -to_sun.x, dir.x < 0.0);
    let start = clamp(h, 0.0, top);
    let r = ground_radius + start;
    // Distance along the ray from the point closest to the centre, and the altitude of that.
    let along = r * mu;
    let lowest = start - r * (mu * mu) / (1.0 + sine);
    let half_top = sqrt(max((top - lowest) * (2.0 * ground_radius + top + lowest), 0.0));
    let descends = mu < 0.0;
    let ground = descends && lowest < 0.0;
    var end = (top - start) * (2.0 * ground_radius + top + start) / max(half_top + along, 1e-20);
    if descends {
        end = half_top - along;
    }
    if ground {
        let half_ground = sqrt(max(-lowest * (2.0 * ground_radius + lowest), 0.0));
        end = start * (2.0 * ground_radius + start) / max(half_ground - along, 1e-20);
    }
    let length = max(min(end, max_distance), 0.0);

    // The sun along the ray, towards the zenith of the lowest point, and aside.
    let nu = clamp(mu * to_sun.y + sine * sun_forward, -1.0, 1.0);
    let rise = sine * to_sun.y - mu * sun_forward;
    let aside = to_sun.z;
    // The shadow is the half of the cylinder about the planet that lies behind it; all lengths over the planet's radius.
    let low = lowest / ground_radius;
    let across = rise * rise + aside * aside;
    let square = rise * rise - aside * aside * (low * (2.0 + low));
    let half_chord = sqrt(max(square, 0.0));
    let middle = (1.0 + low) * rise * nu;
    let larger = middle + select(half_chord, -half_chord, middle < 0.0);
    let product = low * (2.0 + low) - (1.0 + low) * (1.0 + low) * (rise * rise);
    let first = larger / max(across, 1e-14);
    let second = product / select(larger, 1e-14, abs(larger) < 1e-14);
    // A ray along the axis of the cylinder stays within it or without.
    let parallel = across < 1e-13;
    var enter = select(min(first, second), -1e6, parallel) * ground_radius - along;
    var leave = select(max(first, second), 1e6, parallel) * ground_radius - along;
    enter = clamp(enter, 0.0, length);
    leave = clamp(leave, 0.0, length);
    let crosses = select(square > 0.0, lowest < 0.0, parallel);
    let behind = r * to_sun.y + 0.5 * (enter + leave) * nu < 0.0;
    let dark = crosses && behind && leave > enter;
    return AirRay(
        start,
        mu,
        sine,
        nu,
        to_sun.y,
        0.0,
        length,
        select(length, enter, dark),
        select(length, leave, dark),
        select(0u, 1u, ground && end <= max_distance),
    );
}

/// A ray from the eye along the unit vector `dir`, up to `max_distance` from the eye; y is up at the eye, `to_sun` the unit
/// vector to the sun. The eye may be far above the air; a ray that misses the air has length 0.
///
/// domain  ground_radius in [3e6, 1e7] m log
/// domain  top in [5e4, 2e5] m lin
/// domain  eye_altitude in [0, 1e8] m lin
/// domain  dir in [-1, 1] 1 lin
/// domain  to_sun in [-1, 1] 1 lin
/// domain  max_distance in [1, 1e9] m log
/// range   [-1, 1e9] 1
/// error   1e-5 abs of reference::air_ray::air_ray
/// outside undefined
/// source  Bruneton2017 (boundary distances); entry by the tangent altitude: ours
fn air_ray(ground_radius: f32, top: f32, eye_altitude: f32, dir: vec3<f32>, to_sun: vec3<f32>, max_distance: f32) -> AirRay {
    let h = max(eye_altitude, 0.0);
    let parts = zenith_parts(dir);
    let mu = parts.x;
    let sine = parts.y;
    // The horizontal direction of the ray; any will do for a vertical one.
    let horizontal = length(dir.xz);
    let forward = select(vec2<f32>(1.0, 0.0), dir.xz / max(horizontal, 1e-30), horizontal > 1e-30);
    let sun = vec3<f32>(dot(forward, to_sun.xz), to_sun.y, forward.x * to_sun.z - forward.y * to_sun.x);
    if h <= top {
        return ray_inside(ground_radius, top, h, vec2<f32>(sine, mu), sun, max_distance);
    }
    let lowest = tangent_altitude(ground_radius, h, dir);
    if mu >= 0.0 || lowest >= top {
        return AirRay(top, mu, sine, clamp(mu * sun.y + sine * sun.x, -1.0, 1.0), sun.y, 0.0, 0.0, 0.0, 0.0, 0u);
    }
    let half_top = sqrt(max((top - lowest) * (2.0 * ground_radius + top + lowest), 0.0));
    let to_lowest = -(ground_radius + h) * mu;
    let from_eye = (h - top) * (2.0 * ground_radius + h + top) / max(to_lowest + half_top, 1e-20);
    // At the entry the zenith has turned towards the ray; the sun's parts along the ray and across it have not.
    let along = mu * sun.y + sine * sun.x;
    let rise = sine * sun.y - mu * sun.x;
    let entry_mu = -min(half_top / (ground_radius + top), 1.0);
    let entry_sine = min(sine * ((ground_radius + h) / (ground_radius + top)), 1.0);
    let entry_sun = vec3<f32>(entry_sine * along - entry_mu * rise, clamp(entry_mu * along + entry_sine * rise, -1.0, 1.0), sun.z);
    var ray = ray_inside(ground_radius, top, top, vec2<f32>(entry_sine, entry_mu), entry_sun, max_distance - from_eye);
    ray.from_eye = from_eye;
    return ray;
}

/// Altitude at the distance `t` along a ray.
///
/// domain  ground_radius in [3e6, 1e7] m log
/// domain  ray.altitude in [0, 1e5] m lin
/// domain  ray.mu in [-1, 1] 1 lin
/// domain  t in [0, 1e6] m lin
/// range   [-1e7, 1.2e6] m
/// error   0.4 abs of reference::air_ray::ray_altitude
/// outside undefined
/// source  difference of squares divided by the sum of the radii
fn ray_altitude(ground_radius: f32, ray: AirRay, t: f32) -> f32 {
    let r = ground_radius + ray.altitude;
    let gain = t * (t + 2.0 * r * ray.mu);
    return ray.altitude + gain / (r + sqrt(max(r * r + gain, 0.0)));
}

/// Zenith cosine of the sun at the distance `t` along a ray, where the altitude is `altitude`.
///
/// domain  ground_radius in [3e6, 1e7] m log
/// domain  ray.altitude in [0, 1e5] m lin
/// domain  ray.sun_mu in [-1, 1] 1 lin
/// domain  ray.nu in [-1, 1] 1 lin
/// domain  altitude in [0, 1e5] m lin
/// domain  t in [0, 1e6] m lin
/// range   [-1, 1] 1
/// error   5e-7 abs of reference::air_ray::ray_sun_cosine
/// source  elementary
fn ray_sun_cosine(ground_radius: f32, ray: AirRay, altitude: f32, t: f32) -> f32 {
    let r = ground_radius + ray.altitude;
    return clamp((r * ray.sun_mu + t * ray.nu) / (ground_radius + altitude), -1.0, 1.0);
}

/// Distance along a ray to its lowest point: within the ray, so 0 when it rises throughout and its length when it falls.
///
/// domain  ground_radius in [3e6, 1e7] m log
/// domain  ray.altitude in [0, 1e5] m lin
/// domain  ray.mu in [-1, 1] 1 lin
/// domain  ray.length in [0, 2e6] m lin
/// range   [0, 2e6] m
/// error   3e-7 rel of reference::air_ray::lowest_distance
/// source  elementary
fn lowest_distance(ground_radius: f32, ray: AirRay) -> f32 {
    return clamp(-(ground_radius + ray.altitude) * ray.mu, 0.0, ray.length);
}
