//! The cloud layer from a baked tile: density and optical depth to the sun in one fetch, in coordinates that follow the sun's rays.
//! source   columns along the sun: ours; energy-conserving step: Hillaire2015
//! symbols  t distance along the view ray [m] · shear horizontal way of a column per metre of height [1]
#define_import_path veduta::clouds::tile

#import veduta::planet::shell::{ShellSegment, altitude_along, shell_segment, clip_segment, segment_length, segment_distance}
#import veduta::clouds::code::{tile_value}
#import veduta::clouds::integral::{mean_density}
#import veduta::clouds::march::{CloudLight}

/// A tile that repeats along x and z.
struct CloudTile {
    /// Where the eye's foot point lies on it, in tiles.
    place: vec2<f32>,
    /// Horizontal way of the tile's columns, over their rise: that of a sun's ray, or 0 for a low sun.
    shear: vec2<f32>,
    /// Horizontal way of a sun's ray, over its rise.
    sunward: vec2<f32>,
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
    /// Way that is free of clouds for each unit that the tile's density is below 0 [m].
    clear: f32,
    /// The least density that the tile tells, below 0; 1 for a tile of 16 bits a number, which tells all [1].
    least: f32,
}

/// Density before its cut at 0 and optical depth to the sun at a point given relative to the eye, whose altitude is `altitude`.
///
/// domain  relative in [-1e5, 1e5] m lin
/// domain  altitude in [4000, 5500] m lin
/// range   [-1e3, 6.5e4] 1
/// error   2e-2 abs of reference::clouds::uncut_density
/// outside undefined
/// source  ours
fn tile_at(tile: texture_3d<f32>, linear: sampler, layer: CloudTile, relative: vec2<f32>, altitude: f32) -> vec2<f32> {
    let above = clamp(altitude - layer.bottom, 0.0, layer.thickness);
    let place = layer.place + (relative - layer.shear * above) * layer.tiles_per_metre;
    let level = (above / max(layer.thickness, 1e-3) * (layer.levels - 1.0) + 0.5) / layer.levels;
    return tile_value(textureSampleLevel(tile, linear, vec3<f32>(place, level), 0.0).xy, layer.least);
}

/// Share of the sun's light that the layer lets straight through to a point given relative to the eye, below, inside or above it.
///
/// domain  relative in [-1e5, 1e5] m lin
/// domain  altitude in [0, 1e5] m lin
/// range   [0, 1] 1
/// error   5e-2 abs of reference::clouds::sun_depth
/// outside undefined
/// source  ours
fn cloud_shadow(tile: texture_3d<f32>, linear: sampler, layer: CloudTile, relative: vec2<f32>, altitude: f32) -> f32 {
    // Where the sun's ray meets the layer.
    let met = clamp(altitude, layer.bottom, layer.bottom + layer.thickness);
    return exp(-tile_at(tile, linear, layer, relative + layer.sunward * (met - altitude), met).y);
}

/// Light of all orders along a ray through the layer, in parts that light and phase function weigh.
struct OrderedLight {
    /// Of the sun's light that has come straight to where it was scattered, what nothing takes away but scattering at all angles [1].
    whole: f32,
    /// The same where the peak of the phase function takes nothing away.
    kept: f32,
    /// What was scattered before: of the sun's light, for an irradiance of 1 [1/sr]; of the light from above and from below, for a radiance of 1 [1].
    before: vec3<f32>,
    /// Transmittance of the ray.
    transmittance: f32,
    /// Transmittance where the peak takes nothing away.
    kept_transmittance: f32,
    /// Mean distance of what is seen of the clouds [m], by what each stretch takes of that transmittance; the layer's entry where there are none.
    mean_distance: f32,
}

/// What the cells of a layer scatter at a point given relative to the eye, towards a view whose cosine to the sun is `nu`: of the sun's light for an
/// irradiance of 1, of the light from above and of that from below for a radiance of 1.
///
/// domain  relative in [-1e5, 1e5] m lin
/// domain  altitude in [4000, 5500] m lin
/// domain  nu in [-1, 1] 1 lin
/// range   [0, 6.5e4] 1
/// error   2e-1 rel of reference::volume::layer_light
/// outside undefined
/// source  ours
fn cells_at(cells: texture_3d<f32>, linear: sampler, layer: CloudTile, relative: vec2<f32>, altitude: f32, nu: f32) -> vec3<f32> {
    let level = clamp((altitude - layer.bottom) / max(layer.thickness, 1e-3), 0.0, 1.0);
    let place = layer.place + relative * layer.tiles_per_metre;
    let found = textureSampleLevel(cells, linear, vec3<f32>(place, level), 0.0);
    return vec3<f32>(max(found.x + found.y * nu, 0.0), found.zw);
}

