//! The picture of the living ground: the displayed surface of its water, normals, triangles, depth and light.

use std::collections::HashMap;

use veduta::glam::{DVec3, Vec3};
use veduta::ground::{
    Boundary, CHANNELS, Ground, GroundCamera, GroundLook, GroundOptions, GroundPicture,
    GroundPictureOptions, GroundState, Scheme, Triangulation,
};
use veduta::reference::ground::{counted_level, displayed_level, fast_normal};
use veduta::terrain::TerrainLights;
use veduta::{Targets, View, WorldPos};

use crate::common::{Random, gpu};

const LIGHTS: TerrainLights = TerrainLights {
    sun: Vec3::new(1.0, 0.9, 0.8),
    sky: Vec3::new(0.1, 0.15, 0.25),
    bounce: Vec3::ZERO,
};

const TRIANGULATIONS: [Triangulation; 3] = [
    Triangulation::Fixed,
    Triangulation::FourWay,
    Triangulation::Random,
];

fn targets() -> Targets {
    Targets {
        color_format: wgpu::TextureFormat::Rgba32Float,
        depth_format: Some(wgpu::TextureFormat::Depth32Float),
        ..Default::default()
    }
}

/// A state of heights and depths.
fn state_of(size: [usize; 2], cell: impl Fn(usize, usize) -> [f32; 2]) -> GroundState {
    let [columns, rows] = size;
    let mut state = GroundState::from_heights(columns, rows, &vec![0.0; columns * rows]).unwrap();
    for z in 0..rows {
        for x in 0..columns {
            let [height, depth] = cell(x, z);
            let c = state.cell_mut(x, z);
            (c[0], c[1], c[3]) = (height, depth, depth);
        }
    }
    state
}

fn ground_of(options: &GroundOptions, state: &GroundState) -> Ground {
    let gpu = gpu();
    Ground::new(&gpu.device, &gpu.queue, veduta::programs(), options, state).unwrap()
}

fn picture_of(ground: &Ground, options: &GroundPictureOptions, targets: &Targets) -> GroundPicture {
    GroundPicture::new(&gpu().device, veduta::programs(), targets, ground, options).unwrap()
}

/// What the device shows of every cell: height and displayed level over the reference level, and both normals.
struct Shown {
    columns: usize,
    height: Vec<f64>,
    level: Vec<f64>,
    normals: Vec<[[f64; 2]; 2]>,
}

fn shown(state: &GroundState, options: &GroundOptions) -> Shown {
    let ground = ground_of(options, state);
    let mut picture = picture_of(&ground, &GroundPictureOptions::default(), &targets());
    let mut encoder = gpu().device.create_command_encoder(&Default::default());
    let work = picture
        .prepare(
            &gpu().queue,
            &mut encoder,
            &ground,
            &View::default(),
            &LIGHTS,
        )
        .unwrap();
    assert_eq!(work.dispatches, 2);
    gpu().queue.submit([encoder.finish()]);
    let float = |b: &[u8], k: usize| {
        f64::from(f32::from_le_bytes([
            b[4 * k],
            b[4 * k + 1],
            b[4 * k + 2],
            b[4 * k + 3],
        ]))
    };
    let surface = gpu().read_texture(picture.surface()).unwrap();
    let column = |k: usize| surface.chunks_exact(16).map(|c| float(c, k)).collect();
    let snorm =
        |b: &[u8], k: usize| f64::from(i16::from_le_bytes([b[2 * k], b[2 * k + 1]])) / 32767.0;
    let normals = gpu().read_texture(picture.normals()).unwrap();
    Shown {
        columns: state.columns,
        height: column(0),
        level: column(1),
        normals: normals
            .chunks_exact(8)
            .map(|c| [[snorm(c, 0), snorm(c, 1)], [snorm(c, 2), snorm(c, 3)]])
            .collect(),
    }
}

impl Shown {
    /// How far the displayed water is above the ground.
    fn over(&self, x: usize, z: usize) -> f64 {
        let k = z * self.columns + x;
        self.level[k] - self.height[k]
    }
}

