//! The examples, run without a window.

#[allow(dead_code)]
#[path = "../../examples/earth_and_moon.rs"]
mod earth_and_moon;
#[allow(dead_code)] // Its `main` only prints what `draw` returns.
#[path = "../../examples/host_app.rs"]
mod host_app;
#[allow(dead_code)]
#[path = "../../examples/joined_terrain.rs"]
mod joined_terrain;
#[allow(dead_code)]
#[path = "../../examples/sky_over_host.rs"]
mod sky_over_host;

#[allow(dead_code)]
#[path = "../../examples/terrain_and_mesh.rs"]
mod terrain_and_mesh;

#[test]
fn host_app_draws_a_landscape_in_under_80_lines() {
    let source = include_str!("../../examples/host_app.rs");
    assert!(source.lines().count() < 80, "{}", source.lines().count());

    let pixels = host_app::draw().unwrap();
    let (width, height) = (128, 72);
    assert_eq!(pixels.len(), 4 * width * height);
    let mean = |rows: std::ops::Range<usize>, channel: usize| {
        let part = &pixels[4 * width * rows.start..4 * width * rows.end];
        let sum: f64 = part
            .iter()
            .skip(channel)
            .step_by(4)
            .map(|b| f64::from(*b))
            .sum();
        sum / (width * rows.len()) as f64
    };
    let sky = [0, 1, 2].map(|c| mean(0..8, c));
    let ground = [0, 1, 2].map(|c| mean(height - 8..height, c));
    println!("sky {sky:.1?}, ground {ground:.1?}");
    // The clear sky away from the sun is blue and brighter than black, and the ground is something else.
    assert!(sky[2] > sky[0] + 5.0 && sky[2] > 30.0, "{sky:?}");
    assert!(
        (sky[2] - sky[0]) > (ground[2] - ground[0]) + 5.0,
        "{sky:?} {ground:?}"
    );
    assert!(
        pixels.chunks(4).all(|p| p[3] == 255),
        "every pixel is opaque"
    );
}

#[test]
fn joined_terrain_is_sharper_with_every_frame() {
    let size = [96, 54];
    let picture = |frames| -> Vec<f32> {
        joined_terrain::draw(size, frames, 0.0)
            .unwrap()
            .chunks_exact(2)
            .map(|b| joined_terrain::number([b[0], b[1]]))
            .collect()
    };
    let truth = picture(256);
    let off = |frames| {
        let squares = picture(frames)
            .iter()
            .zip(&truth)
            .map(|(a, b)| (a - b).powi(2))
            .sum::<f32>();
        (squares / truth.len() as f32).sqrt()
    };
    let errors = [1, 4, 32].map(off);
    println!("{errors:?}");
    assert_eq!(truth.len(), 4 * 96 * 54);
    assert!(truth.iter().all(|v| v.is_finite()));
    assert!(
        errors[1] < 0.9 * errors[0] && errors[2] < 0.6 * errors[1],
        "{errors:?}"
    );
}

