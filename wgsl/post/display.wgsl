//! What a system writes for a radiance, by the kind of target that the host draws into.
//! source   Leitner2022 ch. 6 (tone map); IEC 61966-2-1 (sRGB); Bayer1973
//! symbols  output kind of target: 0 takes encoded colour, 1 linear colour that it encodes itself, 2 radiance · pixel integer coordinates
#define_import_path veduta::post::display

#import veduta::tone_map::exponential::{exponential}
#import veduta::post::srgb::{encode_srgb, decode_srgb}
#import veduta::post::dither::{dither}

/// The value of a pixel that nothing shines through: radiance as it is, or exposed, encoded and dithered for 8 bits.
///
/// domain  output in [0, 2] 1 lin
/// domain  radiance in [0, 100] 1 lin
/// domain  exposure in [1e-3, 10] 1 log
/// domain  pixel in [0, 16384] 1 lin
/// range   [-0.5, 1e9] 1
/// error   2e-6 abs of reference::post::displayed
/// source  Leitner2022 ch. 6; Bayer1973
fn displayed(output: i32, radiance: vec3<f32>, exposure: f32, pixel: vec2<u32>) -> vec4<f32> {
    if output == 2 {
        return vec4<f32>(radiance, 1.0);
    }
    let signal = dither(encode_srgb(exponential(radiance, exposure)), pixel, 255.0);
    if output == 1 {
        return vec4<f32>(decode_srgb(signal), 1.0);
    }
    return vec4<f32>(signal, 1.0);
}
