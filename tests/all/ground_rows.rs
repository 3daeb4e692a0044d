//! The living ground's capabilities one by one: rows of the table in docs/ground.md that no other test has.

use veduta::ground::{
    Boundary, CHANNELS, Ground, GroundEdit, GroundOptions, GroundScene, GroundState, Scheme, Shape,
    Tool,
};
use veduta::terrain::{HeightField, HeightMap, Kind, MapTexels};

use crate::common::{Random, gpu};
use crate::ground::{edited, flat, hilly, made, run, steps};
use veduta::ground::Erosion;
use veduta::reference::ground as reference;

fn levels(state: &GroundState, z: usize) -> Vec<f64> {
    (0..state.columns)
        .map(|x| state.ground(x, z) + state.water(x, z))
        .collect()
}

/// Row 5: a cell's channels come back as they went in, and levels that differ by a millimetre at 100 m stay apart, where 16-bit floats have steps of 6 cm.
#[test]
fn ground_state_has_the_layout_and_no_steps() {
    let (columns, rows) = (40, 24);
    for scheme in [Scheme::Source, Scheme::Physical] {
        let mut random = Random(8);
        let mut begin = flat(columns, rows, |_, _| 0.0);
        for c in begin.cells.chunks_exact_mut(CHANNELS) {
            c[0] = random.between(95.0, 96.0);
            c[1] = random.between(0.0, 1.0);
            c[2] = random.between(0.0, 0.1);
            c[3] = random.between(0.0, 1.0);
            if scheme == Scheme::Source {
                for speed in &mut c[4..8] {
                    *speed = random.between(0.0, 1.0);
                }
            }
            c[8] = random.between(-0.1, 0.1);
            for lost in &mut c[9..12] {
                *lost = random.between(-1e-9, 1e-9);
            }
        }
        let options = GroundOptions {
            scheme,
            ..Default::default()
        };
        let end = made(&options, &begin).state(gpu()).unwrap();
        assert_eq!(begin.cells, end.cells, "{scheme:?}");
    }
    let tilted = flat(columns, rows, |x, _| 100.0 + 1e-3 * x);
    let end = made(&GroundOptions::default(), &tilted)
        .state(gpu())
        .unwrap();
    let all = levels(&end, 3);
    assert!(all.windows(2).all(|w| (w[1] - w[0] - 1e-3).abs() < 1e-5));
    // A 16-bit float has 11 binary digits: steps of 1/16 at 100.
    let coarse: Vec<f64> = all.iter().map(|h| (h * 16.0).round() / 16.0).collect();
    let steps = coarse.windows(2).filter(|w| w[0] != w[1]).count();
    assert_eq!(steps, 1);
}

/// Row 9: how far along a channel the water's centre gets, with its speed taken along and without.
#[test]
fn ground_waves_travel_farther_with_momentum() {
    let centre = |momentum: bool| {
        let mut begin = flat(256, 16, |_, _| 0.0);
        for z in 0..16 {
            for x in 0..256 {
                let c = begin.cell_mut(x, z);
                c[1] = if x < 16 { 2.0 } else { 0.05 };
                // A wave on its way.
                c[4] = if x < 16 { 1.0 } else { 0.0 };
            }
        }
        let options = GroundOptions {
            boundary: Boundary::Closed,
            momentum,
            ..Default::default()
        };
        let (end, _) = run(&options, &begin, 200);
        let row = levels(&end, 8);
        let sum: f64 = row.iter().sum();
        let mean = row
            .iter()
            .zip(0..)
            .map(|(w, x)| w * f64::from(x))
            .sum::<f64>()
            / sum;
        let front = row.iter().rposition(|w| *w > 0.06).unwrap();
        (mean, front)
    };
    let (with, without) = (centre(true), centre(false));
    println!("centre and front with momentum {with:?}, without {without:?}");
    assert!(with.0 > without.0 + 1.0, "{with:?} {without:?}");
    assert!(with.1 > without.1, "{with:?} {without:?}");
}

