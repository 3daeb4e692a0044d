//! Rays over baked heights, shadows, and the ground in a host's pass.

use veduta::WorldPos;
use veduta::terrain::{Land, RayPath, TerrainRay, ray_hits};
use veduta::view::direction;

use crate::common::gpu;

/// Rays of a picture of so many rows, 16:9 and 60 degrees high, from above a place.
fn rays(land: &Land, rows: usize, height: f64, pitch: f64, place: [f64; 2]) -> (Vec<TerrainRay>, f32) {
    let foot = WorldPos::from_metres([place[0], 0.0, place[1]].into());
    let ground = land.field.prepare::<f64>().unwrap().ground(foot, 0.0).height;
    let origin = foot.moved_by([0.0, ground + height, 0.0].into());
    let mut view = veduta::View::default();
    view.look(0.3, f64::to_radians(pitch), 60_f32.to_radians(), 16.0 / 9.0);
    let [middle, right, up] = view.rays().unwrap().map(|v| v.as_dvec3());
    let columns = rows * 16 / 9;
    let mut rays = Vec::new();
    for y in 0..rows {
        for x in 0..columns {
            let at = |i: usize, n: usize| 2.0 * (i as f64 + 0.5) / n as f64 - 1.0;
            let dir = (middle + right * at(x, columns) - up * at(y, rows)).normalize();
            rays.push(TerrainRay {
                origin,
                dir: dir.to_array(),
                far: 50_000.0,
            });
        }
    }
    (rays, (2.0 * up.length() / rows as f64) as f32)
}

#[test]
fn rays_over_baked_heights_meet_the_field() {
    let rows = 72;
    let columns = rows * 16 / 9;
    for (name, height, pitch) in [
        ("thesis", 300.0, 0.0),
        ("thesis", 2.0, 0.0),
        ("hills", 30.0, -8.0),
        ("lowlands", 2500.0, -15.0),
        ("moon", 5000.0, -20.0),
    ] {
        let land = Land::named(name).unwrap();
        let (rays, angle) = rays(&land, rows, height, pitch, [13_500.0, -14_700.0]);
        let found = ray_hits(gpu(), veduta::programs(), &land, &rays, angle, RayPath::Fast).unwrap();
        let field = land.field.prepare::<f64>().unwrap();
        let top = land.field.bounds().unwrap().maximum;
        let truth: Vec<_> = rays
            .iter()
            .map(|r| field.ray_hit(land.planet_radius, top, r, f64::from(angle), 0.05).unwrap())
            .collect();
        // A pixel is next to the silhouette when one of its neighbours sees the other side of it.
        let met = |i: usize| truth[i].distance.is_finite();
        let near_edge = |i: usize| {
            let (x, y) = (i % columns, i / columns);
            (-1..=1_i32).any(|dy| {
                (-1..=1_i32).any(|dx| {
                    let (x, y) = (x as i32 + dx, y as i32 + dy);
                    x >= 0
                        && y >= 0
                        && x < columns as i32
                        && y < rows as i32
                        && met(y as usize * columns + x as usize) != met(i)
                })
            })
        };
        let (mut wrong, mut at_edge, mut capped) = (0, 0, 0);
        let mut errors = Vec::new();
        for (i, (f, t)) in found.iter().zip(&truth).enumerate() {
            capped += i32::from(f.capped);
            match (f.distance.is_finite(), t.distance.is_finite()) {
                (true, true) => {
                    // Across the ray: the distance along it times how steeply it meets the ground.
                    let cosine = (0..3).map(|k| rays[i].dir[k] * t.normal[k]).sum::<f64>().abs();
                    let across = (f.distance - t.distance).abs() * cosine;
                    errors.push(across / (f64::from(angle) * t.distance).max(0.05));
                }
                (false, false) => {}
                _ if near_edge(i) => at_edge += 1,
                _ => wrong += 1,
            }
        }
        errors.sort_by(f64::total_cmp);
        let centile = |share: f64| errors[((errors.len() - 1) as f64 * share) as usize];
        let count = rays.len() as f64;
        println!(
            "{name}, {height} m: {} hits of {count}; wrong {:.3} %, at the silhouette {:.3} %, capped {capped}; error in footprints: median {:.3}, 95 % {:.3}, 99 % {:.3}",
            errors.len(),
            100.0 * f64::from(wrong) / count,
            100.0 * f64::from(at_edge) / count,
            centile(0.5),
            centile(0.95),
            centile(0.99)
        );
        assert!(f64::from(wrong) <= 2e-4 * count, "{name}: {wrong}");
        assert!(f64::from(at_edge) <= 3e-3 * count, "{name}: {at_edge}");
        assert!(centile(0.99) <= 0.5, "{name}");
        assert_eq!(capped, 0, "{name}");
    }
}

