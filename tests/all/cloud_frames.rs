//! Layers of clouds in a whole frame: the air before them, and their shadows on the ground.

use crate::common::gpu;
use veduta::atmosphere::{
    Atmosphere, Eye, ProbeOptions, ProbeRay, Sky, SkyOptions, SkyQuality, SkyTables, probe,
};
use veduta::clouds::{
    CloudDeck, CloudLights, CloudQuality, Clouds, CloudsOptions, Orders, ProbePath, layer_shadow,
};
use veduta::glam::{DVec3, Vec3};
use veduta::reference::clouds as exact;
use veduta::reference::planet;
use veduta::view::direction;
use veduta::{Preset, Settings, Targets, View, WorldPos, wgpu};

pub(crate) const RADIUS: f64 = 6.36e6;
const WIDTH: u32 = 64;
const HEIGHT: u32 = 36;

pub(crate) fn targets() -> Targets {
    Targets {
        color_format: wgpu::TextureFormat::Rgba16Float,
        ..Default::default()
    }
}

/// A number of 16 bits, finite.
fn half(low: u8, high: u8) -> f32 {
    let bits = u16::from_le_bytes([low, high]);
    let (exponent, rest) = (i32::from(bits >> 10 & 31), f32::from(bits & 1023));
    let size = match exponent {
        0 => rest * 2.0_f32.powi(-24),
        _ => (1.0 + rest / 1024.0) * 2.0_f32.powi(exponent - 15),
    };
    if bits >> 15 == 1 { -size } else { size }
}

