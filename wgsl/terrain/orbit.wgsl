//! Rays over a height field on a ball, seen from far away: the field itself is followed, since a footprint leaves few octaves of it.
//!
//! A ray starts where it comes below the highest ground. From a place where it is clear by c it is clear for c / (L s - r) more, where r is how much of it points up, s
//! how much level, and L the steepest slope: altitude over a ball is convex. That holds of the field, and of the sum of its first octaves, when all that the others can add is taken
//! off c, with the slope of these alone; octaves are added only until the step is long enough. A ray goes half a footprint at the least, as the reference does, and farther when it
//! has used half of its steps: then it counts as one that ran out of them, and does not pass the place where it comes lowest. Between the last clear place and the first that is not, the crossing is bracketed by regula falsi that keeps to the inner four fifths.
//!
//! source   Galin2020 (local Lipschitz bounds); the tangent and the bracket: ours
//! symbols  dir unit direction along the world's axes [1] · pixel_angle angle of a pixel [rad], so that the footprint is pixel_angle t · before what the ray has come already [m]
#define_import_path veduta::terrain::orbit

#import veduta::terrain::clipmap::{likely_end}
#import veduta::terrain::globe::{Globe, GlobeGround, globe_altitude, globe_up, globe_at, globe_frac, globe_octaves}

/// What a ray from the eye found.
struct GlobeHit {
    /// Distance of the hit [m]; -1 if there is none.
    distance: f32,
    /// Unit vector away from the ground along the world's axes.
    normal: vec3<f32>,
    /// The field there.
    ground: GlobeGround,
    /// Steps taken; all of them when the ray ran out of them, or went on by longer steps than are sure.
    steps: i32,
}

/// Distances at which a ray from the eye meets the sphere at an altitude: near, far, and 1 when it does.
///
/// internal
fn globe_span(globe: Globe, dir: vec3<f32>, altitude: f32) -> vec3<f32> {
    let b = (globe.ground_radius + globe.eye_altitude) * dot(dir, globe.up);
    let c = (globe.eye_altitude - altitude) * (2.0 * globe.ground_radius + globe.eye_altitude + altitude);
    let discriminant = b * b - c;
    let root = sqrt(max(discriminant, 0.0));
    let large = select(-b + root, -b - root, b >= 0.0);
    let small = c / select(large, 1.0, large == 0.0);
    return vec3<f32>(min(large, small), max(large, small), select(0.0, 1.0, discriminant >= 0.0));
}

/// Unit vector away from the ground at a place of the altitude.
///
/// internal
fn globe_normal(globe: Globe, at: vec3<f32>, altitude: f32, slope: vec3<f32>) -> vec3<f32> {
    let shrink = globe.ground_radius / (globe.ground_radius + altitude);
    let gradient = globe_up(globe, at) - shrink * slope;
    return gradient * inverseSqrt(max(dot(gradient, gradient), 1e-12));
}

/// First place where a ray from the eye meets the ground before `far`, for a ray that has come `before` metres already, which count for its footprint. A ray that uses up `max_steps`
/// before it comes lowest is taken for what `likely_end` says of it.
///
/// internal
fn globe_hit(globe: Globe, kind: i32, dir: vec3<f32>, before: f32, far: f32, pixel_angle: f32, max_steps: i32) -> GlobeHit {
    var hit = GlobeHit(-1.0, globe.up, GlobeGround(0.0, vec3<f32>(0.0), 0.0), 0);
    // What f32 leaves uncertain about a tangent ray.
    let margin = 2.0 + 5e-7 * (globe.ground_radius + globe.eye_altitude);
    let outer = globe_span(globe, dir, globe.high + margin);
    let inner = globe_span(globe, dir, globe.low - margin);
    let inside = inner.z > 0.0 && inner.y > 0.0;
    let near = max(outer.x, 0.0);
    let end = min(select(outer.y, max(inner.x, 0.0) + margin, inside), far);
    // Here it is nearest to the planet's centre.
    let lowest = -(globe.ground_radius + globe.eye_altitude) * dot(dir, globe.up);
    var count = select(0, max_steps, outer.z > 0.0 && outer.y > 0.0 && near < end);
    var t = near;
    var clear = near;
    var clear_by = 0.0;
    var below = -1.0;
    var below_by = 0.0;
    var hurried = false;
    var done = count == 0;
    while hit.steps < count && !done {
        hit.steps += 1;
        let at = dir * t;
        let footprint = pixel_angle * (before + t);
        let altitude = globe_altitude(globe, at);
        let up = globe_up(globe, at);
        let rise = dot(up, dir);
        let level = sqrt(max(1.0 - rise * rise, 0.0));
        let own = max(0.5 * footprint, 0.05);
        let least = own * exp2(16.0 * max(f32(hit.steps) / f32(max_steps) - 0.5, 0.0));
        let enough = select(4.0 * least, 1e30, below >= 0.0);
        let probe = globe_octaves(globe, kind, globe.cell, globe_frac(globe, at, altitude), up, footprint, altitude, rise, level, enough);
        let early = probe.step >= enough;
        let ground = probe.ground;
        let clearance = select(altitude - ground.height, probe.clear, early);
        if clearance <= 0.0 {
            below = t;
            below_by = clearance;
        } else {
            clear = t;
            clear_by = clearance;
        }
        if below >= 0.0 && (abs(clearance) < 0.01 * footprint || below - clear < 0.01 * footprint) {
            done = true;
            hit.distance = t;
            hit.ground = ground;
            hit.normal = globe_normal(globe, at, altitude, ground.slope);
        } else if below >= 0.0 {
            t = clear + (below - clear) * clamp(clear_by / max(clear_by - below_by, 1e-9), 0.1, 0.9);
        } else {
            let full = select(clearance / max(globe.steepest * level - rise, 1e-3), 0.0, early);
            let safe = max(max(probe.step, full), own);
            done = t >= end;
            let longer = safe < least && !done;
            hurried = hurried || longer;
            let next = t + max(safe, least);
            // A longer step may pass a crest, but not where the ray comes lowest.
            let stop = select(end, min(end, lowest), longer && t + own < lowest);
            t = min(next, stop);
        }
    }
    if !done {
        let start = dir * near;
        let last = dir * clear;
        let left = globe_altitude(globe, last) - globe_at(globe, kind, last, pixel_angle * (before + clear)).height;
        let likely = likely_end(globe.ground_radius, globe_altitude(globe, start), dot(globe_up(globe, start), dir), clear - near, left, far - near);
        // A ray that is clear where it comes lowest rises from there on.
        hit.distance = select(select(-1.0, near + likely, likely >= 0.0 && clear < lowest), t, below >= 0.0);
        let at = dir * max(hit.distance, 0.0);
        hit.ground = globe_at(globe, kind, at, pixel_angle * (before + max(hit.distance, 0.0)));
        hit.normal = globe_normal(globe, at, globe_altitude(globe, at), hit.ground.slope);
    }
    // All steps mean that there were too few.
    hit.steps = select(min(hit.steps, max_steps - 1), max_steps, hurried || !done);
    return hit;
}

