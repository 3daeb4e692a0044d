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

#import veduta::hash::pcg::{pcg, pcg_2d_keyed, pcg_3d_keyed}

const PRIME_X: u32 = 149u;
const PRIME_Y: u32 = 233u;
// The source gives no third prime; this one continues the ratio of the first two.
const PRIME_Z: u32 = 367u;
// Odd multipliers of the axes of `lattice_word_3d`, and of its seed.
const WORD_X: u32 = 747796405u;
const WORD_Y: u32 = 2654435769u;
const WORD_Z: u32 = 2246822519u;
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

/// A word whose upper half is folded into the lower one: a bijection.
///
/// internal
fn fold(word: u32) -> u32 {
    return word ^ (word >> 16u);
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
    let p = bitcast<vec3<u32>>(cell);
    // The increments keep 0 from being a fixed point, and the mirror of a product's bits far from the origin.
    let row = fold(p.y * WORD_Y + WORD_START) + fold(p.z * WORD_Z + (seed * WORD_SEED + WORD_START));
    return ((fold(p.x * WORD_X + WORD_START) * WORD_X) ^ row) * (row | 1u);
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
