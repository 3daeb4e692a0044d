//! Rays inside the air of a planet, by vectors from the planet's centre. Lengths in metres.

use super::math::{add, dot, length, normalize, scale};

/// A ray inside the air, from its start to its end there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AirRay {
    /// Altitude of the start.
    pub altitude: f64,
    /// Zenith cosine at the start.
    pub mu: f64,
    /// Zenith sine at the start.
    pub sine: f64,
    /// Cosine between the ray and the direction to the sun.
    pub nu: f64,
    /// Zenith cosine of the sun at the start.
    pub sun_mu: f64,
    /// Distance from the eye to the start.
    pub from_eye: f64,
    /// Distance from the start to the end; 0 for a ray that misses the air.
    pub length: f64,
    /// Where the ray enters the planet's shadow.
    pub dark_from: f64,
    /// Where it leaves the shadow; not above `dark_from` when the ray is lit throughout.
    pub dark_to: f64,
    /// 1 when the ray ends on the ground, else 0.
    pub meets_ground: u32,
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Zenith cosine and sine of a unit vector; of its vertical and its horizontal part the smaller is exact.
pub fn zenith_parts(dir: [f64; 3]) -> [f64; 2] {
    let d = unit(dir);
    [d[1], d[0].hypot(d[2])]
}

/// The unit vector whose smaller part, vertical or horizontal, is that of `dir`.
fn unit(dir: [f64; 3]) -> [f64; 3] {
    let aside = dir[0].hypot(dir[2]).min(1.0);
    let y = dir[1].clamp(-1.0, 1.0);
    if y * y < 0.5 {
        let stretch = (1.0 - y * y).sqrt() / dir[0].hypot(dir[2]);
        return [dir[0] * stretch, y, dir[2] * stretch];
    }
    [dir[0], (1.0 - aside * aside).sqrt().copysign(y), dir[2]]
}

/// Altitude of the point of a line that is closest to the planet's centre.
pub fn tangent_altitude(ground_radius: f64, h: f64, dir: [f64; 3]) -> f64 {
    (ground_radius + h) * zenith_parts(dir)[1] - ground_radius
}

/// Distances at which a line from `place` (from the centre) meets a sphere about the centre.
fn sphere(place: [f64; 3], dir: [f64; 3], radius: f64) -> Option<[f64; 2]> {
    let middle = -dot(place, dir);
    let closest = length(add(place, scale(dir, middle)));
    let square = (radius - closest) * (radius + closest);
    (square > 0.0).then(|| [middle - square.sqrt(), middle + square.sqrt()])
}

/// The stretch of a ray of a length that lies behind the ground sphere as seen from the sun; `None` if there is none.
fn shadow(
    place: [f64; 3],
    dir: [f64; 3],
    to_sun: [f64; 3],
    ground_radius: f64,
    end: f64,
) -> Option<[f64; 2]> {
    // Distance from the axis of the shadow: the parts of place and direction across to the sun.
    let flat = |v: [f64; 3]| add(v, scale(to_sun, -dot(v, to_sun)));
    let (p, d) = (flat(place), flat(dir));
    let (a, b, c) = (
        dot(d, d),
        dot(p, d),
        (length(p) - ground_radius) * (length(p) + ground_radius),
    );
    let [from, to] = if a < 1e-26 {
        if c >= 0.0 {
            return None;
        }
        [0.0, end]
    } else {
        // The discriminant from the distance of the two axes, for nothing is lost there.
        let between = dot(place, cross(dir, to_sun));
        let square = (ground_radius * a.sqrt() - between) * (ground_radius * a.sqrt() + between);
        if square <= 0.0 {
            return None;
        }
        let larger = -(b + square.sqrt().copysign(b));
        let roots = [larger / a, c / larger];
        [roots[0].min(roots[1]), roots[0].max(roots[1])]
    };
    let (from, to) = (from.clamp(0.0, end), to.clamp(0.0, end));
    let middle = add(place, scale(dir, 0.5 * (from + to)));
    (to > from && dot(middle, to_sun) < 0.0).then_some([from, to])
}

