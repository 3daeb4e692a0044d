//! Weather maps of layers of clouds: device and reference, what a map shows and hides, files and their faults.

use crate::common::{Random, gpu};
use veduta::atmosphere::ProbeRay;
use veduta::clouds::{
    CloudDeck, CloudLights, CloudQuality, CloudShape, Clouds, CloudsOptions, LayerOptions, Orders,
    ProbePath, WeatherMap, WeatherTexels, layer_light,
};
use veduta::glam::{DVec3, Vec3};
use veduta::reference::volume::{self, VolumePaths};
use veduta::view::direction;
use veduta::{Preset, Targets, View, WorldPos, wgpu};

fn texels(width: usize, rows: usize, of: impl Fn(usize, usize) -> [f32; 2]) -> WeatherTexels {
    let values = (0..width * rows).map(|k| of(k % width, k / width));
    WeatherTexels::new(width, values.collect()).unwrap()
}

fn deck(map: WeatherMap) -> CloudDeck {
    CloudDeck {
        bottom: 1000.0,
        thickness: 2000.0,
        coverage: 0.9,
        wavelength: 2000.0,
        period_doublings: 3,
        extinction: 0.03,
        seed: 6,
        shape: Some(CloudShape {
            kind: 1.0,
            kind_spread: 0.0,
            coverage_spread: 0.0,
            detail: 0.6,
            map: Some(map),
            ..CloudShape::default()
        }),
        ..CloudDeck::default()
    }
}

/// Rays up from the ground and down from above, from 25 to 80 degrees.
fn rays() -> Vec<ProbeRay> {
    (0..64)
        .map(|k| {
            let down = k % 2 == 1;
            let pitch = 0.45 + 0.95 * f64::from(k) / 64.0;
            let dir = direction(if down { -pitch } else { pitch }, 2.4 * f64::from(k));
            ProbeRay {
                altitude: if down { 4000.0 } else { 200.0 },
                dir: dir.to_array(),
                to_sun: direction(0.9, 0.7).to_array(),
                distance: f64::INFINITY,
            }
        })
        .collect()
}

fn root(list: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0_f64);
    for value in list {
        sum += value * value;
        count += 1.0;
    }
    (sum / count).sqrt()
}

/// Judges `map_weather` and `mapped_density`, in the march and in the bake of the tile.
#[test]
fn clouds_under_a_weather_map_meet_the_reference() {
    let mut random = Random(5);
    let noise: Vec<[f32; 2]> = (0..12 * 7)
        .map(|_| [random.unit(), 0.3 + 0.7 * random.unit()])
        .collect();
    let list = rays();
    let paths = VolumePaths {
        samples: 400,
        max_order: 1,
        ..Default::default()
    };
    for extent in [None, Some(8000.0)] {
        let map = WeatherMap {
            extent,
            ..WeatherMap::of(texels(12, 7, |x, z| noise[12 * z + x]))
        };
        let deck = deck(map.clone());
        let truth = volume::layer_light(&deck, &list, Orders::All, &paths);
        let rms = root(truth.iter().map(|t| t[0]));
        let own = root(truth.iter().map(|t| t[1])) / rms;
        let opaque = truth.iter().filter(|t| t[2] < 0.5).count();
        assert!((8..56).contains(&opaque), "{opaque}");
        // Another map is told from it.
        let turned = texels(12, 7, |x, z| noise[12 * (6 - z) + x]);
        let other = self::deck(WeatherMap {
            texels: Some(turned),
            ..map
        });
        for (path, scattered, clear) in [
            (ProbePath::Textbook, 0.02, 0.01),
            (ProbePath::Fast, 0.2, 0.05),
        ] {
            let options = LayerOptions {
                path,
                orders: Orders::Single,
                ..Default::default()
            };
            let ask = |deck: &CloudDeck| {
                layer_light(gpu(), veduta::programs(), deck, &list, &options).unwrap()
            };
            let (found, wrong) = (ask(&deck), ask(&other));
            let through = |of: &[veduta::clouds::CubeLight]| {
                root((0..list.len()).map(|k| f64::from(of[k].transmittance) - truth[k][2]))
            };
            let off = root((0..list.len()).map(|k| f64::from(found[k].scatter) - truth[k][0]));
            println!(
                "{path:?}: transmittance {:.4} (another map {:.3}), light {:.4} (noise {own:.4})",
                through(&found),
                through(&wrong),
                off / rms
            );
            assert!(through(&found) < clear, "{path:?}");
            assert!(through(&wrong) > 0.1, "{path:?}");
            let most = (scattered * scattered + (2.0 * own).powi(2)).sqrt();
            assert!(off / rms < most, "{path:?}");
        }
    }
}

