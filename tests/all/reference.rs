//! The references in Rust: quadrature, sky, paths, volumes and intersection, each against what is known exactly, against its
//! own order of convergence, and against a second method.

use crate::common::{Random, cpu_seconds};
use std::f64::consts::PI;
use veduta::atmosphere::{Atmosphere, Layer, Phase, Profile};
use veduta::reference::clouds::{CloudLayer, cloud_density, march_clouds, slab_single_scatter};
use veduta::reference::intersect::{Bracketing, Search, first_crossing, lipschitz_of_terrain};
use veduta::reference::math::{dot, normalize};
use veduta::reference::monte_carlo::{
    self, Tally, sample_cornette_shanks, sample_henyey_greenstein, sample_rayleigh, z_score,
};
use veduta::reference::parallel::parallel_map;
use veduta::reference::phase::{phase_cornette_shanks, phase_henyey_greenstein, phase_rayleigh};
use veduta::reference::quadrature::{KRONROD, Rule, Tolerance, integrate_kronrod};
use veduta::reference::sky::{Sky, SkyRay};
use veduta::reference::sky_paths::{Estimator, Paths, trace_skies};
use veduta::reference::volume::{Region, Volume, VolumePaths, VolumeRay};

/// A random number in [0, 1) with all the digits of an `f64`.
fn unit(random: &mut Random) -> f64 {
    (random.bits() >> 11) as f64 / (1u64 << 53) as f64
}

fn between(random: &mut Random, low: f64, high: f64) -> f64 {
    low + (high - low) * unit(random)
}

fn log_between(random: &mut Random, low: f64, high: f64) -> f64 {
    between(random, low.ln(), high.ln()).exp()
}

/// A unit vector with the given height.
fn at_height(random: &mut Random, y: f64) -> [f64; 3] {
    let angle = between(random, 0.0, 2.0 * PI);
    let across = (1.0 - y * y).max(0.0).sqrt();
    normalize([across * angle.cos(), y, across * angle.sin()])
}

/// Mean and variance of a list.
fn spread(list: &[f64]) -> (f64, f64) {
    let mut tally = Tally::default();
    list.iter().for_each(|&v| tally.add(v));
    (tally.mean(), tally.variance())
}

fn worst(list: impl IntoIterator<Item = f64>) -> f64 {
    list.into_iter().fold(0.0, f64::max)
}

/// An atmosphere that comes with the crate, with a change.
fn changed(name: &str, change: impl FnOnce(&mut Atmosphere)) -> Sky {
    let mut atmosphere = Atmosphere::named(name).unwrap();
    change(&mut atmosphere);
    Sky::new(&atmosphere).unwrap()
}

/// The thesis's air with ozone and coloured ground.
fn earth() -> Sky {
    changed("thesis", |a| {
        a.layers.push(Atmosphere::default().layers[2].clone());
        a.ground_albedo = [0.1, 0.2, 0.3];
    })
}

#[test]
fn reference_gauss_legendre_rules_are_exact_for_their_degree() {
    let known: [(usize, &[f64], &[f64]); 3] = [
        (2, &[1.0 / 3f64.sqrt(), -1.0 / 3f64.sqrt()], &[1.0, 1.0]),
        (
            3,
            &[0.6f64.sqrt(), 0.0, -(0.6f64.sqrt())],
            &[5.0 / 9.0, 8.0 / 9.0, 5.0 / 9.0],
        ),
        (
            5,
            &[
                (5.0 + 2.0 * (10.0f64 / 7.0).sqrt()).sqrt() / 3.0,
                (5.0 - 2.0 * (10.0f64 / 7.0).sqrt()).sqrt() / 3.0,
                0.0,
            ],
            &[
                (322.0 - 13.0 * 70f64.sqrt()) / 900.0,
                (322.0 + 13.0 * 70f64.sqrt()) / 900.0,
                128.0 / 225.0,
            ],
        ),
    ];
    for (order, nodes, weights) in known {
        let rule = Rule::new(order);
        assert_eq!(rule.points.len(), order);
        for ((point, node), weight) in rule.points.iter().zip(nodes).zip(weights) {
            assert!((point.0 - node).abs() < 1e-15, "{order}: {point:?}");
            assert!((point.1 - weight).abs() < 2e-15, "{order}: {point:?}");
        }
    }
    let mut largest: f64 = 0.0;
    for order in 1..=64 {
        let rule = Rule::new(order);
        for degree in 0..2 * order {
            let exact = if degree % 2 == 0 {
                2.0 / (degree as f64 + 1.0)
            } else {
                0.0
            };
            let sum = rule.integrate(|x| [x.powi(degree as i32)], -1.0, 1.0)[0];
            largest = largest.max((sum - exact).abs());
        }
        let beyond = rule.integrate(|x| [x.powi(2 * order as i32)], -1.0, 1.0)[0];
        let missed = 2.0 / (2.0 * order as f64 + 1.0) - beyond;
        assert!(order > 20 || missed > 1e-14, "no rule is better: {order}");
    }
    println!("Gauss-Legendre, orders 1 to 64: largest error of a polynomial {largest:.1e}");
    assert!(largest < 1e-14);
    // Order of convergence: halving the panels of a rule of 3 points gains 2^6.
    let rule = Rule::new(3);
    let error = |panels| (rule.composite(|x| [x.exp()], 0.0, 2.0, panels)[0] - 2f64.exp_m1()).abs();
    let order = (error(8) / error(16)).log2();
    println!("composite rule of 3 points: order {order:.3}");
    assert!((order - 6.0).abs() < 0.05);
}

