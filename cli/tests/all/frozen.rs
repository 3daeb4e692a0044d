//! The frozen baseline against the numbers that it was specified with.

use veduta_cli::camera::ground_height;
use veduta_cli::catalog::{Catalog, SourceArgs};
use veduta_cli::commands::render::{Job, RenderArgs};
use veduta_cli::render::Size;
use veduta_compose::keys::Value;
use veduta_compose::settings::resolve;

/// Eye height above ground, pitch, field of view, sun height, sun azimuth from the view.
const VIEWS: [(&str, [f64; 5]); 12] = [
    ("V01", [300.0, 12.0, 60.0, 30.0, 120.0]),
    ("V02", [2.0, 0.0, 60.0, 60.0, 90.0]),
    ("V03", [50.0, -10.0, 60.0, 10.0, 90.0]),
    ("V04", [2.0, 20.0, 60.0, 5.0, 30.0]),
    ("V05", [300.0, 3.0, 60.0, 1.0, 0.0]),
    ("V06", [300.0, 3.0, 60.0, 1.0, 180.0]),
    ("V07", [300.0, 3.0, 60.0, -4.0, 0.0]),
    ("V08", [300.0, 70.0, 60.0, 45.0, 60.0]),
    ("V09", [4750.0, 0.0, 60.0, 30.0, 60.0]),
    ("V10", [9000.0, -15.0, 60.0, 30.0, 120.0]),
    ("V11", [30000.0, -6.0, 60.0, 15.0, 90.0]),
    ("V12", [1500.0, -1.0, 10.0, 20.0, 100.0]),
];

#[test]
fn twelve_views_are_as_they_were_specified() {
    let catalog = Catalog::load(&SourceArgs::default()).unwrap();
    assert_eq!(catalog.views().len(), VIEWS.len());
    for (name, numbers) in VIEWS {
        let view = catalog.view(name).unwrap();
        let found = [
            view.eye_height,
            view.pitch_deg,
            view.fov_deg,
            view.sun_height_deg,
            view.sun_azimuth_deg,
        ];
        assert_eq!(found, numbers, "{name}");
    }
}

#[test]
fn the_preset_thesis_is_as_it_was_specified() {
    let catalog = Catalog::load(&SourceArgs::default()).unwrap();
    let settings = |preset: &str| {
        let scene = catalog.scene_of("thesis").unwrap();
        resolve(
            catalog.keys(),
            catalog.preset_table(),
            preset,
            Some(scene),
            &[],
        )
        .unwrap()
    };
    let number = |preset: &str, key: &str| -> f64 {
        match settings(preset).values[key] {
            Value::Flag(v) => f64::from(u8::from(v)),
            Value::Int(v) => v as f64,
            Value::Float(v) => v,
            Value::Vec3(_) => panic!("{key} is no number"),
        }
    };
    for (key, value) in [
        ("OCTAVES", 10.0),
        ("OCTAVES_SHADOW", 6.0),
        ("OCTAVES_NORMAL", 11.0),
        ("STEP_FACTOR", 0.5),
        ("MAX_MARCHING_STEPS", 200.0),
        ("MAX_MARCHING_STEPS_SHADOW", 60.0),
        ("TEXTURE_LOW_QUALITY", 0.0),
        ("TEXTURE_FILTERING", 0.0),
        ("ATMOS_STEPS", 16.0),
        ("ATMOS_LIGHT_STEPS", 8.0),
        ("CLOUDS_HEIGHT", 4000.0),
        ("CLOUDS_THICKNESS", 1500.0),
        ("MAX_CLOUD_DISTANCE", 80_000.0),
        ("CLOUD_STEPS", 64.0),
        ("CLOUD_LIGHT_STEPS", 12.0),
        ("CLOUD_SKIP", 0.0),
        ("LOW_QUALITY", 0.0),
    ] {
        assert_eq!(number("thesis", key), value, "{key}");
    }
    // Periodic over 16 km, 60 per km at full density.
    let period =
        number("thesis", "CLOUD_SCALE") * number("thesis", "CLOUD_PERIOD_DOUBLINGS").exp2();
    assert_eq!(period, 16_000.0);
    let extinction = number("thesis", "CLOUD_SCATTERING") + number("thesis", "CLOUD_ABSORPTION");
    assert_eq!(extinction * number("thesis", "CLOUD_DENSITY"), 0.06);
    // The same, but for skipping.
    let values = |name: &str| {
        let mut values = settings(name).values;
        values.remove("CLOUD_SKIP");
        values
    };
    assert_eq!(number("thesis_skip", "CLOUD_SKIP"), 1.0);
    assert_eq!(values("thesis_skip"), values("thesis"));
}

#[test]
fn views_stand_where_they_say() {
    let size = Size {
        width: 64,
        height: 36,
    };
    for (name, numbers) in VIEWS {
        let job = Job::new(&RenderArgs {
            scene: "thesis".to_owned(),
            preset: Some("thesis".to_owned()),
            view: Some(name.to_owned()),
            ..RenderArgs::default()
        })
        .unwrap();
        let view = job.view(0.0, size).unwrap();
        let ground = ground_height(job.catalog.set(), &job.settings, view.eye).unwrap();
        let altitude = view.eye.altitude();
        assert!((altitude - ground - numbers[0]).abs() < 1e-3, "{name}");
        let within = (4000.0..5500.0).contains(&altitude);
        assert_eq!(within, name == "V09", "{name} at {altitude} m");
    }
}
