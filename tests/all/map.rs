//! Height maps: the device, the processor and the definition; bounds, borders, the filter, files and their faults.

use veduta::WorldPos;
use veduta::reference::relief::{self, Relief};
use veduta::terrain::{
    Edge, HeightField, HeightMap, Kind, Land, MapTexels, RayPath, TerrainQuery, TerrainRay,
    heights, hit_errors,
};

use crate::common::{Random, gpu};

const EDGES: [Edge; 3] = [Edge::Repeat, Edge::Mirror, Edge::Clamp];

/// Hills of a few texels on a mountain of the whole map, up to 8 km.
fn values(width: usize, rows: usize) -> Vec<f32> {
    let mut random = Random(7);
    (0..width * rows)
        .map(|i| {
            let (x, z) = ((i % width) as f32, (i / width) as f32);
            let turn = |v: f32, n: usize| (v / n as f32 * std::f32::consts::PI).sin();
            6000.0 * turn(x, width) * turn(z, rows)
                + 800.0 * (0.4 * x).sin() * (0.7 * z + 0.1 * x).cos()
                + 30.0 * random.unit()
        })
        .collect()
}

fn field(edge: Edge, size: [usize; 2], wavelength: f64, amplitude: f64) -> HeightField {
    let texels = MapTexels::new(size[0], values(size[0], size[1])).unwrap();
    HeightField {
        kind: Kind::Map,
        wavelength,
        amplitude,
        octaves: 6,
        map: Some(HeightMap {
            origin: [-1234.5, 777.25],
            ..HeightMap::of(texels, edge)
        }),
        ..HeightField::default()
    }
}

fn position(random: &mut Random, reach: f64) -> WorldPos {
    let mut axis = || (f64::from(random.unit()) - 0.5) * 2.0 * reach;
    let (x, z) = (axis(), axis());
    let mut p = WorldPos::from_metres([x, 0.0, z].into());
    p.frac.x = random.unit();
    p.frac.z = random.unit();
    p
}

/// Judges `bare_land_at`.
#[test]
fn the_device_and_the_processor_read_maps_alike() {
    let mut random = Random(1);
    for edge in EDGES {
        for (size, texel, amplitude) in [
            ([64, 64], 30.0, 0.0),
            ([100, 37], 30.87, 20.0),
            ([1031, 517], 2.0, 3.0),
        ] {
            let field = field(edge, size, texel, amplitude);
            let single = field.prepare::<f32>().unwrap();
            let double = field.prepare::<f64>().unwrap();
            let (mut same, mut total) = (0, 0);
            let (mut places, mut off) = (0_f64, 0_f64);
            for reach in [3e3, 1e5, 1e8, 1e14] {
                for width in [0.0, 20.0, 45.0, 100.0, 3000.0] {
                    let all: Vec<WorldPos> =
                        (0..300).map(|_| position(&mut random, reach)).collect();
                    let found = heights(gpu(), veduta::programs(), &field, &all, width).unwrap();
                    for (p, g) in all.iter().zip(found) {
                        let twin = single.ground(*p, width);
                        let truth = double.ground(*p, f64::from(width));
                        total += 1;
                        same += i32::from(twin == g);
                        let apart = f64::from((g.height - twin.height).abs());
                        places = places.max(apart / f64::from(g.height.abs()).max(1e-9));
                        off = off.max((f64::from(g.height) - truth.height).abs());
                    }
                }
            }
            let places = places / (0.5 * f64::from(f32::EPSILON));
            println!(
                "{edge:?} {size:?}: {same} of {total} bit by bit, {places:.1} places, {:.2} mm",
                1e3 * off
            );
            // Heights are the same to the last bit; slopes and what is lost of them in nearly all places.
            assert_eq!(places, 0.0, "{edge:?} {size:?}");
            assert!(same * 10 > total * 8, "{edge:?} {size:?}: {same}");
            assert!(off <= 0.030, "{edge:?} {size:?}: {off} m");
        }
    }
}