#[test]
fn the_sun_shines_where_the_ground_lets_it() {
    // A frame without sky light: black is shadow. Judged against the share of the sun's disc that rays of the reference reach.
    use veduta::glam::Vec3;
    use veduta::terrain::{Terrain, TerrainLights, TerrainOptions};
    let land = Land::named("thesis").unwrap();
    let rows = 36;
    let columns = rows * 16 / 9;
    let (rays, angle) = rays(&land, rows, 600.0, -10.0, [13_500.0, -14_700.0]);
    let field = land.field.prepare::<f64>().unwrap();
    let top = land.field.bounds().unwrap().maximum;
    let gpu = gpu();
    let targets = veduta::Targets {
        color_format: wgpu::TextureFormat::Rgba32Float,
        ..Default::default()
    };
    let options = TerrainOptions {
        land: land.clone(),
        far: 50_000.0,
        ..Default::default()
    };
    let mut terrain = Terrain::new(&gpu.device, veduta::programs(), &targets, &options).unwrap();
    let to_sun = direction(0.35, 1.9);
    let mut view = veduta::View {
        eye: rays[0].origin,
        sun: veduta::Light {
            to_light: to_sun.as_vec3(),
            ..Default::default()
        },
        ..Default::default()
    };
    view.look(0.3, f64::to_radians(-10.0), 60_f32.to_radians(), 16.0 / 9.0);
    let lights = TerrainLights {
        sun: Vec3::splat(std::f32::consts::PI),
        sky: Vec3::ZERO,
        bounce: Vec3::ZERO,
    };
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let work = terrain
        .prepare(&gpu.queue, &mut encoder, &view, &lights, rows as u32)
        .unwrap();
    assert!(work.bakes > 0);
    gpu.queue.submit([encoder.finish()]);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let again = terrain
        .prepare(&gpu.queue, &mut encoder, &view, &lights, rows as u32)
        .unwrap();
    assert_eq!(again, Default::default(), "nothing is done twice");
    let picture = crate::common::draw_with(
        [columns as u32, rows as u32],
        wgpu::TextureFormat::Rgba32Float,
        |pass| {
            let _ = terrain.draw_opaque(pass);
        },
    );
    assert_eq!(picture.not_finite(), 0);
    let (mut wrong, mut judged, mut lit, mut dark) = (0, 0, 0, 0);
    for (i, ray) in rays.iter().enumerate() {
        let hit = field
            .ray_hit(land.planet_radius, top, ray, f64::from(angle), 0.05)
            .unwrap();
        if !hit.distance.is_finite() || hit.distance > 8000.0 {
            continue;
        }
        let toward = (0..3)
            .map(|k| hit.normal[k] * to_sun.to_array()[k])
            .sum::<f64>();
        if toward < 0.25 {
            continue;
        }
        let footprint = f64::from(angle) * hit.distance;
        let start: [f64; 3] =
            std::array::from_fn(|k| ray.dir[k] * hit.distance + hit.normal[k] * footprint);
        let from = TerrainRay {
            origin: ray.origin.moved_by(start.into()),
            dir: to_sun.to_array(),
            far: 30_000.0,
        };
        // Towards both ends of the disc: where they differ there is penumbra, which is not judged.
        let seen = |turn: f64| {
            let dir = direction(0.35 + turn, 1.9).to_array();
            let ray = TerrainRay { dir, ..from };
            !field
                .ray_hit(land.planet_radius, top, &ray, 0.004, footprint.max(1.0))
                .unwrap()
                .distance
                .is_finite()
        };
        let (up, down) = (seen(0.04), seen(-0.04));
        if up != down {
            continue;
        }
        judged += 1;
        lit += i32::from(up);
        dark += i32::from(!up);
        let bright = picture.pixels[i][0] > 0.02;
        wrong += i32::from(bright != up);
    }
    println!("{wrong} of {judged} wrong, {lit} lit and {dark} dark");
    assert!(lit > 100 && dark > 20);
    assert!(f64::from(wrong) <= 0.02 * f64::from(judged));
}
