//! Height fields on a ball, filtered by the footprint: noise in 3D, on an integer lattice, of the direction from the planet's centre times its radius.
//!
//! Nothing is mapped on the ball: what lies at a place is the noise at the place on the ball of the planet's radius below or above it. The eye's is a cell and a fraction
//! that the host finds in double precision; from there a place follows without the difference of large numbers. The filter is that of
//! `veduta::terrain::field`, with the means and slopes of noise in 3D. A crater's middle is moved onto the ball; those that were farther from it than 0.45 cells
//! do not count, so that craters are spread over the ball evenly and are whole.
//!
//! source   Leitner2022 alg. 1 to 3; Musgrave2003 (hybrid and ridged multifractal); the ball and the filter: ours
//! symbols  at place relative to the eye, along the world's axes [m] · footprint width of what one sample stands for [m] · kind which field [1]
#define_import_path veduta::terrain::globe

#import veduta::noise::lattice::{Lattice3d, split_3d, finer_3d, shifted_3d, octave_seed}
#import veduta::noise::gradient::{gradient_at_3d_slope}
#import veduta::hash::lattice::{lattice_hash_3d}
#import veduta::fractal::ridged::{smooth_abs}
#import veduta::terrain::field::{FIELD_HYBRID, FIELD_RIDGED, FIELD_CRATERS}

/// A height field on a ball and where the eye is; the host makes it (`veduta::terrain::Globe`).
struct Globe {
    /// Lattice cell of the eye's direction times the radius, in units of the wavelength.
    cell: vec3<i32>,
    /// Wavelength of the lattice [m], > 0.
    wavelength: f32,
    /// Fraction within that cell, in [0, 1).
    frac: vec3<f32>,
    /// Height of a value of 1 [m].
    amplitude: f32,
    /// Unit vector from the centre to the eye.
    up: vec3<f32>,
    /// Height of a value of 0 [m].
    base: f32,
    /// Radius of the planet [m].
    ground_radius: f32,
    /// Altitude of the eye above that radius [m].
    eye_altitude: f32,
    /// What the amplitude falls by from octave to octave.
    fall: f32,
    /// Offset of the hybrid, gain of the ridged multifractal, share of cells with a crater.
    shape: f32,
    /// Rounding of the crests of the ridged multifractal; height of the noise between craters.
    detail: f32,
    /// Octaves.
    octaves: i32,
    /// Seed of the lattice.
    seed: u32,
    /// Height of the sea, below which there is no ground [m].
    sea: f32,
    /// The mean of what follows octave 0, as in `veduta::terrain::field`.
    mean: vec4<f32>,
    /// The same of the mean square of the slopes along the ball, per cell.
    lost: vec4<f32>,
    /// No ground is below [m].
    low: f32,
    /// No ground is above [m].
    high: f32,
    /// No slope is steeper.
    steepest: f32,
    /// No octave of a multifractal's or a sum's full weight adds more, per amplitude.
    tallest: f32,
    /// No slope of octave 0 is steeper, and by what that grows from octave to octave.
    steep: f32,
    steep_growth: f32,
}

/// The filtered field at a place.
struct GlobeGround {
    /// Height [m].
    height: f32,
    /// Change of the height along the ball of the planet's radius, along the world's axes.
    slope: vec3<f32>,
    /// Mean square of the slopes that the filter took off.
    lost: f32,
}

/// Altitude of a place.
///
/// internal
fn globe_altitude(globe: Globe, at: vec3<f32>) -> f32 {
    let r = globe.ground_radius + globe.eye_altitude;
    let q = dot(at, at) + 2.0 * r * dot(at, globe.up);
    return globe.eye_altitude + q / (r + sqrt(max(r * r + q, 0.0)));
}

/// Unit vector away from the centre.
///
/// internal
fn globe_up(globe: Globe, at: vec3<f32>) -> vec3<f32> {
    let outward = at + globe.up * (globe.ground_radius + globe.eye_altitude);
    return outward * inverseSqrt(max(dot(outward, outward), 1e-12));
}

/// How far a ray can go on, told by as few octaves as say so.
struct GlobeProbe {
    /// The field; not all of it when fewer octaves were enough.
    ground: GlobeGround,
    /// So far the ray stays clear [m].
    step: f32,
    /// The clearance is at least this [m].
    clear: f32,
}

/// Profile of one crater against the distance from its middle in radii, squared, and its slope over that square: a bowl, a rim, and ejecta that end at 1.5.
///
/// internal
fn ball_crater(x: f32, square: f32) -> vec2<f32> {
    let hollow = max(1.0 - square, 0.0);
    let inverse = select(2.0, 2.5, x < 1.0);
    let y = (x - 1.0) * inverse;
    let ring = max(1.0 - y * y, 0.0);
    let bowl = vec2<f32>(-0.4 * hollow * hollow, 0.8 * hollow);
    return bowl + vec2<f32>(0.08 * ring * ring, -0.16 * ring * y * inverse / max(x, 1e-4));
}

