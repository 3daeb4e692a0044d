The table of columns between every altitude and the sun, layer by layer. Made anew only when the layers change.

#PROGRAM{ air_columns }#

#COMPUTE{
    #CODE{
#import veduta::atmosphere::medium::{Air}
#import veduta::atmosphere::columns::{column_place, column_code, texel_coordinates}

@group(0) @binding(0) var<uniform> air: Air;
@group(2) @binding(0) var columns: texture_storage_2d_array<rgba16float, write>;

@compute @workgroup_size(8, 8)
fn bake(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = textureDimensions(columns);
    if id.x >= size.x || id.y >= size.y {
        return;
    }
    let place = column_place(air.ground_radius, air.top, texel_coordinates(vec2<f32>(id.xy), vec2<f32>(size)));
    let code = column_code(air, place.x, place.y);
    textureStore(columns, id.xy, 0, code.low);
#ifdef AIR_EIGHT_LANES
    textureStore(columns, id.xy, 1, code.high);
#endif
}
    }#
}#
