//! Queries: heights and rays of a land from anywhere, their limits, and a program's own height function.

use std::time::Instant;

use veduta::WorldPos;
use veduta::atmosphere::{SkyQuality, SkyQuery, SkyTables};
use veduta::compose::Source;
use veduta::glam::Vec3;
use veduta::terrain::{
    HeightField, Kind, Land, OwnBounds, Prepared, RayPath, Terrain, TerrainHit, TerrainLights,
    TerrainOptions, TerrainQuery, TerrainRay, globe_heights, heights, hit_errors,
};
use veduta::{Light, ProgramSet, Targets};

use crate::common::{Random, gpu, heading, named};

/// Rays from as many places in a square of so many metres, from 2 to 2000 m above the ground, most of them downwards.
fn scattered(land: &Land, count: usize, square: f64) -> Vec<TerrainRay> {
    let mut random = Random(11);
    let field = land.field.prepare::<f64>().unwrap();
    (0..count)
        .map(|_| {
            let [x, z] = [0, 1].map(|_| square * f64::from(random.between(-0.5, 0.5)));
            let foot = WorldPos::from_metres([x, 0.0, z].into());
            let height = field.ground(foot, 0.0).height;
            let up = 2.0 * 1000_f64.powf(f64::from(random.unit()));
            TerrainRay {
                origin: foot.moved_by([0.0, height + up, 0.0].into()),
                dir: heading(
                    f64::from(random.between(-0.7, 0.15)),
                    f64::from(random.between(0.0, std::f32::consts::TAU)),
                ),
                far: 40_000.0,
            }
        })
        .collect()
}

#[test]
fn a_thousand_origins_are_one_query() {
    for name in ["thesis", "hills", "mesa", "lowlands"] {
        let land = Land::named(name).unwrap();
        let rays = scattered(&land, 1000, 2e5);
        let mut query = TerrainQuery::new(gpu(), veduta::programs(), &land).unwrap();
        let angle = 0.004_f32;
        let before = Instant::now();
        let found = query.ray_hits(&rays, angle, RayPath::Fast).unwrap();
        let first = before.elapsed().as_secs_f64();
        let before = Instant::now();
        let again = query.ray_hits(&rays, angle, RayPath::Fast).unwrap();
        let second = before.elapsed().as_secs_f64();
        assert_eq!(found, again);
        let before = Instant::now();
        let errors = hit_errors(&land, &rays, rays.len(), f64::from(angle), &found).unwrap();
        let judged = before.elapsed().as_secs_f64();
        let wrong = errors.wrong + errors.at_silhouette;
        println!(
            "{name}: {} hits, {wrong} wrong, {} capped, {:.4} footprints at 99 %; {first:.2} s with compilation, {second:.2} s without, {judged:.2} s in f64 on all processors",
            errors.across.len(),
            errors.capped,
            errors.centile(0.99)
        );
        assert!(errors.across.len() > 500);
        // A ray that grazes a crest may pass on one side of it in f32.
        assert!(wrong <= 2, "{name}: {wrong}");
        assert!(errors.capped <= 5 && errors.centile(0.99) <= 0.02, "{name}");
        // A baked clipmap for each of them would take a second and more.
        assert!(second < 8.0, "{name}: {second}");
    }
}

