The table of the sky that pictures read: between the rows of `sky_columns` lie others, on cubics through the four nearest, so that no line between two
of them has a bend that the eye sees as a stripe. Rows above the horizon and below it never mix. One invocation makes all that lie between two rows.

#PROGRAM{ sky_refine }#

#COMPUTE{
    #CODE{
#import veduta::math::cubic::{cubic_weights}
#import veduta::atmosphere::sky_view::{SkyEye, sky_coded, sky_rows}

@group(0) @binding(1) var<uniform> eye: SkyEye;
@group(1) @binding(0) var columns: texture_2d_array<f32>;
@group(2) @binding(0) var sky: texture_storage_2d_array<rgba16float, write>;

@compute @workgroup_size(8, 8)
fn bake(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = vec2<i32>(textureDimensions(columns));
    let column = i32(id.x);
    if column >= size.x || i32(id.y) >= size.y {
        return;
    }
    let fine_rows = f32(textureDimensions(sky).y);
    let fine_above = i32(sky_rows(eye, fine_rows));
    let above = i32(sky_rows(eye, f32(size.y)));
    let below = i32(id.y) >= above;
    let start = select(0, above, below);
    let fine_start = select(0, fine_above, below);
    let count = select(above, size.y - above, below);
    let fine = select(fine_above, i32(fine_rows) - fine_above, below);
    let row = i32(id.y) - start;
    let few = count < 4;
    let first = clamp(row - select(1, 0, few), 0, count - select(4, 2, few));
    // From this row on and before the next; the last row holds itself.
    let from_row = (row * (fine - 1) + count - 2) / (count - 1);
    let to_row = min(((row + 1) * (fine - 1) + count - 2) / (count - 1), fine);
    let rise = f32(count - 1) / f32(fine - 1);
    let coded = sky_coded(eye);
    for (var layer = 0; layer < 2; layer++) {
        let a = textureLoad(columns, vec2<i32>(column, start + first), layer, 0).rgb;
        let b = textureLoad(columns, vec2<i32>(column, start + first + 1), layer, 0).rgb;
        let c = textureLoad(columns, vec2<i32>(column, start + min(first + 2, count - 1)), layer, 0).rgb;
        let d = textureLoad(columns, vec2<i32>(column, start + min(first + 3, count - 1)), layer, 0).rgb;
        for (var k = from_row; k < to_row; k++) {
            let weights = cubic_weights(f32(k) * rise - f32(first), few);
            let sum = a * weights.x + b * weights.y + c * weights.z + d * weights.w;
            // Light is not negative; codes may be.
            textureStore(sky, vec2<i32>(column, fine_start + k), layer, vec4<f32>(select(max(sum, vec3<f32>(0.0)), sum, coded), 1.0));
        }
    }
}
    }#
}#