/// Row 10: rain on a valley with a hollow in its floor makes a stream that runs down the middle and a lake with a level surface; when it stops nothing more is gained and the stream runs dry, the lake
/// stays.
#[test]
fn ground_rain_makes_streams_and_lakes() {
    let (columns, rows) = (96, 64);
    let hollow = |x: f64, z: f64| ((x - 66.0).powi(2) + 2.0 * (z - 32.0).powi(2)).sqrt();
    let begin = flat(columns, rows, |x, z| {
        let valley = 20.0 - 0.15 * x + 0.25 * (z - 32.0).abs();
        valley - 6.0 * (1.0 - hollow(x, z) / 12.0).max(0.0)
    });
    // Steps of shallow water are shorter: more rain and more of them.
    for (scheme, rain, drying) in [
        (Scheme::Source, 2e-4_f32, 8000),
        (Scheme::Physical, 2e-3, 16_000),
    ] {
        let mut options = GroundOptions {
            scheme,
            rain,
            step: if scheme == Scheme::Source { 0.25 } else { 0.0 },
            friction: 0.03,
            ..Default::default()
        };
        let mut ground = made(&options, &begin);
        steps(&mut ground, 4000);
        let wet = ground.state(gpu()).unwrap();
        let before = ground.report(gpu()).unwrap();
        let expected = f64::from(rain) * before.time * (columns * rows) as f64;
        assert!((before.gained / expected - 1.0).abs() < 1e-4, "{before:?}");
        // What passes a column below the hollow, by row: the stream has most of it.
        let passing: Vec<f64> = (0..rows)
            .map(|z| {
                let c = wet.cell(88, z);
                f64::from(c[4]) * wet.water(88, z)
            })
            .collect();
        let all: f64 = passing.iter().sum();
        let stream: f64 = passing[30..=34].iter().sum();
        println!("{scheme:?}: the stream has {:.0} %", 100.0 * stream / all);
        assert!(stream > 0.6 * all, "{scheme:?}: {stream} of {all}");
        // The lake: deep and level.
        let lake = |state: &GroundState| -> Vec<f64> {
            (0..columns * rows)
                .map(|k| (k % columns, k / columns))
                .filter(|(x, z)| hollow(*x as f64, *z as f64) < 12.0 && state.water(*x, *z) > 1.0)
                .map(|(x, z)| state.ground(x, z) + state.water(x, z))
                .collect()
        };
        let spread = |all: &[f64]| {
            all.iter().copied().fold(f64::NEG_INFINITY, f64::max)
                - all.iter().copied().fold(f64::INFINITY, f64::min)
        };
        assert!(wet.water(66, 32) > 3.0, "{}", wet.water(66, 32));
        assert!(lake(&wet).len() > 60, "{} cells", lake(&wet).len());
        // Streams pour into it on all sides.
        assert!(spread(&lake(&wet)) < 0.4, "{}", spread(&lake(&wet)));
        // No more rain.
        options.rain = 0.0;
        ground.set_options(&gpu().queue, &options).unwrap();
        steps(&mut ground, drying);
        let (after, end) = (ground.report(gpu()).unwrap(), ground.state(gpu()).unwrap());
        assert_eq!(after.gained, before.gained, "{scheme:?}");
        assert!(after.run_off > before.run_off);
        let stream_now: f64 = (28..=36)
            .map(|z| f64::from(end.cell(88, z)[4]) * end.water(88, z))
            .sum();
        assert!(stream_now < 0.05 * all, "{scheme:?}: {stream_now} of {all}");
        assert!(end.water(66, 32) > 3.0);
        assert!(spread(&lake(&end)) < 0.02, "{}", spread(&lake(&end)));
    }
}