/// Craters of one lattice: value and slope per cell. Of a radius of 0.15 to 0.35 cells, in the middle half of their cells. `radius` is the planet's, in cells.
///
/// internal
fn crater_cells_3d(p: Lattice3d, up: vec3<f32>, radius: f32, share: f32, seed: u32) -> vec4<f32> {
    var sum = vec4<f32>(0.0);
    // No crater reaches farther than 0.72 cells from its middle, and that lies 0.25 within its cell: of three cells in a row the farthest has none.
    let low = select(vec3<i32>(-1), vec3<i32>(0), p.frac >= vec3<f32>(0.5));
    for (var k = 0; k < 8; k++) {
        let step = low + vec3<i32>(k & 1, (k >> 1u) & 1, k >> 2u);
        let words = lattice_hash_3d(p.cell + step, seed);
        let jitter = vec3<f32>(words & vec3<u32>(0xffffu)) * 7.62939453125e-6 + 0.25;
        let chance = f32(words.x >> 16u) * 1.52587890625e-5;
        let size = f32(words.y >> 16u) * 1.52587890625e-5;
        let crater = 0.15 + 0.2 * size * size;
        let way = vec3<f32>(step) + jitter - p.frac;
        // How far its middle lies above the ball, and where it comes to lie on it.
        let e = 2.0 * dot(up, way) + dot(way, way) / radius;
        let above = e / (1.0 + sqrt(max(1.0 + e / radius, 0.0)));
        let scale = radius / max(radius + above, 0.1);
        let away = (up * above - way) * (scale / crater);
        let square = dot(away, away);
        let profile = ball_crater(sqrt(square), square);
        let depth = clamp((0.45 - abs(above)) * 8.0, 0.0, 1.0);
        let there = select(0.0, crater * depth, chance < share);
        sum += there * vec4<f32>(profile.x, (profile.y * 2.0 / crater) * away);
    }
    return sum;
}

/// The sum of so many amplitudes.
///
/// internal
fn fall_sum(fall: f32, octaves: i32) -> f32 {
    var sum = 0.0;
    var amplitude = 1.0;
    for (var i = 0; i < octaves; i++) {
        sum += amplitude;
        amplitude *= fall;
    }
    return sum;
}

