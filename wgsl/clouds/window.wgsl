//! The cloud layer from a stack of windows about the eye, each twice as wide as the one before: for a field that does not repeat. One fetch a step, as from a tile.
//! source   Losasso2004 (nested grids about the eye, each addressed on a torus); columns along the sun: ours
//! symbols  relative horizontal place from the eye's foot point [m] · altitude [m] · stack windows one above the other in one texture
#define_import_path veduta::clouds::window

#import veduta::planet::shell::{segment_distance}
#import veduta::clouds::code::{tile_value}
#import veduta::clouds::integral::{mean_density}
#import veduta::clouds::march::{CloudLight}
#import veduta::clouds::tile::{CloudTile, OrderedLight, tile_path, path_altitude}

/// Windows about the eye, the first the finest. Columns of a window follow the sun's rays, about the middle of the layer.
struct CloudWindows {
    /// From the eye along x and z, how far each of the first four windows holds what is baked [m]; at least as far as the one before.
    near: vec4<f32>,
    /// The same of the next four; of what there is not as much as of the last.
    wide: vec4<f32>,
    /// Where the eye's foot point lies on the widest window, in its edges.
    place: vec2<f32>,
    /// Horizontal way of the ray of the sun that windows were baked for, over its rise.
    shear: vec2<f32>,
    /// The same of the sun that the windows from `turned` on were baked for.
    next_shear: vec2<f32>,
    /// Widest windows a metre [1/m].
    per_metre: f32,
    /// Windows, in [1, 8].
    count: f32,
    /// Where in the stack, of one place more than windows, the first window lies.
    first: f32,
    /// The first window that lies a place farther in the stack, baked for the next sun.
    turned: f32,
    /// Altitude of the lower sphere [m].
    bottom: f32,
    /// Distance between the spheres [m].
    thickness: f32,
    /// Levels of a window: the first lies on the lower sphere, the last on the upper.
    levels: f32,
    /// Extinction at full density [1/m].
    extinction: f32,
    /// Way that is free of clouds for each unit that the density is below 0 [m].
    clear: f32,
    /// The least density that windows tell, below 0; 1 for those of 16 bits a number, which tell all [1].
    least: f32,
    /// Repetitions of the cells of light of all orders over the widest window.
    lit_scale: f32,
    /// Where what the cells hold begins to give way to their mean, and where it has [m].
    lit_near: f32,
    lit_wide: f32,
}

/// Density before its cut at 0 and optical depth to the sun at a point given relative to the eye, whose altitude is `altitude`, from the finest window that holds it.
///
/// domain  relative in [-1e5, 1e5] m lin
/// domain  altitude in [4000, 5500] m lin
/// range   [-1e3, 6.5e4] 1
/// error   1e-1 abs of reference::clouds::uncut_density
/// outside undefined
/// source  ours
fn window_at(stack: texture_3d<f32>, linear: sampler, windows: CloudWindows, relative: vec2<f32>, altitude: f32) -> vec2<f32> {
    let above = clamp(altitude - windows.bottom, 0.0, windows.thickness);
    let off = above - 0.5 * windows.thickness;
    let before = relative - windows.shear * off;
    let after = relative - windows.next_shear * off;
    let apart = max(abs(before), abs(after));
    let far = vec4<f32>(max(apart.x, apart.y));
    let passed = select(vec4<f32>(0.0), vec4<f32>(1.0), far >= windows.near) + select(vec4<f32>(0.0), vec4<f32>(1.0), far >= windows.wide);
    let window = min(dot(passed, vec4<f32>(1.0)), windows.count - 1.0);
    let turned = window >= windows.turned;
    let q = select(before, after, turned);
    // Two to the power of the windows that are wider.
    let scale = bitcast<f32>((i32(windows.count - window) + 126) << 23u);
    let slot = windows.first + window + select(0.0, 1.0, turned);
    let slots = windows.count + 1.0;
    let own = select(slot, slot - slots, slot >= slots);
    let level = (own * windows.levels + above / max(windows.thickness, 1e-3) * (windows.levels - 1.0) + 0.5) / (windows.levels * slots);
    let place = (windows.place + q * windows.per_metre) * scale;
    return tile_value(textureSampleLevel(stack, linear, vec3<f32>(place, level), 0.0).xy, windows.least);
}

