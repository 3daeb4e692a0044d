//! Rays over baked heights: nested levels around the eye, and how high their ground stands all around it.
//!
//! Level l has texels of `spacing` 2^l metres, heights at their lower corners; it serves places whose larger coordinate is within `reach` texels of the
//! eye, and is addressed modulo its size, so that texels stay where they are when the eye moves. Around the eye the ground is divided into sectors of azimuth and
//! into rings, which widen with the distance. A ray from the eye stays in one sector, and its elevation is all that has to be compared with what each ring of it
//! holds: the tangent that clears its ground. Rings go by 64, 8 and one at a time; only in a ring that a ray may meet does it go from texel to texel, where the
//! patch between the corners is bilinear.
//!
//! source   Tevs2008 (maxima of many sizes); Losasso2004 (clipmaps); sectors and rings: ours
//! symbols  t distance along the ray [m] · level of the clipmap [1] · ring, sector around the eye [1]
#define_import_path veduta::terrain::clipmap

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
    /// Texels of a level's side, a power of two.
    texels: i32,
    /// The finest level that is baked.
    first: i32,
    /// Levels.
    levels: i32,
    /// Rings around the eye, a multiple of 64.
    rings: i32,
    /// Sectors around the eye, a power of two; sector 0 begins at +x.
    sectors: i32,
    /// The first sector that has been made, and how many.
    first_sector: i32,
    made_sectors: i32,
    /// Ring k begins at `ring_scale` sinh(`ring_growth` k) from the eye's axis [m].
    ring_scale: f32,
    ring_growth: f32,
    /// How near the baked ground rays look for the field itself, since texels are wider than footprints [texels]; 0 where they are not.
    margin: f32,
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
    /// Slope of its patch along x and z.
    slope: vec2<f32>,
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