/// Row 11: a wall keeps every drop; over open edges a plain runs dry.
#[test]
fn ground_aquariums_keep_and_open_edges_drain() {
    for scheme in [Scheme::Source, Scheme::Physical] {
        for boundary in [Boundary::Open, Boundary::Closed] {
            let mut begin = flat(48, 40, |_, _| 0.0);
            for c in begin.cells.chunks_exact_mut(CHANNELS) {
                c[1] = 0.5;
            }
            let options = GroundOptions {
                scheme,
                boundary,
                step: if scheme == Scheme::Source { 0.25 } else { 0.0 },
                ..Default::default()
            };
            let (end, report) = run(&options, &begin, 6000);
            let left = end.sums()[1] / begin.sums()[1];
            println!("{scheme:?} {boundary:?}: {left:.4} left, {report:?}");
            if boundary == Boundary::Closed {
                assert!((left - 1.0).abs() < 1e-9, "{scheme:?}: {left}");
            } else {
                assert!(left < 0.05, "{scheme:?}: {left}");
            }
        }
    }
}

/// Row 14: steps in one submission are steps one by one, to the bit.
#[test]
fn ground_steps_of_a_frame_are_single_steps() {
    for scheme in [Scheme::Source, Scheme::Physical] {
        let begin = hilly(70, 50, 12.0, 2);
        let options = GroundOptions {
            scheme,
            rain: 1e-4,
            step: if scheme == Scheme::Source { 0.25 } else { 0.0 },
            erosion: (scheme == Scheme::Source).then(Default::default),
            ..Default::default()
        };
        let mut one = made(&options, &begin);
        let mut many = made(&options, &begin);
        for _ in 0..60 {
            steps(&mut one, 1);
        }
        for count in [7, 1, 20, 32] {
            steps(&mut many, count);
        }
        assert_eq!(one.state(gpu()).unwrap(), many.state(gpu()).unwrap());
        assert_eq!(one.report(gpu()).unwrap(), many.report(gpu()).unwrap());
    }
}

/// Row 37: the range holds all heights, widens after an edit at the cursor, and never narrows.
#[test]
fn ground_range_holds_all_heights() {
    let begin = hilly(64, 48, 100.0, 4);
    let mut ground = made(&GroundOptions::default(), &begin);
    let extremes = |state: &GroundState| {
        (0..64 * 48)
            .map(|k| state.ground(k % 64, k / 64))
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], h| {
                [a.min(h), b.max(h)]
            })
    };
    let holds = |ground: &Ground| {
        let [low, high] = extremes(&ground.state(gpu()).unwrap());
        let [a, b] = ground.range().map(f64::from);
        assert!(a <= low + 1e-5 && b >= high - 1e-5, "{a} {b}: {low} {high}");
    };
    holds(&ground);
    let mut before = ground.range();
    let looked = |ground: &mut Ground, place: [f32; 2]| {
        let mut encoder = gpu().device.create_command_encoder(&Default::default());
        let mut query = ground
            .query(&gpu().device, &gpu().queue, &mut encoder, &[place])
            .unwrap();
        gpu().queue.submit([encoder.finish()]);
        loop {
            if let Some(found) = query.take(&gpu().device, ground).unwrap() {
                return found[0].height;
            }
        }
    };
    for (tool, strength, wider) in [
        (Tool::Raise, 25.0, [false, true]),
        (Tool::Raise, -40.0, [true, false]),
        (Tool::Raise, -5.0, [true, false]),
        (Tool::Flatten { height: 160.0 }, 1.0, [false, true]),
        (Tool::Flatten { height: 100.0 }, 1.0, [false, false]),
    ] {
        edited(
            &mut ground,
            &GroundEdit {
                tool,
                x: 20.0,
                z: 30.0,
                radius: Some(6.0),
                strength,
                seed: 1,
            },
        );
        // As the source does: a look at the cursor.
        let height = looked(&mut ground, [20.0, 30.0]);
        let now = ground.range();
        assert!(now[0] <= before[0] && now[1] >= before[1], "it narrowed");
        assert!((now[0]..=now[1]).contains(&height));
        assert_eq!(
            [now[0] < before[0], now[1] > before[1]],
            wider,
            "{tool:?} {strength}"
        );
        holds(&ground);
        before = now;
    }
}