/// The eight neighbours of a cell, those at the sides first; beyond the edges those of the edge.
fn around(size: [usize; 2], x: usize, z: usize) -> [usize; 8] {
    let [columns, rows] = size;
    let at = |i: isize, j: isize| {
        let x = (x as isize + i).clamp(0, columns as isize - 1) as usize;
        let z = (z as isize + j).clamp(0, rows as isize - 1) as usize;
        z * columns + x
    };
    [
        at(-1, 0),
        at(1, 0),
        at(0, -1),
        at(0, 1),
        at(-1, -1),
        at(1, -1),
        at(-1, 1),
        at(1, 1),
    ]
}

/// Displayed levels in f64.
fn displayed(size: [usize; 2], height: &[f64], depth: &[f64]) -> Vec<f64> {
    let level: Vec<f64> = height.iter().zip(depth).map(|(t, w)| t + w).collect();
    (0..height.len())
        .map(|k| {
            let n = around(size, k % size[0], k / size[0]);
            let four = |of: &[f64], from: usize| std::array::from_fn(|i| of[n[from + i]]);
            displayed_level(
                level[k],
                depth[k],
                four(&level, 0),
                four(&level, 4),
                four(depth, 0),
                four(depth, 4),
                f64::from(0.1_f32),
                2.0,
            )
        })
        .collect()
}

/// Row 12 and 13: the device shows what the algorithm says; normals are central differences with the water-edge rule.
#[test]
fn ground_display_and_normals_meet_their_references() {
    for (size, scheme, spacing) in [
        ([37, 50], Scheme::Source, 1.0_f32),
        ([64, 16], Scheme::Physical, 2.5),
    ] {
        let mut random = Random(size[0] as u64);
        let cells: Vec<[f32; 2]> = (0..size[0] * size[1])
            .map(|_| {
                // Whole parts of 1024, so that sums are exact and comparisons are those of f64.
                let parts = |most: f32, r: &mut Random| (r.unit() * most).floor() / 1024.0;
                let depth = match random.bits() % 4 {
                    0 => 0.0,
                    1 => parts(102.0, &mut random),
                    2 => parts(12.0, &mut random),
                    _ => parts(3000.0, &mut random),
                };
                [parts(4096.0, &mut random), depth]
            })
            .collect();
        let state = state_of(size, |x, z| cells[z * size[0] + x]);
        let options = GroundOptions {
            scheme,
            spacing,
            ..Default::default()
        };
        let found = shown(&state, &options);
        let height: Vec<f64> = cells.iter().map(|c| f64::from(c[0])).collect();
        let depth: Vec<f64> = cells.iter().map(|c| f64::from(c[1])).collect();
        let level = displayed(size, &height, &depth);
        let beside = |x: usize, z: usize, step: [isize; 2]| {
            // Beyond the edge slopes go on.
            let inside = |v: usize, s: isize, n: usize| {
                let t = v as isize + s;
                (0..n as isize).contains(&t).then_some(t as usize)
            };
            let there =
                |s: [isize; 2]| Some((inside(x, s[0], size[0])?, inside(z, s[1], size[1])?));
            let k = z * size[0] + x;
            let of = |(x, z): (usize, usize)| {
                let n = z * size[0] + x;
                [height[n], counted_level(level[k], level[n], height[n])]
            };
            match there(step) {
                Some(n) => of(n),
                None => {
                    let back = of(there([-step[0], -step[1]]).unwrap());
                    [2.0 * height[k] - back[0], 2.0 * level[k] - back[1]]
                }
            }
        };
        let (mut worst, mut turned) = (0.0_f64, 0.0_f64);
        for k in 0..level.len() {
            let (x, z) = (k % size[0], k / size[0]);
            worst = worst.max((found.level[k] - level[k]).abs());
            assert!((found.height[k] - height[k]).abs() < 1e-6);
            let [l, r, d, u] = [[-1, 0], [1, 0], [0, -1], [0, 1]].map(|step| beside(x, z, step));
            for layer in 0..2 {
                let n = fast_normal(l[layer], r[layer], d[layer], u[layer], f64::from(spacing));
                let is = found.normals[k][layer];
                turned = turned.max((is[0] - n[0]).abs()).max((is[1] - n[2]).abs());
            }
        }
        println!("{size:?}: levels within {worst:.1e} m, normals within {turned:.1e}");
        assert!(worst < 2e-6, "{worst}");
        // Half a step of 16 bits, and what f32 leaves of the levels.
        assert!(turned < 2.5e-5, "{turned}");
    }
}

