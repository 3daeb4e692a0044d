//! The sea over a land on the plane.

use veduta::WorldPos;
use veduta::glam::{DVec3, Vec3};
use veduta::terrain::{
    Kind, Land, RayPath, Sea, Terrain, TerrainHit, TerrainLights, TerrainOptions, TerrainQuery,
    hit_errors, land_picture,
};

use veduta::reference::field::height_spread;

use crate::common::gpu;

/// Judges `land_at`.
#[test]
fn the_sea_lies_over_the_land_on_the_device_as_on_the_processor() {
    let land = Land::named("islands").unwrap();
    let level = land.sea.unwrap().level;
    let single = land.prepare::<f32>().unwrap();
    let double = land.prepare::<f64>().unwrap();
    let bare = land.field.prepare::<f64>().unwrap();
    let mut query = TerrainQuery::new(gpu(), veduta::programs(), &land).unwrap();
    let places: Vec<WorldPos> = (0..3000)
        .map(|i| {
            let (turn, away) = (f64::from(i) * 2.4, f64::from(i * i) * 0.02);
            WorldPos::from_metres([away * turn.cos(), 0.0, away * turn.sin()].into())
        })
        .collect();
    let mut wet = 0;
    for footprint in [0.0_f32, 50.0] {
        let found = query.heights(&places, footprint).unwrap();
        for (place, found) in places.iter().zip(found) {
            assert_eq!(found, single.ground(*place, footprint));
            let wide = f64::from(footprint);
            let (truth, under) = (double.ground(*place, wide), bare.ground(*place, wide));
            assert_eq!(truth.height, under.height.max(level));
            if under.height < level - 0.1 {
                wet += 1;
                assert_eq!(f64::from(found.height), level);
                assert_eq!((found.slope, found.lost), ([0.0; 2], 0.0));
            }
        }
    }
    assert!((2000..5000).contains(&wet), "{wet} of 6000 places are wet");
    // No height is outside of what is said of the whole and of a part.
    assert_eq!(single.bounds().unwrap().minimum, level);
    let corner = WorldPos::from_metres([3000.0, 0.0, 900.0].into());
    for size in [10.0, 300.0] {
        let over = double.bounds_over(corner, size, 0.0).unwrap();
        for k in 0..100 {
            let at = [k % 10, k / 10].map(|i| f64::from(i) / 9.0 * size);
            let height = double
                .ground(corner.moved_by([at[0], 0.0, at[1]].into()), 0.0)
                .height;
            assert!(over.minimum <= height && height <= over.maximum);
        }
        assert!(over.minimum >= level);
    }
}

#[test]
fn rays_meet_the_sea_and_its_shores() {
    let land = Land::named("islands").unwrap();
    let level = land.sea.unwrap().level;
    let (columns, rows) = (64_usize, 36_usize);
    for (height, pitch) in [(2.0, -1.0), (400.0, -5.0), (10_000.0, -20.0)] {
        let foot = WorldPos::from_metres([14_000.0, 0.0, 0.0].into());
        let ground = land.prepare::<f64>().unwrap().ground(foot, 0.0).height;
        let mut view = veduta::View {
            eye: foot.moved_by([0.0, ground + height, 0.0].into()),
            ..Default::default()
        };
        view.look(
            std::f32::consts::PI.into(),
            f64::to_radians(pitch),
            0.7,
            16.0 / 9.0,
        );
        let (rays, angle) = crate::land::picture_rays(&view, [columns, rows], 60_000.0);
        let mut query = TerrainQuery::new(gpu(), veduta::programs(), &land).unwrap();
        for (path, across) in [(RayPath::Textbook, 1.0), (RayPath::Fast, 0.5)] {
            query.set_baked_from(1);
            let found = query.ray_hits(&rays, angle as f32, path).unwrap();
            let errors = hit_errors(&land, &rays, columns, angle, &found).unwrap();
            let met = |h: &&TerrainHit| h.distance.is_finite() && h.height == level;
            let wet = found.iter().filter(met).count();
            println!(
                "{height} m, {path:?}: {} hits, {wet} of the sea; {} wrong, {} at the silhouette, 99 % within {:.3} footprints",
                errors.across.len(),
                errors.wrong,
                errors.at_silhouette,
                errors.centile(0.99)
            );
            assert_eq!(errors.wrong, 0);
            assert!(errors.at_silhouette <= 8);
            assert!(errors.centile(0.99) <= across);
            assert!(wet > 100 && wet < errors.across.len());
            for hit in found.iter().filter(met) {
                assert!(hit.normal[1] > 0.999, "{hit:?}");
            }
        }
    }
}