/// The origins' order does not matter, nor who asks together with whom.
#[test]
fn rays_are_grouped_by_their_origins() {
    const MANY: usize = 2500;
    let land = Land::named("hills").unwrap();
    let two = scattered(&land, 2, 1e5);
    let mut random = Random(3);
    let rays: Vec<TerrainRay> = (0..2 * MANY)
        .map(|i| TerrainRay {
            origin: two[i % 2].origin,
            dir: heading(
                f64::from(random.between(-0.5, 0.0)),
                f64::from(random.between(0.0, std::f32::consts::TAU)),
            ),
            far: 30_000.0,
        })
        .collect();
    let mut query = TerrainQuery::new(gpu(), veduta::programs(), &land).unwrap();
    query.set_baked_from(MANY);
    let before = Instant::now();
    let together = query.ray_hits(&rays, 0.004, RayPath::Fast).unwrap();
    let first = before.elapsed().as_secs_f64();
    let before = Instant::now();
    let _ = query.ray_hits(&rays, 0.004, RayPath::Fast).unwrap();
    let baked = before.elapsed().as_secs_f64();
    // The same rays, so few at a time that nothing is baked.
    let loose = |rays: &[TerrainRay], query: &mut TerrainQuery| -> f64 {
        let before = Instant::now();
        for part in rays.chunks(500) {
            query.ray_hits(part, 0.004, RayPath::Fast).unwrap();
        }
        before.elapsed().as_secs_f64()
    };
    let (compiled, few) = (loose(&rays, &mut query), loose(&rays, &mut query));
    println!(
        "two origins of {MANY} rays: {first:.2} s with compilation, {baked:.2} s without; over the field itself {compiled:.2} s and {few:.2} s"
    );
    let sorted: Vec<TerrainRay> = (0..2)
        .flat_map(|k| rays.iter().skip(k).step_by(2).copied())
        .collect();
    let apart = query.ray_hits(&sorted, 0.004, RayPath::Fast).unwrap();
    for (i, hit) in together.iter().enumerate() {
        assert_eq!(*hit, apart[i / 2 + MANY * (i % 2)]);
    }
    let errors = hit_errors(&land, &rays, rays.len(), 0.004, &together).unwrap();
    println!(
        "{} hits, {} + {} wrong",
        errors.across.len(),
        errors.wrong,
        errors.at_silhouette
    );
    assert!(errors.across.len() > MANY && errors.wrong + errors.at_silhouette <= 4);
    assert!(errors.centile(0.99) <= 0.5);
}

/// What a search without bounds finds: steps of half a footprint only.
fn plain(land: &Land, field: &Prepared<f64>, ray: &TerrainRay, angle: f64) -> f64 {
    let eye = field.place(ray.origin);
    let start = ray.origin.altitude();
    let radius = land.planet_radius + start;
    let top = field.bounds().unwrap().maximum;
    let clearance = |t: f64| {
        let q = t * (t + 2.0 * radius * ray.dir[1]);
        let altitude = start + q / (radius + (radius * radius + q).sqrt());
        let at = [ray.dir[0] * t, ray.dir[2] * t];
        (
            altitude - field.ground_from(eye, at, angle * t).height,
            altitude,
        )
    };
    let mut t = 0.0;
    while t < ray.far {
        let next = (t + (0.5 * angle * t).max(0.05)).min(ray.far);
        let (left, altitude) = clearance(next);
        if left <= 0.0 {
            let (mut clear, mut below) = (t, next);
            for _ in 0..50 {
                let middle = 0.5 * (clear + below);
                if clearance(middle).0 <= 0.0 {
                    below = middle;
                } else {
                    clear = middle;
                }
            }
            return clear;
        }
        if altitude > top && ray.dir[1] > 0.0 {
            break;
        }
        t = next;
    }
    f64::INFINITY
}

#[test]
fn bounds_shorten_searches_and_lose_no_hit() {
    for name in ["thesis", "alps", "hills", "mesa", "lowlands", "moon"] {
        let land = Land::named(name).unwrap();
        let count = if name == "moon" { 20 } else { 80 };
        let rays = scattered(&land, count, 1e5);
        for angle in [0.004, 0.0005] {
            let before = Instant::now();
            let found = land.ray_hits(&rays, angle).unwrap();
            let fast = before.elapsed().as_secs_f64();
            let before = Instant::now();
            let field = land.field.prepare::<f64>().unwrap();
            let truth: Vec<f64> = rays
                .iter()
                .map(|r| plain(&land, &field, r, angle))
                .collect();
            let slow = before.elapsed().as_secs_f64();
            let apart = found
                .iter()
                .zip(&truth)
                .filter(|(f, t)| {
                    // Longer steps come by other places: a stretch below the ground that is shorter than half a footprint may be met by one and missed by the other.
                    f.distance.is_finite() != t.is_finite()
                        || (t.is_finite() && (f.distance - **t).abs() > 1e-3 + 0.5 * angle * **t)
                })
                .count();
            println!(
                "{name}, {angle}: {apart} of {count} apart; {:.2} ms a ray, {:.2} without bounds",
                1e3 * fast / count as f64,
                1e3 * slow / count as f64
            );
            assert!(apart <= 1, "{name}: {apart}");
            assert!(fast < slow, "{name}");
        }
    }
}

