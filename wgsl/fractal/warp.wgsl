//! Domain warping: a fractal read at a place that other fractals have moved, and the gradient by the chain rule.
//!
//! With w the vector of the moving fractals and s its strength, the value at p is f(p + s w(p)), and the gradient is
//! g + s (g.x grad w.x + g.y grad w.y + ...) with g that of f at the moved place. The moving fractals have seeds of their
//! own and are shifted by parts of a cell, so that the lattice points of all do not meet.
//!
//! source   Quilez2002 Domain warping; the gradient is ours
//! symbols  strength how far a warp of 1 moves [cell] · octaves number of octaves [1] · hurst Hurst exponent [1]
#define_import_path veduta::fractal::warp

#import veduta::noise::lattice::{split_2d, split_3d}
#import veduta::fractal::fbm::{fbm_2d, fbm_3d, fbm_2d_slope, fbm_3d_slope}

// What the seeds of the moving fractals differ by from that of the moved one.
const SEED_X: u32 = 374761393u;
const SEED_Y: u32 = 668265263u;
const SEED_Z: u32 = 1274126177u;
// Where they are read, odd multiples of 1/64 of a cell away.
const AWAY_X: vec3<f32> = vec3<f32>(0.296875, 0.640625, 0.453125);
const AWAY_Y: vec3<f32> = vec3<f32>(0.734375, 0.359375, 0.578125);
const AWAY_Z: vec3<f32> = vec3<f32>(0.421875, 0.265625, 0.703125);

/// Value and gradient in 2D of what is read at a moved place: `outer` is (value, d/dx, d/dy) there, `warp_x` and `warp_y`
/// are those of the two components of the warp at the place itself.
///
/// domain  outer in [-64, 64] 1 lin
/// domain  warp_x in [-64, 64] 1 lin
/// domain  warp_y in [-64, 64] 1 lin
/// domain  strength in [0, 4] cell lin
/// range   [-32832, 32832] 1
/// error   0.006 abs of reference::fractal::warp::warped_slope_2d
/// outside undefined
/// source  ours (chain rule)
fn warped_slope_2d(outer: vec3<f32>, warp_x: vec3<f32>, warp_y: vec3<f32>, strength: f32) -> vec3<f32> {
    return vec3<f32>(outer.x, outer.yz + strength * (outer.y * warp_x.yz + outer.z * warp_y.yz));
}

/// Value and gradient in 3D of what is read at a moved place, as in 2D.
///
/// domain  outer in [-64, 64] 1 lin
/// domain  warp_x in [-64, 64] 1 lin
/// domain  warp_y in [-64, 64] 1 lin
/// domain  warp_z in [-64, 64] 1 lin
/// domain  strength in [0, 4] cell lin
/// range   [-49216, 49216] 1
/// error   0.01 abs of reference::fractal::warp::warped_slope_3d
/// outside undefined
/// source  ours (chain rule)
fn warped_slope_3d(
    outer: vec4<f32>,
    warp_x: vec4<f32>,
    warp_y: vec4<f32>,
    warp_z: vec4<f32>,
    strength: f32,
) -> vec4<f32> {
    let turned = outer.y * warp_x.yzw + outer.z * warp_y.yzw + outer.w * warp_z.yzw;
    return vec4<f32>(outer.x, outer.yzw + strength * turned);
}

/// fBm of gradient noise in 2D, warped by two others of as many octaves.
///
/// A warped place is rounded by parts of the strength, and the error is that times the slope: it grows with the octaves.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  octaves in [1, 8] 1 lin
/// domain  hurst in [0.5, 2] 1 lin
/// domain  strength in [0, 2] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-3.21, 3.21] 1
/// error   6e-4 abs of reference::fractal::warp::warped_fbm_2d
/// outside undefined
/// source  Quilez2002
fn warped_fbm_2d(
    cell: vec2<i32>,
    frac: vec2<f32>,
    octaves: i32,
    hurst: f32,
    strength: f32,
    seed: u32,
) -> f32 {
    let p = split_2d(cell, frac);
    let warp = vec2<f32>(
        fbm_2d(p.cell, p.frac + AWAY_X.xy, octaves, hurst, seed + SEED_X),
        fbm_2d(p.cell, p.frac + AWAY_Y.xy, octaves, hurst, seed + SEED_Y),
    );
    return fbm_2d(p.cell, p.frac + strength * warp, octaves, hurst, seed);
}

