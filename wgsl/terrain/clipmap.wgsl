//! Rays over baked heights: nested levels around the eye, each with the maxima of its blocks.
//!
//! Level l has texels of `spacing` 2^l metres, heights at their lower corners; it serves places whose larger coordinate is within `reach` texels of the
//! eye, and is addressed modulo its size, so that texels stay where they are when the eye moves. A ray first leaves whole levels that lie below it, then a block of 32, of 8 or of 1 texel at a time:
//! the largest whose maximum lies below the ray's altitude on its way through, of which the tangent is a lower bound, since altitude over a sphere is
//! convex. In a single texel the patch between its corners is bilinear.
//!
//! source   Tevs2008 (maximum mipmaps); Losasso2004 (clipmaps); the tangent's bound: ours
//! symbols  t distance along the ray [m] · origin its start relative to the eye [m] · level of the clipmap [1]
#define_import_path veduta::terrain::clipmap

#import veduta::planet::shell::{up_at, altitude_of}

/// What the rays need to know of the levels.
struct Clip {
    /// Radius of the planet [m].
    ground_radius: f32,
    /// Altitude of the eye [m].
    eye_altitude: f32,
    /// Spacing of the texels of level 0 [m].
    spacing: f32,
    /// Half the width of what a level serves, in its texels.
    reach: f32,
    /// No baked height is above [m].
    top: f32,
    /// Texels of a level's side, a power of two.
    texels: i32,
    /// The finest level that is baked.
    first: i32,
    /// Levels.
    levels: i32,
}

/// What a ray found.
struct ClipHit {
    /// Distance of the hit [m]; -1 if there is none.
    distance: f32,
    /// Distance up to which the ray was followed [m].
    reached: f32,
    /// Clearance there [m].
    clearance: f32,
    /// Spacing of the texel that was hit [m].
    spacing: f32,
    /// Steps taken.
    steps: i32,
}

/// The level that serves a place, given relative to the eye; from `levels` on there is none.
///
/// internal
fn level_of(clip: Clip, at: vec2<f32>) -> i32 {
    let far = max(abs(at.x), abs(at.y)) / (clip.reach * clip.spacing);
    // The binary exponent, plus one: 0 below 1.
    return max((bitcast<i32>(far) >> 23u) - 126, clip.first);
}

/// The heights at the corners of a texel: lower, next in x, next in z, opposite.
///
/// internal
fn corners(heights: texture_2d_array<f32>, clip: Clip, cell: vec2<i32>, level: i32) -> vec4<f32> {
    let mask = vec2<i32>(clip.texels - 1);
    let low = cell & mask;
    let high = (cell + 1) & mask;
    return vec4<f32>(
        textureLoad(heights, low, level, 0).x,
        textureLoad(heights, vec2<i32>(high.x, low.y), level, 0).x,
        textureLoad(heights, vec2<i32>(low.x, high.y), level, 0).x,
        textureLoad(heights, high, level, 0).x,
    );
}

/// The bilinear patch at a fraction of the texel.
///
/// internal
fn patch_height(h: vec4<f32>, f: vec2<f32>) -> f32 {
    let low = h.x + f.x * (h.y - h.x);
    let high = h.z + f.x * (h.w - h.z);
    return low + f.y * (high - low);
}

/// Baked height at a place relative to the eye, from the level that serves it or a coarser one.
///
/// domain  at in [-1e6, 1e6] m lin
/// domain  least in [0, 15] 1 lin
/// range   [-1e5, 1e5] m
/// error   1 abs of reference::field::ground
/// outside undefined
/// source  Losasso2004
fn baked_height(heights: texture_2d_array<f32>, places: texture_2d<f32>, clip: Clip, at: vec2<f32>, least: i32) -> f32 {
    let level = min(max(level_of(clip, at), least), clip.levels - 1);
    let place = textureLoad(places, vec2<i32>(level, 0), 0);
    let u = place.xy + at * place.z;
    let whole = floor(u);
    return patch_height(corners(heights, clip, vec2<i32>(whole), level), u - whole);
}

