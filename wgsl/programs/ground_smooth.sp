A pass of smoothing of a new ground: every cell the weighted mean of itself and its eight neighbours; beyond the edges the edge, or the other edge where the ground goes on there.

#PROGRAM{ ground_smooth }#

#COMPUTE{
    #CODE{
#import veduta::ground::shape::{smoothed_height}

struct GroundShape {
    columns: i32,
    rows: i32,
    // Of the shape, which is there already.
    shape: i32,
    // Whether the ground goes on at the other edge.
    wraps: i32,
    relief: f32,
    // Added everywhere by this pass [m].
    offset: f32,
}

@group(0) @binding(0) var<uniform> form: GroundShape;
@group(1) @binding(0) var<storage, read> before: array<f32>;
@group(2) @binding(0) var<storage, read_write> after: array<f32>;

fn height(x: i32, z: i32) -> f32 {
    let size = vec2<i32>(form.columns, form.rows);
    let at = vec2<i32>(x, z);
    let p = select(clamp(at, vec2<i32>(0), size - 1), (at + size) % size, vec2<bool>(form.wraps == 1));
    return before[p.y * form.columns + p.x];
}

@compute @workgroup_size(64)
fn smoothen(@builtin(global_invocation_id) id: vec3<u32>) {
    let x = i32(id.x);
    let z = i32(id.y);
    if x >= form.columns {
        return;
    }
    let sides = vec4<f32>(height(x - 1, z), height(x + 1, z), height(x, z - 1), height(x, z + 1));
    let corners = vec4<f32>(height(x - 1, z - 1), height(x + 1, z + 1), height(x - 1, z + 1), height(x + 1, z - 1));
    after[z * form.columns + x] = smoothed_height(height(x, z), sides, corners) + form.offset;
}
    }#
}#
