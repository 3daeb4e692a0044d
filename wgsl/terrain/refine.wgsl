//! From the baked ground to the field itself, as the pixel's footprint filters it: a last step, or, where texels are wider than footprints, a search of the field wherever a ray comes close to what
//! is baked.
//! And the sun's share over the field itself, for pictures that have to be those of double precision.
//! source   Newton's method; the search: Keinert2014 (steps by the clearance, longer than the steepest slope allows), regula falsi
//! symbols  t distance along the ray [m] · pixel_angle angle of a pixel [rad], so that the footprint is pixel_angle t
#define_import_path veduta::terrain::refine

#import veduta::planet::shell::{up_at, altitude_of}
#import veduta::terrain::clipmap::{Clip, clip_hit, likely_distance}
#import veduta::terrain::field::{Field}
#import veduta::terrain::relief::{land_at}

/// A hit with the slope where the last step to it began.
struct RefinedHit {
    /// Distance [m].
    distance: f32,
    /// Slope along x and z.
    slope: vec2<f32>,
}

/// A hit moved onto the field, by at most `most` metres, in so many steps, and up to as many again while they are longer than a quarter of a footprint. `slope` is that of what was hit; without a step it stays.
///
/// domain  kind in [0, 7] 1 lin
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  eye_altitude in [0, 1e5] m lin
/// domain  origin in [-1e5, 1e5] m lin
/// domain  dir in [-1, 1] 1 lin
/// domain  t in [0, 1e5] m lin
/// domain  pixel_angle in [1e-5, 0.1] 1 log
/// domain  slope in [-100, 100] 1 lin
/// domain  most in [0, 1e4] m lin
/// domain  steps in [0, 4] 1 lin
/// range   [-1e4, 2e5] 1
/// error   0.2 abs of reference::intersect::first_crossing
/// outside undefined
/// source  Newton's method
fn refined_hit(relief: texture_2d<f32>, field: Field, kind: i32, ground_radius: f32, eye_altitude: f32, origin: vec3<f32>, dir: vec3<f32>, t: f32, pixel_angle: f32, slope: vec2<f32>, most: f32, steps: i32) -> RefinedHit {
    var hit = RefinedHit(t, slope);
    var moved = 0.0;
    for (var i = 0; i < 2 * steps; i++) {
        if i >= steps && moved <= 0.25 * pixel_angle * hit.distance {
            break;
        }
        let at = origin + dir * hit.distance;
        let ground = land_at(relief, field, kind, at.xz, pixel_angle * hit.distance);
        let gradient = up_at(ground_radius, eye_altitude, at) - vec3<f32>(ground.slope.x, 0.0, ground.slope.y);
        let clearance = altitude_of(ground_radius, eye_altitude, at) - ground.height;
        hit.slope = ground.slope;
        // The clearance falls along a ray that meets the ground.
        let fall = max(-dot(gradient, dir), 0.02);
        let next = clamp(hit.distance + clearance / fall, max(t - most, 0.0), t + most);
        moved = abs(next - hit.distance);
        hit.distance = next;
    }
    return hit;
}

/// Where a ray from the eye meets the field.
struct FoundHit {
    /// Distance [m]; -1 if nothing is met.
    distance: f32,
    /// Slope along x and z.
    slope: vec2<f32>,
    /// Steps over baked heights.
    steps: i32,
    /// Whether they did not suffice, so that the answer is what is most likely.
    capped: bool,
}

/// A slope that is rarely exceeded along a ray.
const SEARCH_STEEP: f32 = 0.8;
/// A margin of so many texels asks for crests that are a twentieth of a footprint wide.
const EVERY_CREST: f32 = 0.4;

