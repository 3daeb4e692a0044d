The table of the sky that pictures read: between the rows that `sky_view` has computed lie others, on cubics through the four nearest, so that no line between two
of them has a bend that the eye sees as a stripe. Rows above the horizon and below it never mix.

#PROGRAM{ sky_refine }#

#COMPUTE{
    #CODE{
#import veduta::atmosphere::sky_view::{SkyEye, sky_coded, sky_rows}

@group(0) @binding(1) var<uniform> eye: SkyEye;
@group(1) @binding(0) var computed: texture_2d_array<f32>;
@group(2) @binding(0) var sky: texture_storage_2d_array<rgba16float, write>;

// Lagrange's weights of rows 0 to 3 for the place `x` among them.
fn cubic(x: f32) -> vec4<f32> {
    let a = x - 1.0;
    let b = x - 2.0;
    let c = x - 3.0;
    return vec4<f32>(a * b * c * -0.16666667, x * b * c * 0.5, x * a * c * -0.5, x * a * b * 0.16666667);
}

@compute @workgroup_size(8, 8)
fn bake(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = textureDimensions(sky);
    if id.x >= size.x || id.y >= size.y {
        return;
    }
    let rows = f32(textureDimensions(computed).y);
    let fine_above = sky_rows(eye, f32(size.y));
    let above = sky_rows(eye, rows);
    let below = f32(id.y) >= fine_above;
    let fine = select(fine_above, f32(size.y) - fine_above, below);
    let count = select(above, rows - above, below);
    let at = (f32(id.y) - select(0.0, fine_above, below)) / (fine - 1.0) * (count - 1.0);
    let few = count < 4.0;
    // Of fewer than four rows two are enough for a line.
    let first = clamp(floor(at) - select(1.0, 0.0, few), 0.0, count - select(4.0, 2.0, few));
    let share = at - first;
    let weights = select(cubic(share), vec4<f32>(1.0 - share, share, 0.0, 0.0), few);
    let coded = sky_coded(eye);
    for (var layer = 0; layer < 2; layer++) {
        var sum = vec3<f32>(0.0);
        for (var k = 0; k < 4; k++) {
            let row = min(first + f32(k), count - 1.0) + select(0.0, above, below);
            sum += textureLoad(computed, vec2<i32>(i32(id.x), i32(row)), layer, 0).rgb * weights[k];
        }
        // Light is not negative; codes may be.
        textureStore(sky, id.xy, layer, vec4<f32>(select(max(sum, vec3<f32>(0.0)), sum, coded), 1.0));
    }
}
    }#
}#