/// Row 12: a lake in a steep bowl, whose shore is not along the grid.
#[test]
fn ground_shores_have_no_teeth() {
    let size = [64, 60];
    let surface = 5.0_f32;
    let height = |x: usize, z: usize| {
        let (a, b) = (x as f32 - 30.3, z as f32 - 28.6);
        // Slopes up to about 1, and a spit of land.
        let bowl = 0.015 * (a * a + 0.7 * b * b + 0.5 * a * b);
        bowl + 6.0 * (-((a - 9.0).powi(2) + (b + 4.0).powi(2)) / 30.0).exp()
    };
    let state = state_of(size, |x, z| {
        let h = height(x, z);
        [h, (surface - h).max(0.0)]
    });
    let found = shown(&state, &GroundOptions::default());
    // Every triangle that shows water is flat, at the level of the lake: then its border is where that plane cuts the ground.
    let (mut shown_water, mut worst, mut plain) = (0, 0.0_f64, 0.0_f64);
    for z in 0..size[1] - 1 {
        for x in 0..size[0] - 1 {
            for corners in [
                [(x, z), (x, z + 1), (x + 1, z + 1)],
                [(x, z), (x + 1, z + 1), (x + 1, z)],
            ] {
                if corners.iter().all(|(x, z)| found.over(*x, *z) <= 0.0) {
                    continue;
                }
                shown_water += 1;
                for (x, z) in corners {
                    let k = z * size[0] + x;
                    worst = worst.max((found.level[k] - f64::from(surface)).abs());
                    let as_it_is = state.ground(x, z) + state.water(x, z);
                    plain = plain.max((as_it_is - f64::from(surface)).abs());
                }
            }
        }
    }
    println!(
        "{shown_water} triangles of water: {worst:.1e} m off, without the algorithm {plain:.2} m"
    );
    assert!(shown_water > 1000);
    assert!(worst < 1e-5, "{worst}");
    assert!(plain > 0.5, "no steep shore: {plain}");
    // Dry ground away from the shore: 2 m above the surface.
    for z in 0..size[1] {
        for x in 0..size[0] {
            let n = around(size, x, z);
            let dry = state.water(x, z) == 0.0
                && n.iter()
                    .all(|k| state.water(k % size[0], k / size[0]) == 0.0);
            if dry {
                assert!((found.over(x, z) + 2.0).abs() < 1e-5, "{x} {z}");
            }
        }
    }
}

/// Row 12: puddles stay, films and dry plains show no water.
#[test]
fn ground_puddles_stay_and_dry_plains_do_not_fight() {
    let size = [32, 32];
    let spot = |x: usize, z: usize| x.abs_diff(16) <= 1 && z.abs_diff(16) <= 1;
    for (bottom, depth, stays) in [
        (-0.05_f32, 0.05_f32, true),
        (-0.02, 0.02, true),
        (0.0, 0.0, false),
    ] {
        let state = state_of(size, |x, z| {
            if spot(x, z) {
                [bottom, depth]
            } else {
                [0.0, 0.0]
            }
        });
        let found = shown(&state, &GroundOptions::default());
        if stays {
            assert!(
                (found.over(16, 16) - f64::from(depth)).abs() < 1e-6,
                "a puddle {depth} deep: {}",
                found.over(16, 16)
            );
        }
        assert!(
            (found.over(4, 4) + 2.0).abs() < 1e-6,
            "{}",
            found.over(4, 4)
        );
        // The surface changes with depth, without a jump: less than a hundred times as fast.
        if depth == 0.0 {
            assert!((found.over(16, 16) + 2.0).abs() < 1e-6);
        }
    }
    // A film of rain on a plain: the higher it stands the higher it is shown, from 2 m below on, without jumps.
    let mut before = -2.0_f64;
    for k in 0..=110 {
        let depth = k as f32 * 1e-3;
        let state = state_of(size, |_, _| [0.0, depth]);
        let over = shown(&state, &GroundOptions::default()).over(9, 9);
        assert!(
            over >= before - 1e-6 && over - before < 0.5,
            "{depth}: {before} {over}"
        );
        before = over;
        if depth >= 0.1 {
            assert!((over - f64::from(depth)).abs() < 1e-6);
        }
    }
}

