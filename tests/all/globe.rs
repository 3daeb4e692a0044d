//! Height fields on a ball: the device, the processor and the definition; rays from orbit; depth and normals.

use veduta::WorldPos;
use veduta::reference::globe as reference;
use veduta::reference::parallel::parallel_map;
use veduta::terrain::{
    Domain, Globe, HeightField, Kind, Land, RayPath, TerrainHit, TerrainQuery, TerrainRay,
    globe_heights, ray_hits,
};

use crate::common::{Random, gpu};

fn unit(random: &mut Random) -> [f64; 2] {
    let height = 2.0 * f64::from(random.unit()) - 1.0;
    [
        height.asin(),
        std::f64::consts::TAU * f64::from(random.unit()),
    ]
}

/// One of each kind, with a relief of about 8 km.
fn lands() -> Vec<(&'static str, Land)> {
    let with = |kind, wavelength, amplitude, hurst| Land {
        field: HeightField {
            kind,
            domain: Domain::Sphere,
            wavelength,
            amplitude,
            hurst,
            octaves: 12,
            ..HeightField::default()
        },
        ..Land::default()
    };
    let craters = Kind::Craters {
        share: 0.5,
        roughness: 0.1,
    };
    let ridged = Kind::Ridged {
        gain: 2.0,
        smoothness: 0.01,
    };
    vec![
        ("fbm", with(Kind::Fbm, 100_000.0, 3000.0, 1.0)),
        ("ridged", with(ridged, 60_000.0, 4000.0, 0.9)),
        (
            "hybrid",
            with(Kind::Hybrid { offset: 0.7 }, 100_000.0, 2500.0, 0.25),
        ),
        ("craters", with(craters, 200_000.0, 9000.0, 1.0)),
    ]
}

/// Those that come with the crate, and one of each kind with the widest lattice that there is and 16 octaves.
fn widest() -> Vec<(&'static str, Land)> {
    let mut all: Vec<_> = ["luna", "terra"]
        .map(|name| (name, Land::named(name).unwrap()))
        .into();
    for (name, mut land) in lands() {
        land.field.wavelength = (0.25 * land.planet_radius).min(1e6);
        land.field.octaves = 16;
        if name == "craters" {
            land.field.amplitude = 20_000.0;
        }
        all.push((name, land));
    }
    // Steeper: beyond what the fractions of such wide cells can tell in f32.
    let (_, mut steep) = lands().remove(0);
    steep.field.wavelength = (0.25 * steep.planet_radius).min(1e6);
    steep.field.octaves = 16;
    steep.field.hurst = 0.5;
    all.push(("steep", steep));
    all
}

fn block(globe: &Globe<f32>, eye: WorldPos) -> reference::Globe {
    let b = globe.block(eye, 0.0);
    let wide = |v: [f32; 3]| v.map(f64::from);
    reference::Globe {
        cell: b.cell,
        wavelength: f64::from(b.wavelength),
        frac: wide(b.frac),
        amplitude: f64::from(b.amplitude),
        up: wide(b.up),
        base: f64::from(b.base),
        ground_radius: f64::from(b.ground_radius),
        eye_altitude: f64::from(b.eye_altitude),
        fall: f64::from(b.fall),
        shape: f64::from(b.shape),
        detail: f64::from(b.detail),
        octaves: b.octaves,
        seed: b.seed,
        sea: f64::from(b.sea),
        mean: b.mean.map(f64::from),
        lost: b.lost.map(f64::from),
        low: f64::from(b.low),
        high: f64::from(b.high),
        steepest: f64::from(b.steepest),
        tallest: f64::from(b.tallest),
        steep: f64::from(b.steep),
        steep_growth: f64::from(b.steep_growth),
    }
}

#[test]
fn a_ball_is_the_same_on_the_device_the_processor_and_by_definition() {
    let mut random = Random(1);
    for (name, land) in lands().into_iter().chain(widest()) {
        let (single, double) = (land.globe::<f32>().unwrap(), land.globe::<f64>().unwrap());
        let (mut same, mut total) = (0, 0);
        let (mut low, mut high, mut steepest) = (f32::INFINITY, f32::NEG_INFINITY, 0_f64);
        let (mut worst, mut off, mut definition, mut tilt) = (0_f64, 0_f64, 0_f64, 0_f64);
        for width in [0.0, 100.0, 3000.0, 30_000.0] {
            let places: Vec<WorldPos> = (0..3000)
                .map(|_| double.above(unit(&mut random), 0.0))
                .collect();
            let found = globe_heights(gpu(), veduta::programs(), &land, &places, width).unwrap();
            for (i, (p, g)) in places.iter().zip(found).enumerate() {
                let twin = single.ground(*p, width);
                let truth = double.ground(*p, f64::from(width));
                total += 1;
                same += i32::from(twin == g);
                low = low.min(g.height);
                high = high.max(g.height);
                let square: f64 = truth.slope.iter().map(|s| s * s).sum();
                steepest = steepest.max(square.sqrt());
                let apart = f64::from((g.height - twin.height).abs());
                worst =
                    worst.max(apart / (0.5 * f64::from(f32::EPSILON * g.height.abs())).max(1e-9));
                off = off.max((f64::from(g.height) - truth.height).abs());
                assert!(g.lost >= 0.0 && g.lost.is_finite());
                if i % 20 == 0 {
                    let place = double.place(*p);
                    let ball = block(&single, *p);
                    let kind = land.field.kind.number();
                    let width = f64::from(width);
                    let defined =
                        reference::ground(&ball, kind, place.cell, place.frac, place.up, width);
                    definition = definition.max((defined.height - truth.height).abs());
                    for k in 0..3 {
                        tilt = tilt.max((defined.slope[k] - truth.slope[k]).abs());
                    }
                }
            }
        }
        println!(
            "{name}: {same} of {total} bit by bit, {worst:.1} places, {:.1} mm of {:.0} m with slopes to {steepest:.1}; the definition {:.1} mm, slopes {tilt:.1e}",
            1e3 * off,
            high - low,
            1e3 * definition
        );
        // The same operations in the same order.
        assert_eq!(same, total, "{name}: {worst} places");
        // 2^-25 of cells of 1000 km are 3 cm of the place, and slopes of 1 and more make as much of it in height.
        let bar = if name == "steep" { 0.1 } else { 0.030 };
        assert!(off <= bar, "{name}: {off} m");
        // The series have f32 members in the reference's field.
        assert!(definition <= 0.03 && tilt <= 1e-2, "{name}");
    }
}

