//! Light along given rays: the textbook march on the device against quadrature in f64 (rows A08 to A12 and A19: those of
//! Afra's checklist).

use crate::accuracy::{bits, direction, log_between, rows, toward};
use crate::common::{Random, evaluator, gpu};
use veduta::Atmosphere;
use veduta::atmosphere::probe::{Orders, Path, Probe, ProbeOptions, ProbeRay, ProbeResult};
use veduta::atmosphere::{AirRay, Layer, Phase, Profile};
use veduta::reference::atmosphere::Atmosphere as TwoLayers;
use veduta::reference::parallel::parallel_map;
use veduta::reference::sky::{Sky, SkyRadiance, SkyRay};
use veduta::reference::{air_ray, math};

const RADIUS: f64 = 6_360_000.0;
const TOP: f64 = 100_000.0;

fn options(steps: u32, light_steps: u32) -> ProbeOptions {
    ProbeOptions {
        path: Path::Textbook,
        orders: Orders::Single,
        steps,
        light_steps,
    }
}

fn probe(air: &Atmosphere, steps: u32, light_steps: u32, rays: &[ProbeRay]) -> Vec<ProbeResult> {
    let gpu = gpu();
    Probe::new(
        &gpu.device,
        veduta::programs(),
        air,
        &options(steps, light_steps),
    )
    .and_then(|p| p.run(&gpu.device, &gpu.queue, rays))
    .unwrap()
}

fn named(name: &str) -> Atmosphere {
    Atmosphere::named(name).unwrap()
}

/// The air of `thesis` and `hazy` as the quadrature has it.
fn sky_of(name: &str) -> Sky {
    let mie = match name {
        "thesis" => 2e-6,
        "hazy" => 21e-6,
        other => panic!("{other}"),
    };
    Sky {
        air: TwoLayers {
            mie_scattering: mie,
            mie_extinction: 1.11 * mie,
            ..TwoLayers::default()
        },
        ozone: None,
        ground_albedo: [0.0; 3],
    }
}

fn truth(sky: &Sky, rays: &[ProbeRay]) -> Vec<SkyRadiance> {
    parallel_map(rays.len(), |i| {
        let ray = &rays[i];
        sky.single_scatter(
            &SkyRay {
                eye_altitude: ray.altitude,
                dir: ray.dir,
                to_sun: ray.to_sun,
                distance: ray.distance,
            },
            1e-7,
        )
    })
}

fn uniform(random: &mut Random, low: f64, high: f64) -> f64 {
    low + (high - low) * (random.bits() >> 11) as f64 / (1_u64 << 53) as f64
}

fn heading(elevation: f64, azimuth: f64) -> [f64; 3] {
    let (e, a) = (elevation, azimuth);
    [e.cos() * a.cos(), e.sin(), e.cos() * a.sin()]
}

/// Rays of the kinds that the bars are about: heights from 0 to 36,000 km, sun zenith 0 to 96 degrees, directions all over,
/// about the horizon and across the limb, ends near and far.
fn mixed_rays(count: usize, seed: u64) -> Vec<ProbeRay> {
    let random = &mut Random(seed);
    let near_top = [
        TOP,
        f64::from((TOP as f32).next_up()),
        f64::from((TOP as f32).next_down()),
        TOP.next_up(),
        TOP.next_down(),
    ];
    let exact: Vec<f64> = [0.0, 1.7, 2.0, 3.6e7].into_iter().chain(near_top).collect();
    (0..count)
        .map(|i| {
            let altitude = if i % 4 == 0 {
                exact[(i / 4) % exact.len()]
            } else {
                2.0 * (uniform(random, 0.0, (3.6e7_f64 / 2.0).ln())).exp()
            };
            let r = RADIUS + altitude;
            let turn = std::f64::consts::TAU;
            let azimuth = uniform(random, 0.0, turn);
            // The elevation of the line that touches the sphere of an altitude; of the horizon, for those inside.
            let touching = |level: f64| -((RADIUS + level) / r).min(1.0).acos();
            let elevation = match i % 5 {
                0 | 1 if altitude <= TOP => uniform(random, -1.0, 1.0).asin(),
                0 | 1 => {
                    let least = touching(TOP);
                    (-uniform(random, (-least).sin(), 1.0)).asin()
                }
                2 => touching(0.0) + uniform(random, -0.05, 0.05).to_radians(),
                3 => touching(uniform(random, 0.0, TOP)),
                _ => {
                    touching(if i % 2 == 0 { 0.0 } else { TOP })
                        + uniform(random, -2.0, 2.0).to_radians()
                }
            };
            let zenith = uniform(random, 0.0, 96.0).to_radians();
            let to_sun = heading(
                std::f64::consts::FRAC_PI_2 - zenith,
                azimuth + uniform(random, 0.0, turn),
            );
            let dir = heading(elevation, azimuth);
            let distance = if i % 3 == 0 {
                let near = f64::from(
                    AirRay::new(
                        RADIUS,
                        TOP,
                        &ProbeRay {
                            altitude,
                            dir,
                            to_sun,
                            distance: f64::INFINITY,
                        },
                    )
                    .from_eye,
                );
                near + 10.0 * uniform(random, 0.0, 1e5_f64.ln()).exp()
            } else {
                f64::INFINITY
            };
            ProbeRay {
                altitude,
                dir,
                to_sun,
                distance,
            }
        })
        .collect()
}