/// The ray from a place of the given altitude inside the air, up to `max_distance`; `dir` and `to_sun` in a frame with y up
/// there, `dir` by x and y.
pub fn ray_inside(
    ground_radius: f64,
    top: f64,
    h: f64,
    dir: [f64; 2],
    to_sun: [f64; 3],
    max_distance: f64,
) -> AirRay {
    let h = h.clamp(0.0, top);
    let place = [0.0, ground_radius + h, 0.0];
    trace(
        ground_radius,
        top,
        place,
        [dir[0], dir[1], 0.0],
        normalize(to_sun),
        max_distance,
    )
}

/// The ray from a place (from the centre) inside the air or on its border.
fn trace(
    ground_radius: f64,
    top: f64,
    place: [f64; 3],
    dir: [f64; 3],
    to_sun: [f64; 3],
    max_distance: f64,
) -> AirRay {
    let dir = normalize(dir);
    let up = normalize(place);
    let mu = dot(up, dir);
    let altitude = length(place) - ground_radius;
    let mut end = sphere(place, dir, ground_radius + top).map_or(0.0, |span| span[1].max(0.0));
    let ground = sphere(place, dir, ground_radius).filter(|_| mu < 0.0);
    if let Some(span) = ground {
        end = span[0].max(0.0);
    }
    let meets = ground.is_some() && end <= max_distance;
    let end = end.min(max_distance).max(0.0);
    let [dark_from, dark_to] = shadow(place, dir, to_sun, ground_radius, end).unwrap_or([end, end]);
    AirRay {
        altitude,
        mu,
        sine: length(cross(up, dir)),
        nu: dot(dir, to_sun),
        sun_mu: dot(up, to_sun),
        from_eye: 0.0,
        length: end,
        dark_from,
        dark_to,
        meets_ground: u32::from(meets),
    }
}

/// The ray from the eye along `dir`, up to `max_distance` from the eye; y is up at the eye, which may be above the air.
pub fn air_ray(
    ground_radius: f64,
    top: f64,
    eye_altitude: f64,
    dir: [f64; 3],
    to_sun: [f64; 3],
    max_distance: f64,
) -> AirRay {
    let h = eye_altitude.max(0.0);
    let dir = unit(dir);
    let to_sun = normalize(to_sun);
    let eye = [0.0, ground_radius + h, 0.0];
    if h <= top {
        return trace(ground_radius, top, eye, dir, to_sun, max_distance);
    }
    match sphere(eye, dir, ground_radius + top) {
        Some([from_eye, _]) if dir[1] < 0.0 => AirRay {
            from_eye,
            ..trace(
                ground_radius,
                top,
                add(eye, scale(dir, from_eye)),
                dir,
                to_sun,
                max_distance - from_eye,
            )
        },
        _ => AirRay {
            altitude: top,
            mu: dir[1],
            sine: dir[0].hypot(dir[2]),
            nu: dot(dir, to_sun),
            sun_mu: to_sun[1],
            from_eye: 0.0,
            length: 0.0,
            dark_from: 0.0,
            dark_to: 0.0,
            meets_ground: 0,
        },
    }
}

/// Altitude at the distance `t` along a ray.
pub fn ray_altitude(ground_radius: f64, ray: &AirRay, t: f64) -> f64 {
    super::planet::altitude_along(ground_radius, ray.altitude, ray.mu, t)
}

/// Zenith cosine of the sun at the distance `t` along a ray, where the altitude is `altitude`.
pub fn ray_sun_cosine(ground_radius: f64, ray: &AirRay, altitude: f64, t: f64) -> f64 {
    super::planet::direction_cosine_along(
        ground_radius,
        ray.altitude,
        altitude,
        ray.sun_mu,
        ray.nu,
        t,
    )
}

/// Distance along a ray to its lowest point.
pub fn lowest_distance(ground_radius: f64, ray: &AirRay) -> f64 {
    (-(ground_radius + ray.altitude) * ray.mu).clamp(0.0, ray.length)
}