/// Vertices and triangles as the program makes them of a ground's size.
fn mesh(size: [usize; 2], triangulation: Triangulation) -> Vec<[[u32; 2]; 3]> {
    let end = size.map(|n| n - 1);
    let blocks = end.map(|n| n.div_ceil(64));
    let mut all = Vec::new();
    for block in 0..blocks[0] * blocks[1] {
        let start = [64 * (block % blocks[0]), 64 * (block / blocks[0])];
        // Twice the coordinates, so that middles are whole.
        let place = |index: u16| -> [u32; 2] {
            let k = usize::from(index);
            let (inner, middle) = if k < 4225 {
                ([k % 65, k / 65], false)
            } else {
                ([(k - 4225) % 64, (k - 4225) / 64], true)
            };
            std::array::from_fn(|a| {
                let first = (start[a] + inner[a]).min(end[a]);
                let last = if middle {
                    (first + 1).min(end[a])
                } else {
                    first
                };
                (first + last) as u32
            })
        };
        all.extend(triangulation.triangles().into_iter().map(|t| t.map(place)));
    }
    all
}

/// Row 28: every edge inside has two triangles, which pass it in opposite directions; the area is that of the ground.
#[test]
fn ground_triangles_are_watertight() {
    for size in [[16, 16], [65, 65], [66, 40], [150, 131]] {
        for triangulation in TRIANGULATIONS {
            let mut edges: HashMap<[[u32; 2]; 2], i32> = HashMap::new();
            let mut area = 0;
            let mut count = 0;
            for [a, b, c] in mesh(size, triangulation) {
                let side = |p: [u32; 2]| [0, 1].map(|k| i64::from(p[k]) - i64::from(a[k]));
                let ([bx, bz], [cx, cz]) = (side(b), side(c));
                let twice = bz * cx - bx * cz;
                if twice == 0 {
                    // Beyond the last cell: nothing may be left of it but a point or a line that is not drawn.
                    continue;
                }
                assert!(twice > 0, "{triangulation:?} turns the other way");
                area += twice;
                count += 1;
                for (p, q) in [(a, b), (b, c), (c, a)] {
                    *edges.entry([p, q]).or_default() += 1;
                }
            }
            let squares = ((size[0] - 1) * (size[1] - 1)) as i64;
            let each = if triangulation == Triangulation::FourWay {
                4
            } else {
                2
            };
            assert_eq!(count, each * squares, "{size:?} {triangulation:?}");
            // In halves of a cell.
            assert_eq!(area, 8 * squares, "{size:?} {triangulation:?}");
            let end = size.map(|n| 2 * (n as u32 - 1));
            for ([p, q], n) in &edges {
                assert_eq!(*n, 1, "{triangulation:?} {p:?} {q:?}");
                let border = (0..2).any(|a| p[a] == q[a] && (p[a] == 0 || p[a] == end[a]));
                let other = edges.contains_key(&[*q, *p]);
                assert!(other != border, "{size:?} {triangulation:?}: {p:?} {q:?}");
            }
        }
    }
    // By chance: both diagonals are about as frequent, and not the same in rows.
    let random = Triangulation::Random.triangles();
    let turned: Vec<bool> = random.chunks_exact(2).map(|t| t[0][2] != t[1][1]).collect();
    let share = turned.iter().filter(|t| **t).count() as f64 / turned.len() as f64;
    assert!((share - 0.5).abs() < 0.05, "{share}");
    for shift in [1, 2, 63, 64, 65] {
        let same = turned
            .windows(shift + 1)
            .filter(|w| w[0] == w[shift])
            .count();
        let same = same as f64 / (turned.len() - shift) as f64;
        assert!((same - 0.5).abs() < 0.06, "{shift}: {same}");
    }
}

/// Draws a ground over magenta: colours and depths by rows from the top.
fn drawn(
    ground: &Ground,
    options: &GroundPictureOptions,
    view: &View,
    targets: &Targets,
    [width, height]: [u32; 2],
) -> (Vec<[f32; 4]>, Vec<f32>) {
    let gpu = gpu();
    let mut picture = picture_of(ground, options, targets);
    let depth = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Depth32Float,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let color = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: depth.size(),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: targets.color_format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let [seen, far] = [&color, &depth].map(|t| t.create_view(&Default::default()));
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let _ = picture
        .prepare(&gpu.queue, &mut encoder, ground, view, &LIGHTS)
        .unwrap();
    let clear = match targets.depth {
        veduta::landscape::Depth::Normal => 1.0,
        _ => 0.0,
    };
    {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &seen,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color {
                        r: 1.0,
                        g: 0.0,
                        b: 1.0,
                        a: 1.0,
                    }),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &far,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(clear),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        assert_eq!(picture.draw_opaque(&mut pass).draws, 2);
    }
    // Still: nothing is found anew.
    let again = picture
        .prepare(&gpu.queue, &mut encoder, ground, view, &LIGHTS)
        .unwrap();
    assert_eq!(again, veduta::Work::default());
    gpu.queue.submit([encoder.finish()]);
    let numbers = |t| -> Vec<f32> {
        gpu.read_texture(t)
            .unwrap()
            .as_chunks::<4>()
            .0
            .iter()
            .map(|b| f32::from_le_bytes(*b))
            .collect()
    };
    let colors = numbers(&color).as_chunks::<4>().0.to_vec();
    (colors, numbers(&depth))
}