/// Row 18: the same seed gives the same ground, another one another; the mix is the source's formula (its parts by themselves), its height scales it and its mountains act as a power.
#[test]
fn ground_generator_repeats_and_follows_its_formula() {
    let with = |seed: u32, amplitude: f64, mountains: f64| {
        let scene = GroundScene {
            columns: 48,
            rows: 40,
            field: Some(HeightField {
                kind: Kind::Mix { mountains },
                wavelength: 64.0,
                amplitude,
                octaves: 10,
                seed,
                ..Default::default()
            }),
            ..Default::default()
        };
        scene.begin(gpu(), veduta::programs()).unwrap()
    };
    let heights =
        |s: &GroundState| -> Vec<f64> { (0..48 * 40).map(|k| s.ground(k % 48, k / 48)).collect() };
    let first = with(3, 50.0, 2.0);
    assert_eq!(first, with(3, 50.0, 2.0));
    assert_ne!(first, with(4, 50.0, 2.0));
    let (one, two) = (heights(&first), heights(&with(3, 100.0, 2.0)));
    for (a, b) in one.iter().zip(&two) {
        assert!((b - 2.0 * a).abs() < 1e-3, "{a} {b}");
    }
    // H (0.1 n1 (n2 + 1)^M + 0.2 n2 + n3): for M = 1, 2, 3 the differences are in the ratio n2 + 1.
    let [m0, m1, m2] = [1.0, 2.0, 3.0].map(|m| heights(&with(3, 50.0, m)));
    let mut ratios: Vec<f64> = Vec::new();
    for k in 0..one.len() {
        let (a, b) = (m1[k] - m0[k], m2[k] - m1[k]);
        if a.abs() > 0.05 {
            ratios.push(b / a);
        }
    }
    assert!(ratios.len() > 200, "{}", ratios.len());
    // n2 + 1 lies between 0 and 2 and varies slowly.
    assert!(ratios.iter().all(|r| (-0.05..2.05).contains(r)));
}

/// A ground of a height map: every cell the texel's height, beyond the border as the edge says; with a field, a shape and smoothing over it; faults named.
#[test]
fn ground_heights_come_from_maps() {
    let values: Vec<f32> = (0..20 * 18).map(|k| (k * 7 % 31) as f32 / 31.0).collect();
    let map = HeightMap {
        lowest: 100.0,
        highest: 900.0,
        ..HeightMap::of(
            MapTexels::new(20, values.clone()).unwrap(),
            Default::default(),
        )
    };
    let mut scene = GroundScene::named("rain").unwrap();
    scene.take_heights(map.clone()).unwrap();
    assert_eq!([scene.columns, scene.rows], [20, 18]);
    scene.options.spacing = 30.0;
    let begin = scene.begin(gpu(), veduta::programs()).unwrap();
    for (k, value) in values.iter().enumerate() {
        let wanted = 100.0 + 800.0 * f64::from(*value);
        assert!((begin.ground(k % 20, k / 20) - wanted).abs() < 1e-4);
    }
    // Larger than the map: it repeats.
    (scene.columns, scene.rows) = (50, 40);
    (scene.shape, scene.relief) = (Shape::Slope, 49.0);
    let wide = scene.begin(gpu(), veduta::programs()).unwrap();
    let wanted = 100.0 + 800.0 * f64::from(values[3 * 20 + 5]) - 49.0 * 45.5 / 50.0;
    assert!((wide.ground(45, 39) - wanted).abs() < 1e-3);
    let text = |scene: &GroundScene| {
        scene
            .begin(gpu(), veduta::programs())
            .unwrap_err()
            .to_string()
    };
    scene.heights = Some(HeightMap {
        file: "lost.png".to_owned(),
        ..Default::default()
    });
    assert!(text(&scene).contains("lost.png"), "{}", text(&scene));
    let fault = scene.take_heights(HeightMap::default()).unwrap_err();
    assert!(fault.to_string().contains("map.texels"), "{fault}");
    scene.heights = Some(HeightMap {
        origin: [5.0, 0.0],
        ..map
    });
    assert!(text(&scene).contains("heights.origin"), "{}", text(&scene));
}