/// Where a ray from the eye meets the field: over baked heights with so many last steps on the field. Where texels are wider than footprints these do not know the field's crests: there, within the
/// margin of what is baked, the field itself is looked for in steps of half a footprint or of the clearance over the slopes that are usual, and bracketed; at most `search_steps` times.
/// A margin of at least 0.4 texels looks for all crests that are a twentieth of a footprint wide: in steps of that, or of the clearance over a slope of 4.
///
/// domain  kind in [0, 7] 1 lin
/// domain  dir in [-1, 1] 1 lin
/// domain  far in [0, 1e6] m lin
/// domain  pixel_angle in [1e-5, 0.1] 1 log
/// domain  max_steps in [0, 10000] 1 lin
/// domain  refine_steps in [0, 4] 1 lin
/// domain  search_steps in [0, 10000] 1 lin
/// range   [-1e6, 1e6] 1
/// error   1 abs of reference::intersect::first_crossing
/// outside undefined
/// source  Tevs2008; Keinert2014; Newton's method
fn found_hit(heights: texture_2d_array<f32>, wrapping: sampler, sectors: texture_2d<f32>, places: texture_2d<f32>, relief: texture_2d<f32>, clip: Clip, field: Field, kind: i32, dir: vec3<f32>, far: f32, pixel_angle: f32, max_steps: i32, refine_steps: i32, search_steps: i32) -> FoundHit {
    let every = clip.margin >= EVERY_CREST;
    let fall = max(select(SEARCH_STEEP, 4.0, every) * length(dir.xz) - dir.y, 0.25);
    let share = select(0.5, 0.05, every);
    let narrow = select(0.6, 0.02, every);
    var near = 0.0;
    var steps = 0;
    var left = select(0, search_steps, clip.margin > 0.0);
    var found = FoundHit(-1.0, vec2<f32>(0.0), 0, false);
    // How far the last steps may lead, and how many there are.
    var most = 0.0;
    var last = refine_steps;
    while true {
        // When no place is left to look at the field, near misses of what is baked are none of its hits.
        let margin = select(0.0, clip.margin, left > 0);
        let hit = clip_hit(heights, wrapping, sectors, places, clip, dir, near, far, margin, max_steps - steps);
        steps += hit.steps;
        if hit.distance < 0.0 || left <= 0 {
            found.capped = hit.distance < 0.0 && steps >= max_steps && hit.reached < far;
            found.distance = likely_distance(clip, dir, hit, far, max_steps - steps + hit.steps);
            found.slope = hit.slope;
            most = 2.0 * hit.spacing;
            break;
        }
        let start = max(hit.distance, near);
        var t = start;
        var back = 1.2;
        var clear = -1.0;
        var clear_by = 0.0;
        var below = -1.0;
        var below_by = 0.0;
        while left > 0 {
            left -= 1;
            let at = dir * t;
            let footprint = pixel_angle * t;
            let clearance = altitude_of(clip.ground_radius, clip.eye_altitude, at) - land_at(relief, field, kind, at.xz, footprint).height;
            if clearance <= 0.0 {
                below = t;
                below_by = clearance;
            } else {
                clear = t;
                clear_by = clearance;
            }
            if below >= 0.0 && clear >= 0.0 {
                t = clear + (below - clear) * clamp(clear_by / max(clear_by - below_by, 1e-9), 0.1, 0.9);
                if below - clear < max(narrow * footprint, 3e-7 * t + 1e-4) {
                    break;
                }
            } else if below >= 0.0 {
                // Below the ground where the search began: back to where it is not.
                if t <= near {
                    break;
                }
                t = max(t - max(0.5 * footprint, back * clearance / -fall), near);
                back *= 2.0;
            } else {
                if t > far || (clearance > clip.margin * hit.spacing && t > start + 2.0 * hit.spacing) {
                    break;
                }
                t += max(share * footprint, clearance / fall);
            }
        }
        // Within the bracket that it has, also when the steps are used up.
        if below >= 0.0 {
            found.distance = t;
            most = min(narrow, 0.5) * pixel_angle * t;
            last = 1;
            break;
        }
        near = t;
    }
    found.steps = steps;
    if found.distance >= 0.0 {
        let refined = refined_hit(relief, field, kind, clip.ground_radius, clip.eye_altitude, vec3<f32>(0.0), dir, max(found.distance, 1e-3), pixel_angle, found.slope, most, last);
        found.distance = refined.distance;
        found.slope = refined.slope;
    }
    return found;
}

/// Share of the sun's disc above the field towards it, from a place on the ground of a footprint: the highest of the horizon's tangents along the sun's azimuth, looked for by half a footprint or a two-hundredth of the
/// distance. `limb` is the disc's angular radius, `highest` a height that no ground exceeds.
///
/// domain  kind in [0, 7] 1 lin
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  at in [-1e5, 1e5] m lin
/// domain  altitude in [-1e4, 1e4] m lin
/// domain  footprint in [1e-2, 1e4] m log
/// domain  to_sun in [-1, 1] 1 lin
/// domain  limb in [1e-6, 0.1] 1 log
/// domain  highest in [-1e4, 2e4] m lin
/// domain  far in [1, 1e6] m log
/// domain  max_steps in [0, 100000] 1 lin
/// range   [0, 1] 1
/// error   1 abs of reference::terrain::soft_shadow
/// outside undefined
/// source  ours: as `land_picture`
fn field_sun_share(relief: texture_2d<f32>, field: Field, kind: i32, ground_radius: f32, at: vec2<f32>, altitude: f32, footprint: f32, to_sun: vec3<f32>, limb: f32, highest: f32, far: f32, max_steps: i32) -> f32 {
    let radius = ground_radius + altitude;
    let level = max(length(to_sun.xz), 1e-6);
    let ahead = to_sun.xz / level;
    var horizon = -1e3;
    var d = footprint;
    for (var i = 0; i < max_steps; i++) {
        let q = d * (d + 2.0 * radius * to_sun.y);
        let above = q / (radius + sqrt(max(radius * radius + q, 0.0)));
        if d >= far || altitude + above >= highest + max(0.02, 1.1 * limb) * d {
            break;
        }
        let width = max(footprint, 0.01 * d);
        let rise = land_at(relief, field, kind, at + ahead * d, width).height - altitude;
        horizon = max(horizon, rise / d - 0.5 * d / radius);
        d += 0.5 * width;
    }
    let above = to_sun.y - horizon * level;
    let apart = above * inverseSqrt(1.0 + horizon * horizon) / limb;
    // More than a right angle above the horizon, of which the sine tells nothing.
    let x = select(clamp(apart, -1.0, 1.0), 1.0, above > 0.0 && level + horizon * to_sun.y < 0.0);
    return 0.5 + x * (0.75 - 0.25 * x * x);
}
