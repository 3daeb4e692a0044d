Heights of a field of hills, computed with noise that comes from veduta. Text outside the tags is ignored.

#PROGRAM{ hills }#

#COMPUTE{
    #CODE{
#import veduta::noise::gradient::{gradient_noise_2d}

// One height a sample in metres, row by row.
@group(0) @binding(0) var<storage, read_write> heights: array<f32>;

// Samples of a row, and of a hill along one axis.
const ROW: u32 = 256u;
const HILL: u32 = 32u;

@compute @workgroup_size(64)
fn raise(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&heights) {
        return;
    }
    let place = vec2<u32>(id.x % ROW, id.x / ROW);
    let cell = vec2<i32>(place / HILL);
    let frac = vec2<f32>(place % HILL) / f32(HILL);
    heights[id.x] = 0.75 * gradient_noise_2d(cell, frac, 7u);
}
    }#
}#
