//! The terrain: height, marches, normals, shadows, light and material. Lengths in metres; `offset` and `relative` from the eye.

use super::fractal::{fbm_3d, ridged_multifractal_2d};
use super::math::{add, dot, mix, normalize, scale, smoothstep};
use super::planet::{altitude_of, up_at};

/// Scale and character of the terrain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terrain {
    /// Lattice cell of the eye's foot point.
    pub cell: [i32; 2],
    /// Fraction within that cell.
    pub frac: [f64; 2],
    /// Wavelength of the first octave.
    pub wavelength: f64,
    /// Height of a fractal value of 1.
    pub amplitude: f64,
    /// Hurst exponent.
    pub hurst: f64,
    /// Weight of an octave by the one before it.
    pub gain: f64,
    /// Rounding of the crests.
    pub smoothness: f64,
    /// Seed of the lattice.
    pub seed: u32,
}

/// What a march found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TerrainHit {
    /// Distance of the hit; -1 if there is none.
    pub distance: f64,
    /// Distance of the last sample.
    pub reached: f64,
    /// Clearance at the last sample.
    pub clearance: f64,
    /// Height samples taken.
    pub steps: i32,
}

/// Height of the ground.
pub fn height(terrain: &Terrain, offset: [f64; 2], octaves: i32) -> f64 {
    let place = [
        terrain.frac[0] + offset[0] / terrain.wavelength,
        terrain.frac[1] + offset[1] / terrain.wavelength,
    ];
    terrain.amplitude
        * ridged_multifractal_2d(
            terrain.cell,
            place,
            octaves,
            terrain.hurst,
            terrain.gain,
            terrain.smoothness,
            terrain.seed,
        )
}

/// Clearance above any ground at distance `t` along a ray from the eye.
pub fn clearance_over(
    ground: impl Fn([f64; 2]) -> f64,
    ground_radius: f64,
    eye_altitude: f64,
    dir: [f64; 3],
    t: f64,
) -> f64 {
    altitude_of(ground_radius, eye_altitude, scale(dir, t)) - ground([dir[0] * t, dir[2] * t])
}

/// Clearance above the terrain at distance `t` along a ray from the eye.
pub fn ray_clearance(
    terrain: &Terrain,
    ground_radius: f64,
    eye_altitude: f64,
    dir: [f64; 3],
    t: f64,
    octaves: i32,
) -> f64 {
    clearance_over(
        |p| height(terrain, p, octaves),
        ground_radius,
        eye_altitude,
        dir,
        t,
    )
}

/// First sample below a clearance function walked in equal steps.
pub fn march_constant_over(
    clearance: impl Fn(f64) -> f64,
    near: f64,
    far: f64,
    step: f64,
    max_steps: i32,
    interpolate: bool,
) -> TerrainHit {
    let mut hit = TerrainHit {
        distance: -1.0,
        reached: near,
        clearance: 0.0,
        steps: 0,
    };
    for i in 0..max_steps {
        let t = near + f64::from(i) * step;
        if t > far {
            break;
        }
        let (above, below) = (hit.clearance, clearance(t));
        hit = TerrainHit {
            distance: -1.0,
            reached: t,
            clearance: below,
            steps: i + 1,
        };
        if below < 0.0 {
            hit.distance = if interpolate && i > 0 {
                t - step + step * above / (above - below)
            } else {
                t
            };
            break;
        }
    }
    hit
}

/// First sample below the terrain on a ray walked in equal steps.
#[allow(clippy::too_many_arguments)]
pub fn march_constant(
    terrain: &Terrain,
    ground_radius: f64,
    eye_altitude: f64,
    dir: [f64; 3],
    near: f64,
    far: f64,
    step: f64,
    max_steps: i32,
    octaves: i32,
    interpolate: bool,
) -> TerrainHit {
    march_constant_over(
        |t| ray_clearance(terrain, ground_radius, eye_altitude, dir, t, octaves),
        near,
        far,
        step,
        max_steps,
        interpolate,
    )
}

/// Algorithm 4, corrected, over a clearance function: accumulate the distance, tolerance epsilon * 0.001 * t.
pub fn march_over(
    clearance: impl Fn(f64) -> f64,
    near: f64,
    far: f64,
    step_factor: f64,
    epsilon: f64,
    max_steps: i32,
) -> TerrainHit {
    let mut hit = TerrainHit {
        distance: -1.0,
        reached: near,
        clearance: 0.0,
        steps: 0,
    };
    let mut t = near;
    while hit.steps < max_steps {
        hit.reached = t;
        hit.clearance = clearance(t);
        hit.steps += 1;
        if hit.clearance < epsilon * 0.001 * t {
            hit.distance = t;
            break;
        }
        t += step_factor * hit.clearance;
        if t > far {
            break;
        }
    }
    hit
}

