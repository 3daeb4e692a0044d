Heights of a rectangle of one level of a clipmap; how high the ground stands around the eye, by sector and ring; how high its shadow reaches. Nothing is drawn.

#PROGRAM{ terrain_bake }#

#COMPUTE{
    #CODE{
#ifdef CLIP_SECTORS
// The tangents that clear the ground of each ring of a sector; behind them the maxima of 8 and of 64 rings.
#import veduta::terrain::clipmap::{Clip, level_of, ring_radius, clearing_tangent}

@group(0) @binding(0) var<uniform> clip: Clip;
// The greatest heights of squares of texels.
@group(1) @binding(0) var peaks: texture_2d_array<f32>;
@group(1) @binding(1) var places: texture_2d<f32>;
@group(1) @binding(2) var wrapping: sampler;
@group(2) @binding(0) var sectors: texture_storage_2d<r32float, write>;

var<workgroup> found: array<f32, 64>;

// Eight sectors by eight rings, of which one invocation goes through eight: 64 rings. Neighbouring invocations have neighbouring sectors, which cost the same.
@compute @workgroup_size(8, 8)
fn sweep(@builtin(local_invocation_id) local: vec3<u32>, @builtin(workgroup_id) group: vec3<u32>) {
    let number = i32(group.x * 8u + local.x);
    let sector = (clip.first_sector + number) & (clip.sectors - 1);
    let width = 6.28318530718 / f32(clip.sectors);
    // A little more than the sector, for the rounding of azimuths.
    let turn = vec2<f32>(f32(sector) - 0.001, f32(sector) + 1.001) * width;
    let a = vec2<f32>(cos(turn.x), sin(turn.x));
    let b = vec2<f32>(cos(turn.y), sin(turn.y));
    // How far the sector's directions reach along their longer axis: least and most at its borders, since 45 and 90 degrees are borders, or nearly.
    let along = vec2<f32>(max(abs(a.x), abs(a.y)), max(abs(b.x), abs(b.y)));
    let squares = i32(textureDimensions(peaks).x);
    let shift = vec2<u32>(firstTrailingBit(u32(clip.texels / squares)));
    let begin = i32(group.y) * 64 + i32(local.y) * 8;
    let count_of_rings = select(0, 8, number < clip.made_sectors);
    var eight = -1e30;
    var near = ring_radius(clip, begin);
    for (var ring = begin; ring < begin + count_of_rings; ring++) {
        let inner = near * 0.9999;
        near = ring_radius(clip, ring + 1);
        let far = near * 1.0001;
        // Lines through corners this far out do not cut the arc.
        let out = far * 1.0002;
        let first = level_of(clip, vec2<f32>(inner * min(along.x, along.y) * 0.9998));
        let last = min(level_of(clip, vec2<f32>(out * max(along.x, along.y))), clip.levels - 1);
        let low = min(min(a, b) * inner, min(a, b) * out);
        let high = max(max(a, b) * inner, max(a, b) * out);
        var top = -1e30;
        for (var level = first; level <= last; level++) {
            let place = textureLoad(places, vec2<i32>(level, 0), 0);
            // The part of the ring that this level serves.
            let edge = vec2<f32>((clip.reach + 1.0) * place.w);
            let corner = vec2<i32>(floor(place.xy + max(low, -edge) * place.z)) >> shift;
            let count = ((vec2<i32>(floor(place.xy + min(high, edge) * place.z)) + 1) >> shift) - corner + 1;
            for (var z = 0; z < count.y; z += 2) {
                for (var x = 0; x < count.x; x += 2) {
                    let middle = vec2<f32>(((corner + vec2<i32>(x, z)) & vec2<i32>(squares - 1)) + 1) / f32(squares);
                    let h = textureGather(0, peaks, wrapping, middle, level);
                    top = max(top, max(max(h.x, h.y), max(h.z, h.w)) + clip.margin * place.w);
                }
            }
        }
        let tangent = select(clearing_tangent(clip.ground_radius, clip.eye_altitude, top, inner, far), -1e30, top < -1e29);
        textureStore(sectors, vec2<i32>(ring, sector), vec4<f32>(tangent, 0.0, 0.0, 0.0));
        eight = max(eight, tangent);
    }
    found[local.y * 8u + local.x] = eight;
    workgroupBarrier();
    if count_of_rings > 0 {
        textureStore(sectors, vec2<i32>(clip.rings + begin / 8, sector), vec4<f32>(eight, 0.0, 0.0, 0.0));
        if local.y == 0u {
            for (var k = 1u; k < 8u; k++) {
                eight = max(eight, found[k * 8u + local.x]);
            }
            textureStore(sectors, vec2<i32>(clip.rings + clip.rings / 8 + begin / 64, sector), vec4<f32>(eight, 0.0, 0.0, 0.0));
        }
    }
}
#else
#ifdef CLIP_SHADES
// Heights that the shadows of the sun's upper and lower limb reach on one level: from what they were one texel nearer to the sun. A line that enters the window
// takes them from the next level.
#import veduta::terrain::clipmap::{Sweep, shadow_heights}

