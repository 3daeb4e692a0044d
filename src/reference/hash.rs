//! Integer hashes: the twins of `veduta::hash::pcg` and `veduta::hash::lattice`. Integers are exact on both sides.

/// PCG hash of one word (RXS-M-XS permutation of one generator step). Leitner 2022, listing 5.1.
pub fn pcg(x: u32) -> u32 {
    let state = x.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// One generator step of every word, before the rounds.
fn generate<const N: usize>(v: [u32; N]) -> [u32; N] {
    v.map(|word| word.wrapping_mul(747_796_405).wrapping_add(1_013_904_223))
}

/// What one word contributes to another in a round: xor-shift, then multiply.
fn stir(word: u32) -> u32 {
    (word ^ (word >> 16)).wrapping_mul(747_796_405)
}

/// The last steps of a first word: an odd multiplier between two xor-shifts.
fn finish(word: u32, factor: u32) -> u32 {
    let shifted = word ^ (word >> 15);
    let product = shifted.wrapping_mul(factor | 1);
    product ^ (product >> 15)
}

/// The key spread over the word.
fn spread(key: u32) -> u32 {
    key.wrapping_mul(2_654_435_761)
}

/// Mixing hash of two words with a key; a bijection of the vector for every key.
pub fn pcg_2d_keyed(v: [u32; 2], key: u32) -> [u32; 2] {
    let [x0, y0] = generate(v);
    let row = stir(y0) ^ spread(key);
    let x1 = finish(x0.wrapping_add(row), row);
    let y1 = y0.wrapping_add(stir(x1));
    [x1, y1]
}

/// Mixing hash of two words; a bijection of the vector.
pub fn pcg_2d(v: [u32; 2]) -> [u32; 2] {
    pcg_2d_keyed(v, 0)
}

/// Mixing hash of three words with a key; a bijection of the vector for every key.
pub fn pcg_3d_keyed(v: [u32; 3], key: u32) -> [u32; 3] {
    let [x0, y0, z0] = generate(v);
    let y1 = y0.wrapping_add(stir(z0));
    let row = stir(y1).wrapping_add(z0) ^ spread(key);
    let x1 = finish(x0.wrapping_add(row), y1);
    let z1 = z0.wrapping_add(stir(x1 ^ y1));
    let y2 = y1.wrapping_add(stir(z1));
    [x1, y2, z1]
}

/// Mixing hash of three words; a bijection of the vector.
pub fn pcg_3d(v: [u32; 3]) -> [u32; 3] {
    pcg_3d_keyed(v, 0)
}

/// Mixing hash of four words; a bijection of the vector.
pub fn pcg_4d(v: [u32; 4]) -> [u32; 4] {
    let [x0, y0, z0, w0] = generate(v);
    let z1 = z0.wrapping_add(stir(w0));
    let y1 = y0.wrapping_add(stir(z1));
    let x1 = x0.wrapping_add(stir(y1));
    let w1 = w0.wrapping_add(stir(x1));
    let z2 = z1.wrapping_add(stir(w1 ^ y1));
    let y2 = y1.wrapping_add(stir(z2));
    let x2 = x1.wrapping_add(stir(y2));
    let w2 = w1.wrapping_add(stir(x2));
    [x2, y2, z2, w2]
}

/// The word's top 24 bits as a number in [0, 1).
pub fn unit_float(word: u32) -> f64 {
    f64::from(word >> 8) / f64::from(1_u32 << 24)
}

/// The word's top 24 bits, read as a signed number, in [-1, 1).
pub fn signed_float(word: u32) -> f64 {
    f64::from(word.cast_signed() >> 8) / f64::from(1_u32 << 23)
}

fn words<const N: usize>(cell: [i32; N]) -> [u32; N] {
    cell.map(i32::cast_unsigned)
}

/// Two random words of a lattice point.
pub fn lattice_hash_2d(cell: [i32; 2], seed: u32) -> [u32; 2] {
    pcg_2d_keyed(words(cell), seed)
}

/// Three random words of a lattice point.
pub fn lattice_hash_3d(cell: [i32; 3], seed: u32) -> [u32; 3] {
    pcg_3d_keyed(words(cell), seed)
}

/// One random word of a lattice point, of which the 23 lowest bits count.
pub fn lattice_word_3d(cell: [i32; 3], seed: u32) -> u32 {
    let fold = |word: u32| word ^ (word >> 16);
    let mixed = |axis: usize, multiplier: u32, start: u32| {
        let word = cell[axis].cast_unsigned();
        fold(word.wrapping_mul(multiplier).wrapping_add(start))
    };
    let start = 1_013_904_223;
    let x = mixed(0, 747_796_405, start).wrapping_mul(747_796_405);
    let y = mixed(1, 2_654_435_769, start);
    let z = mixed(2, 2_246_822_519, spread(seed).wrapping_add(start));
    let row = y.wrapping_add(z);
    (x ^ row).wrapping_mul(row | 1)
}

const PRIMES: [u32; 3] = [149, 233, 367];

/// The source's XOR scheme in 2D, eq. 5.3, on integers.
pub fn hash_xor_2d(cell: [i32; 2]) -> u32 {
    let keys = words(cell).into_iter().zip(PRIMES);
    pcg(keys.fold(0, |key, (word, prime)| key ^ word.wrapping_mul(prime)))
}

/// The source's XOR scheme in 3D, eq. 5.3, on integers.
pub fn hash_xor_3d(cell: [i32; 3]) -> u32 {
    let keys = words(cell).into_iter().zip(PRIMES);
    pcg(keys.fold(0, |key, (word, prime)| key ^ word.wrapping_mul(prime)))
}

/// The source's linear scheme in 2D, eq. 5.1, on integers.
pub fn hash_linear_2d(cell: [i32; 2]) -> u32 {
    let keys = words(cell).into_iter().zip(PRIMES);
    pcg(keys.fold(0_u32, |key, (word, prime)| {
        key.wrapping_add(word.wrapping_mul(prime))
    }))
}

/// The source's linear scheme in 3D, eq. 5.1, on integers.
pub fn hash_linear_3d(cell: [i32; 3]) -> u32 {
    let keys = words(cell).into_iter().zip(PRIMES);
    pcg(keys.fold(0_u32, |key, (word, prime)| {
        key.wrapping_add(word.wrapping_mul(prime))
    }))
}

/// The source's nested scheme in 2D, eq. 5.2, on integers.
pub fn hash_nested_2d(cell: [i32; 2]) -> u32 {
    words(cell)
        .into_iter()
        .rev()
        .fold(0, |inner, word| pcg(word.wrapping_add(inner)))
}

/// The source's nested scheme in 3D, eq. 5.2, on integers.
pub fn hash_nested_3d(cell: [i32; 3]) -> u32 {
    words(cell)
        .into_iter()
        .rev()
        .fold(0, |inner, word| pcg(word.wrapping_add(inner)))
}

/// The source's listing 5.2 as printed, with shift and mirror; for lattice points.
pub fn hash_source_2d(position: [f64; 2]) -> u32 {
    let [x, y] = position.map(|p| (p + 3_250_000.0).abs().floor() as u32);
    pcg(149_u32.wrapping_mul(x) ^ 233_u32.wrapping_mul(y))
}
