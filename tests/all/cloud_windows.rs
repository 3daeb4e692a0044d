//! Windows about the eye on layers of clouds that do not repeat.

use crate::cloud_frames::{over_black, stretches, targets};
use crate::common::gpu;
use veduta::clouds::{
    CloudDeck, CloudLights, CloudQuality, Clouds, CloudsOptions, Orders, WindowQuality,
};
use veduta::glam::{DVec3, Vec3};
use veduta::reference::volume::{self, VolumePaths};
use veduta::view::direction;
use veduta::{Preset, View, Work, WorldPos};

const ALONE: CloudLights = CloudLights {
    sun: Vec3::ONE,
    above: Vec3::ZERO,
    below: Vec3::ZERO,
};

/// The layer of `thesis` with a period of 16384 km.
fn endless() -> CloudDeck {
    CloudDeck {
        period_doublings: 12,
        ..CloudDeck::default()
    }
}

fn clouds(quality: CloudQuality, deck: CloudDeck, orders: Orders) -> Clouds {
    let options = CloudsOptions {
        quality,
        deck,
        orders,
        ..Default::default()
    };
    Clouds::new(&gpu().device, veduta::programs(), &targets(), &options).unwrap()
}

/// Small windows, for questions of which texels there are.
fn small() -> CloudQuality {
    CloudQuality {
        windows: WindowQuality {
            texels: 64,
            levels: 8,
            fineness: 23,
            most: 7,
        },
        frames: 8,
        ..CloudQuality::of(&Preset::Low)
    }
}

fn view_from(eye: DVec3, yaw: f64, pitch: f64, field_of_view: f32) -> View {
    let mut view = View {
        eye: WorldPos::from_metres(eye),
        ..Default::default()
    };
    view.sun.to_light = direction(0.8, 1.0).as_vec3();
    view.look(yaw, pitch, field_of_view, 16.0 / 9.0);
    view
}

/// A frame's baking without drawing.
fn advance(clouds: &mut Clouds, view: &View) -> Work {
    let gpu = gpu();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let work = clouds
        .prepare(&gpu.queue, &mut encoder, view, &ALONE)
        .unwrap();
    gpu.queue.submit([encoder.finish()]);
    gpu.device
        .poll(veduta::wgpu::PollType::wait_indefinitely())
        .unwrap();
    work
}

/// The largest difference of light or transmittance, and the root of the mean square of the light's over that of the light.
fn apart(one: &[[f32; 4]], other: &[[f32; 4]]) -> (f32, f64) {
    let mut most = 0.0_f32;
    let (mut square, mut power) = (0.0, 0.0);
    for (a, b) in one.iter().zip(other) {
        for k in 0..4 {
            most = most.max((a[k] - b[k]).abs());
        }
        square += f64::from(a[1] - b[1]).powi(2);
        power += f64::from(b[1]).powi(2);
    }
    (most, (square / power).sqrt())
}

