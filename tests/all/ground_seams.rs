//! The living ground at its seams: lanes beyond the last column, reference heights, states of the other scheme, cursors over the edge, walls, answers of other grounds.

use veduta::ground::{
    Boundary, CHANNELS, Ground, GroundEdit, GroundOptions, GroundPoint, GroundState, Scheme,
    Spring, Tool,
};

use crate::common::gpu;
use crate::ground::{edited, flat, hilly, made, run, steps};

fn asked(ground: &mut Ground, places: &[[f32; 2]]) -> Vec<GroundPoint> {
    let gpu = gpu();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut query = ground
        .query(&gpu.device, &gpu.queue, &mut encoder, places)
        .unwrap();
    gpu.queue.submit([encoder.finish()]);
    loop {
        if let Some(found) = query.take(&gpu.device, ground).unwrap() {
            return found;
        }
    }
}

fn everywhere(tool: Tool, strength: f32) -> GroundEdit {
    GroundEdit {
        tool,
        x: 0.0,
        z: 0.0,
        radius: None,
        strength,
        seed: 1,
    }
}

/// A stream around a periodic ground goes on as it is: the lanes beyond the last column, where the columns are no multiple of 4, gather no water that waves could be fast in or that keeps tiles awake.
#[test]
fn ground_lanes_beyond_the_last_column_stay_dry() {
    for columns in [33, 34, 35, 36] {
        for direction in [4, 6] {
            let mut begin = flat(columns, 16, |_, _| 0.0);
            for c in begin.cells.chunks_exact_mut(CHANNELS) {
                (c[1], c[3], c[direction]) = (1.0, 1.0, 1.0);
            }
            let options = GroundOptions {
                scheme: Scheme::Physical,
                boundary: Boundary::Periodic,
                step: 0.0,
                ..Default::default()
            };
            let (end, report) = run(&options, &begin, 300);
            let exact = f64::from(options.courant) / (1.0 + f64::from(options.gravity).sqrt());
            assert!(
                (report.last_step / exact - 1.0).abs() < 1e-4,
                "{columns}, channel {direction}: {} for {exact}",
                report.last_step
            );
            assert!((end.water(columns - 1, 3) - 1.0).abs() < 1e-4);
            // The source's stream ends, and then all sleep at once.
            let options = GroundOptions {
                boundary: Boundary::Periodic,
                damping: 0.9,
                ..Default::default()
            };
            let (_, report) = run(&options, &begin, 300);
            assert_eq!(report.active_tiles, 0, "{columns}, channel {direction}");
        }
    }
}

/// A state goes on as the ground that it is of, though the least height has crossed the half of a metre meanwhile.
#[test]
fn ground_goes_on_where_the_least_height_crossed_half_a_metre() {
    for scheme in [Scheme::Source, Scheme::Physical] {
        let mut begin = hilly(45, 38, 1200.0, 3);
        for c in begin.cells.chunks_exact_mut(CHANNELS) {
            c[1] = 0.5;
        }
        let options = GroundOptions {
            scheme,
            step: 0.1,
            boundary: Boundary::Closed,
            ..Default::default()
        };
        let mut whole = made(&options, &begin);
        edited(&mut whole, &everywhere(Tool::Raise, -37.31));
        edited(
            &mut whole,
            &everywhere(Tool::Noise { wavelength: 5.0 }, 0.7),
        );
        steps(&mut whole, 20);
        let mut rest = made(&options, &whole.state(gpu()).unwrap());
        for ground in [&mut whole, &mut rest] {
            steps(ground, 40);
        }
        let [a, b] = [&whole, &rest].map(|ground| ground.state(gpu()).unwrap());
        let other = (a.cells.iter().zip(&b.cells)).filter(|(a, b)| a.to_bits() != b.to_bits());
        assert_eq!(other.count(), 0, "{scheme:?}");
    }
}

