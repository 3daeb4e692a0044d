//! Real spherical harmonics up to the third degree, in which light of many orders is kept.
//! source   Sloan2008 Stupid spherical harmonics tricks, appendix A2
//! symbols  dir unit vector [1]
#define_import_path veduta::clouds::harmonics

/// The sixteen harmonics of a direction, orthonormal over the sphere.
struct Harmonics {
    /// Degree 0, and degree 1 along y, z and x.
    zeroth: vec4<f32>,
    /// Degree 2: xy, yz, 3 z^2 - 1, xz.
    second: vec4<f32>,
    /// Degree 2: x^2 - y^2; degree 3: y (3 x^2 - y^2), xyz, y (5 z^2 - 1).
    middle: vec4<f32>,
    /// Degree 3: z (5 z^2 - 3), x (5 z^2 - 1), z (x^2 - y^2), x (x^2 - 3 y^2).
    third: vec4<f32>,
}

/// The harmonics of a direction.
///
/// domain  dir in [-1, 1] 1 lin
/// range   [-20, 20] 1
/// error   2.8e-6 abs of reference::clouds::harmonics
/// outside undefined
/// source  Sloan2008 appendix A2, without the signs of Condon and Shortley
fn harmonics(dir: vec3<f32>) -> Harmonics {
    let x = dir.x;
    let y = dir.y;
    let z = dir.z;
    let xx = x * x;
    let yy = y * y;
    let zz = z * z;
    return Harmonics(
        vec4<f32>(0.28209479, 0.48860251 * y, 0.48860251 * z, 0.48860251 * x),
        vec4<f32>(1.09254843 * x * y, 1.09254843 * y * z, 0.31539157 * (3.0 * zz - 1.0), 1.09254843 * x * z),
        vec4<f32>(0.54627422 * (xx - yy), 0.59004359 * y * (3.0 * xx - yy), 2.89061144 * x * y * z, 0.45704580 * y * (5.0 * zz - 1.0)),
        vec4<f32>(0.37317633 * z * (5.0 * zz - 3.0), 0.45704580 * x * (5.0 * zz - 1.0), 1.44530572 * z * (xx - yy), 0.59004359 * x * (xx - 3.0 * yy)),
    );
}
