Heights of a rectangle of one level of a clipmap; the maxima of blocks of a level, and that of the level; how high the ground reaches around the eye. Nothing is drawn.

#PROGRAM{ terrain_bake }#

#COMPUTE{
    #CODE{
#ifdef CLIP_MAXIMA
// One invocation a block of 8 x 8 texels; a workgroup makes 4 x 4 of them, and their maximum.
struct Bake {
    texels: i32,
    level: i32,
}

@group(0) @binding(0) var<uniform> bake: Bake;
@group(1) @binding(0) var heights: texture_2d_array<f32>;
@group(2) @binding(0) var fine: texture_storage_2d_array<r32float, write>;
@group(2) @binding(1) var coarse: texture_storage_2d_array<r32float, write>;

var<workgroup> found: array<f32, 16>;

@compute @workgroup_size(4, 4)
fn maxima(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) index: u32, @builtin(workgroup_id) group: vec3<u32>) {
    let mask = vec2<i32>(bake.texels - 1);
    let corner = vec2<i32>(id.xy) * 8;
    var top = -1e30;
    for (var k = 0; k < 81; k++) {
        let texel = (corner + vec2<i32>(k % 9, k / 9)) & mask;
        top = max(top, textureLoad(heights, texel, bake.level, 0).x);
    }
    textureStore(fine, vec2<i32>(id.xy), bake.level, vec4<f32>(top, 0.0, 0.0, 0.0));
    found[index] = top;
    workgroupBarrier();
    if index == 0u {
        for (var k = 1; k < 16; k++) {
            top = max(top, found[k]);
        }
        textureStore(coarse, vec2<i32>(group.xy), bake.level, vec4<f32>(top, 0.0, 0.0, 0.0));
    }
}
#else
#ifdef CLIP_TOPS
// The maximum of a level, from those of its blocks of 8 x 8; it stands below those of 32 x 32.
struct Bake {
    texels: i32,
    level: i32,
}

@group(0) @binding(0) var<uniform> bake: Bake;
@group(1) @binding(0) var fine: texture_2d_array<f32>;
@group(2) @binding(0) var coarse: texture_storage_2d_array<r32float, write>;

var<workgroup> found: array<f32, 64>;

@compute @workgroup_size(64)
fn tops(@builtin(local_invocation_index) index: u32) {
    let side = bake.texels / 8;
    var top = -1e30;
    for (var k = i32(index); k < side * side; k += 64) {
        top = max(top, textureLoad(fine, vec2<i32>(k % side, k / side), bake.level, 0).x);
    }
    found[index] = top;
    workgroupBarrier();
    if index == 0u {
        for (var k = 1; k < 64; k++) {
            top = max(top, found[k]);
        }
        textureStore(coarse, vec2<i32>(0, bake.texels / 32), bake.level, vec4<f32>(top, 0.0, 0.0, 0.0));
    }
}
#else
#ifdef CLIP_HORIZON
// For each of 64 sectors around the eye, the tangent of an elevation that no baked ground is above. The altitude of a ray over a sphere is at least that over the
// eye's tangent plane.
#import veduta::terrain::clipmap::{Clip, level_of}

@group(0) @binding(0) var<uniform> clip: Clip;
@group(1) @binding(0) var fine: texture_2d_array<f32>;
@group(1) @binding(1) var places: texture_2d<f32>;
@group(2) @binding(0) var horizon: texture_storage_2d<r32float, write>;

const SECTOR: f32 = 0.09817477042;

@compute @workgroup_size(64)
fn skyline(@builtin(local_invocation_index) index: u32) {
    let turn = vec2<f32>(f32(index), f32(index) + 1.0) * SECTOR;
    let a = vec2<f32>(cos(turn.x), sin(turn.x));
    let b = vec2<f32>(cos(turn.y), sin(turn.y));
    // How far the sector's directions reach along their longer axis: least and most at its borders, since 45 and 90 degrees are borders.
    let along = vec2<f32>(max(abs(a.x), abs(a.y)), max(abs(b.x), abs(b.y)));
    let mask = vec2<i32>(clip.texels / 8 - 1);
    var steepest = -1e30;
    var near = 0.0;
    var far = ldexp(8.0 * clip.spacing, clip.first);
    for (var i = 0; i < 400; i++) {
        let first = level_of(clip, vec2<f32>(near * min(along.x, along.y)));
        if first >= clip.levels {
            break;
        }
        // Lines through these corners do not cut the arc.
        let out = far * 1.0013;
        let last = min(level_of(clip, vec2<f32>(out * max(along.x, along.y))), clip.levels - 1);
        let low = min(min(a, b) * near, min(a, b) * out);
        let high = max(max(a, b) * near, max(a, b) * out);
        var top = -1e30;
        for (var level = first; level <= last; level++) {
            let place = textureLoad(places, vec2<i32>(level, 0), 0);
            let begin = vec2<i32>(floor((place.xy + low * place.z) * 0.125));
            let count = vec2<i32>(floor((place.xy + high * place.z) * 0.125)) - begin + 1;
            for (var z = 0; z < count.y; z++) {
                for (var x = 0; x < count.x; x++) {
                    top = max(top, textureLoad(fine, (begin + vec2<i32>(x, z)) & mask, level, 0).x);
                }
            }
        }
        let rise = top - clip.eye_altitude;
        steepest = max(steepest, rise / max(select(far, near, rise > 0.0), 1e-3));
        near = far;
        far *= 1.1;
    }
    textureStore(horizon, vec2<i32>(i32(index), 0), vec4<f32>(steepest, 0.0, 0.0, 0.0));
}
#else
#import veduta::terrain::field::{Field, ground_at}

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
@group(2) @binding(0) var heights: texture_storage_2d_array<r32float, write>;

@compute @workgroup_size(8, 8)
fn bake(@builtin(global_invocation_id) id: vec3<u32>) {
    let at = vec2<i32>(id.xy);
    if any(at >= rectangle.size) {
        return;
    }
    let ground = ground_at(rectangle.field, FIELD_KIND, vec2<f32>(at) * rectangle.spacing, rectangle.spacing);
    let texel = (rectangle.corner + at) & vec2<i32>(rectangle.texels - 1);
    textureStore(heights, texel, rectangle.level, vec4<f32>(ground.height, 0.0, 0.0, 0.0));
}
#endif
#endif
#endif
    }#
}#
