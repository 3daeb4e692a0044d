//! Clouds in front of a background and behind the air.
//! source   Leitner2022 ch. 4.5 (aerial perspective on clouds); weights: ours
//! symbols  front the air between the eye and the clouds · background radiance without clouds, air included
#define_import_path veduta::clouds::composite

#import veduta::atmosphere::march::{SkyLight}
#import veduta::clouds::march::{CloudLight}

/// Radiance with clouds: their own light through the air before them, and of the background what lies behind them only
/// as far as they let it through. `sun_light` is the sun's irradiance at the clouds, `front` the air up to their mean distance.
///
/// domain  sun_light in [0, 1] 1 lin
/// domain  background in [0, 10] 1 lin
/// range   [0, 1000] 1/sr
/// error   1e-6 rel of reference::clouds::composite_clouds
/// outside undefined
/// source  eq. 4.3 for a layer of partial transmittance
fn composite_clouds(clouds: CloudLight, sun_light: vec3<f32>, front: SkyLight, background: vec3<f32>) -> vec3<f32> {
    let behind = max(background - front.in_scatter, vec3<f32>(0.0));
    return front.in_scatter + front.transmittance * (clouds.scatter * sun_light) + clouds.transmittance * behind;
}