/// A view ray within a layer: its segment, the steps that it is taken in, and its altitudes, by a parabola about the middle of the segment.
struct TilePath {
    /// The stretch within the layer.
    segment: ShellSegment,
    /// Length in the layer [m].
    size: f32,
    /// Length of a step outside of clear air [m].
    even: f32,
    /// Steps at most.
    count: i32,
    /// Distance of the middle [m].
    middle: f32,
    /// Altitude of the middle [m].
    level: f32,
    /// Rise of the ray there [1].
    rise: f32,
    /// Half of what the planet bends away under it [1/m].
    bend: f32,
}

/// The path of a view ray through a layer; `steps` are those of a ray that is eight times as long in the layer as the layer is thick.
///
/// internal
fn tile_path(layer: CloudTile, ground_radius: f32, eye_altitude: f32, dir: vec3<f32>, max_distance: f32, steps: i32) -> TilePath {
    let whole = shell_segment(ground_radius, layer.bottom, layer.bottom + layer.thickness, eye_altitude, dir.y);
    let segment = clip_segment(whole, max_distance);
    let size = segment_length(segment);
    let share = sqrt(size / max(8.0 * layer.thickness, 1e-3));
    let count = select(0, clamp(i32(ceil(f32(steps) * share)), 2, 4 * max(steps, 1)), size > 0.0);
    let middle = 0.5 * (segment.near + segment.far);
    let level = altitude_along(ground_radius, eye_altitude, dir.y, middle);
    let radius = ground_radius + level;
    let rise = clamp(((ground_radius + eye_altitude) * dir.y + middle) / radius, -1.0, 1.0);
    return TilePath(segment, size, size / f32(max(count, 1)), count, middle, level, rise, 0.5 * (1.0 - rise * rise) / radius);
}

/// Altitude at a distance from the eye.
///
/// internal
fn path_altitude(path: TilePath, distance: f32) -> f32 {
    let off = distance - path.middle;
    return path.level + off * (path.rise + off * path.bend);
}

/// Light of all orders of the cloud layer along a view ray up to `max_distance`, stepped as [`march_tile`] is, with a fetch more a step. The phase function is one
/// part that turns light and a peak that hardly does; `kept` is what is left of the extinction without the peak, `nu` the cosine between view and sun; the
/// first step is shorter by `start`, a share of it. Ends when less than `min_transmittance` is left without the peak.
///
/// domain  kept in [0.001, 1] 1 lin
/// domain  nu in [-1, 1] 1 lin
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  eye_altitude in [0, 1e5] m lin
/// domain  dir in [-1, 1] 1 lin
/// domain  max_distance in [0, 1e5] m lin
/// domain  min_transmittance in [0, 0.1] 1 lin
/// domain  steps in [1, 512] 1 lin
/// domain  start in [0, 1] 1 lin
/// range   [0, 1e6] 1
/// error   1e-1 rel of reference::volume::layer_light
/// outside undefined
/// source  ours
fn march_tile_orders(tile: texture_3d<f32>, cells: texture_3d<f32>, linear: sampler, layer: CloudTile, kept: f32, nu: f32, ground_radius: f32, eye_altitude: f32,
    dir: vec3<f32>, max_distance: f32, min_transmittance: f32, steps: i32, start: f32) -> OrderedLight {
    let path = tile_path(layer, ground_radius, eye_altitude, dir, max_distance, steps);
    let deepest = -log(max(min_transmittance, 1e-20)) / max(kept, 1e-3);
    var t = segment_distance(path.segment, 0.0);
    var here = tile_at(tile, linear, layer, dir.xz * t, path_altitude(path, t));
    var depth = 0.0;
    var reach = here.y;
    var lit = exp(-vec2<f32>(1.0, kept) * reach);
    var left = 1.0;
    var once = vec2<f32>(0.0);
    var sent = vec3<f32>(0.0);
    var weighted = 0.0;
    var s = 0.0;
    var stride = 1.0 - start;
    let most = path.count + select(0, 1, start > 0.0);
    for (var i = 0; i < most && s < path.size && depth < deepest; i++) {
        s = min(s + stride * max(path.even * (2.0 - left), -layer.clear * here.x), path.size);
        stride = 1.0;
        let at = segment_distance(path.segment, s);
        let next = tile_at(tile, linear, layer, dir.xz * at, path_altitude(path, at));
        let added = mean_density(here.x, next.x) * layer.extinction * (at - t);
        depth += added;
        let ahead = depth + next.y;
        let dim = exp(-vec2<f32>(1.0, kept) * ahead);
        let change = vec2<f32>(1.0, kept) * (ahead - reach);
        let mean = select((lit - dim) / change, 0.33333334 * (0.5 * (lit + dim) + 2.0 * sqrt(lit * dim)), abs(change) < vec2<f32>(0.5));
        once += added * mean;
        let through = exp(-kept * depth);
        let half_way = 0.5 * (at + t);
        sent += (left - through) * cells_at(cells, linear, layer, dir.xz * half_way, path_altitude(path, half_way), nu);
        weighted += (left - through) * half_way;
        left = through;
        lit = dim;
        reach = ahead;
        here = next;
        t = at;
    }
    let weight = 1.0 - left;
    return OrderedLight(once.x, once.y, sent, exp(-depth), left, select(path.segment.near, weighted / max(weight, 1e-12), weight > 1e-6));
}

