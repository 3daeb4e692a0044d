//! Light along given rays: the textbook march on the device against quadrature in f64 (rows A08 to A12 and A19: those of
//! Afra's checklist).

use crate::accuracy::{bits, log_between, rows};
use crate::common::{Random, centile, errors, evaluator, gpu, heading, left, light, named};
use veduta::Atmosphere;
use veduta::atmosphere::{
    AirRay, Layer, Phase, Probe, ProbeLight, ProbeOptions, ProbeRay, Profile,
};
use veduta::reference::parallel::parallel_map;
use veduta::reference::sky::{Sky, SkyRadiance, SkyRay};
use veduta::reference::{air_ray, math};

const RADIUS: f64 = 6_360_000.0;
const TOP: f64 = 100_000.0;

fn options(steps: u32, light_steps: u32) -> ProbeOptions {
    ProbeOptions {
        steps,
        light_steps,
        ..Default::default()
    }
}

fn probe(air: &Atmosphere, steps: u32, light_steps: u32, rays: &[ProbeRay]) -> Vec<ProbeLight> {
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

fn sky_of(name: &str) -> Sky {
    Sky::new(&named(name)).unwrap()
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
                2.0 * (random.uniform(0.0, (3.6e7_f64 / 2.0).ln())).exp()
            };
            let r = RADIUS + altitude;
            let turn = std::f64::consts::TAU;
            let azimuth = random.uniform(0.0, turn);
            // The elevation of the line that touches the sphere of an altitude; of the horizon, for those inside.
            let touching = |level: f64| -((RADIUS + level) / r).min(1.0).acos();
            let elevation = match i % 5 {
                0 | 1 if altitude <= TOP => random.uniform(-1.0, 1.0).asin(),
                0 | 1 => {
                    let least = touching(TOP);
                    (-random.uniform((-least).sin(), 1.0)).asin()
                }
                2 => touching(0.0) + random.uniform(-0.05, 0.05).to_radians(),
                3 => touching(random.uniform(0.0, TOP)),
                _ => {
                    touching(if i % 2 == 0 { 0.0 } else { TOP })
                        + random.uniform(-2.0, 2.0).to_radians()
                }
            };
            let zenith = random.uniform(0.0, 96.0).to_radians();
            let to_sun = heading(
                std::f64::consts::FRAC_PI_2 - zenith,
                azimuth + random.uniform(0.0, turn),
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
                near + 10.0 * random.uniform(0.0, 1e5_f64.ln()).exp()
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

/// Median, 99th centile and the worst.
fn shown(all: &[(f64, usize)]) -> String {
    let parts = [0.5, 0.99, 1.0].map(|share| format!("{:.1e}", centile(all, share)));
    parts.join(" ")
}

#[test]
fn the_textbook_path_meets_quadrature_from_the_beach_to_orbit() {
    for (name, seed) in [("thesis", 1), ("hazy", 2)] {
        let rays = mixed_rays(3000, seed);
        let truth = truth(&sky_of(name), &rays);
        for (steps, light_steps, bars) in [(24, 8, [5e-4, 1e-2]), (96, 24, [5e-6, 1e-4])] {
            let found = probe(&named(name), steps, light_steps, &rays);
            let radiance = errors(&found, &truth, 1e-6, light);
            let transmittance = errors(&found, &truth, 1e-6, left);
            println!(
                "{name} {steps}/{light_steps}: in-scatter {}, transmittance {} (median, 99 %, worst)",
                shown(&radiance),
                shown(&transmittance),
            );
            let (worst, at) = radiance[radiance.len() - 1];
            println!("    {worst:.1e} at {:?}", rays[at]);
            assert!(centile(&radiance, 0.5) <= bars[0]);
            assert!(centile(&radiance, 0.99) <= bars[1]);
            assert!(centile(&transmittance, 0.99) <= 1e-3);
        }
    }
}

fn ray(altitude: f64, elevation: f64, sun: [f64; 2], distance: f64) -> ProbeRay {
    ProbeRay {
        altitude,
        dir: heading(elevation.to_radians(), 0.0),
        to_sun: heading(sun[0].to_radians(), sun[1].to_radians()),
        distance,
    }
}

const FAR: f64 = f64::INFINITY;

#[test]
fn row_a08_what_lies_in_the_planets_shadow_is_black() {
    let air = named("hazy");
    // The shadow reaches the top of the air 10.1 degrees behind the terminator, and the horizon as far again.
    let deep: Vec<ProbeRay> = (0..180)
        .map(|i| ray([0.0, 2.0, 500.0][i % 3], i as f64, [-20.5, 5.0], FAR))
        .collect();
    for (found, ray) in probe(&air, 32, 8, &deep).iter().zip(&deep) {
        assert_eq!(found.in_scatter, [0.0; 3], "{ray:?}");
    }
    let dusk: Vec<ProbeRay> = (0..400)
        .map(|i| {
            let i = f64::from(i);
            ray(2.0, 0.45 * i, [-0.05 * i, 7.0 * i], FAR)
        })
        .collect();
    let truth = truth(&sky_of("hazy"), &dusk);
    let found = probe(&air, 96, 24, &dusk);
    let mut black = 0;
    for (found, truth) in found.iter().zip(&truth) {
        if truth.in_scatter == [0.0; 3] {
            black += 1;
            assert_eq!(found.in_scatter, [0.0; 3]);
        }
    }
    let all = errors(&found, &truth, 1e-6, light);
    println!("dusk: {} of {}, {black} rays black", shown(&all), all.len());
    assert!(black > 20 && centile(&all, 1.0) < 1e-3);
    // Far into the night, all directions from everywhere.
    let random = &mut Random(9);
    let night: Vec<ProbeRay> = (0..500)
        .map(|_| {
            let mut any = mixed_rays(1, random.bits())[0];
            any.altitude = any.altitude.min(1e4);
            any.to_sun = heading(
                -random.uniform(27.0, 90.0).to_radians(),
                random.uniform(0.0, 6.0),
            );
            any
        })
        .collect();
    let left_dark = probe(&air, 16, 4, &night);
    assert!(left_dark.iter().all(|f| f.in_scatter == [0.0; 3]));
}

/// Air of one density throughout.
fn uniform_air(scattering: f64, absorption: f64) -> Atmosphere {
    Atmosphere {
        planet_radius: 1e9,
        thickness: 1000.0,
        layers: vec![Layer {
            name: "grey".to_owned(),
            profile: Profile::Constant {
                bottom: -1e4,
                top: 1e4,
            },
            scattering: [scattering, 2.0 * scattering, 4.0 * scattering],
            absorption: [absorption; 3],
            phase: Phase::Isotropic,
        }],
        ..Atmosphere::default()
    }
}

#[test]
fn row_a09_a_uniform_medium_gives_the_closed_form() {
    let air = uniform_air(1e-4, 3e-5);
    let mut worst = 0.0_f64;
    for distance in [1.0, 100.0, 1e3, 1e4, 5e4] {
        let level = ray(500.0, 0.0, [90.0, 0.0], distance);
        let found = probe(&air, 16, 4, &[level])[0];
        for c in 0..3 {
            let scattering = 1e-4 * f64::from(1 << c);
            let extinction = scattering + 3e-5;
            let sun = (-extinction * 500.0).exp();
            let share = math::one_minus_exp(extinction * distance);
            let truth = sun * scattering / extinction * share / (4.0 * std::f64::consts::PI);
            worst = worst.max((f64::from(found.in_scatter[c]) / truth - 1.0).abs());
            let passed = (-extinction * distance).exp();
            worst = worst.max((f64::from(found.transmittance[c]) - passed).abs());
        }
    }
    println!("uniform medium: {worst:.1e} with 16 steps");
    assert!(worst < 1e-4);
}

#[test]
fn row_a09_the_march_meets_slices_composited_from_the_far_end() {
    let air = named("thesis");
    let sky = sky_of("thesis");
    for elevation in [1.0_f64, 10.0, 60.0] {
        let view = ray(2.0, elevation, [15.0, 70.0], FAR);
        let along = AirRay::new(RADIUS, TOP, &view);
        let count = 20_000;
        let size = f64::from(along.length) / f64::from(count);
        let nu = math::dot(view.dir, view.to_sun);
        let mut composed = [0.0; 3];
        for i in (0..count).rev() {
            let t = (f64::from(i) + 0.5) * size;
            let place = math::add([0.0, RADIUS + view.altitude, 0.0], math::scale(view.dir, t));
            let h = math::length(place) - RADIUS;
            let mu = math::dot(place, view.to_sun) / math::length(place);
            let out = veduta::reference::planet::top_distance(RADIUS, TOP, h, mu);
            let sun = sky.transmittance(sky.columns(h, mu, out));
            let densities = sky.densities(h);
            let extinction = sky.extinction(densities);
            for (c, composed) in composed.iter_mut().enumerate() {
                let scattered: f64 = air
                    .layers
                    .iter()
                    .map(|l| l.scattering[c] * l.profile.density(h) * l.phase.value(nu))
                    .sum();
                let kept = (-extinction[c] * size).exp();
                let own = size * math::one_minus_exp_over_x(extinction[c] * size);
                *composed = *composed * kept + sun[c] * scattered * own;
            }
        }
        let found = probe(&air, 96, 24, &[view])[0];
        for (found, composed) in found.in_scatter.iter().zip(composed) {
            let off = (f64::from(*found) / composed - 1.0).abs();
            assert!(off < 1e-3, "{elevation}: {off:e}");
        }
    }
}

#[test]
fn row_a10_twice_the_steps_at_most_half_the_error() {
    let rays: Vec<ProbeRay> = [
        (90.0, 45.0),
        (30.0, 5.0),
        (5.0, 20.0),
        (0.5, 30.0),
        (-0.0, 1.0),
    ]
    .iter()
    .map(|(elevation, sun)| ray(2.0, *elevation, [*sun, 40.0], FAR))
    .collect();
    let truth = truth(&sky_of("hazy"), &rays);
    let worst: Vec<f64> = [2, 4, 8, 16, 32, 64]
        .iter()
        .map(|&n| {
            let found = probe(&named("hazy"), n, 48, &rays);
            centile(&errors(&found, &truth, 1e-6, light), 1.0)
        })
        .collect();
    println!(
        "errors with 2, 4, ... 64 steps: {worst:.1?}",
        worst = worst.iter().map(|e| format!("{e:.1e}")).collect::<Vec<_>>()
    );
    for pair in worst.windows(2) {
        assert!(pair[1] <= 0.5 * pair[0] || pair[1] < 1e-5, "{worst:?}");
    }
    let zenith = probe(&named("hazy"), 64, 64, &rays[..1]);
    assert!(centile(&errors(&zenith, &truth[..1], 1e-6, light), 1.0) < 1e-4);
    // The march to the sun, likewise.
    let worst: Vec<f64> = [2, 4, 8, 16, 32]
        .iter()
        .map(|&n| {
            let found = probe(&named("hazy"), 128, n, &rays);
            centile(&errors(&found, &truth, 1e-6, light), 1.0)
        })
        .collect();
    println!("errors with 2, 4, ... 32 steps to the sun: {worst:?}");
    for pair in worst.windows(2) {
        assert!(pair[1] <= 0.5 * pair[0] || pair[1] < 1e-5, "{worst:?}");
    }
}

#[test]
fn row_a11_rays_that_miss_the_air_give_nothing_and_lose_nothing() {
    let air = named("thesis");
    let sun = [20.0, 30.0];
    let eye = 4e5;
    let touching = |level: f64| -((RADIUS + level) / (RADIUS + eye)).acos().to_degrees();
    let entry = |elevation: f64| {
        f64::from(AirRay::new(RADIUS, TOP, &ray(eye, elevation, sun, FAR)).from_eye)
    };
    let misses = [
        ray(eye, 90.0, sun, FAR),
        ray(eye, 0.0, sun, FAR),
        ray(eye, -0.0, sun, FAR),
        ray(eye, touching(TOP + 1.0), sun, FAR),
        ray(eye, touching(2e5), sun, FAR),
        // The planet behind the eye.
        ray(eye, 60.0, sun, FAR),
        // Something stands before the air.
        ray(eye, -90.0, sun, 2.9e5),
        ray(eye, touching(5e4), sun, 0.999 * entry(touching(5e4))),
        ray(eye, -90.0, sun, 0.0),
        ray(2.0, 20.0, sun, 0.0),
        ray(TOP, 0.0, sun, FAR),
        ray(TOP, 30.0, sun, FAR),
        ray(1e8, 10.0, sun, FAR),
        ray(1e8, -90.0 + 5.0, sun, FAR),
    ];
    for (found, ray) in probe(&air, 16, 4, &misses).iter().zip(&misses) {
        assert_eq!(found.in_scatter.map(f32::to_bits), [0; 3], "{ray:?}");
        assert_eq!(
            found.transmittance.map(f32::to_bits),
            [1.0_f32.to_bits(); 3],
            "{ray:?}"
        );
    }
    let down = touching(-1e4);
    let hits = [
        ray(eye, -90.0, sun, FAR),
        ray(eye, touching(TOP - 1.0), sun, FAR),
        ray(eye, touching(5e4), sun, FAR),
        ray(eye, touching(0.001), sun, FAR),
        ray(eye, down, sun, FAR),
        ray(eye, down, sun, entry(down) + 1e4),
        ray(2.0, 90.0, sun, FAR),
        ray(0.0, 0.0, sun, FAR),
        ray(2.0, 0.0, sun, 1e3),
        ray(TOP, -90.0, sun, FAR),
        ray(TOP, -5.0, sun, FAR),
        ray(1e8, -90.0, sun, FAR),
    ];
    let truth = truth(&sky_of("thesis"), &hits);
    let found = probe(&air, 96, 24, &hits);
    for (i, (f, t)) in found.iter().zip(&truth).enumerate() {
        for c in 0..3 {
            let off = (f64::from(f.in_scatter[c]) - t.in_scatter[c]).abs();
            assert!(
                off < 1e-4 * t.in_scatter[c] + 1e-9,
                "{:?} {f:?} {t:?}",
                hits[i]
            );
        }
        assert!(
            f.in_scatter[2] > 0.0 && f.transmittance[2] < 1.0,
            "{:?}",
            hits[i]
        );
    }
    // What stands beyond the end of the ray makes no difference.
    let beyond: Vec<ProbeRay> = hits
        .iter()
        .filter(|r| r.distance == FAR)
        .map(|r| ProbeRay {
            distance: 3e8,
            ..*r
        })
        .collect();
    let same = probe(&air, 96, 24, &beyond);
    let infinite = found.iter().zip(&hits).filter(|(_, r)| r.distance == FAR);
    for (a, (b, _)) in same.iter().zip(infinite) {
        assert_eq!(a, b);
    }
}

#[test]
fn row_a11_no_eye_is_too_low_or_too_high() {
    let near = |x: f64| {
        [
            x,
            x.next_up(),
            x.next_down(),
            f64::from((x as f32).next_up()),
            f64::from((x as f32).next_down()),
        ]
    };
    let mut heights = vec![0.0, 1e-30, 1e-6, 1.7, 1e8, 1e9];
    heights.extend(near(TOP));
    let mut rays = Vec::new();
    for altitude in heights {
        for elevation in [
            -90.0, -89.999, -45.0, -10.0, -1e-3, -1e-9, 0.0, 1e-9, 1e-3, 45.0, 90.0,
        ] {
            for sun in [-90.0, -6.0, -1e-6, 0.0, 1e-6, 30.0, 90.0] {
                for azimuth in [0.0, 90.0, 180.0] {
                    rays.push(ray(altitude, elevation, [sun, azimuth], FAR));
                }
            }
        }
        // Straight to the sun and straight away from it, along the edge of the shadow too.
        for elevation in [-90.0, -30.0, -5.0, 0.0, 5.0, 30.0, 90.0] {
            rays.push(ray(altitude, elevation, [elevation, 0.0], FAR));
            rays.push(ray(altitude, elevation, [-elevation, 180.0], FAR));
        }
    }
    for name in ["thesis", "earth", "mars"] {
        for (found, ray) in probe(&named(name), 12, 4, &rays).iter().zip(&rays) {
            let fine = found.in_scatter.iter().all(|v| v.is_finite() && *v >= 0.0)
                && found.transmittance.iter().all(|v| (0.0..=1.0).contains(v));
            assert!(fine, "{name}: {ray:?}: {found:?}");
        }
    }
}

#[test]
fn row_a12_a_far_surface_meets_the_sky_and_the_top_of_the_air_is_no_seam() {
    let air = named("hazy");
    let mut pairs = Vec::new();
    for elevation in [0.01, 1.0, 10.0, 80.0] {
        for sun in [-3.0, 0.5, 40.0] {
            let sky = ray(2.0, elevation, [sun, 60.0], FAR);
            let length = f64::from(AirRay::new(RADIUS, TOP, &sky).length);
            pairs.push([
                sky,
                ProbeRay {
                    distance: length * (1.0 - 1e-6),
                    ..sky
                },
            ]);
        }
    }
    for elevation in [-90.0_f64, -40.0, -10.2, -10.0, -9.0, -3.0, -0.1] {
        for sun in [-5.0, 2.0, 60.0] {
            let seen = |altitude: f64| ray(altitude, elevation, [sun, 100.0], FAR);
            let one = f64::from((TOP as f32).next_up()) - TOP;
            pairs.push([seen(TOP - one), seen(TOP + one)]);
            pairs.push([seen(TOP), seen(TOP + one)]);
        }
    }
    let rays: Vec<ProbeRay> = pairs.iter().flatten().copied().collect();
    let found = probe(&air, 96, 24, &rays);
    let mut worst = 0.0_f64;
    for (k, pair) in found.chunks(2).enumerate() {
        for c in 0..3 {
            let (a, b) = (
                f64::from(pair[0].in_scatter[c]),
                f64::from(pair[1].in_scatter[c]),
            );
            let off = (a - b).abs() / a.max(1e-6);
            assert!(off < 1e-3, "{:?}: {off:e}", pairs[k]);
            worst = worst.max(off);
        }
    }
    println!("largest step: {worst:.1e}");
}

#[test]
fn row_a19_a_flight_from_the_ground_to_orbit_has_no_pop() {
    let flight: Vec<ProbeRay> = (0..600)
        .map(|i| {
            let altitude = 2.0 * (1.8e7_f64.ln() * f64::from(i) / 599.0).exp();
            // To a place 300 km away on the ground, by its angle from the foot of the eye.
            let horizon = (RADIUS / (RADIUS + altitude)).acos();
            let angle = (3e5_f64 / RADIUS).min(0.9 * horizon);
            let to = [
                RADIUS * angle.sin(),
                RADIUS * angle.cos() - RADIUS - altitude,
                0.0,
            ];
            ProbeRay {
                altitude,
                dir: math::normalize(to),
                to_sun: heading(0.1, 2.0),
                distance: FAR,
            }
        })
        .collect();
    let truth = truth(&sky_of("hazy"), &flight);
    let found = probe(&named("hazy"), 48, 16, &flight);
    for i in 1..flight.len() {
        for c in 0..3 {
            let pop = f64::from(found[i].in_scatter[c] - found[i - 1].in_scatter[c])
                - (truth[i].in_scatter[c] - truth[i - 1].in_scatter[c]);
            assert!(
                pop.abs() < 3e-4 * truth[i].in_scatter[c],
                "{:?}: {pop:e}",
                flight[i]
            );
        }
    }
}

#[test]
fn many_rays_come_back_in_their_order_and_faults_name_the_ray() {
    let rays = mixed_rays(700, 5);
    let whole = probe(&named("thesis"), 2, 1, &rays);
    let each = probe(&named("thesis"), 2, 1, &rays[650..]);
    assert_eq!(whole[650..], each);
    let gpu = gpu();
    let make = |options: &ProbeOptions| {
        Probe::new(&gpu.device, veduta::programs(), &named("thesis"), options)
    };
    assert!(
        make(&options(0, 4))
            .unwrap_err()
            .to_string()
            .contains("`steps` is 0")
    );
    assert!(
        make(&options(4, 0))
            .unwrap_err()
            .to_string()
            .contains("`light_steps` is 0")
    );
    assert!(
        make(&options(512, 64))
            .unwrap_err()
            .to_string()
            .contains("65,535")
    );
    let some = make(&options(2, 1)).unwrap();
    assert!(some.run(&gpu.device, &gpu.queue, &[]).unwrap().is_empty());
    let good = ray(2.0, 10.0, [20.0, 0.0], FAR);
    for (bad, part) in [
        (
            ProbeRay {
                altitude: -1.0,
                ..good
            },
            "`rays[1].altitude` is -1",
        ),
        (
            ProbeRay {
                altitude: f64::NAN,
                ..good
            },
            "`rays[1].altitude` is NaN",
        ),
        (
            ProbeRay {
                dir: [0.0; 3],
                ..good
            },
            "`rays[1].dir`",
        ),
        (
            ProbeRay {
                to_sun: [1.0, 1.0, 0.0],
                ..good
            },
            "`rays[1].to_sun`",
        ),
        (
            ProbeRay {
                distance: f64::NAN,
                ..good
            },
            "`rays[1].distance` is NaN",
        ),
    ] {
        let fault = some.run(&gpu.device, &gpu.queue, &[good, bad]).unwrap_err();
        assert!(fault.to_string().contains(part), "{fault}");
    }
}

#[test]
fn the_largest_counts_run_to_the_end() {
    // A ray with three lit stretches: down into the air, out of the shadow again.
    let long = [
        ray(4e5, -19.0, [1.0, 0.0], FAR),
        ray(0.0, 0.0, [-3.0, 0.0], FAR),
        ray(2.0, 45.0, [30.0, 0.0], FAR),
    ];
    let truth = truth(&sky_of("thesis"), &long);
    for (steps, light_steps) in [(2300, 2), (124, 64), (2, 4000)] {
        let found = probe(&named("thesis"), steps, light_steps, &long);
        let left = errors(&found, &truth, 1e-6, left);
        println!("{steps}/{light_steps}: transmittance {}", shown(&left));
        if steps > 100 {
            assert!(centile(&left, 1.0) < 1e-4);
        }
    }
}

fn close(a: f32, b: f64, scale: f64) -> bool {
    (f64::from(a) - b).abs() <= 1e-6 * scale.max(b.abs())
}

#[test]
fn rays_made_in_f64_are_those_of_the_twin() {
    for (i, ray) in mixed_rays(20_000, 3).iter().enumerate() {
        let made = AirRay::new(RADIUS, TOP, ray);
        let twin = air_ray::air_ray(RADIUS, TOP, ray.altitude, ray.dir, ray.to_sun, ray.distance);
        let same = close(made.altitude, twin.altitude, TOP)
            && close(made.mu, twin.mu, 1.0)
            && close(made.sine, twin.sine, 1.0)
            && close(made.nu, twin.nu, 1.0)
            && close(made.sun_mu, twin.sun_mu, 1.0)
            && close(made.from_eye, twin.from_eye, 1.0)
            && close(made.length, twin.length, 1e3)
            && close(
                made.dark_to - made.dark_from,
                twin.dark_to - twin.dark_from,
                1e6,
            )
            && made.meets_ground == twin.meets_ground;
        assert!(same, "{i} {ray:?}\n{made:?}\n{twin:?}");
    }
}

#[test]
fn the_shadow_of_a_ray_is_where_the_sun_is_hidden() {
    let random = &mut Random(4);
    let (mut dark_places, mut partly) = (0, 0);
    for ray in mixed_rays(4000, 4) {
        let made = air_ray::air_ray(RADIUS, TOP, ray.altitude, ray.dir, ray.to_sun, ray.distance);
        partly += usize::from(
            made.dark_from < made.dark_to && made.dark_to - made.dark_from < made.length,
        );
        for _ in 0..8 {
            let t = made.length * random.uniform(0.0, 1.0);
            let eye = [0.0, RADIUS + ray.altitude, 0.0];
            let place = math::add(eye, math::scale(ray.dir, made.from_eye + t));
            let along = math::dot(place, ray.to_sun);
            let aside = math::length(math::add(place, math::scale(ray.to_sun, -along)));
            let hidden = along < 0.0 && aside < RADIUS;
            let near = (t - made.dark_from).abs().min((t - made.dark_to).abs()) < 1.0
                || (aside - RADIUS).abs() < 1e-3;
            dark_places += usize::from(hidden);
            assert!(
                near || hidden == (t > made.dark_from && t < made.dark_to),
                "{ray:?} {t} {made:?}"
            );
        }
    }
    println!("{dark_places} of 32000 places dark, {partly} of 4000 rays partly");
    assert!(dark_places > 500 && partly > 100);
}

const PARTS: &str = "
fn first(r: AirRay) -> vec4f { return vec4f(r.altitude, r.mu, r.sine, r.nu); }
fn second(r: AirRay) -> vec4f { return vec4f(r.sun_mu, r.from_eye, r.length, r.dark_from); }
fn third(r: AirRay) -> vec2f { return vec2f(r.dark_to, f32(r.meets_ground)); }
";

#[test]
fn rays_made_on_the_device_are_those_of_the_twin() {
    let list: Vec<[f32; 8]> = mixed_rays(20_000, 6)
        .iter()
        .map(|r| {
            let (d, s) = (r.dir.map(|c| c as f32), r.to_sun.map(|c| c as f32));
            [
                r.altitude as f32,
                d[0],
                d[1],
                d[2],
                s[0],
                s[1],
                s[2],
                (r.distance as f32).min(1e9),
            ]
        })
        .collect();
    let run = |part: &str| {
        let call = format!(
            "{part}(air_ray(6360000.0, 100000.0, in.f[0], vec3f(in.f[1], in.f[2], in.f[3]), vec3f(in.f[4], in.f[5], in.f[6]), in.f[7]))"
        );
        evaluator(
            &["veduta::atmosphere::ray::{AirRay, air_ray}"],
            PARTS,
            &call,
            8,
        )
        .run(&bits(&list))
        .unwrap()
    };
    let (a, b, c) = (run("first"), run("second"), run("third"));
    let mut worst = [0.0_f64; 4];
    let mut flips = 0;
    for (i, row) in list.iter().enumerate() {
        let wide = row.map(f64::from);
        let twin = air_ray::air_ray(
            RADIUS,
            TOP,
            wide[0],
            [wide[1], wide[2], wide[3]],
            [wide[4], wide[5], wide[6]],
            wide[7],
        );
        let (a, b, c) = (&a[4 * i..][..4], &b[4 * i..][..4], &c[2 * i..][..2]);
        assert!(a.iter().chain(b).chain(c).all(|v| v.is_finite()), "{row:?}");
        assert!(b[2] >= 0.0 && b[3] >= 0.0 && c[0] <= b[2], "{row:?}");
        // Whether a ray that grazes ground or top meets it may differ; how far off it runs may not.
        let lowest = air_ray::tangent_altitude(RADIUS, wide[0], [wide[1], wide[2], wide[3]]);
        if c[1] != f64::from(twin.meets_ground) || (b[2] == 0.0) != (twin.length < 1e-3) {
            flips += 1;
            assert!(
                lowest.abs() < 1.0
                    || (lowest - TOP).abs() < 1.0
                    || (b[2] - twin.length).abs() < 1e-2 * twin.length,
                "{row:?} {twin:?} {b:?} {c:?}"
            );
            continue;
        }
        let cosines = [
            (a[1], twin.mu),
            (a[2], twin.sine),
            (a[3], twin.nu),
            (b[0], twin.sun_mu),
        ];
        for (d, t) in cosines {
            worst[0] = worst[0].max((d - t).abs());
        }
        worst[1] = worst[1].max((b[1] - twin.from_eye).abs() / twin.from_eye.max(1e4));
        // Where a ray grazes a sphere its end moves a kilometre for a centimetre of height.
        if lowest.abs() > 100.0 && (lowest - TOP).abs() > 100.0 {
            worst[2] = worst[2].max((b[2] - twin.length).abs());
            worst[3] =
                worst[3].max(((c[0] - b[3]) - (twin.dark_to - twin.dark_from).max(0.0)).abs());
        }
    }
    println!(
        "cosines {:.1e}, to the entry {:.1e} relative, length {:.1} m, dark stretch {:.1} m, {flips} flips",
        worst[0], worst[1], worst[2], worst[3]
    );
    assert!(worst[0] < 1e-5 && worst[1] < 1e-5 && flips < 40);
}

#[test]
fn the_tangent_altitude_is_right_to_a_metre_from_anywhere() {
    let (device, list) = rows(40_000, 21, |random| {
        let h = log_between(random, 1e3, 1e8);
        // About the limb, where it matters, and anywhere.
        let level = random.between(-2e5, 2e5);
        let sine = ((6.36e6 + f64::from(level)) / (6.36e6 + f64::from(h))).min(1.0);
        let around = f64::from(random.between(0.0, std::f32::consts::TAU));
        let d = [
            sine * around.cos(),
            -(1.0 - sine * sine).sqrt(),
            sine * around.sin(),
        ];
        [h, d[0] as f32, d[1] as f32, d[2] as f32]
    });
    let values = evaluator(
        &["veduta::atmosphere::ray::{tangent_altitude}"],
        "",
        "tangent_altitude(6360000.0, in.f[0], vec3f(in.f[1], in.f[2], in.f[3]))",
        4,
    )
    .run(&device)
    .unwrap();
    let mut worst = [(0.0_f64, 0.0_f64); 2];
    for (value, row) in values.iter().zip(&list) {
        let truth = air_ray::tangent_altitude(RADIUS, row[0], [row[1], row[2], row[3]]);
        let far = usize::from(row[0] > 1e7);
        let off = (value - truth).abs();
        if off > worst[far].0 {
            worst[far] = (off, row[0]);
        }
    }
    println!("tangent altitude: {worst:?} m off at the height, below and above 10,000 km");
    assert!(worst[0].0 < 1.0 && worst[1].0 < 1.0);
}