struct Shade {
    // The corner of the window in the texture of heights, and the eye in the window [texels].
    corner: vec2<i32>,
    eye: vec2<f32>,
    // The eye in the window of the next level [texels].
    next_eye: vec2<f32>,
    texels: i32,
    level: i32,
    // The next level; -1 if there is none.
    next: i32,
    spacing: f32,
    // A structure begins at 16 bytes; naga writes WGSL without alignments.
    spare: vec2<f32>,
    sweep: Sweep,
}

@group(0) @binding(0) var<uniform> shade: Shade;
@group(1) @binding(0) var heights: texture_2d_array<f32>;
@group(1) @binding(1) var coarser: texture_2d_array<f32>;
@group(1) @binding(2) var wrapping: sampler;
@group(2) @binding(0) var shades: texture_storage_2d_array<rg32float, write>;

// One invocation a line.
@compute @workgroup_size(64)
fn darken(@builtin(global_invocation_id) id: vec3<u32>) {
    let sweep = shade.sweep;
    let texels = f32(shade.texels);
    let stretch = sqrt(1.0 + sweep.shear * sweep.shear);
    let step = shade.spacing * stretch;
    let mask = vec2<i32>(shade.texels - 1);
    let eye = select(shade.eye, shade.eye.yx, sweep.axis == 1);
    var lap = 1e9;
    var height = 0.0;
    var shadow = vec2<f32>(-1e30);
    for (var i = 0; i < shade.texels; i++) {
        let along = f32(select(i, shade.texels - 1 - i, sweep.sign > 0.0));
        // The line comes round: what leaves the window on one side is another line that enters on the other.
        let line = f32(id.x) + sweep.shear * along;
        let own_lap = floor(line / texels);
        let side = line - own_lap * texels;
        let place = select(vec2<f32>(along, side), vec2<f32>(side, along), sweep.axis == 1);
        if own_lap != lap {
            shadow = vec2<f32>(-1e30);
            if shade.next >= 0 {
                shadow = shadow_heights(coarser, wrapping, sweep, shade.texels, shade.next_eye + 0.5 * (place - shade.eye), 0);
            }
            lap = own_lap;
        } else {
            // Halfway to the last place, in metres towards the sun from the eye's.
            let towards = shade.spacing * (sweep.sign * ((along - eye.x) + sweep.shear * (side - eye.y)) / stretch) + 0.5 * step;
            let bend = sweep.growth * towards;
            shadow = max(shadow, vec2<f32>(height)) - step * (vec2<f32>(sweep.upper, sweep.lower) + bend);
        }
        let whole = floor(side);
        let cell = vec2<i32>(select(vec2<f32>(along, whole), vec2<f32>(whole, along), sweep.axis == 1));
        let middle = vec2<f32>(((shade.corner + cell) & mask) + 1) / texels;
        let h = textureGather(0, heights, wrapping, middle, shade.level);
        // Beyond the last texel of the side is the other border.
        let beside = select(select(h.x, h.z, sweep.axis == 1), h.w, whole >= texels - 1.0);
        height = mix(h.w, beside, side - whole);
        textureStore(shades, vec2<i32>(i32(along), i32(id.x)), 0, vec4<f32>(shadow, 0.0, 0.0));
    }
}
#else
#import veduta::terrain::field::{Field}
#import veduta::terrain::relief::{land_at}

override FIELD_KIND: i32 = 2;

struct Rectangle {
    // Lattice place of its corner, which stands in the field as the eye's.
    field: Field,
    // Its corner in the texture; it wraps around the border.
    corner: vec2<i32>,
    size: vec2<i32>,
    texels: i32,
    level: i32,
    spacing: f32,
}

@group(0) @binding(0) var<uniform> rectangle: Rectangle;
@group(1) @binding(0) var relief: texture_2d<f32>;
@group(2) @binding(0) var heights: texture_storage_2d_array<r32float, write>;
@group(2) @binding(1) var peaks: texture_storage_2d_array<r32float, write>;

// One invocation a square of texels; rectangles hold whole ones.
@compute @workgroup_size(8, 8)
fn bake(@builtin(global_invocation_id) id: vec3<u32>) {
    let peak = rectangle.texels / i32(textureDimensions(peaks).x);
    let shift = firstTrailingBit(u32(peak));
    let first = vec2<i32>(id.xy) * peak;
    if any(first >= rectangle.size) {
        return;
    }
    let mask = vec2<i32>(rectangle.texels - 1);
    var top = -1e30;
    for (var k = 0; k < peak * peak; k++) {
        let at = first + vec2<i32>(k & (peak - 1), k >> shift);
        let height = land_at(relief, rectangle.field, FIELD_KIND, vec2<f32>(at) * rectangle.spacing, rectangle.spacing).height;
        top = max(top, height);
        textureStore(heights, (rectangle.corner + at) & mask, rectangle.level, vec4<f32>(height, 0.0, 0.0, 0.0));
    }
    textureStore(peaks, ((rectangle.corner + first) & mask) >> vec2<u32>(shift), rectangle.level, vec4<f32>(top, 0.0, 0.0, 0.0));
}
#endif
#endif
    }#
}#