/// The octaves of the field at a place of the lattice, until a ray at an altitude, of which a share `rise` points up and `level` along the ground, is known to be clear for
/// `enough` metres.
///
/// internal
fn globe_octaves(globe: Globe, kind: i32, cell: vec3<i32>, frac: vec3<f32>, up: vec3<f32>, footprint: f32, altitude: f32, rise: f32, level: f32, enough: f32) -> GlobeProbe {
    var p = split_3d(cell, frac);
    var reach = globe.wavelength / max(footprint, 1e-6);
    var amplitude = 1.0;
    var frequency = 1.0;
    var weight = vec4<f32>(1.0, 0.0, 0.0, 0.0);
    var sum = vec4<f32>(0.0);
    var tail = globe.mean.x;
    var tail_step = globe.mean.y;
    var rough = globe.lost.x;
    var rough_step = globe.lost.y;
    var mean = vec4<f32>(tail, 0.0, 0.0, 0.0);
    var lost = rough;
    let last = fall_sum(globe.fall, globe.octaves);
    var before = 0.0;
    var steep = 0.0;
    var octave_steep = globe.steep;
    var best = 0.0;
    var clear = 0.0;
    for (var i = 0; i < globe.octaves; i++) {
        if reach <= 1.0 {
            break;
        }
        let x = min(reach - 1.0, 1.0);
        let keep = x * x * (3.0 - 2.0 * x);
        let seed = octave_seed(globe.seed, i);
        let q = shifted_3d(p, i);
        p = finer_3d(p);
        let n = gradient_at_3d_slope(q, seed);
        var term = vec4<f32>(n.x, frequency * n.yzw);
        if kind == FIELD_RIDGED {
            let size = smooth_abs(n.x, globe.detail);
            let ridge = 1.0 - size;
            let square = ridge * ridge;
            let off = -2.0 * ridge * (n.x / max(size, 1e-30)) * frequency;
            term = vec4<f32>(square * weight.x, off * weight.x * n.yzw + square * weight.yzw);
            let next = globe.shape * term;
            weight = select(next, vec4<f32>(1.0, 0.0, 0.0, 0.0), next.x >= 1.0);
            term *= amplitude;
        } else if kind == FIELD_HYBRID {
            // Kept apart as in `veduta::terrain::field`.
            let signal = amplitude * vec4<f32>(max(n.x, -8.0) + globe.shape, frequency * n.yzw);
            term = vec4<f32>(weight.x * signal.x, weight.x * signal.yzw + signal.x * weight.yzw);
            weight = select(term, vec4<f32>(1.0, 0.0, 0.0, 0.0), term.x >= 1.0);
        } else if kind == FIELD_CRATERS {
            let craters = crater_cells_3d(q, up, frequency * (globe.ground_radius / globe.wavelength), globe.shape, seed);
            let both = craters + globe.detail * n;
            term = amplitude * vec4<f32>(both.x, frequency * both.yzw);
        } else {
            term *= amplitude;
        }
        sum += term;
        // What the octaves so far leave clear below the ray, whatever the others are.
        before += amplitude;
        steep += octave_steep;
        octave_steep *= globe.steep_growth;
        let room = altitude - max(globe.base + globe.amplitude * (sum.x + globe.tallest * (last - before)), globe.sea);
        // A step that is long enough means a clearance of at least a quarter of it, on which shadows rely.
        let step = room / max(steep * level - rise, 0.25);
        clear = select(clear, room, step > best);
        best = max(best, step);
        if best >= enough {
            break;
        }
        if kind == FIELD_HYBRID {
            tail *= globe.mean.z;
            rough *= globe.lost.z;
        } else {
            tail -= tail_step;
            rough -= rough_step;
        }
        tail_step *= globe.mean.z;
        rough_step *= globe.lost.z;
        frequency *= 2.0;
        amplitude *= globe.fall;
        reach *= 0.5;
        let left = select(1.0, 0.0, i + 1 == globe.octaves);
        let rest = left * tail * (1.0 + globe.mean.w * (1.0 - weight.x));
        let slope = left * tail * (1.0 + globe.mean.w * (1.0 - 2.0 * weight.x));
        let after = sum + vec4<f32>(rest * weight.x, slope * weight.yzw);
        let after_lost = left * max(rough, 0.0) * weight.x * (1.0 + globe.lost.w * (1.0 - weight.x));
        mean = mean * (1.0 - keep) + after * keep;
        lost = max(after_lost + (1.0 - keep * keep) * (lost - after_lost), 0.0);
    }
    let steepness = globe.amplitude / globe.wavelength;
    let height = globe.base + globe.amplitude * mean.x;
    // Along the ball.
    let gradient = mean.yzw - up * dot(up, mean.yzw);
    let dry = height >= globe.sea;
    let ground = GlobeGround(
        max(height, globe.sea),
        select(vec3<f32>(0.0), steepness * gradient, dry),
        select(0.0, steepness * steepness * lost, dry),
    );
    return GlobeProbe(ground, best, clear);
}

/// The field at a place of the ball's lattice, where `up` is the way from the centre.
///
/// domain  kind in [0, 3] 1 lin
/// domain  cell in [-2147483648, 2147483647] cell lin
/// domain  frac in [0, 1] cell lin
/// domain  up in [-1, 1] 1 lin
/// domain  footprint in [1e-3, 1e5] m log
/// range   [-1e5, 1e5] 1
/// error   5e-3 abs of reference::globe::ground
/// outside undefined
/// source  Leitner2022 alg. 1 to 3; the filter and the ball: ours
fn globe_ground(globe: Globe, kind: i32, cell: vec3<i32>, frac: vec3<f32>, up: vec3<f32>, footprint: f32) -> GlobeGround {
    return globe_octaves(globe, kind, cell, frac, up, footprint, -1e30, 0.0, 1.0, 1e30).ground;
}

/// The place on the lattice below or above a place, from the eye's cell on.
///
/// internal
fn globe_frac(globe: Globe, at: vec3<f32>, altitude: f32) -> vec3<f32> {
    let share = globe.ground_radius / (globe.ground_radius + altitude);
    return globe.frac + (at + globe.up * (globe.eye_altitude - altitude)) * share / globe.wavelength;
}

/// The field below or above a place.
///
/// domain  kind in [0, 3] 1 lin
/// domain  at in [-2e5, 2e5] m lin
/// domain  footprint in [1e-3, 1e5] m log
/// range   [-1e5, 1e5] 1
/// error   0.2 abs of reference::globe::ground_from
/// outside undefined
/// source  the place on the ball from the eye's without a difference of radii: ours
fn globe_at(globe: Globe, kind: i32, at: vec3<f32>, footprint: f32) -> GlobeGround {
    return globe_ground(globe, kind, globe.cell, globe_frac(globe, at, globe_altitude(globe, at)), globe_up(globe, at), footprint);
}
