//! The sun's disc with a limb that is antialiased and an irradiance that no pixel size changes.
//! source   elementary; energy-conserving limb: ours
//! symbols  angular_radius of the disc [rad] · pixel_angle angle between neighbouring pixels [rad]
#define_import_path veduta::atmosphere::sun_disc

const PI: f32 = 3.14159265;

/// Radiance of the sun's disc for an irradiance of 1, uniform over the disc, with a linear ramp one pixel wide across
/// the limb; its integral over the sphere is 1 for every pixel size. Multiply by the transmittance of the air.
///
/// domain  dir in [-1, 1] 1 lin
/// domain  to_sun in [-1, 1] 1 lin
/// domain  angular_radius in [1e-3, 0.1] rad log
/// domain  pixel_angle in [1e-4, 0.1] rad log
/// range   [0, 4e5] 1/sr
/// error   20 abs of reference::atmosphere::sun_disc
/// outside undefined
/// source  chord distance to the disc's centre; area of the ramp in closed form
fn sun_disc(dir: vec3<f32>, to_sun: vec3<f32>, angular_radius: f32, pixel_angle: f32) -> f32 {
    let ramp = max(pixel_angle, 1e-7);
    let angle = distance(dir, to_sun);
    let coverage = clamp(0.5 + (angular_radius - angle) / ramp, 0.0, 1.0);
    let outer = angular_radius + 0.5 * ramp;
    let area = select(angular_radius * angular_radius + ramp * ramp / 12.0, outer * outer * outer / (3.0 * ramp), ramp > 2.0 * angular_radius);
    return coverage / (PI * area);
}