/// A query answers heights again and again, as the function for one call does.
#[test]
fn a_query_knows_the_heights_of_a_ball() {
    let mut random = Random(8);
    let land = Land::named("terra").unwrap();
    let globe = land.globe::<f64>().unwrap();
    let mut query = TerrainQuery::new(gpu(), veduta::programs(), &land).unwrap();
    for width in [0.0, 5000.0] {
        let places: Vec<WorldPos> = (0..100)
            .map(|_| globe.above(unit(&mut random), 100.0))
            .collect();
        let found = query.globe_heights(&places, width).unwrap();
        let alone = globe_heights(gpu(), veduta::programs(), &land, &places, width).unwrap();
        assert_eq!(found, alone);
        assert!(found.iter().any(|g| g.height > 10.0));
    }
    assert!(query.globe_heights(&[], 0.0).unwrap().is_empty());
    let text = query.heights(&[], 0.0).unwrap_err().to_string();
    assert!(text.contains("globe_heights"), "{text}");
    let text = query
        .globe_heights(&[WorldPos::default()], -1.0)
        .unwrap_err();
    assert!(text.to_string().contains("footprint"), "{text}");
    let mut plane = TerrainQuery::new(gpu(), veduta::programs(), &Land::default()).unwrap();
    let text = plane.globe_heights(&[], 0.0).unwrap_err().to_string();
    assert!(
        text.contains("Plane") && text.contains("TerrainQuery::heights"),
        "{text}"
    );
}

#[test]
fn slopes_on_a_ball_are_along_it_and_those_of_its_heights() {
    let mut random = Random(3);
    for (name, land) in lands() {
        let globe = land.globe::<f64>().unwrap();
        let (mut bad, total) = (0, 1500);
        for i in 0..total {
            let [latitude, longitude] = unit(&mut random);
            let width = if i % 2 == 0 { 0.0 } else { 2000.0 };
            let step = 2e-8;
            let at = |a: f64, b: f64| {
                let p = globe.above([latitude + a, longitude + b / latitude.cos()], 0.0);
                (globe.place(p), globe.ground(p, width))
            };
            let (place, g) = at(0.0, 0.0);
            let outward: f64 = (0..3).map(|k| g.slope[k] * place.up[k]).sum();
            assert!(outward.abs() < 1e-9, "{name}: {outward}");
            let north = (at(step, 0.0).0.up, at(-step, 0.0).0.up);
            let east = (at(0.0, step).0.up, at(0.0, -step).0.up);
            let rise = |[a, b]: [f64; 2]| at(a, b).1.height - at(-a, -b).1.height;
            let along = |(p, q): ([f64; 3], [f64; 3])| {
                let way: [f64; 3] = std::array::from_fn(|k| (p[k] - q[k]) * globe.radius());
                (0..3).map(|k| way[k] * g.slope[k]).sum::<f64>()
            };
            let length = 2.0 * step * globe.radius();
            let off = ((rise([step, 0.0]) - along(north)) / length)
                .abs()
                .max(((rise([0.0, step]) - along(east)) / length).abs());
            let size = 1.0 + g.slope.iter().map(|s| s * s).sum::<f64>().sqrt();
            bad += i32::from(off > 3e-3 * size);
        }
        println!("{name}: {bad} of {total} at a kink");
        assert!(bad <= total / 100, "{name}: {bad}");
    }
}

#[test]
fn bounds_and_lost_slopes_hold_on_a_ball() {
    let mut random = Random(4);
    for (name, land) in lands() {
        let globe = land.globe::<f64>().unwrap();
        let bounds = globe.bounds();
        let (mut low, mut high, mut steep) = (f64::INFINITY, f64::NEG_INFINITY, 0_f64);
        for share in [0.3, 0.05, 0.01] {
            let width = share * land.field.wavelength;
            let (mut all, mut kept, mut lost) = (0.0, 0.0, 0.0);
            for _ in 0..4000 {
                let p = globe.above(unit(&mut random), 0.0);
                let square = |s: [f64; 3]| s.iter().map(|s| s * s).sum::<f64>();
                let whole = globe.ground(p, 0.0);
                let g = globe.ground(p, width);
                for g in [&whole, &g] {
                    low = low.min(g.height);
                    high = high.max(g.height);
                    steep = steep.max(square(g.slope).sqrt());
                }
                all += square(whole.slope);
                kept += square(g.slope);
                lost += g.lost;
            }
            println!(
                "{name}, footprint {width:.0} m: slopes {:.4}, kept {:.4}, lost {:.4}",
                all / 4000.0,
                kept / 4000.0,
                lost / 4000.0
            );
            let bar = if name == "hybrid" { 0.35 } else { 0.15 };
            assert!(((kept + lost) / all - 1.0).abs() < bar, "{name}");
        }
        println!(
            "{name}: heights {low:.0} .. {high:.0} of {:.0} .. {:.0}, slope {steep:.2} of {:.2}",
            bounds.minimum, bounds.maximum, bounds.lipschitz
        );
        assert!(low >= bounds.minimum && high <= bounds.maximum, "{name}");
        assert!(steep <= bounds.lipschitz, "{name}");
    }
}

