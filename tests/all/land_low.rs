//! The ground as the preset `low` draws it, over wide sectors and without steps on the field, and what an eye that moves keeps from frame to frame.

use veduta::glam::Vec3;
use veduta::program::Value;
use veduta::terrain::{
    HitErrors, Land, Terrain, TerrainHit, TerrainLights, TerrainOptions, TerrainRay, hit_errors,
};
use veduta::{Preset, ProgramSet, Targets, View, WorldPos};

use crate::common::gpu;
use crate::land::drawn;

const FAR: f64 = 50_000.0;

/// The preset `low` with sectors of so many texels.
fn widened(width: i64) -> ProgramSet {
    let mut set = veduta::programs().clone();
    let mut changed = 0;
    for preset in set.presets.to_mut().iter_mut().filter(|p| p.name == "low") {
        for (key, value) in preset.values.to_mut() {
            if key == "CLIP_WIDTH" {
                *value = Value::Int(width);
                changed += 1;
            }
        }
    }
    assert_eq!(changed, 1, "`low` says how wide sectors are");
    set
}

fn terrain_of(programs: &ProgramSet, preset: Preset) -> Terrain {
    let targets = Targets {
        color_format: wgpu::TextureFormat::Rgba32Float,
        depth_format: Some(wgpu::TextureFormat::Depth32Float),
        ..Default::default()
    };
    let options = TerrainOptions {
        preset,
        land: Land::named("thesis").unwrap(),
        far: FAR,
        ..Default::default()
    };
    Terrain::new(&gpu().device, programs, &targets, &options).unwrap()
}

/// An eye above a place of the views' ground.
fn eye_above(offset: [f64; 2], height: f64) -> WorldPos {
    let foot = WorldPos::from_metres([13_500.0 + offset[0], 0.0, offset[1] - 14_700.0].into());
    let field = Land::named("thesis").unwrap().field.prepare::<f64>();
    let ground = field.unwrap().ground(foot, 0.0).height;
    foot.moved_by([0.0, ground + height, 0.0].into())
}

fn prepared(terrain: &mut Terrain, view: &View, footprint_rows: u32) {
    let gpu = gpu();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let lights = TerrainLights::clear(Vec3::ONE);
    let _ = terrain
        .prepare(&gpu.queue, &mut encoder, view, &lights, footprint_rows)
        .unwrap();
    gpu.queue.submit([encoder.finish()]);
}

/// The rays through the middles of a picture's pixels, and where the depth that is drawn says that they meet the ground. Footprints are those of a picture of `footprint_rows`.
fn pictured(
    terrain: &mut Terrain,
    view: &View,
    [columns, rows]: [usize; 2],
    footprint_rows: u32,
) -> (Vec<TerrainRay>, Vec<TerrainHit>) {
    prepared(terrain, view, footprint_rows);
    let (_, depths, _) = drawn(terrain, columns, rows, 0.0);
    let [middle, right, up] = view.rays().unwrap().map(|v| v.as_dvec3());
    let forward = view.world_from_view.transform_vector3(Vec3::NEG_Z);
    let [from, scale] = [view.projection.w_axis.z, view.projection.z_axis.z].map(f64::from);
    let at = |k: usize, n: usize| 2.0 * (k as f64 + 0.5) / n as f64 - 1.0;
    (0..)
        .zip(&depths)
        .map(|(i, depth)| {
            let (x, y) = (i % columns, i / columns);
            let dir = (middle + right * at(x, columns) - up * at(y, rows)).normalize();
            let ray = TerrainRay {
                origin: view.eye,
                dir: dir.to_array(),
                far: FAR,
            };
            let distance = match f64::from(*depth) {
                0.0 => f64::INFINITY,
                depth => from / (depth + scale) / dir.dot(forward.as_dvec3()),
            };
            let hit = TerrainHit {
                distance,
                ..TerrainHit::MISS
            };
            (ray, hit)
        })
        .unzip()
}

fn judged(rays: &[TerrainRay], found: &[TerrainHit], columns: usize, angle: f64) -> HitErrors {
    hit_errors(&Land::named("thesis").unwrap(), rays, columns, angle, found).unwrap()
}

