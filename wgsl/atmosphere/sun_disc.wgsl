//! The sun's disc with a limb that is antialiased and an irradiance that no pixel size changes.
//! source   elementary; energy-conserving limb and discs smaller than a pixel: ours
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
/// error   13.5 abs of reference::atmosphere::sun_disc
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

/// Area of the unit disc between the level of its centre and `y`, in [0, 1], on one side.
///
/// internal
fn disc_below(y: vec4<f32>) -> vec4<f32> {
    // The arc sine to 2e-8, which no device's own promises.
    var arc = 0.0066700901 - 0.0012624911 * y;
    arc = 0.0308918810 + y * (-0.0170881256 + y * arc);
    arc = 0.0889789874 + y * (-0.0501743046 + y * arc);
    arc = 1.5707963050 + y * (-0.2145988016 + y * arc);
    return 0.5 * (y * sqrt((1.0 - y) * (1.0 + y)) + (1.57079633 - sqrt(1.0 - y) * arc));
}

/// Area [px^2] of a disc within the pixel about the origin, which is a unit square; the disc's centre and radius are in pixels. Over all pixels the areas
/// add up to that of the disc, wherever it stands among them.
///
/// domain  centre in [-64, 64] px lin
/// domain  radius in [1e-3, 16] px log
/// range   [-1e-4, 1.0001] px^2
/// error   1e-4 abs of reference::atmosphere::disc_in_pixel
/// outside undefined
/// source  elementary; arc sine Abramowitz1964 4.4.46
fn disc_in_pixel(centre: vec2<f32>, radius: f32) -> f32 {
    let over = 1.0 / radius;
    // Edges of the pixel as seen from the disc's centre, in radii.
    let low = clamp((vec2<f32>(-0.5) - centre) * over, vec2<f32>(-1.0), vec2<f32>(1.0));
    let high = clamp((vec2<f32>(0.5) - centre) * over, vec2<f32>(-1.0), vec2<f32>(1.0));
    let x = vec2<f32>(low.x, high.x);
    let y = vec2<f32>(low.y, high.y);
    // Where the disc's edge crosses the sides, and the areas up to there.
    let cross = sqrt((1.0 - x) * (1.0 + x));
    let up = abs(y);
    let below = disc_below(vec4<f32>(up, cross));
    let side = abs(x).xxyy;
    let beyond = below.xyxy - below.zzww;
    let flat = side * min(up.xyxy, cross.xxyy);
    let parts = (flat + max(beyond, vec4<f32>(0.0))) * sign(y).xyxy;
    return (sign(x.y) * (parts.w - parts.z) - sign(x.x) * (parts.y - parts.x)) * (radius * radius);
}
