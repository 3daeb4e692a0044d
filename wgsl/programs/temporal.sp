Temporal anti-aliasing and upsampling: samples of this frame, taken off the middles of their pixels, join those of earlier frames, which are found through the depth.

#PROGRAM{ temporal }#

#DEFINE{
    #HOST{
struct TemporalView {
    // The ray through clip coordinates (x, y) is along ray_middle + x ray_right + y ray_up, without the shift of the samples.
    ray_middle: vec3<f32>,
    // One over the distance is (depth + depth_offset) * inverse_numerator.
    depth_offset: f32,
    ray_right: vec3<f32>,
    inverse_numerator: f32,
    ray_up: vec3<f32>,
    // Most samples that a pixel's history counts as; 0 forgets it.
    frames: f32,
    // Clip coordinates of the frame before for a direction and one over the distance along it.
    before_x: vec4<f32>,
    before_y: vec4<f32>,
    before_w: vec4<f32>,
    // Shift of the samples from the middles of their pixels [pixels of the host's picture].
    shift: vec2<f32>,
    // Standard deviations that a history may differ from its surroundings.
    bound: f32,
    frame: u32,
    // Pixels of the host's picture and of the result.
    taken: vec2<f32>,
    size: vec2<f32>,
    // 1 where the host leaves what shows nothing transparent.
    has_empty: u32,
}

@group(0) @binding(0) var<uniform> temporal: TemporalView;
@group(1) @binding(0) var picture: texture_2d<f32>;
@group(1) @binding(1) var depths: texture_depth_2d;
@group(1) @binding(2) var nearest: sampler;
// Red and green, blue and alpha, one over the distance and the count: two codes each.
    }#
}#

#VERTEX{
    #USE{ HOST }#
    #CODE{
// Squares of 32 pixels of the result, two triangles each; those around which no sample shows anything have no size.
@vertex
fn cover(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    let tile = index / 6u;
    let corner = index % 6u;
    let k = select(select(3u, corner % 3u, corner == 4u), select(corner, 2u, corner == 3u), corner < 4u);
    let columns = (u32(temporal.size.x) + 31u) / 32u;
    let low = vec2<f32>(vec2<u32>(tile % columns, tile / columns) * 32u);
    let high = min(low + 32.0, temporal.size);
    let by = temporal.taken / temporal.size;
    // All samples that the pixels look at.
    let first = floor(low * by - 0.5 - temporal.shift) - 1.0;
    let last = floor(high * by - 0.5 - temporal.shift) + 2.0;
    let far = select(1.0, 0.0, temporal.inverse_numerator > 0.0);
    var seen = temporal.has_empty == 0u;
    for (var y = first.y; y <= last.y && !seen; y += 2.0) {
        for (var x = first.x; x <= last.x && !seen; x += 2.0) {
            let at = (vec2<f32>(x, y) + 1.0) / temporal.taken;
            seen = any(textureGather(depths, nearest, at) != vec4<f32>(far)) || any(textureGather(3, picture, nearest, at) != vec4<f32>(0.0));
        }
    }
    let place = vec2<f32>(select(low.x, high.x, (k & 1u) == 1u), select(low.y, high.y, k > 1u)) / temporal.size;
    return vec4<f32>(select(vec2<f32>(-2.0), vec2<f32>(2.0 * place.x - 1.0, 1.0 - 2.0 * place.y), seen), 0.0, 1.0);
}
    }#
}#

#FRAGMENT{
    #USE{ HOST }#
    #CODE{
#import veduta::hash::pcg::{pcg_3d}
#import veduta::post::temporal::{box_share, catmull_rom, pixel_share}

@group(1) @binding(3) var history_rg: texture_2d<u32>;
@group(1) @binding(4) var history_ba: texture_2d<u32>;
@group(1) @binding(5) var history_place: texture_2d<u32>;

// Whether a history is held to its surroundings.
override TEMPORAL_BOUNDED: i32 = 1;
// Whether it is read with a cubic of sixteen texels instead of four.
override TEMPORAL_SHARP: i32 = 1;
// Whether the eye stands: each pixel is where it was.
override TEMPORAL_STILL: i32 = 0;
// Whether samples lie so far apart that only the nearest tells of a pixel.
override TEMPORAL_SPARSE: i32 = 0;
// Whether nothing moves but the eye.
override TEMPORAL_FIXED: i32 = 0;