/// Light and transmittance of pixels, by `march_windows` and `window_at`, against a march in `f64` over the noise itself, at the origin, 10000 km from it and in between, near and far clouds, with and without wind.
#[test]
fn windows_meet_the_march_near_and_far_from_the_origin() {
    let (columns, rows) = (64, 36);
    for (place, pitch, field_of_view, most) in [
        ([100.0, -300.0], 0.9, 0.7, 0.06),
        ([1.0e7 + 777.0, -1.0e7 + 333.0], 0.9, 0.7, 0.06),
        ([-54_321.0, 1.0e7], 0.2, 0.2, 0.11),
    ] {
        let deck = CloudDeck {
            wind: [12.5, -7.25],
            ..endless()
        };
        let mut view = view_from(
            DVec3::new(place[0], 300.0, place[1]),
            0.4,
            pitch,
            field_of_view,
        );
        view.time = 100.0;
        let to_sun = view.sun.to_light.as_dvec3().normalize().to_array();
        let quality = CloudQuality {
            steps: 128,
            windows: WindowQuality {
                texels: 512,
                levels: 64,
                fineness: 128,
                most: 7,
            },
            ..CloudQuality::of(&Preset::High)
        };
        let mut clouds = clouds(quality, deck.clone(), Orders::Single);
        let shown = over_black(&mut clouds, &view, &ALONE);
        let [middle, right, up] = view.rays().unwrap();
        let (mut square, mut power, mut seen, mut through) = (0.0, 0.0, 0, 0.0_f64);
        let mut pixels = 0;
        for (y, x) in (2..rows)
            .step_by(4)
            .flat_map(|y| (2..columns).step_by(6).map(move |x| (y, x)))
        {
            let at = |k: u32, n: u32| (2 * k + 1) as f32 / n as f32 - 1.0;
            let dir = middle + at(x, columns) * right - at(y, rows) * up;
            let ray = veduta::atmosphere::ProbeRay {
                altitude: 300.0,
                dir: dir.as_dvec3().normalize().to_array(),
                to_sun,
                distance: f64::INFINITY,
            };
            let drifted = [place[0] - 1250.0, place[1] + 725.0];
            let (found, left) = stretches(&deck, drifted, &ray, 24);
            let wanted: f64 = found.iter().map(|s| s.light).sum();
            let pixel = shown[(y * columns + x) as usize];
            square += (f64::from(pixel[1]) - wanted).powi(2);
            power += wanted * wanted;
            through += (f64::from(pixel[3]) - left).powi(2);
            seen += usize::from(left < 0.9);
            pixels += 1;
        }
        let off = (square / power).sqrt();
        let through = (through / f64::from(pixels)).sqrt();
        println!(
            "at {place:?}, {pitch} up: {off:.4} of the light, {through:.4} of the transmittance, {seen} of {pixels} cloudy"
        );
        assert!(seen > 15, "{seen}");
        assert!(off < most, "{off}");
        assert!(through < 0.5 * most, "{through}");
    }
    // Whole periods away the clouds are the same, however far: 5 10^13 m. Texels are others there.
    let quality = CloudQuality::of(&Preset::High);
    let picture = |x: f64| {
        let view = view_from(DVec3::new(x, 300.0, 0.0), 0.4, 0.9, 0.7);
        over_black(
            &mut clouds(quality, endless(), Orders::Single),
            &view,
            &ALONE,
        )
    };
    let (_, off) = apart(
        &picture(100.0 - 3.0 * 16_384_000.0 * 1_048_576.0),
        &picture(100.0),
    );
    let (_, moved) = apart(&picture(160.0), &picture(100.0));
    println!("3 x 2^20 periods away {off:.4}, 60 m away {moved:.4}");
    assert!(off < 0.06 && moved > 2.0 * off, "{off} {moved}");
    // The clouds are others everywhere: they do not repeat after the period of `thesis`.
    let quality = small();
    let picture = |x: f64| {
        let view = view_from(DVec3::new(x, 300.0, 0.0), 0.4, 0.9, 0.7);
        over_black(
            &mut clouds(quality, endless(), Orders::Single),
            &view,
            &ALONE,
        )
    };
    let (_, off) = apart(&picture(0.0), &picture(16_000.0));
    assert!(off > 0.3, "{off}");
}