#[test]
fn no_search_goes_on_for_ever() {
    // Pebbles over which a ray flies by a hand's breadth, on a planet so large that it stays there.
    let land = Land {
        field: HeightField {
            wavelength: 16.0,
            amplitude: 0.3,
            octaves: 14,
            ..HeightField::default()
        },
        planet_radius: 1e9,
        ..Land::default()
    };
    let ray = TerrainRay {
        origin: WorldPos::from_metres([0.0, 0.45, 0.0].into()),
        dir: [1.0, 0.0, 0.0],
        far: f64::INFINITY,
    };
    let field = land.field.prepare::<f64>().unwrap();
    let before = Instant::now();
    let hit = field.ray_hit(land.planet_radius, &ray, 0.0, 1e-9).unwrap();
    println!("{hit:?} after {:.2} s", before.elapsed().as_secs_f64());
    assert!(hit.capped && hit.distance.is_finite());
    assert!(before.elapsed().as_secs_f64() < 30.0);
    let above = TerrainRay {
        origin: WorldPos::from_metres([0.0, 0.62, 0.0].into()),
        ..ray
    };
    assert!(above.origin.altitude() > field.bounds().unwrap().maximum);
    // Above all ground nothing is stepped through.
    let before = Instant::now();
    let hit = field
        .ray_hit(land.planet_radius, &above, 0.0, 1e-9)
        .unwrap();
    assert_eq!(hit, TerrainHit::MISS);
    assert!(before.elapsed().as_secs_f64() < 0.1);
}

#[test]
fn faults_of_queries_name_what_is_wrong() {
    let land = Land::named("hills").unwrap();
    let mut query = TerrainQuery::new(gpu(), veduta::programs(), &land).unwrap();
    let mut nowhere = WorldPos::default();
    nowhere.frac.z = f32::NAN;
    let ray = |origin| TerrainRay {
        origin,
        dir: [0.0, -1.0, 0.0],
        far: 1e5,
    };
    let good = ray(WorldPos::from_metres([0.0, 9000.0, 0.0].into()));
    for fault in [
        query
            .ray_hits(&[good, ray(nowhere)], 0.01, RayPath::Fast)
            .unwrap_err(),
        land.ray_hits(&[good, ray(nowhere)], 0.01).unwrap_err(),
    ] {
        let text = fault.to_string();
        assert!(
            text.contains("origin of ray 1") && text.contains("NaN"),
            "{text}"
        );
    }
    let places = [WorldPos::default(), nowhere];
    let text = query.heights(&places, 0.0).unwrap_err().to_string();
    assert!(text.contains("position 1"), "{text}");
    let text = heights(gpu(), veduta::programs(), &land.field, &places, 0.0).unwrap_err();
    assert!(text.to_string().contains("position 1"), "{text}");
    let ball = Land::named("terra").unwrap();
    let text = globe_heights(gpu(), veduta::programs(), &ball, &places, 0.0).unwrap_err();
    assert!(text.to_string().contains("position 1"), "{text}");
    let mut over = TerrainQuery::new(gpu(), veduta::programs(), &ball).unwrap();
    assert!(over.heights(&places[..1], 0.0).is_err());
    assert!(
        query
            .set_steps(0)
            .unwrap_err()
            .to_string()
            .contains("steps")
    );
    // Nothing was followed for nothing.
    assert!(query.ray_hits(&[], 0.01, RayPath::Fast).unwrap().is_empty());
    // Rays end where they say, or where all rays end.
    let endless = TerrainRay {
        far: f64::INFINITY,
        ..good
    };
    let down = query
        .ray_hits(&[good, endless], 0.01, RayPath::Fast)
        .unwrap();
    assert_eq!(down[0], down[1]);
    let own = Land {
        field: own_field(None),
        ..Land::default()
    };
    let text = own.ray_hits(&[good], 0.01).unwrap_err().to_string();
    assert!(text.contains("Own"), "{text}");
    // Options by the names that a host gave them.
    let targets = Targets {
        depth_format: Some(wgpu::TextureFormat::Depth32Float),
        ..Default::default()
    };
    let terrain = |options: TerrainOptions| {
        let fault = Terrain::new(&gpu().device, veduta::programs(), &targets, &options);
        fault.unwrap_err().to_string()
    };
    let text = terrain(TerrainOptions {
        far: 5e6,
        ..Default::default()
    });
    assert!(text.contains("terrain.far"), "{text}");
    let text = terrain(TerrainOptions {
        texels: 300,
        ..Default::default()
    });
    assert!(
        text.contains("terrain.texels") && text.contains("300"),
        "{text}"
    );
}