const MAGENTA: [f32; 4] = [1.0, 0.0, 1.0, 1.0];

fn wavy(size: [usize; 2]) -> GroundState {
    state_of(size, |x, z| {
        let (a, b) = (x as f32 * 0.31, z as f32 * 0.23);
        [3.0 * (a.sin() * b.cos()) + 2.0 * (0.7 * b).sin(), 0.0]
    })
}

/// Row 28: what is drawn has no holes and lies where the ground does, for both depth conventions, far from the origin as near it.
#[test]
fn ground_mesh_lies_where_the_ground_does() {
    let size = [150, 131];
    let state = wavy(size);
    let options = GroundOptions {
        spacing: 2.0,
        ..Default::default()
    };
    let ground = ground_of(&options, &state);
    let pixels = [96, 64];
    let top = GroundCamera {
        eye: [150.0, 260.0, 131.0],
        target: [149.0, 0.0, 129.0],
        field_of_view: 70.0,
        sun_height: 40.0,
        sun_azimuth: 30.0,
    };
    let slanted = GroundCamera {
        eye: [40.0, 30.0, 270.0],
        target: [150.0, 0.0, 120.0],
        ..top
    };
    let far_corner = WorldPos::from_metres(DVec3::new(3.2e9, 40.0, -7.7e8));
    for triangulation in TRIANGULATIONS {
        for (camera, corner, convention) in [
            (
                top,
                WorldPos::default(),
                veduta::landscape::Depth::ReversedInfinite,
            ),
            (
                slanted,
                WorldPos::default(),
                veduta::landscape::Depth::Normal,
            ),
            (
                slanted,
                far_corner,
                veduta::landscape::Depth::ReversedInfinite,
            ),
        ] {
            let aspect = f64::from(pixels[0]) / f64::from(pixels[1]);
            let mut view = camera.view(corner, aspect).unwrap();
            if convention == veduta::landscape::Depth::Normal {
                view.projection = veduta::glam::camera::rh::proj::directx::perspective(
                    camera.field_of_view.to_radians() as f32,
                    aspect as f32,
                    1.0,
                    2000.0,
                );
            }
            let targets = Targets {
                depth: convention,
                ..targets()
            };
            let how = GroundPictureOptions {
                triangulation,
                corner,
                ..Default::default()
            };
            let (colors, depths) = drawn(&ground, &how, &view, &targets, pixels);
            let [middle, right, up] = view.rays().unwrap().map(|v| v.as_dvec3());
            let forward = view
                .world_from_view
                .transform_vector3(Vec3::NEG_Z)
                .as_dvec3();
            let (scale, offset) = (
                f64::from(view.projection.z_axis.z),
                f64::from(view.projection.w_axis.z),
            );
            let eye = view.eye.relative_to(corner);
            let (mut hits, mut holes) = (0, 0);
            for (k, (color, depth)) in colors.iter().zip(&depths).enumerate() {
                let at = |k: usize, n: u32| 2.0 * (k as f64 + 0.5) / f64::from(n) - 1.0;
                let ray = middle + right * at(k % 96, pixels[0]) - up * at(k / 96, pixels[1]);
                let place = |linear: f64| eye + ray * (linear / ray.dot(forward));
                let inside = |p: DVec3| p.x > 0.0 && p.z > 0.0 && p.x < 298.0 && p.z < 260.0;
                if *color == MAGENTA {
                    // A hole only if the ray passes over the ground at all heights that it has.
                    let [a, b] = [-5.1, 5.1].map(|y| place((y - eye.y) / ray.y * ray.dot(forward)));
                    holes += i32::from(ray.y < 0.0 && inside(a) && inside(b));
                    continue;
                }
                hits += 1;
                let p = place(offset / (f64::from(*depth) + scale));
                assert!(
                    inside(p + DVec3::new(1e-2, 0.0, 1e-2))
                        || inside(p - DVec3::new(1e-2, 0.0, 1e-2)),
                    "{p}"
                );
                // The patch's triangles differ from its bilinear form by a quarter of its twist.
                let (x, z) = (
                    (p.x / 2.0).clamp(0.0, 148.999),
                    (p.z / 2.0).clamp(0.0, 129.999),
                );
                let (i, j) = (x as usize, z as usize);
                let (f, g) = (x.fract(), z.fract());
                let h = |a: usize, b: usize| state.ground(i + a, j + b);
                let low = h(0, 0) + f * (h(1, 0) - h(0, 0));
                let high = h(0, 1) + f * (h(1, 1) - h(0, 1));
                let twist = (h(0, 0) + h(1, 1) - h(0, 1) - h(1, 0)).abs();
                let off = p.y - (low + g * (high - low));
                assert!(
                    off.abs() < 0.26 * twist + 5e-3,
                    "{triangulation:?} {convention:?} at {p}: {off}, twist {twist}"
                );
            }
            assert!(hits > 2000, "{hits}");
            assert_eq!(holes, 0, "{triangulation:?}");
        }
    }
}