/// Algorithm 4, corrected, on the terrain.
#[allow(clippy::too_many_arguments)]
pub fn march(
    terrain: &Terrain,
    ground_radius: f64,
    eye_altitude: f64,
    dir: [f64; 3],
    near: f64,
    far: f64,
    step_factor: f64,
    epsilon: f64,
    max_steps: i32,
    octaves: i32,
) -> TerrainHit {
    march_over(
        |t| ray_clearance(terrain, ground_radius, eye_altitude, dir, t, octaves),
        near,
        far,
        step_factor,
        epsilon,
        max_steps,
    )
}

/// Slope (dh/dx, dh/dz) by central differences over 2 `step`.
pub fn terrain_slope(terrain: &Terrain, offset: [f64; 2], step: f64, octaves: i32) -> [f64; 2] {
    let h = |dx: f64, dz: f64| height(terrain, [offset[0] + dx, offset[1] + dz], octaves);
    [
        (h(step, 0.0) - h(-step, 0.0)) / (2.0 * step),
        (h(0.0, step) - h(0.0, -step)) / (2.0 * step),
    ]
}

/// Unit normal in the frame whose +Y is up at the point.
pub fn local_normal(terrain: &Terrain, offset: [f64; 2], step: f64, octaves: i32) -> [f64; 3] {
    let slope = terrain_slope(terrain, offset, step, octaves);
    normalize([-slope[0], 1.0, -slope[1]])
}

/// Unit normal in the eye's frame.
pub fn terrain_normal(
    terrain: &Terrain,
    ground_radius: f64,
    eye_altitude: f64,
    relative: [f64; 3],
    step: f64,
    octaves: i32,
) -> [f64; 3] {
    let slope = terrain_slope(terrain, [relative[0], relative[2]], step, octaves);
    normalize(add(
        up_at(ground_radius, eye_altitude, relative),
        [-slope[0], 0.0, -slope[1]],
    ))
}

/// Share of sunlight that reaches a point over any ground.
#[allow(clippy::too_many_arguments)]
pub fn soft_shadow_over(
    ground: impl Fn([f64; 2]) -> f64,
    ground_radius: f64,
    eye_altitude: f64,
    relative: [f64; 3],
    normal: [f64; 3],
    to_sun: [f64; 3],
    bias: f64,
    far: f64,
    sharpness: f64,
    step_factor: f64,
    epsilon: f64,
    max_steps: i32,
) -> f64 {
    let start = add(relative, scale(normal, bias));
    let (mut light, mut t) = (1.0f64, 0.0);
    for _ in 0..max_steps {
        let sample = add(start, scale(to_sun, t));
        let clearance =
            altitude_of(ground_radius, eye_altitude, sample) - ground([sample[0], sample[2]]);
        if clearance < epsilon * 0.001 * t {
            return 0.0;
        }
        if t > 0.0 {
            light = light.min(sharpness * clearance / t);
        }
        t += step_factor * clearance.max(0.0);
        if t > far {
            break;
        }
    }
    light
}

/// Share of sunlight that reaches a point of the terrain.
#[allow(clippy::too_many_arguments)]
pub fn soft_shadow(
    terrain: &Terrain,
    ground_radius: f64,
    eye_altitude: f64,
    relative: [f64; 3],
    normal: [f64; 3],
    to_sun: [f64; 3],
    bias: f64,
    far: f64,
    sharpness: f64,
    step_factor: f64,
    epsilon: f64,
    max_steps: i32,
    octaves: i32,
) -> f64 {
    let ground = |p| height(terrain, p, octaves);
    soft_shadow_over(
        ground,
        ground_radius,
        eye_altitude,
        relative,
        normal,
        to_sun,
        bias,
        far,
        sharpness,
        step_factor,
        epsilon,
        max_steps,
    )
}

/// Irradiances of the three lights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThreeLights {
    /// Direct sunlight.
    pub sun_color: [f64; 3],
    /// Ambient light from straight above.
    pub sky_color: [f64; 3],
    /// Light returned by the ground.
    pub bounce_color: [f64; 3],
}

/// Horizontal direction from which the bounce light comes.
pub fn bounce_direction(to_sun: [f64; 3]) -> [f64; 3] {
    let l = to_sun[0].hypot(to_sun[2]).max(1e-5);
    [-to_sun[0] / l, 0.0, -to_sun[2] / l]
}

