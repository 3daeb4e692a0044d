//! stub
#define_import_path veduta::fractal::fbm

/// stub
/// internal
fn h3(c: vec3<i32>, seed: u32) -> f32 {
    let x = (bitcast<u32>(c.x) * 0x9E3779B1u) ^ (bitcast<u32>(c.y) * 0x85EBCA77u) ^ (bitcast<u32>(c.z) * 0xC2B2AE3Du) ^ (seed * 0x27D4EB2Fu);
    var w = x * 747796405u + 2891336453u; w = ((w >> ((w >> 28u) + 4u)) ^ w) * 277803737u; w = (w >> 22u) ^ w;
    return f32(w >> 8u) / 16777216.0;
}
/// stub
/// internal
fn vnoise2(cell: vec2<i32>, frac: vec2<f32>, seed: u32) -> f32 { return vnoise3(vec3<i32>(cell, 0), vec3<f32>(frac, 0.0), seed, 0); }
/// stub
/// internal
fn vnoise3(cell: vec3<i32>, frac: vec3<f32>, seed: u32, period: i32) -> f32 {
    let fl = floor(frac); var c = cell + vec3<i32>(fl); let f = frac - fl; var e = c + 1;
    if period > 0 { c = ((c % period) + period) % period; e = ((e % period) + period) % period; }
    let u = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let a = mix(h3(c, seed), h3(vec3<i32>(e.x, c.y, c.z), seed), u.x);
    let b = mix(h3(vec3<i32>(c.x, e.y, c.z), seed), h3(vec3<i32>(e.x, e.y, c.z), seed), u.x);
    let g = mix(h3(vec3<i32>(c.x, c.y, e.z), seed), h3(vec3<i32>(e.x, c.y, e.z), seed), u.x);
    let h = mix(h3(vec3<i32>(c.x, e.y, e.z), seed), h3(e, seed), u.x);
    return mix(mix(a, b, u.y), mix(g, h, u.y), u.z);
}
/// stub
/// internal
fn fbm_3d(cell: vec3<i32>, frac: vec3<f32>, octaves: i32, hurst: f32, seed: u32) -> f32 {
    var r = 0.0; var c = cell; var f = frac; var a = 1.0; let d = exp2(-hurst);
    for (var i = 0; i < octaves; i++) { r += a * (2.0 * vnoise3(c, f, seed + u32(i), 0) - 1.0); c = c * 2; f = f * 2.0; a *= d; }
    return r;
}
/// stub
/// internal
fn fbm_value_3d_periodic(cell: vec3<i32>, frac: vec3<f32>, period: vec3<i32>, octaves: i32, hurst: f32, seed: u32) -> f32 {
    var r = 0.0; var c = cell; var f = frac; var a = 1.0; let d = exp2(-hurst); var n = 0.0; var p = period.x;
    for (var i = 0; i < octaves; i++) { r += a * vnoise3(c, f, seed + u32(i), p); n += a; c = c * 2; f = f * 2.0; a *= d; p = p * 2; }
    return r / n;
}