/// Warped fBm in 2D and its gradient: (value, d/dx, d/dy), per cell of octave 0.
///
/// The gradient's error is relative to its largest size, the product of the slopes of warped and warping fractal.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  octaves in [1, 8] 1 lin
/// domain  hurst in [0.5, 2] 1 lin
/// domain  strength in [0, 2] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-200000, 200000] 1
/// error   15 abs of reference::fractal::warp::warped_fbm_2d_slope
/// outside undefined
/// source  Quilez2002; the gradient is ours
fn warped_fbm_2d_slope(
    cell: vec2<i32>,
    frac: vec2<f32>,
    octaves: i32,
    hurst: f32,
    strength: f32,
    seed: u32,
) -> vec3<f32> {
    let p = split_2d(cell, frac);
    let x = fbm_2d_slope(p.cell, p.frac + AWAY_X.xy, octaves, hurst, seed + SEED_X);
    let y = fbm_2d_slope(p.cell, p.frac + AWAY_Y.xy, octaves, hurst, seed + SEED_Y);
    let moved = p.frac + strength * vec2<f32>(x.x, y.x);
    return warped_slope_2d(fbm_2d_slope(p.cell, moved, octaves, hurst, seed), x, y, strength);
}

/// fBm of gradient noise in 3D, warped by three others of as many octaves.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  octaves in [1, 8] 1 lin
/// domain  hurst in [0.5, 2] 1 lin
/// domain  strength in [0, 2] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-3.21, 3.21] 1
/// error   6e-4 abs of reference::fractal::warp::warped_fbm_3d
/// outside undefined
/// source  Quilez2002
fn warped_fbm_3d(
    cell: vec3<i32>,
    frac: vec3<f32>,
    octaves: i32,
    hurst: f32,
    strength: f32,
    seed: u32,
) -> f32 {
    let p = split_3d(cell, frac);
    let warp = vec3<f32>(
        fbm_3d(p.cell, p.frac + AWAY_X, octaves, hurst, seed + SEED_X),
        fbm_3d(p.cell, p.frac + AWAY_Y, octaves, hurst, seed + SEED_Y),
        fbm_3d(p.cell, p.frac + AWAY_Z, octaves, hurst, seed + SEED_Z),
    );
    return fbm_3d(p.cell, p.frac + strength * warp, octaves, hurst, seed);
}

/// Warped fBm in 3D and its gradient: (value, d/dx, d/dy, d/dz), per cell of octave 0.
///
/// The gradient's error is relative to its largest size, the product of the slopes of warped and warping fractal.
///
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  octaves in [1, 8] 1 lin
/// domain  hurst in [0.5, 2] 1 lin
/// domain  strength in [0, 2] cell lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [-550000, 550000] 1
/// error   20 abs of reference::fractal::warp::warped_fbm_3d_slope
/// outside undefined
/// source  Quilez2002; the gradient is ours
fn warped_fbm_3d_slope(
    cell: vec3<i32>,
    frac: vec3<f32>,
    octaves: i32,
    hurst: f32,
    strength: f32,
    seed: u32,
) -> vec4<f32> {
    let p = split_3d(cell, frac);
    let x = fbm_3d_slope(p.cell, p.frac + AWAY_X, octaves, hurst, seed + SEED_X);
    let y = fbm_3d_slope(p.cell, p.frac + AWAY_Y, octaves, hurst, seed + SEED_Y);
    let z = fbm_3d_slope(p.cell, p.frac + AWAY_Z, octaves, hurst, seed + SEED_Z);
    let moved = p.frac + strength * vec3<f32>(x.x, y.x, z.x);
    return warped_slope_3d(fbm_3d_slope(p.cell, moved, octaves, hurst, seed), x, y, z, strength);
}
