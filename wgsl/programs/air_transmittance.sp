The table of transmittance towards the sun, for shaders that want the sun's colour at many places with one read. Made anew only when the air changes.

#PROGRAM{ air_transmittance }#

#COMPUTE{
    #CODE{
#import veduta::atmosphere::medium::{Air}
#import veduta::atmosphere::columns::{texel_coordinates}
#import veduta::atmosphere::transmittance::{transmittance_code, transmittance_place}

@group(0) @binding(0) var<uniform> air: Air;
@group(2) @binding(0) var table: texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(8, 8)
fn bake(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = textureDimensions(table);
    if id.x >= size.x || id.y >= size.y {
        return;
    }
    let place = transmittance_place(air.ground_radius, air.top, texel_coordinates(vec2<f32>(id.xy), vec2<f32>(size)));
    textureStore(table, id.xy, vec4<f32>(transmittance_code(air, place.x, place.y), 1.0));
}
    }#
}#
