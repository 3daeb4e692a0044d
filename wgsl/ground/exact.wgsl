//! Sums that lose nothing: a number and what rounding took from it, whose sum is the value. Four at once.
//! source   Knuth1969 TwoSum
//! symbols  lost what rounding took
#define_import_path veduta::ground::exact

/// Four values as sums of two floats each.
struct Pairs {
    /// The nearest floats.
    value: vec4<f32>,
    /// What they lack.
    lost: vec4<f32>,
}

/// The number itself, which no compiler can look through when `none` is 0 at run time.
///
/// internal
fn opaque(x: vec4<f32>, none: u32) -> vec4<f32> {
    return bitcast<vec4<f32>>(bitcast<vec4<u32>>(x) ^ vec4<u32>(none));
}

/// A pair of floats with a number added. `none` must be 0, and the compiler must not know it: compilers cancel `(a + b) - a`.
///
/// internal
fn add_exactly(value: vec4<f32>, lost: vec4<f32>, more: vec4<f32>, none: u32) -> Pairs {
    let all = lost + more;
    let sum = opaque(value + all, none);
    let part = opaque(sum - value, none);
    return Pairs(sum, (value - opaque(sum - part, none)) + (all - part));
}
