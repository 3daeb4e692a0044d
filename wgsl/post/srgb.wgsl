//! The sRGB transfer function, exactly as standardised: linear toe and power 2.4.
//! source   IEC 61966-2-1
//! symbols  linear light [1] · encoded signal [1]
#define_import_path veduta::post::srgb

/// Signal of a linear light, per channel; negative light counts as 0.
///
/// domain  linear in [0, 1] 1 lin
/// range   [0, 1] 1
/// error   5e-7 abs of reference::post::encode_srgb
/// monotone linear
/// source  IEC 61966-2-1
fn encode_srgb(linear: vec3<f32>) -> vec3<f32> {
    let light = max(linear, vec3<f32>(0.0));
    let power = 1.055 * pow(max(light, vec3<f32>(0.0031308)), vec3<f32>(0.41666667)) - 0.055;
    return select(power, light * 12.92, light <= vec3<f32>(0.0031308));
}

/// Linear light of a signal, per channel; a negative signal counts as 0.
///
/// domain  encoded in [0, 1] 1 lin
/// range   [0, 1] 1
/// error   1e-6 abs of reference::post::decode_srgb
/// monotone encoded
/// outside undefined
/// source  IEC 61966-2-1
fn decode_srgb(encoded: vec3<f32>) -> vec3<f32> {
    let signal = max(encoded, vec3<f32>(0.0));
    let power = pow((max(signal, vec3<f32>(0.04045)) + 0.055) / 1.055, vec3<f32>(2.4));
    return select(power, signal / 12.92, signal <= vec3<f32>(0.04045));
}