#[test]
fn the_picture_of_a_shore_is_that_of_double_precision() {
    let mut land = Land::named("islands").unwrap();
    // Pale rock of one colour, so that what is darker is the sea or its border.
    let m = &mut land.material;
    (m.rock_dark, m.rock_light, m.snow, m.rock_stain) = ([0.8; 3], [0.8; 3], [0.8; 3], 1.0);
    let (columns, rows) = (64_usize, 36_usize);
    let foot = WorldPos::from_metres([14_000.0, 0.0, 0.0].into());
    let mut view = veduta::View {
        eye: foot.moved_by([0.0, 1500.0, 0.0].into()),
        sun: veduta::Light {
            to_light: Vec3::new(0.5, 0.3, 0.3).normalize(),
            ..Default::default()
        },
        ..Default::default()
    };
    view.look(
        std::f32::consts::PI.into(),
        f64::to_radians(-14.0),
        0.7,
        16.0 / 9.0,
    );
    let lights = TerrainLights {
        sun: Vec3::splat(3.0),
        sky: Vec3::splat(std::f32::consts::PI),
        bounce: Vec3::ZERO,
    };
    let far = 60_000.0;
    let truth = land_picture(&land, &view, &lights, [columns, rows], far).unwrap();
    let gpu = gpu();
    let targets = veduta::Targets {
        color_format: wgpu::TextureFormat::Rgba32Float,
        depth_format: Some(wgpu::TextureFormat::Depth32Float),
        ..Default::default()
    };
    let options = TerrainOptions {
        land: land.clone(),
        far,
        exact: true,
        ..Default::default()
    };
    let mut terrain = Terrain::new(&gpu.device, veduta::programs(), &targets, &options).unwrap();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let _ = terrain
        .prepare(&gpu.queue, &mut encoder, &view, &lights, rows as u32)
        .unwrap();
    gpu.queue.submit([encoder.finish()]);
    let (picture, _, _) = crate::land::drawn(&terrain, columns, rows, 0.0);
    let (mut off, mut wet, mut shore, mut grazing, mut count) = (0.0, 0, 0, 0, 0);
    let sea = f64::from(land.sea.unwrap().albedo[2]);
    for (pixel, drawn) in truth.iter().zip(picture.chunks(4)) {
        let Some(pixel) = pixel else { continue };
        let drawn = DVec3::new(drawn[0].into(), drawn[1].into(), drawn[2].into());
        let apart = (DVec3::from_array(pixel.radiance) - drawn).length();
        // Rays that graze a crest and meet the next one here, and not there.
        grazing += i32::from(apart > 0.05);
        off += if apart > 0.05 { 0.0 } else { apart * apart };
        count += 3;
        // Level water under the whole sun.
        let water = sea * (1.0 + 3.0 * f64::from(view.sun.to_light.y) / std::f64::consts::PI);
        let blue = pixel.lit[2];
        wet += i32::from((blue - water).abs() < 1e-6);
        shore += i32::from(blue > water + 1e-6 && blue < 0.4);
    }
    let rms = (off / f64::from(count)).sqrt();
    println!(
        "RMS {rms:.2e} of white; {wet} pixels of sea, {shore} of its border, {grazing} graze, {count} numbers"
    );
    assert!(wet > 300 && shore > 10, "{wet} {shore}");
    assert!(rms < 2e-5 && grazing < 3, "{rms} {grazing}");
}