#[test]
fn maps_are_their_definition() {
    let mut random = Random(2);
    for edge in EDGES {
        let size = [100, 37];
        let field = field(edge, size, 32.0, 0.0);
        let map = field.map.clone().unwrap();
        let double = field.prepare::<f64>().unwrap();
        let heights: Vec<f64> = map
            .texels
            .as_ref()
            .unwrap()
            .values()
            .iter()
            .map(|v| f64::from(*v))
            .collect();
        let truth = Relief::new(size, &heights, edge.number(), 32.0);
        let (mut height, mut slope, mut lost) = (0_f64, 0_f64, 0_f64);
        for i in 0..3000 {
            let p = position(&mut random, 8000.0);
            let width = [0.0, 25.0, 40.0, 90.0, 700.0, 1e4][i % 6];
            let found = double.ground(p, width);
            let metres = p.to_metres();
            let place = [metres.x - map.origin[0], metres.z - map.origin[1]].map(|m| m / 32.0);
            let exact = relief::ground(&truth, place, width);
            height = height.max((found.height - exact.height).abs());
            for k in 0..2 {
                slope = slope.max((found.slope[k] - exact.slope[k]).abs());
            }
            lost = lost.max((found.lost - exact.lost).abs() / (0.1 + exact.lost));
        }
        println!("{edge:?}: height {height:.1e} m, slope {slope:.1e}, lost {lost:.1e}");
        // Levels are kept in `f32`.
        assert!(height < 5e-3 && slope < 1e-4 && lost < 1e-3, "{edge:?}");
        // The surface goes through the texels.
        let middle =
            WorldPos::from_metres([map.origin[0] + 320.0, 0.0, map.origin[1] + 640.0].into());
        let there = double.ground(middle, 0.0).height;
        assert!((there - heights[20 * 100 + 10]).abs() < 1e-3, "{there}");
    }
}

#[test]
fn slopes_of_maps_are_those_of_their_heights_and_bounds_hold() {
    let mut random = Random(3);
    for edge in EDGES {
        let field = field(edge, [100, 37], 30.0, 20.0);
        let bounds = field.bounds().unwrap();
        let double = field.prepare::<f64>().unwrap();
        let (mut low, mut high, mut steep) = (f64::INFINITY, f64::NEG_INFINITY, 0_f64);
        for i in 0..6000 {
            let eye = double.place(position(&mut random, 3e3));
            let width = [0.0, 25.0, 40.0, 90.0, 700.0][i % 5];
            let at = |x: f64, z: f64| double.ground_from(eye, [x, z], width);
            let g = at(0.0, 0.0);
            let d = 1e-3;
            let central = [
                (at(d, 0.0).height - at(-d, 0.0).height) / (2.0 * d),
                (at(0.0, d).height - at(0.0, -d).height) / (2.0 * d),
            ];
            for k in 0..2 {
                assert!(
                    (g.slope[k] - central[k]).abs() < 2e-3,
                    "{:?} {central:?}",
                    g.slope
                );
            }
            (low, high) = (low.min(g.height), high.max(g.height));
            steep = steep.max(g.slope[0].hypot(g.slope[1]));
        }
        println!(
            "{edge:?}: heights {low:.0} .. {high:.0} of {:.0} .. {:.0}, slope {steep:.1} of {:.1}",
            bounds.minimum, bounds.maximum, bounds.lipschitz
        );
        assert!(low >= bounds.minimum && high <= bounds.maximum && steep <= bounds.lipschitz);
        assert!(high - low > 0.8 * (bounds.maximum - bounds.minimum));
        assert!(steep > 0.3 * bounds.lipschitz);
    }
}

