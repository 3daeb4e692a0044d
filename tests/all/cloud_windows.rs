//! Windows about the eye on layers of clouds that do not repeat.

use crate::cloud_frames::{RADIUS, over_black, stretches, targets};
use crate::common::gpu;
use veduta::clouds::{CloudDeck, CloudLights, CloudQuality, Clouds, CloudsOptions, Orders};
use veduta::glam::{DVec3, Vec3};
use veduta::reference::planet;
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
        window_texels: 64,
        levels: 8,
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

/// Light and transmittance of pixels against a march in `f64` over the noise itself, at the origin, 10000 km from it and in between, near and far clouds, with and without wind.
#[test]
fn windows_meet_the_march_near_and_far_from_the_origin() {
    let (columns, rows) = (64, 36);
    for (place, pitch, field_of_view, most) in [
        ([100.0, -300.0], 0.9, 0.7, 0.05),
        ([1.0e7 + 777.0, -1.0e7 + 333.0], 0.9, 0.7, 0.05),
        ([-54_321.0, 1.0e7], 0.2, 0.2, 0.1),
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
            window_texels: 384,
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
        println!("at {place:?}, {pitch} up: {off:.4} of the light, {through:.4} of the transmittance, {seen} of {pixels} cloudy");
        assert!(seen > 15, "{seen}");
        assert!(off < most, "{off}");
        assert!(through < 0.5 * most, "{through}");
    }
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
    let _ = planet::altitude_of(RADIUS, 0.0, [0.0; 3]);
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
    assert!(f64::from(along) > finest && f64::from(along) < 4.5 * finest, "{along}");
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
    let mut check = |flown: &mut Clouds, eye: DVec3, what: &str| {
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
        view.eye = view.eye.moved_by(DVec3::new(400.0, 0.0, -250.0) * f64::from(k));
        let _ = advance(&mut clouds, &view);
        if k % 30 == 29 {
            let (_, off) = apart(&over_black(&mut clouds, &view, &ALONE), &fresh(&view));
            println!("frame {k} of a flight under a sun that moves: {off:.4} off");
            assert!(off < 0.05, "{off}");
        }
    }
}

/// What presets keep on the device, at most.
#[test]
fn windows_keep_to_the_memory_of_the_presets() {
    for (preset, most) in [(Preset::Low, 12), (Preset::Medium, 32), (Preset::High, 96)] {
        let clouds = clouds(CloudQuality::of(&preset), endless(), Orders::Single);
        let held = clouds.resources();
        let mib = (held.texture_bytes + held.buffer_bytes) as f64 / f64::from(1 << 20);
        println!("{preset:?}: {mib:.1} MiB");
        assert!(mib < f64::from(most), "{preset:?}: {mib} MiB");
    }
}