const SIZE: [u32; 2] = [64, 36];

fn picture(clouds: &mut Clouds, view: &View) -> Vec<u8> {
    let gpu = gpu();
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d {
            width: SIZE[0],
            height: SIZE[1],
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba16Float,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let lights = CloudLights::clear(Vec3::ONE);
    let _ = clouds
        .prepare(&gpu.queue, &mut encoder, view, &lights)
        .unwrap();
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &texture.create_view(&Default::default()),
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                store: wgpu::StoreOp::Store,
            },
        })],
        ..Default::default()
    });
    let _ = clouds.composite(&mut pass).unwrap();
    drop(pass);
    gpu.queue.submit([encoder.finish()]);
    gpu.read_texture(&texture).unwrap()
}

fn new(deck: CloudDeck) -> Clouds {
    let targets = Targets {
        color_format: wgpu::TextureFormat::Rgba16Float,
        ..Default::default()
    };
    let options = CloudsOptions {
        deck,
        quality: CloudQuality {
            cells: [32, 2],
            ..CloudQuality::of(&Preset::Low)
        },
        orders: Orders::Single,
        ..Default::default()
    };
    Clouds::new(&gpu().device, veduta::programs(), &targets, &options).unwrap()
}

fn looking() -> View {
    let mut view = View {
        eye: WorldPos::from_metres(DVec3::new(100.0, 300.0, -300.0)),
        ..Default::default()
    };
    view.look(0.4, 0.9, 0.8, 16.0 / 9.0);
    view
}

/// Words of 16 bits that say: nothing but what was behind.
fn clear(picture: &[u8]) -> bool {
    picture.chunks(8).all(|p| *p == [0, 0, 0, 0, 0, 0, 0, 0x3c])
}

#[test]
fn a_weather_map_of_nothing_shows_nothing() {
    let none = deck(WeatherMap::of(texels(4, 4, |_, _| [0.0, 1.0])));
    for path in [ProbePath::Textbook, ProbePath::Fast] {
        let options = LayerOptions {
            path,
            orders: Orders::Single,
            ..Default::default()
        };
        let found = layer_light(gpu(), veduta::programs(), &none, &rays(), &options).unwrap();
        assert!(
            found
                .iter()
                .all(|l| l.scatter == 0.0 && l.transmittance == 1.0)
        );
    }
    let view = looking();
    assert!(clear(&picture(&mut new(none.clone()), &view)));
    let full = deck(WeatherMap::of(texels(4, 4, |_, _| [1.0, 1.0])));
    let shown = picture(&mut new(full.clone()), &view);
    assert!(!clear(&shown));
    // Twice as many metres of the same are the same; a host's texture takes the map's place, and back.
    let mut clouds = new(none);
    assert!(clear(&picture(&mut clouds, &view)));
    let host = |value: f32, format| {
        let texture = gpu().device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d {
                width: 2,
                height: 3,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(16),
            rows_per_image: None,
        };
        let bytes = value.to_le_bytes().repeat(12);
        if format == wgpu::TextureFormat::Rg32Float {
            let queue = &gpu().queue;
            queue.write_texture(texture.as_image_copy(), &bytes, layout, texture.size());
        }
        texture.create_view(&Default::default())
    };
    let device = &gpu().device;
    for (value, wanted) in [(1.0, Some(&shown)), (0.0, None)] {
        let view_of = host(value, wgpu::TextureFormat::Rg32Float);
        clouds.set_weather(device, &view_of).unwrap();
        let found = picture(&mut clouds, &view);
        match wanted {
            // Steps in the clear are shorter under a host's map.
            Some(shown) => {
                let off = found.iter().zip(shown.iter()).filter(|(a, b)| a != b);
                assert!(!clear(&found) && off.count() < found.len() / 2);
            }
            None => assert!(clear(&found)),
        }
    }
    let wrong = host(0.0, wgpu::TextureFormat::R32Float);
    let text = clouds.set_weather(device, &wrong).unwrap_err().to_string();
    assert!(text.contains("R32Float"), "{text}");
    let text = new(CloudDeck::named("fair").unwrap())
        .set_weather(device, &host(1.0, wgpu::TextureFormat::Rg32Float))
        .unwrap_err()
        .to_string();
    assert!(text.contains("deck.shape.map"), "{text}");
}

