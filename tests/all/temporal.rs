//! Frames that are joined: towards the picture of many samples, standing and moving, and what they do with changes.

use veduta::View;
use veduta::glam::{DVec3, I64Vec3, Vec3};
use veduta::temporal::{Temporal, TemporalOptions};
use veduta::wgpu;

use crate::common::gpu;

const SIZE: [u32; 2] = [64, 36];

/// Red, green and blue and the distance along -z of what a ray meets.
type Scene = dyn Fn(DVec3, DVec3) -> ([f64; 3], f64);

/// A wall 40 m away, and before its left half one 10 m away, both with squares of about four pixels.
fn walls(eye: DVec3, dir: DVec3) -> ([f64; 3], f64) {
    let at = |z: f64| eye + dir * ((z - eye.z) / dir.z);
    let near = at(-10.0);
    let (p, distance, side) = if near.x < 0.5 {
        (near, eye.z + 10.0, 1.1)
    } else {
        (at(-40.0), eye.z + 40.0, 4.6)
    };
    let light = (p.x / side).floor() as i64 + (p.y / side).floor() as i64;
    let value = if light.rem_euclid(2) == 0 { 0.9 } else { 0.1 };
    ([value, 0.5 * value, 0.2 + 0.1 * value], distance)
}

fn texture(size: [u32; 2], format: wgpu::TextureFormat) -> wgpu::Texture {
    gpu().device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d {
            width: size[0],
            height: size[1],
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}

/// A host that draws on the processor.
struct Host {
    color: wgpu::Texture,
    depth: wgpu::Texture,
    temporal: Temporal,
    taken: [u32; 2],
}

fn view() -> View {
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    View {
        eye: veduta::WorldPos {
            cell: I64Vec3::ZERO,
            frac: Vec3::ZERO,
        },
        projection: veduta::glam::camera::rh::proj::directx::perspective_infinite_reverse(
            1.0, aspect, 1.0,
        ),
        ..View::default()
    }
}

/// What the middles of pixels see: colours, distances.
fn seen(view: &View, size: [u32; 2], scene: &Scene) -> (Vec<[f64; 3]>, Vec<f64>) {
    let [middle, right, up] = view.rays().unwrap().map(|v| v.as_dvec3());
    let eye = view.eye.to_metres();
    let mut colors = Vec::new();
    let mut distances = Vec::new();
    for y in 0..size[1] {
        for x in 0..size[0] {
            let at = |i: u32, n: u32| 2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0;
            let (color, distance) =
                scene(eye, middle + right * at(x, size[0]) - up * at(y, size[1]));
            colors.push(color);
            distances.push(distance);
        }
    }
    (colors, distances)
}

/// The picture with 12 x 12 samples a pixel.
fn truth(view: &View, scene: &Scene) -> Vec<[f64; 3]> {
    const N: u32 = 12;
    let (fine, _) = seen(view, [N * SIZE[0], N * SIZE[1]], scene);
    let mut sums = vec![[0.0; 3]; (SIZE[0] * SIZE[1]) as usize];
    for (k, color) in (0..).zip(fine) {
        let (x, y) = (k % (N * SIZE[0]) / N, k / (N * SIZE[0]) / N);
        for c in 0..3 {
            sums[(y * SIZE[0] + x) as usize][c] += color[c] / f64::from(N * N);
        }
    }
    sums
}

/// Root mean square of differences, away from the border.
fn apart(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let inner = |k: usize| {
        let (x, y) = (k as u32 % SIZE[0], k as u32 / SIZE[0]);
        (3..SIZE[0] - 3).contains(&x) && (3..SIZE[1] - 3).contains(&y)
    };
    let squares: Vec<f64> = (0..a.len())
        .filter(|k| inner(*k))
        .flat_map(|k| (0..3).map(move |c| (a[k][c] - b[k][c]).powi(2)))
        .collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

impl Host {
    fn new(options: TemporalOptions) -> Host {
        let device = &gpu().device;
        let color = texture(options.taken, wgpu::TextureFormat::Rgba32Float);
        let depth = texture(options.taken, wgpu::TextureFormat::Depth16Unorm);
        let mut temporal = Temporal::new(device, veduta::programs(), &options).unwrap();
        temporal
            .set_host(
                device,
                &color.create_view(&Default::default()),
                &depth.create_view(&Default::default()),
            )
            .unwrap();
        Host {
            color,
            depth,
            temporal,
            taken: options.taken,
        }
    }

    fn frame(&mut self, view: &View, scene: &Scene) -> Vec<[f64; 3]> {
        let gpu = gpu();
        let (colors, distances) = seen(&self.temporal.shifted(view), self.taken, scene);
        // What is infinitely far is transparent.
        let texels: Vec<u8> = colors
            .iter()
            .zip(&distances)
            .flat_map(|(c, d)| {
                let alpha = f32::from(u8::from(d.is_finite()));
                [c[0] as f32, c[1] as f32, c[2] as f32, alpha]
            })
            .flat_map(f32::to_le_bytes)
            .collect();
        // As the projection has it; the near plane lies at a metre.
        let [scale, offset] = [view.projection.z_axis.z, view.projection.w_axis.z].map(f64::from);
        let depths: Vec<u8> = distances
            .iter()
            .flat_map(|d| ((65535.0 * (offset / d - scale)).round() as u16).to_le_bytes())
            .collect();
        for (texture, bytes, texel) in [(&self.color, &texels, 16), (&self.depth, &depths, 2)] {
            gpu.queue.write_texture(
                texture.as_image_copy(),
                bytes,
                wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(texel * self.taken[0]),
                    rows_per_image: None,
                },
                texture.size(),
            );
        }
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let work = self
            .temporal
            .resolve(&gpu.queue, &mut encoder, view)
            .unwrap();
        assert_eq!(work.draws, 1);
        gpu.queue.submit([encoder.finish()]);
        gpu.read_texture(self.temporal.result().texture())
            .unwrap()
            .chunks_exact(8)
            .map(|t| [0, 2, 4].map(|k| crate::tables::half(u16::from_le_bytes([t[k], t[k + 1]]))))
            .collect()
    }
}

fn still(options: TemporalOptions) -> TemporalOptions {
    TemporalOptions {
        bound: f32::INFINITY,
        frames: 64.0,
        ..options
    }
}

#[test]
fn standing_frames_become_the_picture_of_many_samples() {
    let view = view();
    let truth = truth(&view, &walls);
    for (taken, share) in [(SIZE, 0.12), ([32, 18], 0.25), ([43, 24], 0.2)] {
        for sharp in [false, true] {
            let mut host = Host::new(still(TemporalOptions {
                taken,
                sharp,
                ..TemporalOptions::of(SIZE)
            }));
            let first = apart(&host.frame(&view, &walls), &truth);
            let last = (1..64).fold(first, |_, _| apart(&host.frame(&view, &walls), &truth));
            println!("{taken:?} {sharp}: {first:.4} -> {last:.4}");
            assert!(
                first > 0.05 && last < share * first,
                "{taken:?} {first} {last}"
            );
        }
    }
}

#[test]
fn a_moving_eye_finds_its_frames_again() {
    use veduta::glam::camera::rh::proj::directx;
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    let infinite = view().projection;
    // Greatest depths far away, and nearest.
    let normal = directx::perspective(1.0, aspect, 1.0, 500.0);
    let reversed = directx::perspective(1.0, aspect, 500.0, 1.0);
    for (taken, share, projection) in [
        (SIZE, 0.65, infinite),
        ([43, 24], 0.65, infinite),
        (SIZE, 0.65, normal),
        (SIZE, 0.65, reversed),
    ] {
        let mut host = Host::new(TemporalOptions {
            frames: 16.0,
            ..still(TemporalOptions {
                taken,
                ..TemporalOptions::of(SIZE)
            })
        });
        let mut alone = 0.0;
        let mut last = 0.0;
        for frame in 0..40 {
            let mut view = view();
            let t = f64::from(frame);
            view.eye = view
                .eye
                .moved_by(DVec3::new(0.02 * t, 0.013 * t, -0.01 * t));
            view.look(-0.004 * t, 0.002 * t, 1.0, aspect);
            view.projection = projection;
            let truth = truth(&view, &walls);
            if frame == 39 {
                let mut once = Host::new(still(TemporalOptions {
                    taken,
                    ..TemporalOptions::of(SIZE)
                }));
                alone = apart(&once.frame(&view, &walls), &truth);
            }
            last = apart(&host.frame(&view, &walls), &truth);
        }
        println!("{taken:?}: {alone:.4} -> {last:.4}");
        assert!(
            last < share * alone,
            "{taken:?}: {last}, a frame alone {alone}"
        );
    }
}

#[test]
fn what_was_hidden_has_no_history() {
    let view = view();
    let flat = |near: bool| {
        move |_: DVec3, dir: DVec3| {
            if near && dir.x.abs() < 0.3 {
                ([5.0, 5.0, 5.0], 4.0)
            } else {
                ([0.25, 0.5, 0.125], 40.0)
            }
        }
    };
    let mut host = Host::new(still(TemporalOptions::of(SIZE)));
    for _ in 0..20 {
        host.frame(&view, &flat(true));
    }
    let after = host.frame(&view, &flat(false));
    // Away from the edge of what is gone, of which only the depths around tell.
    for (k, color) in after.iter().enumerate() {
        for (c, value) in [0.25, 0.5, 0.125].into_iter().enumerate() {
            assert!(
                (color[c] - value).abs() < 2e-3 * value,
                "pixel {k}: {color:?}"
            );
        }
    }
}

/// A post before nothing, that the eye passes: squares of the picture without it are left out, and nothing else changes.
#[test]
fn what_shows_nothing_is_left_out() {
    let post = |eye: DVec3, dir: DVec3| {
        let p = eye + dir * ((-20.0 - eye.z) / dir.z);
        if p.x > 6.0 && p.x < 9.0 && p.y < 1.0 {
            let light = (p.x / 0.9).floor() as i64 + (p.y / 0.9).floor() as i64;
            ([0.2 + 0.6 * light.rem_euclid(2) as f64; 3], eye.z + 20.0)
        } else {
            ([0.0; 3], f64::INFINITY)
        }
    };
    for (taken, sharp) in [(SIZE, true), ([32, 18], false), ([26, 15], true)] {
        let run = |has_empty: bool| {
            let mut host = Host::new(still(TemporalOptions {
                taken,
                sharp,
                has_empty,
                ..TemporalOptions::of(SIZE)
            }));
            let mut all = Vec::new();
            for frame in 0..48 {
                // It stands, flies to the right until the post has left the right half, and stands again.
                let t = f64::from(frame - 8).clamp(0.0, 30.0);
                let mut view = view();
                view.eye = view.eye.moved_by(DVec3::new(0.5 * t, 0.0, 0.0));
                all.push(host.frame(&view, &post));
            }
            all
        };
        let (whole, less) = (run(false), run(true));
        for (frame, (a, b)) in whole.iter().zip(&less).enumerate() {
            let off = (0..a.len())
                .flat_map(|k| (0..3).map(move |c| (k, c)))
                .map(|(k, c)| (a[k][c] - b[k][c]).abs())
                .fold(0.0, f64::max);
            assert!(off < 0.01, "{taken:?} frame {frame}: {off}");
        }
        let shown = |p: &[[f64; 3]], left: bool| {
            (0..p.len()).any(|k| (k as u32 % SIZE[0] < 32) == left && p[k][0] > 0.1)
        };
        // The post goes from the right half to the left one, which was left out before, as the other is now.
        assert!(
            !shown(&less[0], true) && shown(&less[0], false),
            "{taken:?}"
        );
        assert!(
            shown(&less[47], true) && !shown(&less[47], false),
            "{taken:?}"
        );
    }
}

#[test]
fn lights_that_change_are_followed() {
    let view = view();
    let lit =
        |by: f64| move |_: DVec3, dir: DVec3| ([by * (1.0 + 0.2 * (9.0 * dir.x).sin()); 3], 40.0);
    let mut host = Host::new(TemporalOptions::of(SIZE));
    for _ in 0..20 {
        host.frame(&view, &lit(1.0));
    }
    let mut after = Vec::new();
    for _ in 0..3 {
        after = host.frame(&view, &lit(0.5));
    }
    let off = apart(&after, &truth(&view, &lit(0.5)));
    assert!(off < 0.02, "{off}");
    host.temporal.reset();
    let off = apart(&host.frame(&view, &lit(0.1)), &truth(&view, &lit(0.1)));
    assert!(off < 2e-3, "{off}");
}

#[test]
fn codes_keep_dim_and_bright_light() {
    let view = view();
    for value in [1e-6, 3e-3, 1.0, 6e4] {
        let mut host = Host::new(still(TemporalOptions::of(SIZE)));
        let mut last = Vec::new();
        for _ in 0..64 {
            last = host.frame(&view, &move |_, _| ([value, 0.77 * value, 0.0], 40.0));
        }
        let mean = |c: usize| last.iter().map(|p| p[c]).sum::<f64>() / last.len() as f64;
        // Half floats of the result end at 6e-8.
        for (c, share) in [(0, 1.0), (1, 0.77)] {
            let off = (mean(c) - share * value).abs();
            assert!(off < 1e-3 * value + 6e-8, "{value}: {}", mean(c));
        }
        assert_eq!(mean(2), 0.0);
    }
}

#[test]
fn what_does_not_fit_is_named() {
    let device = &gpu().device;
    let good = TemporalOptions::of(SIZE);
    for (options, what) in [
        (
            TemporalOptions {
                taken: [0, 3],
                ..good
            },
            "options.taken",
        ),
        (
            TemporalOptions {
                size: [32, 36],
                ..good
            },
            "options.size",
        ),
        (
            TemporalOptions {
                size: [640, 36],
                ..good
            },
            "options.size",
        ),
        (
            TemporalOptions {
                frames: 0.5,
                ..good
            },
            "options.frames",
        ),
        (
            TemporalOptions {
                frames: f32::NAN,
                ..good
            },
            "options.frames",
        ),
        (TemporalOptions { bound: 0.0, ..good }, "options.bound"),
    ] {
        let fault = Temporal::new(device, veduta::programs(), &options).unwrap_err();
        assert!(fault.to_string().contains(what), "{fault}");
    }
    let mut temporal = Temporal::new(device, veduta::programs(), &good).unwrap();
    let mut encoder = device.create_command_encoder(&Default::default());
    let fault = temporal
        .resolve(&gpu().queue, &mut encoder, &view())
        .unwrap_err();
    assert!(fault.to_string().contains("set_host"), "{fault}");
    let of = |size, format| texture(size, format).create_view(&Default::default());
    let depth = of(SIZE, wgpu::TextureFormat::Depth32Float);
    let color = of(SIZE, wgpu::TextureFormat::Rgba16Float);
    for (color, depth, what) in [
        (
            &of([8, 8], wgpu::TextureFormat::Rgba16Float),
            &depth,
            "color",
        ),
        (
            &color,
            &of([8, 8], wgpu::TextureFormat::Depth32Float),
            "depth",
        ),
        (&of(SIZE, wgpu::TextureFormat::Rgba8Uint), &depth, "color"),
        (&color, &color, "depth"),
    ] {
        let fault = temporal.set_host(device, color, depth).unwrap_err();
        assert!(fault.to_string().contains(what), "{fault}");
    }
    temporal.set_host(device, &color, &depth).unwrap();
    let mut flat = view();
    flat.projection =
        veduta::glam::camera::rh::proj::directx::orthographic(-8.0, 8.0, -4.5, 4.5, 1.0, 100.0);
    let fault = temporal
        .resolve(&gpu().queue, &mut encoder, &flat)
        .unwrap_err()
        .to_string();
    assert!(fault.contains("projection"), "{fault}");
    let mut wrong = view();
    wrong.exposure = f32::NAN;
    assert!(
        temporal
            .resolve(&gpu().queue, &mut encoder, &wrong)
            .is_err()
    );
}

/// A host that keeps its own history of views.
#[test]
fn a_view_that_is_told_stands_for_the_last_one() {
    let projection = view().projection;
    let at = |t: f64| {
        let mut view = view();
        view.eye = view.eye.moved_by(DVec3::new(0.03 * t, 0.01 * t, -0.02 * t));
        view.look(-0.005 * t, 0.0, 1.0, SIZE[0] as f32 / SIZE[1] as f32);
        view.projection = projection;
        view
    };
    // Clip space of one view from places relative to another's eye.
    let clip = |from: &View, to: &View| {
        from.projection
            * from.world_from_view.inverse()
            * veduta::glam::Mat4::from_translation(to.eye.relative_to(from.eye).as_vec3())
    };
    let run = |told: &dyn Fn(f64) -> Option<f64>| {
        let mut host = Host::new(still(TemporalOptions::of(SIZE)));
        let mut last = Vec::new();
        for frame in 0..12 {
            let t = f64::from(frame);
            let mut view = at(t);
            view.previous = told(t).map(|before| clip(&at(before), &view));
            last = host.frame(&view, &walls);
        }
        last
    };
    let own = run(&|_| None);
    let same = run(&|t| Some(t - 1.0));
    let wrong = run(&|t| Some(t - 9.0));
    let (off, away) = (apart(&own, &same), apart(&own, &wrong));
    println!("told {off:.5}, wrongly told {away:.4}");
    assert!(off < 2e-3 && away > 10.0 * off.max(1e-3));
    let truth = truth(&at(11.0), &walls);
    assert!(apart(&wrong, &truth) > 1.2 * apart(&own, &truth));
}

/// A slope before a far wall, as rough as ground: posts thinner than samples lie apart, so that frames show and miss them by turns.
fn posts(eye: DVec3, dir: DVec3) -> ([f64; 3], f64) {
    let wall = eye + dir * ((-40.0 - eye.z) / dir.z);
    let post = eye + dir * ((-30.0 - eye.z) / dir.z);
    if (post.x / 1.7).rem_euclid(1.0) < 0.4 {
        ([0.9, 0.7, 0.5], eye.z + 30.0)
    } else {
        let light = 0.2 + 0.1 * (2.0 * wall.y).sin();
        ([light, light, light], eye.z + 40.0)
    }
}

#[test]
fn what_samples_miss_is_kept_where_only_the_eye_moves() {
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    for (way, least) in [(0.0, 0.8), (0.003, 0.85)] {
        let flight = |fixed: bool| {
            let mut host = Host::new(TemporalOptions {
                taken: [17, 10],
                frames: 16.0,
                sharp: false,
                fixed,
                ..still(TemporalOptions::of(SIZE))
            });
            let mut sums = [0.0; 2];
            let mut before: Option<Vec<[f64; 3]>> = None;
            for frame in 0..60 {
                let mut view = view();
                view.eye = view
                    .eye
                    .moved_by(DVec3::new(way * f64::from(frame), 0.0, 0.0));
                view.look(0.0, 0.0, 1.0, aspect);
                let shown = host.frame(&view, &posts);
                if frame >= 30 {
                    sums[0] += apart(&shown, &truth(&view, &posts)) / 30.0;
                    sums[1] += before.map_or(0.0, |old| apart(&shown, &old)) / 30.0;
                }
                before = Some(shown);
            }
            sums
        };
        let [left, kept] = [false, true].map(flight);
        println!("{way} m a frame: error {left:?} -> {kept:?}");
        assert!(
            kept[0] < least * left[0] && kept[1] < 0.6 * left[1],
            "{way}: {left:?} {kept:?}"
        );
    }
}

/// What the eye's own way uncovers keeps nothing of what hid it; where things may move, what was beside an edge trails behind it.
#[test]
fn what_the_way_uncovers_is_left_where_only_the_eye_moves() {
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    // A bright edge 4 m away before a dark wall.
    let edge = |eye: DVec3, dir: DVec3| {
        let near = eye + dir * ((-4.0 - eye.z) / dir.z);
        if near.x < 0.0 {
            ([5.0; 3], eye.z + 4.0)
        } else {
            ([0.25; 3], eye.z + 40.0)
        }
    };
    // The edge moves by 0.9 pixels a frame to the left.
    let step = 0.9 * 4.0 * 2.0 * 0.5_f64.tan() / f64::from(SIZE[1]);
    let trail = |fixed: bool| {
        let mut host = Host::new(TemporalOptions {
            fixed,
            ..still(TemporalOptions::of(SIZE))
        });
        let mut view = view();
        view.look(0.0, 0.0, 1.0, aspect);
        let (mut sum, mut count) = (0.0, 0.0);
        for frame in 0..24 {
            let shown = host.frame(&view, &edge);
            let border = f64::from(SIZE[0]) / 2.0 - 0.9 * f64::from(frame);
            for (k, color) in shown.iter().enumerate() {
                let away = f64::from(k as u32 % SIZE[0]) + 0.5 - border;
                if frame >= 12 && (2.5..8.0).contains(&away) {
                    sum += (color[0] - 0.25).abs();
                    count += 1.0;
                }
            }
            view.eye = view.eye.moved_by(DVec3::new(step, 0.0, 0.0));
        }
        sum / count
    };
    let [left, kept] = [false, true].map(trail);
    println!("behind the edge: {left} -> {kept}");
    assert!(kept < 0.02 && kept < 0.1 * left, "{left} {kept}");
}
