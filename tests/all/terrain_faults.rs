//! What `Terrain` refuses, on the plane and over a ball.

use veduta::glam::Vec3;
use veduta::landscape::{Depth, Projection};
use veduta::terrain::{Land, Terrain, TerrainLights, TerrainOptions};
use veduta::{Targets, View};

use crate::common::gpu;

fn targets() -> Targets {
    Targets {
        depth_format: Some(wgpu::TextureFormat::Depth32Float),
        ..Default::default()
    }
}

fn options(land: &str) -> TerrainOptions {
    TerrainOptions {
        land: Land::named(land).unwrap(),
        texels: 128,
        ..Default::default()
    }
}

fn made(targets: &Targets, options: &TerrainOptions) -> Result<Terrain, veduta::Error> {
    Terrain::new(&gpu().device, veduta::programs(), targets, options)
}

#[test]
fn targets_and_options_that_no_terrain_can_have_are_refused() {
    for land in ["thesis", "luna"] {
        let refused = |targets: Targets, options: TerrainOptions, words: [&str; 2]| {
            let text = made(&targets, &options).unwrap_err().to_string();
            assert!(words.iter().all(|w| text.contains(w)), "{land}: {text}");
        };
        let bare = Targets {
            depth_format: None,
            ..targets()
        };
        refused(bare, options(land), ["targets.depth_format", "None"]);
        let flat = Targets {
            projection: Projection::Orthographic,
            ..targets()
        };
        refused(flat, options(land), ["targets.projection", "Orthographic"]);
        let sectors = TerrainOptions {
            sky_sectors: 17,
            ..options(land)
        };
        refused(targets(), sectors, ["terrain.sky_sectors", "17"]);
        for far in [f64::NAN, 99.0, 2e9] {
            let far = TerrainOptions {
                far,
                ..options(land)
            };
            refused(targets(), far, ["terrain.far", "100"]);
        }
        let mut odd = options(land);
        odd.land.planet_radius = f64::NAN;
        refused(targets(), odd, ["planet_radius", "NaN"]);
    }
    let texels = TerrainOptions {
        texels: 300,
        ..options("thesis")
    };
    let text = made(&targets(), &texels).unwrap_err().to_string();
    assert!(
        text.contains("terrain.texels") && text.contains("300"),
        "{text}"
    );
}

#[test]
fn frames_that_no_terrain_can_draw_are_refused() {
    let gpu = gpu();
    for land in ["thesis", "luna"] {
        let mut terrain = made(&targets(), &options(land)).unwrap();
        let mut good = View::default();
        good.look(0.3, -0.2, 1.0, 1.8);
        let lights = TerrainLights::clear(Vec3::ONE);
        let mut refused = |view: &View, lights: &TerrainLights, rows: u32, word: &str| {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let text = terrain
                .prepare(&gpu.queue, &mut encoder, view, lights, rows)
                .unwrap_err()
                .to_string();
            assert!(text.contains(word), "{land}: {text}");
        };
        refused(&good, &lights, 0, "rows");
        for (name, broken) in [
            (
                "lights.sun",
                TerrainLights {
                    sun: Vec3::NAN,
                    ..lights
                },
            ),
            (
                "lights.sky",
                TerrainLights {
                    sky: Vec3::splat(-1.0),
                    ..lights
                },
            ),
            (
                "lights.bounce",
                TerrainLights {
                    bounce: Vec3::INFINITY,
                    ..lights
                },
            ),
        ] {
            refused(&good, &broken, 36, name);
        }
        let mut nowhere = good;
        nowhere.eye.frac.x = f32::NAN;
        refused(&nowhere, &lights, 36, "eye");
        let mut blind = good;
        blind.exposure = f32::NAN;
        refused(&blind, &lights, 36, "exposure");
        // The targets have reversed depth; this projection has not.
        let mut turned = good;
        turned.projection =
            veduta::glam::camera::rh::proj::directx::perspective(1.0, 1.8, 0.1, 1e5);
        refused(&turned, &lights, 36, "projection");
        // And the other way round.
        let normal = Targets {
            depth: Depth::Normal,
            ..targets()
        };
        let mut other = made(&normal, &options(land)).unwrap();
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let text = other
            .prepare(&gpu.queue, &mut encoder, &good, &lights, 36)
            .unwrap_err()
            .to_string();
        assert!(
            text.contains("projection") && text.contains("Normal"),
            "{text}"
        );
        // Lights by the height of the sun.
        let text = terrain
            .set_lights_by_sun(Some(&[lights; 31]))
            .unwrap_err()
            .to_string();
        assert!(text.contains("lights") && text.contains("31"), "{text}");
        let mut table = vec![lights; 32];
        table[31].sky.y = f32::NAN;
        let text = terrain.set_lights_by_sun(Some(&table)).unwrap_err();
        assert!(text.to_string().contains("lights.sky"), "{text}");
        // What was refused has left it as it was.
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let work = terrain
            .prepare(&gpu.queue, &mut encoder, &good, &lights, 36)
            .unwrap();
        assert!(work.writes > 0);
    }
}