/// The same from files, beside a scene's.
#[cfg(feature = "height_maps")]
#[test]
fn ground_heights_come_from_files() {
    let folder = std::env::temp_dir().join(format!("veduta-grounds-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let words: Vec<u16> = (0..16 * 16).map(|k| (k * 257 % 65_521) as u16).collect();
    let mut bytes = Vec::new();
    {
        let mut encoder = png::Encoder::new(&mut bytes, 16, 16);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(png::BitDepth::Sixteen);
        let data: Vec<u8> = words.iter().flat_map(|v| v.to_be_bytes()).collect();
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&data).unwrap();
        writer.finish().unwrap();
    }
    std::fs::write(folder.join("h.png"), &bytes).unwrap();
    let metres: Vec<f32> = words.iter().map(|w| f32::from(*w) / 100.0).collect();
    let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (16, 16), }\n";
    let mut npy = b"\x93NUMPY\x01\x00".to_vec();
    npy.extend((header.len() as u16).to_le_bytes());
    npy.extend(header.as_bytes());
    npy.extend(metres.iter().flat_map(|v| v.to_le_bytes()));
    std::fs::write(folder.join("h.npy"), &npy).unwrap();
    exr::prelude::write_rgb_file(folder.join("color.exr"), 16, 16, |_, _| (0.0_f32, 0.0, 0.0))
        .unwrap();
    {
        use exr::prelude::WritableImage as _;
        let channel =
            exr::prelude::AnyChannel::new("Y", exr::prelude::FlatSamples::F32(metres.clone()));
        let channels = exr::prelude::AnyChannels::sort([channel].into_iter().collect());
        exr::prelude::Image::from_channels(exr::prelude::Vec2(16, 16), channels)
            .write()
            .to_file(folder.join("h.exr"))
            .unwrap();
    }
    let read = |heights: &str| {
        let ron = format!("(columns: 16, rows: 16, heights: {heights})");
        std::fs::write(folder.join("ground.ron"), ron).unwrap();
        GroundScene::read(&folder.join("ground.ron"))
    };
    for (heights, scale) in [
        ("(file: \"h.png\", lowest: -10, highest: 645.35)", 100.0),
        ("(file: \"h.npy\", lowest: -10, highest: -9)", 100.0),
        ("(file: \"h.exr\", lowest: -10, highest: -9)", 100.0),
    ] {
        let scene = read(heights).unwrap();
        let begin = scene.begin(gpu(), veduta::programs()).unwrap();
        for (k, w) in words.iter().enumerate() {
            let wanted = f64::from(*w) / scale - 10.0;
            let is = begin.ground(k % 16, k / 16);
            assert!((is - wanted).abs() < 1e-4, "{heights}: {is} {wanted}");
        }
    }
    for (heights, word) in [
        ("(file: \"none.png\")", "none.png"),
        ("(file: \"color.exr\")", "channels"),
        ("(file: \"h.tif\")", ".png, .exr or .npy"),
    ] {
        let fault = read(heights).unwrap_err().to_string();
        assert!(fault.contains(word), "{fault}");
    }
    let fault = GroundScene::read(&folder.join("nothing.ron")).unwrap_err();
    assert!(fault.to_string().contains("nothing.ron"), "{fault}");
}

/// Springs of a scene: set by key, taken away, and faults named.
#[test]
fn ground_springs_come_and_go() {
    let mut scene = GroundScene::named("flood").unwrap();
    assert_eq!(scene.options.springs.len(), 1);
    scene.set("SPRING", "none").unwrap();
    assert!(scene.options.springs.is_empty());
    scene.set("SPRING", "1, 2, 3, 40").unwrap();
    let spring = scene.options.springs[0];
    assert_eq!(
        [spring.x, spring.z, spring.radius, spring.rate],
        [1.0, 2.0, 3.0, 40.0]
    );
    let fault = scene.set("SPRING", "1,2,3").unwrap_err().to_string();
    assert!(fault.contains("x,z,radius,rate"), "{fault}");
    // All that ship can be seen.
    for name in GroundScene::names() {
        let scene = GroundScene::named(name).unwrap();
        scene.camera.unwrap().check().unwrap();
    }
}

