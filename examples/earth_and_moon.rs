//! The Earth, the Moon and the Sun from orbit: the host draws the Moon and the stars, veduta the sky over them. Run it with
//! `cargo run --release --example earth_and_moon -- picture.ppm 400 -14 20 40` for an eye at 400 km, the sun 14 degrees below the level and
//! 20 to the right, and a field of view of 40 degrees; with `400 10 110 5` the half Moon stands over the limb.

use veduta::atmosphere::{Sky, SkyComposition, SkyOptions};
use veduta::glam::{DVec3, Vec3};
use veduta::view::direction;
use veduta::{Light, Targets, View, WorldPos, wgpu};

/// Where the eye is and where the sun stands.
pub struct Shot {
    /// Altitude of the eye in kilometres.
    pub altitude: f64,
    /// Height of the sun in degrees.
    pub sun_height: f64,
    /// Azimuth of the sun from the middle of the picture in degrees, clockwise.
    pub sun_azimuth: f64,
    /// Vertical field of view in degrees.
    pub fov: f64,
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
    // One target with the host's scene radiance, and linear depth in its alpha: 1 where there is nothing.
    let scene = texture(
        wgpu::TextureFormat::Rgba32Float,
        wgpu::TextureUsages::TEXTURE_BINDING,
    );
    let scene = scene.create_view(&Default::default());
    let picture = texture(
        wgpu::TextureFormat::Rgba8UnormSrgb,
        wgpu::TextureUsages::COPY_SRC,
    );
    let options = SkyOptions {
        composition: SkyComposition::OverPictureWithAlpha,
        ..Default::default()
    };
    let mut sky = Sky::new(device, veduta::programs(), &Targets::default(), &options)?;
    let greatest_depth = 1e9;
    sky.set_host_with_alpha(device, &scene, greatest_depth)?;

    let altitude = 1e3 * shot.altitude;
    let to_sun = direction(shot.sun_height.to_radians(), shot.sun_azimuth.to_radians());
    let mut view = View {
        eye: WorldPos::from_metres(DVec3::new(0.0, altitude, 0.0)),
        sun: Light {
            to_light: to_sun.as_vec3(),
            irradiance: Vec3::splat(12.0),
            ..Default::default()
        },
        ..Default::default()
    };
    // The horizon lies this far below the level.
    let radius = options.atmosphere.planet_radius;
    let dip = (radius / (radius + altitude)).acos();
    let fov = shot.fov.to_radians();
    let aspect = size[0] as f32 / size[1] as f32;
    view.look(0.0, -dip + 0.1 * fov, fov as f32, aspect);

    let mut encoder = device.create_command_encoder(&Default::default());
    let _ = sky.prepare(queue, &mut encoder, &view)?;
    let [middle, right, up] = view.rays()?;
    let forward = view.world_from_view.transform_vector3(Vec3::NEG_Z);
    // The Moon in its true size, 384,400 km away.
    let to_moon = direction(0.27 * fov - dip, -0.3 * fov).as_vec3();
    let mut host = Vec::new();
    for (v, w) in [
        (middle, 384_400e3),
        (right, 1_737e3),
        (up, greatest_depth),
        (forward, 0.0),
        (to_moon, 0.0),
        (view.sun.to_light, 0.0),
        (view.sun.irradiance, 0.0),
    ] {
        host.extend(v.extend(w).to_array());
    }
    draw_space(&gpu, &mut encoder, &scene, &host);
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

/// What the host does without veduta: the Moon and the stars into its target.
fn draw_space(
    gpu: &veduta::device::Gpu,
    encoder: &mut wgpu::CommandEncoder,
    scene: &wgpu::TextureView,
    host: &[f32],
) {
    let device = &gpu.device;
    let module = device.create_shader_module(wgpu::include_wgsl!("earth_and_moon.wgsl"));
    let bytes: Vec<u8> = host.iter().flat_map(|n| n.to_le_bytes()).collect();
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("host"),
        size: bytes.len() as u64,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    gpu.queue.write_buffer(&buffer, 0, &bytes);
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("space"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("cover"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("space"),
            compilation_options: Default::default(),
            targets: &[Some(wgpu::TextureFormat::Rgba32Float.into())],
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
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: scene,
            depth_slice: None,
            resolve_target: None,
            ops: Default::default(),
        })],
        ..Default::default()
    });
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.draw(0..3, 0..1);
}

fn main() -> Fallible<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |at: usize, otherwise: f64| arguments.get(at).map_or(Ok(otherwise), |a| a.parse());
    let shot = Shot {
        altitude: number(1, 400.0)?,
        sun_height: number(2, -14.0)?,
        sun_azimuth: number(3, 20.0)?,
        fov: number(4, 40.0)?,
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