#[test]
fn filtered_maps_are_nearer_to_the_mean_over_the_footprint() {
    let mut random = Random(4);
    let field = field(Edge::Mirror, [256, 256], 30.0, 0.0);
    let double = field.prepare::<f64>().unwrap();
    for width in [60.0, 100.0, 200.0, 400.0] {
        let (mut with, mut without, mut all, mut kept) = (0.0, 0.0, 0.0, 0.0);
        for _ in 0..600 {
            let eye = double.place(position(&mut random, 1e5));
            let mut mean = 0.0;
            for k in 0..256 {
                let at = [k % 16, k / 16].map(|i| width * ((f64::from(i) + 0.5) / 16.0 - 0.5));
                let g = double.ground_from(eye, at, 0.0);
                mean += g.height / 256.0;
                all += (g.slope[0].powi(2) + g.slope[1].powi(2)) / 256.0;
            }
            let g = double.ground_at(eye, width);
            with += (g.height - mean).powi(2);
            without += (double.ground_at(eye, 0.0).height - mean).powi(2);
            kept += g.slope[0].powi(2) + g.slope[1].powi(2) + g.lost;
        }
        let [with, without] = [with, without].map(|s: f64| (s / 600.0).sqrt());
        println!(
            "footprint {width}: filtered {with:.1} m, unfiltered {without:.1} m, slopes {:.3}",
            kept / all
        );
        assert!(with < without && (kept / all - 1.0_f64).abs() < 0.2);
    }
}

#[test]
fn rays_over_a_map_meet_it() {
    for (edge, amplitude) in [(Edge::Repeat, 0.0), (Edge::Clamp, 15.0)] {
        let mut land = Land {
            field: field(edge, [128, 128], 60.0, amplitude),
            ..Land::default()
        };
        land.field.map.as_mut().unwrap().highest = 0.3;
        let ground = land.field.prepare::<f64>().unwrap();
        for place in [[2000.0, 3000.0], [1e8, -1e8]] {
            let foot = WorldPos::from_metres([place[0], 0.0, place[1]].into());
            let height = ground.ground(foot, 0.0).height;
            let origin = foot.moved_by([0.0, height + 300.0, 0.0].into());
            let (columns, rows) = (128, 72);
            let angle = 1.0 / f64::from(columns);
            let rays: Vec<TerrainRay> = (0..columns * rows)
                .map(|i| {
                    let x = f64::from(i % columns - columns / 2) * angle;
                    let y = f64::from(rows / 2 - i / columns) * angle - 0.1;
                    let length = (1.0 + x * x + y * y).sqrt();
                    TerrainRay {
                        origin,
                        dir: [x / length, y / length, 1.0 / length],
                        far: 30_000.0,
                    }
                })
                .collect();
            // The march costs ten times as much.
            let both = [RayPath::Fast, RayPath::Textbook];
            for path in &both[..if place[0] < 1e6 { 2 } else { 1 }] {
                let path = *path;
                let mut query = TerrainQuery::new(gpu(), veduta::programs(), &land).unwrap();
                query.set_baked_from(1);
                let found = query.ray_hits(&rays, angle as f32, path).unwrap();
                let errors = hit_errors(&land, &rays, columns as usize, angle, &found).unwrap();
                println!(
                    "{edge:?} {place:?} {path:?}: {} hits, {} wrong, {} at the silhouette, {:.3} footprints",
                    errors.across.len(),
                    errors.wrong,
                    errors.at_silhouette,
                    errors.centile(0.99)
                );
                assert!(errors.across.len() > 2800);
                if path == RayPath::Fast {
                    // 100,000 km away with detail: 0.24.
                    let bar = if place[0] < 1e6 { 0.005 } else { 0.5 };
                    assert!(errors.wrong == 0 && errors.centile(0.99) < bar);
                } else {
                    // Half the clearance is no safe step on slopes as steep as these: the march ends inside of cliffs, at 99 % up to 6.7 footprints deep.
                    assert!(errors.wrong as f64 <= 0.002 * rays.len() as f64);
                    assert!(errors.at_silhouette as f64 <= 0.01 * rays.len() as f64);
                    assert!(errors.centile(0.5) < 0.2 && errors.centile(0.99) < 10.0);
                }
            }
        }
    }
}

