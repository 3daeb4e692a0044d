Bakes a rectangle of a window on a cloud layer, in its texels' places on the torus: every column follows a ray to the sun, so that depths are sums along it. One invocation two
columns, which share words; with CLOUD_WIDE one.

#PROGRAM{ cloud_window }#

#COMPUTE{
    #CODE{
#ifdef CLOUD_WIDE
#import veduta::math::half::{half_word}
#else
#import veduta::clouds::code::{tile_code}
#endif
#ifdef CLOUD_SHAPED
#import veduta::clouds::field::{CloudLayer}
#import veduta::clouds::shape::{CloudShape, shaped_density}
#else
#import veduta::clouds::field::{CloudLayer, uncut_density}
#endif
#import veduta::clouds::integral::{mean_density}

struct WindowPart {
    // Horizontal way of the sun's ray per metre of height.
    shear: vec2<f32>,
    // Where the corner of the window lies on the torus of the noise, 2^32 a turn.
    turn: vec2<u32>,
    // Which texel holds the corner.
    corner: vec2<i32>,
    // The first texel of the rectangle, and its texels along x and z.
    first: vec2<i32>,
    size: vec2<i32>,
    // Turns of a texel.
    texel_turn: u32,
    // Texels of the window's edge.
    texels: i32,
    // Way along the sun's ray per metre of height.
    slant: f32,
    levels: i32,
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

@group(0) @binding(0) var<uniform> part: WindowPart;
@group(2) @binding(0) var<storage, read_write> texels: array<u32>;

#ifdef CLOUD_WIDE
const TEXELS: i32 = 1;
#else
// To a word.
const TEXELS: i32 = 2;
#endif

// The layer with the foot of a column of texels for its origin.
fn layer_at(texel: vec2<i32>) -> CloudLayer {
    // How far from the corner, on the torus.
    let off = texel - part.corner;
    let cell = vec2<u32>(select(off, off + part.texels, off < vec2<i32>(0)));
    let turn = part.turn + cell * part.texel_turn + (part.texel_turn >> 1u);
    return CloudLayer(vec3<u32>(turn.x, 0u, turn.y), part.turns_per_metre, part.period_doublings, 0.5, part.bottom, part.thickness, part.coverage, part.uniformity,
        part.extinction, 1.0, 0.0, 0.0, 0.0, part.seed);
}

// Density before its cut above the foot of a column.
fn density_over(layer: CloudLayer, up: f32) -> f32 {
    let at = part.shear * (up - 0.5 * part.thickness);
    // Not beyond the spheres by rounding.
    let altitude = clamp(part.bottom + up, part.bottom, part.bottom + part.thickness);
#ifdef CLOUD_SHAPED
    let shape = CloudShape(part.kind, part.kind_spread, part.coverage_spread, part.detail, part.sharpness, part.weather_doublings);
    let found = shaped_density(layer, shape, vec3<f32>(at.x, 0.0, at.y), altitude);
#else
    let found = uncut_density(layer, vec3<f32>(at.x, 0.0, at.y), altitude);
#endif
    return clamp(found, -1000.0, 1.0);
}

@compute @workgroup_size(64)
fn bake(@builtin(global_invocation_id) id: vec3<u32>) {
    let across = part.size.x / TEXELS;
    let column = i32(id.x);
    if column >= across * part.size.y {
        return;
    }
    let i = column % across;
    let row = column / across;
    let place = part.first + vec2<i32>(TEXELS * i, row);
    let one = layer_at(place);
#ifndef CLOUD_WIDE
    let other = layer_at(place + vec2<i32>(1, 0));
#endif
    let height = part.thickness / f32(part.levels - 1);
    let scale = part.extinction * height * part.slant;
    // Rows of copies begin at multiples of 256 bytes.
    let words = (part.size.x + 64 * TEXELS - 1) / (64 * TEXELS) * 64;
    var above = vec2<f32>(0.0);
    var depth = vec2<f32>(0.0);
    for (var j = part.levels - 1; j >= 0; j--) {
        let up = f32(j) * height;
        let gain = select(scale, 0.0, j == part.levels - 1);
        let left = density_over(one, up);
        depth.x += gain * mean_density(above.x, left);
        above.x = left;
#ifdef CLOUD_WIDE
        let word = half_word(vec2<f32>(left, min(depth.x, 6e4)));
#else
        let right = density_over(other, up);
        depth.y += gain * mean_density(above.y, right);
        above.y = right;
        let word = pack4x8snorm(vec4<f32>(tile_code(left, depth.x, part.least), tile_code(right, depth.y, part.least)));
#endif
        texels[(j * part.size.y + row) * words + i] = word;
    }
}
    }#
}#
