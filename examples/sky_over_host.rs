//! A host draws its own meshes, lights them with veduta's sun and sky, and veduta puts the air before them and the sky behind. Run it with
//! `cargo run --release --example sky_over_host -- picture.ppm 2 30 0` for an eye at 2 m, the sun at 30 degrees and a level view.

use veduta::atmosphere::{LightPlace, Sky, SkyComposition, SkyOptions, SkyQuery};
use veduta::glam::{DVec3, Vec3};
use veduta::view::direction;
use veduta::{Light, Targets, View, WorldPos, wgpu};

/// Where the eye is and where the sun stands.
pub struct Shot {
    /// Altitude of the eye in metres.
    pub altitude: f64,
    /// Height of the sun in degrees.
    pub sun_height: f64,
    /// Elevation of the view in degrees.
    pub pitch: f64,
}

type Fallible<T> = Result<T, Box<dyn std::error::Error>>;

/// Draws one frame and returns its pixels for display: red, green, blue and alpha, row by row.
pub fn draw(size: [u32; 2], shot: &Shot) -> Fallible<Vec<u8>> {
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
    // The host's scene radiance and depth, which veduta reads, and the picture for display, which veduta writes.
    let read = wgpu::TextureUsages::TEXTURE_BINDING;
    let scene = texture(wgpu::TextureFormat::Rgba16Float, read).create_view(&Default::default());
    let depth = texture(wgpu::TextureFormat::Depth32Float, read).create_view(&Default::default());
    let picture = texture(
        wgpu::TextureFormat::Rgba8UnormSrgb,
        wgpu::TextureUsages::COPY_SRC,
    );

    // Once: the sky over the host's picture. `Targets::default()` has reversed infinite depth and a perspective.
    let options = SkyOptions {
        composition: SkyComposition::OverPicture,
        ..Default::default()
    };
    let mut sky = Sky::new(device, veduta::programs(), &Targets::default(), &options)?;
    sky.set_host(device, &depth, Some(&scene))?;

    // Each frame: the view, the light on the ground, the host's pass, veduta's pass.
    let to_sun = direction(shot.sun_height.to_radians(), 0.9);
    let mut view = View {
        eye: WorldPos::from_metres(DVec3::new(0.0, shot.altitude, 0.0)),
        sun: Light {
            to_light: to_sun.as_vec3(),
            irradiance: Vec3::splat(6.0),
            ..Default::default()
        },
        ..Default::default()
    };
    let aspect = size[0] as f32 / size[1] as f32;
    view.look(0.0, shot.pitch.to_radians(), 1.0, aspect);
    let query = SkyQuery::new(device, veduta::programs(), &options.atmosphere)?;
    let place = LightPlace {
        altitude: 0.0,
        to_sun: to_sun.to_array(),
        normal: [0.0, 1.0, 0.0],
        sun_angular_radius: f64::from(view.sun.angular_radius),
    };
    let light = query.run(device, queue, sky.tables_mut(), &[place])?[0];

    let mut encoder = device.create_command_encoder(&Default::default());
    let work = sky.prepare(queue, &mut encoder, &view)?;
    println!("{light:?}, {} tables", work.bakes);
    let mut host = (view.projection * view.world_from_view.inverse())
        .to_cols_array()
        .to_vec();
    let colour = Vec3::from_array(options.atmosphere.sun.colour.map(|c| c as f32));
    let irradiance = |of: [f32; 3]| Vec3::from_array(of) * view.sun.irradiance * colour;
    host.extend(view.sun.to_light.extend(shot.altitude as f32).to_array());
    host.extend(irradiance(light.sun).extend(0.0).to_array());
    host.extend(irradiance(light.sky).extend(0.0).to_array());
    draw_meshes(&gpu, &mut encoder, &scene, &depth, &host);

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

/// What the host does without veduta: its meshes with its shader, into its targets.
fn draw_meshes(
    gpu: &veduta::device::Gpu,
    encoder: &mut wgpu::CommandEncoder,
    scene: &wgpu::TextureView,
    depth: &wgpu::TextureView,
    host: &[f32],
) {
    let device = &gpu.device;
    let module = device.create_shader_module(wgpu::include_wgsl!("sky_over_host.wgsl"));
    let bytes: Vec<u8> = host.iter().flat_map(|n| n.to_le_bytes()).collect();
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("host"),
        size: bytes.len() as u64,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    gpu.queue.write_buffer(&buffer, 0, &bytes);
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: scene,
            depth_slice: None,
            resolve_target: None,
            ops: Default::default(),
        })],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: depth,
            depth_ops: Some(wgpu::Operations {
                load: wgpu::LoadOp::Clear(0.0),
                store: wgpu::StoreOp::Store,
            }),
            stencil_ops: None,
        }),
        ..Default::default()
    });
    for (entry, vertices, instances) in [("ground", 6 * 160 * 320, 1), ("boxes", 36, 6)] {
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(entry),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some(entry),
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
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..vertices, 0..instances);
    }
}

fn main() -> Fallible<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |at: usize, otherwise: f64| arguments.get(at).map_or(Ok(otherwise), |a| a.parse());
    let shot = Shot {
        altitude: number(1, 2.0)?,
        sun_height: number(2, 30.0)?,
        pitch: number(3, 0.0)?,
    };
    let size = [384, 216];
    let pixels = draw(size, &shot)?;
    if let Some(file) = arguments.first() {
        let mut bytes = format!("P6 {} {} 255\n", size[0], size[1]).into_bytes();
        bytes.extend(pixels.chunks(4).flat_map(|p| &p[..3]));
        std::fs::write(file, bytes)?;
    }
    Ok(())
}
