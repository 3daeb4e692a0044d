//! The terrain's height function: ridged multifractal mountains, and the one place where a program may plug in its own.
//! source   Leitner2022 alg. 3 and ch. 4.2
//! symbols  offset horizontal offset from the eye, (x, z) [m] · octaves number of octaves [1]
#define_import_path veduta::terrain::height

#import veduta::fractal::ridged::{ridged_multifractal_2d}

/// Scale and character of the terrain; the eye's place on it is a lattice cell and a fraction, so that precision does
/// not depend on how far the eye has travelled.
struct Terrain {
    /// Lattice cell of the eye's foot point, in units of the base wavelength.
    cell: vec2<i32>,
    /// Fraction within that cell, in [0, 1).
    frac: vec2<f32>,
    /// Wavelength of the first octave [m], > 0.
    wavelength: f32,
    /// Height of a fractal value of 1 [m].
    amplitude: f32,
    /// Hurst exponent: octave i has the amplitude 2^(-i hurst).
    hurst: f32,
    /// Weight of an octave by the one before it.
    gain: f32,
    /// Rounding of the crests; 0 keeps them sharp.
    smoothness: f32,
    /// Seed of the lattice.
    seed: u32,
}

// The attribute must stand between the comment and `virtual`: naga_oil 0.23 joins the line before that word with the
// function, and a function joined to a comment is lost.

/// Height of the ground above the planet's sphere; override it to plug in another terrain.
///
/// domain  offset in [-1e5, 1e5] m lin
/// domain  octaves in [1, 16] 1 lin
/// range   [-1e5, 1e5] m
/// error   1.5e-2 abs of reference::terrain::height
/// outside undefined
/// source  Leitner2022 alg. 3
@must_use
virtual fn height(terrain: Terrain, offset: vec2<f32>, octaves: i32) -> f32 {
    return terrain.amplitude * ridged_multifractal_2d(terrain.cell, terrain.frac + offset / terrain.wavelength, octaves,
        terrain.hurst, terrain.gain, terrain.smoothness, terrain.seed);
}