/// Light of the cloud layer along a view ray up to `max_distance`, in steps of one fetch, for an albedo and a phase function of 1. `steps` are those of a
/// ray that is eight times as long in the layer as the layer is thick; a longer ray takes more, a shorter one less, by the root of its length. Steps grow
/// where the tile says that no cloud is near, and to twice as long as less light is left. Light and depth of a step are exact where its extinction is even and
/// the depth to the sun changes evenly. The first step is shorter by `start`, a share of it, for a jitter. Ends when less than `min_transmittance` is left.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  eye_altitude in [0, 1e5] m lin
/// domain  dir in [-1, 1] 1 lin
/// domain  max_distance in [0, 1e5] m lin
/// domain  min_transmittance in [0, 0.1] 1 lin
/// domain  steps in [1, 512] 1 lin
/// domain  start in [0, 1] 1 lin
/// range   [0, 1e6] 1
/// error   2e-2 abs of reference::clouds::march_clouds
/// outside undefined
/// source  ours
fn march_tile(tile: texture_3d<f32>, linear: sampler, layer: CloudTile, ground_radius: f32, eye_altitude: f32, dir: vec3<f32>, max_distance: f32,
    min_transmittance: f32, steps: i32, start: f32) -> CloudLight {
    let path = tile_path(layer, ground_radius, eye_altitude, dir, max_distance, steps);
    let deepest = -log(max(min_transmittance, 1e-20));
    var t = segment_distance(path.segment, 0.0);
    var here = tile_at(tile, linear, layer, dir.xz * t, path_altitude(path, t));
    var depth = 0.0;
    var left = 1.0;
    var lit = exp(-here.y);
    var reach = here.y;
    var scatter = 0.0;
    var weighted = 0.0;
    var samples = 0;
    var s = 0.0;
    var stride = 1.0 - start;
    let most = path.count + select(0, 1, start > 0.0);
    for (var i = 0; i < most && s < path.size && depth < deepest; i++) {
        s = min(s + stride * max(path.even * (2.0 - left), -layer.clear * here.x), path.size);
        stride = 1.0;
        let at = segment_distance(path.segment, s);
        let next = tile_at(tile, linear, layer, dir.xz * at, path_altitude(path, at));
        let added = mean_density(here.x, next.x) * layer.extinction * (at - t);
        depth += added;
        // Light at the end of the step, and its mean: the logarithmic one.
        let ahead = depth + next.y;
        let dim = exp(-ahead);
        let change = ahead - reach;
        let mean = select((lit - dim) / change, 0.33333334 * (0.5 * (lit + dim) + 2.0 * sqrt(lit * dim)), abs(change) < 0.5);
        scatter += added * mean;
        let through = exp(-depth);
        weighted += (left - through) * 0.5 * (at + t);
        left = through;
        lit = dim;
        reach = ahead;
        here = next;
        t = at;
        samples += 1;
    }
    let weight = 1.0 - left;
    return CloudLight(scatter, left, select(path.segment.near, weighted / max(weight, 1e-12), weight > 1e-6), samples, 0);
}
