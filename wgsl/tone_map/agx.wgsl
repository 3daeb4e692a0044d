//! AgX, the base look: colours are drawn together, encoded by their logarithm, bent by a sigmoid, and spread again.
//!
//! Range: 10 stops below and 6.5 above middle grey, 0.18. The sigmoid has slope 2 at middle grey, which becomes the code
//! 0.5, and reaches 0 and 1 at the ends of the range: with s = 2 (x - 20/33), x in [0, 1] the encoded colour,
//!
//! y = 1/2 + s / (1 + a |s|^p)^(1/p), p = 3 below and 13/4 above middle grey.
//!
//! Where s is e at the end of the range, y is 1/2 away from middle grey if 1 + a e^p = (2 e)^p, so a = 2^p - e^-p, with
//! e = 40/33 below and 26/33 above.
//!
//! The code is that of a display with exponent 2.2; the result is its light. Spreading by the inverse of the first matrix
//! is what its users have made of the original, which leaves the colours drawn together.
//!
//! source   Sobotka2022 AgX configuration (matrix, range, slope, powers); Wrensch2023 Minimal AgX (spreading); coefficients ours
//! symbols  color linear radiance [1] · exposure sensitivity of the camera, lower is darker [1]
#define_import_path veduta::tone_map::agx

const LEAST_LOG: f32 = -12.473931188;
const STOPS: f32 = 16.5;
const MIDDLE: f32 = 0.60606060606;
const TOE: f32 = 7.4384843750;
const SHOULDER: f32 = 7.3434211180;

/// The sigmoid, from exactly 0 to 1.
///
/// domain  x in [0, 1] 1 lin
/// range   [0, 1] 1
/// error   4e-7 abs of reference::tone_map::agx_sigmoid
/// monotone x
/// source  Sobotka2022; coefficients ours
fn agx_sigmoid(x: f32) -> f32 {
    let s = 2.0 * (x - MIDDLE);
    let size = abs(s);
    let cube = size * size * size;
    let above = s > 0.0;
    let bend = 1.0 + select(TOE * cube, SHOULDER * cube * sqrt(sqrt(size)), above);
    let root = exp2(log2(bend) * select(-0.33333333333, -0.30769230769, above));
    // Rounding must not lift black.
    return select(clamp(0.5 + s * root, 0.0, 1.0), 0.0, x <= 0.0);
}

/// y^2.2 for y in [0, 1], exactly 0 at 0.
///
/// internal
fn display_light(y: f32) -> f32 {
    return y * y * exp2(0.2 * log2(max(y, 1e-30)));
}

/// Display light after AgX, in [0, 1]; negative radiance counts as 0.
///
/// domain  color in [1e-6, 1e6] 1 log
/// domain  exposure in [1e-3, 1e3] 1 log
/// range   [0, 1] 1
/// error   2e-6 abs of reference::tone_map::agx
/// source  Sobotka2022; Wrensch2023
fn agx(color: vec3<f32>, exposure: f32) -> vec3<f32> {
    let x = clamp(color * exposure, vec3<f32>(0.0), vec3<f32>(1e30));
    let drawn = vec3<f32>(
        dot(vec3<f32>(0.842479062253094, 0.0784335999999992, 0.0792237451477643), x),
        dot(vec3<f32>(0.0423282422610123, 0.878468636469772, 0.0791661274605434), x),
        dot(vec3<f32>(0.0423756549057051, 0.0784336, 0.879142973793104), x),
    );
    // The floor lies below the range.
    let stops = log2(max(drawn, vec3<f32>(1e-5))) - LEAST_LOG;
    let code = clamp(stops * (1.0 / STOPS), vec3<f32>(0.0), vec3<f32>(1.0));
    let y = vec3<f32>(agx_sigmoid(code.x), agx_sigmoid(code.y), agx_sigmoid(code.z));
    let spread = clamp(vec3<f32>(
        dot(vec3<f32>(1.196879005120, -0.098020881140, -0.099029744080), y),
        dot(vec3<f32>(-0.052896851757, 1.151903129904, -0.098961176845), y),
        dot(vec3<f32>(-0.052971635514, -0.098043450117, 1.151073672641), y),
    ), vec3<f32>(0.0), vec3<f32>(1.0));
    return vec3<f32>(display_light(spread.x), display_light(spread.y), display_light(spread.z));
}