/// Rays of a picture of so many rows, 16:9, from a height above a place, looking down from level by an angle.
fn rays(
    globe: &Globe<f64>,
    rows: usize,
    height: f64,
    pitch: f64,
    field_of_view: f64,
) -> (Vec<TerrainRay>, f32, veduta::View) {
    use veduta::glam::{DQuat, Mat4};
    let (latitude, longitude) = (0.35, 0.6);
    let turn = DQuat::from_rotation_y(longitude)
        * DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2 - latitude);
    let mut view = veduta::View {
        eye: globe.above([latitude, longitude], height),
        ..Default::default()
    };
    let angle = field_of_view.to_radians() as f32;
    view.look(0.3, pitch.to_radians(), angle, 16.0 / 9.0);
    view.world_from_view = Mat4::from_quat(turn.as_quat()) * view.world_from_view;
    let [middle, right, up] = view.rays().unwrap().map(|v| v.as_dvec3());
    let columns = rows * 16 / 9;
    let mut rays = Vec::new();
    for y in 0..rows {
        for x in 0..columns {
            let at = |i: usize, n: usize| 2.0 * (i as f64 + 0.5) / n as f64 - 1.0;
            let dir = (middle + right * at(x, columns) - up * at(y, rows)).normalize();
            rays.push(TerrainRay {
                origin: view.eye,
                dir: dir.to_array(),
                far: 1e9,
            });
        }
    }
    (rays, (2.0 * up.length() / rows as f64) as f32, view)
}

/// How far a hit lies off the field across the ray (m), given the true one.
fn across(globe: &Globe<f64>, ray: &TerrainRay, angle: f64, found: f64, truth: f64) -> f64 {
    let gap = |at: f64| {
        let p = ray.origin.moved_by(ray.dir.map(|c| c * at).into());
        let place = globe.place(p);
        let g = globe.ground_at(place, angle * at);
        let normal = globe.normal(place, &g);
        let level: f64 = (0..3).map(|k| normal[k] * place.up[k]).sum();
        (globe.altitude(p) - g.height) * level
    };
    if found < truth {
        gap(found).abs()
    } else {
        (0..=64)
            .map(|k| -gap(truth + (found - truth) * f64::from(k) / 64.0))
            .fold(0.0, f64::max)
    }
}

#[test]
fn rays_from_orbit_meet_the_ball() {
    for (name, height, pitch, fov) in [
        ("luna", 400e3, -25.0, 60.0),
        ("luna", 2000e3, -60.0, 70.0),
        ("luna", 10e3, -10.0, 60.0),
        ("terra", 400e3, -20.0, 60.0),
        ("terra", 400e3, -70.0, 4.0),
        ("luna", 400e3, -50.0, 4.0),
    ] {
        let land = Land::named(name).unwrap();
        let globe = land.globe::<f64>().unwrap();
        let rows = 27;
        let columns = rows * 16 / 9;
        let (rays, angle, _) = rays(&globe, rows, height, pitch, fov);
        let wide = f64::from(angle);
        let programs = veduta::programs();
        let found = ray_hits(gpu(), programs, &land, &rays, angle, RayPath::Fast).unwrap();
        let truth = parallel_map(rays.len(), |i| globe.ray_hit(&rays[i], wide, 0.05).unwrap());
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
        let mut tilts = Vec::new();
        for (i, (f, t)) in found.iter().zip(&truth).enumerate() {
            capped += i32::from(f.capped);
            match (f.distance.is_finite(), t.distance.is_finite()) {
                (true, true) => {
                    let off = across(&globe, &rays[i], wide, f.distance, t.distance);
                    errors.push(off / (wide * t.distance).max(0.05));
                    let cosine: f64 = (0..3).map(|k| f.normal[k] * t.normal[k]).sum();
                    tilts.push(1.0 - cosine);
                }
                (false, false) => {}
                _ if near_edge(i) => at_edge += 1,
                _ => wrong += 1,
            }
        }
        errors.sort_by(f64::total_cmp);
        tilts.sort_by(f64::total_cmp);
        let centile =
            |sorted: &[f64], share: f64| sorted[((sorted.len() - 1) as f64 * share) as usize];
        let count = rays.len() as f64;
        println!(
            "{name}, {height} m, {fov} degrees: {} hits of {count}; wrong {:.3} %, at the silhouette {:.3} %, capped {capped}; error in footprints: median {:.4}, 95 % {:.4}, 99 % {:.4}, normals 99 % {:.1e}",
            errors.len(),
            100.0 * f64::from(wrong) / count,
            100.0 * f64::from(at_edge) / count,
            centile(&errors, 0.5),
            centile(&errors, 0.95),
            centile(&errors, 0.99),
            centile(&tilts, 0.99),
        );
        assert!(errors.len() > 200, "{name}");
        assert!(f64::from(wrong) <= 2e-4 * count, "{name}: {wrong}");
        assert!(f64::from(at_edge) <= 3e-3 * count, "{name}: {at_edge}");
        // A crossing is bracketed to a hundredth of a footprint.
        assert!(centile(&errors, 0.99) <= 0.02, "{name}");
        assert!(centile(&tilts, 0.99) <= 0.02, "{name}");
        assert_eq!(capped, 0, "{name}");
    }
}