/// The least and greatest height are the device's: of digging, laying down, slides and edits, as of the answer that was taken; never narrower than the ground, nor wider than what it had by more than
/// rounding.
#[test]
fn ground_range_is_the_devices() {
    let extremes = |state: &GroundState| {
        (0..state.columns * state.rows)
            .map(|k| state.ground(k % state.columns, k / state.columns))
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], h| {
                [a.min(h), b.max(h)]
            })
    };
    let looked = |ground: &mut Ground| {
        let mut encoder = gpu().device.create_command_encoder(&Default::default());
        let mut query = ground.query_range(&gpu().device, &mut encoder);
        gpu().queue.submit([encoder.finish()]);
        while query.take(&gpu().device, ground).unwrap().is_none() {}
    };
    for altitude in [0.0, 3000.0] {
        // A bowl whose bottom a spring digs, and a pillar that slides.
        let mut begin = flat(75, 50, |x, z| {
            altitude + 0.02 * ((x - 30.0).powi(2) + (z - 25.0).powi(2)).sqrt() + 0.05 * x
        });
        for z in 20..24 {
            for x in 60..64 {
                begin.cell_mut(x, z)[0] += 20.0;
            }
        }
        let options = GroundOptions {
            rain: 1e-3,
            erosion: Some(Erosion {
                capacity: 2.0,
                dig: 0.5,
                lay: 0.5,
                ..Default::default()
            }),
            ..Default::default()
        };
        let mut ground = made(&options, &begin);
        let first = ground.range();
        let mut had = extremes(&begin);
        let check = |ground: &Ground, had: [f64; 2]| {
            let [a, b] = ground.range().map(f64::from);
            let slack = 2e-6 * (altitude + 30.0);
            assert!(
                a <= had[0] && b >= had[1] && a >= had[0] - slack && b <= had[1] + slack,
                "{altitude}: {a} {b}, had {had:?}"
            );
        };
        check(&ground, had);
        for k in 0..60 {
            let before = ground.range();
            steps(&mut ground, 1);
            // Until an answer is taken it is what it was.
            assert_eq!(ground.range(), before);
            looked(&mut ground);
            let now = extremes(&ground.state(gpu()).unwrap());
            had = [had[0].min(now[0]), had[1].max(now[1])];
            check(&ground, had);
            if k == 30 {
                let edit = GroundEdit {
                    tool: Tool::Raise,
                    x: 5.0,
                    z: 5.0,
                    radius: Some(4.0),
                    strength: 30.0,
                    seed: 0,
                };
                edited(&mut ground, &edit);
                // At once as high as it could be, then as high as it is.
                assert!(f64::from(ground.range()[1]) >= had[1] + 29.9);
                looked(&mut ground);
                let now = extremes(&ground.state(gpu()).unwrap());
                had = [had[0].min(now[0]), had[1].max(now[1])];
                check(&ground, had);
                assert!(had[1] < altitude + 36.0, "{had:?}");
            }
        }
        assert!(
            had[0] < f64::from(first[0]) - 1e-3,
            "nothing was dug: {had:?} {first:?}"
        );
        let report = ground.report(gpu()).unwrap();
        let range = ground.range().map(f64::from);
        assert!((report.heights[0] - range[0]).abs() < 1e-3);
        assert!((report.heights[1] - range[1]).abs() < 1e-3);
        // An answer about an earlier state says nothing of the one that is set now.
        let mut encoder = gpu().device.create_command_encoder(&Default::default());
        let mut late = ground.query_range(&gpu().device, &mut encoder);
        gpu().queue.submit([encoder.finish()]);
        ground.set_state(&gpu().queue, &begin).unwrap();
        while late.take(&gpu().device, &mut ground).unwrap().is_none() {}
        assert_eq!(ground.range(), first);
    }
}

