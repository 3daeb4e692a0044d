//! The surface of the water as it is shown, and normals of grids of heights.
//! source   weather digest 5 and 6
//! symbols  level ground plus water [m] · water depth [m] · least depth from which water is shown as it is [m] · sink depth of dry surface below the ground [m]
#define_import_path veduta::ground::surface

/// Level at which the water of a cell is shown, from that of its eight neighbours: as it is where it is deep; where it is shallow that of lower water beside it; dry surface lies `sink` below the ground.
/// The middle of a shallow puddle, with no lower neighbour, stays; where all nine are dry it does not.
///
/// domain  level in [-1e3, 1e3] m lin
/// domain  water in [0, 10] m lin
/// domain  side_levels in [-1e3, 1e3] m lin
/// domain  corner_levels in [-1e3, 1e3] m lin
/// domain  side_waters in [0, 10] m lin
/// domain  corner_waters in [0, 10] m lin
/// domain  least in [0.01, 1] m log
/// domain  sink in [0, 10] m lin
/// range   [-2e3, 2e3] m
/// error   2e-3 abs of reference::ground::displayed_level
/// outside undefined
/// source  weather digest 5; departs: flat ground that is dry all around lies below too, and does so smoothly within a tenth of `least`
fn displayed_level(level: f32, water: f32, side_levels: vec4<f32>, corner_levels: vec4<f32>, side_waters: vec4<f32>, corner_waters: vec4<f32>, least: f32, sink: f32) -> f32 {
    if water >= least {
        return level;
    }
    let share = water / least;
    let side_lower = side_levels < vec4<f32>(level);
    let corner_lower = corner_levels < vec4<f32>(level);
    let side_weights = select(vec4<f32>(0.0), side_waters, side_lower);
    let corner_weights = select(vec4<f32>(0.0), corner_waters, corner_lower);
    let all = dot(side_weights, vec4<f32>(1.0)) + dot(corner_weights, vec4<f32>(1.0));
    // Heights over this level, so that no digits are lost at great ones.
    let sum = dot(side_weights, side_levels - level) + dot(corner_weights, corner_levels - level);
    let beside = level + (1.0 - share) * sum / max(all, 1e-12);
    let deepest = max(side_waters, corner_waters);
    let wettest = max(max(max(deepest.x, deepest.y), max(deepest.z, deepest.w)), water);
    let dry = 1.0 - smoothstep(0.0, 0.1 * least, wettest);
    let falls = any(side_lower) || any(corner_lower);
    let below = level - select(dry, 1.0, falls) * sink * (1.0 - share);
    return select(below, beside, all > 1e-12);
}

/// Unit normal of a grid of heights by central differences, from the neighbours to -x, +x, -z and +z.
///
/// domain  left in [-1e3, 1e3] m lin
/// domain  right in [-1e3, 1e3] m lin
/// domain  low in [-1e3, 1e3] m lin
/// domain  high in [-1e3, 1e3] m lin
/// domain  spacing in [1e-2, 1e3] m log
/// range   [-1, 1] 1
/// error   1e-6 abs of reference::ground::fast_normal
/// outside undefined
/// source  weather digest 6, equation 2
fn fast_normal(left: f32, right: f32, low: f32, high: f32, spacing: f32) -> vec3<f32> {
    return normalize(vec3<f32>(left - right, 2.0 * spacing, low - high));
}

/// The level that a neighbour counts with in the normal of the water: the centre's where the water beside lies under its ground.
///
/// domain  centre in [-1e4, 1e4] m lin
/// domain  beside in [-1e4, 1e4] m lin
/// domain  ground_beside in [-1e4, 1e4] m lin
/// range   [-1e4, 1e4] m
/// error   0 abs of reference::ground::counted_level
/// source  weather digest 6
fn counted_level(centre: f32, beside: f32, ground_beside: f32) -> f32 {
    return select(beside, centre, beside < ground_beside);
}