#[test]
fn reference_kronrod_rules_are_exact_for_their_degree_and_their_error_is_honest() {
    let sum = |degree: i32, weight: fn(usize) -> f64| -> f64 {
        (0..8)
            .map(|i| {
                let both = if i < 7 { 2.0 } else { 1.0 };
                both * weight(i) * KRONROD[i].node.powi(degree)
            })
            .sum()
    };
    let mut largest: f64 = 0.0;
    for degree in (0..=22).step_by(2) {
        let exact = 2.0 / (f64::from(degree) + 1.0);
        largest = largest.max((sum(degree, |i| KRONROD[i].kronrod) - exact).abs());
        if degree <= 12 {
            largest = largest.max((sum(degree, |i| KRONROD[i].gauss) - exact).abs());
        }
    }
    println!("Gauss-Kronrod: largest error of a polynomial of degree 23 and 13 {largest:.1e}");
    assert!(largest < 1e-15);
    assert!((sum(24, |i| KRONROD[i].kronrod) - 2.0 / 25.0).abs() > 1e-10);
    assert!((sum(14, |i| KRONROD[i].gauss) - 2.0 / 15.0).abs() > 1e-5);
    let seven = Rule::new(7);
    for (i, (node, weight)) in seven.points.iter().take(4).enumerate() {
        assert!((KRONROD[2 * i + 1].node - node).abs() < 1e-15);
        assert!((KRONROD[2 * i + 1].gauss - weight).abs() < 1e-15);
    }
    type Case = (&'static str, fn(f64) -> f64, f64, f64, f64);
    let cases: [Case; 6] = [
        ("exp", |x| x.exp(), 0.0, 1.0, 1f64.exp_m1()),
        ("sqrt", |x| x.sqrt(), 0.0, 1.0, 2.0 / 3.0),
        (
            "peak",
            |x| 1.0 / (1e-6 + x * x),
            -1.0,
            1.0,
            2e3 * 1e3f64.atan(),
        ),
        ("kink", |x| (x - 0.3).abs(), 0.0, 1.0, 0.5 * (0.09 + 0.49)),
        (
            "step",
            |x| f64::from(u8::from(x > 1.0 / 3.0)),
            0.0,
            1.0,
            2.0 / 3.0,
        ),
        (
            "waves",
            |x| (200.0 * x).cos(),
            0.0,
            1.0,
            200f64.sin() / 200.0,
        ),
    ];
    for (name, f, a, b, exact) in cases {
        for relative in [1e-4, 1e-8, 1e-12] {
            let found = integrate_kronrod(|x| [f(x)], &[(a, b)], Tolerance::relative(relative));
            let error = (found.value[0] - exact).abs();
            println!(
                "{name:6} to {relative:.0e}: error {:.1e}, estimate {:.1e}, {} points",
                error / exact.abs(),
                found.error[0] / exact.abs(),
                found.evaluations
            );
            assert!(error <= found.error[0], "{name} at {relative}");
            assert!(!found.converged || found.error[0] <= relative * found.value[0].abs());
            assert!(found.converged || relative < 1e-10, "{name} at {relative}");
        }
    }
}

/// Integral of exp(-(r - R) / H) over a whole line at the distance `closest` from the centre: 2 p K1(p / H) exp(R / H), the
/// Bessel function by its expansion for large arguments.
fn whole_line(closest: f64, ground: f64, height: f64) -> f64 {
    let z = closest / height;
    let series = 1.0 + 3.0 / (8.0 * z) - 15.0 / (128.0 * z * z) + 315.0 / (3072.0 * z * z * z);
    2.0 * closest * (PI / (2.0 * z)).sqrt() * series * ((ground - closest) / height).exp()
}

#[test]
fn reference_sky_columns_are_those_of_closed_forms_and_of_a_second_method() {
    let sky = earth();
    let (ground, top) = (sky.atmosphere().planet_radius, sky.atmosphere().thickness);
    let up = sky.columns(0.0, 1.0, top);
    let exact = |height: f64| -height * (-top / height).exp_m1();
    println!("vertical columns {up:?} m");
    // Lanes of ramps come first.
    assert!((up[0] / 15_000.0 - 1.0).abs() < 1e-10);
    assert!((up[1] / exact(8000.0) - 1.0).abs() < 1e-12);
    assert!((up[2] / exact(1200.0) - 1.0).abs() < 1e-12);
    // A line through everything, with a top so high that nothing is missed.
    let mut endless = sky.atmosphere().clone();
    endless.thickness = 4e6;
    let endless = Sky::new(&endless).unwrap();
    for h in [0.0, 100.0, 5000.0, 30_000.0] {
        let to = ((ground + 4e6).powi(2) - (ground + h).powi(2)).sqrt();
        let half = endless.columns(h, 0.0, to);
        for (k, height) in [(1, 8000.0), (2, 1200.0)] {
            let error = 2.0 * half[k] / whole_line(ground + h, ground, height) - 1.0;
            println!(
                "grazing line at {h} m, scale height {height} m: {error:.1e} from 2 p K1(p/H)"
            );
            assert!(error.abs() < 3e-11);
        }
    }
    let mut random = Random(31);
    let (mut air, mut ozone): (f64, f64) = (0.0, 0.0);
    for i in 0..1000 {
        let h = if i % 2 == 0 {
            log_between(&mut random, 0.1, 1e5)
        } else {
            between(&mut random, 0.0, 1e5)
        };
        let horizon = -(1.0 - (ground / (ground + h)).powi(2)).sqrt();
        let mu = match i % 3 {
            0 => between(&mut random, horizon, 1.0),
            1 => horizon + (1.0 - horizon) * log_between(&mut random, 1e-6, 1.0),
            _ => between(&mut random, -0.01, 0.01).max(horizon),
        };
        let r = ground + h;
        let out = ((ground + top).powi(2) - r * r * (1.0 - mu * mu)).sqrt() - r * mu;
        let distance = out * between(&mut random, 0.01, 1.0);
        let (a, b) = (
            sky.columns(h, mu, distance),
            sky.columns_adaptive(h, mu, distance),
        );
        for k in 1..3 {
            // Columns that darken by less than 1e-9 count by their difference.
            air = air.max((a[k] - b[k]).abs() / b[k].max(1e-3));
        }
        ozone = ozone.max((a[0] - b[0]).abs());
    }
    println!(
        "1000 columns by two methods: air and aerosol {air:.1e} relative, ozone {ozone:.1e} m"
    );
    assert!(air < 2e-10 && ozone < 1e-4);
}

/// Rays from the ground, from within the air and from space, with suns at every height and many near the horizon.
fn sky_rays(count: usize, seed: u64) -> Vec<SkyRay> {
    let ground = Atmosphere::default().planet_radius;
    let mut random = Random(seed);
    (0..count)
        .map(|i| {
            let r = &mut random;
            let eye_altitude = match i % 4 {
                0 => log_between(r, 1.0, 1e4),
                1 => between(r, 0.0, 1e5),
                2 => log_between(r, 1e5, 1e7),
                _ => 2.0,
            };
            let eye = ground + eye_altitude;
            let y = if eye_altitude > 1e5 {
                // Aimed at the disc of the planet and its air.
                let closest = if i % 8 < 4 {
                    (ground + 1e5) * unit(r).sqrt()
                } else {
                    ground + between(r, -2e4, 1e5)
                };
                -(1.0 - (closest / eye).powi(2)).max(0.0).sqrt()
            } else if i % 3 == 0 {
                between(r, -0.1, 0.2)
            } else {
                between(r, -1.0, 1.0)
            };
            let sun_y = match i % 5 {
                0 | 1 => between(r, -0.15, 0.15),
                2 => between(r, 0.0, 1.0),
                _ => between(r, -0.3, 1.0),
            };
            let (dir, to_sun) = (at_height(r, y), at_height(r, sun_y));
            let distance = if i % 7 < 3 && eye_altitude < 1e5 {
                log_between(r, 10.0, 1e6)
            } else {
                f64::INFINITY
            };
            SkyRay {
                eye_altitude,
                dir,
                to_sun,
                distance,
            }
        })
        .collect()
}

#[test]
fn reference_sky_scattered_once_keeps_1e_6_on_1000_rays_by_two_methods() {
    let sky = earth();
    let rays = sky_rays(1000, 32);
    let start = cpu_seconds();
    let first = parallel_map(rays.len(), |i| sky.single_scatter(&rays[i], 1e-9));
    let middle = cpu_seconds();
    let second = parallel_map(rays.len(), |i| {
        sky.single_scatter_composite(&rays[i], 8, 12)
    });
    let end = cpu_seconds();
    let (mut dark, mut points, mut differences, mut estimates) = (0, 0, vec![], vec![]);
    let mut again = vec![];
    for (i, (a, b)) in first.iter().zip(&second).enumerate() {
        points += a.evaluations;
        if a.in_scatter == [0.0; 3] && *b == [0.0; 3] {
            dark += 1;
            continue;
        }
        let apart: [f64; 3] =
            std::array::from_fn(|k| (a.in_scatter[k] - b[k]).abs() / a.in_scatter[k]);
        differences.extend(apart);
        estimates.extend((0..3).map(|k| a.error[k] / a.in_scatter[k]));
        if worst(apart) > 1e-9 {
            again.push(i);
        }
    }
    differences.sort_by(f64::total_cmp);
    let at = |share: f64| differences[(share * (differences.len() - 1) as f64) as usize];
    println!(
        "1000 rays, {dark} of them in the dark: the two methods differ by {:.1e} at most, {:.1e} at 99 %, {:.1e} in the middle; estimates up to {:.1e}; {} points a ray; {:.2} s and {:.2} s of CPU",
        at(1.0),
        at(0.99),
        at(0.5),
        worst(estimates.clone()),
        points / rays.len(),
        middle - start,
        end - middle,
    );
    assert!(at(1.0) < 1e-6 && worst(estimates) < 1e-6);
    assert!(dark < 200);
    // Where the two differ, the composite rule was too coarse: with more panels it comes to the adaptive one.
    let finer = parallel_map(again.len(), |i| {
        sky.single_scatter_composite(&rays[again[i]], 40, 12)
    });
    let left = worst(again.iter().zip(&finer).flat_map(|(&i, b)| {
        let a = first[i].in_scatter;
        (0..3).map(move |k| (a[k] - b[k]).abs() / a[k])
    }));
    println!(
        "{} rays were more than 1e-9 apart; with five times the panels they are {left:.1e} apart at most",
        again.len()
    );
    assert!(left < 2e-9);
}

#[test]
fn reference_sky_scattered_once_agrees_with_closed_forms() {
    // Straight at the sun every path is as long as the ray: the columns times exp(-depth).
    let sky = changed("thesis", |_| {});
    let air = sky.atmosphere();
    let mut random = Random(33);
    let mut largest: f64 = 0.0;
    for _ in 0..100 {
        let h = between(&mut random, 0.0, 5e4);
        let y = between(&mut random, -0.02, 1.0);
        let dir = at_height(&mut random, y);
        let ray = SkyRay {
            eye_altitude: h,
            dir,
            to_sun: dir,
            distance: f64::INFINITY,
        };
        let r = air.planet_radius + h;
        if y < 0.0 && r * (1.0 - y * y).sqrt() < air.planet_radius {
            continue;
        }
        let found = sky.single_scatter(&ray, 1e-10);
        let out = (air.top_radius().powi(2) - r * r * (1.0 - y * y)).sqrt() - r * y;
        let columns = sky.columns_adaptive(h, y, out);
        let left = sky.transmittance(columns);
        for (k, left) in left.iter().enumerate() {
            let exact = left
                * (air.layers[0].scattering[k] * columns[0] * phase_rayleigh(1.0)
                    + air.layers[1].scattering[k] * columns[1] * phase_cornette_shanks(1.0, 0.76));
            largest = largest.max((found.in_scatter[k] / exact - 1.0).abs());
        }
    }
    println!("towards the sun: {largest:.1e} from the closed form");
    assert!(largest < 1e-9);
    // Straight down from space under the sun, air alone: (1 - exp(-2 depth)) / 2.
    let clear = changed("thesis", |a| {
        a.layers.truncate(1);
        a.ground_albedo = [0.5; 3];
    });
    let down = SkyRay {
        eye_altitude: 4e5,
        dir: [0.0, -1.0, 0.0],
        to_sun: [0.0, 1.0, 0.0],
        distance: f64::INFINITY,
    };
    let found = clear.single_scatter(&down, 1e-10);
    for k in 0..3 {
        let depth = clear.atmosphere().layers[0].scattering[k] * 8000.0 * -(-12.5f64).exp_m1();
        let exact = -0.5 * (-2.0 * depth).exp_m1() * phase_rayleigh(-1.0);
        let reflected = 0.5 / PI * (-2.0 * depth).exp();
        assert!((found.in_scatter[k] / exact - 1.0).abs() < 1e-9);
        assert!((found.reflected[k] / reflected - 1.0).abs() < 1e-9);
        assert!((found.in_scatter[k] - exact).abs() <= found.error[k] + 1e-12 * exact);
    }
}

#[test]
fn reference_parallel_results_are_in_order_and_streams_differ() {
    assert_eq!(
        parallel_map(1000, |i| i * i),
        (0..1000).map(|i| i * i).collect::<Vec<_>>()
    );
    assert!(parallel_map(0, |i| i).is_empty());
    let first = |seed, stream| monte_carlo::Random::new(seed, stream).bits();
    let mut words: Vec<u64> = (0..100)
        .flat_map(|seed| (0..100).map(move |stream| first(seed, stream)))
        .collect();
    words.sort_unstable();
    words.dedup();
    assert_eq!(words.len(), 10_000);
    assert_eq!(first(7, 8), first(7, 8));
}

#[test]
fn reference_sky_composite_rule_converges_with_its_order() {
    let sky = earth();
    let ray = SkyRay {
        eye_altitude: 2.0,
        dir: normalize([0.6, 0.3, 0.1]),
        to_sun: normalize([-0.3, 0.05, 0.6]),
        distance: f64::INFINITY,
    };
    let exact = sky.single_scatter(&ray, 1e-11).in_scatter;
    for order in [2, 3] {
        let error =
            |panels| (sky.single_scatter_composite(&ray, panels, order)[2] / exact[2] - 1.0).abs();
        let (coarse, fine) = (error(16), error(32));
        let measured = (coarse / fine).log2();
        println!(
            "{order} points a panel: error {coarse:.1e} with 16 panels, {fine:.1e} with 32, order {measured:.2}"
        );
        assert!((measured - 2.0 * order as f64).abs() < 0.5);
    }
}

#[test]
fn reference_phase_samples_follow_their_functions() {
    let g = 0.76;
    type Case = (
        &'static str,
        fn(&mut monte_carlo::Random) -> f64,
        fn(f64) -> f64,
    );
    let cases: [Case; 4] = [
        ("Rayleigh", sample_rayleigh, phase_rayleigh),
        (
            "Henyey-Greenstein",
            |r| sample_henyey_greenstein(0.76, r),
            |mu| phase_henyey_greenstein(mu, 0.76),
        ),
        (
            "backward",
            |r| sample_henyey_greenstein(-0.4, r),
            |mu| phase_henyey_greenstein(mu, -0.4),
        ),
        (
            "Cornette-Shanks",
            |r| sample_cornette_shanks(0.76, r),
            |mu| phase_cornette_shanks(mu, 0.76),
        ),
    ];
    let rule = Rule::new(16);
    for (i, (name, sample, phase)) in cases.into_iter().enumerate() {
        let (bins, count) = (40, 200_000);
        let mut random = monte_carlo::Random::new(5, i as u64);
        let mut found = vec![0.0; bins];
        for _ in 0..count {
            let mu = sample(&mut random);
            assert!((-1.0..=1.0).contains(&mu));
            found[(((mu + 1.0) * 0.5 * bins as f64) as usize).min(bins - 1)] += 1.0;
        }
        let chi: f64 = (0..bins)
            .map(|b| {
                let edge = |b: usize| -1.0 + 2.0 * b as f64 / bins as f64;
                let share = 2.0 * PI * rule.integrate(|mu| [phase(mu)], edge(b), edge(b + 1))[0];
                let expected = share * f64::from(count);
                (found[b] - expected).powi(2) / expected
            })
            .sum();
        let z = (chi - 39.0) / (2.0 * 39.0f64).sqrt();
        println!("{name}: chi square {chi:.1} of 39, z {z:.2}");
        assert!(z.abs() < 5.0);
    }
    // The closed form of Cornette and Shanks's mean cosine.
    let mean =
        2.0 * PI * rule.composite(|mu| [mu * phase_cornette_shanks(mu, g)], -1.0, 1.0, 64)[0];
    let exact = g * 3.0 * (4.0 + g * g) / (5.0 * (2.0 + g * g));
    assert!((mean - exact).abs() < 1e-12);
}

/// Rays by day and at low sun, most from near the ground.
fn day_rays(count: usize, seed: u64) -> Vec<SkyRay> {
    let mut random = Random(seed);
    (0..count)
        .map(|i| {
            let r = &mut random;
            let y = between(r, -0.3, 1.0);
            let sun = between(r, 0.05, 1.0);
            let (dir, to_sun) = (at_height(r, y), at_height(r, sun));
            SkyRay {
                eye_altitude: if i % 3 == 0 {
                    between(r, 0.0, 2e4)
                } else {
                    2.0
                },
                dir,
                to_sun,
                distance: f64::INFINITY,
            }
        })
        .collect()
}

/// Checks that scores have mean 0 and variance 1, within four of the standard deviations that so many scores have.
fn assert_honest(name: &str, scores: &[f64]) {
    let (mean, variance) = spread(scores);
    let count = scores.len() as f64;
    let (off_mean, off_variance) = (4.0 / count.sqrt(), 4.0 * (2.0 / count).sqrt());
    println!(
        "{name}: {count} scores, mean {mean:.3} (within {off_mean:.3}), variance {variance:.3} (1 within {off_variance:.3}), largest {:.2}",
        worst(scores.iter().map(|z| z.abs()))
    );
    assert!(mean.abs() < off_mean, "{name}: mean {mean}");
    assert!(
        (variance - 1.0).abs() < off_variance,
        "{name}: variance {variance}"
    );
}

#[test]
fn reference_sky_paths_of_two_seeds_have_scores_of_unit_variance() {
    let sky = earth();
    let rays = day_rays(200, 35);
    let start = cpu_seconds();
    let run = |seed| {
        let paths = Paths {
            samples: 1000,
            seed,
            ..Default::default()
        };
        trace_skies(&sky, &rays, &paths)
    };
    let (a, b) = (run(1), run(2));
    let scores: Vec<f64> = a
        .iter()
        .zip(&b)
        .flat_map(|(a, b)| {
            (0..3).map(|k| {
                z_score(
                    a.mean[k],
                    a.standard_error[k],
                    b.mean[k],
                    b.standard_error[k],
                )
            })
        })
        .collect();
    let relative = spread(
        &a.iter()
            .flat_map(|m| (0..3).map(|k| m.standard_error[k] / m.mean[k]))
            .collect::<Vec<_>>(),
    )
    .0;
    let cost = (cpu_seconds() - start) / (2.0 * 200.0 * 1000.0 * 3.0);
    println!(
        "all orders, 1000 paths: standard error {:.2} % of the radiance in the mean, {:.1} us of CPU a path",
        100.0 * relative,
        1e6 * cost
    );
    assert_honest("two seeds", &scores);
    let few = Paths {
        samples: 1000,
        ..Default::default()
    };
    assert_eq!(
        trace_skies(&sky, &rays[..5], &few),
        a[..5],
        "the same seed gives the same picture"
    );
}

#[test]
fn reference_sky_paths_of_two_estimators_agree() {
    let sky = earth();
    let rays = day_rays(60, 36);
    let placed = trace_skies(
        &sky,
        &rays,
        &Paths {
            samples: 2000,
            ..Default::default()
        },
    );
    let paths = Paths {
        samples: 12_000,
        seed: 3,
        estimator: Estimator::Tracking,
        ..Default::default()
    };
    let tracked = trace_skies(&sky, &rays, &paths);
    let scores: Vec<f64> = placed
        .iter()
        .zip(&tracked)
        .flat_map(|(a, b)| {
            (0..3).map(|k| {
                z_score(
                    a.mean[k],
                    a.standard_error[k],
                    b.mean[k],
                    b.standard_error[k],
                )
            })
        })
        .collect();
    assert_honest("placed against tracked", &scores);
}

#[test]
fn reference_sky_paths_of_order_one_are_the_quadrature() {
    let sky = earth();
    let rays = day_rays(200, 37);
    let exact: Vec<[f64; 3]> = parallel_map(rays.len(), |i| {
        let s = sky.single_scatter(&rays[i], 1e-9);
        std::array::from_fn(|k| s.in_scatter[k] + s.reflected[k])
    });
    for (name, estimator, samples) in [
        ("placed", Estimator::Quadrature, 1000),
        ("tracked", Estimator::Tracking, 4000),
    ] {
        let paths = Paths {
            samples,
            max_order: 1,
            seed: 4,
            estimator,
            ..Default::default()
        };
        let found = trace_skies(&sky, &rays, &paths);
        let mut scores = vec![];
        let mut relative = vec![];
        for (m, e) in found.iter().zip(&exact) {
            for (k, &e) in e.iter().enumerate() {
                scores.push(z_score(m.mean[k], m.standard_error[k], e, 0.0));
                relative.push(m.standard_error[k] / e);
            }
        }
        println!(
            "order 1, {name}: standard error {:.3} % in the mean",
            100.0 * spread(&relative).0
        );
        assert_honest(&format!("order 1 {name} against quadrature"), &scores);
    }
}

#[test]
fn reference_sky_is_a_white_furnace() {
    let sky = changed("thesis", |a| {
        a.layers[1].absorption = [0.0; 3];
        a.ground_albedo = [1.0; 3];
    });
    let rays = sky_rays(60, 38)
        .into_iter()
        .map(|ray| SkyRay {
            distance: f64::INFINITY,
            ..ray
        })
        .collect::<Vec<_>>();
    let base = Paths {
        samples: 500,
        max_order: 1_000_000,
        sun: 0.0,
        uniform: 1.0,
        ..Default::default()
    };
    let mut scores = vec![];
    let mut apart: f64 = 0.0;
    for m in trace_skies(&sky, &rays, &base) {
        for k in 0..3 {
            scores.push(z_score(m.mean[k], m.standard_error[k].max(1e-9), 1.0, 0.0));
            apart = apart.max((m.mean[k] - 1.0).abs());
        }
    }
    println!("white furnace, placed: radiance 1 within {apart:.1e}");
    assert_honest("white furnace", &scores);
    let tracked = Paths {
        samples: 50,
        estimator: Estimator::Tracking,
        ..base
    };
    for m in trace_skies(&sky, &rays, &tracked) {
        assert_eq!(m.mean, [1.0; 3], "every path leaves with all its light");
    }
}

/// Everything that an atmosphere may have: eight lobes, five profiles, haze that begins and ends within the air.
fn many_layers() -> Atmosphere {
    let layer = |name: &str, profile, scattering, absorption, phase| Layer {
        name: name.to_owned(),
        profile,
        scattering,
        absorption,
        phase,
    };
    let mut air = Atmosphere::default();
    air.layers[1].phase = Phase::TwoLobes {
        forward: 0.8,
        backward: -0.4,
        backward_share: 0.2,
    };
    air.layers.extend([
        layer(
            "a cloud",
            Profile::Constant {
                bottom: 3000.0,
                top: 5000.0,
            },
            [2e-5, 1e-5, 3e-5],
            [1e-6; 3],
            Phase::Draine { g: 0.6, alpha: 3.0 },
        ),
        layer(
            "a high haze",
            Profile::Tent {
                bottom: 60_000.0,
                peak: 70_000.0,
                top: 85_000.0,
            },
            [1e-6, 2e-6, 3e-6],
            [0.0; 3],
            Phase::CornetteShanksMean { u: 0.7 },
        ),
        layer(
            "more of the air",
            Profile::Exponential {
                scale_height: 8000.0,
            },
            [1e-6; 3],
            [1e-7; 3],
            Phase::Isotropic,
        ),
        layer(
            "smoke",
            Profile::Exponential {
                scale_height: 2500.0,
            },
            [1e-6; 3],
            [3e-6, 4e-6, 5e-6],
            Phase::HenyeyGreenstein { g: -0.2 },
        ),
    ]);
    air
}

#[test]
fn reference_sky_takes_any_layers_by_two_methods_and_two_estimators() {
    for atmosphere in [many_layers(), Atmosphere::named("mars").unwrap()] {
        let sky = Sky::new(&atmosphere).unwrap();
        let rays: Vec<SkyRay> = sky_rays(200, 44);
        let apart = |i: usize, panels: usize| {
            let a = sky.single_scatter(&rays[i], 1e-9).in_scatter;
            let b = sky.single_scatter_composite(&rays[i], panels, 12);
            let lit = (0..3).filter(|k| a[*k] != b[*k]);
            worst(lit.map(|k| (a[k] - b[k]).abs() / a[k]))
        };
        let coarse = parallel_map(rays.len(), |i| apart(i, 12));
        let mut order: Vec<usize> = (0..rays.len()).collect();
        order.sort_by(|i, j| coarse[*j].total_cmp(&coarse[*i]));
        let fine = worst(parallel_map(6, |k| apart(order[k], 60)));
        println!(
            "{} layers: the two methods differ by {:.1e} at most, {:.1e} in the middle; with five times the panels by {fine:.1e}",
            atmosphere.layers.len(),
            coarse[order[0]],
            coarse[order[rays.len() / 2]],
        );
        // Layers with edges have roots at every border, where panels of equal width converge with the power 3/2.
        assert!(coarse[order[0]] < 5e-5 && coarse[order[100]] < 1e-9);
        assert!(fine < 2e-6);
        // Towards the sun few paths carry much light, and such samples tell little of their own spread.
        let mut rays = day_rays(60, 45);
        rays.retain(|ray| dot(ray.dir, ray.to_sun) < 0.7);
        let exact = parallel_map(rays.len(), |i| sky.single_scatter(&rays[i], 1e-9));
        let run = |paths: Paths| trace_skies(&sky, &rays, &paths);
        // All orders by tracking, against the first by quadrature and the others by importance.
        let tracked = run(Paths {
            samples: 8000,
            seed: 5,
            estimator: Estimator::Tracking,
            seen_ground: false,
            ..Default::default()
        });
        let others = run(Paths {
            samples: 2000,
            seed: 6,
            first_order: 2,
            seen_ground: false,
            ..Default::default()
        });
        let mut scores = vec![];
        for ((t, o), e) in tracked.iter().zip(&others).zip(&exact) {
            for k in 0..3 {
                // Of a ray that meets the ground at once, no tracked path may have met anything else.
                if t.standard_error[k] == 0.0 {
                    continue;
                }
                let sum = o.mean[k] + e.in_scatter[k];
                scores.push(z_score(
                    t.mean[k],
                    t.standard_error[k],
                    sum,
                    o.standard_error[k],
                ));
            }
        }
        assert_honest("tracked against quadrature and placed", &scores);
    }
}

#[test]
fn reference_crossings_are_those_of_closed_forms_and_none_is_missed() {
    let mut random = Random(39);
    let (mut hits, mut clear, mut evaluations) = (0, 0, 0);
    let mut largest: f64 = 0.0;
    for i in 0..2000 {
        let r = &mut random;
        let y = between(r, -0.5, 0.1);
        let dir = at_height(r, y);
        let eye = between(r, 0.0, 100.0);
        let (slope, far) = (between(r, 0.0, 0.5), 1000.0);
        // A tilted plane, a ball on a deep floor, and a curved wave, in turn.
        let (clearance, exact, lipschitz): (Box<dyn Fn(f64) -> f64>, f64, f64) = match i % 3 {
            0 => {
                let rate = dir[1] - slope * dir[0];
                (
                    Box::new(move |t| eye + 0.1 + t * rate),
                    -(eye + 0.1) / rate,
                    lipschitz_of_terrain(dir, slope),
                )
            }
            1 => {
                let centre = [0.0, eye - 40.0, 0.0];
                let radius = 30.0;
                let along = centre[1] * dir[1];
                let square = along * along - centre[1] * centre[1] + radius * radius;
                let exact = if square > 0.0 && along > 0.0 && eye < 5.0 {
                    along - square.sqrt()
                } else {
                    -1.0
                };
                let reachable = eye < 5.0;
                (
                    Box::new(move |t| {
                        let p = [dir[0] * t, dir[1] * t - centre[1], dir[2] * t];
                        if reachable {
                            dot(p, p).sqrt() - radius
                        } else {
                            1.0
                        }
                    }),
                    exact,
                    1.0,
                )
            }
            _ => {
                // A crest of cos exactly at the height of a level ray: height 1 + cos(0.1 x), ray along x at 1 + c.
                let level = between(r, -0.999, 0.999);
                let phase = between(r, level.acos() + 1e-3, 2.0 * PI - level.acos() - 1e-3);
                let exact = (2.0 * PI - level.acos() - phase) / 0.1;
                (
                    Box::new(move |t| level - (0.1 * t + phase).cos()),
                    exact,
                    0.1,
                )
            }
        };
        let found = first_crossing(
            &clearance,
            &Bracketing {
                far,
                lipschitz,
                least_step: 1e-5,
                ..Default::default()
            },
        );
        match found {
            Search::Hit {
                distance,
                error,
                evaluations: n,
            } => {
                hits += 1;
                evaluations += n;
                assert!(error < 1e-9);
                let apart = (distance - exact).abs();
                if i % 3 != 1 || apart < 1.0 {
                    largest = largest.max(apart);
                }
                assert!(apart < 1e-6, "case {i}: {found:?} against {exact}");
            }
            Search::Clear {
                least,
                evaluations: n,
            } => {
                clear += 1;
                evaluations += n;
                assert!(least > 0.0);
                assert!(!(0.0..far).contains(&exact), "case {i}: missed {exact}");
            }
            Search::Exhausted { .. } => panic!("case {i}: exhausted"),
        }
    }
    println!(
        "2000 searches: {hits} hits within {largest:.1e} m, {clear} clear, {} values each",
        evaluations / 2000
    );
    // Crests that a level ray clips by less and less: all found while the stretch below ground is longer than the least step.
    for depth in [1e-2, 1e-4, 1e-6, 1e-8, 1e-10] {
        let crest = |t: f64| depth_over(t, depth);
        let search = Bracketing {
            far: 1000.0,
            lipschitz: 0.1,
            least_step: 1e-5,
            ..Default::default()
        };
        let found = first_crossing(crest, &search)
            .distance()
            .expect("a clipped crest");
        let exact = 500.0 - (1.0 - depth).acos() / 0.1;
        println!(
            "crest clipped by {depth:.0e} m: {:.1e} m off",
            found - exact
        );
        assert!((found - exact).abs() < 1e-6 + 1e-15 / depth.sqrt() * 1e3);
    }
    let grazed = first_crossing(
        |t| depth_over(t, -1e-6),
        &Bracketing {
            far: 1000.0,
            lipschitz: 0.1,
            least_step: 1e-3,
            ..Default::default()
        },
    );
    assert!(matches!(grazed, Search::Clear { least, .. } if least > 0.9e-6));
    let short = Bracketing {
        evaluations: 10,
        least_step: 1e-3,
        ..Default::default()
    };
    assert!(
        matches!(first_crossing(|_| 1.0, &short), Search::Exhausted { reached } if reached < 10.0)
    );
    assert_eq!(
        first_crossing(|_| -1.0, &Bracketing::default()).distance(),
        Some(0.0)
    );
    assert!((lipschitz_of_terrain([1.0, 0.0, 0.0], 1.0) - 2.0).abs() < 1e-15);
}

/// Clearance of a level ray over one crest at 500 m that rises `depth` above it.
fn depth_over(t: f64, depth: f64) -> f64 {
    let turn = 0.1 * (t - 500.0);
    if turn.abs() < PI {
        1.0 - depth - turn.cos()
    } else {
        2.0 - depth
    }
}

/// A slab or shell without any structure, to be given a density.
fn fog<F>(region: Region, density: F) -> Volume<F> {
    Volume {
        region,
        density,
        max_density: 1.0,
        extinction: 0.002,
        albedo: 0.9,
        g_forward: 0.8,
        g_backward: -0.3,
        backward_share: 0.2,
    }
}

const SLAB: Region = Region::Slab {
    bottom: 0.0,
    top: 1000.0,
};

const SHELL: Region = Region::Shell {
    ground_radius: 6_360_000.0,
    bottom: 1000.0,
    top: 2000.0,
};

#[test]
fn reference_volumes_scattered_once_agree_with_closed_forms() {
    let mut random = Random(40);
    let mut largest: f64 = 0.0;
    for i in 0..60 {
        let r = &mut random;
        let (view, sun) = (between(r, 0.05, 1.0), between(r, 0.05, 1.0));
        let ray = VolumeRay {
            origin: [0.0, -50.0, 0.0],
            dir: at_height(r, view),
            to_sun: at_height(r, sun),
            distance: f64::INFINITY,
        };
        // The same light for every vertical profile of the same depth: uniform, and falling with the height.
        let scale_height = 300.0;
        let profile = move |p: [f64; 3]| match i % 2 {
            0 => 1.0,
            _ => (-p[1] / scale_height).exp(),
        };
        let fog = fog(SLAB, profile);
        let column = match i % 2 {
            0 => 1000.0,
            _ => -scale_height * (-1000.0 / scale_height).exp_m1(),
        };
        let nu = dot(ray.dir, ray.to_sun);
        let exact = slab_single_scatter(
            fog.extinction * column,
            fog.albedo,
            fog.phase(nu),
            view,
            sun,
        );
        let found = fog.single_scatter(&ray, 1e-9);
        let error = (found.scatter - exact).abs();
        assert!(
            error <= found.error + 1e-13 * exact,
            "{error} above the estimate {}",
            found.error
        );
        let left = (-fog.extinction * column / view).exp();
        largest = largest
            .max(error / exact)
            .max((found.transmittance / left - 1.0).abs());
    }
    println!("60 slabs: {largest:.1e} from the closed form");
    assert!(largest < 2e-8);
    // Upwards under the sun at the zenith every path is as long, whatever the density.
    let bumps = fog(SHELL, |p: [f64; 3]| 0.5 + 0.5 * (0.02 * p[1]).sin());
    let ray = VolumeRay {
        origin: [0.0; 3],
        dir: [0.0, 1.0, 0.0],
        to_sun: [0.0, 1.0, 0.0],
        distance: f64::INFINITY,
    };
    let depth = bumps.extinction * 0.5 * (1000.0 + (20f64.cos() - 40f64.cos()) / 0.02);
    let exact = bumps.albedo * bumps.phase(1.0) * depth * (-depth).exp();
    let found = bumps.single_scatter(&ray, 1e-9);
    let error = (found.scatter / exact - 1.0).abs();
    println!(
        "vertical column: {error:.1e} from the closed form, estimate {:.1e}, {} points",
        found.error / exact,
        found.evaluations
    );
    assert!(error < 2e-9 && (found.scatter - exact).abs() <= found.error);
    // Order of convergence.
    let slant = VolumeRay {
        dir: normalize([0.5, 0.6, 0.2]),
        to_sun: normalize([-0.6, 0.4, 0.1]),
        ..ray
    };
    let truth = bumps.single_scatter(&slant, 1e-11).scatter;
    for (order, few) in [(1_u8, 64), (2, 32), (3, 16)] {
        let error = |panels| {
            (bumps
                .single_scatter_composite(&slant, panels, usize::from(order), 1e-12)
                .scatter
                / truth
                - 1.0)
                .abs()
        };
        let (coarse, fine) = (error(few), error(2 * few));
        let measured = (coarse / fine).log2();
        println!(
            "{order} points a panel: error {coarse:.1e} with {few} panels, {fine:.1e} with twice as many, order {measured:.2}"
        );
        assert!((measured - 2.0 * f64::from(order)).abs() < 0.5);
    }
}

#[test]
fn reference_volumes_of_clouds_are_what_the_twin_marches_to() {
    let layer = CloudLayer {
        cell: [3, 0, -7],
        frac: [0.3, 0.1, 0.8],
        wavelength: 2500.0,
        period: 64,
        octaves: 3,
        hurst: 0.7,
        bottom: 1000.0,
        thickness: 1000.0,
        coverage: 0.7,
        uniformity: 0.1,
        extinction: 0.004,
        albedo: 0.99,
        g_forward: 0.8,
        g_backward: -0.2,
        backward_share: 0.3,
        seed: 5,
    };
    let radius = 6_360_000.0;
    let clouds = Volume {
        region: SHELL,
        density: |p: [f64; 3]| cloud_density(&layer, p, SHELL.altitude(p)),
        max_density: 1.0,
        extinction: layer.extinction,
        albedo: layer.albedo,
        g_forward: layer.g_forward,
        g_backward: layer.g_backward,
        backward_share: layer.backward_share,
    };
    let rays: Vec<VolumeRay> = {
        let mut r = Random(41);
        (0..8)
            .map(|_| {
                let (view, sun) = (between(&mut r, 0.2, 1.0), between(&mut r, 0.3, 1.0));
                VolumeRay {
                    origin: [0.0; 3],
                    dir: at_height(&mut r, view),
                    to_sun: at_height(&mut r, sun),
                    distance: f64::INFINITY,
                }
            })
            .collect()
    };
    let start = cpu_seconds();
    let fine = parallel_map(rays.len(), |i| clouds.single_scatter(&rays[i], 1e-5));
    println!(
        "{:.2} s of CPU for 8 cloud rays to 1e-5",
        cpu_seconds() - start
    );
    for (ray, fine) in rays.iter().zip(&fine) {
        let march = |steps: i32| {
            march_clouds(
                &layer,
                radius,
                0.0,
                ray.dir,
                ray.to_sun,
                f64::INFINITY,
                steps,
                steps,
                0.5,
            )
        };
        // The march counts a whole step before its light, an error of the first order: two step counts remove it.
        let [coarse, close, closer] = [64, 256, 512].map(|steps| march(steps).scatter);
        let off = |scatter: f64| (scatter / fine.scatter - 1.0).abs();
        let limit = 2.0 * closer - close;
        println!(
            "cloud ray: scatter {:.4e} (estimate {:.0e}), transmittance {:.4}; the twin's march is {:.1e} off with 64 steps, {:.1e} with 512, its limit {:.1e}",
            fine.scatter,
            fine.error / fine.scatter,
            fine.transmittance,
            off(coarse),
            off(closer),
            off(limit)
        );
        assert!(fine.scatter == 0.0 || off(limit) < 2e-4);
        assert!(fine.error <= 5e-5 * fine.scatter);
    }
}

#[test]
fn reference_volumes_by_paths_agree_with_quadrature_and_with_themselves() {
    let bumps = fog(SHELL, |p: [f64; 3]| {
        let wave = |x: f64| 0.5 + 0.5 * (0.01 * x).sin();
        wave(p[0]) * wave(p[1]) * wave(p[2] + 40.0)
    });
    let mut random = Random(42);
    let rays: Vec<VolumeRay> = (0..200)
        .map(|i| {
            let r = &mut random;
            let (view, sun) = (between(r, 0.05, 1.0), between(r, -0.005, 1.0));
            let mut dir = at_height(r, view);
            // From below, from within and from above.
            let height = [0.0, 1000.0, 3000.0][i % 3];
            if i % 3 == 2 {
                dir[1] = -dir[1];
            }
            VolumeRay {
                origin: [0.0, height, 0.0],
                dir,
                to_sun: at_height(r, sun),
                distance: if i % 5 == 0 { 2000.0 } else { f64::INFINITY },
            }
        })
        .collect();
    let trace =
        |paths: VolumePaths| parallel_map(rays.len(), |i| bumps.trace(&rays[i], &paths, i as u64));
    let exact = parallel_map(rays.len(), |i| bumps.single_scatter(&rays[i], 1e-6));
    let once = trace(VolumePaths {
        samples: 3000,
        max_order: 1,
        ..Default::default()
    });
    let scores: Vec<f64> = once
        .iter()
        .zip(&exact)
        .map(|(m, e)| z_score(m.0, m.1, e.scatter, 0.0))
        .collect();
    assert_honest("volume, order 1 against quadrature", &scores);
    let all = |seed| {
        trace(VolumePaths {
            samples: 2000,
            seed,
            ..Default::default()
        })
    };
    let scores: Vec<f64> = all(1)
        .iter()
        .zip(&all(2))
        .map(|(a, b)| z_score(a.0, a.1, b.0, b.1))
        .collect();
    assert_honest("volume, two seeds", &scores);
}

#[test]
fn reference_volumes_by_paths_are_a_white_furnace_and_a_deep_layer_by_chandrasekhar() {
    let white = Volume {
        albedo: 1.0,
        extinction: 0.01,
        ..fog(SLAB, |p: [f64; 3]| 0.5 + 0.5 * (0.01 * p[0]).sin())
    };
    let ray = VolumeRay {
        origin: [0.0, -10.0, 0.0],
        dir: normalize([0.3, 0.8, 0.1]),
        to_sun: [0.0, 1.0, 0.0],
        distance: f64::INFINITY,
    };
    let paths = VolumePaths {
        sun: 0.0,
        uniform: 1.0,
        ..Default::default()
    };
    assert_eq!(white.trace(&ray, &paths, 0), (1.0, 0.0));
    // Light reflected by an endless depth that scatters evenly: albedo / 4 pi, mu0 / (mu + mu0), H(mu) H(mu0), with
    // Chandrasekhar's function H from its integral equation.
    let albedo: f64 = 0.8;
    let rule = Rule::new(40);
    let nodes: Vec<(f64, f64)> = rule
        .points
        .iter()
        .map(|(x, w)| (0.5 * (x + 1.0), 0.5 * w))
        .collect();
    let mut h = vec![1.0; nodes.len()];
    let value = |mu: f64, h: &[f64]| {
        let sum: f64 = nodes
            .iter()
            .zip(h)
            .map(|((m, w), h)| w * m * h / (mu + m))
            .sum();
        1.0 / ((1.0 - albedo).sqrt() + 0.5 * albedo * sum)
    };
    for _ in 0..100 {
        h = nodes.iter().map(|(mu, _)| value(*mu, &h)).collect();
    }
    let deep = Volume {
        albedo,
        extinction: 0.03,
        g_forward: 0.0,
        backward_share: 0.0,
        ..fog(SLAB, |_| 1.0)
    };
    let mut random = Random(43);
    let cases: Vec<(f64, VolumeRay)> = (0..100)
        .map(|_| {
            let r = &mut random;
            let (view, sun) = (between(r, 0.1, 1.0), between(r, 0.1, 1.0));
            let exact = albedo / (4.0 * PI) * sun / (view + sun) * value(view, &h) * value(sun, &h);
            let ray = VolumeRay {
                origin: [0.0, 1010.0, 0.0],
                dir: at_height(r, -view),
                to_sun: at_height(r, sun),
                distance: f64::INFINITY,
            };
            (exact, ray)
        })
        .collect();
    let paths = VolumePaths {
        samples: 3000,
        ..Default::default()
    };
    let found = parallel_map(cases.len(), |i| deep.trace(&cases[i].1, &paths, i as u64));
    let relative = found
        .iter()
        .zip(&cases)
        .map(|(m, c)| m.1 / c.0)
        .sum::<f64>()
        / 100.0;
    let scores: Vec<f64> = found
        .iter()
        .zip(&cases)
        .map(|(m, c)| z_score(m.0, m.1, c.0, 0.0))
        .collect();
    println!(
        "deep layer: standard error {:.2} % in the mean",
        100.0 * relative
    );
    assert_honest("deep layer against Chandrasekhar", &scores);
}