// Four texels of a history around a corner, by channel, in the order of gathers.
struct Four {
    r: vec4<f32>,
    g: vec4<f32>,
    b: vec4<f32>,
    a: vec4<f32>,
}

// A code is a float without sign with six binary digits of exponent and ten after the first of the mantissa, from 2^-40 to 2^24; 0 is 0.
fn four_decoded(codes: vec4<u32>) -> vec4<f32> {
    return select(bitcast<vec4<f32>>((codes << vec4<u32>(13u)) + 0x2b800000u), vec4<f32>(0.0), codes == vec4<u32>(0u));
}

fn four(rg: vec4<u32>, ba: vec4<u32>) -> Four {
    let low = vec4<u32>(0xffffu);
    let half = vec4<u32>(16u);
    return Four(four_decoded(rg & low), four_decoded(rg >> half), four_decoded(ba & low), four_decoded(ba >> half));
}

fn blend(texels: Four, weights: vec4<f32>) -> vec4<f32> {
    return vec4<f32>(dot(texels.r, weights), dot(texels.g, weights), dot(texels.b, weights), dot(texels.a, weights));
}

fn least_of(v: vec4<f32>) -> f32 {
    return min(min(v.x, v.y), min(v.z, v.w));
}

fn most_of(v: vec4<f32>) -> f32 {
    return max(max(v.x, v.y), max(v.z, v.w));
}

fn codes(values: vec4<f32>, chance: vec4<u32>) -> vec4<u32> {
    let bits = bitcast<vec4<u32>>(clamp(values, vec4<f32>(0.0), vec4<f32>(1.6e7))) + chance;
    return (max(bits, vec4<u32>(0x2b800000u)) - 0x2b800000u) >> vec4<u32>(13u);
}

struct Joined {
    @location(0) color: vec4<f32>,
    @location(1) rg: u32,
    @location(2) ba: u32,
    @location(3) place: u32,
}