/// Light of the cloud layer along a view ray up to `max_distance`, as `march_tile` of a tile gives it.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  eye_altitude in [0, 1e5] m lin
/// domain  dir in [-1, 1] 1 lin
/// domain  max_distance in [0, 1e5] m lin
/// domain  min_transmittance in [0, 0.1] 1 lin
/// domain  steps in [1, 512] 1 lin
/// domain  start in [0, 1] 1 lin
/// range   [0, 1e6] 1
/// error   5e-2 abs of reference::clouds::march_clouds
/// outside undefined
/// source  ours
fn march_windows(stack: texture_3d<f32>, linear: sampler, windows: CloudWindows, ground_radius: f32, eye_altitude: f32, dir: vec3<f32>, max_distance: f32,
    min_transmittance: f32, steps: i32, start: f32) -> CloudLight {
    let spheres = CloudTile(windows.place, windows.shear, windows.shear, windows.per_metre, windows.bottom, windows.thickness, windows.levels, windows.extinction, windows.clear, windows.least);
    let path = tile_path(spheres, ground_radius, eye_altitude, dir, max_distance, steps);
    let deepest = -log(max(min_transmittance, 1e-20));
    var t = segment_distance(path.segment, 0.0);
    var here = window_at(stack, linear, windows, dir.xz * t, path_altitude(path, t));
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
        s = min(s + stride * max(path.even * (2.0 - left), -windows.clear * here.x), path.size);
        stride = 1.0;
        let at = segment_distance(path.segment, s);
        let next = window_at(stack, linear, windows, dir.xz * at, path_altitude(path, at));
        let added = mean_density(here.x, next.x) * windows.extinction * (at - t);
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

/// What the cells of a layer scatter at a point given relative to the eye, as `cells_at` of a tile gives it; far from the eye the mean over the land.
///
/// domain  relative in [-1e5, 1e5] m lin
/// domain  altitude in [4000, 5500] m lin
/// domain  nu in [-1, 1] 1 lin
/// range   [0, 6.5e4] 1
/// error   3e-1 rel of reference::volume::layer_light
/// outside undefined
/// source  ours
fn window_cells_at(cells: texture_3d<f32>, mean: texture_3d<f32>, linear: sampler, windows: CloudWindows, relative: vec2<f32>, altitude: f32, nu: f32) -> vec3<f32> {
    let level = clamp((altitude - windows.bottom) / max(windows.thickness, 1e-3), 0.0, 1.0);
    let place = (windows.place + relative * windows.per_metre) * windows.lit_scale;
    let own = textureSampleLevel(cells, linear, vec3<f32>(place, level), 0.0);
    let all = textureSampleLevel(mean, linear, vec3<f32>(0.5, 0.5, level), 0.0);
    let apart = max(abs(relative.x), abs(relative.y));
    let found = mix(own, all, clamp((apart - windows.lit_near) / max(windows.lit_wide - windows.lit_near, 1.0), 0.0, 1.0));
    return vec3<f32>(max(found.x + found.y * nu, 0.0), found.zw);
}

/// Light of all orders of the cloud layer along a view ray up to `max_distance`, as `march_tile_orders` of a tile gives it.
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
/// error   2e-1 rel of reference::volume::layer_light
/// outside undefined
/// source  ours
fn march_windows_orders(stack: texture_3d<f32>, cells: texture_3d<f32>, mean_cells: texture_3d<f32>, linear: sampler, windows: CloudWindows, kept: f32, nu: f32,
    ground_radius: f32, eye_altitude: f32, dir: vec3<f32>, max_distance: f32, min_transmittance: f32, steps: i32, start: f32) -> OrderedLight {
    let spheres = CloudTile(windows.place, windows.shear, windows.shear, windows.per_metre, windows.bottom, windows.thickness, windows.levels, windows.extinction, windows.clear, windows.least);
    let path = tile_path(spheres, ground_radius, eye_altitude, dir, max_distance, steps);
    let deepest = -log(max(min_transmittance, 1e-20)) / max(kept, 1e-3);
    var t = segment_distance(path.segment, 0.0);
    var here = window_at(stack, linear, windows, dir.xz * t, path_altitude(path, t));
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
        s = min(s + stride * max(path.even * (2.0 - left), -windows.clear * here.x), path.size);
        stride = 1.0;
        let at = segment_distance(path.segment, s);
        let next = window_at(stack, linear, windows, dir.xz * at, path_altitude(path, at));
        let added = mean_density(here.x, next.x) * windows.extinction * (at - t);
        depth += added;
        let ahead = depth + next.y;
        let dim = exp(-vec2<f32>(1.0, kept) * ahead);
        let change = vec2<f32>(1.0, kept) * (ahead - reach);
        let mean = select((lit - dim) / change, 0.33333334 * (0.5 * (lit + dim) + 2.0 * sqrt(lit * dim)), abs(change) < vec2<f32>(0.5));
        once += added * mean;
        let through = exp(-kept * depth);
        let half_way = 0.5 * (at + t);
        sent += (left - through) * window_cells_at(cells, mean_cells, linear, windows, dir.xz * half_way, path_altitude(path, half_way), nu);
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
