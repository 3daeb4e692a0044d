//! Rays, altitudes and shells around a spherical planet, with altitudes instead of radii so that nothing cancels.
//! source   Bruneton2017 (boundary distances); altitude form: ours
//! symbols  h altitude of the ray's start [m] · mu its zenith cosine [1] · t distance along it [m] · level altitude of a sphere [m]
#define_import_path veduta::planet::shell

/// The two distances at which a ray meets a sphere; `near > far` when it misses.
struct Span {
    /// First root [m]; negative behind the start.
    near: f32,
    /// Second root [m].
    far: f32,
}

/// The part of a ray that lies inside a shell: [near, far] without (gap_near, gap_far), where it dips below the shell.
/// Empty when `near >= far`; without a gap both gap members equal `far`.
struct ShellSegment {
    /// Entry [m].
    near: f32,
    /// Exit [m].
    far: f32,
    /// Start of the stretch below the shell [m].
    gap_near: f32,
    /// End of the stretch below the shell [m].
    gap_far: f32,
}

/// Altitude at distance `t` along a ray.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  h in [0, 1e5] m lin
/// domain  mu in [-1, 1] 1 lin
/// domain  t in [0, 1e6] m lin
/// range   [-1e8, 1.2e6] m
/// error   0.4 abs of reference::planet::altitude_along
/// outside undefined
/// source  difference of squares divided by the sum of the radii
fn altitude_along(ground_radius: f32, h: f32, mu: f32, t: f32) -> f32 {
    let r = ground_radius + h;
    let q = t * (t + 2.0 * r * mu);
    return h + q / (r + sqrt(max(r * r + q, 0.0)));
}

/// Altitude of a point given relative to the eye, +Y up at the eye.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  eye_altitude in [0, 1e5] m lin
/// domain  relative in [-5e5, 5e5] m lin
/// range   [-1e6, 2e6] m
/// error   0.4 abs of reference::planet::altitude_of
/// outside undefined
/// source  difference of squares divided by the sum of the radii
fn altitude_of(ground_radius: f32, eye_altitude: f32, relative: vec3<f32>) -> f32 {
    let r = ground_radius + eye_altitude;
    let q = dot(relative, relative) + 2.0 * r * relative.y;
    return eye_altitude + q / (r + sqrt(max(r * r + q, 0.0)));
}

/// Unit vector away from the planet's centre at a point given relative to the eye.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  eye_altitude in [0, 1e5] m lin
/// domain  relative in [-5e5, 5e5] m lin
/// range   [-1, 1] 1
/// error   5e-7 abs of reference::planet::up_at
/// source  elementary
fn up_at(ground_radius: f32, eye_altitude: f32, relative: vec3<f32>) -> vec3<f32> {
    let outward = relative + vec3<f32>(0.0, ground_radius + eye_altitude, 0.0);
    return outward * inverseSqrt(max(dot(outward, outward), 1e-12));
}

/// Zenith cosine, at distance `t` along a ray, of a fixed direction (towards the sun, say) that has the zenith cosine
/// `direction_mu` at the ray's start and the cosine `nu` with the ray; `altitude` is the ray's altitude at `t`.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  h in [0, 1e5] m lin
/// domain  altitude in [0, 1e5] m lin
/// domain  direction_mu in [-1, 1] 1 lin
/// domain  nu in [-1, 1] 1 lin
/// domain  t in [0, 1e6] m lin
/// range   [-1, 1] 1
/// error   5e-7 abs of reference::planet::direction_cosine_along
/// source  elementary
fn direction_cosine_along(ground_radius: f32, h: f32, altitude: f32, direction_mu: f32, nu: f32, t: f32) -> f32 {
    return clamp(((ground_radius + h) * direction_mu + t * nu) / (ground_radius + altitude), -1.0, 1.0);
}

/// Distances at which a ray meets the sphere at altitude `level`.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  level in [0, 1e5] m lin
/// domain  h in [0, 1e5] m lin
/// domain  mu in [-1, 1] 1 lin
/// range   [-2.1e8, 2.1e8] m
/// error   1e-3 rel of reference::planet::sphere_span
/// outside undefined
/// source  quadratic without cancellation; near a tangent ray the square root doubles the relative rounding's exponent
fn sphere_span(ground_radius: f32, level: f32, h: f32, mu: f32) -> Span {
    let b = (ground_radius + h) * mu;
    let c = (h - level) * (2.0 * ground_radius + h + level);
    let discriminant = b * b - c;
    let root = sqrt(max(discriminant, 0.0));
    let large = select(-b + root, -b - root, b >= 0.0);
    let small = c / select(large, 1.0, large == 0.0);
    let span = Span(min(large, small), max(large, small));
    if discriminant < 0.0 {
        return Span(1.0, -1.0);
    }
    return span;
}

