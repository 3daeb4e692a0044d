//! Height maps: the surface through the texels of a map and of its pyramid, filtered by the footprint, with fractal detail.
//!
//! Level l of the texture holds the means over squares of about 2^l texels, and the mean square of the slopes of the whole map over them. Between texels runs Catmull and Rom's cubic, which
//! has one slope everywhere. A level counts fully up to a footprint of 1.4 of its texels, and is gone at 2.8, where the next has taken its place.
//!
//! source   CatmullRom1974; Williams1983 (pyramids); slopes left out: ours
//! symbols  relief height [m] and mean square of the slopes, by level · offset place from the eye, (x, z) [m] · footprint width of what one sample stands for [m]
#define_import_path veduta::terrain::relief

#import veduta::noise::lattice::{Lattice2d}
#import veduta::terrain::field::{Field, Ground, ground_at, field_place, FIELD_MAP}

const EDGE_REPEAT: i32 = 0;
const EDGE_MIRROR: i32 = 1;
const EDGE_CLAMP: i32 = 2;

/// The texels of rows of `count` that stand for texels beyond their ends.
///
/// internal
fn border_texels(i: vec4<i32>, count: i32, edge: i32) -> vec4<i32> {
    let period = select(count, 2 * count, edge == EDGE_MIRROR);
    let r = ((i % period) + period) % period;
    let turned = min(r, 2 * count - 1 - r);
    return select(select(r, turned, edge == EDGE_MIRROR), clamp(i, vec4<i32>(0), vec4<i32>(count - 1)), edge == EDGE_CLAMP);
}

/// Catmull and Rom's cubic through four values, and its slope.
///
/// internal
fn cubic(p: vec4<f32>, t: f32) -> vec2<f32> {
    let first = p.z - p.x;
    let second = 2.0 * p.x - 5.0 * p.y + 4.0 * p.z - p.w;
    let third = 3.0 * (p.y - p.z) + p.w - p.x;
    return vec2<f32>(p.y + 0.5 * t * (first + t * (second + t * third)), 0.5 * (first + t * (2.0 * second + 3.0 * t * third)));
}

/// A place on one axis of a level: the texel below as a float of a whole number would lose its last places, so it stands apart.
struct Along {
    /// The texel below.
    texel: i32,
    /// The rest, in [0, 1].
    t: f32,
    /// Texels of the level a metre.
    inverse: f32,
}

/// Where a place on the lattice of the texels lies among `count` texels of a level that stand for `whole`.
///
/// internal
fn level_place(cell: i32, frac: f32, count: i32, whole: i32, edge: i32, texel: f32) -> Along {
    let r = cell % (2 * whole);
    let turned = select(r, r + 2 * whole, r < 0);
    let near = select(turned, clamp(cell, -4 * whole, 5 * whole), edge == EDGE_CLAMP);
    let parts = near * count;
    let rest = parts % whole;
    let down = rest < 0;
    let below = select(rest, rest + whole, down);
    let x = (f32(below) + (frac + 0.5) * f32(count)) / f32(whole) - 0.5;
    let lower = floor(x);
    return Along(select(parts / whole, parts / whole - 1, down) + i32(lower), x - lower, f32(count) / (f32(whole) * texel));
}

/// Heights and mean squares of the slopes of four texels of a row.
///
/// internal
fn row_texels(relief: texture_2d<f32>, columns: vec4<i32>, row: i32, level: i32) -> mat2x4<f32> {
    let a = textureLoad(relief, vec2<i32>(columns.x, row), level).xy;
    let b = textureLoad(relief, vec2<i32>(columns.y, row), level).xy;
    let c = textureLoad(relief, vec2<i32>(columns.z, row), level).xy;
    let d = textureLoad(relief, vec2<i32>(columns.w, row), level).xy;
    return mat2x4<f32>(vec4<f32>(a.x, b.x, c.x, d.x), vec4<f32>(a.y, b.y, c.y, d.y));
}

