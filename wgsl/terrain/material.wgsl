//! What the ground is made of: rock from 3D fractals in two qualities, snow by slope, filtering by footprint.
//! source   Leitner2022 ch. 5; formulas and colours of the rock: ours
//! symbols  position (x, altitude, z) relative to the eye's foot point [m] · dpdx, dpdy its change to the next pixel [m]
#define_import_path veduta::terrain::material

#import veduta::fractal::fbm::{fbm_3d}
#import veduta::noise::lattice::{split_3d, finer_3d, shifted_3d, octave_seed, octave_fall}
#import veduta::noise::gradient::{gradient_at_3d}

/// Scale, colours and place of the rock; the eye's foot point is a lattice cell and a fraction.
struct Rock {
    /// Lattice cell of the eye's foot point (altitude 0), in units of the wavelength.
    cell: vec3<i32>,
    /// Fraction within that cell, in [0, 1).
    frac: vec3<f32>,
    /// Wavelength of the first octave [m], > 0.
    wavelength: f32,
    /// Octaves of each fBm.
    octaves: i32,
    /// Hurst exponent of each fBm.
    hurst: f32,
    /// Albedo of the darkest rock.
    dark: vec3<f32>,
    /// Albedo of the brightest rock.
    light: vec3<f32>,
    /// Albedo of weathered stains; in high quality only.
    stain: vec3<f32>,
    /// Seed of the lattice.
    seed: u32,
}

/// One fBm of the rock on a lattice whose axes are finer by whole factors.
///
/// internal
fn rock_noise(rock: Rock, position: vec3<f32>, fineness: vec3<i32>, seed: u32) -> f32 {
    let frac = (rock.frac + position / rock.wavelength) * vec3<f32>(fineness);
    return fbm_3d(rock.cell * fineness, frac, rock.octaves, rock.hurst, rock.seed + seed);
}

/// Albedo of the rock from one fBm: the cheap texture.
///
/// domain  position in [-1e4, 1e4] m lin
/// range   [0, 1] 1
/// error   1e-4 abs of reference::terrain::rock_low
/// source  Leitner2022 ch. 5.3 (one call)
fn rock_low(rock: Rock, position: vec3<f32>) -> vec3<f32> {
    let tone = rock_noise(rock, position, vec3<i32>(1, 1, 1), 0u);
    return mix(rock.dark, rock.light, clamp(0.5 + 0.6 * tone, 0.0, 1.0));
}

/// Albedo of the rock from four fBm: bulk tone, strata, grain and stains.
///
/// domain  position in [-1e4, 1e4] m lin
/// range   [0, 1] 1
/// error   4e-4 abs of reference::terrain::rock_high
/// source  Leitner2022 ch. 5.3 (four calls)
fn rock_high(rock: Rock, position: vec3<f32>) -> vec3<f32> {
    let bulk = rock_noise(rock, position, vec3<i32>(1, 1, 1), 0u);
    let bent = position + vec3<f32>(0.0, 0.5 * bulk * rock.wavelength, 0.0);
    let strata = rock_noise(rock, bent, vec3<i32>(1, 5, 1), 1u);
    let grain = rock_noise(rock, position, vec3<i32>(8, 8, 8), 2u);
    let stains = rock_noise(rock, position, vec3<i32>(2, 2, 2), 3u);
    let tone = clamp(0.5 + 0.3 * bulk + 0.3 * strata + 0.25 * grain, 0.0, 1.0);
    return mix(mix(rock.dark, rock.light, tone), rock.stain, 0.6 * smoothstep(0.05, 0.6, stains));
}

/// One fBm of the rock without the octaves that a footprint cannot show: each fades as its cells go from two footprints to one.
///
/// domain  position in [-1e4, 1e4] m lin
/// domain  fineness in [1, 8] 1 lin
/// domain  footprint in [1e-3, 1e4] m log
/// range   [-16, 16] 1
/// error   1e-3 abs of reference::terrain::faded_noise
/// outside undefined
/// source  Leitner2022 alg. 1; fading: ours
fn faded_noise(rock: Rock, position: vec3<f32>, fineness: vec3<i32>, seed: u32, footprint: f32) -> f32 {
    let fall = octave_fall(rock.hurst);
    var p = split_3d(rock.cell * fineness, (rock.frac + position / rock.wavelength) * vec3<f32>(fineness));
    var reach = rock.wavelength / (f32(max(fineness.x, max(fineness.y, fineness.z))) * max(footprint, 1e-6));
    var amplitude = 1.0;
    var sum = 0.0;
    for (var i = 0; i < rock.octaves; i++) {
        if reach <= 1.0 {
            break;
        }
        let x = min(reach - 1.0, 1.0);
        sum += amplitude * (x * x * (3.0 - 2.0 * x)) * gradient_at_3d(shifted_3d(p, i), octave_seed(rock.seed + seed, i));
        p = finer_3d(p);
        amplitude *= fall;
        reach *= 0.5;
    }
    return sum;
}

/// `rock_low` without what a footprint cannot show.
///
/// domain  position in [-1e4, 1e4] m lin
/// domain  footprint in [1e-3, 1e4] m log
/// range   [0, 1] 1
/// error   1e-4 abs of reference::terrain::rock_low_faded
/// source  Leitner2022 ch. 5.3 and 5.5; departs: fades octaves instead of averaging samples
fn rock_low_faded(rock: Rock, position: vec3<f32>, footprint: f32) -> vec3<f32> {
    let tone = faded_noise(rock, position, vec3<i32>(1, 1, 1), 0u, footprint);
    return mix(rock.dark, rock.light, clamp(0.5 + 0.6 * tone, 0.0, 1.0));
}