/// Rays that run out of steps are what they most likely are, on both paths: none that leads below the horizon is sky.
#[test]
fn rays_without_steps_are_what_they_most_likely_are() {
    let land = Land::named("thesis").unwrap();
    let (rays, angle) = crate::land::rays(&land, 54, 300.0, -8.0, [13_500.0, -14_700.0]);
    let truth = land.ray_hits(&rays, f64::from(angle)).unwrap();
    for (path, steps, least) in [(RayPath::Fast, 24, 0.8), (RayPath::Textbook, 12, 0.7)] {
        let mut query = TerrainQuery::new(gpu(), veduta::programs(), &land).unwrap();
        query.set_steps(steps).unwrap();
        query.set_baked_from(1);
        let found = query.ray_hits(&rays, angle, path).unwrap();
        let (mut capped, mut right, mut lost, mut below) = (0, 0, 0, 0);
        for ((ray, f), t) in rays.iter().zip(&found).zip(&truth) {
            if !f.capped {
                continue;
            }
            capped += 1;
            right += i32::from(f.distance.is_finite() == t.distance.is_finite());
            let down = ray.dir[1] < -0.03;
            below += i32::from(down);
            lost += i32::from(down && !f.distance.is_finite());
        }
        println!(
            "{path:?}, {steps} steps: {capped} capped, {right} of them right; {below} below the horizon, {lost} of them sky"
        );
        assert!(capped > 300 && below > 100, "{path:?}: {capped}, {below}");
        assert_eq!(lost, 0, "{path:?}");
        assert!(f64::from(right) >= least * f64::from(capped), "{path:?}");
    }
}

/// The march over the plane as accurate as it says: hits within its tolerance, a thousandth of the distance above the ground.
#[test]
fn the_march_over_the_plane_comes_close() {
    for (name, height, pitch) in [("thesis", 300.0, 0.0), ("hills", 30.0, -8.0)] {
        let land = Land::named(name).unwrap();
        let (rays, angle) = crate::land::rays(&land, 36, height, pitch, [13_500.0, -14_700.0]);
        let mut query = TerrainQuery::new(gpu(), veduta::programs(), &land).unwrap();
        let found = query.ray_hits(&rays, angle, RayPath::Textbook).unwrap();
        let errors = hit_errors(&land, &rays, 64, f64::from(angle), &found).unwrap();
        println!(
            "{name}: {} hits of {}, {} wrong, {} at the silhouette, {} capped; {:.3} footprints in the median, {:.3} at 99 %",
            errors.across.len(),
            rays.len(),
            errors.wrong,
            errors.at_silhouette,
            errors.capped,
            errors.centile(0.5),
            errors.centile(0.99)
        );
        assert!(errors.across.len() > 500);
        assert!(errors.wrong as f64 <= 0.002 * rays.len() as f64, "{name}");
        assert!(
            errors.at_silhouette as f64 <= 0.02 * rays.len() as f64,
            "{name}"
        );
        assert_eq!(errors.capped, 0, "{name}");
        // The tolerance is 0.001 of the distance; a pixel has 0.029 or 0.0096 of it.
        let tolerance = 0.0011 / f64::from(angle);
        assert!(errors.centile(0.99) <= tolerance, "{name}");
    }
}

/// Waves in octaves, by which a program's own function is told from all others.
const OWN: &str = "
#define_import_path own::waves
#import veduta::terrain::height::{Terrain}

override fn veduta::terrain::height::height(terrain: Terrain, offset: vec2<f32>, octaves: i32) -> f32 {
    let p = fract(terrain.frac + offset / terrain.wavelength);
    var sum = 0.0;
    var size = terrain.amplitude;
    var turns = 6.283185307;
    for (var i = 0; i < octaves; i++) {
        sum += size * sin(turns * p.x) * cos(turns * p.y);
        turns *= 2.0;
        size *= 0.4;
    }
    return sum;
}
";

