//! stub
#define_import_path veduta::fractal::ridged
#import veduta::fractal::fbm::{vnoise2}

/// stub
/// internal
fn ridged_multifractal_2d(cell: vec2<i32>, frac: vec2<f32>, octaves: i32, hurst: f32, gain: f32, smoothness: f32, seed: u32) -> f32 {
    var s = 1.0 - abs(2.0 * vnoise2(cell, frac, seed) - 1.0); s = s * s; var r = s; var c = cell; var f = frac; var a = 1.0;
    let d = exp2(-hurst);
    for (var i = 1; i < octaves; i++) {
        let w = clamp(s * gain, 0.0, 1.0); c = c * 2; f = f * 2.0; a *= d;
        s = 1.0 - abs(2.0 * vnoise2(c, f, seed + u32(i)) - 1.0); s = s * s * w; r += a * s;
    }
    return r;
}
