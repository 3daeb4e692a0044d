//! Integer hashes of the PCG family: of one word, and mixing bijections of two, three and four words.
//!
//! The vector hashes follow the idea of Jarzynski and Olano's pcg2d, pcg3d and pcg4d: one step of a linear congruential
//! generator a word, then rounds in which words take up one another. They depart from the printed forms, because these
//! fail as lattice hashes. In pcg2d the rounds before the shift are linear: over a 4096 x 4096 block the first word of
//! cells 16 apart is correlated (64 standard deviations). In pcg3d (pcg4d is built alike) the low bits are periodic with
//! short periods, and in the slices where a factor is 0 just 99.756 % of a word's values are distinct instead of 99.805 %.
//! Here what a word takes up is xor-shifted and multiplied first, so that high bits reach the low ones in every round. Every step is
//! invertible: it adds to one word a function of the others, shifts-and-xors it, or multiplies it by an odd number made
//! of the others; so each hash is a bijection of its vector.
//!
//! They are laid out for lattices: what depends on the later words alone comes first, so that neighbours along `x` share
//! it, then the first word gets one more multiplication and is done; the rounds after that serve the other words.
//!
//! source   JarzynskiOlano2020 Hash Functions for GPU Rendering, JCGT 9(3)
//! source   Leitner2022 listing 5.1
//! symbols  v words [1] · key word that selects one of 2^32 hashes [1]
#define_import_path veduta::hash::pcg

// Multiplier of the 32-bit PCG generators and increment of the printed vector hashes.
const MULTIPLIER: u32 = 747796405u;
const INCREMENT: u32 = 1013904223u;
// Spreads keys that differ little: 2^32 / golden ratio, made odd.
const KEY_SPREAD: u32 = 2654435761u;

/// What one word contributes to another in a round.
///
/// internal
fn stir(word: u32) -> u32 {
    return (word ^ (word >> 16u)) * MULTIPLIER;
}

/// The last steps of a first word: multiplied by an odd number between two xor-shifts.
///
/// internal
fn finish(word: u32, factor: u32) -> u32 {
    let product = (word ^ (word >> 15u)) * (factor | 1u);
    return product ^ (product >> 15u);
}

/// PCG hash of one word, the RXS-M-XS permutation of one generator step: a bijection.
///
/// domain  x in [0, 4294967295] 1 lin
/// range   [0, 4294967295] 1
/// error   0 abs of reference::hash::pcg
/// source  Leitner2022 listing 5.1
fn pcg(x: u32) -> u32 {
    let state = x * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

/// Mixing hash of two words with a key: for every key another bijection of the vector.
///
/// domain  v in [0, 4294967295] 1 lin
/// domain  key in [0, 4294967295] 1 lin
/// range   [0, 4294967295] 1
/// error   0 abs of reference::hash::pcg_2d_keyed
/// source  JarzynskiOlano2020 pcg2d; departs: see the module
fn pcg_2d_keyed(v: vec2<u32>, key: u32) -> vec2<u32> {
    var w = v * MULTIPLIER + INCREMENT;
    let row = stir(w.y) ^ (key * KEY_SPREAD);
    w.x = finish(w.x + row, row);
    w.y += stir(w.x);
    return w;
}

/// The first words of `pcg_2d_keyed` of (low, low), (high, low), (low, high) and (high, high).
///
/// internal
fn pcg_2d_corners_keyed(low: vec2<u32>, high: vec2<u32>, key: u32) -> vec4<u32> {
    let w = vec4<u32>(low, high) * MULTIPLIER + INCREMENT;
    let y = w.yw;
    let row = (((y ^ (y >> vec2<u32>(16u))) * MULTIPLIER) ^ vec2<u32>(key * KEY_SPREAD)).xxyy;
    let sum = w.xzxz + row;
    let product = (sum ^ (sum >> vec4<u32>(15u))) * (row | vec4<u32>(1u));
    return product ^ (product >> vec4<u32>(15u));
}

/// Mixing hash of two words: a bijection of the vector.
///
/// domain  v in [0, 4294967295] 1 lin
/// range   [0, 4294967295] 1
/// error   0 abs of reference::hash::pcg_2d
/// source  JarzynskiOlano2020 pcg2d; departs: see the module
fn pcg_2d(v: vec2<u32>) -> vec2<u32> {
    return pcg_2d_keyed(v, 0u);
}

/// Mixing hash of three words with a key: for every key another bijection of the vector.
///
/// domain  v in [0, 4294967295] 1 lin
/// domain  key in [0, 4294967295] 1 lin
/// range   [0, 4294967295] 1
/// error   0 abs of reference::hash::pcg_3d_keyed
/// source  JarzynskiOlano2020 pcg3d; departs: see the module
fn pcg_3d_keyed(v: vec3<u32>, key: u32) -> vec3<u32> {
    var w = v * MULTIPLIER + INCREMENT;
    w.y += stir(w.z);
    w.x = finish(w.x + ((stir(w.y) + w.z) ^ (key * KEY_SPREAD)), w.y);
    w.z += stir(w.x ^ w.y);
    w.y += stir(w.z);
    return w;
}

/// Mixing hash of three words: a bijection of the vector.
///
/// domain  v in [0, 4294967295] 1 lin
/// range   [0, 4294967295] 1
/// error   0 abs of reference::hash::pcg_3d
/// source  JarzynskiOlano2020 pcg3d; departs: see the module
fn pcg_3d(v: vec3<u32>) -> vec3<u32> {
    return pcg_3d_keyed(v, 0u);
}

/// Mixing hash of four words: a bijection of the vector.
///
/// domain  v in [0, 4294967295] 1 lin
/// range   [0, 4294967295] 1
/// error   0 abs of reference::hash::pcg_4d
/// source  JarzynskiOlano2020 pcg4d; departs: see the module
fn pcg_4d(v: vec4<u32>) -> vec4<u32> {
    var w = v * MULTIPLIER + INCREMENT;
    w.z += stir(w.w);
    w.y += stir(w.z);
    w.x += stir(w.y);
    w.w += stir(w.x);
    w.z += stir(w.w ^ w.y);
    w.y += stir(w.z);
    w.x += stir(w.y);
    w.w += stir(w.x);
    return w;
}

/// The word as a number in [0, 1): its top 24 bits, exact, never 1.
///
/// domain  word in [0, 4294967295] 1 lin
/// range   [0, 1] 1
/// error   0 abs of reference::hash::unit_float
/// monotone word
/// source  Leitner2022 3.2; departs: no division by 2^32 - 1, which in f32 can give 1
fn unit_float(word: u32) -> f32 {
    return f32(bitcast<i32>(word >> 8u)) * 5.9604644775390625e-8;
}

/// The word as a number in [-1, 1): its top 24 bits read as a signed number, exact.
///
/// domain  word in [0, 4294967295] 1 lin
/// range   [-1, 1] 1
/// error   0 abs of reference::hash::signed_float
/// source  Leitner2022 3.2; departs: the sign bit is the word's own
fn signed_float(word: u32) -> f32 {
    return f32(bitcast<i32>(word) >> 8u) * 1.1920928955078125e-7;
}