fn own_field(bounds: Option<OwnBounds>) -> HeightField {
    HeightField {
        kind: Kind::Own {
            gain: 0.0,
            smoothness: 0.0,
            bounds,
        },
        wavelength: 4096.0,
        amplitude: 300.0,
        base: 100.0,
        octaves: 6,
        ..HeightField::default()
    }
}

/// The same on the processor, with octaves that fade.
fn own_height(at: [f64; 2], footprint: f64) -> f64 {
    let [x, z] = at.map(|c| (c / 4096.0).rem_euclid(1.0));
    let octave = |i: u32| {
        let turns = std::f64::consts::TAU * f64::from(1_u32 << i);
        300.0 * 0.4_f64.powi(i as i32) * (turns * x).sin() * (turns * z).cos()
    };
    let sum: f64 = (0..6)
        .map(|i| {
            let share =
                (4096.0 / footprint.max(1e-3) / f64::from(1_u32 << i) - 1.0).clamp(0.0, 1.0);
            // The first octave never fades.
            let keep = if i == 0 {
                1.0
            } else {
                share * share * (3.0 - 2.0 * share)
            };
            keep * octave(i)
        })
        .sum();
    100.0 + sum
}

/// The terrain's programs with the module above.
fn own_programs() -> ProgramSet {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = std::env::temp_dir().join(format!("veduta-own-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("waves.wgsl"), OWN).unwrap();
    let source = Source::read(&[&root.join("wgsl"), &root.join("presets"), &folder])
        .unwrap()
        .plug_in("own::waves");
    let mut set = veduta::programs().clone();
    set.programs
        .to_mut()
        .retain(|p| !p.program.starts_with("terrain"));
    let bake: &[&[&str]] = &[&[], &["CLIP_SECTORS"], &["CLIP_SHADES"]];
    for (program, ways) in [
        ("terrain", &bake[..1]),
        ("terrain_bake", bake),
        ("terrain_heights", &bake[..1]),
        ("terrain_rays", &[&[], &["TERRAIN_FAST"]]),
    ] {
        for features in ways {
            let composed = source.compose(program, features).unwrap();
            set.programs.to_mut().push(composed);
        }
    }
    set
}

#[test]
fn a_programs_own_height_is_drawn_and_asked() {
    let programs = own_programs();
    let bounds = OwnBounds {
        minimum: -500.0,
        maximum: 500.0,
        lipschitz: 2.0,
    };
    let land = Land {
        field: own_field(Some(bounds)),
        ..Land::default()
    };
    assert_eq!(land.field.bounds().unwrap().maximum, 600.0);
    let mut query = TerrainQuery::new(gpu(), &programs, &land).unwrap();
    // Heights, far from the origin, too, at whole multiples of the wavelength.
    let mut random = Random(21);
    let mut worst = 0_f64;
    for footprint in [0.0_f32, 9.0, 30.0, 90.0, 300.0] {
        let places: Vec<[f64; 2]> = (0..500)
            .map(|_| [0, 1].map(|_| f64::from(random.between(-1e4, 1e4)).floor()))
            .collect();
        for away in [0.0, 4096.0 * 1e8] {
            let at: Vec<WorldPos> = places
                .iter()
                .map(|[x, z]| WorldPos::from_metres([x + away, 0.0, z - away].into()))
                .collect();
            let found = query.heights(&at, footprint).unwrap();
            for (p, g) in places.iter().zip(found) {
                let truth = own_height(*p, f64::from(footprint));
                worst = worst.max((f64::from(g.height) - truth).abs());
            }
        }
    }
    println!("heights {:.1} mm off", 1e3 * worst);
    assert!(worst < 0.03, "{worst}");
    // No octave pops: from one footprint to the next one that is 1 % larger, heights change by little of what the octave has.
    let place = [WorldPos::from_metres([777.0, 0.0, 1234.0].into())];
    let series: Vec<f32> = (0..460)
        .map(|i| 50.0 * 1.01_f32.powi(i))
        .map(|f| query.heights(&place, f).unwrap()[0].height)
        .collect();
    let jump = series
        .windows(2)
        .map(|w| (w[1] - w[0]).abs())
        .fold(0.0, f32::max);
    let span = series.iter().fold(f32::MIN, |a, b| a.max(*b))
        - series.iter().fold(f32::MAX, |a, b| a.min(*b));
    println!("largest change {jump:.2} m of {span:.1} m");
    assert!(span > 20.0 && jump < 0.05 * span);
    // Rays: over the field itself and over baked heights.
    let origin = WorldPos::from_metres([500.0, 900.0, -800.0].into());
    let angle = 0.01_f32;
    let rays: Vec<TerrainRay> = (0..1024)
        .map(|i| TerrainRay {
            origin,
            dir: heading(-0.02 - 0.02 * f64::from(i / 32), 0.03 * f64::from(i % 32)),
            far: 30_000.0,
        })
        .collect();
    let clearance = |ray: &TerrainRay, t: f64| {
        let radius = land.planet_radius + 900.0;
        let q = t * (t + 2.0 * radius * ray.dir[1]);
        let altitude = 900.0 + q / (radius + (radius * radius + q).sqrt());
        let at = [500.0 + ray.dir[0] * t, -800.0 + ray.dir[2] * t];
        altitude - own_height(at, f64::from(angle) * t)
    };
    let truth: Vec<f64> = rays
        .iter()
        .map(|ray| {
            let mut t = 1.0;
            while t < ray.far && clearance(ray, t) > 0.0 {
                t += (0.002 * t).max(0.2);
            }
            if t < ray.far { t } else { f64::INFINITY }
        })
        .collect();
    let judge = |what: &str, found: &[TerrainHit], most: f64| {
        let (mut wrong, mut worst) = (0, 0_f64);
        for ((ray, f), t) in rays.iter().zip(found).zip(&truth) {
            assert!(!f.capped);
            if f.distance.is_finite() != t.is_finite() {
                wrong += 1;
            } else if t.is_finite() {
                let gap = clearance(ray, f.distance).abs();
                worst = worst.max(gap / (f64::from(angle) * f.distance));
            }
        }
        println!(
            "{what}: {wrong} of {} wrong, {worst:.4} footprints",
            found.len()
        );
        assert!(wrong <= 2 && worst < most, "{what}");
    };
    query.set_baked_from(1000);
    let baked = query.ray_hits(&rays, angle, RayPath::Fast).unwrap();
    judge("baked", &baked, 0.3);
    let few: Vec<TerrainHit> = rays
        .chunks(256)
        .flat_map(|part| query.ray_hits(part, angle, RayPath::Fast).unwrap())
        .collect();
    judge("itself", &few, 0.02);
    // Without a word about its bounds nothing is lost but time.
    let bare = Land {
        field: own_field(None),
        ..Land::default()
    };
    let mut query = TerrainQuery::new(gpu(), &programs, &bare).unwrap();
    let few: Vec<TerrainHit> = rays
        .chunks(256)
        .flat_map(|part| query.ray_hits(part, angle, RayPath::Fast).unwrap())
        .collect();
    judge("itself, without bounds", &few, 0.02);
    // And drawn, with a depth that leads back to it.
    let targets = Targets {
        color_format: wgpu::TextureFormat::Rgba32Float,
        depth_format: Some(wgpu::TextureFormat::Depth32Float),
        ..Default::default()
    };
    let options = TerrainOptions {
        land: land.clone(),
        far: 30_000.0,
        ..Default::default()
    };
    let mut terrain = Terrain::new(&gpu().device, &programs, &targets, &options).unwrap();
    let mut view = veduta::View {
        eye: origin,
        ..Default::default()
    };
    view.look(0.3, -0.4, 60_f32.to_radians(), 16.0 / 9.0);
    let (columns, rows) = (64, 36);
    let mut encoder = gpu().device.create_command_encoder(&Default::default());
    let lights = TerrainLights::clear(Vec3::ONE);
    let _ = terrain
        .prepare(&gpu().queue, &mut encoder, &view, &lights, rows)
        .unwrap();
    gpu().queue.submit([encoder.finish()]);
    let (colors, depths, _) = crate::land::drawn(&terrain, columns, rows as usize, 0.0);
    let [middle, right, up] = view.rays().unwrap().map(|v| v.as_dvec3());
    let forward = view
        .world_from_view
        .transform_vector3(Vec3::NEG_Z)
        .as_dvec3();
    let pixel = 2.0 * up.length() / f64::from(rows);
    let (mut seen, mut off) = (0, 0_f64);
    for (i, depth) in depths.iter().enumerate().filter(|(_, d)| **d > 0.0) {
        let at = |k: usize, n: usize| 2.0 * (k as f64 + 0.5) / n as f64 - 1.0;
        let dir = (middle + right * at(i % columns, columns) - up * at(i / columns, rows as usize))
            .normalize();
        let t = 0.1 / f64::from(*depth) / dir.dot(forward);
        let ray = TerrainRay {
            origin,
            dir: dir.to_array(),
            far: 1e5,
        };
        let radius = land.planet_radius + 900.0;
        let q = t * (t + 2.0 * radius * dir.y);
        let altitude = 900.0 + q / (radius + (radius * radius + q).sqrt());
        let height = own_height([500.0 + ray.dir[0] * t, -800.0 + ray.dir[2] * t], pixel * t);
        off = off.max((altitude - height).abs() / (pixel * t));
        seen += 1;
    }
    println!(
        "{seen} of {} pixels show ground, {off:.3} footprints off",
        depths.len()
    );
    assert!(seen > 1500 && off < 0.5);
    assert!(colors.iter().all(|c| c.is_finite()) && colors.iter().any(|c| *c > 0.01));
}

#[test]
fn lights_of_the_ground_are_those_of_its_sky() {
    let gpu = gpu();
    let (device, queue) = (&gpu.device, &gpu.queue);
    let air = named("earth");
    let quality = SkyQuality::finest();
    let mut tables = SkyTables::new(device, veduta::programs(), &air, &quality).unwrap();
    let query = SkyQuery::new(device, veduta::programs(), &air).unwrap();
    let albedo = Vec3::splat(0.2);
    let mut lights = |elevation: f64, altitude: f64, irradiance: f32| {
        let sun = Light {
            to_light: Vec3::from_array(heading(elevation.to_radians(), 0.4).map(|c| c as f32)),
            irradiance: Vec3::splat(irradiance),
            ..Default::default()
        };
        TerrainLights::from_sky(device, queue, &query, &mut tables, &sun, altitude, albedo).unwrap()
    };
    let (noon, low, night) = (
        lights(60.0, 500.0, 1.0),
        lights(4.0, 500.0, 1.0),
        lights(-5.0, 500.0, 1.0),
    );
    println!("{noon:?}\n{low:?}\n{night:?}");
    assert!(noon.sun.x > 0.7 && noon.sun.x < 1.0 && noon.sun.x > noon.sun.z);
    assert!(noon.sky.z > 1.5 * noon.sky.x && noon.sky.z < 0.4);
    assert!(low.sun.x / low.sun.z > 2.0 * noon.sun.x / noon.sun.z);
    assert_eq!(night.sun, Vec3::ZERO);
    assert!(night.sky.z > 0.0 && night.sky.z < 0.1 * low.sky.z);
    let level = noon.sun * 60_f32.to_radians().sin() + noon.sky;
    assert!((noon.bounce - 0.1 * level).abs().max_element() < 1e-6);
    // In the unit of the sun.
    let twice = lights(60.0, 500.0, 2.0);
    assert!((twice.sun - 2.0 * noon.sun).abs().max_element() < 1e-6);
    // Less air above a summit; beyond the air as at its top.
    let high = lights(60.0, 4000.0, 1.0);
    assert!(high.sun.z > noon.sun.z && high.sky.z < noon.sky.z);
    let sun = Light::default();
    let fault = TerrainLights::from_sky(device, queue, &query, &mut tables, &sun, f64::NAN, albedo);
    assert!(fault.unwrap_err().to_string().contains("altitude"));
    let all = TerrainLights::by_sun_from_sky(device, queue, &query, &mut tables, &sun, 0.0, albedo)
        .unwrap();
    assert_eq!(all.len(), Terrain::sun_cosines().len());
    assert!(all[0].sun == Vec3::ZERO && all[31].sun.x > all[12].sun.x);
}
