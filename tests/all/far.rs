//! Pictures of the ground far from the origin, against renders in `f64` of the same coordinates.

use veduta::glam::{DVec3, Vec3};
use veduta::reference::post::encode_srgb;
use veduta::reference::tone_map::exponential;
use veduta::terrain::{
    HitErrors, Land, Terrain, TerrainHit, TerrainLights, TerrainOptions, TerrainRay, hit_errors,
    land_picture, land_picture_at,
};
use veduta::view::direction;
use veduta::{Light, ProgramSet, Targets, Value, View, WorldPos};

use crate::common::gpu;

/// The preset `high` with another number of steps of refinement.
fn refined(steps: i64) -> ProgramSet {
    let mut set = veduta::programs().clone();
    for preset in set.presets.to_mut().iter_mut().filter(|p| p.name == "high") {
        for (key, value) in preset.values.to_mut() {
            if key == "REFINE_STEPS" {
                *value = Value::Int(steps);
            }
        }
    }
    set
}

/// PSNR of all pixels, of those whose neighbours are all ground that is lit or all that is not, and the share of those; errors of the drawn depth.
fn judged(
    name: &str,
    offset: i64,
    height: f64,
    pitch: f64,
    sun: f64,
    [steps, texels]: [u32; 2],
    exact: bool,
) -> ([f64; 6], HitErrors) {
    let (columns, rows, far) = (64, 36, 50_000.0);
    let land = Land::named(name).unwrap();
    let mut foot = WorldPos::from_metres(DVec3::new(13_500.0, 0.0, -14_700.0));
    foot.cell.x += offset;
    foot.cell.z -= offset;
    let ground = land
        .field
        .prepare::<f64>()
        .unwrap()
        .ground(foot, 0.0)
        .height;
    let mut view = View {
        eye: foot.moved_by(DVec3::new(0.0, ground + height, 0.0)),
        sun: Light {
            to_light: direction(sun.to_radians(), 2.0).as_vec3(),
            ..Default::default()
        },
        ..Default::default()
    };
    view.look(0.3, pitch.to_radians(), 60_f32.to_radians(), 16.0 / 9.0);
    let mut lights = TerrainLights::clear(Vec3::ONE);
    if sun == 0.0 {
        lights.sun = Vec3::ZERO;
    }
    let truth = land_picture(&land, &view, &lights, [columns, rows], far).unwrap();
    let targets = Targets {
        color_format: wgpu::TextureFormat::Rgba32Float,
        depth_format: Some(wgpu::TextureFormat::Depth32Float),
        ..Default::default()
    };
    let options = TerrainOptions {
        land: land.clone(),
        far,
        texels,
        exact,
        ..Default::default()
    };
    let gpu = gpu();
    let mut terrain =
        Terrain::new(&gpu.device, &refined(i64::from(steps)), &targets, &options).unwrap();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let _ = terrain
        .prepare(&gpu.queue, &mut encoder, &view, &lights, rows as u32)
        .unwrap();
    gpu.queue.submit([encoder.finish()]);
    let (colors, depths, _) = crate::land::drawn(&terrain, columns, rows, 0.0);
    // Where the depth says that the ground is.
    let pixels = view.pixels([columns as u32, rows as u32]).unwrap();
    let (rays, hits): (Vec<TerrainRay>, Vec<TerrainHit>) = (0..columns * rows)
        .map(|i| {
            let at = [i % columns, i / columns].map(|k| k as f64 + 0.5);
            let distance = pixels.distance(at, depths[i]);
            let ray = TerrainRay {
                origin: view.eye,
                dir: pixels.direction(at).to_array(),
                far,
            };
            (
                ray,
                TerrainHit {
                    distance,
                    ..TerrainHit::MISS
                },
            )
        })
        .unzip();
    let angle = pixels.angle();
    let errors = hit_errors(&land, &rays, columns, angle, &hits).unwrap();
    // The light of double precision at the places that were drawn.
    let distances: Vec<f64> = hits.iter().map(|h| h.distance).collect();
    let there = land_picture_at(&land, &view, &lights, [columns, rows], far, &distances).unwrap();
    let state = |i: usize| truth[i].map(|p| (p.sun > 0.999) as i32 - (p.sun < 0.001) as i32);
    let (mut all, mut inner, mut count) = (0.0, 0.0, 0);
    let (mut places, mut lights, mut other) = (0.0, 0.0, 0);
    for i in 0..columns * rows {
        let (x, y) = (i % columns, i / columns);
        let mut plain = state(i) != Some(0) && (depths[i] > 0.0) == truth[i].is_some();
        for v in y.saturating_sub(1)..(y + 2).min(rows) {
            for u in x.saturating_sub(1)..(x + 2).min(columns) {
                let k = v * columns + u;
                plain &= state(k) == state(i);
                // No crest between them, either.
                if let (Some(a), Some(b)) = (truth[i], truth[k]) {
                    plain &= (a.distance / b.distance).ln().abs() < 0.2;
                }
            }
        }
        let shown = |c: [f64; 3]| encode_srgb(exponential(c, 4.0));
        let want = shown(truth[i].map_or([0.0; 3], |p| p.radiance));
        let drawn = if depths[i] > 0.0 {
            &colors[4 * i..4 * i + 3]
        } else {
            &[0.0; 3][..]
        };
        let have = shown([0, 1, 2].map(|k| f64::from(drawn[k])));
        let error: f64 = (0..3).map(|k| (want[k] - have[k]).powi(2)).sum::<f64>() / 3.0;
        all += error;
        let same = shown(there[i].map_or([0.0; 3], |p| p.radiance));
        let apart =
            |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>() / 3.0;
        places += apart(want, same);
        other += i32::from(
            truth[i].map_or(f64::INFINITY, |p| p.distance) / distances[i] > 1.01
                || truth[i].map_or(f64::INFINITY, |p| p.distance) / distances[i] < 0.99,
        );
        lights += apart(same, have);
        if plain {
            inner += error;
            count += 1;
        }
    }
    let psnr = |sum: f64, count: usize| -10.0 * (sum / count.max(1) as f64).max(1e-30).log10();
    let share = count as f64 / (columns * rows) as f64;
    (
        [
            psnr(all, columns * rows),
            psnr(inner, count),
            share,
            psnr(places, columns * rows),
            psnr(lights, columns * rows),
            f64::from(other),
        ],
        errors,
    )
}

