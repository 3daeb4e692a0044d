//! The air of a planet as layers: densities, extinction and scattering at an altitude, and the phase functions of all layers at once.
//! source   Hillaire2020 (exponential and tent layers); lanes and the common form of the phase functions: ours
//! symbols  h altitude [m] · nu cosine of the scattering angle, 1 forward · a lane is a layer, or one lobe of its phase function
#define_import_path veduta::atmosphere::medium

/// One number for each of eight lanes; a lane that is not used holds 0 everywhere.
struct Lanes {
    /// Lanes 0 to 3.
    low: vec4<f32>,
    /// Lanes 4 to 7.
    high: vec4<f32>,
}

/// Four layers, those that are not exponential first. The density of a layer is exp(fall h) clamp(min(rise h + rise_offset, sink h + sink_offset), 0, 1).
struct FourLayers {
    /// Minus the reciprocal of the scale height, 0 for a layer that is not exponential [1/m].
    fall: vec4<f32>,
    /// Slope of the lower ramp [1/m].
    rise: vec4<f32>,
    /// The lower ramp at altitude 0.
    rise_offset: vec4<f32>,
    /// Slope of the upper ramp [1/m].
    sink: vec4<f32>,
    /// The upper ramp at altitude 0.
    sink_offset: vec4<f32>,
    /// Extinction of red light at density 1 [1/m].
    extinction_red: vec4<f32>,
    /// Extinction of green light at density 1 [1/m].
    extinction_green: vec4<f32>,
    /// Extinction of blue light at density 1 [1/m].
    extinction_blue: vec4<f32>,
    /// Scattering of red light at density 1 [1/m].
    scattering_red: vec4<f32>,
    /// Scattering of green light at density 1 [1/m].
    scattering_green: vec4<f32>,
    /// Scattering of blue light at density 1 [1/m].
    scattering_blue: vec4<f32>,
    /// Asymmetry g of the phase function (phase_level + phase_square nu^2) (1 + g^2 - 2 g nu)^(-3/2).
    phase_g: vec4<f32>,
    /// Its level [1/sr].
    phase_level: vec4<f32>,
    /// Its coefficient of nu^2 [1/sr].
    phase_square: vec4<f32>,
    /// First Legendre moment of the phase function: its mean cosine.
    phase_first: vec4<f32>,
    /// Second Legendre moment of the phase function.
    phase_second: vec4<f32>,
    /// 1 for a layer with a peaked phase function, whose light the tables keep apart; else 0.
    peaked: vec4<f32>,
}

/// The air of a planet and its ground.
struct Air {
    /// Radius of the ground sphere [m].
    ground_radius: f32,
    /// Thickness of the shell [m].
    top: f32,
    /// How many lanes there are; above 4 the second four layers count.
    lane_count: u32,
    /// Asymmetry of the phase function that peaked light is kept without; 0 when no layer is peaked.
    peak_g: f32,
    /// Its level [1/sr].
    peak_level: f32,
    /// Its coefficient of nu^2 [1/sr].
    peak_square: f32,
    /// Angular radius of the sun's disc by which light of higher orders fades over the planet's shadow [rad].
    sun_radius: f32,
    /// Albedo of the ground.
    ground_albedo: vec3<f32>,
    /// Lanes 0 to 3.
    low: FourLayers,
    /// Lanes 4 to 7.
    high: FourLayers,
}

/// Densities of four layers.
///
/// internal
fn four_densities(layers: FourLayers, h: f32) -> vec4<f32> {
    let ramps = min(layers.rise * h + layers.rise_offset, layers.sink * h + layers.sink_offset);
    return exp(layers.fall * h) * clamp(ramps, vec4<f32>(0.0), vec4<f32>(1.0));
}