/// The layer over black: light and transmittance of each pixel.
pub(crate) fn over_black(clouds: &mut Clouds, view: &View, lights: &CloudLights) -> Vec<[f32; 4]> {
    let gpu = gpu();
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d {
            width: WIDTH,
            height: HEIGHT,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: targets().color_format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let target = texture.create_view(&Default::default());
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let _ = clouds
        .prepare(&gpu.queue, &mut encoder, view, lights)
        .unwrap();
    let _ = clouds.encode_volumes(&mut encoder).unwrap();
    {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &target,
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
    }
    gpu.queue.submit([encoder.finish()]);
    gpu.read_texture(&texture)
        .unwrap()
        .chunks_exact(8)
        .map(|p| [0, 2, 4, 6].map(|k| half(p[k], p[k + 1])))
        .collect()
}

/// What lies between the eye and a distance: the clouds' light from there, and how much of the light from behind is left after it.
pub(crate) struct Stretch {
    pub distance: f64,
    pub light: f64,
    pub taken: f64,
}

/// A march in `f64` through a layer above the point at `place`, in stretches.
pub(crate) fn stretches(
    deck: &CloudDeck,
    place: [f64; 2],
    ray: &ProbeRay,
    count: usize,
) -> (Vec<Stretch>, f64) {
    let mut layer = exact::CloudLayer::of(deck);
    for (k, at) in [(0, place[0]), (2, place[1])] {
        let cells = at / deck.wavelength;
        layer.cell[k] = cells.floor() as i32;
        layer.frac[k] = cells - cells.floor();
    }
    let top = layer.bottom + layer.thickness;
    let segment = planet::shell_segment(RADIUS, layer.bottom, top, ray.altitude, ray.dir[1]);
    let segment = planet::clip_segment(segment, 200_000.0);
    let fine = 20;
    let ds = planet::segment_length(segment) / (count * fine) as f64;
    let nu = (0..3).map(|k| ray.dir[k] * ray.to_sun[k]).sum::<f64>();
    let phase = veduta::reference::phase::phase_double_henyey_greenstein(
        nu,
        deck.g_forward,
        deck.g_backward,
        deck.backward_share,
    );
    let mut depth = 0.0_f64;
    let mut found = Vec::new();
    for k in 0..count {
        let (mut light, mut far, before) = (0.0, 0.0, (-depth).exp());
        for j in 0..fine {
            let t = planet::segment_distance(segment, ((k * fine + j) as f64 + 0.5) * ds);
            far += t / fine as f64;
            let relative = ray.dir.map(|c| c * t);
            let altitude = planet::altitude_of(RADIUS, ray.altitude, relative);
            let added = exact::cloud_density(&layer, relative, altitude) * layer.extinction * ds;
            if added > 0.0 && depth < 12.0 {
                let mu = planet::direction_cosine_along(
                    RADIUS,
                    ray.altitude,
                    altitude,
                    ray.to_sun[1],
                    nu,
                    t,
                );
                let sun = exact::sun_depth(&layer, RADIUS, relative, altitude, ray.to_sun, mu, 24);
                light += (-depth - sun).exp() * (1.0 - (-added).exp()) * phase;
            }
            depth += added;
        }
        found.push(Stretch {
            distance: far,
            light,
            taken: before - (-depth).exp(),
        });
    }
    (found, (-depth).exp())
}

/// Air up to the mean distance of what is seen of the clouds, against a march that has the air at each of its steps, from below and from 10 km.
#[test]
fn clouds_show_the_air_before_them() {
    let gpu = gpu();
    let air = Atmosphere::default();
    let settings = Settings::resolve(veduta::programs(), &Preset::High, None, &[]).unwrap();
    for (altitude, pitch, most) in [(300.0, 0.3, 0.02), (10_000.0, -0.3, 0.03)] {
        let mut view = View {
            eye: WorldPos::from_metres(DVec3::new(100.0, altitude, -300.0)),
            ..Default::default()
        };
        view.sun.irradiance = Vec3::ONE;
        view.look(0.4, pitch, 0.8, 16.0 / 9.0);
        let to_sun = view.sun.to_light.as_dvec3().normalize().to_array();
        let mut tables = SkyTables::new(
            &gpu.device,
            veduta::programs(),
            &air,
            &SkyQuality::of(&settings),
        )
        .unwrap();
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let eye = Eye {
            altitude,
            to_sun,
            sun_angular_radius: f64::from(view.sun.angular_radius),
        };
        let _ = tables.prepare(&gpu.queue, &mut encoder, &eye).unwrap();
        gpu.queue.submit([encoder.finish()]);
        let new = |air: Option<Atmosphere>| {
            let options = CloudsOptions {
                quality: CloudQuality {
                    texels: 512,
                    first_texels: 512,
                    steps: 192,
                    ..CloudQuality::of(&Preset::High)
                },
                far: 200_000.0,
                orders: Orders::Single,
                air,
                ..Default::default()
            };
            Clouds::new(&gpu.device, veduta::programs(), &targets(), &options).unwrap()
        };
        let lights = CloudLights {
            sun: Vec3::ONE,
            above: Vec3::ZERO,
            below: Vec3::ZERO,
        };
        let mut clouds = new(Some(air.clone()));
        clouds.set_air(&gpu.device, &tables).unwrap();
        let shown = over_black(&mut clouds, &view, &lights);
        let bare = over_black(&mut new(None), &view, &lights);
        // Pixels here and there, and the air at every stretch of theirs.
        let [middle, right, up] = view.rays().unwrap();
        let mut pixels = Vec::new();
        let mut rays = Vec::new();
        const STRETCHES: usize = 24;
        for (y, x) in (2..HEIGHT)
            .step_by(4)
            .flat_map(|y| (2..WIDTH).step_by(6).map(move |x| (y, x)))
        {
            let at = |k: u32, n: u32| (2 * k + 1) as f32 / n as f32 - 1.0;
            let dir = middle + at(x, WIDTH) * right - at(y, HEIGHT) * up;
            let ray = ProbeRay {
                altitude,
                dir: dir.as_dvec3().normalize().to_array(),
                to_sun,
                distance: f64::INFINITY,
            };
            let (found, left) = stretches(&CloudDeck::default(), [100.0, -300.0], &ray, STRETCHES);
            rays.extend(found.iter().map(|s| ProbeRay {
                distance: s.distance.max(1.0),
                ..ray
            }));
            pixels.push(((y * WIDTH + x) as usize, found, left));
        }
        let options = ProbeOptions {
            path: ProbePath::Fast,
            orders: Orders::All,
            ..Default::default()
        };
        let airs = probe(gpu, &air, &rays, &options).unwrap();
        let (mut square, mut power, mut changed, mut seen) = (0.0, 0.0, 0.0, 0);
        for ((at, found, left), airs) in pixels.iter().zip(airs.chunks_exact(STRETCHES)) {
            let colour = air.sun.colour;
            seen += usize::from(*left < 0.9);
            for (k, colour) in colour.into_iter().enumerate() {
                let wanted: f64 = found
                    .iter()
                    .zip(airs)
                    .map(|(s, a)| {
                        s.light * f64::from(a.transmittance[k])
                            + s.taken * colour * f64::from(a.in_scatter[k])
                    })
                    .sum();
                square += (f64::from(shown[*at][k]) - wanted).powi(2);
                power += wanted * wanted;
                changed += (f64::from(bare[*at][k]) - wanted).powi(2);
            }
        }
        let off = (square / power).sqrt();
        println!(
            "from {altitude} m: {:.2} % of the light with air at each step, {:.1} % without air; {seen} of {} pixels cloudy",
            100.0 * off,
            100.0 * (changed / power).sqrt(),
            pixels.len()
        );
        assert!(seen > 20, "{seen}");
        assert!(off < most, "{off}");
        assert!((changed / power).sqrt() > 3.0 * most);
    }
}

#[test]
fn tables_of_the_air_that_do_not_fit_are_refused() {
    let gpu = gpu();
    let device = &gpu.device;
    let small = CloudsOptions {
        quality: CloudQuality {
            cells: [32, 2],
            ..CloudQuality::of(&Preset::Low)
        },
        ..Default::default()
    };
    let new = |options: &CloudsOptions| {
        Clouds::new(device, veduta::programs(), &targets(), options).unwrap()
    };
    let settings = Settings::resolve(veduta::programs(), &Preset::Low, None, &[]).unwrap();
    let quality = SkyQuality::of(&settings);
    let tables = SkyTables::new(device, veduta::programs(), &Default::default(), &quality).unwrap();
    let text = new(&small)
        .set_air(device, &tables)
        .unwrap_err()
        .to_string();
    assert!(text.contains("options.air"), "{text}");
    let airy = CloudsOptions {
        air: Some(Atmosphere::default()),
        ..small
    };
    let background = Sky::new(
        device,
        veduta::programs(),
        &targets(),
        &SkyOptions::default(),
    )
    .unwrap();
    let text = new(&airy)
        .set_air(device, background.tables())
        .unwrap_err()
        .to_string();
    assert!(text.contains("tables.aerial"), "{text}");
    // Without tables nothing is drawn.
    let mut clouds = new(&airy);
    let mut encoder = device.create_command_encoder(&Default::default());
    let lights = CloudLights::clear(Vec3::ONE);
    let mut view = View::default();
    view.look(0.0, 0.5, 1.0, 16.0 / 9.0);
    let _ = clouds
        .prepare(&gpu.queue, &mut encoder, &view, &lights)
        .unwrap();
    let target = device
        .create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: Default::default(),
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: targets().color_format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        })
        .create_view(&Default::default());
    let text = {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &target,
                depth_slice: None,
                resolve_target: None,
                ops: Default::default(),
            })],
            ..Default::default()
        });
        clouds.composite(&mut pass).unwrap_err().to_string()
    };
    assert!(text.contains("set_air"), "{text}");
}

