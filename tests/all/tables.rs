//! The tables of air and sky: their mappings, what they hold against quadrature and paths in f64, and what is made anew when
//! (row A07: that of Afra's checklist).

use crate::common::{Random, gpu};
use veduta::atmosphere::{
    AirRay, Eye, FastProbe, Orders, ProbeLight, ProbeRay, SkyQuality, SkyTables,
};
use veduta::reference::probe::{Effort, Probed, probe};
use veduta::reference::{air_tables, medium};
use veduta::{Atmosphere, Preset, Settings};

const FAR: f64 = f64::INFINITY;

fn named(name: &str) -> Atmosphere {
    Atmosphere::named(name).unwrap()
}

fn quality(preset: Preset) -> SkyQuality {
    let mut q = SkyQuality::of(&Settings::resolve(veduta::programs(), &preset, None, &[]).unwrap());
    for (k, v) in std::env::vars() {
        let n: Vec<u32> = v.split(',').filter_map(|p| p.parse().ok()).collect();
        match k.as_str() {
            "Q_SKY" => q.sky = [n[0], n[1]], "Q_AERIAL" => q.aerial = [n[0], n[1]], "Q_SLICES" => q.aerial_slices = n[0],
            "Q_COLUMNS" => q.columns = [n[0], n[1]], "Q_STEPS" => q.sky_steps = n[0], "Q_ASTEPS" => q.aerial_steps = n[0], "Q_DIFFUSE" => q.diffuse = [n[0], n[1]], _ => {}
        }
    }
    q
}

fn set() -> &'static veduta::ProgramSet {
    static SET: std::sync::OnceLock<veduta::ProgramSet> = std::sync::OnceLock::new();
    if std::env::var("LIVE").is_err() { return veduta::programs(); }
    SET.get_or_init(|| {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let source = veduta::compose::Source::read(&[&folder.join("wgsl"), &folder.join("presets")]).unwrap();
        let mut set = veduta::programs().clone();
        set.programs.to_mut().retain(|p| !(p.program.starts_with("sky") || p.program.starts_with("air")));
        for p in ["air_columns", "air_diffuse", "sky_view", "sky_aerial", "sky_probe"] { set.get_or_compose(&source, p, &[]).unwrap(); }
        set
    })
}

fn fast(air: &Atmosphere, quality: &SkyQuality, rays: &[ProbeRay]) -> Vec<ProbeLight> {
    let gpu = gpu();
    FastProbe::new(&gpu.device, set(), air, quality, 0)
        .and_then(|mut p| p.run(&gpu.device, &gpu.queue, rays))
        .unwrap()
}

fn truth(air: &Atmosphere, rays: &[ProbeRay], orders: Orders, samples: usize) -> Vec<Probed> {
    let effort = Effort {
        tolerance: 1e-6,
        samples,
        seed: 1,
    };
    probe(air, rays, orders, &effort).unwrap()
}

fn uniform(random: &mut Random, low: f64, high: f64) -> f64 {
    low + (high - low) * (random.bits() >> 11) as f64 / (1_u64 << 53) as f64
}

fn heading(elevation: f64, azimuth: f64) -> [f64; 3] {
    let (e, a) = (elevation, azimuth);
    [e.cos() * a.cos(), e.sin(), e.cos() * a.sin()]
}

/// Elevation of the line from an altitude that touches the sphere of another, or of the horizontal.
fn touching(air: &Atmosphere, altitude: f64, level: f64) -> f64 {
    let ratio = (air.planet_radius + level) / (air.planet_radius + altitude);
    -ratio.min(1.0).acos()
}

/// Rays of eyes at heights from 2 m to 36,000 km under the sun at zenith angles from 0 to 96 degrees: all over, about the
/// horizon, and across the limb.
fn rays_of_eyes(air: &Atmosphere, eyes: usize, each: usize, seed: u64) -> Vec<ProbeRay> {
    let random = &mut Random(seed);
    let mut rays = Vec::new();
    for _ in 0..eyes {
        let altitude = 2.0 * uniform(random, 0.0, 1.8e7_f64.ln()).exp();
        let sun = std::f64::consts::FRAC_PI_2 - uniform(random, 0.0, 96.0).to_radians();
        for i in 0..each {
            let level = |h| touching(air, altitude, h);
            let elevation = match i % 4 {
                0 | 1 if altitude <= air.thickness => uniform(random, -1.0, 1.0).asin(),
                0 | 1 => -uniform(random, (-level(air.thickness)).sin(), 1.0).asin(),
                2 => level(0.0) + uniform(random, -3.0, 3.0).to_radians(),
                _ => level(uniform(random, 0.0, air.thickness)),
            };
            rays.push(ProbeRay {
                altitude,
                dir: heading(elevation, uniform(random, 0.0, std::f64::consts::TAU)),
                to_sun: heading(sun, 0.0),
                distance: FAR,
            });
        }
    }
    rays
}