#[test]
fn textures_of_the_host_are_read() {
    let device = &gpu().device;
    let make = |format| {
        device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d {
                width: 5,
                height: 3,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::COPY_SRC | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        })
    };
    let texture = make(wgpu::TextureFormat::R32Float);
    let values: Vec<f32> = (0..15_u8).map(|i| f32::from(i) * 1.5).collect();
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    gpu().queue.write_texture(
        texture.as_image_copy(),
        &bytes,
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(20),
            rows_per_image: None,
        },
        texture.size(),
    );
    let texels = MapTexels::from_texture(gpu(), &texture).unwrap();
    assert_eq!((texels.size(), texels.values()), ([5, 3], &values[..]));
    let other = make(wgpu::TextureFormat::Rgba8Unorm);
    let fault = MapTexels::from_texture(gpu(), &other).unwrap_err();
    assert!(fault.to_string().contains("R32Float"), "{fault}");
}

#[test]
fn faults_of_maps_name_what_is_wrong() {
    let good = field(Edge::Repeat, [4, 4], 30.0, 0.0);
    let text = |field: HeightField| field.prepare::<f64>().unwrap_err().to_string();
    assert!(
        MapTexels::new(4, vec![0.0; 15])
            .unwrap_err()
            .to_string()
            .contains("15 values in rows of 4")
    );
    assert!(MapTexels::new(1, vec![0.0; 15]).is_err());
    assert!(
        MapTexels::new(2, vec![0.0, 0.0, 0.0, f32::NAN])
            .unwrap_err()
            .to_string()
            .contains("map.values[1][1]")
    );
    let none = text(HeightField {
        map: None,
        ..good.clone()
    });
    assert!(none.contains("field.map"), "{none}");
    let other = text(HeightField {
        kind: Kind::Fbm,
        wavelength: 100.0,
        ..good.clone()
    });
    assert!(other.contains("field.map"), "{other}");
    let with = |change: fn(&mut HeightMap)| {
        let mut field = good.clone();
        change(field.map.as_mut().unwrap());
        field
    };
    for (name, bad) in [
        ("map.lowest", with(|m| m.lowest = f64::NAN)),
        ("map.highest", with(|m| m.highest = 3e4)),
        ("map.origin", with(|m| m.origin[1] = f64::INFINITY)),
        ("map.height", with(|m| m.highest = 1e4)),
        ("map.texels", with(|m| m.texels = None)),
    ] {
        let text = text(bad);
        assert!(text.contains(name), "{text}");
    }
    let land = Land::from_ron(
        "(field: (kind: Map, map: Some((file: \"a.png\", edge: Mirror, lowest: -10, highest: 3000)), wavelength: 30, amplitude: 0, octaves: 1, hurst: 1))",
    )
    .unwrap();
    assert_eq!(Land::from_ron(&land.to_ron().unwrap()).unwrap(), land);
    let text = land.field.bounds().unwrap_err().to_string();
    assert!(text.contains("a.png"), "{text}");
}

#[cfg(feature = "height_maps")]
mod files {
    use super::*;
    use std::path::PathBuf;
    use veduta::Error;

    fn folder() -> PathBuf {
        let folder = std::env::temp_dir().join(format!("veduta-maps-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        folder
    }

    fn npy(kind: &str, shape: &str, data: &[u8]) -> Vec<u8> {
        let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}\n");
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend(data);
        bytes
    }

    fn read(name: &str, bytes: &[u8]) -> Result<MapTexels, Error> {
        let folder = folder();
        std::fs::write(folder.join(name), bytes).unwrap();
        let mut map = HeightMap {
            file: name.to_owned(),
            ..HeightMap::default()
        };
        map.read(&folder)?;
        Ok(map.texels.unwrap())
    }

    fn png_bytes(color: png::ColorType, depth: png::BitDepth, data: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 3, 2);
        encoder.set_color(color);
        encoder.set_depth(depth);
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(data).unwrap();
        writer.finish().unwrap();
        bytes
    }

