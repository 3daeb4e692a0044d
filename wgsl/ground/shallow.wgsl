//! Shallow water on a staggered grid: depths in cells, speeds on the faces between them. Every function takes four faces at once.
//! source   Stelling2003 (advection on a staggered grid: momentum where flow slows, head where it gains speed); depths over a sill: Audusse2004
//! symbols  depth of water [m] · rise ground of the far cell above that of the near one [m] · q discharge per width [m^2/s]
#define_import_path veduta::ground::shallow

/// How deep water stands over the higher ground of a face, from the near cell; from the far cell with the opposite rise.
///
/// domain  depth in [0, 1e4] m lin
/// domain  rise in [-1e4, 1e4] m lin
/// range   [0, 1e4] m
/// error   1e-3 abs of reference::ground::sill_depth
/// monotone depth
/// source  Audusse2004 hydrostatic reconstruction
fn sill_depth(depth: vec4<f32>, rise: vec4<f32>) -> vec4<f32> {
    return max(depth - max(rise, vec4<f32>(0.0)), vec4<f32>(0.0));
}

/// The discharge through a face: speed times the depth over the sill where the water comes from.
///
/// domain  speed in [-100, 100] m/s lin
/// domain  near in [0, 1e3] m lin
/// domain  far in [0, 1e3] m lin
/// range   [-1e5, 1e5] m^2/s
/// error   2e-2 abs of reference::ground::discharge
/// outside undefined
/// source  Stelling2003 (first-order upwind)
fn discharge(speed: vec4<f32>, near: vec4<f32>, far: vec4<f32>) -> vec4<f32> {
    return max(speed, vec4<f32>(0.0)) * near + min(speed, vec4<f32>(0.0)) * far;
}

/// A speed after bed friction, implicitly.
///
/// domain  speed in [-100, 100] m/s lin
/// domain  depth in [1e-4, 1e3] m log
/// domain  friction in [0, 0.2] s*m^-1/3 lin
/// domain  gravity in [0.1, 30] m/s^2 lin
/// domain  step in [0, 10] s lin
/// range   [-100, 100] m/s
/// error   1e-3 abs of reference::ground::rubbed_speed
/// outside undefined
/// source  Manning's law
fn rubbed_speed(speed: vec4<f32>, depth: vec4<f32>, friction: f32, gravity: f32, step: f32) -> vec4<f32> {
    let deep = max(depth, vec4<f32>(1e-4));
    let rate = gravity * friction * friction * abs(speed) / (deep * pow(deep, vec4<f32>(0.33333333)));
    return speed / (1.0 + step * rate);
}