/// Errors of all channels over the truth or a floor, less `spread` standard errors of the truth, with their rays; the
/// smallest first.
fn errors(
    found: &[ProbeLight],
    truth: &[Probed],
    floor: f64,
    spread: f64,
    part: fn(&ProbeLight, &Probed, usize) -> (f64, f64, f64),
) -> Vec<(f64, usize)> {
    let mut all: Vec<(f64, usize)> = (0..3 * found.len())
        .map(|k| {
            let (f, t, error) = part(&found[k / 3], &truth[k / 3], k % 3);
            assert!(f.is_finite(), "ray {}", k / 3);
            let off = ((f - t).abs() - spread * error).max(0.0);
            (off / t.abs().max(floor), k / 3)
        })
        .collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all
}

fn light(found: &ProbeLight, truth: &Probed, c: usize) -> (f64, f64, f64) {
    let found = f64::from(found.in_scatter[c]);
    (found, truth.in_scatter[c], truth.error[c])
}

fn left(found: &ProbeLight, truth: &Probed, c: usize) -> (f64, f64, f64) {
    (f64::from(found.transmittance[c]), truth.transmittance[c], 0.0)
}

fn centile(all: &[(f64, usize)], share: f64) -> f64 {
    all[((all.len() - 1) as f64 * share) as usize].0
}

/// Median, 95th and 99th centile and the worst.
fn shown(all: &[(f64, usize)]) -> String {
    let parts = [0.5, 0.95, 0.99, 1.0].map(|share| format!("{:.2}", 100.0 * centile(all, share)));
    format!("{} % (median, 95, 99, worst)", parts.join(" "))
}

/// A ray in words.
fn told(air: &Atmosphere, ray: &ProbeRay) -> String {
    let elevation = ray.dir[1].atan2(ray.dir[0].hypot(ray.dir[2])).to_degrees();
    let r = air.planet_radius + ray.altitude;
    let tangent = r * ray.dir[0].hypot(ray.dir[2]) - air.planet_radius;
    let azimuth = ray.dir[2].atan2(ray.dir[0]).to_degrees();
    let made = AirRay::new(air.planet_radius, air.thickness, ray);
    format!(
        "h {:.4e} elevation {elevation:.4} (horizon {:.4}, lowest {tangent:.0} m) azimuth {azimuth:.1} sun {:.3} distance {:.2e} sun at entry {:.3} length {:.3e} dark {:.3e} {:.3e} nu {:.4}",
        ray.altitude,
        touching(air, ray.altitude, 0.0).to_degrees(),
        ray.to_sun[1].asin().to_degrees(),
        ray.distance,
        f64::from(made.sun_mu).asin().to_degrees(),
        made.length, made.dark_from, made.dark_to, made.nu
    )
}

