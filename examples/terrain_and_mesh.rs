//! A host's own meshes among mountains: veduta draws the ground with its depth, the host its towers into the same pass, and veduta the air before both. Run it with
//! `cargo run --release --example terrain_and_mesh -- picture.ppm`.

use veduta::atmosphere::{Sky, SkyComposition, SkyOptions, SkyQuery};
use veduta::glam::{DVec3, Vec3};
use veduta::terrain::{Land, Terrain, TerrainLights, TerrainOptions};
use veduta::view::direction;
use veduta::{Light, Preset, Targets, View, WorldPos, wgpu};

/// A tower of the host.
pub struct Tower {
    /// How far it is from the eye, to the right and ahead in metres.
    pub away: [f64; 2],
    /// How high its foot stands above the ground in metres.
    pub rise: f64,
}

/// A row of towers on the ground.
pub fn row() -> Vec<Tower> {
    [[-150.0, 500.0], [60.0, 900.0], [500.0, 1600.0]]
        .map(|away| Tower { away, rise: 0.0 })
        .into()
}

type Fallible<T> = Result<T, Box<dyn std::error::Error>>;

/// Draws one frame and returns its pixels for display: red, green, blue and alpha, row by row.
pub fn draw(size: [u32; 2], towers: &[Tower]) -> Fallible<Vec<u8>> {
    let gpu = pollster::block_on(veduta::device::Gpu::open())?;
    let (device, queue) = (&gpu.device, &gpu.queue);
    let texture = |format, usage| {
        device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d {
                width: size[0],
                height: size[1],
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: usage | wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        })
    };
    let read = wgpu::TextureUsages::TEXTURE_BINDING;
    let scene = texture(wgpu::TextureFormat::Rgba16Float, read).create_view(&Default::default());
    let depth = texture(wgpu::TextureFormat::Depth32Float, read).create_view(&Default::default());
    let picture = texture(
        wgpu::TextureFormat::Rgba8UnormSrgb,
        wgpu::TextureUsages::COPY_SRC,
    );

    // Once: the ground into the host's pass (scene radiance and reversed infinite depth), and the air over what has been drawn.
    let land = Land::named("alps")?;
    let targets = Targets {
        color_format: wgpu::TextureFormat::Rgba16Float,
        depth_format: Some(wgpu::TextureFormat::Depth32Float),
        ..Default::default()
    };
    let options = TerrainOptions {
        preset: Preset::Low,
        land: land.clone(),
        ..Default::default()
    };
    let mut terrain = Terrain::new(device, veduta::programs(), &targets, &options)?;
    let options = SkyOptions {
        composition: SkyComposition::OverPicture,
        ..Default::default()
    };
    let mut sky = Sky::new(device, veduta::programs(), &Targets::default(), &options)?;
    sky.set_host(device, &depth, Some(&scene))?;
    let query = SkyQuery::new(device, veduta::programs(), &options.atmosphere)?;

    // Where things stand: the same heights as on the device, on the processor.
    let field = land.prepare::<f64>()?;
    let above = |at: DVec3, rise: f64| {
        let foot = WorldPos::from_metres(DVec3::new(at.x, 0.0, at.z));
        let height = field.ground(foot, 0.0).height;
        (foot.moved_by(DVec3::new(0.0, height + rise, 0.0)), height)
    };
    let (eye, ground) = above(DVec3::new(13_500.0, 0.0, -14_700.0), 250.0);
    let mut view = View {
        eye,
        sun: Light {
            to_light: direction(0.5, 2.1).as_vec3(),
            irradiance: Vec3::splat(6.0),
            ..Default::default()
        },
        ..Default::default()
    };
    view.look(0.0, -0.1, 1.0, size[0] as f32 / size[1] as f32);

    // Each frame: lights of the sky, the ground, the towers, the air.
    let lights = TerrainLights::from_sky(
        device,
        queue,
        &query,
        sky.tables_mut(),
        &view.sun,
        ground,
        land.material.rock_albedo(),
    )?;
    let mut encoder = device.create_command_encoder(&Default::default());
    let work = terrain.prepare(queue, &mut encoder, &view, &lights, size[1])?;
    println!("{lights:?}, {} levels baked", work.bakes);
    let _ = sky.prepare(queue, &mut encoder, &view)?;
    let mut host = (view.projection * view.world_from_view.inverse())
        .to_cols_array()
        .to_vec();
    host.extend(view.sun.to_light.extend(0.0).to_array());
    host.extend(lights.sun.extend(0.0).to_array());
    host.extend(lights.sky.extend(0.0).to_array());
    for tower in towers {
        let [right, ahead] = tower.away;
        let at = eye.to_metres() + DVec3::new(right, 0.0, -ahead);
        let foot = above(at, tower.rise).0.relative_to(eye).as_vec3();
        host.extend(foot.extend(0.0).to_array());
    }
    host.resize(28 + 4 * 8, 0.0);
    let (pipeline, group) = meshes(&gpu, &host);
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &scene,
            depth_slice: None,
            resolve_target: None,
            ops: Default::default(),
        })],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &depth,
            depth_ops: Some(wgpu::Operations {
                load: wgpu::LoadOp::Clear(0.0),
                store: wgpu::StoreOp::Store,
            }),
            stencil_ops: None,
        }),
        ..Default::default()
    });
    let _ = terrain.draw_opaque(&mut pass);
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.draw(0..36, 0..towers.len().min(8) as u32);
    drop(pass);
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &picture.create_view(&Default::default()),
            depth_slice: None,
            resolve_target: None,
            ops: Default::default(),
        })],
        ..Default::default()
    });
    let _ = sky.composite(&mut pass)?;
    drop(pass);
    queue.submit([encoder.finish()]);
    Ok(gpu.read_texture(&picture)?)
}

/// What the host has anyway: its shader, with depth that is greater when it is nearer.
fn meshes(gpu: &veduta::device::Gpu, host: &[f32]) -> (wgpu::RenderPipeline, wgpu::BindGroup) {
    let device = &gpu.device;
    let module = device.create_shader_module(wgpu::include_wgsl!("terrain_and_mesh.wgsl"));
    let bytes: Vec<u8> = host.iter().flat_map(|n| n.to_le_bytes()).collect();
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("host"),
        size: bytes.len() as u64,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    gpu.queue.write_buffer(&buffer, 0, &bytes);
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("towers"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("tower"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: wgpu::TextureFormat::Depth32Float,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("lit"),
            compilation_options: Default::default(),
            targets: &[Some(wgpu::TextureFormat::Rgba16Float.into())],
        }),
        multiview_mask: None,
        cache: None,
    });
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("host"),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[wgpu::BindGroupEntry {
            binding: 0,
            resource: buffer.as_entire_binding(),
        }],
    });
    (pipeline, group)
}

fn main() -> Fallible<()> {
    let size = [384, 216];
    let pixels = draw(size, &row())?;
    if let Some(file) = std::env::args().nth(1) {
        let mut bytes = format!("P6 {} {} 255\n", size[0], size[1]).into_bytes();
        bytes.extend(pixels.chunks(4).flat_map(|p| &p[..3]));
        std::fs::write(file, bytes)?;
    }
    Ok(())
}
