//! Hashes of integer lattice points: the default, and the source's three schemes.
//!
//! A point is a vector of `i32`, its bits are hashed as they are: no shift of the origin, no absolute value, and so no
//! mirror and no loss far out; after 2^32 points the lattice wraps. Only `hash_source_2d` keeps the source's shift.
//!
//! The source's schemes share out too few keys (distinct ones in a 2048 x 2048 block: linear 18 %, XOR 12 %, and 28 % with
//! the source's shift); they are here for parity and for comparisons. `lattice_hash_2d` and `lattice_hash_3d` give what
//! independent random words would give, 99.805 % of 4096 x 4096 distinct in every word, and are bijections for every seed.
//!
//! `lattice_word_3d` is what the noises in 3D are made of: one word instead of three, for fewer operations.
//!
//! source   Leitner2022 3.3 to 3.5, eq. 5.1 to 5.3, listing 5.2
//! symbols  cell lattice point [cell] · seed selects one of 2^32 hashes [1]
#define_import_path veduta::hash::lattice

#import veduta::hash::pcg::{pcg, pcg_2d_keyed, pcg_2d_corners_keyed, pcg_3d_keyed}

const PRIME_X: u32 = 149u;
const PRIME_Y: u32 = 233u;
// The source gives no third prime; this one continues the ratio of the first two.
const PRIME_Z: u32 = 367u;
// Odd multipliers of the axes of `lattice_word_3d`, and of its seed.
const SPREAD_3D: vec3<u32> = vec3<u32>(747796405u, 2654435769u, 2246822519u);
const WORD_SEED: u32 = 2654435761u;
const WORD_START: u32 = 1013904223u;
const SOURCE_SHIFT: f32 = 3250000.0;

/// Two random words of a lattice point; for every seed a bijection of the point.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [0, 4294967295] 1
/// error   0 abs of reference::hash::lattice_hash_2d
/// source  JarzynskiOlano2020 pcg2d; departs: see veduta::hash::pcg
fn lattice_hash_2d(cell: vec2<i32>, seed: u32) -> vec2<u32> {
    return pcg_2d_keyed(bitcast<vec2<u32>>(cell), seed);
}

/// The first words of `lattice_hash_2d` at the corners of a cell, which need not be neighbours; in the order of (x, y):
/// both low, x high, y high, both high. What corners share is done once, and the rest side by side.
///
/// internal
fn lattice_words_2d(low: vec2<i32>, high: vec2<i32>, seed: u32) -> vec4<u32> {
    return pcg_2d_corners_keyed(bitcast<vec2<u32>>(low), bitcast<vec2<u32>>(high), seed);
}

/// Three random words of a lattice point; for every seed a bijection of the point.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [0, 4294967295] 1
/// error   0 abs of reference::hash::lattice_hash_3d
/// source  JarzynskiOlano2020 pcg3d; departs: see veduta::hash::pcg
fn lattice_hash_3d(cell: vec3<i32>, seed: u32) -> vec3<u32> {
    return pcg_3d_keyed(bitcast<vec3<u32>>(cell), seed);
}

/// The coordinates of a lattice point, spread over all bits: what its neighbours' differ by is a constant, so that a whole
/// cell takes three multiplications.
///
/// internal
fn spread_3d(cell: vec3<i32>, seed: u32) -> vec3<u32> {
    return bitcast<vec3<u32>>(cell) * SPREAD_3D + spread_zero_3d(seed);
}

/// The spread coordinates of the lattice point 0. The increments keep it from being a fixed point, and the mirror of a
/// product's bits far from the origin.
///
/// internal
fn spread_zero_3d(seed: u32) -> vec3<u32> {
    return vec3<u32>(WORD_START, WORD_START, seed * WORD_SEED + WORD_START);
}

/// The keys of spread coordinates, which all points share that have the coordinate: the upper half is folded into the lower
/// one, a bijection, and x is multiplied once more.
///
/// internal
fn lattice_keys_3d(spread: vec3<u32>) -> vec3<u32> {
    let folded = spread ^ (spread >> vec3<u32>(16u));
    return vec3<u32>(folded.x * SPREAD_3D.x, folded.y, folded.z);
}

/// The keys of a cell's four rows along x, in the order of (y, z): both low, y high, z high, both high.
///
/// internal
fn rows_of_keys_3d(low: vec3<u32>, high: vec3<u32>) -> vec4<u32> {
    return vec4<u32>(low.y, high.y, low.y, high.y) + vec4<u32>(low.z, low.z, high.z, high.z);
}

