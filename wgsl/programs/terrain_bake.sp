Heights of a rectangle of one level of a clipmap, and the maxima of blocks of a level. Nothing is drawn.

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
    }#
}#