/// New options are refused as those of a new ground are.
#[test]
fn ground_refuses_springs_beside_it_whenever_they_come() {
    let mut options = GroundOptions::default();
    let mut ground = made(&options, &flat(20, 16, |_, _| 0.0));
    options.springs = vec![Spring {
        x: 30.0,
        z: 4.0,
        radius: 2.0,
        rate: 1.0,
    }];
    let fault = ground.set_options(&gpu().queue, &options).unwrap_err();
    assert!(fault.to_string().contains("springs[0]"), "{fault}");
    assert!(ground.options().springs.is_empty());
    options.springs[0].x = 12.0;
    ground.set_options(&gpu().queue, &options).unwrap();
}

/// Discharges of shallow water follow from the speeds of a state of the source's scheme, as it is and through its numbers.
#[test]
fn ground_of_the_source_goes_on_as_shallow_water() {
    let begin = flat(24, 20, |_, _| 0.0);
    let mut ground = made(&GroundOptions::default(), &begin);
    let pour = GroundEdit {
        tool: Tool::Water,
        x: 9.0,
        z: 8.0,
        radius: Some(6.0),
        strength: 2.0,
        seed: 0,
    };
    edited(&mut ground, &pour);
    steps(&mut ground, 12);
    let source = ground.state(gpu()).unwrap();
    let read = GroundState::from_channels(24, 20, CHANNELS, &source.cells).unwrap();
    let options = GroundOptions {
        scheme: Scheme::Physical,
        step: 0.0,
        boundary: Boundary::Closed,
        ..Default::default()
    };
    let mut few = Vec::new();
    for c in source.cells.chunks_exact(CHANNELS) {
        few.extend_from_slice(&c[..12]);
    }
    let without = GroundState::from_channels(24, 20, 12, &few).unwrap();
    let wanted = made(&options, &without).state(gpu()).unwrap();
    let fastest = wanted
        .cells
        .chunks_exact(CHANNELS)
        .fold(0.0_f32, |a, c| a.max(c[12].abs()));
    assert!(fastest > 1e-2, "{fastest}");
    for state in [&source, &read] {
        let shallow = made(&options, state).state(gpu()).unwrap();
        assert_eq!(shallow.cells, wanted.cells);
        // A face's discharge is its speed times the depth where the water comes from.
        for z in 0..20 {
            for x in 0..23 {
                let (c, next) = (shallow.cell(x, z), shallow.cell(x + 1, z));
                let found = c[4] * c[1] - next[6] * next[1];
                assert!((c[12] - found).abs() < 1e-5, "{x} {z}: {} {found}", c[12]);
            }
        }
    }
}

/// A cursor reaches over the edges of a periodic ground, and only of such.
#[test]
fn ground_cursors_wrap_where_the_ground_does() {
    let (columns, rows) = (33_usize, 34_usize);
    for boundary in [Boundary::Periodic, Boundary::Closed, Boundary::Open] {
        for (x, z) in [(1.0, 32.5), (31.0, 2.0), (-2.0, 35.0), (70.0, 17.0)] {
            let options = GroundOptions {
                boundary,
                ..Default::default()
            };
            let mut ground = made(&options, &flat(columns, rows, |_, _| 0.0));
            let edit = GroundEdit {
                tool: Tool::Raise,
                x,
                z,
                radius: Some(7.0),
                strength: 2.0,
                seed: 0,
            };
            edited(&mut ground, &edit);
            let end = ground.state(gpu()).unwrap();
            let way = |here: usize, there: f32, size: usize| {
                let d = here as f64 - f64::from(there);
                if boundary == Boundary::Periodic {
                    d - size as f64 * (d / size as f64).round()
                } else {
                    d
                }
            };
            for row in 0..rows {
                for column in 0..columns {
                    let d = [way(column, x, columns), way(row, z, rows)];
                    let fade = (1.0 - (d[0] * d[0] + d[1] * d[1]) / 49.0).max(0.0);
                    let lift = end.ground(column, row);
                    assert!(
                        (lift - 2.0 * fade * fade).abs() < 1e-5,
                        "{boundary:?}, cursor {x} {z}: {lift} at {column} {row}, not {}",
                        2.0 * fade * fade
                    );
                }
            }
        }
    }
}