/// The heights at the corners of a texel: lower, next in x, next in z, opposite. `wrapping` is a sampler that repeats; it reads all four at once.
///
/// internal
fn corners(heights: texture_2d_array<f32>, wrapping: sampler, clip: Clip, cell: vec2<i32>, level: i32) -> vec4<f32> {
    let middle = vec2<f32>((cell & vec2<i32>(clip.texels - 1)) + 1) / f32(clip.texels);
    return textureGather(0, heights, wrapping, middle, level).wzxy;
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
fn baked_height(heights: texture_2d_array<f32>, wrapping: sampler, places: texture_2d<f32>, clip: Clip, at: vec2<f32>, least: i32) -> f32 {
    let level = min(max(level_of(clip, at), least), clip.levels - 1);
    let place = textureLoad(places, vec2<i32>(level, 0), 0);
    let u = place.xy + at * place.z;
    let whole = floor(u);
    return patch_height(corners(heights, wrapping, clip, vec2<i32>(whole), level), u - whole);
}

/// Distance of the inner border of a ring from the eye's axis.
///
/// internal
fn ring_radius(clip: Clip, ring: i32) -> f32 {
    let x = clip.ring_growth * f32(ring);
    return 0.5 * clip.ring_scale * (exp(x) - exp(-x));
}

/// Tangent of the elevation of the lowest ray from the eye that passes above ground of height `top` everywhere between the distances `near` and `far` from the
/// eye's axis. Rounding is on the safe side.
///
/// internal
fn clearing_tangent(ground_radius: f32, eye_altitude: f32, top: f32, near: f32, far: f32) -> f32 {
    let radius = ground_radius + eye_altitude;
    let rise = top - eye_altitude;
    let b = rise * (2.0 * radius + rise);
    // From above, ground of one height looks highest at its horizon.
    let r = max(clamp(sqrt(max(-b, 0.0)), near, max(near, far)), 1e-3);
    let tangent = (b - r * r) / (r * (radius + sqrt(max(radius * radius + b - r * r, 0.0))));
    return tangent + 1e-6 + 1e-5 * abs(tangent);
}

/// First place from the distance `near` on where a ray from the eye meets the baked ground, or comes nearer to it than `margin` texels, before `far`. A ray that uses up `max_steps` has no hit, but tells how far it came, and how high above the baked ground it is there. `sectors` holds, for each sector of azimuth, the tangents that clear the ground of its rings; see `veduta::terrain_bake`.
///
/// domain  dir in [-1, 1] 1 lin
/// domain  near in [0, 1e6] m lin
/// domain  far in [0, 1e6] m lin
/// domain  margin in [0, 1] 1 lin
/// domain  max_steps in [0, 10000] 1 lin
/// range   [-1e6, 1e6] m
/// error   1 abs of reference::intersect::first_crossing
/// outside undefined
/// source  Tevs2008 (maxima of many sizes); departs: maxima of elevations, by sector and ring
fn clip_hit(heights: texture_2d_array<f32>, wrapping: sampler, sectors: texture_2d<f32>, places: texture_2d<f32>, clip: Clip, dir: vec3<f32>, near: f32, far: f32, margin: f32, max_steps: i32) -> ClipHit {
    var hit = ClipHit(-1.0, near, 0.0, clip.spacing, vec2<f32>(0.0), 0);
    let start = clip.eye_altitude;
    let radius = clip.ground_radius + start;
    let flat = select(dir.xz, vec2<f32>(1e-6), abs(dir.xz) < vec2<f32>(1e-6));
    let inverse = 1.0 / flat;
    let side = select(vec2<f32>(0.0), vec2<f32>(1.0), flat > vec2<f32>(0.0));
    let outwards = 1.0 / max(length(dir.xz), 1e-6);
    let tangent = dir.y * outwards;
    let sector = i32(floor(atan2(dir.z, dir.x) * (0.15915494309 * f32(clip.sectors)))) & (clip.sectors - 1);
    // The ring of the first place; the rounding of the logarithm is on the safe side.
    let begin = near / (outwards * clip.ring_scale);
    var ring = max(i32(floor(log(begin + sqrt(begin * begin + 1.0)) / clip.ring_growth - 1e-3)), 0);
    var t = near;
    var done = false;
    while hit.steps < max_steps && !done {
        // Rings above whose ground the ray passes: 64, 8 or one at a time.
        var size = 2u;
        while hit.steps < max_steps {
            if ring >= clip.rings {
                done = true;
                break;
            }
            hit.steps += 1;
            let column = select(select(0, clip.rings, size == 1u), clip.rings + (clip.rings >> 3u), size == 2u);
            let top = textureLoad(sectors, vec2<i32>(column + (ring >> (3u * size)), sector), 0).x;
            if tangent > top {
                ring = ((ring >> (3u * size)) + 1) << (3u * size);
                size = select(select(0u, 1u, (ring & 7) == 0), 2u, (ring & 63) == 0);
            } else {
                if size == 0u {
                    break;
                }
                size -= 1u;
            }
        }
        // The texels of the ring, while one level serves them.
        t = max(t, ring_radius(clip, ring) * outwards);
        let end = select(ring_radius(clip, ring + 1) * outwards, 0.0, done);
        done = done || t >= far;
        let level = level_of(clip, dir.xz * t);
        let place = textureLoad(places, vec2<i32>(min(level, clip.levels - 1), 0), 0);
        while hit.steps < max_steps && !done && t < end {
            let at = dir.xz * t;
            if level_of(clip, at) != level {
                break;
            }
            let q = t * (t + 2.0 * radius * dir.y);
            let root = sqrt(max(radius * radius + q, 0.0));
            let altitude = start + q / (radius + root);
            let rise = (radius * dir.y + t) / root;
            let u = place.xy + at * place.z;
            let whole = floor(u);
            let stretch = inverse * place.w;
            let to_texel = (whole + side - u) * stretch + abs(stretch) * 1e-3;
            let step = min(to_texel.x, to_texel.y);
            let h = corners(heights, wrapping, clip, vec2<i32>(whole), min(level, clip.levels - 1));
            let here = altitude - patch_height(h, u - whole);
            let there = altitude + rise * step - patch_height(h, clamp(u - whole + flat * place.z * step, vec2<f32>(0.0), vec2<f32>(1.0)));
            hit.spacing = place.w;
            hit.steps += 1;
            if min(here, there) <= margin * place.w {
                hit.slope = 0.5 * place.z * vec2<f32>(h.y - h.x + h.w - h.z, h.z - h.x + h.w - h.y);
                hit.distance = t + select(0.0, step * max(here, 0.0) / max(max(here, 0.0) - there, 1e-9), there <= 0.0);
                done = true;
                break;
            }
            t += step;
        }
        ring += select(0, 1, t >= end);
    }
    // Where it ran out of steps: all rings before this one are clear.
    hit.reached = min(max(t, ring_radius(clip, min(ring, clip.rings)) * outwards), far);
    let over = dir.xz * hit.reached;
    let q = hit.reached * (hit.reached + 2.0 * radius * dir.y);
    hit.clearance = start + q / (radius + sqrt(max(radius * radius + q, 0.0))) - baked_height(heights, wrapping, places, clip, over, 0);
    // A ring may reach beyond the end of the ray.
    hit.distance = select(hit.distance, -1.0, hit.distance > far);
    return hit;
}

/// Distance at which a ray that ran out of steps most likely meets the ground, from how far it came and its clearance there; -1 for what most likely is sky. `mu` is the ray's zenith cosine at the
/// eye. A ray that is close to the ground has met it; one that would come down to the height of the ground below it meets it where it does.
///
/// internal
fn likely_end(ground_radius: f32, eye_altitude: f32, mu: f32, reached: f32, clearance: f32, far: f32) -> f32 {
    let radius = ground_radius + eye_altitude;
    let t = reached;
    let q = t * (t + 2.0 * radius * mu);
    let below = eye_altitude + q / (radius + sqrt(max(radius * radius + q, 0.0))) - clearance;
    // Altitude of the place nearest to the planet's centre.
    let square = mu * mu;
    let lowest = eye_altitude - radius * square / (1.0 + sqrt(max(1.0 - square, 0.0)));
    let fall = -(mu + t / radius);
    let close = clearance < 0.02 * t;
    let falls = fall > 0.0 && lowest < below;
    let distance = t + select(max(clearance, 0.0) / max(fall, 1e-3), 0.0, close);
    return select(-1.0, min(distance, far), close || falls);
}

/// [`likely_end`] of a ray that ran out of steps; the distance of the hit if there is one.
///
/// internal
fn likely_distance(clip: Clip, dir: vec3<f32>, hit: ClipHit, far: f32, max_steps: i32) -> f32 {
    let capped = hit.distance < 0.0 && hit.steps >= max_steps && hit.reached < far;
    let end = likely_end(clip.ground_radius, clip.eye_altitude, dir.y, hit.reached, hit.clearance, far);
    return select(hit.distance, end, capped);
}

/// How the ground's shadow is swept: along the axis of the texels nearest to the sun's azimuth, on lines that keep to it.
struct Sweep {
    /// Axis: 0 for x, 1 for z; the other is the side.
    axis: i32,
    /// Side steps a step along the axis [1].
    shear: f32,
    /// Tangents of the elevation of the upper and the lower limb, at the eye.
    upper: f32,
    lower: f32,
    /// By how much they grow towards the sun [1/m].
    growth: f32,
    /// Sun on the axis: 1 or -1.
    sign: f32,
}

/// The line through a place in texels from a window's corner, along the axis and to the side.
///
/// internal
fn sweep_line(sweep: Sweep, place: vec2<f32>) -> vec2<f32> {
    let along = select(place, place.yx, sweep.axis == 1);
    return vec2<f32>(along.x, along.y - sweep.shear * along.x);
}

/// Heights that the shadows of the upper and of the lower limb reach at a place: between four points of two lines.
///
/// internal
fn shadow_heights(shades: texture_2d_array<f32>, wrapping: sampler, sweep: Sweep, texels: i32, place: vec2<f32>, level: i32) -> vec2<f32> {
    let line = sweep_line(sweep, place);
    let whole = floor(line);
    let middle = vec2<f32>((vec2<i32>(whole) & vec2<i32>(texels - 1)) + 1) / f32(texels);
    let f = line - whole;
    return vec2<f32>(
        patch_height(textureGather(0, shades, wrapping, middle, level).wzxy, f),
        patch_height(textureGather(1, shades, wrapping, middle, level).wzxy, f),
    );
}

/// Share of the sun's disc that is seen past the baked ground from a place on it, given relative to the eye. `shades` holds the heights to which the shadows of
/// the sun's upper and lower limb reach. At a shadow's border a texel decides, so that no bound of the error says anything there: 1.2 % of places with the sun from the side and 3.8 % with the sun in
/// front are on the other side of it.
///
/// domain  at in [-1e6, 1e6] m lin
/// range   [0, 1] 1
/// error   1 abs of reference::terrain::soft_shadow
/// outside undefined
/// source  ours: running maxima of heights along lines towards the sun
fn sun_share(heights: texture_2d_array<f32>, shades: texture_2d_array<f32>, wrapping: sampler, places: texture_2d<f32>, clip: Clip, sweep: Sweep, at: vec2<f32>) -> f32 {
    let level = min(level_of(clip, at), clip.levels - 1);
    let place = textureLoad(places, vec2<i32>(level, 0), 0);
    let u = place.xy + at * place.z;
    let whole = floor(u);
    let height = patch_height(corners(heights, wrapping, clip, vec2<i32>(whole), level), u - whole);
    let window = textureLoad(places, vec2<i32>(level, 1), 0).xy + at * place.z;
    let shadow = shadow_heights(shades, wrapping, sweep, clip.texels, window, level);
    // What is finer than a texel is not resolved.
    let texel = 0.25 * place.w * abs(sweep.upper);
    let half = max(0.5 * (shadow.y - shadow.x), texel) + 1e-6;
    let x = clamp((height - 0.5 * (shadow.x + shadow.y)) / half, -1.0, 1.0);
    return clamp(0.5 + x * (0.75 - 0.25 * x * x), 0.0, 1.0);
}