/// Light: slopes towards the sun are brighter; deeper water is darker; ground that is dry looks the same whether a sheet of water lies below it or not; films do not show.
#[test]
fn ground_picture_shows_light_depth_and_mud() {
    let size = [64, 64];
    let pixels = [64, 48];
    let camera = GroundCamera {
        eye: [31.5, 60.0, 70.0],
        target: [31.5, 0.0, 31.5],
        field_of_view: 40.0,
        sun_height: 30.0,
        sun_azimuth: 90.0,
    };
    let view = camera.view(WorldPos::default(), 64.0 / 48.0).unwrap();
    let paint = |cell: &dyn Fn(usize, usize) -> [f32; 2], mean: Option<f32>| {
        let mut state = state_of(size, cell);
        if let Some(mean) = mean {
            for c in state.cells.chunks_exact_mut(CHANNELS) {
                c[3] = mean;
            }
        }
        let ground = ground_of(&GroundOptions::default(), &state);
        let how = GroundPictureOptions {
            look: GroundLook {
                altitudes: Some([-100.0, 100.0]),
                ..Default::default()
            },
            ..Default::default()
        };
        drawn(&ground, &how, &view, &targets(), pixels).0
    };
    let mean = |colors: &[[f32; 4]]| -> f64 {
        let middle = &colors[64 * 20..64 * 28];
        middle
            .iter()
            .map(|c| f64::from(c[0] + c[1] + c[2]))
            .sum::<f64>()
            / middle.len() as f64
    };
    // The sun is in the east, at +x.
    let east = paint(&|x, _| [-0.3 * x as f32, 0.0], None);
    let level = paint(&|_, _| [0.0, 0.0], None);
    let west = paint(&|x, _| [0.3 * x as f32, 0.0], None);
    assert!(mean(&east) > 1.3 * mean(&level) && mean(&level) > 1.3 * mean(&west));
    // Level and dry: the same everywhere, as one layer alone would be.
    let spread = |colors: &[[f32; 4]]| {
        let seen: Vec<f32> = colors
            .iter()
            .filter(|c| **c != MAGENTA)
            .map(|c| c[1])
            .collect();
        let [low, high] = [f32::min as fn(f32, f32) -> f32, f32::max]
            .map(|f| seen.iter().copied().reduce(f).unwrap());
        (high - low) / high
    };
    assert!(spread(&level) < 1e-4, "{}", spread(&level));
    let film = paint(&|_, _| [0.0, 5e-3], Some(0.0));
    assert!(spread(&film) < 1e-4, "{}", spread(&film));
    let of_both = (mean(&film) / mean(&level) - 1.0).abs();
    assert!(of_both < 1e-4, "{of_both}");
    // Nor on a slope.
    let slope = |film: f32| paint(&|x, z| [0.2 * x as f32 + 0.01 * z as f32, film], Some(0.0));
    assert_eq!(slope(1e-3), slope(0.0));
    let depths = [0.2, 0.5, 1.0, 3.0, 10.0];
    let waters: Vec<f64> = depths
        .iter()
        .map(|d| mean(&paint(&|_, _| [-d, *d], Some(0.0))))
        .collect();
    assert!(waters.windows(2).all(|w| w[1] < w[0]), "{waters:?}");
    // Mud by the mean.
    let muddy = paint(&|_, _| [0.0, 0.0], Some(0.1));
    let hue = |c: &[[f32; 4]]| c[64 * 24 + 32][1] / c[64 * 24 + 32][0];
    assert!(
        hue(&muddy) < 0.8 * hue(&level),
        "{} {}",
        hue(&muddy),
        hue(&level)
    );
}