@fragment
fn resolve(@builtin(position) position: vec4<f32>) -> Joined {
    let id = vec2<u32>(position.xy);
    let size = temporal.size;
    let taken = temporal.taken;
    let texel = 1.0 / size;
    let middle = position.xy;
    let at = middle * texel;
    // The four samples around: they count by their distance, and a very little where none is near.
    let between = at * taken - 0.5 - temporal.shift;
    let first = floor(between);
    let off = between - first;
    let scale = size / taken;
    let last = vec2<i32>(taken) - 1;
    let right_one = vec2<f32>(off >= vec2<f32>(0.5));
    var now = vec4<f32>(0.0);
    var weight = 0.0;
    if TEMPORAL_SPARSE != 0 {
        let away = abs(off - right_one) * scale;
        now = textureLoad(picture, clamp(vec2<i32>(first + right_one), vec2<i32>(0), last), 0);
        // Few samples fall into a pixel then: those around it count, too.
        weight = max(pixel_share(0.7 * away.x) * pixel_share(0.7 * away.y), 1e-7);
    } else {
        let across = vec2<f32>(pixel_share(off.x * scale.x), pixel_share((1.0 - off.x) * scale.x)) + 1e-4 * vec2<f32>(1.0 - off.x, off.x);
        let along = vec2<f32>(pixel_share(off.y * scale.y), pixel_share((1.0 - off.y) * scale.y)) + 1e-4 * vec2<f32>(1.0 - off.y, off.y);
        let low = clamp(vec2<i32>(first), vec2<i32>(0), last);
        let high = min(vec2<i32>(first) + 1, last);
        let p00 = textureLoad(picture, low, 0);
        let p10 = textureLoad(picture, vec2<i32>(high.x, low.y), 0);
        let p01 = textureLoad(picture, vec2<i32>(low.x, high.y), 0);
        let p11 = textureLoad(picture, high, 0);
        weight = (across.x + across.y) * (along.x + along.y);
        now = ((p00 * across.x + p10 * across.y) * along.x + (p01 * across.x + p11 * across.y) * along.y) / weight;
    }

    // One over the distance of sixteen samples around, which stays finite in the sky: what a finer feature hid or showed a frame ago is among them.
    let sample = 1.0 / taken;
    let corner_one = first * sample;
    let corner_two = corner_one + 2.0 * sample;
    var inverse = vec4<f32>(0.0);
    var most_depth = 0.0;
    var least_depth = 0.0;
    // Samples that are far apart do not tell of what is finer for an eye that moves, and need not where nothing moves at all; it is left to the four around.
    if TEMPORAL_SPARSE != 0 && (TEMPORAL_STILL == 0 || TEMPORAL_FIXED != 0) {
        inverse = textureGather(depths, nearest, corner_one + sample);
        most_depth = most_of(inverse);
        least_depth = least_of(inverse);
    } else {
        let d0 = textureGather(depths, nearest, corner_one);
        let d1 = textureGather(depths, nearest, vec2<f32>(corner_two.x, corner_one.y));
        let d2 = textureGather(depths, nearest, vec2<f32>(corner_one.x, corner_two.y));
        let d3 = textureGather(depths, nearest, corner_two);
        // The four around; gathers give (0, 1), (1, 1), (1, 0), (0, 0).
        inverse = vec4<f32>(d2.z, d3.w, d1.x, d0.y);
        most_depth = most_of(max(max(d0, d1), max(d2, d3)));
        least_depth = least_of(min(min(d0, d1), min(d2, d3)));
    }
    inverse = (inverse + temporal.depth_offset) * temporal.inverse_numerator;
    // Depths may grow with the distance.
    let ends = (vec2<f32>(least_depth, most_depth) + temporal.depth_offset) * temporal.inverse_numerator;
    let near = max(ends.x, ends.y);
    let far = max(min(ends.x, ends.y), 0.0);
    // On a plane it is linear across the picture; across edges that of the nearest sample, or of what is in front, with which edges move.
    let linear_one = mix(mix(inverse.w, inverse.z, off.x), mix(inverse.x, inverse.y, off.x), off.y);
    let middle_one = mix(mix(inverse.w, inverse.z, right_one.x), mix(inverse.x, inverse.y, right_one.x), right_one.y);
    let own = select(select(middle_one, near, middle_one < 0.7 * near), linear_one, least_of(inverse) > 0.7 * most_of(inverse));
    var old = vec4<f32>(0.0);
    var count = 0.0;
    var known = 1.0;
    var moved = 0.0;
    var inside = true;
    if TEMPORAL_STILL != 0 {
        let there = textureLoad(history_place, id, 0).x;
        let rg = textureLoad(history_rg, id, 0).x;
        let ba = textureLoad(history_ba, id, 0).x;
        old = four_decoded(vec4<u32>(rg & 0xffffu, rg >> 16u, ba & 0xffffu, ba >> 16u));
        let kept = four_decoded(vec4<u32>(there & 0xffffu, there >> 16u, 0u, 0u));
        // Where nothing moves samples may miss what is seen here, but nothing else has come to be seen.
        known = select(0.0, 1.0, TEMPORAL_FIXED != 0 || (kept.x >= 0.9 * far && kept.x <= 1.1 * near + 1e-9));
        count = kept.y;
    } else {
        let clip = vec2<f32>(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y);
        let place = vec4<f32>(temporal.ray_middle + clip.x * temporal.ray_right + clip.y * temporal.ray_up, own);
        let w = dot(temporal.before_w, place);
        let by = 1.0 / max(w, 1e-30);
        let was = vec2<f32>(dot(temporal.before_x, place), -dot(temporal.before_y, place)) * by * 0.5 + 0.5;
        inside = w > 0.0 && all(was >= vec2<f32>(0.0)) && all(was <= vec2<f32>(1.0));
        var h = select(middle, was * size, inside) - 0.5;
        let whole = round(h);
        h = select(h, whole, abs(h - whole) < vec2<f32>(0.004));
        let cell = floor(h);
        let share = h - cell;

        // The history there: what stood at another distance is not it.
        let corner = (cell + 1.0) * texel;
        let places = textureGather(0, history_place, nearest, corner);
        let stood = four_decoded(places & vec4<u32>(0xffffu));
        let counts = four_decoded(places >> vec4<u32>(16u));
        let linear = vec4<f32>((1.0 - share.x) * share.y, share.x * share.y, share.x * (1.0 - share.y), (1.0 - share.x) * (1.0 - share.y));
        let fits = vec4<f32>(stood >= vec4<f32>(0.9 * by * far)) * vec4<f32>(stood <= vec4<f32>(1.1 * by * near + 1e-9));
        var found = fits;
        if TEMPORAL_FIXED != 0 {
            // Where only the eye moves, what stood at another distance is something else once the two move apart: by a quarter of a pixel in a frame.
            let passing = vec2<f32>(temporal.before_x.w, -temporal.before_y.w) - (2.0 * was - 1.0) * temporal.before_w.w;
            let pixels = 0.5 * by * length(passing * size);
            found = vec4<f32>(abs(stood - by * own) * pixels < vec4<f32>(0.25 * by));
        }
        let valid = linear * found;
        known = dot(valid, vec4<f32>(1.0));
        let by_known = 1.0 / max(known, 1e-6);
        // Gathers give (0, 1), (1, 1), (1, 0), (0, 0).
        let around = four(textureGather(0, history_rg, nearest, corner), textureGather(0, history_ba, nearest, corner));
        old = blend(around, valid) * by_known;
        if TEMPORAL_SHARP != 0 {
            let x = catmull_rom(share.x);
            let y = catmull_rom(share.y);
            let e0 = cell * texel;
            let e3 = (cell + 2.0) * texel;
            let e1 = vec2<f32>(e3.x, e0.y);
            let e2 = vec2<f32>(e0.x, e3.y);
            let f0 = four(textureGather(0, history_rg, nearest, e0), textureGather(0, history_ba, nearest, e0));
            let f1 = four(textureGather(0, history_rg, nearest, e1), textureGather(0, history_ba, nearest, e1));
            let f2 = four(textureGather(0, history_rg, nearest, e2), textureGather(0, history_ba, nearest, e2));
            let f3 = four(textureGather(0, history_rg, nearest, e3), textureGather(0, history_ba, nearest, e3));
            let cubic = blend(f0, vec4<f32>(x.x * y.y, x.y * y.y, x.y * y.x, x.x * y.x)) + blend(f1, vec4<f32>(x.z * y.y, x.w * y.y, x.w * y.x, x.z * y.x))
                + blend(f2, vec4<f32>(x.x * y.w, x.y * y.w, x.y * y.z, x.x * y.z)) + blend(f3, vec4<f32>(x.z * y.w, x.w * y.w, x.w * y.z, x.z * y.z));
            // A cubic overshoots beside edges: no darker or brighter than the four around.
            let least = vec4<f32>(least_of(around.r), least_of(around.g), least_of(around.b), least_of(around.a));
            let most = vec4<f32>(most_of(around.r), most_of(around.g), most_of(around.b), most_of(around.a));
            old = select(old, clamp(cubic, least, most), known > 0.999);
        }
        count = dot(counts, valid) * by_known;
        moved = length((was - at) * size);
    }
    if TEMPORAL_BOUNDED != 0 {
        // The nine samples around.
        let one = clamp(vec2<i32>(round(between)), vec2<i32>(0), last);
        var mean = vec3<f32>(0.0);
        var square = vec3<f32>(0.0);
        for (var k = 0; k < 9; k++) {
            let sample = textureLoad(picture, clamp(one + vec2<i32>(k % 3 - 1, k / 3 - 1), vec2<i32>(0), last), 0).rgb;
            mean += sample * 0.11111111;
            square += sample * sample * 0.11111111;
        }
        let deviation = sqrt(max(square - mean * mean, vec3<f32>(0.0)));
        let kept_share = box_share(old.rgb - mean, deviation, temporal.bound);
        old = vec4<f32>(mean + kept_share * (old.rgb - mean), old.a);
        count *= kept_share;
    }
    // What moves is read between pixels in every frame, and blurs; it counts for less.
    count = select(0.0, min(count, max(temporal.frames / (1.0 + 8.0 * moved), min(temporal.frames, 2.0))), inside && known > 0.01);
    // Nor is it read for long without a sample: a far one is better then, though not for what hardly moves and keeps its history.
    let least = select(min(moved, 1.0), clamp(2.0 * moved - 1.0, 0.0, 1.0), TEMPORAL_FIXED != 0);
    let counted = min(max(weight, 0.4 * least), 1.0);
    let mixed = mix(old, now, counted / (count + counted));
    let result = select(mixed, now, count == 0.0);
    let words = pcg_3d(vec3<u32>(id, temporal.frame));
    let chance = vec4<u32>(words.x, words.x >> 16u, words.y, words.y >> 16u) & vec4<u32>(0x1fffu);
    let color_codes = codes(result, chance);
    let place_codes = codes(vec4<f32>(own, min(count + counted, max(temporal.frames, 1.0)), 0.0, 0.0), vec4<u32>(0u));
    return Joined(result, color_codes.x | (color_codes.y << 16u), color_codes.z | (color_codes.w << 16u), place_codes.x | (place_codes.y << 16u));
}
    }#
}#