/// Shape and smoothing on the device against the processor's: all shapes, boundaries, sizes; over a field too.
#[test]
fn ground_shapes_meet_their_reference() {
    let mut worst = 0.0_f64;
    let shapes = [
        Shape::Even,
        Shape::Hill,
        Shape::Lake,
        Shape::Valley,
        Shape::Ridge,
        Shape::Slope,
        Shape::Bed,
    ];
    for ([columns, rows], smooth) in [
        ([16, 16], 3),
        ([83, 70], 1),
        ([64, 200], 0),
        ([1000, 17], 40),
        ([33, 128], 7),
    ] {
        for boundary in [Boundary::Open, Boundary::Closed, Boundary::Periodic] {
            for shape in shapes {
                let mut scene = GroundScene {
                    columns,
                    rows,
                    field: Some(HeightField {
                        wavelength: 40.0,
                        amplitude: 20.0,
                        octaves: 5,
                        seed: 9,
                        ..Default::default()
                    }),
                    ..Default::default()
                };
                scene.options.boundary = boundary;
                let heights = |scene: &GroundScene| -> Vec<f64> {
                    let state = scene.begin(gpu(), veduta::programs()).unwrap();
                    state
                        .cells
                        .chunks_exact(CHANNELS)
                        .map(|c| f64::from(c[0]))
                        .collect()
                };
                let field = heights(&scene);
                (scene.shape, scene.relief, scene.altitude) = (shape, 100.0, 700.0);
                scene.smooth = smooth;
                let found = heights(&scene);
                let (c, r) = (columns as usize, rows as usize);
                let mut wanted: Vec<f64> = field
                    .iter()
                    .enumerate()
                    .map(|(k, h)| {
                        let x = ((k % c) as f64 + 0.5) / f64::from(columns);
                        let z = ((k / c) as f64 + 0.5) / f64::from(rows);
                        h + 700.0 + 100.0 * shape.share(x, z)
                    })
                    .collect();
                for _ in 0..smooth {
                    wanted = reference::smoothed(&wanted, c, r, boundary == Boundary::Periodic);
                }
                for (k, (is, exact)) in found.iter().zip(&wanted).enumerate() {
                    worst = worst.max((is - exact).abs());
                    assert!(
                        (is - exact).abs() < 3e-4,
                        "{columns}x{rows} {boundary:?} {shape:?} {smooth} cell {k}: {is} {exact}"
                    );
                }
            }
        }
    }
    println!("at most {worst:.1e} m apart");
    // Shares as the reference's parts say.
    for k in 0..=20 {
        let (x, z) = (f64::from(k) / 20.0, f64::from(k * 7 % 21) / 20.0);
        assert!((Shape::Bed.share(x, z) - reference::bed_share(x, z)).abs() < 1e-12);
        assert!((Shape::Ridge.share(x, z) - reference::bump(2.0 * x - 1.0)).abs() < 1e-12);
    }
}