/// Rays that run out of steps are what they most likely are, on both paths: none that leads below the horizon is sky, and none ends far from the ground.
#[test]
fn rays_without_steps_over_a_ball_are_what_they_most_likely_are() {
    for (name, height, pitch, path, steps, least) in [
        ("luna", 10e3, -10.0, RayPath::Fast, 3, 0.8),
        ("luna", 400e3, -25.0, RayPath::Fast, 3, 0.8),
        ("luna", 10e3, -10.0, RayPath::Fast, 16, 0.9),
        ("luna", 10e3, -10.0, RayPath::Fast, 40, 0.95),
        ("luna", 400e3, -25.0, RayPath::Fast, 7, 0.8),
        ("terra", 400e3, -20.0, RayPath::Fast, 5, 0.8),
        ("luna", 10e3, -10.0, RayPath::Textbook, 8, 0.7),
    ] {
        let land = Land::named(name).unwrap();
        let globe = land.globe::<f64>().unwrap();
        let (rays, angle, _) = rays(&globe, 36, height, pitch, 60.0);
        let wide = f64::from(angle);
        let truth = parallel_map(rays.len(), |i| globe.ray_hit(&rays[i], wide, 0.05).unwrap());
        let mut query = TerrainQuery::new(gpu(), veduta::programs(), &land).unwrap();
        query.set_steps(steps).unwrap();
        let found = query.ray_hits(&rays, angle, path).unwrap();
        let (mut capped, mut right, mut lost, mut below) = (0, 0, 0, 0);
        let mut high = Vec::new();
        for ((ray, f), t) in rays.iter().zip(&found).zip(&truth) {
            if !f.capped {
                continue;
            }
            capped += 1;
            right += i32::from(f.distance.is_finite() == t.distance.is_finite());
            // Where it comes lowest it is below all that is seen around it.
            let up = globe.place(ray.origin).up;
            let mu: f64 = (0..3).map(|k| up[k] * ray.dir[k]).sum();
            let out = globe.radius() + globe.altitude(ray.origin);
            let lowest = out * (1.0 - mu * mu).sqrt() - globe.radius();
            let down = mu < 0.0 && lowest < -3000.0;
            below += i32::from(down);
            lost += i32::from(down && !f.distance.is_finite());
            if f.distance.is_finite() && t.distance.is_finite() {
                let at = ray.origin.moved_by(ray.dir.map(|c| c * f.distance).into());
                high.push((globe.altitude(at) - globe.ground(at, wide * f.distance).height).abs());
            }
        }
        high.sort_by(f64::total_cmp);
        let off = high.get(high.len() / 2).copied().unwrap_or(0.0);
        println!(
            "{name}, {height} m, {path:?}, {steps} steps: {capped} capped, {right} of them right; {below} below the horizon, {lost} of them sky; {off:.0} m from the ground in the median"
        );
        assert!(
            capped > 60 && below > 20,
            "{name} {path:?}: {capped}, {below}"
        );
        assert_eq!(lost, 0, "{name} {path:?}");
        if steps >= 16 {
            assert!(off < 300.0, "{name}: {off} m");
        }
        assert!(
            f64::from(right) >= least * f64::from(capped),
            "{name} {path:?}"
        );
    }
}

#[test]
fn the_march_over_a_ball_comes_close() {
    let land = Land::named("luna").unwrap();
    let globe = land.globe::<f64>().unwrap();
    let (rays, angle, _) = rays(&globe, 18, 400e3, -40.0, 50.0);
    let programs = veduta::programs();
    let found = ray_hits(gpu(), programs, &land, &rays, angle, RayPath::Textbook).unwrap();
    // The march ends within a thousandth of the distance above the ground: 7 footprints here.
    let (mut wrong, mut hits, mut above) = (0, 0, 0_f64);
    for (ray, f) in rays.iter().zip(&found) {
        let t = globe.ray_hit(ray, f64::from(angle), 0.05).unwrap();
        wrong += i32::from(t.distance.is_finite() != f.distance.is_finite());
        assert!(!f.capped);
        if f.distance.is_finite() {
            let at = ray.origin.moved_by(ray.dir.map(|c| c * f.distance).into());
            let clearance =
                globe.altitude(at) - globe.ground(at, f64::from(angle) * f.distance).height;
            above = above.max(clearance.abs() / (0.001 * f.distance));
            hits += 1;
        }
    }
    println!(
        "{wrong} of {} wrong, {hits} hits up to {above:.2} tolerances from the ground",
        rays.len()
    );
    assert!(hits > 100 && wrong * 200 <= rays.len() as i32);
    assert!(above < 1.1);
}