/// Densities of all layers, relative to the greatest of each; altitudes below 0 count as 0.
///
/// domain  h in [0, 1e5] m lin
/// range   [0, 1] 1
/// error   1e-6 abs of reference::medium::air_densities
/// source  Hillaire2020 sec. 4
fn air_densities(air: Air, h: f32) -> Lanes {
    let altitude = max(h, 0.0);
    var densities = Lanes(four_densities(air.low, altitude), vec4<f32>(0.0));
#ifdef AIR_EIGHT_LANES
    densities.high = four_densities(air.high, altitude);
#endif
    return densities;
}

/// Extinction of amounts (densities), or optical depth of columns [m], per channel.
///
/// domain  amounts.low in [0, 1] 1 lin
/// domain  amounts.high in [0, 1] 1 lin
/// range   [0, 1] 1/m
/// error   4e-7 rel of reference::medium::air_extinction
/// source  sum over the layers
fn air_extinction(air: Air, amounts: Lanes) -> vec3<f32> {
    var sum = vec3<f32>(
        dot(air.low.extinction_red, amounts.low),
        dot(air.low.extinction_green, amounts.low),
        dot(air.low.extinction_blue, amounts.low),
    );
#ifdef AIR_EIGHT_LANES
    sum += vec3<f32>(
        dot(air.high.extinction_red, amounts.high),
        dot(air.high.extinction_green, amounts.high),
        dot(air.high.extinction_blue, amounts.high),
    );
#endif
    return sum;
}

/// Scattering of amounts, each lane weighted (with its phase function, say), per channel.
///
/// domain  amounts.low in [0, 1] 1 lin
/// domain  amounts.high in [0, 1] 1 lin
/// domain  weights.low in [0, 10] 1/sr lin
/// domain  weights.high in [0, 10] 1/sr lin
/// range   [0, 10] 1/m
/// error   6e-7 rel of reference::medium::air_scattering
/// outside undefined
/// source  sum over the layers
fn air_scattering(air: Air, amounts: Lanes, weights: Lanes) -> vec3<f32> {
    let low = amounts.low * weights.low;
    var sum = vec3<f32>(
        dot(air.low.scattering_red, low),
        dot(air.low.scattering_green, low),
        dot(air.low.scattering_blue, low),
    );
#ifdef AIR_EIGHT_LANES
    let high = amounts.high * weights.high;
    sum += vec3<f32>(
        dot(air.high.scattering_red, high),
        dot(air.high.scattering_green, high),
        dot(air.high.scattering_blue, high),
    );
#endif
    return sum;
}

/// Phase functions of four layers.
///
/// internal
fn four_phases(layers: FourLayers, nu: f32) -> vec4<f32> {
    let gap = 1.0 - layers.phase_g;
    let base = max(gap * gap + (2.0 - 2.0 * nu) * layers.phase_g, vec4<f32>(1e-9));
    return (layers.phase_level + layers.phase_square * (nu * nu)) * inverseSqrt(base) / base;
}

/// Phase functions of all layers; their integrals over the sphere are 1.
///
/// domain  nu in [-1, 1] 1 lin
/// range   [0, 2e3] 1/sr
/// error   2e-5 rel of reference::medium::air_phases
/// outside undefined
/// source  Cornette1992, Henyey1941, Draine2003 in one form
fn air_phases(air: Air, nu: f32) -> Lanes {
    var phases = Lanes(four_phases(air.low, nu), vec4<f32>(0.0));
#ifdef AIR_EIGHT_LANES
    phases.high = four_phases(air.high, nu);
#endif
    return phases;
}

/// The phase function that the light of peaked layers is kept without in tables: that of the most peaked layer.
///
/// domain  nu in [-1, 1] 1 lin
/// range   [0, 2e3] 1/sr
/// error   2e-5 rel of reference::medium::peak_phase
/// outside undefined
/// source  as air_phases
fn peak_phase(air: Air, nu: f32) -> f32 {
    let gap = 1.0 - air.peak_g;
    let base = max(gap * gap + (2.0 - 2.0 * nu) * air.peak_g, 1e-9);
    let over = inverseSqrt(base);
    return (air.peak_level + air.peak_square * (nu * nu)) * (over * over * over);
}