/// The words of four points with the same x on four rows.
///
/// internal
fn words_of_rows_3d(x: u32, rows: vec4<u32>) -> vec4<u32> {
    return (vec4<u32>(x) ^ rows) * (rows | vec4<u32>(1u));
}

/// One random word of a lattice point, cheaply: its 23 lowest bits make good numbers, of which the upper ones are the best.
/// The bits above are correlated over far distances.
///
/// Every coordinate is mixed once, shared by all points that have it; a point itself costs one more multiplication, by an
/// odd number that y and z make. For fixed y and z it is a bijection of x. It is neither a bijection of the point nor as
/// thorough as `lattice_hash_3d`: bit k depends on bits 0 to k of the mixed coordinates only, so that of two lines along x
/// one pair in 2^23 has the same numbers.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [0, 4294967295] 1
/// error   0 abs of reference::hash::lattice_word_3d
/// source  ours
fn lattice_word_3d(cell: vec3<i32>, seed: u32) -> u32 {
    let keys = lattice_keys_3d(spread_3d(cell, seed));
    let row = keys.y + keys.z;
    return (keys.x ^ row) * (row | 1u);
}

/// The source's chosen scheme in 2D: one PCG hash of the XOR of prime multiples.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// range   [0, 4294967295] 1
/// error   0 abs of reference::hash::hash_xor_2d
/// source  Leitner2022 eq. 5.3; departs: integer points, no shift, no mirror
fn hash_xor_2d(cell: vec2<i32>) -> u32 {
    let p = bitcast<vec2<u32>>(cell);
    return pcg((p.x * PRIME_X) ^ (p.y * PRIME_Y));
}

/// The source's chosen scheme in 3D.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// range   [0, 4294967295] 1
/// error   0 abs of reference::hash::hash_xor_3d
/// source  Leitner2022 eq. 5.3; departs: integer points, no shift, no mirror; the third prime is ours
fn hash_xor_3d(cell: vec3<i32>) -> u32 {
    let p = bitcast<vec3<u32>>(cell);
    return pcg((p.x * PRIME_X) ^ (p.y * PRIME_Y) ^ (p.z * PRIME_Z));
}

/// The source's first scheme in 2D: one PCG hash of a sum of prime multiples; repeats visibly.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// range   [0, 4294967295] 1
/// error   0 abs of reference::hash::hash_linear_2d
/// source  Leitner2022 eq. 5.1; departs: integer points
fn hash_linear_2d(cell: vec2<i32>) -> u32 {
    let p = bitcast<vec2<u32>>(cell);
    return pcg(p.x * PRIME_X + p.y * PRIME_Y);
}

/// The source's first scheme in 3D.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// range   [0, 4294967295] 1
/// error   0 abs of reference::hash::hash_linear_3d
/// source  Leitner2022 eq. 5.1; departs: integer points; the third prime is ours
fn hash_linear_3d(cell: vec3<i32>) -> u32 {
    let p = bitcast<vec3<u32>>(cell);
    return pcg(p.x * PRIME_X + p.y * PRIME_Y + p.z * PRIME_Z);
}

/// The source's second scheme in 2D: one PCG hash a dimension, each in the next.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// range   [0, 4294967295] 1
/// error   0 abs of reference::hash::hash_nested_2d
/// source  Leitner2022 eq. 5.2; departs: integer points
fn hash_nested_2d(cell: vec2<i32>) -> u32 {
    let p = bitcast<vec2<u32>>(cell);
    return pcg(p.x + pcg(p.y));
}

/// The source's second scheme in 3D.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// range   [0, 4294967295] 1
/// error   0 abs of reference::hash::hash_nested_3d
/// source  Leitner2022 eq. 5.2; departs: integer points
fn hash_nested_3d(cell: vec3<i32>) -> u32 {
    let p = bitcast<vec3<u32>>(cell);
    return pcg(p.x + pcg(p.y + pcg(p.z)));
}

/// The source's listing as printed, with its shift and its mirror at -3 250 000; for parity.
///
/// Positions must be lattice points already: near the shift `f32` steps by 0.25, and beyond 16 777 216 points merge.
///
/// domain  position in [-3000000, 3000000] cell lin
/// range   [0, 4294967295] 1
/// error   0 abs of reference::hash::hash_source_2d
/// source  Leitner2022 listing 5.2
fn hash_source_2d(position: vec2<f32>) -> u32 {
    let p = vec2<u32>(floor(abs(position + SOURCE_SHIFT)));
    return pcg((PRIME_X * p.x) ^ (PRIME_Y * p.y));
}