#[test]
fn single_scattering_from_tables_meets_quadrature() {
    let eyes = std::env::var("EYES").map_or(40, |v| v.parse().unwrap());
    let show = std::env::var("SHOW").map_or(0, |v| v.parse().unwrap());
    let presets = if std::env::var("HIGH").is_ok() { vec![Preset::High] } else { vec![Preset::High, Preset::Medium, Preset::Low] };
    for (name, seed) in [("earth", 1), ("thesis", 2), ("hazy", 3)] {
        let air = named(name);
        let rays = rays_of_eyes(&air, eyes, 40, seed);
        let start = std::time::Instant::now();
        let truth = truth(&air, &rays, Orders::Single, 0);
        println!("truth {:.1} s", start.elapsed().as_secs_f64());
        for preset in presets.clone() {
            let quality = SkyQuality {
                all_orders: false,
                ..quality(preset.clone())
            };
            let start = std::time::Instant::now();
            let found = fast(&air, &quality, &rays);
            println!("fast {:.1} s", start.elapsed().as_secs_f64());
            let light = errors(&found, &truth, 1e-6, 0.0, light);
            let left = errors(&found, &truth, 1e-6, 0.0, left);
            println!("{name} {preset:?}: in-scatter {}, transmittance {}", shown(&light), shown(&left));
            for class in ["inside above", "inside below", "outside limb", "outside globe"] {
                let of = |k: usize| {
                    let ray = &rays[k];
                    let below = ray.dir[1].atan2(ray.dir[0].hypot(ray.dir[2])) < touching(&air, ray.altitude, 0.0);
                    match (ray.altitude > air.thickness, below) { (false, false) => "inside above", (false, true) => "inside below", (true, false) => "outside limb", _ => "outside globe" }
                };
                let part: Vec<_> = light.iter().copied().filter(|(_, k)| of(*k) == class).collect();
                let depth: Vec<_> = left.iter().copied().filter(|(_, k)| of(*k) == class).collect();
                println!("    {class}: {} ; {}", shown(&part), shown(&depth));
            }
            let one = std::env::var("CLASS").unwrap_or_default();
            for (off, k) in light.iter().rev().filter(|(_, k)| one.is_empty() || (rays[*k].altitude > air.thickness) == (one == "out")).take(show) {
                println!("   {:.1} % {:?} {:.2e} {:.2e}", 100.0 * off, told(&air, &rays[*k]), found[*k].in_scatter[1], truth[*k].in_scatter[1]);
            }
        }
    }
}

fn f16(bits: [u8; 2]) -> f64 {
    let bits = u16::from_le_bytes(bits);
    let (exponent, digits) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023));
    let size = match exponent {
        0 => digits * 2_f64.powi(-24),
        _ => (1.0 + digits / 1024.0) * 2_f64.powi(exponent - 15),
    };
    if bits >> 15 == 1 { -size } else { size }
}

fn prepare(tables: &mut SkyTables, eye: &Eye) -> veduta::Work {
    let gpu = gpu();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let work = tables.prepare(&gpu.queue, &mut encoder, eye).unwrap();
    gpu.queue.submit([encoder.finish()]);
    work
}

fn tables_of(air: &Atmosphere, quality: &SkyQuality) -> SkyTables {
    SkyTables::new(&gpu().device, set(), air, quality).unwrap()
}

const NOON: Eye = Eye {
    altitude: 2.0,
    to_sun: [0.6, 0.8, 0.0],
    sun_angular_radius: 0.004652,
};

