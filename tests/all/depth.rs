//! The depth that the ground writes, for every convention.

use veduta::glam::camera::rh::proj::directx;
use veduta::glam::{DVec3, Vec3};
use veduta::landscape::Depth;
use veduta::terrain::{Land, Terrain, TerrainLights, TerrainOptions};
use veduta::{Targets, View, WorldPos};

use crate::common::gpu;

/// From the depth alone a host finds the place that the ground was hit at: it must lie on the field.
#[test]
fn every_depth_leads_back_to_the_ground() {
    let land = Land::named("thesis").unwrap();
    let field = land.field.prepare::<f64>().unwrap();
    let (rows, columns) = (36_usize, 64_usize);
    let foot = WorldPos::from_metres([13_500.0, 0.0, -14_700.0].into());
    let ground = field.ground(foot, 0.0).height;
    let (near, far) = (0.5_f32, 60_000.0_f32);
    let (angle, aspect) = (60_f32.to_radians(), 16.0 / 9.0);
    for (depth, projection) in [
        (
            Depth::Normal,
            directx::perspective(angle, aspect, near, far),
        ),
        (
            Depth::Reversed,
            directx::perspective(angle, aspect, far, near),
        ),
        (
            Depth::ReversedInfinite,
            directx::perspective_infinite_reverse(angle, aspect, near),
        ),
    ] {
        let targets = Targets {
            color_format: wgpu::TextureFormat::Rgba32Float,
            depth_format: Some(wgpu::TextureFormat::Depth32Float),
            depth,
            ..Default::default()
        };
        let options = TerrainOptions {
            land: land.clone(),
            far: 50_000.0,
            ..Default::default()
        };
        let gpu = gpu();
        let programs = veduta::programs();
        let mut terrain = Terrain::new(&gpu.device, programs, &targets, &options).unwrap();
        let mut view = View {
            eye: foot.moved_by([0.0, ground + 300.0, 0.0].into()),
            ..Default::default()
        };
        view.look(0.3, f64::to_radians(-12.0), angle, aspect);
        view.projection = projection;
        let lights = TerrainLights::clear(Vec3::ONE);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let _ = terrain
            .prepare(&gpu.queue, &mut encoder, &view, &lights, rows as u32)
            .unwrap();
        gpu.queue.submit([encoder.finish()]);
        let clear = if depth == Depth::Normal { 1.0 } else { 0.0 };
        let (_, depths, _) = crate::land::drawn(&terrain, columns, rows, clear);
        let pixels = view.pixels([columns as u32, rows as u32]).unwrap();
        // What is cleared lies on the far plane, if there is one.
        let nothing = pixels.distance([32.0, 18.0], clear);
        assert!(match depth {
            Depth::ReversedInfinite => nothing.is_infinite(),
            _ => (nothing / f64::from(far) - 1.0).abs() < 0.02,
        });
        let stretched = View {
            world_from_view: view.world_from_view
                * veduta::glam::Mat4::from_scale(Vec3::splat(2.0)),
            ..view
        };
        let same = stretched.pixels([columns as u32, rows as u32]).unwrap();
        let [a, b] = [&same, &pixels].map(|p| p.distance([20.0, 9.0], 0.37));
        assert!((a - b).abs() < 1e-5 * b, "{a} {b}");
        let inverse = projection.as_dmat4().inverse();
        let world = view.world_from_view.as_dmat4();
        let pixel_angle = 2.0 * f64::from(angle / 2.0).tan() / rows as f64;
        let eye = field.place(view.eye);
        let radius = land.planet_radius + view.eye.altitude();
        let (mut seen, mut worst, mut off) = (0, 0.0_f64, Vec::new());
        for (i, written) in depths.iter().enumerate() {
            if *written == clear {
                continue;
            }
            let at = |k: usize, n: usize| 2.0 * (k as f64 + 0.5) / n as f64 - 1.0;
            let [x, y] = [at(i % columns, columns), -at(i / columns, rows)];
            let place = |depth: f64| {
                let p = inverse.project_point3(DVec3::new(x, y, depth));
                world.transform_point3(p)
            };
            let p = place(f64::from(*written));
            let distance = p.length();
            let pixel = [i % columns, i / columns].map(|k| k as f64 + 0.5);
            // What hosts are given is the same as by the inverse of the matrix.
            let said = pixels.distance(pixel, *written);
            assert!(
                (said - distance).abs() < 2e-5 * distance,
                "{depth:?}: {said} {distance}"
            );
            assert!(pixels.direction(pixel).distance(p / distance) < 1e-6);
            // What the next number of the format stands for.
            let next = f32::from_bits(written.to_bits() ^ 1);
            let grain = (place(f64::from(next)) - p).length();
            let altitude =
                (p.x * p.x + (p.y + radius).powi(2) + p.z * p.z).sqrt() - land.planet_radius;
            let footprint = pixel_angle * distance;
            let g = field.ground_from(eye, [p.x, p.z], footprint);
            let across = (altitude - g.height).abs() * g.normal()[1];
            seen += 1;
            worst = worst.max(grain / footprint);
            off.push((across / (footprint + 2.0 * grain)).min(1e3));
        }
        off.sort_by(f64::total_cmp);
        let high = off[off.len() * 98 / 100];
        println!(
            "{depth:?}: {seen} pixels, {high:.3} footprints off the field at 98 %, the format's grain is at most {worst:.3} footprints"
        );
        assert!(seen > 1000, "{depth:?}");
        assert!(high <= 0.04, "{depth:?}: {high}");
    }
}