#[test]
fn seas_that_are_none_are_refused() {
    let fault = |sea: Sea, name: &str| {
        let land = Land {
            sea: Some(sea),
            ..Land::default()
        };
        let text = land.check().unwrap_err().to_string();
        assert!(text.contains(name), "{text}");
        assert!(land.prepare::<f32>().is_err());
    };
    let albedo = [0.1; 3];
    for level in [f64::NAN, 3e4, -3e4] {
        fault(Sea { level, albedo }, "land.sea.level");
    }
    for wrong in [f32::NAN, -0.1, 1.5] {
        let albedo = [0.1, wrong, 0.1];
        fault(Sea { level: 0.0, albedo }, "land.sea.albedo");
    }
    // The processor does not know a program's own function, below the sea or above it.
    let mut land = Land::default();
    land.field.kind = Kind::Own {
        gain: 2.0,
        smoothness: 0.0,
        bounds: None,
    };
    land.sea = Some(Sea { level: 0.0, albedo });
    let height = land
        .prepare::<f64>()
        .unwrap()
        .ground(WorldPos::default(), 0.0)
        .height;
    assert!(height.is_nan());
}

/// The border of the sea within a pixel is as wide as the heights within it differ.
#[test]
fn heights_within_a_footprint_differ_by_what_is_said() {
    for (name, low, high) in [
        ("islands", 0.7, 1.4),
        ("hills", 0.7, 1.4),
        ("thesis", 0.7, 1.4),
    ] {
        let land = Land::named(name).unwrap();
        let field = land.field.prepare::<f64>().unwrap();
        let wavelength = land.field.lattice_wavelength();
        let octaves = f64::from(field.octaves());
        for footprint in [4.0, 60.0, 600.0] {
            let (mut said, mut found) = (0.0, 0.0);
            let (mut dry_off, mut plain_off) = (0.0, 0.0);
            for i in 0..60 {
                let middle = WorldPos::from_metres(
                    [f64::from(i) * 5100.0, 0.0, f64::from(i % 7) * -3700.0].into(),
                );
                let place = field.place(middle);
                let seen = field.ground(middle, footprint);
                let within: Vec<f64> = (0..256)
                    .map(|k| {
                        let at = [k % 16, k / 16]
                            .map(|c| ((f64::from(c) + 0.5) / 16.0 - 0.5) * footprint);
                        field.ground_from(place, at, footprint / 16.0).height - seen.height
                    })
                    .collect();
                let mean = within.iter().sum::<f64>() / 256.0;
                let variance = within.iter().map(|h| (h - mean).powi(2)).sum::<f64>() / 256.0;
                let left = (octaves - (wavelength / footprint).log2()).clamp(0.0, octaves);
                let spread = height_spread(
                    seen.slope,
                    seen.lost,
                    footprint,
                    left,
                    (-land.field.hurst).exp2(),
                );
                said += spread.powi(2);
                found += variance;
                // A sea at the height that is seen, and a little higher.
                let level = 0.5 * variance.sqrt();
                let above = within.iter().filter(|h| **h > level).count() as f64 / 256.0;
                let x = (0.5 - 0.5 * level / (2.24 * spread)).clamp(0.0, 1.0);
                dry_off += (x * x * (3.0 - 2.0 * x) - above).powi(2);
                plain_off += above.powi(2);
            }
            let ratio = (said / found).sqrt();
            let [off, plain] = [dry_off, plain_off].map(|v: f64| (v / 60.0).sqrt());
            println!(
                "{name}, {footprint} m: {ratio:.3} of the deviation; dry share off by {off:.3} RMS, {plain:.3} without a border"
            );
            assert!((low..high).contains(&ratio), "{name}, {footprint}: {ratio}");
            assert!(off < 0.2 && off < 0.6 * plain, "{off}");
        }
    }
}