/// How much of a uniform sky's light arrives between the heights around a place of the ground, as `veduta::terrain::sky_share` has it. In each sector the horizon is the highest of six heights, each 2.5 times
/// as far as the one before it and filtered by a quarter of its distance, the ground's own plane, and the level. `east` and `south` lie along the ground, `slope` goes along them.
///
/// internal
fn globe_sky_share(globe: Globe, kind: i32, origin: vec3<f32>, east: vec3<f32>, south: vec3<f32>, slope: vec2<f32>, footprint: f32, sectors: i32) -> f32 {
    var sum = 0.0;
    for (var i = 0; i < sectors; i++) {
        let turn = 6.283185307 * (f32(i) + 0.5) / f32(sectors);
        let dir = vec2<f32>(cos(turn), sin(turn));
        let g = dot(slope, dir);
        // No sky is below the level.
        var tangent = max(g, 0.0);
        var t = 4.0 * footprint;
        for (var k = 0; k < 6; k++) {
            let at = origin + t * (dir.x * east + dir.y * south);
            let rise = (globe_at(globe, kind, at, max(footprint, 0.25 * t)).height - globe_altitude(globe, at)) / t;
            tangent = max(tangent, rise);
            t *= 2.5;
        }
        let square = 1.0 / (1.0 + tangent * tangent);
        sum += square - g * (1.570796327 - atan(tangent) - tangent * square);
    }
    return select(1.0, max(sum, 0.0) / f32(max(sectors, 1)), sectors > 0);
}

/// Half the height, in metres across a shadow's border on the ground, over which the clearance of a ray towards a light varies within a pixel of which `dir` is the view and `footprint` the width: the ground's slope
/// and the light's against each other, along both sides of what the pixel covers. Second, by how much the clearance over level ground of that slope grows towards the light, per metre.
///
/// internal
fn globe_border(up: vec3<f32>, slope: vec3<f32>, to_light: vec3<f32>, dir: vec3<f32>, footprint: f32) -> vec2<f32> {
    let mu = dot(up, to_light);
    let towards = to_light - mu * up;
    let level = max(length(towards), 0.05);
    let change = slope - towards * (clamp(mu / level, 0.0, 4.0) / level);
    // A pixel covers more ground along the view the more the ground slants.
    let facing = (dot(slope, dir) - dot(up, dir)) * inverseSqrt(1.0 + dot(slope, slope));
    let ahead = dir - dot(up, dir) * up;
    let forth = ahead / max(length(ahead), 1e-3);
    let along = dot(change, forth) / max(facing, 0.1);
    let aside = dot(change, cross(up, forth));
    return vec2<f32>(0.3 * footprint * sqrt(along * along + aside * aside), max(mu - dot(slope, towards), 0.0));
}

/// Share of the disc of a light of the angular radius whose tangent is `width` that is seen from a place on the ground of the footprint `footprint`, with its [`globe_border`]. Steps grow with the distance
/// and the clearance.
///
/// internal
fn globe_shadow(globe: Globe, kind: i32, origin: vec3<f32>, to_light: vec3<f32>, width: f32, footprint: f32, border: vec2<f32>, max_steps: i32) -> f32 {
    var least = 1.0;
    var t = 1.5 * footprint;
    for (var i = 0; i < max_steps; i++) {
        let at = origin + to_light * t;
        let altitude = globe_altitude(globe, at);
        let up = globe_up(globe, at);
        let rise = dot(up, to_light);
        if least <= -1.0 || (rise >= 0.0 && altitude > globe.high) {
            break;
        }
        let level = sqrt(max(1.0 - rise * rise, 0.0));
        let own = max(min(footprint, 0.35 * t), 0.04 * t);
        let probe = globe_octaves(globe, kind, globe.cell, globe_frac(globe, at, altitude), up, footprint + 0.5 * width * t, altitude, rise, level, 4.0 * own);
        let early = probe.step >= 4.0 * own;
        let clearance = select(altitude - probe.ground.height, probe.clear, early);
        // The shadow's border is as wide as the penumbra and what varies within the pixel, but no level ground shades itself.
        least = min(least, clearance / (width * t + min(border.x, 0.5 * border.y * t)));
        t += max(max(select(1.2 * clearance, 0.0, early), probe.step), own);
    }
    let x = clamp(least, -1.0, 1.0);
    return clamp(0.5 + x * (0.75 - 0.25 * x * x), 0.0, 1.0);
}
