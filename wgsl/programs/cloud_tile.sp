Bakes rows of the tile of a cloud layer: every column follows a ray to the sun, so that depths are sums along it. One invocation a column.

#PROGRAM{ cloud_tile }#

#COMPUTE{
    #CODE{
#ifdef CLOUD_SHAPED
#import veduta::clouds::field::{CloudLayer}
#import veduta::clouds::shape::{CloudShape, shaped_density}
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
}

@group(0) @binding(0) var<uniform> tile: TileRows;
@group(2) @binding(0) var<storage, read_write> texels: array<u32>;

// The bits of a number from -65,000 to 65,000 as a 16-bit float, rounded; what is within 6e-5 of 0 may become 0.
fn half(x: f32) -> u32 {
    return ((bitcast<u32>(abs(x) * 1.92592994e-34) + 0x1000u) >> 13u) | select(0u, 0x8000u, x < 0.0);
}

@compute @workgroup_size(64)
fn bake(@builtin(global_invocation_id) id: vec3<u32>) {
    let column = i32(id.x);
    if column >= tile.texels * tile.rows {
        return;
    }
    let layer = CloudLayer(vec3<u32>(0u), tile.turns_per_metre, tile.period_doublings, 0.5, tile.bottom, tile.thickness, tile.coverage, tile.uniformity,
        tile.extinction, 1.0, 0.0, 0.0, 0.0, tile.seed);
    let i = column % tile.texels;
    let k = tile.first_row + column / tile.texels;
    let foot = (vec2<f32>(f32(i), f32(k)) + 0.5) / f32(tile.texels) * tile.edge;
    let height = tile.thickness / f32(tile.levels - 1);
    let scale = tile.extinction * height * tile.slant;
    var above = 0.0;
    var depth = 0.0;
    for (var j = tile.levels - 1; j >= 0; j--) {
        let up = f32(j) * height;
        let at = foot + tile.shear * up;
        // Not beyond the spheres by rounding.
        let altitude = clamp(tile.bottom + up, tile.bottom, tile.bottom + tile.thickness);
#ifdef CLOUD_SHAPED
        let shape = CloudShape(tile.kind, tile.kind_spread, tile.coverage_spread, tile.detail, tile.sharpness, tile.weather_doublings);
        let found = shaped_density(layer, shape, vec3<f32>(at.x, 0.0, at.y), altitude);
#else
        let found = uncut_density(layer, vec3<f32>(at.x, 0.0, at.y), altitude);
#endif
        let density = clamp(found, -1000.0, 1.0);
        depth += select(scale * mean_density(above, density), 0.0, j == tile.levels - 1);
        above = density;
        texels[(j * tile.rows + column / tile.texels) * tile.texels + i] = half(density) | (half(min(depth, 6e4)) << 16u);
    }
}
    }#
}#