#[test]
fn row_a07_the_table_of_columns_is_right_at_every_height_and_angle() {
    for name in ["earth", "thesis", "hazy", "mars"] {
        let air = named(name);
        let (radius, top) = (air.planet_radius, air.thickness);
        let quality = quality(Preset::High);
        let mut tables = tables_of(&air, &quality);
        let _ = prepare(&mut tables, &NOON);
        let data = gpu().read_texture(tables.columns().texture()).unwrap();
        let size = quality.columns.map(|n| n as usize);
        let texel = |x: usize, y: usize, lane: usize| {
            let at = 8 * (y * size[0] + x) + 2 * lane;
            f16([data[at], data[at + 1]])
        };
        // The table as `sun_depth` reads it, interpolated by hand.
        let by_hand = |h: f64, mu: f64| -> [f64; 8] {
            let at = air_tables::column_coordinates(radius, top, h, mu);
            let place: [f64; 2] = std::array::from_fn(|k| at[k] * (size[k] - 1) as f64);
            let low = [0, 1].map(|k| (place[k] as usize).min(size[k] - 2));
            let share: [f64; 2] = std::array::from_fn(|k| place[k] - low[k] as f64);
            let scale = air_tables::column_scale(&air, h, mu);
            std::array::from_fn(|lane| {
                if lane >= 4 {
                    return 0.0;
                }
                let row = |y| {
                    let [a, b] = [0, 1].map(|x| texel(low[0] + x, y, lane));
                    a + (b - a) * share[0]
                };
                let [a, b] = [row(low[1]), row(low[1] + 1)];
                (a + (b - a) * share[1]) * scale[lane] * top
            })
        };
        let random = &mut Random(7);
        let mut rays = Vec::new();
        for i in 0..4000 {
            let h = match i % 3 {
                0 => top * uniform(random, 0.0, 1.0).powi(2),
                1 => uniform(random, 0.0, top),
                _ => top * uniform(random, 0.0, 1.0).powi(4),
            };
            let horizon = touching(&air, h, 0.0);
            let above = uniform(random, 0.0, 1.0).powi(if i % 2 == 0 { 1 } else { 4 });
            let elevation = horizon + (std::f64::consts::FRAC_PI_2 - horizon) * above;
            rays.push(ProbeRay {
                altitude: h,
                dir: heading(elevation, 0.0),
                to_sun: [0.0, 1.0, 0.0],
                distance: FAR,
            });
        }
        let truth: Vec<[f64; 3]> = rays
            .iter()
            .map(|r| air_tables::sun_depth(&air, r.altitude, r.dir[1]))
            .collect();
        let mut off: Vec<(f64, usize)> = Vec::new();
        for (k, ray) in rays.iter().enumerate() {
            let found = medium::air_extinction(&air, by_hand(ray.altitude, ray.dir[1]));
            for c in 0..3 {
                let floor = std::env::var("FLOOR").map_or(1e-3, |v| v.parse().unwrap());
                off.push(((found[c] - truth[k][c]).abs() / truth[k][c].max(floor), k));
            }
        }
        off.sort_by(|a, b| a.0.total_cmp(&b.0));
        println!("{name}: columns {} by hand", shown(&off));
        for (e, k) in off.iter().rev().take(12).step_by(3) {
            println!("   {:.2} % {}", 100.0 * e, told(&air, &rays[*k]));
        }
        // The same table as the device filters it, of up to a hundred eyes.
        let some: Vec<ProbeRay> = rays.iter().step_by(40).copied().collect();
        let filtered = fast(&air, &quality, &some);
        let mut worst = 0.0_f64;
        for (ray, found) in some.iter().zip(&filtered) {
            let depth = medium::air_extinction(&air, by_hand(ray.altitude, ray.dir[1]));
            for c in 0..3 {
                worst = worst.max((f64::from(found.transmittance[c]) - (-depth[c]).exp()).abs());
            }
        }
        println!("{name}: filtered by the device and by hand: {worst:.1e} of the transmittance");
        assert!(worst < 1e-3, "{worst:e}");
    }
}

/// Distances from 0.1 to 100 km from eyes in the lower air and above.
#[test]
fn air_before_things_meets_quadrature() {
    for (name, seed) in [("earth", 4), ("hazy", 5)] {
        let air = named(name);
        let random = &mut Random(seed);
        let mut rays = Vec::new();
        for eye in 0..24 {
            let altitude = [2.0, 30.0, 500.0, 3000.0, 12_000.0, 40_000.0][eye % 6];
            let sun = uniform(random, -4.0, 90.0).to_radians();
            for i in 0..40 {
                let horizon = touching(&air, altitude, 0.0);
                let elevation = match i % 3 {
                    0 => uniform(random, -1.0, 1.0).asin(),
                    1 => horizon + uniform(random, -3.0, 3.0).to_radians(),
                    _ => -uniform(random, 0.0, 1.0).powi(2).asin(),
                };
                rays.push(ProbeRay {
                    altitude,
                    dir: heading(elevation, uniform(random, 0.0, std::f64::consts::TAU)),
                    to_sun: heading(sun, 0.0),
                    distance: 100.0 * (1000_f64.ln() * uniform(random, 0.0, 1.0)).exp(),
                });
            }
        }
        let truth = truth(&air, &rays, Orders::Single, 0);
        for preset in [Preset::High, Preset::Medium, Preset::Low] {
            let quality = SkyQuality { all_orders: false, ..quality(preset.clone()) };
            let found = fast(&air, &quality, &rays);
            let light = errors(&found, &truth, 1e-6, 0.0, light);
            let left = errors(&found, &truth, 1e-6, 0.0, left);
            println!("{name} {preset:?}: in-scatter {}, transmittance {}", shown(&light), shown(&left));
            if preset == Preset::High && std::env::var("SHOW").is_ok() {
                for list in [&light, &left] {
                    for (off, k) in list.iter().rev().skip(list.len() / 40).take(12) {
                        println!("   {:.1} % {:?}", 100.0 * off, told(&air, &rays[*k]));
                    }
                }
            }
        }
    }
}