/// Levels follow the water that runs, in both schemes.
#[test]
fn ground_picture_follows_the_water() {
    for scheme in [Scheme::Source, Scheme::Physical] {
        let size = [48, 32];
        let state = state_of(size, |x, _| [0.0, if x < 12 { 3.0 } else { 0.0 }]);
        let options = GroundOptions {
            scheme,
            boundary: Boundary::Closed,
            step: 0.05,
            ..Default::default()
        };
        let mut ground = ground_of(&options, &state);
        let mut picture = picture_of(&ground, &GroundPictureOptions::default(), &targets());
        for count in [1_u32, 2, 37] {
            let mut encoder = gpu().device.create_command_encoder(&Default::default());
            let _ = ground.step(&mut encoder, count);
            let work = picture
                .prepare(
                    &gpu().queue,
                    &mut encoder,
                    &ground,
                    &View::default(),
                    &LIGHTS,
                )
                .unwrap();
            gpu().queue.submit([encoder.finish()]);
            assert_eq!(work.dispatches, 2);
            let now = ground.state(gpu()).unwrap();
            let surface = gpu().read_texture(picture.surface()).unwrap();
            let depths: Vec<f32> = surface
                .chunks_exact(16)
                .map(|c| f32::from_le_bytes([c[8], c[9], c[10], c[11]]))
                .collect();
            let wanted: Vec<f32> = now.cells.chunks_exact(CHANNELS).map(|c| c[1]).collect();
            assert_eq!(depths, wanted, "{scheme:?} after {count}");
        }
    }
}

#[test]
fn ground_picture_names_its_faults() {
    let size = [20, 20];
    let ground = ground_of(&GroundOptions::default(), &wavy(size));
    let device = &gpu().device;
    let made = |targets: &Targets, options: &GroundPictureOptions| {
        GroundPicture::new(device, veduta::programs(), targets, &ground, options)
            .map(|_| ())
            .map_err(|e| e.to_string())
    };
    let plain = GroundPictureOptions::default();
    for (targets, options, word) in [
        (Targets::default(), plain, "targets.depth_format"),
        (
            Targets {
                projection: veduta::landscape::Projection::Orthographic,
                ..targets()
            },
            plain,
            "targets.projection",
        ),
        (
            targets(),
            GroundPictureOptions {
                look: GroundLook {
                    mud_albedo: [0.1, f32::NAN, 0.0],
                    ..Default::default()
                },
                ..plain
            },
            "look.mud_albedo",
        ),
        (
            targets(),
            GroundPictureOptions {
                look: GroundLook {
                    steep: [1.0, 1.0],
                    ..Default::default()
                },
                ..plain
            },
            "look.steep",
        ),
    ] {
        let fault = made(&targets, &options).unwrap_err();
        assert!(fault.contains(word), "{fault}");
    }
    let mut picture = picture_of(&ground, &plain, &targets());
    let other = ground_of(&GroundOptions::default(), &wavy([20, 24]));
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut prepare = |ground: &Ground, view: &View| {
        picture
            .prepare(&gpu().queue, &mut encoder, ground, view, &LIGHTS)
            .unwrap_err()
            .to_string()
    };
    assert!(prepare(&other, &View::default()).contains("ground.size"));
    let far = View {
        eye: WorldPos::from_metres(DVec3::new(1e9, 0.0, 0.0)),
        ..Default::default()
    };
    assert!(prepare(&ground, &far).contains("view.eye"));
    let normal = View {
        projection: veduta::glam::camera::rh::proj::directx::perspective(1.0, 1.0, 1.0, 100.0),
        ..Default::default()
    };
    assert!(prepare(&ground, &normal).contains("view.projection"));
}