/// Beside a wall the velocity of shallow water is the mean of the wall's, none, and that of the other face, at the first column and row as at the last.
#[test]
fn ground_queries_know_walls() {
    for boundary in [Boundary::Closed, Boundary::Open, Boundary::Periodic] {
        let mut begin = hilly(22, 19, 0.0, 6);
        for c in begin.cells.chunks_exact_mut(CHANNELS) {
            c[1] = 3.0;
        }
        let options = GroundOptions {
            scheme: Scheme::Physical,
            boundary,
            step: 0.0,
            ..Default::default()
        };
        let mut ground = made(&options, &begin);
        steps(&mut ground, 10);
        let state = ground.state(gpu()).unwrap();
        let places: Vec<[f32; 2]> = (0..22 * 19)
            .map(|k| [(k % 22) as f32, (k / 22) as f32])
            .collect();
        let wraps = boundary == Boundary::Periodic;
        for (place, found) in places.iter().zip(asked(&mut ground, &places)) {
            let (x, z) = (place[0] as usize, place[1] as usize);
            let c = state.cell(x, z);
            // What leaves to +, and what comes over the same face from beyond it.
            let face = |x: usize, z: usize, along: usize| {
                let next = if along == 0 {
                    (x + 1 < 22 || wraps).then_some(((x + 1) % 22, z))
                } else {
                    (z + 1 < 19 || wraps).then_some((x, (z + 1) % 19))
                };
                let back = next.map_or(0.0, |(x, z)| state.cell(x, z)[6 + along]);
                state.cell(x, z)[4 + along] - back
            };
            let before = |along: usize| match (along, x, z) {
                (0, 0, _) if wraps => face(21, z, 0),
                (1, _, 0) if wraps => face(x, 18, 1),
                (0, 0, _) | (1, _, 0) => 0.0,
                (0, ..) => face(x - 1, z, 0),
                _ => face(x, z - 1, 1),
            };
            for (along, velocity) in found.velocity.iter().enumerate() {
                let wanted = 0.5 * (face(x, z, along) + before(along));
                assert!(
                    (velocity - wanted).abs() < 1e-5,
                    "{boundary:?} {x} {z}: {:?}, not {wanted} of {c:?}",
                    found.velocity
                );
            }
        }
    }
}

/// An answer is for the ground that was asked.
#[test]
fn ground_answers_of_another_ground_are_refused() {
    let gpu = gpu();
    let options = GroundOptions::default();
    let mut low = made(&options, &flat(16, 16, |_, _| 0.0));
    let mut high = made(&options, &flat(16, 16, |_, _| 500.0));
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut query = high.query_range(&gpu.device, &mut encoder);
    gpu.queue.submit([encoder.finish()]);
    let before = low.range();
    for _ in 0..1000 {
        match query.take(&gpu.device, &mut low) {
            Err(fault) => assert!(fault.to_string().contains("ground.query"), "{fault}"),
            Ok(found) => assert!(found.is_none(), "another ground's answer was taken"),
        }
    }
    assert_eq!(low.range(), before);
    // It is still there for its own.
    while query.take(&gpu.device, &mut high).unwrap().is_none() {}
}

/// The mean arrives at its slowest too, and what is still sleeps.
#[test]
fn ground_means_arrive_at_every_weight() {
    for scheme in [Scheme::Source, Scheme::Physical] {
        let mut begin = flat(18, 16, |_, _| 0.0);
        for c in begin.cells.chunks_exact_mut(CHANNELS) {
            (c[1], c[3]) = (1.5, 1.4998);
        }
        let options = GroundOptions {
            scheme,
            boundary: Boundary::Closed,
            mean_weight: 1e-3,
            ..Default::default()
        };
        let (end, report) = run(&options, &begin, 3000);
        assert_eq!(report.active_tiles, 0, "{scheme:?}: {:?}", end.cell(3, 3));
        assert_eq!(end.cell(3, 3)[3], 1.5);
    }
}

/// A share is a share.
#[test]
fn ground_edits_refuse_shares_beyond_one() {
    for tool in [Tool::Smooth, Tool::Flatten { height: 3.0 }] {
        for strength in [-0.1, 1.1, f32::NAN] {
            let fault = everywhere(tool, strength).check().unwrap_err().to_string();
            assert!(fault.contains("edit.strength"), "{fault}");
        }
        everywhere(tool, 1.0).check().unwrap();
    }
    everywhere(Tool::Raise, -3.0).check().unwrap();
}