/// Height, slopes along x and z, and mean square of the slopes, on one level.
///
/// internal
fn level_ground(relief: texture_2d<f32>, place: Lattice2d, texel: f32, edge: i32, level: i32) -> vec4<f32> {
    let whole = vec2<i32>(textureDimensions(relief, 0));
    let count = vec2<i32>(textureDimensions(relief, level));
    let x = level_place(place.cell.x, place.frac.x, count.x, whole.x, edge, texel);
    let z = level_place(place.cell.y, place.frac.y, count.y, whole.y, edge, texel);
    let around = vec4<i32>(-1, 0, 1, 2);
    let columns = border_texels(x.texel + around, count.x, edge);
    let rows = border_texels(z.texel + around, count.y, edge);
    let a = row_texels(relief, columns, rows.x, level);
    let b = row_texels(relief, columns, rows.y, level);
    let c = row_texels(relief, columns, rows.z, level);
    let d = row_texels(relief, columns, rows.w, level);
    let p = cubic(a[0], x.t);
    let q = cubic(b[0], x.t);
    let r = cubic(c[0], x.t);
    let s = cubic(d[0], x.t);
    let height = cubic(vec4<f32>(p.x, q.x, r.x, s.x), z.t);
    let along_x = cubic(vec4<f32>(p.y, q.y, r.y, s.y), z.t).x;
    let low = b[1].y + x.t * (b[1].z - b[1].y);
    let high = c[1].y + x.t * (c[1].z - c[1].y);
    return vec4<f32>(height.x, x.inverse * along_x, z.inverse * height.y, low + z.t * (high - low));
}

/// The map at a place on the lattice of its texels, filtered by a footprint.
///
/// internal
fn relief_ground(relief: texture_2d<f32>, place: Lattice2d, texel: f32, edge: i32, footprint: f32) -> Ground {
    let ratio = max(0.70710678 * footprint / texel, 1.0);
    let bits = bitcast<u32>(ratio);
    let whole = i32(bits >> 23u) - 127;
    let last = i32(textureNumLevels(relief)) - 1;
    let x = 2.0 / bitcast<f32>((bits & 0x7fffffu) | 0x3f800000u) - 1.0;
    let keep = select(x * x * (3.0 - 2.0 * x), 1.0, whole >= last);
    let level = min(whole, last);
    let fine = level_ground(relief, place, texel, edge, level);
    let coarse = level_ground(relief, place, texel, edge, min(level + 1, last));
    let mixed = keep * fine + (1.0 - keep) * coarse;
    let left = select(1.0, 1.0 - keep, level == 0);
    return Ground(mixed.x, mixed.yz, left * max(mixed.w - dot(mixed.yz, mixed.yz), 0.0));
}

/// The bare field at a place, filtered by the footprint, below the sea too: with the map where it has one. `kind` is one of the constants `FIELD_..` of `veduta::terrain::field`; given as an override it costs nothing, and
/// `relief` is read by `FIELD_MAP` only.
///
/// domain  kind in [0, 7] 1 lin
/// domain  offset in [-1e5, 1e5] m lin
/// domain  footprint in [1e-3, 1e5] m log
/// range   [-1e5, 1e5] 1
/// error   3e-2 abs of reference::relief::ground
/// outside undefined
/// source  CatmullRom1974; Williams1983; slopes left out: ours
fn bare_land_at(relief: texture_2d<f32>, field: Field, kind: i32, offset: vec2<f32>, footprint: f32) -> Ground {
    let detail = ground_at(field, kind, offset, footprint);
    if kind != FIELD_MAP {
        return detail;
    }
    let place = field_place(field, offset);
    let map = relief_ground(relief, place, field.wavelength, i32(field.shape), footprint);
    return Ground(map.height + detail.height, map.slope + detail.slope, map.lost + detail.lost);
}

/// The land at a place, filtered by the footprint: the field, or the level sea above it.
///
/// domain  kind in [0, 7] 1 lin
/// domain  offset in [-1e5, 1e5] m lin
/// domain  footprint in [1e-3, 1e5] m log
/// range   [-1e5, 1e5] 1
/// error   3e-2 abs of reference::relief::ground
/// outside undefined
/// source  CatmullRom1974; Williams1983; slopes left out: ours
fn land_at(relief: texture_2d<f32>, field: Field, kind: i32, offset: vec2<f32>, footprint: f32) -> Ground {
    let bare = bare_land_at(relief, field, kind, offset, footprint);
    let dry = !(bare.height < field.sea);
    return Ground(select(field.sea, bare.height, dry), select(vec2<f32>(0.0), bare.slope, dry), select(0.0, bare.lost, dry));
}