/// A clear half of the map is clear land: the transmittance from the ground straight up tells which is which.
#[test]
fn a_weather_map_lies_where_it_says() {
    // Clouds in the western half of each of the two maps along the period of 16 km.
    let map = WeatherMap {
        extent: Some(8000.0),
        ..WeatherMap::of(texels(8, 2, |x, _| [f32::from(u8::from(x < 4)), 1.0]))
    };
    let deck = CloudDeck {
        uniformity: 0.5,
        ..deck(map)
    };
    let points: Vec<[f64; 3]> = (0..64)
        .map(|k| [125.0 + 250.0 * f64::from(k), 0.0, 3000.0])
        .collect();
    let up = [0.0, 1.0, 0.0];
    let found =
        veduta::clouds::layer_shadow(gpu(), veduta::programs(), &deck, up, &points).unwrap();
    for ([x, ..], share) in points.iter().zip(found) {
        let place = x.rem_euclid(8000.0);
        // Between texels it fades.
        if (4500.0..7500.0).contains(&place) {
            assert_eq!(share, 1.0, "{x}");
        } else if (500.0..3500.0).contains(&place) {
            assert!(share < 0.5, "{x} {share}");
        }
    }
}

#[test]
fn faults_of_weather_maps_are_told() {
    let fault = |text: String, what: &str| assert!(text.contains(what), "{text}");
    let made =
        |width, values: Vec<[f32; 2]>| WeatherTexels::new(width, values).unwrap_err().to_string();
    fault(made(0, vec![]), "weather.width");
    fault(made(3, vec![[0.0; 2]; 7]), "whole rows");
    fault(made(4097, vec![[0.0; 2]; 4097]), "weather.width");
    fault(
        made(2, vec![[0.0; 2], [0.5, 1.5]]),
        "weather.values[0][1].kind",
    );
    let bad = vec![[0.0; 2], [0.0; 2], [f32::NAN, 0.0]];
    fault(made(1, bad), "weather.values[2][0].coverage");
    let good = WeatherMap::of(texels(2, 2, |_, _| [1.0; 2]));
    let checked = |deck: CloudDeck| deck.check().unwrap_err().to_string();
    let mut both = deck(good.clone());
    both.shape.as_mut().unwrap().coverage_spread = 0.1;
    fault(checked(both), "deck.shape.coverage_spread");
    let mut both = deck(good.clone());
    both.shape.as_mut().unwrap().kind_spread = 0.1;
    fault(checked(both), "deck.shape.kind_spread");
    for extent in [5000.0, 0.0, -16_000.0, f64::NAN, 32_000.0, 1.0] {
        let map = WeatherMap {
            extent: Some(extent),
            ..good.clone()
        };
        fault(checked(deck(map)), "deck.shape.map.extent");
    }
    // Not read yet.
    let lost = deck(WeatherMap {
        file: "a.png".to_owned(),
        ..WeatherMap::default()
    });
    lost.check().unwrap();
    for path in [ProbePath::Textbook, ProbePath::Fast] {
        let options = LayerOptions {
            path,
            orders: Orders::Single,
            ..Default::default()
        };
        let error = layer_light(gpu(), veduta::programs(), &lost, &rays(), &options);
        fault(error.unwrap_err().to_string(), "a.png");
    }
}

#[cfg(feature = "height_maps")]
mod files {
    use super::*;