/// Nothing is baked for an eye that stands, turns, or goes to and fro by less than a strip; for one that flies, what it uncovers.
#[test]
fn windows_bake_what_the_eye_uncovers() {
    let quality = small();
    let mut clouds = clouds(quality, endless(), Orders::Single);
    let at = |x: f64, z: f64, yaw: f64| view_from(DVec3::new(x, 300.0, z), yaw, 0.6, 0.9);
    let first = advance(&mut clouds, &at(0.0, 0.0, 0.0));
    assert!(first.dispatches > 0 && first.bakes > 0);
    let again = advance(&mut clouds, &at(0.0, 0.0, 0.0));
    assert_eq!((again.dispatches, again.bakes, again.writes), (0, 0, 0));
    // 64 texels over at most 2.8 wavelengths: a texel is at least 87 m wide.
    let mut baked = 0;
    for k in 0..40 {
        let work = advance(&mut clouds, &at([0.0, 85.0][k % 2], 3.0, 0.1 * k as f64));
        baked += work.dispatches;
    }
    assert_eq!(baked, 0);
    // 100 m/s for 200 s, 30 frames a second: every 30th of them, so that no frame goes farther than a strip is wide.
    let fly = |clouds: &mut Clouds, way: [f64; 2]| {
        let (mut bakes, mut most) = (0, 0);
        for k in 0..200 {
            let metres = 100.0 * f64::from(k);
            let work = advance(clouds, &at(way[0] * metres, way[1] * metres, 0.0));
            bakes += work.bakes;
            most = most.max(work.bakes);
        }
        (bakes, most)
    };
    let (along, most) = fly(&mut clouds, [1.0, 0.0]);
    println!("20 km along x: {along} strips, at most {most} a frame");
    // Strips of 4 texels of 87 to 175 m, and as many again of all wider windows.
    let finest = 20_000.0 / (4.0 * 175.0);
    assert!(
        f64::from(along) > finest && f64::from(along) < 4.5 * finest,
        "{along}"
    );
    assert!(most <= 6);
    let mut other = self::clouds(quality, endless(), Orders::Single);
    let _ = advance(&mut other, &at(0.0, 0.0, 0.0));
    let (diagonal, _) = fly(&mut other, [0.6, -0.8]);
    println!("20 km across: {diagonal} strips");
    assert!((1.2..1.6).contains(&(f64::from(diagonal) / f64::from(along))));
}

/// After flights every way and after jumps the windows hold what windows begun there hold, to the bit, and every texel of it: the pictures are the same.
#[test]
fn windows_hold_nothing_stale() {
    let quality = small();
    let origin = DVec3::new(4.0e6, 300.0, -7.0e6);
    let mut flown = clouds(quality, endless(), Orders::Single);
    let mut eye = origin;
    let check = |flown: &mut Clouds, eye: DVec3, what: &str| {
        for (yaw, pitch) in [(0.3, 0.5), (2.4, 0.15), (4.4, 0.15)] {
            let view = view_from(eye, yaw, pitch, 1.2);
            let shown = over_black(flown, &view, &ALONE);
            let fresh = over_black(
                &mut clouds(quality, endless(), Orders::Single),
                &view,
                &ALONE,
            );
            let (most, _) = apart(&shown, &fresh);
            assert!(shown.iter().filter(|p| p[3] < 0.5).count() > 100);
            assert_eq!(most, 0.0, "{what}, yaw {yaw}");
        }
    };
    let steps = [
        (1.0, 0.0),
        (-1.0, 0.0),
        (0.0, 1.0),
        (0.0, -1.0),
        (1.0, 1.0),
        (-1.0, 0.5),
        (-0.3, -1.0),
        (1.0, -1.0),
    ];
    for (x, z) in steps {
        for _ in 0..40 {
            eye += DVec3::new(x, 0.0, z) * 333.3;
            let _ = advance(&mut flown, &view_from(eye, 0.0, 0.5, 1.2));
        }
        check(&mut flown, eye, &format!("flown {x}, {z}"));
    }
    // Jumps: of a part of the finest window, beyond it, beyond all.
    for jump in [
        DVec3::new(3000.0, 0.0, -2500.0),
        DVec3::new(-9000.0, 0.0, 14_000.0),
        DVec3::new(0.0, 200.0, -60_000.0),
        DVec3::new(2.0e6, 0.0, 3.0e6),
    ] {
        eye += jump;
        let view = view_from(eye, 0.3, 0.5, 1.2);
        let first = over_black(&mut flown, &view, &ALONE);
        assert!(first.iter().flatten().all(|v| v.is_finite()));
        let mut frames = 0;
        loop {
            let work = advance(&mut flown, &view);
            frames += 1;
            if work.dispatches == 0 && work.writes == 0 {
                break;
            }
            assert!(frames < 100);
        }
        check(&mut flown, eye, &format!("jumped by {jump}"));
    }
}