/// Queries of a periodic ground go on at the other edge; of others they end at the edge.
#[test]
fn ground_queries_wrap_where_the_ground_does() {
    let (columns, rows) = (45, 38);
    let turn = std::f64::consts::TAU;
    let begin = flat(columns, rows, |x, z| {
        3.0 * (turn * x / 45.0).sin() + 2.0 * (turn * z / 38.0).cos()
    });
    let ask = |boundary: Boundary, places: &[[f32; 2]]| {
        let options = GroundOptions {
            boundary,
            ..Default::default()
        };
        let mut ground = made(&options, &begin);
        let mut encoder = gpu().device.create_command_encoder(&Default::default());
        let mut query = ground
            .query(&gpu().device, &gpu().queue, &mut encoder, places)
            .unwrap();
        gpu().queue.submit([encoder.finish()]);
        loop {
            if let Some(found) = query.take(&gpu().device, &mut ground).unwrap() {
                return found;
            }
        }
    };
    let mut random = Random(14);
    let inside: Vec<[f32; 2]> = (0..200)
        .map(|_| [random.between(0.0, 45.0), random.between(0.0, 38.0)])
        .collect();
    let shifted: Vec<[f32; 2]> = inside.iter().map(|[x, z]| [x - 90.0, z + 38.0]).collect();
    let (one, two) = (
        ask(Boundary::Periodic, &inside),
        ask(Boundary::Periodic, &shifted),
    );
    for (k, (a, b)) in one.iter().zip(&two).enumerate() {
        assert!(
            (a.height - b.height).abs() < 1e-4,
            "{:?}: {a:?} {b:?}",
            inside[k]
        );
        for n in 0..3 {
            assert!((a.normal[n] - b.normal[n]).abs() < 1e-4, "{a:?} {b:?}");
        }
    }
    // Halfway from the last cell to the first.
    let middle = ask(Boundary::Periodic, &[[44.5, 10.0]])[0].height;
    let wanted = 0.5 * (begin.ground(44, 10) + begin.ground(0, 10));
    assert!(
        (f64::from(middle) - wanted).abs() < 1e-5,
        "{middle} {wanted}"
    );
    for boundary in [Boundary::Open, Boundary::Closed] {
        let [a, b] = [44.5, 1e4].map(|x| ask(boundary, &[[x, 10.0]])[0].height);
        assert_eq!(a, b);
        assert!((f64::from(a) - begin.ground(44, 10)).abs() < 1e-5);
    }
}

/// Every key of `--set` refuses what it may not be, by name.
#[test]
fn ground_keys_refuse_what_is_out_of_range() {
    let bad = [
        ("COLUMNS", "15"),
        ("ROWS", "4097"),
        ("SIZE", "8"),
        ("SHAPE", "Cone"),
        ("RELIEF", "2e4"),
        ("ALTITUDE", "-2e4"),
        ("SMOOTH", "1001"),
        ("SEED", "-1"),
        ("WATER_LEVEL", "3e4"),
        ("WATER_SHARE", "1.5"),
        ("DEPTH", "-1"),
        ("SCHEME", "Wet"),
        ("BOUNDARY", "Far"),
        ("SPACING", "0"),
        ("STEP", "0.6"),
        ("DAMPING", "1.1"),
        ("MOMENTUM", "maybe"),
        ("RAIN", "-1"),
        ("EVAPORATION", "4e6"),
        ("SEEPAGE", "nan"),
        ("MEAN_WEIGHT", "0"),
        ("GRAVITY", "0"),
        ("COURANT", "0.6"),
        ("FRICTION", "2"),
        ("LONGEST_STEP", "0"),
        ("EROSION", "perhaps"),
        ("CAPACITY", "11"),
        ("DEEPEST", "-1"),
        ("DIG", "2"),
        ("LAY", "-0.1"),
        ("SLOPE_LIMIT", "-1"),
        ("SLIDE", "0.3"),
        ("HARDNESS", "2"),
        ("HARD_WAVELENGTH", "5000"),
        ("LAYER", "-1"),
        ("SPRING", "1,2,3,-4"),
    ];
    assert_eq!(bad.map(|(key, _)| key), GroundScene::keys());
    for (key, value) in bad {
        let mut scene = GroundScene::named("erosion").unwrap();
        let fault = scene
            .set(key, value)
            .and_then(|()| scene.check())
            .expect_err(key)
            .to_string();
        // By the name of the key or of its field.
        let named = match key {
            "SIZE" => "columns".to_owned(),
            "SPRING" => "springs.rate".to_owned(),
            _ => key.to_lowercase(),
        };
        assert!(fault.to_lowercase().contains(&named), "{key}: {fault}");
    }
    // A seed of nothing.
    let mut scene = GroundScene::named("dam_break").unwrap();
    let fault = scene.set("SEED", "3").unwrap_err().to_string();
    assert!(fault.contains("SEED") && fault.contains("field"), "{fault}");
    let mut scene = GroundScene::named("rain").unwrap();
    scene.set("SEED", "3").unwrap();
    assert_eq!(scene.field.unwrap().seed, 3);
}
