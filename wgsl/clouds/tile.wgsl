//! The cloud layer from a baked tile: density and optical depth to the sun in one fetch, in coordinates that follow the sun's rays.
//! source   columns along the sun: ours; energy-conserving step: Hillaire2015
//! symbols  t distance along the view ray [m] · shear horizontal way of a sun's ray per metre of height [1]
#define_import_path veduta::clouds::tile

#import veduta::planet::shell::{altitude_along, shell_segment, clip_segment, segment_length, segment_distance}
#import veduta::clouds::integral::{step_light}
#import veduta::clouds::march::{CloudLight}

/// A tile that repeats along x and z.
struct CloudTile {
    /// Where the eye's foot point lies on it, in tiles.
    place: vec2<f32>,
    /// Horizontal way of a sun's ray, over its rise.
    shear: vec2<f32>,
    /// Tiles a metre [1/m].
    tiles_per_metre: f32,
    /// Altitude of the lower sphere [m].
    bottom: f32,
    /// Distance between the spheres [m].
    thickness: f32,
    /// Levels of the tile: the first lies on the lower sphere, the last on the upper.
    levels: f32,
    /// Extinction at full density [1/m].
    extinction: f32,
}

/// Density and optical depth to the sun at a point given relative to the eye, whose altitude is `altitude`.
///
/// internal
fn tile_at(tile: texture_3d<f32>, linear: sampler, layer: CloudTile, relative: vec2<f32>, altitude: f32) -> vec2<f32> {
    let above = clamp(altitude - layer.bottom, 0.0, layer.thickness);
    let place = layer.place + (relative - layer.shear * above) * layer.tiles_per_metre;
    let level = (above / max(layer.thickness, 1e-3) * (layer.levels - 1.0) + 0.5) / layer.levels;
    return textureSampleLevel(tile, linear, vec3<f32>(place, level), 0.0).xy;
}

/// Light of the cloud layer along a view ray up to `max_distance`, in `steps` equal steps of one fetch, for an albedo and a phase function of 1.
/// Light and depth of a step are exact where its extinction is even and the depth to the sun changes evenly. Ends when less than `min_transmittance` is
/// left.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  eye_altitude in [0, 1e5] m lin
/// domain  dir in [-1, 1] 1 lin
/// domain  max_distance in [0, 1e5] m lin
/// domain  min_transmittance in [0, 0.1] 1 lin
/// domain  steps in [1, 512] 1 lin
/// range   [0, 1e6] 1
/// error   2e-2 abs of reference::clouds::march_clouds
/// outside undefined
/// source  ours
fn march_tile(tile: texture_3d<f32>, linear: sampler, layer: CloudTile, ground_radius: f32, eye_altitude: f32, dir: vec3<f32>, max_distance: f32,
    min_transmittance: f32, steps: i32) -> CloudLight {
    let whole = shell_segment(ground_radius, layer.bottom, layer.bottom + layer.thickness, eye_altitude, dir.y);
    let segment = clip_segment(whole, max_distance);
    let size = segment_length(segment);
    let count = select(0, max(steps, 1), size > 0.0);
    let ds = size / f32(max(count, 1));
    let scale = 0.5 * layer.extinction * ds;
    // Altitudes by a parabola about the middle of the segment.
    let middle = 0.5 * (segment.near + segment.far);
    let level = altitude_along(ground_radius, eye_altitude, dir.y, middle);
    let radius = ground_radius + level;
    let rise = clamp(((ground_radius + eye_altitude) * dir.y + middle) / radius, -1.0, 1.0);
    let bend = 0.5 * (1.0 - rise * rise) / radius;
    let start = segment_distance(segment, 0.0);
    let before = start - middle;
    var here = tile_at(tile, linear, layer, dir.xz * start, level + before * (rise + before * bend));
    var transmittance = 1.0;
    var scatter = 0.0;
    var weighted = 0.0;
    var samples = 0;
    for (var i = 1; i <= count && transmittance > min_transmittance; i++) {
        let t = segment_distance(segment, f32(i) * ds);
        let off = t - middle;
        let next = tile_at(tile, linear, layer, dir.xz * t, level + off * (rise + off * bend));
        let depth = scale * (here.x + next.x);
        let left = transmittance * exp(-depth);
        scatter += transmittance * step_light(depth, here.y, next.y);
        weighted += (transmittance - left) * (t - 0.5 * ds);
        transmittance = left;
        here = next;
        samples += 1;
    }
    let weight = 1.0 - transmittance;
    return CloudLight(scatter, transmittance, select(segment.near, weighted / max(weight, 1e-12), weight > 1e-6), samples, 0);
}