/// A sun that goes on: windows are baked anew one after the other, and are in the end those of the new sun; the picture never leaves what lies between.
#[test]
fn windows_follow_the_sun() {
    let quality = small();
    let mut clouds = clouds(quality, endless(), Orders::Single);
    let under = |height: f64| {
        let mut view = view_from(DVec3::new(-500.0, 300.0, 900.0), 0.4, 0.5, 1.2);
        view.sun.to_light = direction(height, 1.0).as_vec3();
        view
    };
    let fresh = |view: &View| {
        over_black(
            &mut self::clouds(quality, endless(), Orders::Single),
            view,
            &ALONE,
        )
    };
    let (start, end) = (under(0.8), under(0.7));
    let _ = over_black(&mut clouds, &start, &ALONE);
    let (_, whole) = apart(&fresh(&start), &fresh(&end));
    let (mut last, mut frames) = (f64::INFINITY, 0);
    loop {
        let shown = over_black(&mut clouds, &end, &ALONE);
        let (_, off) = apart(&shown, &fresh(&end));
        // The way there is monotone but for what the windows differ by.
        assert!(off < last + 0.02, "frame {frames}: {off} after {last}");
        (last, frames) = (off, frames + 1);
        let work = advance(&mut clouds, &end);
        if work.dispatches == 0 {
            break;
        }
        assert!(frames < 200);
    }
    let (most, off) = apart(&over_black(&mut clouds, &end, &ALONE), &fresh(&end));
    println!("after {frames} frames {off:.5}, {most:.5} at most; {whole:.4} between the suns");
    assert!(frames > 5 && whole > 0.01);
    assert!(off < 1e-3 && most < 4e-3, "{off} {most}");
    // A flight under a sun that moves is none but a shift of both.
    for k in 0..120 {
        let mut view = under(0.7 - 0.002 * f64::from(k));
        view.eye = view
            .eye
            .moved_by(DVec3::new(400.0, 0.0, -250.0) * f64::from(k));
        let _ = advance(&mut clouds, &view);
        if k % 30 == 29 {
            let (_, off) = apart(&over_black(&mut clouds, &view, &ALONE), &fresh(&view));
            println!("frame {k} of a flight under a sun that moves: {off:.4} off");
            assert!(off < 0.12, "{off}");
        }
    }
    // When both come to rest nothing of the way is left.
    let mut rest = under(0.46);
    rest.eye = rest.eye.moved_by(DVec3::new(50_000.0, 0.0, -30_000.0));
    let mut frames = 0;
    while advance(&mut clouds, &rest).dispatches > 0 {
        frames += 1;
        assert!(frames < 300);
    }
    let (most, _) = apart(&over_black(&mut clouds, &rest, &ALONE), &fresh(&rest));
    assert!(most < 4e-3, "{most}");
}

/// What presets keep on the device, at most.
#[test]
fn windows_keep_to_the_memory_of_the_presets() {
    for (preset, most) in [(Preset::Low, 12), (Preset::Medium, 32), (Preset::High, 96)] {
        for (name, far) in CloudDeck::names().flat_map(|name| [(name, 80e3), (name, 1e6)]) {
            let options = CloudsOptions {
                quality: CloudQuality::of(&preset),
                deck: CloudDeck {
                    period_doublings: 12,
                    ..CloudDeck::named(name).unwrap()
                },
                far,
                ..Default::default()
            };
            let device = &gpu().device;
            let clouds = Clouds::new(device, veduta::programs(), &targets(), &options).unwrap();
            let held = clouds.resources();
            let mib = (held.texture_bytes + held.buffer_bytes) as f64 / f64::from(1 << 20);
            println!("{preset:?}, {name} to {far} m: {mib:.1} MiB");
            assert!(mib < f64::from(most), "{preset:?}, {name}: {mib} MiB");
        }
    }
}