#[test]
fn sky_over_host_puts_air_before_the_hosts_things() {
    let size = [96, 54];
    let draw = |altitude, sun_height, pitch| {
        let shot = sky_over_host::Shot {
            altitude,
            sun_height,
            pitch,
        };
        sky_over_host::draw(size, &shot).unwrap()
    };
    let mean = |pixels: &[u8], [x, y]: [usize; 2]| {
        [0, 1, 2].map(|c| {
            let sum: u32 = (0..16)
                .map(|i| u32::from(pixels[4 * (96 * (y + i / 4) + x + i % 4) + c]))
                .sum();
            f64::from(sum) / 16.0
        })
    };
    let noon = draw(2.0, 40.0, 0.0);
    let (sky, ground) = (mean(&noon, [30, 2]), mean(&noon, [30, 45]));
    println!("sky {sky:.1?}, ground {ground:.1?}");
    assert!(sky[2] > sky[0] + 15.0 && ground[1] > ground[2] + 15.0);
    let dusk = draw(2.0, 2.0, 0.0);
    let dark = mean(&dusk, [30, 45]);
    assert!(
        dark.iter().zip(ground).all(|(a, b)| *a < 0.6 * b),
        "{dark:?}"
    );
    // From above, the air turns what lies far away blue, and space is black.
    let high = draw(10_000.0, 40.0, -8.0);
    let (far, near) = (mean(&high, [40, 28]), mean(&high, [40, 50]));
    println!("far {far:.1?}, near {near:.1?}");
    assert!(far[2] - far[0] > near[2] - near[0] && far[2] > near[2]);
    let space = draw(200_000.0, 40.0, -25.0);
    assert!(mean(&space, [40, 2]).iter().all(|v| *v <= 1.0));
    assert!(mean(&space, [40, 45])[2] > 50.0);
}

#[test]
fn earth_and_moon_shows_the_limb_before_the_stars() {
    let size = [96, 54];
    let shot = earth_and_moon::Shot {
        altitude: 400.0,
        sun_height: 10.0,
        sun_azimuth: 110.0,
        fov: 5.0,
    };
    let pixels = earth_and_moon::draw(size, &shot).unwrap();
    let at = |x: usize, y: usize| &pixels[4 * (96 * y + x)..4 * (96 * y + x) + 3];
    let row = |y: usize| -> [u32; 3] {
        std::array::from_fn(|c| (0..96).map(|x| u32::from(at(x, y)[c])).sum::<u32>() / 96)
    };
    // Space above, then the blue of the limb, then the lit ground.
    let (space, limb, ground) = (row(2), row(26), row(50));
    println!("{space:?} {limb:?} {ground:?}");
    assert!(space.iter().all(|v| *v < 12));
    assert!(limb[2] > 60 && limb[2] > limb[0] + 20);
    assert!(ground.iter().all(|v| *v > 90));
    // The Moon is lit from the right.
    let bright = |x: usize| (15..21).map(|y| u32::from(at(x, y)[0])).max().unwrap_or(0);
    let moon: Vec<usize> = (20..45).filter(|x| bright(*x) > 60).collect();
    println!("{moon:?}");
    assert!(!moon.is_empty() && moon.len() < 12);
}

#[test]
fn terrain_and_mesh_hides_what_stands_behind_the_ground() {
    use terrain_and_mesh::{Tower, draw, row};
    let size = [96, 54];
    let red = |pixels: &[u8]| {
        pixels
            .chunks(4)
            .filter(|p| f64::from(p[0]) > 2.0 * f64::from(p[1]) && p[0] > 40)
            .count()
    };
    let empty = draw(size, &[]).unwrap();
    let shown = draw(size, &row()).unwrap();
    let sunk: Vec<Tower> = row()
        .into_iter()
        .map(|t| Tower { rise: -400.0, ..t })
        .collect();
    let behind = draw(size, &sunk).unwrap();
    let apart = |a: &[u8], b: &[u8]| a.chunks(4).zip(b.chunks(4)).filter(|(p, q)| p != q).count();
    println!(
        "{} red pixels, {} differ; sunk: {} red, {} differ",
        red(&shown),
        apart(&shown, &empty),
        red(&behind),
        apart(&behind, &empty)
    );
    assert!(red(&empty) == 0 && red(&shown) > 20);
    assert!(apart(&shown, &empty) < 96 * 54 / 4);
    assert_eq!(behind, empty);
    // Sky above, ground below.
    let mean = |y: usize, c: usize| -> u32 {
        (0..96)
            .map(|x| u32::from(empty[4 * (96 * y + x) + c]))
            .sum::<u32>()
            / 96
    };
    assert!(mean(1, 2) > mean(1, 0) + 20, "blue");
    assert!(mean(52, 2) < mean(1, 2));
}
