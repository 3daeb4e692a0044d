//! The grid of the living ground: four cells of a row in one vector, tiles of 32 cells square, neighbours over the edges.
//! source   ours
//! symbols  group four cells side by side
#define_import_path veduta::ground::grid

/// What one step needs to know; the same for every program of the ground.
struct GroundStep {
    /// Cells along x and z.
    columns: i32,
    rows: i32,
    /// Vectors a row.
    groups: i32,
    /// Tiles along x, and all of them.
    tiles_x: i32,
    tiles: i32,
    /// Beyond the edge: 0 water falls off, 1 there is a wall, 2 there is the other edge.
    boundary: i32,
    /// 0 the scheme of the source, 1 shallow water.
    scheme: i32,
    /// Whether every tile runs although nothing moves.
    awake: i32,
    /// Step; 0: from the data [s].
    step: f32,
    damping: f32,
    momentum: f32,
    /// Metres a second.
    rain: f32,
    evaporation: f32,
    seepage: f32,
    mean_weight: f32,
    gravity: f32,
    spacing: f32,
    courant: f32,
    friction: f32,
    most_step: f32,
    strength: f32,
    deepest: f32,
    dig: f32,
    lay: f32,
    /// Height difference of neighbours from which ground slides [m].
    steepest: f32,
    slide: f32,
    /// Share by which hard ground resists, wavelength of hard spots [cells] and thickness of layers [m].
    hardness: f32,
    hard_wavelength: f32,
    layer: f32,
    reference: f32,
    sources: i32,
    /// Nothing, which no compiler may know.
    none: u32,
}

/// Where a thread works: its group and rows.
struct Strip {
    group: i32,
    first: i32,
    end: i32,
    /// Where its first row is in a plane, and from there the next row, in vectors.
    at: i32,
    pitch: i32,
    /// Columns beside its own, over the edge if it wraps.
    left_column: i32,
    right_column: i32,
    /// Where they are in the first row, and from there in the next row, in floats.
    left: i32,
    left_pitch: i32,
    right: i32,
    right_pitch: i32,
}

/// Vectors a plane. A plane holds tile after tile, each with its rows one after the other: rows that are read one after the other follow each other there. A tile has 32 rows of 8 vectors; the
/// last of a row and of a column are as narrow as the grid.
///
/// internal
fn plane_of(now: GroundStep) -> i32 {
    return now.groups * now.rows;
}

/// Vectors from a row to the next in the tile of a group.
///
/// internal
fn pitch_of(now: GroundStep, group: i32) -> i32 {
    return min(8, now.groups - (group & -8));
}

/// Where a group of four columns of a row is in a plane, in vectors.
///
/// internal
fn place_of(now: GroundStep, group: i32, z: i32) -> i32 {
    let above = z & -32;
    let before = group & -8;
    return above * now.groups + before * min(32, now.rows - above) + (z - above) * min(8, now.groups - before) + (group - before);
}

/// Where a cell is in a plane, in floats.
///
/// internal
fn cell_place(now: GroundStep, x: i32, z: i32) -> i32 {
    return 4 * place_of(now, x >> 2u, z) + (x & 3);
}

/// The strip of a lane of a tile.
///
/// internal
fn strip_of(now: GroundStep, tile: i32, lane: i32) -> Strip {
    let group = (tile % now.tiles_x) * 8 + lane;
    let first = (tile / now.tiles_x) * 32;
    let wraps = now.boundary == 2;
    let x = 4 * group;
    let left = select(x - 1, select(0, now.columns - 1, wraps), x == 0);
    let right = select(x + 4, select(now.columns - 1, 0, wraps), x + 4 >= now.columns);
    return Strip(group, first, min(first + 32, now.rows), place_of(now, group, first), pitch_of(now, group), left, right, cell_place(now, left, first),
        4 * pitch_of(now, left >> 2u), cell_place(now, right, first), 4 * pitch_of(now, right >> 2u));
}

/// A row, or what lies beyond the edge: the other edge, or the row itself.
///
/// internal
fn row_at(now: GroundStep, z: i32) -> i32 {
    let wraps = now.boundary == 2;
    if z < 0 {
        return select(0, now.rows - 1, wraps);
    }
    if z >= now.rows {
        return select(now.rows - 1, 0, wraps);
    }
    return z;
}

/// Where the row after a strip's row `z`, which is at `at`, is in a plane, in vectors; after the last, what lies beyond the edge.
///
/// internal
fn row_after(now: GroundStep, place: Strip, at: i32, z: i32) -> i32 {
    if z + 1 < place.end {
        return at + place.pitch;
    }
    return place_of(now, place.group, row_at(now, z + 1));
}

/// The columns of a group.
///
/// internal
fn columns_of(group: i32) -> vec4<i32> {
    return vec4<i32>(4 * group) + vec4<i32>(0, 1, 2, 3);
}

/// Values of the cells to the left.
///
/// internal
fn from_left(here: vec4<f32>, left: f32) -> vec4<f32> {
    return vec4<f32>(left, here.xyz);
}

/// Values of the cells to the right; `last` marks the last column.
///
/// internal
fn from_right(here: vec4<f32>, right: f32, last: vec4<bool>) -> vec4<f32> {
    return select(vec4<f32>(here.yzw, right), vec4<f32>(right), last);
}

/// Depths that fall in a second on four cells of a row, from up to four sources: centre x, z and radius in cells, and metres a second.
///
/// internal
fn sourced(sources: mat4x4<f32>, count: i32, columns: vec4<i32>, row: i32) -> vec4<f32> {
    var all = vec4<f32>(0.0);
    for (var k = 0; k < count; k++) {
        let source = sources[k];
        let x = vec4<f32>(columns) - source.x;
        let z = f32(row) - source.y;
        all += select(vec4<f32>(0.0), vec4<f32>(source.w), x * x + z * z <= vec4<f32>(source.z * source.z));
    }
    return all;
}

/// What weather does to water in a step.
struct Weather {
    /// Rained or sprung, evaporated, seeped [m].
    gained: vec4<f32>,
    evaporated: vec4<f32>,
    seeped: vec4<f32>,
}

/// Rain and sources, and evaporation and seepage of no more than there is.
///
/// internal
fn weather(now: GroundStep, spring: vec4<f32>, water: vec4<f32>, inside: vec4<f32>, step: f32) -> Weather {
    let gained = inside * ((vec4<f32>(now.rain) + spring) * step);
    let there = max(water, vec4<f32>(0.0));
    let evaporated = min(there, inside * (now.evaporation * step));
    let seeped = min(there - evaporated, inside * (now.seepage * step));
    return Weather(gained, evaporated, seeped);
}

/// The running mean of the water after a step; it arrives, also where the weight is so small that adding changes nothing any more.
///
/// internal
fn running_mean(mean: vec4<f32>, water: vec4<f32>, weight: f32) -> vec4<f32> {
    let next = mean + (water - mean) * weight;
    let stalled = bitcast<vec4<u32>>(next) == bitcast<vec4<u32>>(mean);
    return select(next, water, stalled | (abs(water - next) <= 1e-5 * water + vec4<f32>(1e-7)));
}