/// The sun's light on drawn ground against `layer_shadow` where the depth says that it is.
#[test]
fn clouds_shade_the_ground() {
    use veduta::terrain::{Land, Terrain, TerrainLights, TerrainOptions};
    let gpu = gpu();
    let (rows, columns) = (72, 128);
    let land_targets = Targets {
        color_format: wgpu::TextureFormat::Rgba32Float,
        depth_format: Some(wgpu::TextureFormat::Depth32Float),
        ..targets()
    };
    let options = TerrainOptions {
        land: Land::named("thesis").unwrap(),
        cloud_shadows: true,
        ..Default::default()
    };
    let mut terrain =
        Terrain::new(&gpu.device, veduta::programs(), &land_targets, &options).unwrap();
    let mut view = View {
        eye: WorldPos::from_metres(DVec3::new(13_500.0, 3200.0, -14_700.0)),
        ..Default::default()
    };
    view.sun.to_light = direction(0.8, 1.0).as_vec3();
    view.look(0.3, -0.25, 1.0, 16.0 / 9.0);
    let deck = CloudDeck {
        wind: [11.0, -7.0],
        ..Default::default()
    };
    let mut clouds = Clouds::new(
        &gpu.device,
        veduta::programs(),
        &targets(),
        &CloudsOptions {
            quality: CloudQuality {
                first_texels: 384,
                ..CloudQuality::of(&Preset::High)
            },
            deck: deck.clone(),
            orders: Orders::Single,
            ..Default::default()
        },
    )
    .unwrap();
    let lights = TerrainLights {
        sun: Vec3::splat(std::f32::consts::PI),
        sky: Vec3::ZERO,
        bounce: Vec3::ZERO,
    };
    // Before it is told anything no cloud shades it.
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let _ = terrain
        .prepare(&gpu.queue, &mut encoder, &view, &lights, rows as u32)
        .unwrap();
    gpu.queue.submit([encoder.finish()]);
    let (untold, _, _) = crate::land::drawn(&terrain, columns, rows, 0.0);
    let mut draw = |shadow: Option<f64>| {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        view.time = shadow.unwrap_or(0.0);
        let _ = terrain
            .prepare(&gpu.queue, &mut encoder, &view, &lights, rows as u32)
            .unwrap();
        let sun = CloudLights::clear(Vec3::ONE);
        let _ = clouds
            .prepare(&gpu.queue, &mut encoder, &view, &sun)
            .unwrap();
        let told = shadow.and_then(|_| clouds.shadow());
        assert_eq!(told.is_some(), shadow.is_some());
        let _ = terrain
            .set_cloud_shadow(&gpu.device, &gpu.queue, told.as_ref())
            .unwrap();
        gpu.queue.submit([encoder.finish()]);
        crate::land::drawn(&terrain, columns, rows, 0.0)
    };
    let (lit, depths, _) = draw(None);
    let (shaded, _, _) = draw(Some(200.0));
    let (again, _, _) = draw(None);
    assert!(lit == again, "without clouds there is no shadow");
    assert!(lit == untold, "none is told yet");
    let [middle, right, up] = view.rays().unwrap();
    let forward = view.world_from_view.transform_vector3(Vec3::NEG_Z);
    let eye = view.eye.to_metres();
    let (mut points, mut shares) = (Vec::new(), Vec::new());
    for i in 0..rows * columns {
        let at = |k: usize, n: usize| (2 * k + 1) as f32 / n as f32 - 1.0;
        let ray = middle + at(i % columns, columns) * right - at(i / columns, rows) * up;
        if depths[i] > 0.0 && lit[4 * i] > 0.02 {
            let ahead = view.projection.w_axis.z / depths[i] / ray.dot(forward);
            let relative = (ray * ahead).as_dvec3();
            let altitude = planet::altitude_of(RADIUS, eye.y, relative.to_array());
            // Clouds that drift with the wind stand where the ground has gone the other way.
            points.push([
                eye.x + relative.x - 200.0 * deck.wind[0],
                altitude,
                eye.z + relative.z - 200.0 * deck.wind[1],
            ]);
            shares.push(f64::from(shaded[4 * i] / lit[4 * i]));
        }
    }
    let to_sun = view.sun.to_light.as_dvec3().to_array();
    let wanted = layer_shadow(gpu, veduta::programs(), &deck, to_sun, &points).unwrap();
    let square: f64 = shares
        .iter()
        .zip(&wanted)
        .map(|(s, w)| (s - f64::from(*w)).powi(2))
        .sum();
    let off = (square / points.len() as f64).sqrt();
    let dark = wanted.iter().filter(|w| **w < 0.1).count();
    println!(
        "{} lit places, {dark} in the shadow of clouds: off by {off:.4}",
        points.len()
    );
    assert!(dark > points.len() / 20 && dark < points.len() * 9 / 10);
    assert!(off < 0.01, "{off}");
    // Ground that was made without refuses a shadow.
    let mut bare = Terrain::new(
        &gpu.device,
        veduta::programs(),
        &land_targets,
        &TerrainOptions::default(),
    )
    .unwrap();
    let text = bare
        .set_cloud_shadow(&gpu.device, &gpu.queue, None)
        .unwrap_err()
        .to_string();
    assert!(text.contains("terrain.cloud_shadows"), "{text}");
}

