//! Normals of the terrain by central differences of its height.
//! source   Leitner2022 listing 5.3, corrected; on the sphere: ours
//! symbols  step half the span of the differences [m] · octaves number of octaves [1]
#define_import_path veduta::terrain::normal

#import veduta::planet::shell::{up_at}
#import veduta::terrain::height::{Terrain, height}

/// Slope of the ground, (dh/dx, dh/dz), by central differences over `2 step`; the span is also a low-pass filter, so
/// tie it to the pixel's footprint.
///
/// domain  offset in [-1e5, 1e5] m lin
/// domain  step in [1, 1000] m log
/// domain  octaves in [1, 16] 1 lin
/// range   [-1e4, 1e4] 1
/// error   6e-3 abs of reference::terrain::terrain_slope
/// outside undefined
/// source  Leitner2022 listing 5.3
fn terrain_slope(terrain: Terrain, offset: vec2<f32>, step: f32, octaves: i32) -> vec2<f32> {
    let east = height(terrain, offset + vec2<f32>(step, 0.0), octaves);
    let west = height(terrain, offset - vec2<f32>(step, 0.0), octaves);
    let south = height(terrain, offset + vec2<f32>(0.0, step), octaves);
    let north = height(terrain, offset - vec2<f32>(0.0, step), octaves);
    return vec2<f32>(east - west, south - north) / (2.0 * step);
}

/// Unit normal in the local frame, whose +Y is up at the point itself; its y is the cosine of the slope and positive.
///
/// domain  offset in [-1e5, 1e5] m lin
/// domain  step in [1, 1000] m log
/// domain  octaves in [1, 16] 1 lin
/// range   [-1, 1] 1
/// error   3e-3 abs of reference::terrain::local_normal
/// outside undefined
/// source  Leitner2022 listing 5.3
fn local_normal(terrain: Terrain, offset: vec2<f32>, step: f32, octaves: i32) -> vec3<f32> {
    let slope = terrain_slope(terrain, offset, step, octaves);
    return vec3<f32>(-slope.x, 1.0, -slope.y) * inverseSqrt(1.0 + dot(slope, slope));
}

/// Unit normal in the eye's frame at a point given relative to the eye: the gradient of altitude minus height, which is
/// exact for the surface that the march meets.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  eye_altitude in [0, 1e5] m lin
/// domain  relative in [-1e5, 1e5] m lin
/// domain  step in [1, 1000] m log
/// domain  octaves in [1, 16] 1 lin
/// range   [-1, 1] 1
/// error   3e-3 abs of reference::terrain::terrain_normal
/// outside undefined
/// source  Leitner2022 listing 5.3; departs: gradient on the sphere
fn terrain_normal(terrain: Terrain, ground_radius: f32, eye_altitude: f32, relative: vec3<f32>, step: f32, octaves: i32) -> vec3<f32> {
    let slope = terrain_slope(terrain, relative.xz, step, octaves);
    let gradient = up_at(ground_radius, eye_altitude, relative) - vec3<f32>(slope.x, 0.0, slope.y);
    return gradient * inverseSqrt(max(dot(gradient, gradient), 1e-12));
}