/// Distance from altitude `h`, along zenith cosine `mu`, to the top of the shell.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  top in [1e5, 2e5] m lin
/// domain  h in [0, 1e5] m lin
/// domain  mu in [-1, 1] 1 lin
/// range   [0, 2.1e8] m
/// error   6e-7 rel of reference::planet::top_distance
/// outside undefined
/// source  Bruneton2017 DistanceToTopAtmosphereBoundary; departs: altitude instead of radius
fn top_distance(ground_radius: f32, top: f32, h: f32, mu: f32) -> f32 {
    let b = (ground_radius + h) * mu;
    let c = max(top - h, 0.0) * (2.0 * ground_radius + top + h);
    let root = sqrt(b * b + c);
    return select(root - b, c / max(b + root, 1e-20), b > 0.0);
}

/// Distance from altitude `h` >= 0, along zenith cosine `mu`, to the ground sphere; -1 when the ray misses it.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  h in [0, 1e5] m lin
/// domain  mu in [-1, 1] 1 lin
/// range   [-1, 5e6] m
/// error   1e-3 rel of reference::planet::ground_distance
/// outside undefined
/// source  Bruneton2017 DistanceToBottomAtmosphereBoundary; departs: altitude instead of radius
fn ground_distance(ground_radius: f32, h: f32, mu: f32) -> f32 {
    let b = (ground_radius + h) * mu;
    let c = h * (2.0 * ground_radius + h);
    let discriminant = b * b - c;
    let met = c / max(sqrt(max(discriminant, 0.0)) - b, 1e-20);
    return select(-1.0, met, b < 0.0 && discriminant >= 0.0);
}

/// The part of a ray between the spheres at altitudes `bottom` and `top`, from a start below, inside or above them;
/// the ground sphere ends the ray.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  bottom in [100, 5e3] m lin
/// domain  top in [6e3, 2e4] m lin
/// domain  h in [0, 1e5] m lin
/// domain  mu in [-1, 1] 1 lin
/// range   [0, 1e7] m
/// error   1e-3 rel of reference::planet::shell_segment
/// outside undefined
/// source  interval logic: ours
fn shell_segment(ground_radius: f32, bottom: f32, top: f32, h: f32, mu: f32) -> ShellSegment {
    let outer = sphere_span(ground_radius, top, h, mu);
    let inner = sphere_span(ground_radius, bottom, h, mu);
    let meets_ground = ground_distance(ground_radius, h, mu) >= 0.0;
    let entry = max(outer.near, 0.0);
    let exit = outer.far;
    if exit <= entry {
        return ShellSegment(0.0, 0.0, 0.0, 0.0);
    }
    if inner.far <= 0.0 {
        return ShellSegment(entry, exit, exit, exit);
    }
    if inner.near <= 0.0 {
        // The start is below the shell.
        if meets_ground {
            return ShellSegment(0.0, 0.0, 0.0, 0.0);
        }
        return ShellSegment(inner.far, exit, exit, exit);
    }
    if meets_ground {
        return ShellSegment(entry, inner.near, inner.near, inner.near);
    }
    return ShellSegment(entry, exit, inner.near, inner.far);
}

/// A segment shortened to end at `max_distance`.
///
/// domain  max_distance in [0, 1e6] m lin
/// range   [0, 1e6] m
/// error   0 abs of reference::planet::clip_segment
/// source  elementary
fn clip_segment(segment: ShellSegment, max_distance: f32) -> ShellSegment {
    let limit = max(max_distance, 0.0);
    return ShellSegment(min(segment.near, limit), min(segment.far, limit), min(segment.gap_near, limit), min(segment.gap_far, limit));
}

/// Length of a segment without its gap.
///
/// range   [0, 1e7] m
/// error   3e-7 rel of reference::planet::segment_length
/// source  elementary
fn segment_length(segment: ShellSegment) -> f32 {
    return max((segment.gap_near - segment.near) + (segment.far - segment.gap_far), 0.0);
}

/// Distance along the ray at the length `s` into a segment; the gap is leapt over.
///
/// domain  s in [0, 1e6] m lin
/// range   [0, 1e7] m
/// error   4e-7 rel of reference::planet::segment_distance
/// monotone s
/// source  elementary
fn segment_distance(segment: ShellSegment, s: f32) -> f32 {
    let t = segment.near + s;
    return t + select(0.0, segment.gap_far - segment.gap_near, t > segment.gap_near);
}