/// `march_windows_orders` with `window_cells_at` against paths, near, and so far that the mean of the cells stands for them; and after a flight the light of the place flown to.
#[test]
fn light_of_all_orders_in_windows_meets_paths() {
    let (columns, rows) = (64, 36);
    // The cells lie over the second window, and over the first. Far away what is seen of clouds is darker than the mean of their cells: beyond the aims of 10 and 20 % there, as `docs/clouds.md` says.
    for (pitch, field_of_view, fineness, aims) in
        [(0.7, 0.9, 176, [0.1, 0.2]), (0.3, 0.3, 88, [0.25, 0.45])]
    {
        let quality = CloudQuality::of(&Preset::High);
        let windows = WindowQuality {
            fineness,
            ..quality.windows
        };
        let quality = CloudQuality { windows, ..quality };
        let mut clouds = clouds(quality, endless(), Orders::All);
        let view = view_from(DVec3::new(0.0, 300.0, 0.0), 0.4, pitch, field_of_view);
        let to_sun = view.sun.to_light.as_dvec3().normalize().to_array();
        for _ in 0..300 {
            if advance(&mut clouds, &view).dispatches == 0 {
                break;
            }
        }
        let shown = over_black(&mut clouds, &view, &ALONE);
        let [middle, right, up] = view.rays().unwrap();
        let (mut pixels, mut list) = (Vec::new(), Vec::new());
        for (y, x) in (2..rows)
            .step_by(4)
            .flat_map(|y| (2..columns).step_by(4).map(move |x| (y, x)))
        {
            let at = |k: u32, n: u32| (2 * k + 1) as f32 / n as f32 - 1.0;
            let dir = middle + at(x, columns) * right - at(y, rows) * up;
            pixels.push((y * columns + x) as usize);
            list.push(veduta::atmosphere::ProbeRay {
                altitude: 300.0,
                dir: dir.as_dvec3().normalize().to_array(),
                to_sun,
                distance: 80_000.0,
            });
        }
        let paths = VolumePaths {
            samples: 128,
            ..Default::default()
        };
        let truth = volume::layer_light(&endless(), &list, Orders::All, &paths);
        let found = |k: usize| f64::from(shown[pixels[k]][1]);
        let count = list.len() as f64;
        let mean: f64 = truth.iter().map(|t| t[0]).sum::<f64>() / count;
        let noise = truth.iter().map(|t| t[1] * t[1]).sum::<f64>().sqrt() / count / mean;
        let off = (0..list.len()).map(found).sum::<f64>() / count / mean - 1.0;
        // Blocks of two by two rays.
        let (mut square, mut noisy, mut blocks) = (0.0, 0.0, 0.0);
        let rms = (truth.iter().map(|t| t[0] * t[0]).sum::<f64>() / count).sqrt();
        for k in 0..4 {
            for i in 0..8 {
                let members =
                    [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(x, y)| (2 * k + y) * 16 + 2 * i + x);
                let part: f64 = members.iter().map(|m| found(*m) - truth[*m][0]).sum();
                square += (part / 4.0).powi(2);
                noisy += members.iter().map(|m| truth[*m][1].powi(2)).sum::<f64>() / 16.0;
                blocks += 1.0;
            }
        }
        let [square, noisy] = [square, noisy].map(|s: f64| (s / blocks).sqrt() / rms);
        println!(
            "{pitch} up: mean {off:+.3} (noise {noise:.3}), blocks {square:.3} (noise {noisy:.3})"
        );
        assert!(off.abs() < aims[0] + 2.0 * noise, "{off} {noise}");
        assert!(
            square < (aims[1] * aims[1] + noisy * noisy).sqrt(),
            "{square}"
        );
        if pitch < 0.5 {
            continue;
        }
        // Flown away and back to rest there: as light as if begun there.
        let mut away = view;
        for _ in 0..40 {
            away.eye = away.eye.moved_by(DVec3::new(300.0, 0.0, -450.0));
            let _ = advance(&mut clouds, &away);
        }
        let flown_at_once = over_black(&mut clouds, &away, &ALONE);
        let mut frames = 0;
        while advance(&mut clouds, &away).dispatches > 0 {
            frames += 1;
            assert!(frames < 600);
        }
        let mut fresh = self::clouds(quality, endless(), Orders::All);
        while advance(&mut fresh, &away).dispatches > 0 {}
        let fresh = over_black(&mut fresh, &away, &ALONE);
        let (_, early) = apart(&flown_at_once, &fresh);
        let (_, late) = apart(&over_black(&mut clouds, &away, &ALONE), &fresh);
        println!(
            "flown 22 km in 40 frames {early:.4} off, at rest there after {frames} frames {late:.4}"
        );
        assert!(late < 0.03, "{late}");
        // 16 km/s, before the light has followed.
        assert!(early < 0.35, "{early}");
    }
}

