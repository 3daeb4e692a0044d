//! Single scattering of sunlight in a spherical atmosphere of air and aerosol: sky and aerial perspective in one march.
//! source   Leitner2022 alg. 7 (after Nishita1993), corrected by half a step; planet shadow: ours
//! symbols  h altitude [m] · mu zenith cosine [1] · R, M Rayleigh and Mie · densities are relative to sea level
#define_import_path veduta::atmosphere::march

#import veduta::planet::shell::{altitude_along, direction_cosine_along, sphere_span, top_distance, ground_distance}
#import veduta::lighting::phase::{phase_rayleigh, phase_cornette_shanks}

/// The planet's air.
struct Atmosphere {
    /// Radius of the ground sphere [m].
    ground_radius: f32,
    /// Thickness of the shell [m].
    top: f32,
    /// Rayleigh scattering at sea level, which is its extinction too [1/m].
    rayleigh_scattering: vec3<f32>,
    /// Scale height of the air [m].
    rayleigh_height: f32,
    /// Mie scattering at sea level [1/m].
    mie_scattering: f32,
    /// Mie extinction at sea level [1/m].
    mie_extinction: f32,
    /// Scale height of the aerosol [m].
    mie_height: f32,
    /// Asymmetry of the aerosol's phase function.
    mie_g: f32,
}

/// Light added and light left along a ray; radiance is relative to the sun's irradiance outside the air.
struct SkyLight {
    /// Radiance scattered into the ray [1/sr].
    in_scatter: vec3<f32>,
    /// Transmittance of the ray.
    transmittance: vec3<f32>,
}

/// Densities of air and aerosol, relative to sea level; altitudes below 0 count as 0.
///
/// domain  h in [0, 1e5] m lin
/// range   [0, 1] 1
/// error   4e-7 abs of reference::atmosphere::air_density
/// monotone h
/// outside undefined
/// source  Leitner2022 eq. 3.15
fn air_density(atmosphere: Atmosphere, h: f32) -> vec2<f32> {
    return exp(max(h, 0.0) / vec2<f32>(-atmosphere.rayleigh_height, -atmosphere.mie_height));
}

/// Integrals of the air's and the aerosol's density from altitude `h` along zenith cosine `mu` to the top of the shell [m],
/// by the midpoint rule; the ground does not end the path.
///
/// domain  h in [0, 1e5] m lin
/// domain  mu in [-0.1, 1] 1 lin
/// domain  steps in [1, 512] 1 lin
/// range   [0, 2.5e7] m
/// error   2e-5 rel of reference::atmosphere::air_column
/// outside undefined
/// source  Leitner2022 alg. 7 (raymarchToLight)
fn air_column(atmosphere: Atmosphere, h: f32, mu: f32, steps: i32) -> vec2<f32> {
    let count = max(steps, 1);
    let dt = top_distance(atmosphere.ground_radius, atmosphere.top, h, mu) / f32(count);
    let falloff = vec2<f32>(-1.0 / atmosphere.rayleigh_height, -1.0 / atmosphere.mie_height);
    var sum = vec2<f32>(0.0);
    for (var i = 0; i < count; i++) {
        let altitude = altitude_along(atmosphere.ground_radius, h, mu, (f32(i) + 0.5) * dt);
        sum += exp(max(altitude, 0.0) * falloff);
    }
    return sum * dt;
}

/// Share of sunlight that reaches altitude `h` from zenith cosine `mu`, per channel; 0 in the planet's shadow.
///
/// domain  h in [0, 1e5] m lin
/// domain  mu in [-1, 1] 1 lin
/// domain  steps in [1, 512] 1 lin
/// range   [0, 1] 1
/// error   3e-6 abs of reference::atmosphere::sun_transmittance
/// outside undefined
/// source  Leitner2022 eq. 3.1 along the path to the sun
fn sun_transmittance(atmosphere: Atmosphere, h: f32, mu: f32, steps: i32) -> vec3<f32> {
    let column = air_column(atmosphere, h, mu, steps);
    let lit = ground_distance(atmosphere.ground_radius, h, mu) < 0.0;
    return select(vec3<f32>(0.0), exp(-(atmosphere.rayleigh_scattering * column.x + atmosphere.mie_extinction * column.y)), lit);
}

/// Light scattered into a view ray and the ray's transmittance, up to `distance` (give 1e9 for none), the ground sphere
/// or the end of the air, whichever is first: the sky, and the air before any surface. The eye may be above the air.
///
/// domain  eye_altitude in [0, 1e5] m lin
/// domain  dir in [-1, 1] 1 lin
/// domain  to_sun in [-1, 1] 1 lin
/// domain  distance in [0, 1e7] m lin
/// domain  steps in [1, 512] 1 lin
/// domain  light_steps in [1, 64] 1 lin
/// range   [0, 100] 1/sr
/// error   3e-5 abs of reference::atmosphere::march_sky
/// outside undefined
/// source  Leitner2022 alg. 7; departs: half a step less attenuation, planet shadow
fn march_sky(atmosphere: Atmosphere, eye_altitude: f32, dir: vec3<f32>, to_sun: vec3<f32>, distance: f32, steps: i32, light_steps: i32) -> SkyLight {
    let radius = atmosphere.ground_radius;
    let nu = dot(dir, to_sun);
    let count = max(steps, 1);
    let shell = sphere_span(radius, atmosphere.top, eye_altitude, dir.y);
    let ground = ground_distance(radius, eye_altitude, dir.y);
    let near = max(shell.near, 0.0);
    let end = min(distance, min(shell.far, select(shell.far, ground, ground >= 0.0)));
    let dt = max(end - near, 0.0) / f32(count);
    let extinction = vec4<f32>(atmosphere.rayleigh_scattering, atmosphere.mie_extinction);
    let falloff = vec2<f32>(-1.0 / atmosphere.rayleigh_height, -1.0 / atmosphere.mie_height);
    var column = vec2<f32>(0.0);
    var rayleigh = vec3<f32>(0.0);
    var mie = vec3<f32>(0.0);
    for (var i = 0; i < count; i++) {
        let t = near + (f32(i) + 0.5) * dt;
        let h = max(altitude_along(radius, eye_altitude, dir.y, t), 0.0);
        let thickness = exp(h * falloff) * dt;
        let mu = direction_cosine_along(radius, eye_altitude, h, to_sun.y, nu, t);
        if ground_distance(radius, h, mu) < 0.0 {
            let passed = column + 0.5 * thickness + air_column(atmosphere, h, mu, light_steps);
            let light = exp(-(extinction.xyz * passed.x + extinction.w * passed.y));
            rayleigh += light * thickness.x;
            mie += light * thickness.y;
        }
        column += thickness;
    }
    let in_scatter = rayleigh * atmosphere.rayleigh_scattering * phase_rayleigh(nu)
        + mie * (atmosphere.mie_scattering * phase_cornette_shanks(nu, atmosphere.mie_g));
    return SkyLight(in_scatter, exp(-(extinction.xyz * column.x + extinction.w * column.y)));
}