/// A depth buffer as large as the picture whose left part is a wall at a distance (m), behind which there is sky.
fn walled(view: &View, distance: f32, columns: u32) -> wgpu::TextureView {
    let gpu = gpu();
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d {
            width: WIDTH,
            height: HEIGHT,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Depth32Float,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    let target = texture.create_view(&Default::default());
    let module = gpu
        .device
        .create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(
                "override AT: f32 = 0.0;
@vertex
fn cover(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(select(-1.0, 3.0, i == 1u), select(-1.0, 3.0, i == 2u), AT, 1.0);
}"
                .into(),
            ),
        });
    let pipeline = gpu
        .device
        .create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("cover"),
                compilation_options: wgpu::PipelineCompilationOptions {
                    constants: &[("AT", f64::from(view.projection.w_axis.z / distance))],
                    ..Default::default()
                },
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: wgpu::TextureFormat::Depth32Float,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Always),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: None,
            multiview_mask: None,
            cache: None,
        });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &target,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&pipeline);
        pass.set_scissor_rect(0, 0, columns, HEIGHT);
        pass.draw(0..3, 0..1);
    }
    gpu.queue.submit([encoder.finish()]);
    target
}

/// Half as many pixels a side, before the sky and before a wall within the layer: like the whole ones, and no cloud of the sky on the wall, nor the wall's in the sky.
#[test]
fn half_resolution_keeps_to_the_depth() {
    let mut view = View {
        eye: WorldPos::from_metres(DVec3::new(100.0, 300.0, -300.0)),
        ..Default::default()
    };
    view.sun.irradiance = Vec3::ONE;
    // So narrow that a pixel is not much wider than the noise is fine.
    view.look(0.4, 0.8, 0.4, 16.0 / 9.0);
    let lights = CloudLights::clear(Vec3::ONE);
    // An odd number of columns, so that texels of the coarse picture lie across the edge.
    let columns = 31;
    // The wall stands before the layer.
    let wall = walled(&view, 2000.0, columns);
    let draw = |half: bool, jitter: bool| {
        let options = CloudsOptions {
            quality: CloudQuality {
                cells: [32, 2],
                steps: 96,
                half,
                jitter,
                ..CloudQuality::of(&Preset::Low)
            },
            over_depth: true,
            orders: Orders::Single,
            ..Default::default()
        };
        let device = &gpu().device;
        let mut clouds = Clouds::new(device, veduta::programs(), &targets(), &options).unwrap();
        clouds.set_host(device, &wall).unwrap();
        over_black(&mut clouds, &view, &lights)
    };
    let (whole, half, shifted) = (draw(false, false), draw(true, false), draw(false, true));
    let column = |i: usize| (i as u32) % WIDTH;
    // Nothing on the wall, right up to the edge.
    let on_wall = (0..whole.len()).filter(|i| column(*i) < columns);
    for i in on_wall {
        assert_eq!(whole[i][3], 1.0);
        assert!(half[i][3] > 0.995, "{i}: {:?}", half[i]);
    }
    // Relative to the whole picture moved by some pixels, right or down.
    let off_by = |other: &[[f32; 4]], first: u32, last: u32, moved: isize| {
        let of = |p: &[[f32; 4]], i: usize| f64::from(p[i][1]);
        let rows = WIDTH as usize..whole.len() - WIDTH as usize;
        let inside = |i: &usize| (first..last).contains(&column(*i)) && rows.contains(i);
        let all: Vec<usize> = (0..whole.len()).filter(inside).collect();
        let square: f64 = all
            .iter()
            .map(|i| (of(other, *i) - of(&whole, i.wrapping_add_signed(moved))).powi(2))
            .sum();
        let power: f64 = all.iter().map(|i| of(&whole, *i).powi(2)).sum();
        (square / power).sqrt()
    };
    let off = |other: &[[f32; 4]], first: u32, last: u32| off_by(other, first, last, 0);
    let (open, edge) = (off(&half, 36, WIDTH - 1), off(&half, columns, columns + 2));
    // It stands where the whole one does: moved either way it is off by more, and as much.
    for step in [1, WIDTH as isize] {
        let [one, other] = [-step, step].map(|moved| off_by(&half, 36, WIDTH - 1, moved));
        println!("moved: {one:.4} and {other:.4}");
        assert!(open < 0.8 * one.min(other));
        assert!((one - other).abs() < 0.25 * (one + other));
    }
    let jitter = off(&shifted, columns, WIDTH);
    println!(
        "half resolution: {open:.4} of the light off, {edge:.4} beside the wall; shifted starts {jitter:.4}"
    );
    assert!(open < 0.025, "{open}");
    // Beside the wall no worse than a neighbour taken for the pixel is.
    assert!(edge < 0.1, "{edge}");
    assert!(jitter > 1e-4 && jitter < 0.03, "{jitter}");
    // What has no use for a size refuses it.
    let options = CloudsOptions {
        orders: Orders::Single,
        ..Default::default()
    };
    let device = &gpu().device;
    let mut clouds = Clouds::new(device, veduta::programs(), &targets(), &options).unwrap();
    let text = clouds.set_size(device, [8, 8]).unwrap_err().to_string();
    assert!(text.contains("quality.half"), "{text}");
}