/// Rays of an eye on the ground all over the sky.
fn ground_rays(zeniths: &[f64], each: usize, seed: u64) -> Vec<ProbeRay> {
    let random = &mut Random(seed);
    let mut rays = Vec::new();
    for zenith in zeniths {
        let sun = (90.0 - zenith).to_radians();
        for i in 0..each {
            let elevation = if i % 4 == 3 {
                uniform(random, 0.0, 5.0).to_radians()
            } else {
                uniform(random, 0.0, 1.0).asin()
            };
            rays.push(ProbeRay {
                altitude: 2.0,
                dir: heading(elevation, uniform(random, 0.0, std::f64::consts::TAU)),
                to_sun: heading(sun, 0.0),
                distance: FAR,
            });
        }
    }
    rays
}

#[test]
fn all_orders_from_tables_meet_paths() {
    let samples = std::env::var("SAMPLES").map_or(3000, |v| v.parse().unwrap());
    let each = std::env::var("EACH").map_or(6, |v| v.parse().unwrap());
    for albedo in [0.0, 0.3] {
        let air = Atmosphere { ground_albedo: [albedo; 3], ..named("earth") };
        for (zeniths, bar) in [
            (&[0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 75.0, 80.0][..], 0.04),
            (&[88.0, 90.0], 0.08),
            (&[93.0], 0.12),
        ] {
            let rays = ground_rays(zeniths, each, 8);
            let start = std::time::Instant::now();
            let truth = truth(&air, &rays, Orders::All, samples);
            let own: Vec<f64> = truth.iter().map(|t| t.error[1] / t.in_scatter[1]).collect();
            println!("{:.1} s, mean standard error {:.2} %", start.elapsed().as_secs_f64(), 100.0 * own.iter().sum::<f64>() / own.len() as f64);
            for preset in [Preset::High, Preset::Medium, Preset::Low] {
                let found = fast(&air, &quality(preset.clone()), &rays);
                let all = errors(&found, &truth, 1e-6, 0.0, light);
                println!("albedo {albedo} sun {zeniths:?} {preset:?}: {} (bar {bar})", shown(&all));
                let mut signed = [0.0; 3];
                for (f, t) in found.iter().zip(&truth) {
                    for c in 0..3 { signed[c] += 100.0 * (f64::from(f.in_scatter[c]) / t.in_scatter[c] - 1.0) / found.len() as f64; }
                }
                println!("     mean {signed:.2?} %");
            }
        }
    }
}

#[test]
fn twilight_falls_with_every_tenth_of_a_degree() {
    let air = named("earth");
    let rays: Vec<ProbeRay> = (0..=120)
        .flat_map(|i| {
            let sun = (-6.0 - 0.1 * f64::from(i)).to_radians();
            [90.0, 0.5].map(|elevation: f64| ProbeRay {
                altitude: 2.0,
                dir: heading(elevation.to_radians(), 0.0),
                to_sun: heading(sun, 0.0),
                distance: FAR,
            })
        })
        .collect();
    let found = fast(&air, &quality(Preset::High), &rays);
    for which in 0..2 {
        for i in 1..=120 {
            for c in 0..3 {
                let (before, after) = (found[2 * i - 2 + which].in_scatter[c], found[2 * i + which].in_scatter[c]);
                assert!(after < before && after > 0.0, "{which} {i} {c}: {before:e} {after:e}");
            }
        }
    }
    let samples = std::env::var("SAMPLES").map_or(20_000, |v| v.parse().unwrap());
    for i in [0, 20, 40, 60, 120] {
        let some = [rays[2 * i], rays[2 * i + 1]];
        let start = std::time::Instant::now();
        let truth = truth(&air, &some, Orders::All, samples);
        for (k, t) in truth.iter().enumerate() {
            println!("sun {:.1} {}: {:?} of {:.3?}, +- {:.1?} % ({:.1} s)", -6.0 - 0.1 * i as f64, ["zenith", "horizon"][k],
                [0, 1, 2].map(|c| (100.0 * (f64::from(found[2 * i + k].in_scatter[c]) / t.in_scatter[c] - 1.0)).round()), t.in_scatter.map(|l| 1e9 * l),
                [0, 1, 2].map(|c| 100.0 * t.error[c] / t.in_scatter[c]), start.elapsed().as_secs_f64());
        }
    }
}