/// Judges the program `terrain_globe`: what it covers and the depth that it writes.
#[test]
fn a_ball_is_drawn_where_rays_meet_it_with_their_depth() {
    use veduta::glam::Vec3;
    use veduta::terrain::{Terrain, TerrainLights, TerrainOptions};
    let land = Land::named("luna").unwrap();
    let globe = land.globe::<f64>().unwrap();
    let (rows, columns) = (36, 64);
    let targets = veduta::Targets {
        color_format: wgpu::TextureFormat::Rgba32Float,
        depth_format: Some(wgpu::TextureFormat::Depth32Float),
        ..Default::default()
    };
    let options = TerrainOptions {
        land: land.clone(),
        far: 1e9,
        ..Default::default()
    };
    let gpu = gpu();
    let mut terrain = Terrain::new(&gpu.device, veduta::programs(), &targets, &options).unwrap();
    assert!(terrain.clipmap().is_none());
    let lights = TerrainLights::clear(Vec3::ONE);
    for (height, pitch) in [(400e3, -25.0), (2000e3, -60.0)] {
        let (rays, angle, view) = rays(&globe, rows, height, pitch, 70.0);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let _ = terrain
            .prepare(&gpu.queue, &mut encoder, &view, &lights, rows as u32)
            .unwrap();
        gpu.queue.submit([encoder.finish()]);
        let (picture, depths, work) = crate::land::drawn(&terrain, columns, rows, 0.0);
        assert_eq!(work.draws, 1);
        assert!(picture.iter().all(|v| v.is_finite()));
        let path = RayPath::Fast;
        let found = ray_hits(gpu, veduta::programs(), &land, &rays, angle, path).unwrap();
        let forward = view
            .world_from_view
            .transform_vector3(Vec3::NEG_Z)
            .as_dvec3();
        let apart = |(i, h): &(usize, &TerrainHit)| h.distance.is_finite() != (depths[*i] > 0.0);
        let apart = found.iter().enumerate().filter(apart).count();
        let mut off: Vec<f64> = Vec::new();
        for (i, h) in found.iter().enumerate() {
            if h.distance.is_finite() && depths[i] > 0.0 {
                let ahead = h.distance * forward.dot(rays[i].dir.into());
                let drawn = 0.1 / f64::from(depths[i]);
                off.push((drawn - ahead).abs() / (f64::from(angle) * h.distance));
            }
        }
        off.sort_by(f64::total_cmp);
        let high = off[off.len() * 98 / 100];
        println!(
            "{height} m: {} hits, {apart} apart, depth off by {high:.3} footprints at 98 %",
            off.len()
        );
        assert!(off.len() > 300 && apart <= 4, "{height}: {apart}");
        assert!(high <= 0.004, "{height}: {high}");
    }
    // Away from the ball nothing is drawn.
    let (_, _, view) = rays(&globe, rows, 2000e3, 60.0, 50.0);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let _ = terrain
        .prepare(&gpu.queue, &mut encoder, &view, &lights, rows as u32)
        .unwrap();
    gpu.queue.submit([encoder.finish()]);
    assert_eq!(crate::land::drawn(&terrain, columns, rows, 0.0).2.draws, 0);
}

/// Whether pixels see the sun over a ball, by small steps in double precision over the field of each pixel's footprint.
struct SunOver<'a> {
    globe: &'a Globe<f64>,
    view: veduta::View,
    rows: usize,
    to_sun: veduta::glam::DVec3,
    radius: f64,
    top: f64,
}

impl SunOver<'_> {
    /// The share of the sun's disc that is seen from nine places of a pixel, each counted by how much it faces the sun; whether its upper limb is seen from any; how much the middle faces it.
    fn share(&self, x: usize, y: usize) -> Option<(f64, bool, f64)> {
        use veduta::glam::DVec3;
        let [middle, right, up] = self.view.rays().unwrap().map(|v| v.as_dvec3());
        let angle = 2.0 * up.length() / self.rows as f64;
        let at = |k: usize, j: usize, n: usize| {
            2.0 * (k as f64 + (j as f64 + 0.5) / 3.0) / n as f64 - 1.0
        };
        let (mut sum, mut all, mut any, mut middle_faces) = (0.0, 0.0, false, 0.0);
        for j in 0..9 {
            let columns = self.rows * 16 / 9;
            let dir =
                (middle + right * at(x, j % 3, columns) - up * at(y, j / 3, self.rows)).normalize();
            let ray = TerrainRay {
                origin: self.view.eye,
                dir: dir.to_array(),
                far: 1e9,
            };
            let hit = self.globe.ray_hit(&ray, angle, 0.05).unwrap();
            let facing = DVec3::from(hit.normal).dot(self.to_sun);
            if !hit.distance.is_finite() || facing <= 0.0 {
                continue;
            }
            if j == 4 {
                middle_faces = facing;
            }
            let from = self.view.eye.moved_by(dir * hit.distance);
            let footprint = angle * hit.distance;
            let (mut t, mut least) = (0.5 * footprint, 2.0_f64);
            while least > -1.0 {
                let p = from.moved_by(self.to_sun * t);
                let altitude = self.globe.altitude(p);
                if altitude > self.top + self.radius * t {
                    break;
                }
                let clear = altitude - self.globe.ground(p, footprint).height;
                least = least.min(clear / (t * self.radius));
                t += 0.5 * footprint;
            }
            let x = least.clamp(-1.0, 1.0);
            any |= least > -1.0;
            all += facing;
            sum += facing * (0.5 + x * (0.75 - 0.25 * x * x));
        }
        (all > 0.0).then(|| (sum / all, any, middle_faces))
    }
}