/// Errors of all channels, relative to the truth or to `floor`, with their rays; the smallest first.
fn errors(
    found: &[ProbeResult],
    truth: &[SkyRadiance],
    floor: f64,
    part: fn(&ProbeResult, &SkyRadiance, usize) -> (f64, f64),
) -> Vec<(f64, usize)> {
    let mut all: Vec<(f64, usize)> = (0..3 * found.len())
        .map(|k| {
            let (f, t) = part(&found[k / 3], &truth[k / 3], k % 3);
            assert!(f.is_finite(), "ray {}", k / 3);
            ((f - t).abs() / t.abs().max(floor), k / 3)
        })
        .collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all
}

fn light(found: &ProbeResult, truth: &SkyRadiance, c: usize) -> (f64, f64) {
    (f64::from(found.in_scatter[c]), truth.in_scatter[c])
}

fn left(found: &ProbeResult, truth: &SkyRadiance, c: usize) -> (f64, f64) {
    (f64::from(found.transmittance[c]), truth.transmittance[c])
}

fn centile(all: &[(f64, usize)], share: f64) -> f64 {
    all[((all.len() - 1) as f64 * share) as usize].0
}

/// Median, 99th centile and the worst.
fn shown(all: &[(f64, usize)]) -> String {
    let parts = [0.5, 0.99, 1.0].map(|share| format!("{:.1e}", centile(all, share)));
    parts.join(" ")
}

#[test]
fn the_textbook_path_meets_quadrature_from_the_beach_to_orbit() {
    for (name, seed) in [("thesis", 1), ("hazy", 2)] {
        let rays = mixed_rays(3000, seed);
        let clock = std::time::Instant::now();
        let truth = truth(&sky_of(name), &rays);
        println!(
            "{name}: {} rays by quadrature in {:?}",
            rays.len(),
            clock.elapsed()
        );
        for (steps, light_steps) in [(24, 8), (48, 16), (96, 24), (192, 48)] {
            let clock = std::time::Instant::now();
            let found = probe(&named(name), steps, light_steps, &rays);
            let took = clock.elapsed();
            let radiance = errors(&found, &truth, 1e-6, light);
            let transmittance = errors(&found, &truth, 1e-6, left);
            println!(
                "{name} {steps}/{light_steps}: in-scatter {}, transmittance {} (median, 99 %, worst), {took:?}",
                shown(&radiance),
                shown(&transmittance),
            );
            for (error, at) in radiance.iter().rev().step_by(7).take(3) {
                println!(
                    "    {error:.2e} {:?} {:?} {:?}",
                    rays[*at], found[*at], truth[*at].in_scatter
                );
            }
            if steps >= 96 {
                assert!(centile(&radiance, 0.5) <= 5e-4);
                assert!(centile(&radiance, 0.99) <= 1e-2);
            }
        }
    }
}