#[test]
fn what_windows_cannot_do_is_refused() {
    let new = |options: &CloudsOptions| {
        Clouds::new(&gpu().device, veduta::programs(), &targets(), options)
            .unwrap_err()
            .to_string()
    };
    let options = CloudsOptions {
        quality: small(),
        deck: endless(),
        orders: Orders::Single,
        ..Default::default()
    };
    let text = new(&CloudsOptions {
        shadows: true,
        ..options.clone()
    });
    assert!(text.contains("options.shadows"), "{text}");
    let with = |windows: WindowQuality| {
        new(&CloudsOptions {
            quality: CloudQuality { windows, ..small() },
            ..options.clone()
        })
    };
    let good = small().windows;
    for (windows, name) in [
        (
            WindowQuality {
                texels: 100,
                ..good
            },
            "windows.texels",
        ),
        (
            WindowQuality {
                texels: 544,
                ..good
            },
            "windows.texels",
        ),
        (WindowQuality { levels: 1, ..good }, "windows.levels"),
        (WindowQuality { most: 0, ..good }, "windows.most"),
        (WindowQuality { most: 8, ..good }, "windows.most"),
        (
            WindowQuality {
                fineness: 0,
                ..good
            },
            "windows.fineness",
        ),
    ] {
        let text = with(windows);
        assert!(text.contains(name), "{text}");
    }
    // No shadow is told that a tile's reader would take for one.
    let mut clouds = clouds(small(), endless(), Orders::Single);
    let _ = advance(&mut clouds, &view_from(DVec3::ZERO, 0.0, 0.5, 1.0));
    assert!(clouds.shadow().is_none());
}

/// Pictures of layers with forms, of wide numbers, from within, above and far away, with the sun high and low, hold no value that is not finite.
#[test]
fn windows_of_every_kind_are_finite() {
    for (k, name) in ["fair", "towers", "stratus", "thesis"]
        .into_iter()
        .enumerate()
    {
        let deck = CloudDeck {
            period_doublings: 5 + 2 * k as u32,
            ..CloudDeck::named(name).unwrap()
        };
        let quality = CloudQuality {
            wide: k % 2 == 1,
            ..small()
        };
        let inside = deck.bottom + 0.5 * deck.thickness;
        let mut clouds = clouds(quality, deck, Orders::Single);
        for altitude in [0.0, inside, 12_000.0, 400_000.0] {
            for sun in [1.5, 0.3, 0.0, -0.2] {
                let mut view = view_from(DVec3::new(-3e9, altitude, 5e8), 1.0, 0.0, 1.5);
                view.sun.to_light = direction(sun, 1.0).as_vec3();
                let shown = over_black(&mut clouds, &view, &ALONE);
                assert!(
                    shown.iter().flatten().all(|v| v.is_finite() && *v >= 0.0),
                    "{name} {altitude} {sun}"
                );
            }
        }
    }
}