/// The share of the sun that balls are drawn with, against double precision: in the mean over a pixel, and of lit pixels with hardly a lit one around them whether any of their ground sees the sun.
#[test]
fn lone_lit_places_on_the_moon_see_the_sun() {
    use veduta::glam::{DVec3, Vec3};
    use veduta::program::Value;
    use veduta::terrain::{Terrain, TerrainLights, TerrainOptions};
    let (rows, columns) = (72, 128);
    let targets = veduta::Targets {
        color_format: wgpu::TextureFormat::Rgba32Float,
        depth_format: Some(wgpu::TextureFormat::Depth32Float),
        ..Default::default()
    };
    let gpu = gpu();
    let mut open = veduta::programs().clone();
    for key in open.keys.to_mut() {
        if key.name == "GLOBE_STEPS_SHADOW" {
            key.default = Value::Int(0);
        }
    }
    let lights = TerrainLights {
        sun: Vec3::ONE,
        sky: Vec3::ZERO,
        bounce: Vec3::ZERO,
    };
    let (mut alone, mut grazed) = ([0_usize; 2], [0_usize; 2]);
    for (name, height, pitch, azimuth, elevation, most) in [
        ("luna", 10e3, -10.0, 0.4, 4.0, 0.08),
        ("luna", 10e3, -10.0, 2.0, 4.0, 0.07),
        ("luna", 10e3, -10.0, 3.6, 4.0, 0.08),
        ("luna", 10e3, -10.0, 5.2, 4.0, 0.09),
        ("luna", 30e3, -25.0, 4.0, 2.0, 0.1),
        ("luna", 400e3, -40.0, 1.0, 4.0, 0.06),
        ("terra", 10e3, -8.0, 2.0, 4.0, 0.01),
    ] {
        let land = Land::named(name).unwrap();
        let globe = land.globe::<f64>().unwrap();
        let (_, _, mut view) = rays(&globe, rows, height, pitch, 60.0);
        let up = DVec3::from(globe.place(view.eye).up);
        let (east, _) = up.any_orthonormal_pair();
        let level = east * f64::cos(azimuth) + up.cross(east) * f64::sin(azimuth);
        let (sine, cosine) = f64::to_radians(elevation).sin_cos();
        let to_sun = up * sine + level * cosine;
        view.sun.to_light = to_sun.as_vec3();
        let [open, (picture, depths, _)] = [&open, veduta::programs()].map(|programs| {
            let options = TerrainOptions {
                land: land.clone(),
                far: 1e9,
                ..Default::default()
            };
            let mut terrain = Terrain::new(&gpu.device, programs, &targets, &options).unwrap();
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let _ = terrain
                .prepare(&gpu.queue, &mut encoder, &view, &lights, rows as u32)
                .unwrap();
            gpu.queue.submit([encoder.finish()]);
            crate::land::drawn(&terrain, columns, rows, 0.0)
        });
        // No ground that is met stands higher.
        let mut random = Random(7);
        let top = (0..20_000)
            .map(|_| {
                globe
                    .ground(globe.above(unit(&mut random), 0.0), 100.0)
                    .height
            })
            .fold(0.0, f64::max);
        let sun = SunOver {
            globe: &globe,
            radius: f64::from(view.sun.angular_radius),
            view,
            rows,
            to_sun,
            top: (1.2 * top).min(globe.bounds().maximum),
        };
        let lit = |x: usize, y: usize| picture[4 * (y * columns + x)] > 0.004;
        let (mut judged, mut lone) = (Vec::new(), Vec::new());
        for y in 1..rows - 1 {
            for x in 1..columns - 1 {
                let i = y * columns + x;
                if depths[i] <= 0.0 {
                    continue;
                }
                let around = (0..9)
                    .filter(|k| *k != 4 && lit(x + k % 3 - 1, y + k / 3 - 1))
                    .count();
                if lit(x, y) && around <= 1 {
                    lone.push([x, y]);
                }
                if i % 16 == 0 && open.0[4 * i] > 1e-4 {
                    judged.push([x, y]);
                }
            }
        }
        // Ground that the sun grazes is lit by slopes that are left out.
        let found = parallel_map(lone.len(), |i| sun.share(lone[i][0], lone[i][1]));
        let see = |least: f64| {
            let judged = found.iter().flatten().filter(|s| s.2 >= least);
            [judged.clone().filter(|s| s.1).count(), judged.count()]
        };
        let (all, facing) = (see(0.0), see(0.05));
        if name == "luna" {
            for k in 0..2 {
                alone[k] += facing[k];
                grazed[k] += all[k] - facing[k];
            }
        }
        let errors: Vec<f64> = parallel_map(judged.len(), |i| {
            let [x, y] = judged[i];
            let at = 4 * (y * columns + x);
            let drawn = f64::from(picture[at] / open.0[at]);
            // Ground that the sun grazes has its own light.
            sun.share(x, y).filter(|s| s.2 > 0.05).map(|s| drawn - s.0)
        })
        .into_iter()
        .flatten()
        .collect();
        let mean =
            |of: fn(f64) -> f64| errors.iter().map(|e| of(*e)).sum::<f64>() / errors.len() as f64;
        let (error, bias) = (mean(f64::abs), mean(|e| e));
        println!(
            "{name}, {height} m, sun at {elevation} degrees: {} pixels, error {error:.3}, bias {bias:.3}; alone with the sun in sight {facing:?}, of all that faces it {all:?}",
            errors.len()
        );
        assert!(errors.len() > 60, "{name}: {}", errors.len());
        assert!(
            error < most && bias.abs() < 0.5 * most,
            "{name}: {error} {bias}"
        );
    }
    let [see, all] = [0, 1].map(|k| alone[k] + grazed[k]);
    println!(
        "on the moon {see} of {all} pixels alone see the sun, {alone:?} of those that it does not graze"
    );
    // 63 of 70; 97 of 100 are aimed at.
    assert!(all >= 50 && see * 100 >= 85 * all, "{see} of {all}");
}