/// Light received by a surface from sun, sky and bounce.
pub fn shade_three_lights(
    lights: &ThreeLights,
    normal: [f64; 3],
    to_sun: [f64; 3],
    shadow: f64,
) -> [f64; 3] {
    let direct = dot(normal, to_sun).max(0.0) * shadow;
    let ambient = normal[1].max(0.0);
    let bounce = dot(normal, bounce_direction(to_sun)).max(0.0);
    std::array::from_fn(|k| {
        direct * lights.sun_color[k]
            + ambient * lights.sky_color[k]
            + bounce * lights.bounce_color[k]
    })
}

/// Light received by a surface of which only the mean slopes and the mean square about them are known.
pub fn shade_rough(
    lights: &ThreeLights,
    slope: [f64; 2],
    lost: f64,
    to_sun: [f64; 3],
    shadow: f64,
) -> [f64; 3] {
    let size = (1.0 + slope[0] * slope[0] + slope[1] * slope[1] + lost).sqrt();
    let normal = [-slope[0] / size, 1.0 / size, -slope[1] / size];
    let spread = 0.8 * (0.5 * lost).sqrt() / size;
    let lit = |x: f64, width: f64| 0.5 * (x + x.hypot(width));
    let direct = lit(dot(normal, to_sun), spread * to_sun[0].hypot(to_sun[2])) * shadow;
    let bounce = lit(dot(normal, bounce_direction(to_sun)), spread);
    std::array::from_fn(|k| {
        direct * lights.sun_color[k]
            + normal[1] * lights.sky_color[k]
            + bounce * lights.bounce_color[k]
    })
}

/// Scale, colours and place of the rock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rock {
    /// Lattice cell of the eye's foot point.
    pub cell: [i32; 3],
    /// Fraction within that cell.
    pub frac: [f64; 3],
    /// Wavelength of the first octave.
    pub wavelength: f64,
    /// Octaves of each fBm.
    pub octaves: i32,
    /// Hurst exponent of each fBm.
    pub hurst: f64,
    /// Albedo of the darkest rock.
    pub dark: [f64; 3],
    /// Albedo of the brightest rock.
    pub light: [f64; 3],
    /// Albedo of weathered stains.
    pub stain: [f64; 3],
    /// Seed of the lattice.
    pub seed: u32,
}

/// One fBm of the rock on a lattice whose axes are finer by whole factors.
fn rock_noise(rock: &Rock, position: [f64; 3], fineness: [i32; 3], seed: u32) -> f64 {
    let cell = std::array::from_fn(|k| rock.cell[k].wrapping_mul(fineness[k]));
    let frac = std::array::from_fn(|k| {
        (rock.frac[k] + position[k] / rock.wavelength) * f64::from(fineness[k])
    });
    fbm_3d(
        cell,
        frac,
        rock.octaves,
        rock.hurst,
        rock.seed.wrapping_add(seed),
    )
}

/// Albedo of the rock from one fBm.
pub fn rock_low(rock: &Rock, position: [f64; 3]) -> [f64; 3] {
    mix(
        rock.dark,
        rock.light,
        (0.5 + 0.6 * rock_noise(rock, position, [1; 3], 0)).clamp(0.0, 1.0),
    )
}

/// Albedo of the rock from four fBm.
pub fn rock_high(rock: &Rock, position: [f64; 3]) -> [f64; 3] {
    let bulk = rock_noise(rock, position, [1; 3], 0);
    let strata = rock_noise(
        rock,
        add(position, [0.0, 0.5 * bulk * rock.wavelength, 0.0]),
        [1, 5, 1],
        1,
    );
    let grain = rock_noise(rock, position, [8; 3], 2);
    let stains = rock_noise(rock, position, [2; 3], 3);
    let tone = (0.5 + 0.3 * bulk + 0.3 * strata + 0.25 * grain).clamp(0.0, 1.0);
    mix(
        mix(rock.dark, rock.light, tone),
        rock.stain,
        0.6 * smoothstep(0.05, 0.6, stains),
    )
}

/// One fBm of the rock, each octave by the share of it that a footprint leaves.
pub fn faded_noise(
    rock: &Rock,
    position: [f64; 3],
    fineness: [i32; 3],
    seed: u32,
    footprint: f64,
) -> f64 {
    let finest = f64::from(fineness.into_iter().max().unwrap_or(1));
    let part = |octaves: i32| {
        let rock = Rock { octaves, ..*rock };
        rock_noise(&rock, position, fineness, seed)
    };
    (0..rock.octaves)
        .map(|i| {
            let cells = rock.wavelength / (finest * 2_f64.powi(i));
            super::field::kept(cells, footprint) * (part(i + 1) - part(i))
        })
        .sum()
}

