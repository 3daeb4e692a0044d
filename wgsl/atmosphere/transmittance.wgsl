//! The table of transmittance: what is left of sunlight at a place in the air, colour by colour; one read in place of columns and an exponential.
//! source   Bruneton2017, Hillaire2020 (transmittance by height and zenith angle); roots that are dense at the horizon and at the ground, and the payload: ours
//! symbols  h altitude [m] · mu zenith cosine · x, y coordinates in [0, 1]
//!
//! A texel holds, for altitude h and zenith cosine mu above the horizon, the root of the transmittance from there to the top of the air for red, green
//! and blue [1], and 1; a root, since it falls half as steeply. Paths end at the top; the table has none that meet the ground.
#define_import_path veduta::atmosphere::transmittance

#import veduta::atmosphere::medium::{Air, air_extinction}
#import veduta::atmosphere::columns::{columns_to_top, horizon_cosine, texture_place}

/// Coordinates in the table of altitude `h` and zenith cosine `mu`; below the horizon those of the horizon.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  top in [5e4, 2e5] m lin
/// domain  h in [0, top] m lin
/// domain  mu in [-1, 1] 1 lin
/// range   [0, 1] 1
/// error   3.5e-5 abs of reference::air_tables::transmittance_coordinates
/// source  ours
fn transmittance_coordinates(ground_radius: f32, top: f32, h: f32, mu: f32) -> vec2<f32> {
    let horizon = horizon_cosine(ground_radius, h);
    let x = sqrt(clamp((mu - horizon) / (1.0 - horizon), 0.0, 1.0));
    return vec2<f32>(x, sqrt(clamp(h / top, 0.0, 1.0)));
}

/// Altitude [m] and zenith cosine of coordinates: the inverse of `transmittance_coordinates`. The error is that of the altitude.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  top in [5e4, 2e5] m lin
/// domain  place in [0, 1] 1 lin
/// range   [-1, 2e5] 1
/// error   0.02 abs of reference::air_tables::transmittance_place
/// outside undefined
/// source  as transmittance_coordinates
fn transmittance_place(ground_radius: f32, top: f32, place: vec2<f32>) -> vec2<f32> {
    let h = top * place.y * place.y;
    let horizon = horizon_cosine(ground_radius, h);
    return vec2<f32>(h, horizon + (1.0 - horizon) * place.x * place.x);
}

/// The texel of the table for altitude `h` and zenith cosine `mu`.
///
/// domain  h in [0, air.top] m lin
/// domain  mu in [-1, 1] 1 lin
/// range   [0, 1] 1
/// error   1e-4 abs of reference::air_tables::transmittance_code
/// outside undefined
/// source  ours
fn transmittance_code(air: Air, h: f32, mu: f32) -> vec3<f32> {
    return exp(-0.5 * air_extinction(air, columns_to_top(air, h, mu)));
}

/// What is left of sunlight at altitude `h`, of a sun at the zenith cosine `mu`, read from the table; of a sun below the horizon what is left along the
/// horizon.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  top in [5e4, 2e5] m lin
/// domain  h in [0, 1e5] m lin
/// domain  mu in [-1, 1] 1 lin
/// range   [0, 1] 1
/// error   0.02 abs of reference::air_tables::sun_depth
/// source  Bruneton2017 GetTransmittanceToTopAtmosphereBoundary
fn table_transmittance(table: texture_2d<f32>, linear: sampler, ground_radius: f32, top: f32, h: f32, mu: f32) -> vec3<f32> {
    let size = vec2<f32>(textureDimensions(table));
    let place = texture_place(transmittance_coordinates(ground_radius, top, h, mu), size);
    let code = textureSampleLevel(table, linear, place, 0.0).rgb;
    return code * code;
}