/// Judges `height_spread` on a ball: the standard deviation of 256 heights within a footprint, and the share of them that a sea leaves dry.
#[test]
fn heights_within_a_footprint_of_a_ball_differ_by_what_is_said() {
    use veduta::glam::DVec3;
    use veduta::reference::field::height_spread;
    let terra = ("terra", Land::named("terra").unwrap());
    for (name, mut land) in lands().into_iter().chain([terra]) {
        if name == "craters" {
            continue;
        }
        land.sea = None;
        let globe = land.globe::<f64>().unwrap();
        let field = &land.field;
        let octaves = f64::from(field.octaves);
        let mut random = Random(12);
        for share in [0.002, 0.01, 0.05, 0.3] {
            let footprint = share * field.wavelength;
            let (mut said, mut found) = (0.0, 0.0);
            let (mut dry_off, mut plain_off) = (0.0, 0.0);
            for _ in 0..100 {
                let middle = globe.above(unit(&mut random), 0.0);
                let place = globe.place(middle);
                let seen = globe.ground(middle, footprint);
                let up = DVec3::from(place.up);
                let (east, south) = up.any_orthonormal_pair();
                let within: Vec<f64> = (0..256)
                    .map(|k| {
                        let [x, z] = [k % 16, k / 16]
                            .map(|c| ((f64::from(c) + 0.5) / 16.0 - 0.5) * footprint);
                        let at = middle.moved_by(x * east + z * south);
                        globe.ground(at, footprint / 16.0).height - seen.height
                    })
                    .collect();
                let mean = within.iter().sum::<f64>() / 256.0;
                let variance = within.iter().map(|h| (h - mean).powi(2)).sum::<f64>() / 256.0;
                let left = (octaves - (field.wavelength / footprint).log2()).clamp(0.0, octaves);
                let slope = DVec3::from(seen.slope);
                let slope = [slope.dot(east), slope.dot(south)];
                let spread =
                    height_spread(slope, seen.lost, footprint, left, (-field.hurst).exp2());
                said += spread.powi(2);
                found += variance;
                let level = 0.5 * variance.sqrt();
                let above = within.iter().filter(|h| **h > level).count() as f64 / 256.0;
                let x = (0.5 - 0.5 * level / (2.24 * spread)).clamp(0.0, 1.0);
                dry_off += (x * x * (3.0 - 2.0 * x) - above).powi(2);
                plain_off += above.powi(2);
            }
            let ratio = (said / found).sqrt();
            let [off, plain] = [dry_off, plain_off].map(|v: f64| (v / 100.0).sqrt());
            println!(
                "{name}, {footprint:.0} m: {ratio:.3} of the deviation; dry share off by {off:.3} RMS, {plain:.3} without a border"
            );
            // Footprints that the coarsest cells hardly exceed differ less than is said.
            let most = if share < 0.1 { 1.3 } else { 1.6 };
            assert!((0.8..most).contains(&ratio), "{name}, {footprint}: {ratio}");
            assert!(off < 0.2 && off < 0.6 * plain, "{name}, {footprint}: {off}");
        }
    }
}

/// Draws a land from 10 km without a sun, so that the sky's light alone is seen.
fn under_the_sky(land: &Land, preset: veduta::Preset, sky_sectors: u32) -> (Vec<f32>, Vec<f32>) {
    use veduta::glam::Vec3;
    use veduta::terrain::{Terrain, TerrainLights, TerrainOptions};
    let globe = land.globe::<f64>().unwrap();
    let rows = 36;
    let (_, _, view) = rays(&globe, rows, 10e3, -20.0, 60.0);
    let targets = veduta::Targets {
        color_format: wgpu::TextureFormat::Rgba32Float,
        depth_format: Some(wgpu::TextureFormat::Depth32Float),
        ..Default::default()
    };
    let options = TerrainOptions {
        preset,
        land: land.clone(),
        far: 1e9,
        sky_sectors,
        ..Default::default()
    };
    let gpu = gpu();
    let mut terrain = Terrain::new(&gpu.device, veduta::programs(), &targets, &options).unwrap();
    let lights = TerrainLights {
        sun: Vec3::ZERO,
        sky: Vec3::ONE,
        bounce: Vec3::ZERO,
    };
    let all = vec![lights; 32];
    terrain.set_lights_by_sun(Some(&all)).unwrap();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let _ = terrain
        .prepare(&gpu.queue, &mut encoder, &view, &lights, rows as u32)
        .unwrap();
    gpu.queue.submit([encoder.finish()]);
    let (picture, depths, _) = crate::land::drawn(&terrain, rows * 16 / 9, rows, 0.0);
    (picture, depths)
}

