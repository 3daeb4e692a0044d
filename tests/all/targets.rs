//! What systems say to targets that they cannot draw into, and to lands that their programs do not know.

use veduta::terrain::{Land, RayPath, Terrain, TerrainOptions, TerrainQuery, TerrainRay};
use veduta::{Targets, WorldPos};

use crate::common::gpu;

fn text<T>(made: Result<T, veduta::Error>) -> String {
    match made {
        Ok(_) => panic!("taken"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn targets_that_cannot_be_drawn_into_are_refused() {
    use wgpu::TextureFormat as F;
    let good = Targets {
        depth_format: Some(F::Depth32Float),
        ..Default::default()
    };
    let device = &gpu().device;
    good.check_on(device).unwrap();
    for (targets, name) in [
        (
            Targets {
                depth_format: Some(F::Rgba8Unorm),
                ..good
            },
            "targets.depth_format",
        ),
        (
            Targets {
                depth_format: Some(F::Stencil8),
                ..good
            },
            "targets.depth_format",
        ),
        (
            Targets {
                color_format: F::Depth32Float,
                ..good
            },
            "targets.color_format",
        ),
        (
            Targets {
                color_format: F::Bc1RgbaUnorm,
                ..good
            },
            "targets.color_format",
        ),
        (
            Targets {
                color_format: F::Rgb9e5Ufloat,
                ..good
            },
            "targets.color_format",
        ),
        (
            Targets {
                sample_count: 3,
                ..good
            },
            "targets.sample_count",
        ),
        (
            Targets {
                sample_count: 8,
                ..good
            },
            "targets.sample_count",
        ),
    ] {
        let fault = text(targets.check_on(device));
        assert!(fault.contains(name), "{fault}");
        for land in ["thesis", "terra"] {
            let options = TerrainOptions {
                land: Land::named(land).unwrap(),
                ..Default::default()
            };
            let fault = text(Terrain::new(device, veduta::programs(), &targets, &options));
            assert!(fault.contains(name), "{land}: {fault}");
        }
    }
}

/// Without a module plugged in, the height in its place is that of other mountains.
#[test]
fn a_programs_own_height_that_is_not_plugged_in_is_refused() {
    let mut land = Land::default();
    land.field.kind = veduta::terrain::Kind::Own {
        gain: 2.0,
        smoothness: 0.0,
        bounds: None,
    };
    let programs = veduta::programs();
    let named = |fault: String, program: &str| {
        assert!(
            fault.contains("field.kind") && fault.contains(program) && fault.contains("plug"),
            "{fault}"
        );
    };
    let targets = Targets {
        depth_format: Some(wgpu::TextureFormat::Depth32Float),
        ..Default::default()
    };
    let options = TerrainOptions {
        land: land.clone(),
        ..Default::default()
    };
    let made = Terrain::new(&gpu().device, programs, &targets, &options);
    named(text(made), "terrain_bake");
    let mut query = TerrainQuery::new(gpu(), programs, &land).unwrap();
    let origin = WorldPos::from_metres([0.0, 9000.0, 0.0].into());
    named(text(query.heights(&[origin], 0.0)), "terrain_heights");
    let ray = TerrainRay {
        origin,
        dir: [0.0, -1.0, 0.0],
        far: 1e5,
    };
    for path in [RayPath::Textbook, RayPath::Fast] {
        named(text(query.ray_hits(&[ray], 0.001, path)), "terrain_rays");
    }
    query.set_baked_from(1);
    let baked = query.ray_hits(&[ray], 0.001, RayPath::Fast);
    named(text(baked), "terrain_");
}
