//! Diffuse light of an outdoor scene from three directional lights.
//! source   Leitner2022 ch. 4.3 (after Quilez2013)
//! symbols  normal unit normal · to_sun unit direction to the sun · shadow share of sunlight that arrives [1]
#define_import_path veduta::terrain::shading

/// Irradiances of the three lights, before the surface's albedo.
struct ThreeLights {
    /// Direct sunlight; the only one with a shadow.
    sun_color: vec3<f32>,
    /// Ambient light of the sky, from straight above.
    sky_color: vec3<f32>,
    /// Light that the ground returns towards where the sun's came from.
    bounce_color: vec3<f32>,
}

/// Horizontal direction from which the bounce light comes, away from the sun; it shrinks to zero with the sun in the zenith.
///
/// domain  to_sun in [-1, 1] 1 lin
/// range   [-1, 1] 1
/// error   4e-7 abs of reference::terrain::bounce_direction
/// source  Leitner2022 ch. 4.3; guarded at the zenith
fn bounce_direction(to_sun: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(-to_sun.x, 0.0, -to_sun.z) * inverseSqrt(max(dot(to_sun.xz, to_sun.xz), 1e-10));
}

/// Light received by a surface from sun, sky and bounce; multiply it by the albedo.
///
/// domain  normal in [-1, 1] 1 lin
/// domain  to_sun in [-1, 1] 1 lin
/// domain  shadow in [0, 1] 1 lin
/// domain  lights.sun_color in [0, 10] 1 lin
/// domain  lights.sky_color in [0, 10] 1 lin
/// domain  lights.bounce_color in [0, 10] 1 lin
/// range   [0, 30] 1
/// error   5e-6 abs of reference::terrain::shade_three_lights
/// outside undefined
/// source  Leitner2022 eq. 4.1; departs: clamped at 0
fn shade_three_lights(lights: ThreeLights, normal: vec3<f32>, to_sun: vec3<f32>, shadow: f32) -> vec3<f32> {
    let direct = max(dot(normal, to_sun), 0.0) * shadow;
    let ambient = max(normal.y, 0.0);
    let bounce = max(dot(normal, bounce_direction(to_sun)), 0.0);
    return direct * lights.sun_color + ambient * lights.sky_color + bounce * lights.bounce_color;
}

/// Light received by a surface of which only mean slopes are known: `lost` is the mean square of the slopes about them. The mean of the normals is shorter
/// than 1, and where the sun grazes the surface part of it is lit.
///
/// With normals spread by s about the mean, the mean of max(n . l, 0) is taken for (x + sqrt(x^2 + (0.8 s)^2)) / 2, exact far from and at x = 0.
///
/// domain  slope in [-10, 10] 1 lin
/// domain  lost in [0, 10] 1 lin
/// domain  to_sun in [-1, 1] 1 lin
/// domain  shadow in [0, 1] 1 lin
/// domain  lights.sun_color in [0, 10] 1 lin
/// domain  lights.sky_color in [0, 10] 1 lin
/// domain  lights.bounce_color in [0, 10] 1 lin
/// range   [0, 40] 1
/// error   1e-5 abs of reference::terrain::shade_rough
/// outside undefined
/// source  Leitner2022 eq. 4.1; mean over slopes: ours
fn shade_rough(lights: ThreeLights, slope: vec2<f32>, lost: f32, to_sun: vec3<f32>, shadow: f32) -> vec3<f32> {
    let shrink = inverseSqrt(1.0 + dot(slope, slope) + lost);
    let normal = vec3<f32>(-slope.x, 1.0, -slope.y) * shrink;
    // The slopes' spread towards the sun, and towards a level light.
    let spread = 0.8 * shrink * sqrt(0.5 * lost);
    let x = dot(normal, to_sun);
    let width = spread * length(to_sun.xz);
    let direct = 0.5 * (x + sqrt(x * x + width * width));
    let y = dot(normal, bounce_direction(to_sun));
    let bounce = 0.5 * (y + sqrt(y * y + spread * spread));
    return max(direct, 0.0) * shadow * lights.sun_color + normal.y * lights.sky_color + max(bounce, 0.0) * lights.bounce_color;
}