/// Judges `field_sun_share`, too: with `exact` the picture has no baked shadow.
#[test]
fn pictures_far_from_the_origin_are_those_of_double_precision() {
    // 60 dB are the aim for ground far off. The shadows of `thesis` are baked, at the resolution of the clipmap, and its crests are kinks: without `exact` 38 to 41 dB with the sun and 48 to 53 dB without are
    // what is measured; the least values only hold that.
    for (name, height, pitch, sun, exact, least) in [
        ("hills", 800.0, -50.0, 60.0, false, 60.0),
        ("thesis", 2500.0, -60.0, 0.0, false, 40.0),
        ("thesis", 2500.0, -60.0, 60.0, false, 36.0),
        ("thesis", 2500.0, -60.0, 0.0, true, 60.0),
        ("thesis", 2500.0, -60.0, 60.0, true, 60.0),
    ] {
        for offset in [0, 100_000_000] {
            let ([all, inner, share, _, _, other], errors) =
                judged(name, offset, height, pitch, sun, [2, 0], exact);
            println!(
                "{name} from {height} m, sun at {sun} degrees, {offset} m off, exact {exact}: {all:.1} dB; {inner:.1} dB in {:.0} % of the pixels; {other} on another crest; depth: {} wrong, {} at the silhouette, {:.3} footprints",
                100.0 * share,
                errors.wrong,
                errors.at_silhouette,
                errors.centile(0.99)
            );
            assert!(all > least, "{name} at {offset} m: {all} dB");
            assert!(errors.wrong == 0 && errors.centile(0.99) < 0.5);
        }
    }
}

/// What stands between the ridged ground and double precision, one thing at a time: rays that graze a crest, and baked shadows.
#[test]
fn what_ridges_lose_is_in_their_crests_and_shadows() {
    for (sun, steps, texels, exact) in [
        (0.0, 2, 0, false),
        (60.0, 2, 0, false),
        (60.0, 4, 1024, false),
        (20.0, 2, 0, true),
    ] {
        let ([all, inner, _, places, lights, other], errors) =
            judged("thesis", 0, 2500.0, -60.0, sun, [steps, texels], exact);
        println!(
            "sun at {sun}, {steps} steps, texels {texels}, exact {exact}: {all:.1} dB, {inner:.1} dB inside; by hits alone {places:.1} dB, by light at the same places {lights:.1} dB; hits {:.4} footprints off, {other} pixels on another crest",
            errors.centile(0.99)
        );
        // Where no shadow is baked the light is right at the places that are drawn; few rays that graze a crest meet the next one.
        assert!(places > 40.0 && lights > if sun == 0.0 || exact { 60.0 } else { 40.0 });
        assert!(other <= 16.0);
    }
}