    fn folder() -> std::path::PathBuf {
        let folder = std::env::temp_dir().join(format!("veduta-weather-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        folder
    }

    fn read(name: &str, bytes: &[u8]) -> Result<WeatherTexels, String> {
        std::fs::write(folder().join(name), bytes).unwrap();
        let mut map = WeatherMap {
            file: name.to_owned(),
            ..WeatherMap::default()
        };
        map.read(&folder()).map_err(|e| e.to_string())?;
        Ok(map.texels.unwrap())
    }

    fn png_bytes(color: png::ColorType, depth: png::BitDepth, data: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
        encoder.set_color(color);
        encoder.set_depth(depth);
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(data).unwrap();
        writer.finish().unwrap();
        bytes
    }

    fn npy(shape: &str, numbers: &[f32]) -> Vec<u8> {
        let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}\n");
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend(numbers.iter().flat_map(|v| v.to_le_bytes()));
        bytes
    }

    #[test]
    fn weather_maps_are_read_from_files() {
        use png::{BitDepth, ColorType};
        let wanted = [[0.2_f32, 1.0], [0.6, 0.0]];
        let b = |v: [u8; 6]| v.to_vec();
        let rgb = png_bytes(ColorType::Rgb, BitDepth::Eight, &b([51, 255, 9, 153, 0, 7]));
        let words: Vec<u8> = [13107_u16, 65535, 39321, 0]
            .iter()
            .flat_map(|v| v.to_be_bytes())
            .collect();
        let grey = png_bytes(ColorType::GrayscaleAlpha, BitDepth::Sixteen, &words);
        let numbers = npy("(1, 2, 2)", wanted.as_flattened());
        for (name, bytes) in [("a.png", &rgb), ("b.png", &grey), ("c.npy", &numbers)] {
            let found = read(name, bytes).unwrap();
            assert_eq!(
                (found.size(), found.values()),
                ([2, 1], &wanted[..]),
                "{name}"
            );
        }
        use exr::prelude::{AnyChannel, AnyChannels, FlatSamples, Image, Vec2, WritableImage as _};
        for [first, second] in [["coverage", "kind"], ["R", "G"]] {
            let of = |name, k: usize| {
                AnyChannel::new(
                    name,
                    FlatSamples::F32(wanted.iter().map(|t| t[k]).collect()),
                )
            };
            // Another one beside them.
            let list = [of(first, 0), of(second, 1), of("alpha", 1)];
            let channels = AnyChannels::sort(list.into_iter().collect());
            let path = folder().join("d.exr");
            Image::from_channels(Vec2(2, 1), channels)
                .write()
                .to_file(&path)
                .unwrap();
            let found = read("d.exr", &std::fs::read(&path).unwrap()).unwrap();
            assert_eq!((found.size(), found.values()), ([2, 1], &wanted[..]));
        }
        let text = "(shape: Some((kind_spread: 0, coverage_spread: 0, map: Some((file: \"c.npy\", extent: Some(8000))))))";
        std::fs::write(folder().join("deck.ron"), text).unwrap();
        let deck = CloudDeck::read(&folder().join("deck.ron")).unwrap();
        let map = deck.shape.unwrap().map.unwrap();
        assert_eq!(map.extent, Some(8000.0));
        assert_eq!(map.texels.unwrap().values(), wanted);
    }

    #[test]
    fn bad_files_of_weather_are_told_apart() {
        let fault = |name: &str, bytes: &[u8], what: &str| {
            let text = read(name, bytes).unwrap_err();
            assert!(text.contains(what) && text.contains(name), "{text}");
        };
        let grey = png_bytes(png::ColorType::Grayscale, png::BitDepth::Eight, &[1, 2]);
        fault("e.png", &grey, "Rgb");
        fault("e.tif", b"", ".png, .exr or .npy");
        fault("e.npy", &npy("(2, 2)", &[0.0; 4]), "(rows, columns, 2)");
        fault("e.npy", &npy("(1, 2, 2)", &[0.0; 3]), "do not fill");
        fault(
            "e.npy",
            &npy("(1, 1, 2)", &[0.5, 2.0]),
            "weather.values[0][0].kind",
        );
        fault(
            "e.npy",
            &npy("(1, 1, 2)", &[f32::INFINITY, 0.0]),
            "in [0, 1]",
        );
        let mut lost = WeatherMap {
            file: "nowhere.png".to_owned(),
            ..WeatherMap::default()
        };
        let text = lost.read(&folder()).unwrap_err().to_string();
        assert!(text.contains("nowhere.png"), "{text}");
    }

    #[test]
    fn the_shipped_map_is_read() {
        let path =
            std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/weather/front.ron");
        let deck = CloudDeck::read(&path).unwrap();
        let texels = deck
            .shape
            .as_ref()
            .unwrap()
            .map
            .as_ref()
            .unwrap()
            .texels
            .clone();
        let texels = texels.unwrap();
        assert_eq!(texels.size(), [64, 64]);
        // A line of towers through its middle, few clouds east of it, also over the border.
        for k in 0..64 {
            let z = f64::from(k) / 64.0;
            let most = (0..64)
                .map(|x| texels.at([f64::from(x) / 64.0, z]))
                .fold([0.0_f64; 2], |a, b| [a[0].max(b[0]), a[1].max(b[1])]);
            assert!(most[0] > 0.95 && most[1] > 0.95, "{k} {most:?}");
            let [cover, kind] = texels.at([0.8, z]);
            assert!(cover < 0.4 && kind < 0.4, "{k} {cover} {kind}");
        }
    }
}
