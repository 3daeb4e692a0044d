Bakes rows of the tile of a cloud layer: every column follows a ray to the sun, so that depths are sums along it. One invocation two columns, which share
words. With CLOUD_COARSE, a coarser level of detail of the rows that have been baked; one invocation two texels.

#PROGRAM{ cloud_tile }#

#COMPUTE{
    #CODE{
#ifdef CLOUD_WIDE
#import veduta::math::half::{half_word, half_pair}
#endif
#ifdef CLOUD_COARSE
#import veduta::clouds::code::{tile_code, tile_value}
#else
#import veduta::clouds::code::{tile_code}
#ifdef CLOUD_SHAPED
#import veduta::clouds::field::{CloudLayer}
#import veduta::clouds::shape::{CloudShape, shaped_density}
#else
#import veduta::clouds::field::{CloudLayer, uncut_density}
#endif
#import veduta::clouds::integral::{mean_density}
#endif

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
}

@group(0) @binding(0) var<uniform> tile: TileRows;
@group(2) @binding(0) var<storage, read_write> texels: array<u32>;

#ifdef CLOUD_WIDE
const TEXELS: i32 = 1;

fn word_of(codes: vec4<f32>) -> u32 {
    return half_word(codes.xy);
}

fn codes_of(word: u32) -> vec4<f32> {
    return vec4<f32>(half_pair(word), 0.0, 0.0);
}

fn code_of(density: f32, depth: f32) -> vec2<f32> {
    return vec2<f32>(density, min(depth, 6e4));
}
#else
// To a word.
const TEXELS: i32 = 2;

fn word_of(codes: vec4<f32>) -> u32 {
    return pack4x8unorm(codes);
}

fn codes_of(word: u32) -> vec4<f32> {
    return unpack4x8unorm(word);
}

fn code_of(density: f32, depth: f32) -> vec2<f32> {
    return tile_code(density, depth, tile.least);
}
#endif

// Words in a row of a level of detail: rows of copies begin at multiples of 256 bytes.
fn row_words(detail: u32) -> i32 {
    return ((tile.texels >> detail) + 64 * TEXELS - 1) / (64 * TEXELS) * 64;
}

// Word of a place: column of words, level of height, row.
fn word_at(detail: u32, at: vec3<i32>) -> i32 {
    var start = 0;
    for (var m = 0u; m < detail; m++) {
        start += row_words(m) * (tile.rows >> m) * (tile.levels >> m);
    }
    return start + (at.y * (tile.rows >> detail) + at.z) * row_words(detail) + at.x;
}

#ifdef CLOUD_COARSE
override CLOUD_DETAIL: i32 = 1;

// Of eight texels the mean density after its cut, or before it where there is no cloud; and the mean depth.
@compute @workgroup_size(64)
fn reduce(@builtin(global_invocation_id) id: vec3<u32>) {
    let detail = u32(CLOUD_DETAIL);
    let size = vec3<i32>((tile.texels >> detail) / TEXELS, tile.levels >> detail, tile.rows >> detail);
    let index = i32(id.x);
    if index >= size.x * size.y * size.z {
        return;
    }
    let at = vec3<i32>(index % size.x, index / size.x % size.y, index / (size.x * size.y));
    var codes = vec4<f32>(0.0);
    for (var side = 0; side < TEXELS; side++) {
        var sum = vec3<f32>(0.0);
        for (var k = 0; k < 8; k++) {
            // Of each pair of texels the left and the right one.
            let place = 2 * (TEXELS * at.x + side) + (k & 1);
            let pair = codes_of(texels[word_at(detail - 1u, vec3<i32>(place / TEXELS, 2 * at.yz + vec2<i32>((k >> 1u) & 1, k >> 2u)))]);
            let texel = tile_value(select(pair.xy, pair.zw, place % TEXELS == 1), tile.least);
            sum += vec3<f32>(max(texel.x, 0.0), texel);
        }
        let code = code_of(0.125 * select(sum.y, sum.x, sum.x > 0.0), 0.125 * sum.z);
        codes = select(vec4<f32>(codes.xy, code), vec4<f32>(code, 0.0, 0.0), side == 0);
    }
    texels[word_at(detail, at)] = word_of(codes);
}
#else
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
    var above = vec2<f32>(0.0);
    var depth = vec2<f32>(0.0);
    for (var j = tile.levels - 1; j >= 0; j--) {
        let up = f32(j) * height;
        // Not beyond the spheres by rounding.
        let altitude = clamp(tile.bottom + up, tile.bottom, tile.bottom + tile.thickness);
        var codes = vec4<f32>(0.0);
        for (var side = 0; side < TEXELS; side++) {
            let foot = (vec2<f32>(f32(TEXELS * i + side), f32(tile.first_row + row)) + 0.5) / f32(tile.texels) * tile.edge;
            let at = foot + tile.shear * up;
#ifdef CLOUD_SHAPED
            let shape = CloudShape(tile.kind, tile.kind_spread, tile.coverage_spread, tile.detail, tile.sharpness, tile.weather_doublings);
            let found = shaped_density(layer, shape, vec3<f32>(at.x, 0.0, at.y), altitude);
#else
            let found = uncut_density(layer, vec3<f32>(at.x, 0.0, at.y), altitude);
#endif
            let density = clamp(found, -1000.0, 1.0);
            let before = select(above.x, above.y, side == 1);
            let sum = select(depth.x, depth.y, side == 1) + select(scale * mean_density(before, density), 0.0, j == tile.levels - 1);
            let code = code_of(density, sum);
            if side == 0 {
                above.x = density;
                depth.x = sum;
                codes = vec4<f32>(code, 0.0, 0.0);
            } else {
                above.y = density;
                depth.y = sum;
                codes = vec4<f32>(codes.xy, code);
            }
        }
        texels[word_at(0u, vec3<i32>(i, j, row))] = word_of(codes);
    }
}
#endif
    }#
}#