/// Judges `globe_sky_share` by finer horizons over the field in double precision.
#[test]
fn craters_see_less_of_the_sky() {
    use veduta::glam::DVec3;
    use veduta::reference::terrain::sky_share;
    let land = Land::named("luna").unwrap();
    let globe = land.globe::<f64>().unwrap();
    let (rays, angle, view) = rays(&globe, 36, 10e3, -20.0, 60.0);
    let (open, depths) = under_the_sky(&land, veduta::Preset::High, 0);
    let (shut, _) = under_the_sky(&land, veduta::Preset::High, 8);
    let forward = view
        .world_from_view
        .transform_vector3(veduta::glam::Vec3::NEG_Z)
        .as_dvec3();
    let (mut off, mut flat, mut mean, mut judged) = (0.0, 0.0, 0.0, 0.0);
    for (i, ray) in rays.iter().enumerate() {
        if depths[i] <= 0.0 || open[4 * i] < 1e-4 || i % 5 != 0 {
            continue;
        }
        let share = f64::from(shut[4 * i] / open[4 * i]);
        let distance = 0.1 / f64::from(depths[i]) / forward.dot(ray.dir.into());
        let footprint = f64::from(angle) * distance;
        let at = ray.origin.moved_by(ray.dir.map(|c| c * distance).into());
        let here = globe.ground(at, footprint);
        let up = DVec3::from(globe.place(at).up);
        let (east, south) = up.any_orthonormal_pair();
        let slope = DVec3::from(here.slope);
        let slope = [slope.dot(east), slope.dot(south)];
        let foot = globe.altitude(at);
        // Above the plane that is level here.
        let height = |[x, z]: [f64; 2]| {
            let p = at.moved_by(x * east + z * south);
            let width = footprint.max(0.05 * x.hypot(z));
            globe.ground(p, width).height - globe.altitude(p) + foot
        };
        let truth = sky_share(
            height,
            [0.0; 2],
            here.height,
            slope,
            2.0 * footprint,
            1.15,
            50,
            32,
        );
        judged += 1.0;
        off += (share - truth).abs();
        flat += (1.0 - truth).abs();
        mean += truth;
    }
    let [off, flat, mean] = [off, flat, mean].map(|s| s / judged);
    println!(
        "{judged} places: mean share {mean:.3}, mean error {off:.4}, without horizons {flat:.4}"
    );
    assert!(judged > 150.0 && flat > 0.002 && off < 0.6 * flat);
}

/// Rock has veins, grain and stains in `high`, and one tone in `low`.
#[test]
fn rock_on_a_ball_has_two_qualities() {
    use veduta::Preset;
    let land = |stain: f32| {
        let mut land = Land::named("luna").unwrap();
        land.material.rock_stain = stain;
        land.material.rock_wavelength = 20_000.0;
        land
    };
    let apart = |(a, depths): &(Vec<f32>, Vec<f32>), b: &[f32]| {
        a.chunks_exact(4)
            .zip(b.chunks_exact(4))
            .zip(depths)
            .filter(|((a, b), d)| **d > 0.0 && (a[0] / b[0] - 1.0).abs() > 0.02)
            .count()
    };
    let high = under_the_sky(&land(0.6), Preset::High, 0);
    let low = under_the_sky(&land(0.6), Preset::Low, 0);
    let seen = low.1.iter().filter(|d| **d > 0.0).count();
    let dark = [Preset::High, Preset::Low].map(|p| under_the_sky(&land(0.1), p, 0).0);
    let found = [
        apart(&high, &low.0),
        apart(&high, &dark[0]),
        apart(&low, &dark[1]),
    ];
    println!(
        "of {seen} pixels {} differ between `high` and `low`, {} by stains in `high`, {} in `low`",
        found[0], found[1], found[2]
    );
    assert!(seen > 1000);
    assert!(found[0] > 300 && found[1] > 100 && found[2] == 0);
}

#[test]
fn faults_on_a_ball_name_what_is_wrong() {
    let good = Land::named("luna").unwrap();
    let fault = |change: fn(&mut Land)| {
        let mut land = good.clone();
        change(&mut land);
        land.check().unwrap_err().to_string()
    };
    let text = fault(|l| l.field.kind = Kind::Mix { mountains: 2.0 });
    assert!(
        text.contains("field.kind") && text.contains("Sphere"),
        "{text}"
    );
    let text = fault(|l| l.field.wavelength = 900_000.0);
    assert!(text.contains("field.wavelength"), "{text}");
    let text = good.field.prepare::<f32>().unwrap_err().to_string();
    assert!(text.contains("Land::globe"), "{text}");
    let text = Land::default().globe::<f32>().unwrap_err().to_string();
    assert!(text.contains("domain"), "{text}");
}

/// Judges `View::levelled`: the eye's altitude, and angles with what is up.
#[test]
fn a_levelled_view_stands_upright() {
    let land = Land::named("terra").unwrap();
    let globe = land.globe::<f64>().unwrap();
    let (_, _, mut view) = rays(&globe, 4, 400e3, -20.0, 60.0);
    view.sun.to_light = veduta::glam::Vec3::new(0.6, 0.0, -0.8);
    let level = view.levelled(land.planet_radius);
    assert!((level.eye.altitude() - 400e3).abs() < 0.1);
    let up = globe.place(view.eye).up;
    let [a, b] = [view.rays().unwrap()[0], level.rays().unwrap()[0]].map(|r| r.normalize());
    let before = a.as_dvec3().dot(up.into());
    assert!((before - f64::from(b.y)).abs() < 1e-6, "{before} {}", b.y);
    let sun = view.sun.to_light.as_dvec3().dot(up.into());
    assert!((sun - f64::from(level.sun.to_light.y)).abs() < 1e-6);
    assert!((a.dot(view.sun.to_light) - b.dot(level.sun.to_light)).abs() < 1e-6);
}
