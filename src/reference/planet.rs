//! Rays, altitudes and shells around a spherical planet. Lengths in metres; `h` is the altitude of the ray's start and
//! `mu` its zenith cosine.

use super::math::{dot, length, scale};

/// The two distances at which a ray meets a sphere; `near > far` when it misses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// First root; negative behind the start.
    pub near: f64,
    /// Second root.
    pub far: f64,
}

/// The part of a ray inside a shell: [near, far] without (gap_near, gap_far).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShellSegment {
    /// Entry.
    pub near: f64,
    /// Exit.
    pub far: f64,
    /// Start of the stretch below the shell; `far` without one.
    pub gap_near: f64,
    /// End of the stretch below the shell; `far` without one.
    pub gap_far: f64,
}

/// Altitude at distance `t` along a ray: the distance to the centre less the radius.
pub fn altitude_along(ground_radius: f64, h: f64, mu: f64, t: f64) -> f64 {
    let (up, aside) = (
        ground_radius + h + mu * t,
        (1.0 - mu * mu).max(0.0).sqrt() * t,
    );
    up.hypot(aside) - ground_radius
}

/// Altitude of a point given relative to the eye.
pub fn altitude_of(ground_radius: f64, eye_altitude: f64, relative: [f64; 3]) -> f64 {
    length([
        relative[0],
        relative[1] + ground_radius + eye_altitude,
        relative[2],
    ]) - ground_radius
}

/// Unit vector away from the planet's centre.
pub fn up_at(ground_radius: f64, eye_altitude: f64, relative: [f64; 3]) -> [f64; 3] {
    super::math::normalize([
        relative[0],
        relative[1] + ground_radius + eye_altitude,
        relative[2],
    ])
}

/// Zenith cosine at distance `t` along a ray of a direction that has `direction_mu` at its start and the cosine `nu` with it.
pub fn direction_cosine_along(
    ground_radius: f64,
    h: f64,
    altitude: f64,
    direction_mu: f64,
    nu: f64,
    t: f64,
) -> f64 {
    (((ground_radius + h) * direction_mu + t * nu) / (ground_radius + altitude)).clamp(-1.0, 1.0)
}

/// Distances at which a ray meets the sphere at altitude `level`.
pub fn sphere_span(ground_radius: f64, level: f64, h: f64, mu: f64) -> Span {
    let r = ground_radius + h;
    let closest = r * (1.0 - mu * mu).max(0.0).sqrt();
    let radius = ground_radius + level;
    let half = (radius - closest) * (radius + closest);
    if half < 0.0 {
        return Span {
            near: 1.0,
            far: -1.0,
        };
    }
    Span {
        near: -r * mu - half.sqrt(),
        far: -r * mu + half.sqrt(),
    }
}

/// Distance to the top of the shell.
pub fn top_distance(ground_radius: f64, top: f64, h: f64, mu: f64) -> f64 {
    let h = h.min(top);
    // The roots of t^2 + 2 b t - c = 0; their product is -c, and upwards the far one is a small difference.
    let b = (ground_radius + h) * mu;
    let c = (top - h) * (2.0 * ground_radius + top + h);
    let root = (b * b + c).sqrt();
    if b > 0.0 { c / (b + root) } else { root - b }
}

/// Distance to the ground sphere; -1 when the ray misses it.
pub fn ground_distance(ground_radius: f64, h: f64, mu: f64) -> f64 {
    let span = sphere_span(ground_radius, 0.0, h, mu);
    if mu < 0.0 && span.near <= span.far {
        span.near.max(0.0)
    } else {
        -1.0
    }
}

/// The part of a ray between the spheres at `bottom` and `top`: the crossings of the three spheres in order, and of the
/// stretches between them those whose middle lies in the shell, up to the ground.
pub fn shell_segment(ground_radius: f64, bottom: f64, top: f64, h: f64, mu: f64) -> ShellSegment {
    let ground = ground_distance(ground_radius, h, mu);
    let end = if ground >= 0.0 { ground } else { f64::INFINITY };
    let mut crossings = vec![0.0];
    for level in [bottom, top] {
        let span = sphere_span(ground_radius, level, h, mu);
        if span.near <= span.far {
            crossings.extend([span.near, span.far]);
        }
    }
    crossings.retain(|t| (0.0..=end).contains(t));
    crossings.sort_by(f64::total_cmp);
    let mut stretches: Vec<(f64, f64)> = Vec::new();
    for pair in crossings.windows(2) {
        let altitude = altitude_along(ground_radius, h, mu, 0.5 * (pair[0] + pair[1]));
        if pair[1] > pair[0] && (bottom..=top).contains(&altitude) {
            stretches.push((pair[0], pair[1]));
        }
    }
    match stretches[..] {
        [] => ShellSegment {
            near: 0.0,
            far: 0.0,
            gap_near: 0.0,
            gap_far: 0.0,
        },
        [(near, far)] => ShellSegment {
            near,
            far,
            gap_near: far,
            gap_far: far,
        },
        [(near, gap_near), (gap_far, far), ..] => ShellSegment {
            near,
            far,
            gap_near,
            gap_far,
        },
    }
}

/// A segment shortened to end at `max_distance`.
pub fn clip_segment(segment: ShellSegment, max_distance: f64) -> ShellSegment {
    let clip = |t: f64| t.min(max_distance.max(0.0));
    ShellSegment {
        near: clip(segment.near),
        far: clip(segment.far),
        gap_near: clip(segment.gap_near),
        gap_far: clip(segment.gap_far),
    }
}

/// Length of a segment without its gap.
pub fn segment_length(segment: ShellSegment) -> f64 {
    (segment.far - segment.near - (segment.gap_far - segment.gap_near)).max(0.0)
}

/// Distance along the ray at the length `s` into a segment.
pub fn segment_distance(segment: ShellSegment, s: f64) -> f64 {
    let t = segment.near + s;
    if t > segment.gap_near {
        t + segment.gap_far - segment.gap_near
    } else {
        t
    }
}

/// Altitude of the point `dir * t`, for callers that hold a direction.
pub fn altitude_on(ground_radius: f64, eye_altitude: f64, dir: [f64; 3], t: f64) -> f64 {
    debug_assert!((dot(dir, dir) - 1.0).abs() < 1e-6);
    altitude_of(ground_radius, eye_altitude, scale(dir, t))
}
