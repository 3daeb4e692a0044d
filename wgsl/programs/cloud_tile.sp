Bakes rows of the tile of a cloud layer: every column follows a ray to the sun, so that depths are sums along it. One invocation two columns, which share
words; with CLOUD_WIDE one.

#PROGRAM{ cloud_tile }#

#COMPUTE{
    #CODE{
#ifdef CLOUD_WIDE
#import veduta::math::half::{half_word}
#else
#import veduta::clouds::code::{tile_code}
#endif
#ifdef CLOUD_SHAPED
#import veduta::clouds::field::{CloudLayer}
#ifdef CLOUD_MAPPED
#import veduta::clouds::shape::{CloudShape, mapped_density}
#else
#import veduta::clouds::shape::{CloudShape, shaped_density}
#endif
#else
#import veduta::clouds::field::{CloudLayer, uncut_density}
#endif
#import veduta::clouds::integral::{mean_density}

struct TileRows {
    // Horizontal way of the sun's ray per metre of height.
    shear: vec2<f32>,
    // Edge of the tile [m].
    edge: f32,
    // Way along the sun's ray per metre of height.
    slant: f32,
    texels: i32,
    levels: i32,
    first_row: i32,
    rows: i32,
    turns_per_metre: f32,
    period_doublings: u32,
    bottom: f32,
    thickness: f32,
    coverage: f32,
    uniformity: f32,
    extinction: f32,
    seed: u32,
    // Of clouds with forms.
    kind: f32,
    kind_spread: f32,
    coverage_spread: f32,
    detail: f32,
    sharpness: f32,
    weather_doublings: u32,
    // The least density that is told.
    least: f32,
    // Times that a map for the weather lies along the edge.
    repeats: u32,
}

@group(0) @binding(0) var<uniform> tile: TileRows;
#ifdef CLOUD_MAPPED
@group(1) @binding(0) var weather: texture_2d<f32>;
#endif
@group(2) @binding(0) var<storage, read_write> texels: array<u32>;

#ifdef CLOUD_WIDE
const TEXELS: i32 = 1;
#else
// To a word.
const TEXELS: i32 = 2;
#endif

// Density before its cut above a column of the tile.
fn density_over(layer: CloudLayer, column: i32, row: i32, up: f32) -> f32 {
    let foot = (vec2<f32>(f32(column), f32(tile.first_row + row)) + 0.5) / f32(tile.texels) * tile.edge;
    let at = foot + tile.shear * up;
    // Not beyond the spheres by rounding.
    let altitude = clamp(tile.bottom + up, tile.bottom, tile.bottom + tile.thickness);
#ifdef CLOUD_SHAPED
    let shape = CloudShape(tile.kind, tile.kind_spread, tile.coverage_spread, tile.detail, tile.sharpness, tile.weather_doublings);
#ifdef CLOUD_MAPPED
    let found = mapped_density(weather, layer, shape, tile.repeats, vec3<f32>(at.x, 0.0, at.y), altitude);
#else
    let found = shaped_density(layer, shape, vec3<f32>(at.x, 0.0, at.y), altitude);
#endif
#else
    let found = uncut_density(layer, vec3<f32>(at.x, 0.0, at.y), altitude);
#endif
    return clamp(found, -1000.0, 1.0);
}

@compute @workgroup_size(64)
fn bake(@builtin(global_invocation_id) id: vec3<u32>) {
    let across = tile.texels / TEXELS;
    let column = i32(id.x);
    if column >= across * tile.rows {
        return;
    }
    let layer = CloudLayer(vec3<u32>(0u), tile.turns_per_metre, tile.period_doublings, 0.5, tile.bottom, tile.thickness, tile.coverage, tile.uniformity,
        tile.extinction, 1.0, 0.0, 0.0, 0.0, tile.seed);
    let i = column % across;
    let row = column / across;
    let height = tile.thickness / f32(tile.levels - 1);
    let scale = tile.extinction * height * tile.slant;
    // Rows of copies begin at multiples of 256 bytes.
    let words = (tile.texels + 64 * TEXELS - 1) / (64 * TEXELS) * 64;
    var above = vec2<f32>(0.0);
    var depth = vec2<f32>(0.0);
    for (var j = tile.levels - 1; j >= 0; j--) {
        let up = f32(j) * height;
        let gain = select(scale, 0.0, j == tile.levels - 1);
        let left = density_over(layer, TEXELS * i, row, up);
        depth.x += gain * mean_density(above.x, left);
        above.x = left;
#ifdef CLOUD_WIDE
        let word = half_word(vec2<f32>(left, min(depth.x, 6e4)));
#else
        let right = density_over(layer, 2 * i + 1, row, up);
        depth.y += gain * mean_density(above.y, right);
        above.y = right;
        let word = pack4x8snorm(vec4<f32>(tile_code(left, depth.x, tile.least), tile_code(right, depth.y, tile.least)));
#endif
        texels[(j * tile.rows + row) * words + i] = word;
    }
}
    }#
}#
