What the picture of the ground shows of every cell: height, level of the water as it is displayed, depth and mean of the water.

#PROGRAM{ ground_surface }#

#COMPUTE{
    #CODE{
#import veduta::ground::grid::{GroundStep, cell_place}
#import veduta::ground::surface::{displayed_level}

struct Shore {
    // Depth from which water is shown as it is, and depth of dry surface below the ground [m].
    least: f32,
    sink: f32,
}

@group(0) @binding(0) var<uniform> now: GroundStep;
@group(0) @binding(1) var<uniform> shore: Shore;
@group(1) @binding(0) var<storage, read> ground: array<vec4<f32>>;
@group(1) @binding(1) var<storage, read> water: array<vec4<f32>>;
@group(1) @binding(2) var<storage, read> means: array<vec4<f32>>;
// Height and displayed level over the reference level, depth, mean.
@group(2) @binding(0) var surface: texture_storage_2d<rgba32float, write>;

// Where a cell is; beyond the edges those of the edge.
fn index_of(x: i32, z: i32) -> i32 {
    return cell_place(now, clamp(x, 0, now.columns - 1), clamp(z, 0, now.rows - 1));
}

// Level and depth of a cell.
fn cell(x: i32, z: i32) -> vec2<f32> {
    let at = index_of(x, z);
    let depth = water[at >> 2u][at & 3];
    return vec2<f32>(ground[at >> 2u][at & 3] + depth, depth);
}

@compute @workgroup_size(8, 8)
fn show(@builtin(global_invocation_id) id: vec3<u32>) {
    let x = i32(id.x);
    let z = i32(id.y);
    if x >= now.columns || z >= now.rows {
        return;
    }
    let at = index_of(x, z);
    let height = ground[at >> 2u][at & 3];
    let depth = water[at >> 2u][at & 3];
    let left = cell(x - 1, z);
    let right = cell(x + 1, z);
    let low = cell(x, z - 1);
    let high = cell(x, z + 1);
    let a = cell(x - 1, z - 1);
    let b = cell(x + 1, z - 1);
    let c = cell(x - 1, z + 1);
    let d = cell(x + 1, z + 1);
    let shown = displayed_level(height + depth, depth, vec4<f32>(left.x, right.x, low.x, high.x), vec4<f32>(a.x, b.x, c.x, d.x), vec4<f32>(left.y, right.y, low.y, high.y), vec4<f32>(a.y, b.y, c.y, d.y), shore.least, shore.sink);
    textureStore(surface, vec2<i32>(x, z), vec4<f32>(height, shown, depth, means[at >> 2u][at & 3]));
}
    }#
}#
