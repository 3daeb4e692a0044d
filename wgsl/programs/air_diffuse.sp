The table of light scattered more than once, order by order: the first order out of the sun, each other out of the one before, and a last, which adds all
of them up and closes with a geometric series. In thin air that is the third; the thicker the air, the more orders lie between. Made anew only when the layers or the ground change.

#PROGRAM{ air_diffuse }#

#COMPUTE{
    #CODE{
#import veduta::atmosphere::medium::{Air}
#import veduta::atmosphere::columns::{texel_coordinates}
#import veduta::atmosphere::diffuse::{Moments, diffuse_place, encode_moments, decode_moments, add_moments}
#import veduta::atmosphere::orders::{order_moments, further_orders}

// 1, 2, 3 for the last, 4 for those between it and the second.
override SCATTERING_ORDER: i32 = 1;

@group(0) @binding(0) var<uniform> air: Air;
@group(1) @binding(0) var linear: sampler;
@group(1) @binding(1) var columns: texture_2d_array<f32>;
// The order before, and the sum of those before that.
@group(1) @binding(2) var before: texture_2d_array<f32>;
@group(1) @binding(3) var earlier: texture_2d_array<f32>;
@group(2) @binding(0) var moments: texture_storage_2d_array<rgba16float, write>;
// Sum of all orders before this one, where it lies between.
@group(2) @binding(1) var sums: texture_storage_2d_array<rgba16float, write>;

fn order_at(order: texture_2d_array<f32>, texel: vec2<u32>) -> Moments {
    return decode_moments(textureLoad(order, texel, 0, 0), textureLoad(order, texel, 1, 0), textureLoad(order, texel, 2, 0));
}

@compute @workgroup_size(4, 4)
fn bake(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = textureDimensions(moments);
    if id.x >= size.x || id.y >= size.y {
        return;
    }
    let place = diffuse_place(air.top, texel_coordinates(vec2<f32>(id.xy), vec2<f32>(size)));
    var found = order_moments(columns, before, linear, air, place.x, place.y, SCATTERING_ORDER == 1);
    if SCATTERING_ORDER >= 3 {
        let last = order_at(before, id.xy);
        let sum = add_moments(order_at(earlier, id.xy), last);
        if SCATTERING_ORDER == 3 {
            found = add_moments(sum, further_orders(last, found));
        } else {
            textureStore(sums, id.xy, 0, encode_moments(sum));
            textureStore(sums, id.xy, 1, vec4<f32>(sum.up, sum.aside.y));
            textureStore(sums, id.xy, 2, vec4<f32>(sum.level, sum.aside.z));
        }
    }
    textureStore(moments, id.xy, 0, encode_moments(found));
    textureStore(moments, id.xy, 1, vec4<f32>(found.up, found.aside.y));
    textureStore(moments, id.xy, 2, vec4<f32>(found.level, found.aside.z));
}
    }#
}#