#[test]
fn layers_appear_without_a_pop() {
    let mut view = View {
        eye: WorldPos::from_metres(DVec3::new(13_500.0, 300.0, -14_700.0)),
        ..Default::default()
    };
    view.sun.irradiance = Vec3::ONE;
    view.look(0.0, 0.35, 1.0, 16.0 / 9.0);
    let lights = CloudLights::clear(Vec3::splat(std::f32::consts::PI));
    for preset in [Preset::Low, Preset::Medium, Preset::High] {
        let quality = CloudQuality::of(&preset);
        let options = CloudsOptions {
            quality,
            ..Default::default()
        };
        let device = &gpu().device;
        let mut clouds = Clouds::new(device, veduta::programs(), &targets(), &options).unwrap();
        // Before a grey sky, tone-mapped so that light clouds are at two thirds.
        let mut shown = |_: u32| -> Vec<f64> {
            over_black(&mut clouds, &view, &lights)
                .iter()
                .map(|p| f64::from(p[1] + 0.1 * p[3]))
                .map(|light| light / (0.25 + light))
                .collect()
        };
        let first = shown(0);
        let (mut before, mut worst) = (first.clone(), [0.0_f64; 3]);
        for k in 1..60 {
            let now = shown(k);
            let count = now.len() as f64;
            let mean: f64 = now.iter().zip(&before).map(|(n, b)| n - b).sum::<f64>() / count;
            let square: f64 = now.iter().zip(&before).map(|(n, b)| (n - b).powi(2)).sum();
            let rms = (square / count).sqrt();
            if rms > 0.002 {
                println!("{preset:?}: frame {k}: {mean:.4} {rms:.4}");
            }
            worst = [worst[0].max(mean.abs()), worst[1].max(rms), worst[2]];
            before = now;
        }
        let count = before.len() as f64;
        let square: f64 = before
            .iter()
            .zip(&first)
            .map(|(n, b)| (n - b).powi(2))
            .sum();
        worst[2] = (square / count).sqrt();
        println!(
            "{preset:?}: a frame changes the mean by {:.4}, pixels by {:.4} RMS at most; the first is off by {:.4} from the last",
            worst[0], worst[1], worst[2]
        );
        assert!(worst[0] < 0.003, "{worst:?}");
        assert!(worst[1] < 0.01, "{worst:?}");
        assert!(worst[2] < 0.05, "{worst:?}");
    }
}