/// First place where a ray from `origin` meets the baked ground between `near` and `far`. A ray that uses up `max_steps` has no hit, but tells how
/// far it came. Below the maxima of blocks of 32 in `coarse` stands that of the level. Rays that rise above the highest of the heights end there.
///
/// domain  origin in [-1e6, 1e6] m lin
/// domain  dir in [-1, 1] 1 lin
/// domain  near in [0, 1e6] m lin
/// domain  far in [0, 1e6] m lin
/// domain  max_steps in [0, 10000] 1 lin
/// range   [-1e6, 1e6] m
/// error   1 abs of reference::intersect::first_crossing
/// outside undefined
/// source  Tevs2008; departs: clipmap, blocks of four sizes, tangents for altitudes
fn clip_hit(heights: texture_2d_array<f32>, fine: texture_2d_array<f32>, coarse: texture_2d_array<f32>, places: texture_2d<f32>, clip: Clip,
    origin: vec3<f32>, dir: vec3<f32>, near: f32, far: f32, max_steps: i32) -> ClipHit {
    var hit = ClipHit(-1.0, near, 0.0, clip.spacing, 0);
    let start = altitude_of(clip.ground_radius, clip.eye_altitude, origin);
    let mu = dot(dir, up_at(clip.ground_radius, clip.eye_altitude, origin));
    let radius = clip.ground_radius + start;
    let flat = select(dir.xz, vec2<f32>(1e-6), abs(dir.xz) < vec2<f32>(1e-6));
    let inverse = 1.0 / flat;
    let side = select(vec2<f32>(0.0), vec2<f32>(1.0), flat > vec2<f32>(0.0));
    let fine_mask = vec2<i32>(clip.texels / 8 - 1);
    let coarse_mask = vec2<i32>(clip.texels / 32 - 1);
    var t = near;
    // Levels that lie below the ray as far as they serve it.
    for (var i = 0; i < clip.levels; i++) {
        let q = t * (t + 2.0 * radius * mu);
        let root = sqrt(max(radius * radius + q, 0.0));
        let altitude = start + q / (radius + root);
        let rise = (radius * mu + t) / root;
        let at = origin.xz + dir.xz * t;
        let level = level_of(clip, at);
        let spacing = textureLoad(places, vec2<i32>(level, 0), 0).w;
        let leave = ((2.0 * side - 1.0) * clip.reach * spacing - at) * inverse + abs(inverse) * spacing * 1e-3;
        let step = min(leave.x, leave.y);
        if level >= clip.levels || altitude + min(rise * step, 0.0) <= textureLoad(coarse, vec2<i32>(0, clip.texels / 32), level, 0).x {
            break;
        }
        t += step;
    }
    hit.reached = t;
    var done = false;
    while hit.steps < max_steps && !done {
        // Blocks of 32 and of 8 texels, up to one of 8 that may be met.
        var level = 0;
        var place = vec4<f32>(0.0);
        var end = 0.0;
        while hit.steps < max_steps {
            let q = t * (t + 2.0 * radius * mu);
            let root = sqrt(max(radius * radius + q, 0.0));
            let altitude = start + q / (radius + root);
            let rise = (radius * mu + t) / root;
            let at = origin.xz + dir.xz * t;
            level = level_of(clip, at);
            if t >= far || level >= clip.levels || (rise >= 0.0 && altitude > clip.top) {
                done = true;
                break;
            }
            hit.steps += 1;
            place = textureLoad(places, vec2<i32>(level, 0), 0);
            let u = place.xy + at * place.z;
            let cell = vec2<i32>(floor(u));
            // Ways to the borders of the blocks, and a thousandth of a texel beyond.
            let stretch = inverse * place.w;
            let leave = abs(stretch) * 1e-3;
            let to_coarse = ((floor(u * 0.03125) + side) * 32.0 - u) * stretch + leave;
            let to_fine = ((floor(u * 0.125) + side) * 8.0 - u) * stretch + leave;
            let step_coarse = min(to_coarse.x, to_coarse.y);
            let step_fine = min(to_fine.x, to_fine.y);
            let over_coarse = textureLoad(coarse, (cell >> vec2<u32>(5u)) & coarse_mask, level, 0).x;
            let over_fine = textureLoad(fine, (cell >> vec2<u32>(3u)) & fine_mask, level, 0).x;
            let clear_coarse = altitude + min(rise * step_coarse, 0.0) > over_coarse;
            if !clear_coarse && altitude + min(rise * step_fine, 0.0) <= over_fine {
                end = t + step_fine;
                break;
            }
            hit.reached = t;
            hit.clearance = altitude - over_fine;
            t += select(step_fine, step_coarse, clear_coarse);
        }
        // Its texels, while its level serves them.
        while hit.steps < max_steps && !done && t < end {
            let q = t * (t + 2.0 * radius * mu);
            let root = sqrt(max(radius * radius + q, 0.0));
            let altitude = start + q / (radius + root);
            let rise = (radius * mu + t) / root;
            let at = origin.xz + dir.xz * t;
            if level_of(clip, at) != level {
                break;
            }
            let u = place.xy + at * place.z;
            let whole = floor(u);
            let stretch = inverse * place.w;
            let to_texel = (whole + side - u) * stretch + abs(stretch) * 1e-3;
            let step = min(to_texel.x, to_texel.y);
            let h = corners(heights, clip, vec2<i32>(whole), level);
            let here = altitude - patch_height(h, u - whole);
            let there = altitude + rise * step - patch_height(h, clamp(u - whole + flat * place.z * step, vec2<f32>(0.0), vec2<f32>(1.0)));
            hit.reached = t;
            hit.clearance = here;
            hit.spacing = place.w;
            hit.steps += 1;
            if min(here, there) <= 0.0 {
                hit.distance = t + step * max(here, 0.0) / max(max(here, 0.0) - there, 1e-9);
                done = true;
                break;
            }
            t += step;
        }
    }
    return hit;
}