    #[test]
    fn maps_are_read_from_files() {
        let numbers: [f32; 6] = [1.0, -2.5, 3.0, 4.0, 5.0, 6e3];
        let bytes: Vec<u8> = numbers.iter().flat_map(|v| v.to_le_bytes()).collect();
        let found = read("a.npy", &npy("<f4", "(2, 3)", &bytes)).unwrap();
        assert_eq!((found.size(), found.values()), ([3, 2], &numbers[..]));
        let bytes: Vec<u8> = numbers
            .iter()
            .flat_map(|v| (*v as i16).to_be_bytes())
            .collect();
        let found = read("b.npy", &npy(">i2", "(2, 3)", &bytes)).unwrap();
        assert_eq!(found.values(), [1.0, -2.0, 3.0, 4.0, 5.0, 6000.0]);
        let words: Vec<u8> = [0_u16, 13107, 65535, 1, 2, 3]
            .iter()
            .flat_map(|v| v.to_be_bytes())
            .collect();
        let file = png_bytes(png::ColorType::Grayscale, png::BitDepth::Sixteen, &words);
        let found = read("c.png", &file).unwrap();
        assert_eq!(found.size(), [3, 2]);
        assert_eq!(&found.values()[..3], [0.0, 0.2, 1.0]);
        let path = folder().join("d.exr");
        let size = exr::prelude::Vec2(3, 2);
        let channel = exr::prelude::AnyChannel::new(
            "height",
            exr::prelude::FlatSamples::F32(numbers.to_vec()),
        );
        let channels = exr::prelude::AnyChannels::sort([channel].into_iter().collect());
        use exr::prelude::WritableImage as _;
        exr::prelude::Image::from_channels(size, channels)
            .write()
            .to_file(&path)
            .unwrap();
        let found = read("d.exr", &std::fs::read(&path).unwrap()).unwrap();
        assert_eq!((found.size(), found.values()), ([3, 2], &numbers[..]));
        // A land with its map beside it.
        let ron = "(field: (kind: Map, map: Some((file: \"c.png\", highest: 500)), wavelength: 30, amplitude: 0, octaves: 1, hurst: 1))";
        std::fs::write(folder().join("land.ron"), ron).unwrap();
        let land = Land::read(&folder().join("land.ron")).unwrap();
        let at = WorldPos::from_metres([60.0, 0.0, 0.0].into());
        let height = land.field.prepare::<f64>().unwrap().ground(at, 0.0).height;
        assert!((height - 500.0).abs() < 1e-3, "{height}");
    }

    #[test]
    fn bad_files_are_told_apart() {
        let fault = |name: &str, bytes: &[u8], what: &str| {
            let text = read(name, bytes).unwrap_err().to_string();
            assert!(text.contains(what) && text.contains(name), "{text}");
        };
        fault("e.tif", b"", ".png, .exr or .npy");
        fault("f.npy", b"nothing", "no NPY file");
        fault(
            "f.npy",
            &npy("<f4", "(2, 3)", &[0; 23]),
            "do not fill its 23 bytes",
        );
        fault("f.npy", &npy("<c8", "(2, 3)", &[0; 48]), "c8");
        fault(
            "f.npy",
            &npy("<f4", "(2, 3, 1)", &[0; 24]),
            "(rows, columns)",
        );
        fault(
            "f.npy",
            &npy("<f4", "(99999999999, 99999999999)", &[0; 24]),
            "do not fill",
        );
        fault("f.npy", &npy("<f4", "(1, 6)", &[0; 24]), "whole rows");
        fault("f.npy", &npy("<f4", "(2, 3)", &[255; 24]), "finite");
        fault("g.png", b"\x89PNG", "map");
        let color = png_bytes(png::ColorType::Rgb, png::BitDepth::Eight, &[0; 18]);
        fault("g.png", &color, "Grayscale");
        let grey = png_bytes(png::ColorType::Grayscale, png::BitDepth::Sixteen, &[7; 12]);
        for end in [9, 30, grey.len() - 20] {
            fault("g.png", &grey[..end], "g.png");
        }
        fault("h.exr", b"\x76\x2f\x31\x01", "h.exr");
        let mut lost = HeightMap {
            file: "nowhere.png".to_owned(),
            ..HeightMap::default()
        };
        let text = lost.read(&folder()).unwrap_err().to_string();
        assert!(text.contains("nowhere.png"), "{text}");
    }
}
