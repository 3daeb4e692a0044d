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
#ifdef CLOUD_LOW_SUN
// Two for each level: the texels that its rays have gone from their column and row, within the tile, and the way to the level above [m]; the parts that the way is taken in, and
// the depth of one at full density.
@group(1) @binding(1) var<storage, read> ways: array<vec4<f32>>;
#endif
@group(2) @binding(0) var<storage, read_write> texels: array<u32>;

#ifdef CLOUD_WIDE
const TEXELS: i32 = 1;
#else
// To a word.
const TEXELS: i32 = 2;
#endif

fn layer_of() -> CloudLayer {
    return CloudLayer(vec3<u32>(0u), tile.turns_per_metre, tile.period_doublings, 0.5, tile.bottom, tile.thickness, tile.coverage, tile.uniformity,
        tile.extinction, 1.0, 0.0, 0.0, 0.0, tile.seed);
}

// Density before its cut at a place on the tile, so high above its lowest level.
fn density_over(layer: CloudLayer, at: vec2<f32>, up: f32) -> f32 {
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
    let layer = layer_of();
    let i = column % across;
    let row = column / across;
    let height = tile.thickness / f32(tile.levels - 1);
    let texel = tile.edge / f32(tile.texels);
    let scale = tile.extinction * height * tile.slant;
    // Rows of copies begin at multiples of 256 bytes.
    let words = (tile.texels + 64 * TEXELS - 1) / (64 * TEXELS) * 64;
#ifndef CLOUD_LOW_SUN
    let foot = (vec2<f32>(f32(TEXELS * i), f32(tile.first_row + row)) + 0.5) * texel;
#endif
    var above = vec2<f32>(0.0);
    var depth = vec2<f32>(0.0);
#ifdef CLOUD_LOW_SUN
    // From level to level along a ray, in parts; columns of the tile stand upright, and the ray is now in one, now in another.
    for (var j = tile.levels - 1; j >= 0; j--) {
        let way = ways[2 * j];
        let parts = ways[2 * j + 1];
        let column = (TEXELS * i + i32(way.x)) % tile.texels;
        let foot = (vec2<f32>(f32(column), f32((tile.first_row + row + i32(way.y)) % tile.texels)) + 0.5) * texel;
        var left = 0.0;
        var right = 0.0;
        for (var k = i32(parts.x) - 1; k >= 0; k--) {
            let share = f32(k) / parts.x;
            let up = (f32(j) + share) * height;
            left = density_over(layer, foot + share * way.zw, up);
            depth.x += parts.y * mean_density(above.x, left);
            above.x = left;
#ifndef CLOUD_WIDE
            right = density_over(layer, foot + share * way.zw + vec2<f32>(texel, 0.0), up);
            depth.y += parts.y * mean_density(above.y, right);
            above.y = right;
#endif
        }
#ifdef CLOUD_WIDE
        let word = half_word(vec2<f32>(left, min(depth.x, 6e4)));
#else
        let word = pack4x8snorm(vec4<f32>(tile_code(left, depth.x, tile.least), tile_code(right, depth.y, tile.least)));
#endif
        texels[(j * tile.rows + row) * words + column / TEXELS] = word;
    }
#else
    for (var j = tile.levels - 1; j >= 0; j--) {
        let up = f32(j) * height;
        let gain = select(scale, 0.0, j == tile.levels - 1);
        let place = foot + tile.shear * up;
        let left = density_over(layer, place, up);
        depth.x += gain * mean_density(above.x, left);
        above.x = left;
#ifdef CLOUD_WIDE
        let word = half_word(vec2<f32>(left, min(depth.x, 6e4)));
#else
        let right = density_over(layer, place + vec2<f32>(texel, 0.0), up);
        depth.y += gain * mean_density(above.y, right);
        above.y = right;
        let word = pack4x8snorm(vec4<f32>(tile_code(left, depth.x, tile.least), tile_code(right, depth.y, tile.least)));
#endif
        texels[(j * tile.rows + row) * words + i] = word;
    }
#endif
}
    }#
}#