/// Judges the hits of `low` as `Temporal` takes them for a picture of 256x144: 67x37 rays, whose footprints are those of 288 rows.
#[test]
fn wide_sectors_lose_no_ground() {
    let size = [67, 37];
    for width in [8, 16] {
        let programs = widened(width);
        let (mut rays_of_all, mut at_silhouette) = (0, 0);
        // Distances that 99 of 100 hits keep to, in footprints: measured 0.39, 0.96, 0.31 and 0.38, with wide and with narrow sectors.
        for (offset, height, pitch, yaw, most) in [
            ([0.0, 0.0], 300.0, 12.0, 0.0, 0.5),
            ([0.0, 0.0], 2.0, 5.0, 0.3, 1.2),
            ([4000.0, -900.0], 700.0, -15.0, 2.0, 0.5),
            ([-7000.0, 3000.0], 1500.0, -4.0, 4.4, 0.5),
        ] {
            let mut terrain = terrain_of(&programs, Preset::Low);
            let mut view = View {
                eye: eye_above(offset, height),
                ..Default::default()
            };
            view.look(yaw, f64::to_radians(pitch), 60_f32.to_radians(), 16.0 / 9.0);
            let (rays, found) = pictured(&mut terrain, &view, size, 288);
            let angle = 2.0 * f64::from(view.rays().unwrap()[2].length()) / 288.0;
            let errors = judged(&rays, &found, size[0], angle);
            let across = errors.centile(0.99);
            println!(
                "{width} texels, {height} m, {pitch} degrees: {} hits, {} wrong, {} at the silhouette, across {across:.2}",
                errors.across.len(),
                errors.wrong,
                errors.at_silhouette,
            );
            assert!(errors.across.len() > 900, "{}", errors.across.len());
            assert_eq!(errors.wrong, 0, "{width} texels, {height} m");
            assert!(across < most, "{width} texels, {height} m: {across}");
            rays_of_all += errors.rays;
            at_silhouette += errors.at_silhouette;
        }
        // 7 of 9916.
        assert!(
            1000 * at_silhouette < 2 * rays_of_all,
            "{width} texels: {at_silhouette} of {rays_of_all}"
        );
    }
}

/// The nearest ground is kept for some metres of flight: what is baked for it must be as fine as what a system that has just been made bakes.
#[test]
fn a_flight_that_comes_down_sees_what_a_standing_eye_sees() {
    let size = [64, 36];
    for preset in [Preset::Low, Preset::High] {
        let mut flying = terrain_of(veduta::programs(), preset.clone());
        for k in 0..=240 {
            // Down from 500 m to 3 m, ever slower, and never turning: only the way it has come makes it look for the ground anew.
            let left = f64::from(240 - k) / 240.0;
            let mut view = View {
                eye: eye_above([300.0 * left, 0.0], 3.0 + 497.0 * left * left),
                ..Default::default()
            };
            view.look(0.3, -0.2, 1.05, 16.0 / 9.0);
            prepared(&mut flying, &view, 72);
            if k % 80 != 0 || k == 0 {
                continue;
            }
            let (rays, found) = pictured(&mut flying, &view, size, 72);
            let mut fresh = terrain_of(veduta::programs(), preset.clone());
            let (_, own) = pictured(&mut fresh, &view, size, 72);
            let angle = 2.0 * f64::from(view.rays().unwrap()[2].length()) / 72.0;
            let [a, b] = [&found, &own].map(|f| judged(&rays, f, size[0], angle));
            println!(
                "{preset:?}, frame {k}: {} and {} hits, wrong {} {}, at the silhouette {} {}, across {:.3} {:.3}",
                a.across.len(),
                b.across.len(),
                a.wrong,
                b.wrong,
                a.at_silhouette,
                b.at_silhouette,
                a.centile(0.99),
                b.centile(0.99),
            );
            // Nearly the same: what is kept is nearer by as much as the eye has moved, so that levels may be finer.
            let apart = a.across.len().abs_diff(b.across.len());
            assert!(apart <= 3 && a.wrong <= b.wrong, "{preset:?}, frame {k}");
            assert!(a.at_silhouette <= b.at_silhouette + 3, "{preset:?}, {k}");
            for share in [0.9, 0.99] {
                let [own, fresh] = [&a, &b].map(|e| e.centile(share));
                assert!(
                    own < 1.2 * fresh + 0.02,
                    "{preset:?}, frame {k}: {own}, {fresh}"
                );
            }
        }
    }
}
