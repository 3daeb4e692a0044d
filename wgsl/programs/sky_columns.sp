Further columns of the table of the sky: between those that `sky_view` has computed lie others, on cubics through the four nearest, so that no line between two
of them has a bend that the eye sees as a stripe. `sky_refine` puts further rows between its rows. One invocation makes all that lie between two columns.

#PROGRAM{ sky_columns }#

#COMPUTE{
    #CODE{
#import veduta::math::cubic::{cubic_weights}

@group(1) @binding(0) var computed: texture_2d_array<f32>;
@group(2) @binding(0) var columns: texture_storage_2d_array<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn bake(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = textureDimensions(computed);
    if id.x >= size.x || id.y >= size.y {
        return;
    }
    let count = i32(size.x);
    let column = i32(id.x);
    let row = i32(id.y);
    let each = i32(textureDimensions(columns).x - 1u) / (count - 1);
    // Of fewer than four columns two are enough for a line.
    let few = count < 4;
    let first = clamp(column - select(1, 0, few), 0, count - select(4, 2, few));
    let last = select(1, each, column + 1 < count);
    for (var layer = 0; layer < 2; layer++) {
        let a = textureLoad(computed, vec2<i32>(first, row), layer, 0);
        let b = textureLoad(computed, vec2<i32>(first + 1, row), layer, 0);
        let c = textureLoad(computed, vec2<i32>(min(first + 2, count - 1), row), layer, 0);
        let d = textureLoad(computed, vec2<i32>(min(first + 3, count - 1), row), layer, 0);
        for (var k = 0; k < last; k++) {
            let weights = cubic_weights(f32(column - first) + f32(k) / f32(each), few);
            let sum = a * weights.x + b * weights.y + c * weights.z + d * weights.w;
            textureStore(columns, vec2<i32>(column * each + k, row), layer, sum);
        }
    }
}
    }#
}#