/// Albedo of the rock from one fBm, faded by a footprint.
pub fn rock_low_faded(rock: &Rock, position: [f64; 3], footprint: f64) -> [f64; 3] {
    let tone = faded_noise(rock, position, [1; 3], 0, footprint);
    mix(rock.dark, rock.light, (0.5 + 0.6 * tone).clamp(0.0, 1.0))
}

/// Albedo of the rock from four fBm, faded by a footprint.
pub fn rock_high_faded(rock: &Rock, position: [f64; 3], footprint: f64) -> [f64; 3] {
    let noise = |p, fineness, seed| faded_noise(rock, p, fineness, seed, footprint);
    let bulk = noise(position, [1; 3], 0);
    let bent = add(position, [0.0, 0.5 * bulk * rock.wavelength, 0.0]);
    let (strata, grain, stains) = (
        noise(bent, [1, 5, 1], 1),
        noise(position, [8; 3], 2),
        noise(position, [2; 3], 3),
    );
    let tone = (0.5 + 0.3 * bulk + 0.3 * strata + 0.25 * grain).clamp(0.0, 1.0);
    mix(
        mix(rock.dark, rock.light, tone),
        rock.stain,
        0.6 * smoothstep(0.05, 0.6, stains),
    )
}

/// Mean of a texture over n x n points of a footprint.
fn filtered(
    texture: impl Fn([f64; 3]) -> [f64; 3],
    position: [f64; 3],
    dpdx: [f64; 3],
    dpdy: [f64; 3],
    samples: i32,
) -> [f64; 3] {
    let n = samples.max(1);
    let mut sum = [0.0; 3];
    for j in 0..n {
        for i in 0..n {
            let place = |k: i32| (f64::from(k) + 0.5) / f64::from(n) - 0.5;
            sum = add(
                sum,
                texture(add(
                    position,
                    add(scale(dpdx, place(i)), scale(dpdy, place(j))),
                )),
            );
        }
    }
    scale(sum, 1.0 / f64::from(n * n))
}

/// `rock_low` averaged over a footprint.
pub fn rock_low_filtered(
    rock: &Rock,
    position: [f64; 3],
    dpdx: [f64; 3],
    dpdy: [f64; 3],
    samples: i32,
) -> [f64; 3] {
    filtered(|p| rock_low(rock, p), position, dpdx, dpdy, samples)
}

/// `rock_high` averaged over a footprint.
pub fn rock_high_filtered(
    rock: &Rock,
    position: [f64; 3],
    dpdx: [f64; 3],
    dpdy: [f64; 3],
    samples: i32,
) -> [f64; 3] {
    filtered(|p| rock_high(rock, p), position, dpdx, dpdy, samples)
}

/// Movement of the point seen from one pixel to the next, on the tangent plane; stretched at most 20 times.
pub fn surface_footprint(
    dir: [f64; 3],
    dir_change: [f64; 3],
    distance: f64,
    normal: [f64; 3],
) -> [f64; 3] {
    let facing = dot(dir, normal).min(-0.05);
    scale(
        add(dir_change, scale(dir, -dot(dir_change, normal) / facing)),
        distance,
    )
}

/// Share of snow on a slope.
pub fn snow_blend(normal_y: f64, noise: f64, edge0: f64, edge1: f64, k: f64) -> f64 {
    1.0 - smoothstep((edge0 + k * noise).min(edge1 - 0.01), edge1, 1.0 - normal_y)
}

/// Irradiance of a uniform sky on the ground between horizons, over that on level ground and the normal's zenith cosine: horizons in so many sectors, of heights at so many
/// distances, each longer by a factor.
#[allow(clippy::too_many_arguments)]
pub fn sky_share(
    height: impl Fn([f64; 2]) -> f64,
    at: [f64; 2],
    altitude: f64,
    slope: [f64; 2],
    first: f64,
    factor: f64,
    rings: i32,
    sectors: i32,
) -> f64 {
    let mut sum = 0.0;
    for i in 0..sectors {
        let turn = std::f64::consts::TAU * (f64::from(i) + 0.5) / f64::from(sectors);
        let (sine, cosine) = turn.sin_cos();
        let g = slope[0] * cosine + slope[1] * sine;
        let tangent = (0..rings).fold(g.max(0.0), |most, k| {
            let t = first * factor.powi(k);
            most.max((height([at[0] + cosine * t, at[1] + sine * t]) - altitude) / t)
        });
        let square = 1.0 / (1.0 + tangent * tangent);
        sum += square - g * (std::f64::consts::FRAC_PI_2 - tangent.atan() - tangent * square);
    }
    sum.max(0.0) / f64::from(sectors)
}
