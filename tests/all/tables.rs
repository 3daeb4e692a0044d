//! The tables of air and sky: their mappings, what they hold against quadrature and paths in f64, and what is made anew when
//! (row A07: that of Afra's checklist).

use crate::common::{Random, evaluator, gpu};
use veduta::atmosphere::{
    AirRay, Eye, FastProbe, Orders, ProbeLight, ProbeRay, SkyQuality, SkyTables,
};
use veduta::reference::probe::{Effort, Probed, probe};
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
