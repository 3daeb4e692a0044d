//! Khronos' PBR neutral tone map: base colours stay what they are, only highlights are compressed and lose colour.
//!
//! Of every channel first goes what a surface of refractive index 1.5 reflects beside its colour: 0.04, less in the dark.
//! Up to 0.76 nothing more is done; above, the largest channel is compressed towards 1.
//!
//! source   Khronos2024 PBR Neutral Tone Mapper
//! symbols  color linear radiance [1] · exposure sensitivity of the camera, lower is darker [1]
#define_import_path veduta::tone_map::neutral

/// Where compression starts, 0.8 - 0.04.
const START: f32 = 0.76;
const DESATURATION: f32 = 0.15;

/// Display light after the neutral tone map, in [0, 1]; negative radiance counts as 0.
///
/// domain  color in [1e-6, 1e6] 1 log
/// domain  exposure in [1e-3, 1e3] 1 log
/// range   [0, 1] 1
/// error   6e-7 abs of reference::tone_map::neutral
/// source  Khronos2024
fn neutral(color: vec3<f32>, exposure: f32) -> vec3<f32> {
    let x = clamp(color * exposure, vec3<f32>(0.0), vec3<f32>(1e30));
    let least = min(x.x, min(x.y, x.z));
    // x - (least - 6.25 least^2) in the dark, without cancellation in the least channel.
    let base = select(x - 0.04, (x - least) + 6.25 * least * least, least < 0.08);
    let peak = max(base.x, max(base.y, base.z));
    if (peak < START) {
        return base;
    }
    // What the peak loses, in full precision: without it colours at the start would turn grey by a rounding.
    let above = peak - START;
    let room = 1.0 - START;
    let loss = above * (above / (above + room));
    let compressed = 1.0 - room * room / (above + room);
    let white = DESATURATION * loss;
    return min((base * (compressed / peak) + compressed * white) / (1.0 + white), vec3<f32>(1.0));
}