/// From columns that follow the sun's rays to upright ones, in tiles of 8 bits, while it sets.
#[test]
fn a_setting_sun_lights_clouds_as_one_that_stands() {
    let mut view = View {
        eye: WorldPos::from_metres(DVec3::new(13_500.0, 300.0, -14_700.0)),
        ..Default::default()
    };
    view.sun.irradiance = Vec3::ONE;
    view.look(0.0, 0.5, 1.0, 16.0 / 9.0);
    let lights = CloudLights {
        sun: Vec3::splat(std::f32::consts::PI),
        above: Vec3::ZERO,
        below: Vec3::ZERO,
    };
    let device = &gpu().device;
    for (deck, [high, low]) in [("thesis", [15.0_f64, 10.0]), ("towers", [48.0, 43.0])] {
        let options = CloudsOptions {
            quality: CloudQuality {
                frames: 10,
                ..CloudQuality::of(&Preset::Low)
            },
            deck: CloudDeck::named(deck).unwrap(),
            ..Default::default()
        };
        let lowest = f64::from(options.deck.lowest_sun(options.quality.levels)).asin();
        assert!((low..high).contains(&lowest.to_degrees()));
        let new = || Clouds::new(device, veduta::programs(), &targets(), &options).unwrap();
        let mut under = |clouds: &mut Clouds, degrees: f64| {
            view.sun.to_light = direction(degrees.to_radians(), 0.5).as_vec3();
            over_black(clouds, &view, &lights)
        };
        // A twentieth of a degree a frame, and then it stands.
        let mut clouds = new();
        for k in 0..100 {
            let _ = under(&mut clouds, high - (high - low) * f64::from(k) / 100.0);
        }
        let moved = under(&mut clouds, low);
        let mut rested = |clouds: &mut Clouds, degrees: f64| {
            (0..400).map(|_| under(clouds, degrees)).last().unwrap()
        };
        let (stood, begun) = (rested(&mut clouds, low), rested(&mut new(), low));
        let before = rested(&mut new(), low + 3.0);
        let off = |picture: &[[f32; 4]]| {
            let part = |f: &dyn Fn(usize) -> f32| {
                (0..begun.len())
                    .map(|i| f64::from(f(i)).powi(2))
                    .sum::<f64>()
            };
            (part(&|i| picture[i][1] - begun[i][1]) / part(&|i| begun[i][1])).sqrt()
        };
        let [way, degree, stood] = [&moved, &before, &stood].map(|p| off(p));
        println!(
            "{deck}: {way:.3} off when the sun has just come to rest, as {degree:.3} three degrees before; {stood:.4} later"
        );
        // It lags by less than three degrees: those of two seconds.
        assert!(way < degree, "{deck}: {way}, {degree}");
        assert!(stood < 0.05, "{deck}: {stood}");
    }
}