/// `rock_high` without what a footprint cannot show.
///
/// domain  position in [-1e4, 1e4] m lin
/// domain  footprint in [1e-3, 1e4] m log
/// range   [0, 1] 1
/// error   4e-4 abs of reference::terrain::rock_high_faded
/// source  Leitner2022 ch. 5.3 and 5.5; departs: fades octaves instead of averaging samples
fn rock_high_faded(rock: Rock, position: vec3<f32>, footprint: f32) -> vec3<f32> {
    let bulk = faded_noise(rock, position, vec3<i32>(1, 1, 1), 0u, footprint);
    let bent = position + vec3<f32>(0.0, 0.5 * bulk * rock.wavelength, 0.0);
    let strata = faded_noise(rock, bent, vec3<i32>(1, 5, 1), 1u, footprint);
    let grain = faded_noise(rock, position, vec3<i32>(8, 8, 8), 2u, footprint);
    let stains = faded_noise(rock, position, vec3<i32>(2, 2, 2), 3u, footprint);
    let tone = clamp(0.5 + 0.3 * bulk + 0.3 * strata + 0.25 * grain, 0.0, 1.0);
    return mix(mix(rock.dark, rock.light, tone), rock.stain, 0.6 * smoothstep(0.05, 0.6, stains));
}

/// `rock_low` averaged over `samples` x `samples` points of the pixel's footprint; one sample is the unfiltered texture.
///
/// domain  position in [-1e4, 1e4] m lin
/// domain  dpdx in [-100, 100] m lin
/// domain  dpdy in [-100, 100] m lin
/// domain  samples in [1, 8] 1 lin
/// range   [0, 1.0000003] 1
/// error   6e-5 abs of reference::terrain::rock_low_filtered
/// source  Leitner2022 ch. 5.5
fn rock_low_filtered(rock: Rock, position: vec3<f32>, dpdx: vec3<f32>, dpdy: vec3<f32>, samples: i32) -> vec3<f32> {
    let n = max(samples, 1);
    var sum = vec3<f32>(0.0);
    for (var i = 0; i < n * n; i++) {
        let place = (vec2<f32>(f32(i % n), f32(i / n)) + 0.5) / f32(n) - 0.5;
        sum += rock_low(rock, position + place.x * dpdx + place.y * dpdy);
    }
    return sum / f32(n * n);
}

/// `rock_high` averaged over `samples` x `samples` points of the pixel's footprint; one sample is the unfiltered texture.
///
/// domain  position in [-1e4, 1e4] m lin
/// domain  dpdx in [-100, 100] m lin
/// domain  dpdy in [-100, 100] m lin
/// domain  samples in [1, 8] 1 lin
/// range   [0, 1.0000003] 1
/// error   3e-4 abs of reference::terrain::rock_high_filtered
/// source  Leitner2022 ch. 5.5
fn rock_high_filtered(rock: Rock, position: vec3<f32>, dpdx: vec3<f32>, dpdy: vec3<f32>, samples: i32) -> vec3<f32> {
    let n = max(samples, 1);
    var sum = vec3<f32>(0.0);
    for (var i = 0; i < n * n; i++) {
        let place = (vec2<f32>(f32(i % n), f32(i / n)) + 0.5) / f32(n) - 0.5;
        sum += rock_high(rock, position + place.x * dpdx + place.y * dpdy);
    }
    return sum / f32(n * n);
}

/// How far the point seen moves on the surface from one pixel to the next, from the change `dir_change` of the ray's
/// direction; grazing views are limited to a stretch of 20, so that silhouettes have no endless footprint.
///
/// domain  dir in [-1, 1] 1 lin
/// domain  dir_change in [-0.01, 0.01] 1 lin
/// domain  distance in [0, 1e5] m lin
/// domain  normal in [-1, 1] 1 lin
/// range   [-4e4, 4e4] m
/// error   0.05 abs of reference::terrain::surface_footprint
/// outside undefined
/// source  Igehy1999 ray differentials on the tangent plane; limit: ours
fn surface_footprint(dir: vec3<f32>, dir_change: vec3<f32>, distance: f32, normal: vec3<f32>) -> vec3<f32> {
    let facing = min(dot(dir, normal), -0.05);
    return distance * (dir_change - dir * (dot(dir_change, normal) / facing));
}

/// Share of snow on a slope: 1 on the flat, 0 on steep rock, with the border moved by `k * noise`.
/// `edge0` moves, and is kept 0.01 below `edge1`.
///
/// domain  normal_y in [0, 1] 1 lin
/// domain  noise in [-2, 2] 1 lin
/// domain  edge0 in [0, 0.5] 1 lin
/// domain  edge1 in [0.5, 1] 1 lin
/// domain  k in [0, 1] 1 lin
/// range   [0, 1] 1
/// error   1e-5 abs of reference::terrain::snow_blend
/// monotone normal_y
/// source  Leitner2022 ch. 5.4; slope read as 1 - normal_y, share of rock turned into share of snow
fn snow_blend(normal_y: f32, noise: f32, edge0: f32, edge1: f32, k: f32) -> f32 {
    let start = min(edge0 + k * noise, edge1 - 0.01);
    let x = clamp((1.0 - normal_y - start) / (edge1 - start), 0.0, 1.0);
    return 1.0 - x * x * (3.0 - 2.0 * x);
}
