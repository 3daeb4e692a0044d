Normals of the ground and of its displayed water, of every cell: x and z of both as signed fractions of 16 bits.

#PROGRAM{ ground_normals }#

#COMPUTE{
    #CODE{
#import veduta::ground::grid::{GroundStep}
#import veduta::ground::surface::{fast_normal, counted_level}

@group(0) @binding(0) var<uniform> now: GroundStep;
@group(1) @binding(0) var surface: texture_2d<f32>;
@group(2) @binding(0) var normals: texture_storage_2d<rg32uint, write>;

// What stands beside a cell; beyond the edge its slope goes on.
fn beside(here: vec2<f32>, at: vec2<i32>, step: vec2<i32>) -> vec2<f32> {
    let end = vec2<i32>(now.columns - 1, now.rows - 1);
    let there = at + step;
    if any(there < vec2<i32>(0)) || any(there > end) {
        let back = textureLoad(surface, at - step, 0).xy;
        return 2.0 * here - vec2<f32>(back.x, counted_level(here.y, back.y, back.x));
    }
    let found = textureLoad(surface, there, 0).xy;
    return vec2<f32>(found.x, counted_level(here.y, found.y, found.x));
}

@compute @workgroup_size(8, 8)
fn turn(@builtin(global_invocation_id) id: vec3<u32>) {
    let at = vec2<i32>(id.xy);
    if at.x >= now.columns || at.y >= now.rows {
        return;
    }
    let here = textureLoad(surface, at, 0).xy;
    let left = beside(here, at, vec2<i32>(-1, 0));
    let right = beside(here, at, vec2<i32>(1, 0));
    let low = beside(here, at, vec2<i32>(0, -1));
    let high = beside(here, at, vec2<i32>(0, 1));
    let bare = fast_normal(left.x, right.x, low.x, high.x, now.spacing);
    let wet = fast_normal(left.y, right.y, low.y, high.y, now.spacing);
    textureStore(normals, at, vec4<u32>(pack2x16snorm(bare.xz), pack2x16snorm(wet.xz), 0u, 0u));
}
    }#
}#