/// Share of the disc of a light of the angular radius whose tangent is `width` that is seen past the baked ground from `origin`. On the way details
/// much finer than the penumbra are left to coarser levels.
///
/// domain  origin in [-1e6, 1e6] m lin
/// domain  to_light in [-1, 1] 1 lin
/// domain  width in [1e-4, 0.1] 1 log
/// domain  lift in [0, 1e4] m lin
/// domain  far in [0, 1e6] m lin
/// domain  max_steps in [0, 10000] 1 lin
/// range   [0, 1] 1
/// error   1 abs of reference::terrain::soft_shadow
/// source  Quilez2010 (least ratio of clearance to distance); the levels and the disc: ours
fn clip_shadow(heights: texture_2d_array<f32>, places: texture_2d<f32>, clip: Clip, origin: vec3<f32>, to_light: vec3<f32>, width: f32, lift: f32, far: f32,
    max_steps: i32) -> f32 {
    let start = altitude_of(clip.ground_radius, clip.eye_altitude, origin) + lift;
    let mu = dot(to_light, up_at(clip.ground_radius, clip.eye_altitude, origin));
    let radius = clip.ground_radius + start;
    var least = 1.0;
    var t = 2.0 * lift;
    for (var i = 0; i < max_steps; i++) {
        let q = t * (t + 2.0 * radius * mu);
        let root = sqrt(max(radius * radius + q, 0.0));
        let altitude = start + q / (radius + root);
        let rise = (radius * mu + t) / root;
        if t >= far || least <= -1.0 || (rise >= 0.0 && altitude > clip.top) {
            break;
        }
        let at = origin.xz + to_light.xz * t;
        // A texel of half the penumbra's half width.
        let own = (bitcast<i32>(0.5 * width * t / clip.spacing) >> 23u) - 126;
        let level = min(max(level_of(clip, at), own), clip.levels - 1);
        let place = textureLoad(places, vec2<i32>(level, 0), 0);
        let u = place.xy + at * place.z;
        let whole = floor(u);
        let clearance = altitude - patch_height(corners(heights, clip, vec2<i32>(whole), level), u - whole);
        least = min(least, clearance / (width * t));
        t += max(0.7 * clearance, max(place.w, 0.03 * t));
    }
    let x = clamp(least, -1.0, 1.0);
    return clamp(0.5 + x * (0.75 - 0.25 * x * x), 0.0, 1.0);
}