#[test]
fn no_eye_is_too_low_or_too_high_for_the_tables() {
    let air = named("earth");
    let top = air.thickness;
    let one = |x: f32| f64::from(x);
    let heights = [0.0, 1.7, one((top as f32).next_down()), top, one((top as f32).next_up()), 1e8];
    let mut rays = Vec::new();
    for altitude in heights {
        for sun in [-90.0, -18.0, -6.0, -1e-6, 0.0, 30.0, 90.0_f64] {
            for elevation in [-90.0, -89.999, -86.4, -45.0, -10.0, -1e-3, -1e-9, 0.0, 1e-9, 1e-3, 45.0, 90.0_f64] {
                for azimuth in [0.0, 90.0, 180.0_f64] {
                    for distance in [1.0, 1e5, FAR] {
                        rays.push(ProbeRay {
                            altitude,
                            dir: heading(elevation.to_radians(), azimuth.to_radians()),
                            to_sun: heading(sun.to_radians(), 0.0),
                            distance,
                        });
                    }
                }
            }
        }
    }
    for all_orders in [false, true] {
        let quality = SkyQuality { all_orders, ..quality(Preset::Low) };
        for (found, ray) in fast(&air, &quality, &rays).iter().zip(&rays) {
            let fine = found.in_scatter.iter().all(|v| v.is_finite() && *v >= 0.0)
                && found.transmittance.iter().all(|v| (0.0..=1.0).contains(v));
            assert!(fine, "{ray:?}: {found:?}");
            let made = AirRay::new(air.planet_radius, top, ray);
            let tangent = (air.planet_radius + ray.altitude) * ray.dir[0].hypot(ray.dir[2]) - air.planet_radius;
            if ray.altitude > top && (made.length == 0.0 && (tangent - top).abs() > 10.0 || ray.distance < ray.altitude - top) {
                assert_eq!((found.in_scatter, found.transmittance), ([0.0; 3], [1.0; 3]), "{ray:?}");
            }
        }
    }
}

#[test]
fn only_what_has_changed_is_made_anew() {
    let earth = named("earth");
    let quality = SkyQuality::of(&Settings::resolve(veduta::programs(), &Preset::Low, None, &[]).unwrap());
    let mut tables = tables_of(&earth, &quality);
    // Columns, three orders, sky, air before things.
    let first = prepare(&mut tables, &NOON);
    assert_eq!((first.bakes, first.writes), (6, 2));
    assert_eq!(prepare(&mut tables, &NOON), veduta::Work::default());
    let turned = Eye { to_sun: [0.0, 0.8, -0.6], ..NOON };
    let work = prepare(&mut tables, &turned);
    assert_eq!((work.bakes, work.writes), (0, 1));
    // An eye has no place but its altitude.
    assert_eq!(prepare(&mut tables, &turned), veduta::Work::default());
    let sunk = Eye { to_sun: [0.8, 0.6, 0.0], ..NOON };
    assert_eq!(prepare(&mut tables, &sunk).bakes, 2);
    let risen = Eye { altitude: 3.0, ..sunk };
    assert_eq!(prepare(&mut tables, &risen).bakes, 2);
    let larger = Eye { sun_angular_radius: 0.01, ..risen };
    assert_eq!(prepare(&mut tables, &larger).bakes, 2);
    // All but the columns.
    let mut air = Atmosphere { ground_albedo: [0.1; 3], ..earth.clone() };
    tables.set_atmosphere(&air).unwrap();
    assert_eq!(prepare(&mut tables, &larger).bakes, 5);
    air.layers[0].scattering[1] *= 2.0;
    air.layers[2].absorption[0] *= 2.0;
    tables.set_atmosphere(&air).unwrap();
    assert_eq!(prepare(&mut tables, &larger).bakes, 5);
    air.layers[1].profile = veduta::atmosphere::Profile::Exponential { scale_height: 1300.0 };
    tables.set_atmosphere(&air).unwrap();
    assert_eq!(prepare(&mut tables, &larger).bakes, 6);
    tables.set_atmosphere(&air).unwrap();
    assert_eq!(prepare(&mut tables, &larger), veduta::Work::default());
    // Without light of higher orders its table is never made.
    let single = SkyQuality { all_orders: false, ..quality };
    assert_eq!(prepare(&mut tables_of(&earth, &single), &NOON).bakes, 3);
}
