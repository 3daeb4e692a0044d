//! The sky behind a host's scene and the air before it (rows A12 to A15, A18 and A19; for A16 see `tone_map`).

use veduta::atmosphere::{
    Eye, FastProbe, LightPlace, ProbeLight, ProbeRay, Sky, SkyComposition, SkyOptions, SkyQuality,
    SkyQuery,
};
use veduta::glam::camera::rh::proj::directx;
use veduta::glam::{DVec3, Mat4, Vec3, Vec4};
use veduta::landscape::{Depth, Projection};
use veduta::reference::parallel::parallel_map;
use veduta::reference::sky::{Sky as Truth, SkyRay};
use veduta::view::direction;
use veduta::{Atmosphere, Error, Light, Preset, Settings, Targets, View, WorldPos};

use crate::common::{Picture, Random, gpu};

const SIZE: [u32; 2] = [96, 54];
const PIXELS: usize = (SIZE[0] * SIZE[1]) as usize;
const FLOAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

fn targets(depth: Depth, projection: Projection) -> Targets {
    Targets {
        color_format: FLOAT,
        depth,
        projection,
        ..Default::default()
    }
}

fn sky_with(targets: &Targets, composition: SkyComposition, preset: Preset) -> Sky {
    let options = SkyOptions {
        preset,
        composition,
        ..Default::default()
    };
    Sky::new(&gpu().device, veduta::programs(), targets, &options).unwrap()
}

fn background(preset: Preset) -> Sky {
    sky_with(
        &targets(Depth::default(), Projection::default()),
        SkyComposition::Background,
        preset,
    )
}

/// Angles in degrees; the sun's azimuth and the view's are from -z.
fn looking(altitude: f64, [yaw, pitch, fov]: [f64; 3], [height, azimuth]: [f64; 2]) -> View {
    let mut view = View {
        eye: WorldPos::from_metres(DVec3::new(0.0, altitude, 0.0)),
        sun: Light {
            to_light: direction(height.to_radians(), azimuth.to_radians()).as_vec3(),
            ..Default::default()
        },
        ..Default::default()
    };
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    view.look(
        yaw.to_radians(),
        pitch.to_radians(),
        fov.to_radians() as f32,
        aspect,
    );
    view
}

fn texture(
    format: wgpu::TextureFormat,
    sample_count: u32,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    gpu().device.create_texture(&wgpu::TextureDescriptor {
        label: Some("sky test"),
        size: wgpu::Extent3d {
            width: SIZE[0],
            height: SIZE[1],
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}

fn view_of(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&Default::default())
}

fn upload(format: wgpu::TextureFormat, numbers: &[f32]) -> wgpu::TextureView {
    let texture = texture(
        format,
        1,
        wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
    );
    let bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
    gpu().queue.write_texture(
        texture.as_image_copy(),
        &bytes,
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(bytes.len() as u32 / SIZE[1]),
            rows_per_image: None,
        },
        texture.size(),
    );
    view_of(&texture)
}

/// A depth buffer that holds these numbers.
fn depth_buffer(numbers: &[f32]) -> wgpu::TextureView {
    let gpu = gpu();
    let source = upload(wgpu::TextureFormat::R32Float, numbers);
    let module = gpu
        .device
        .create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("depths"),
            source: wgpu::ShaderSource::Wgsl(
                "@group(0) @binding(0) var depths: texture_2d<f32>;
@vertex fn cover(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(select(-1.0, 3.0, i == 1u), select(-1.0, 3.0, i == 2u), 0.5, 1.0);
}
@fragment fn fill(@builtin(position) p: vec4<f32>) -> @builtin(frag_depth) f32 {
    return textureLoad(depths, vec2<i32>(p.xy), 0).r;
}"
                .into(),
            ),
        });
    let format = wgpu::TextureFormat::Depth32Float;
    let pipeline = gpu
        .device
        .create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("depths"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: None,
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Always),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: None,
                compilation_options: Default::default(),
                targets: &[],
            }),
            multiview_mask: None,
            cache: None,
        });
    let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("depths"),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[wgpu::BindGroupEntry {
            binding: 0,
            resource: wgpu::BindingResource::TextureView(&source),
        }],
    });
    let depth = view_of(&texture(
        format,
        1,
        wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::RENDER_ATTACHMENT,
    ));
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &depth,
                depth_ops: Some(wgpu::Operations::default()),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
    }
    gpu.queue.submit([encoder.finish()]);
    depth
}

fn floats(texture: &wgpu::Texture) -> Picture {
    let pixels = gpu()
        .read_texture(texture)
        .unwrap()
        .chunks_exact(16)
        .map(|p| [0, 4, 8, 12].map(|i| f32::from_le_bytes([p[i], p[i + 1], p[i + 2], p[i + 3]])))
        .collect();
    Picture {
        width: SIZE[0],
        pixels,
    }
}

/// Prepares and draws into as many targets as the composition has.
fn shoot_all(sky: &mut Sky, view: &View, count: usize) -> Vec<Picture> {
    let gpu = gpu();
    let out: Vec<wgpu::Texture> = (0..count)
        .map(|_| {
            texture(
                FLOAT,
                1,
                wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            )
        })
        .collect();
    let views: Vec<wgpu::TextureView> = out.iter().map(view_of).collect();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let _ = sky.prepare(&gpu.queue, &mut encoder, view).unwrap();
    {
        let attachments: Vec<_> = views
            .iter()
            .map(|view| {
                Some(wgpu::RenderPassColorAttachment {
                    view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations::default(),
                })
            })
            .collect();
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &attachments,
            ..Default::default()
        });
        let _ = sky.composite(&mut pass).unwrap();
    }
    gpu.queue.submit([encoder.finish()]);
    out.iter().map(floats).collect()
}

fn shoot(sky: &mut Sky, view: &View) -> Picture {
    shoot_all(sky, view, 1).remove(0)
}

fn quality(preset: &Preset) -> SkyQuality {
    SkyQuality::of(&Settings::resolve(veduta::programs(), preset, None, &[]).unwrap())
}

fn fast(preset: &Preset, all_orders: bool, rays: &[ProbeRay]) -> Vec<ProbeLight> {
    let gpu = gpu();
    let quality = SkyQuality {
        all_orders,
        ..quality(preset)
    };
    let air = Atmosphere::default();
    FastProbe::new(&gpu.device, veduta::programs(), &air, &quality, 0)
        .and_then(|mut p| p.run(&gpu.device, &gpu.queue, rays))
        .unwrap()
}

/// Clip coordinates of a pixel's middle.
fn clip_of(i: usize) -> [f64; 2] {
    let (x, y) = (i as u32 % SIZE[0], i as u32 / SIZE[0]);
    [
        (f64::from(x) + 0.5) / f64::from(SIZE[0]) * 2.0 - 1.0,
        1.0 - (f64::from(y) + 0.5) / f64::from(SIZE[1]) * 2.0,
    ]
}

/// The ray of a pixel of a perspective at the depth 1, in the world.
fn ray_of(view: &View, i: usize) -> DVec3 {
    let [middle, right, up] = view.rays().unwrap().map(|v| v.as_dvec3());
    let [x, y] = clip_of(i);
    middle + right * x + up * y
}

fn relative(a: f32, b: f32, floor: f32) -> f32 {
    (a - b).abs() / a.abs().max(b.abs()).max(floor)
}

/// The largest relative difference of two pictures, over the pixels that `keep` wants.
fn worst(a: &Picture, b: &Picture, floor: f32, keep: impl Fn(usize) -> bool) -> f32 {
    let mut worst = 0.0_f32;
    for (i, (p, q)) in a.pixels.iter().zip(&b.pixels).enumerate() {
        if keep(i) {
            for c in 0..3 {
                worst = worst.max(relative(p[c], q[c], floor));
            }
        }
    }
    worst
}

fn brightest(picture: &Picture) -> f32 {
    picture
        .pixels
        .iter()
        .flat_map(|p| &p[..3])
        .fold(0.0, |a, b| a.max(*b))
}

/// Matrices with a near plane and a far one for each convention.
fn matrix(depth: Depth, projection: Projection, near: f32, far: f32) -> Mat4 {
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    let (near, far) = match depth {
        Depth::Normal => (near, far),
        _ => (far, near),
    };
    match (projection, depth) {
        (Projection::Orthographic, _) => {
            directx::orthographic(-9e3 * aspect, 9e3 * aspect, -9e3, 9e3, near, far)
        }
        (_, Depth::ReversedInfinite) => directx::perspective_infinite_reverse(1.0, aspect, far),
        _ => directx::perspective(1.0, aspect, near, far),
    }
}

#[test]
fn air_before_things_is_that_of_the_probe_with_every_depth() {
    let random = &mut Random(4);
    let linear: Vec<f32> = (0..PIXELS)
        .map(|_| 60.0 * 1000_f32.powf(random.unit()))
        .collect();
    let colours: Vec<f32> = (0..4 * PIXELS).map(|_| random.between(0.0, 4.0)).collect();
    let picture = upload(FLOAT, &colours);
    let irradiance = View::default().sun.irradiance
        * Vec3::from_array(Atmosphere::default().sun.colour.map(|c| c as f32));
    for (depth, projection) in [
        (Depth::Normal, Projection::Perspective),
        (Depth::Reversed, Projection::Perspective),
        (Depth::ReversedInfinite, Projection::Perspective),
        (Depth::Normal, Projection::Orthographic),
        (Depth::Reversed, Projection::Orthographic),
        (Depth::ReversedInfinite, Projection::Orthographic),
    ] {
        let targets = targets(depth, projection);
        let parallel = projection == Projection::Orthographic;
        let mut view = looking(3000.0, [0.0, 8.0, 60.0], [22.0, 10.0]);
        view.projection = matrix(depth, projection, 20.0, 1e5);
        let clear = if depth == Depth::Normal { 1.0 } else { 0.0 };
        let depths: Vec<f32> = (0..PIXELS)
            .map(|i| {
                let clip = view.projection * Vec4::new(0.0, 0.0, -linear[i], 1.0);
                if i % 5 == 0 { clear } else { clip.z / clip.w }
            })
            .collect();
        let buffer = depth_buffer(&depths);
        let mut over = sky_with(&targets, SkyComposition::OverPicture, Preset::Medium);
        over.set_host(&gpu().device, &buffer, Some(&picture))
            .unwrap();
        let shown = shoot(&mut over, &view);
        assert_eq!(shown.not_finite(), 0);

        // The same with the depth in the picture's alpha (row A14).
        let greatest = 70_000.0;
        let with_alpha: Vec<f32> = (0..4 * PIXELS)
            .map(|k| match (k % 4, (k / 4) % 5) {
                (3, 0) => 1.0,
                (3, _) => linear[k / 4] / greatest,
                _ => colours[k],
            })
            .collect();
        let mut alpha = sky_with(
            &targets,
            SkyComposition::OverPictureWithAlpha,
            Preset::Medium,
        );
        let one_target = upload(FLOAT, &with_alpha);
        alpha
            .set_host_with_alpha(&gpu().device, &one_target, greatest)
            .unwrap();
        let difference = worst(&shoot(&mut alpha, &view), &shown, 1e-3, |_| true);
        println!("  depth in alpha {difference:.2e}");
        assert!(difference < 1e-3);

        // The point before which the air is, from the eye.
        let point = |i: usize| {
            if parallel {
                let [x, y] = clip_of(i);
                let half = view.projection.inverse();
                let at = DVec3::new(
                    x * f64::from(half.x_axis.x),
                    y * f64::from(half.y_axis.y),
                    -f64::from(linear[i]),
                );
                view.world_from_view.as_dmat4().transform_vector3(at)
            } else {
                ray_of(&view, i) * f64::from(linear[i])
            }
        };
        let kept: Vec<usize> = (0..PIXELS)
            .filter(|&i| i % 5 != 0 && point(i).y > -2500.0)
            .collect();
        let rays: Vec<ProbeRay> = kept
            .iter()
            .map(|&i| ProbeRay {
                altitude: 3000.0,
                dir: point(i).normalize().to_array(),
                to_sun: view.sun.to_light.as_dvec3().normalize().to_array(),
                distance: point(i).length(),
            })
            .collect();
        let found = fast(&Preset::Medium, true, &rays);
        let mut worst_before = 0.0_f32;
        for (&i, light) in kept.iter().zip(&found) {
            for c in 0..3 {
                let expected = colours[4 * i + c] * light.transmittance[c]
                    + light.in_scatter[c] * irradiance[c];
                worst_before = worst_before.max(relative(shown.pixels[i][c], expected, 1e-3));
            }
        }
        let mut sky = sky_with(&targets, SkyComposition::Background, Preset::Medium);
        let alone = shoot(&mut sky, &view);
        // Where nothing stands the host's picture shines through the air like stars (`space_transmittance`).
        let far: Vec<usize> = (0..PIXELS)
            .filter(|&i| i % 5 == 0 && point(i).y / point(i).length() > -0.02)
            .collect();
        let forward = view.world_from_view.transform_vector3(Vec3::NEG_Z);
        let rays: Vec<ProbeRay> = far
            .iter()
            .map(|&i| ProbeRay {
                altitude: 3000.0,
                dir: if parallel {
                    forward.as_dvec3().normalize().to_array()
                } else {
                    ray_of(&view, i).normalize().to_array()
                },
                to_sun: view.sun.to_light.as_dvec3().normalize().to_array(),
                distance: f64::INFINITY,
            })
            .collect();
        let mut clear_worst = 0.0_f32;
        for (&i, light) in far.iter().zip(&fast(&Preset::Medium, true, &rays)) {
            for c in 0..3 {
                let expected = alone.pixels[i][c] + colours[4 * i + c] * light.transmittance[c];
                clear_worst = clear_worst.max(relative(shown.pixels[i][c], expected, 1e-3));
            }
        }
        assert!(far.len() > 300);
        println!(
            "{depth:?} {projection:?}: {} pixels, worst {worst_before:.5}, sky {clear_worst:.6}",
            kept.len()
        );
        assert!(kept.len() > 1000);
        // The sky alone shares reads between neighbours, here a degree apart.
        assert!(worst_before < 0.01 && clear_worst < 0.01);

        if depth == Depth::Reversed || depth == Depth::ReversedInfinite && !parallel {
            let mut two = sky_with(&targets, SkyComposition::TwoTargets, Preset::Medium);
            two.set_host(&gpu().device, &buffer, None).unwrap();
            let layers = shoot_all(&mut two, &view, 2);
            let together = Picture {
                width: SIZE[0],
                pixels: (0..PIXELS)
                    .map(|i| {
                        [0, 1, 2, 3].map(|c| {
                            colours[4 * i + c] * layers[1].pixels[i][c] + layers[0].pixels[i][c]
                        })
                    })
                    .collect(),
            };
            let difference = worst(&together, &shown, 1e-3, |_| true);
            println!("  two targets {difference:.2e}");
            assert!(difference < 1e-5);
        }
    }
}

#[test]
fn things_below_the_ground_sphere_have_air_before_them() {
    // A white thing 5 km away, just above the level and 0.6 degrees below it, where the ground sphere is 190 m away, or none.
    let white = upload(FLOAT, &[1.0; 4 * PIXELS]);
    let targets = targets(Depth::ReversedInfinite, Projection::Perspective);
    let mut two = sky_with(&targets, SkyComposition::TwoTargets, Preset::High);
    for altitude in [0.0, 2.0] {
        let view = looking(altitude, [0.0, 0.0, 4.0], [30.0, 60.0]);
        let at = depth_buffer(&[0.1 / 5e3; PIXELS]);
        two.set_host(&gpu().device, &at, Some(&white)).unwrap();
        let layers = shoot_all(&mut two, &view, 2);
        let mut ends = [[f32::MAX; 3], [0.0_f32; 3]];
        for i in (0..PIXELS).filter(|&i| ray_of(&view, i).normalize().y.abs() < 0.011) {
            let [least, most] = &mut ends;
            for ((least, most), left) in least.iter_mut().zip(most).zip(layers[1].pixels[i]) {
                *least = least.min(left);
                *most = most.max(left);
            }
        }
        println!(
            "{altitude} m: transmittance from {:?} to {:?}",
            ends[0], ends[1]
        );
        assert!((0..3).all(|c| ends[1][c] - ends[0][c] < 0.01 && ends[1][c] < 0.98));
        let light = |y: usize| layers[0].pixels[y * SIZE[0] as usize + 48][2];
        let (above, below) = (light(24), light(30));
        assert!((above / below - 1.0).abs() < 0.03, "{above} {below}");
    }
}

#[test]
fn no_seam_between_far_black_things_and_the_sky() {
    let black = upload(FLOAT, &[0.0; 4 * PIXELS]);
    let targets = targets(Depth::ReversedInfinite, Projection::Perspective);
    let mut over = sky_with(&targets, SkyComposition::OverPicture, Preset::High);
    let mut sky = background(Preset::High);
    for (altitude, pitch, sun) in [
        (2.0, 20.0, [35.0, 100.0]),
        (2.0, 20.0, [3.0, 100.0]),
        (10_000.0, 10.0, [20.0, 60.0]),
        (99_999.0, -5.0, [20.0, 60.0]),
        (400_000.0, -15.0, [20.0, 60.0]),
    ] {
        let view = looking(altitude, [0.0, pitch, 60.0], sun);
        // Farther than the air is deep.
        let far = depth_buffer(&[0.1 / 5e6; PIXELS]);
        over.set_host(&gpu().device, &far, Some(&black)).unwrap();
        let things = shoot(&mut over, &view);
        let alone = shoot(&mut sky, &view);
        let floor = 1e-3 * brightest(&alone);
        let r = Atmosphere::default().planet_radius;
        let horizon = -(1.0 - (r / (r + altitude)).powi(2)).sqrt();
        // Two neighbours share what they read of the sky, so that the edge of the ground is sharp to two.
        let seam = worst(&things, &alone, floor, |i| {
            [i, i ^ 1]
                .iter()
                .all(|&i| ray_of(&view, i).normalize().y > horizon)
        });
        println!("{altitude} m: {seam:.5}");
        assert!(seam < 0.02, "{altitude} m: {seam}");
    }
}

#[test]
fn crossing_the_top_of_the_air_changes_no_pixel() {
    let mut sky = background(Preset::High);
    for (pitch, sun) in [
        (-12.0, [40.0, 30.0]),
        (-12.0, [3.0, 20.0]),
        (-60.0, [20.0, 90.0]),
    ] {
        let mut at = |altitude: f64| shoot(&mut sky, &looking(altitude, [0.0, pitch, 50.0], sun));
        let below = at(99_999.0);
        let above = at(100_001.0);
        let floor = 0.01 * brightest(&below);
        let metre = worst(&below, &above, floor, |_| true);
        let (low, lower) = (at(99_900.0), at(99_700.0));
        let (high, higher) = (at(100_100.0), at(100_300.0));
        let across = worst(&low, &high, floor, |_| true);
        let place = (0..PIXELS)
            .max_by(|&a, &b| {
                let only = |i| worst(&below, &above, floor, |k| k == i);
                only(a).total_cmp(&only(b))
            })
            .unwrap();
        println!(
            "  worst pixel {place}: {:?} below, {:?} above",
            below.pixels[place], above.pixels[place]
        );
        let beside =
            worst(&lower, &low, floor, |_| true).max(worst(&high, &higher, floor, |_| true));
        println!(
            "pitch {pitch}, sun {sun:?}: 2 m {metre:.5}, 200 m {across:.5}, beside {beside:.5}"
        );
        // The limb has other rows within the air than above it; a pixel at the horizon comes near the bar of row A12.
        assert!(metre < 0.01 && across < 0.01 + beside);
    }
}

#[test]
fn rays_that_miss_the_air_leave_the_picture_as_it_is() {
    let random = &mut Random(9);
    let colours: Vec<f32> = (0..4 * PIXELS).map(|_| random.between(0.0, 4.0)).collect();
    let picture = upload(FLOAT, &colours);
    let depths: Vec<f32> = (0..PIXELS)
        .map(|i| if i % 2 == 0 { 1e-3 } else { 0.0 })
        .collect();
    let depth = depth_buffer(&depths);
    let targets = targets(Depth::ReversedInfinite, Projection::Perspective);
    let mut over = sky_with(&targets, SkyComposition::OverPicture, Preset::Low);
    over.set_host(&gpu().device, &depth, Some(&picture))
        .unwrap();
    let mut sky = background(Preset::Low);
    let air = Atmosphere::default();
    for altitude in [101_000.0, 4e5, 3.6e7] {
        let dip = (air.planet_radius / (air.planet_radius + altitude)).acos();
        let view = looking(altitude, [0.0, -dip.to_degrees(), 40.0], [30.0, 180.0]);
        let (over, alone) = (shoot(&mut over, &view), shoot(&mut sky, &view));
        let (mut missed, mut lit) = (0, 0);
        for i in 0..PIXELS {
            let dir = ray_of(&view, i).normalize();
            let lowest =
                (air.planet_radius + altitude) * (1.0 - dir.y * dir.y).sqrt() - air.planet_radius;
            if dir.y > 0.0 || lowest > air.thickness + 100.0 {
                missed += 1;
                assert_eq!(over.pixels[i][..3], colours[4 * i..4 * i + 3], "{i}");
                assert_eq!(alone.pixels[i][..3], [0.0; 3], "{i}");
            } else if lowest < 0.5 * air.thickness {
                lit += usize::from(alone.pixels[i][2] > 0.0);
            }
        }
        println!("{altitude} m: {missed} miss, {lit} lit");
        assert!(missed > 1000 && lit > 50);
    }
}

#[test]
fn from_orbit_there_is_a_limb_and_a_terminator() {
    let mut sky = background(Preset::Medium);
    // The sun stands at the right, in the horizon of the place below.
    let view = looking(2e7, [0.0, -90.0, 50.0], [0.0, 90.0]);
    let picture = shoot(&mut sky, &view);
    assert_eq!(picture.not_finite(), 0);
    let row = |x: usize| picture.pixels[96 * 27 + x];
    let columns: Vec<String> = (0..96)
        .step_by(6)
        .map(|x| format!("{:.3}", row(x)[2]))
        .collect();
    println!("{columns:?}");
    // Space, day, night, space.
    assert!(row(1)[2] == 0.0 && row(94)[2] == 0.0);
    let radius = (6.36e6_f64 / 2.636e7).asin().tan() / 25_f64.to_radians().tan() * 27.0;
    let at = |share: f64| row((48.0 + share * radius) as usize)[2];
    println!("{radius:.1}: {:.4} {:.4} {:.6}", at(0.9), at(0.3), at(-0.5));
    assert!(at(0.9) > 0.1 && at(0.3) > 0.02 && at(-0.5) < 1e-3 * at(0.3));
    // The limb is bluer than what lies within.
    let limb = looking(4e5, [0.0, -18.6, 4.0], [40.0, 120.0]);
    let picture = shoot(&mut sky, &limb);
    let column: Vec<[f32; 4]> = (0..54).map(|y| picture.pixels[96 * y + 48]).collect();
    let blue = |p: &[f32; 4]| p[2] / p[0].max(1e-9);
    let edge = column.iter().position(|p| p[2] > 0.05).unwrap();
    println!(
        "edge at {edge}: {:?}, bottom {:?}",
        column[edge], column[53]
    );
    assert!(edge > 2 && edge < 50 && blue(&column[edge]) > 1.5 * blue(&column[53]));
}

/// The integral of the sun's disc over a picture, without the sky about it, over the sun's irradiance.
fn disc_of(picture: &Picture, view: &View) -> [f64; 3] {
    let [middle, right, up] = view.rays().unwrap().map(|v| v.as_dvec3());
    let area = 4.0 * right.length() * up.length() / PIXELS as f64;
    let to_sun = view.sun.to_light.as_dvec3();
    let mut near: Vec<(f64, usize, f64)> = (0..PIXELS)
        .map(|i| {
            let ray = ray_of(view, i);
            (
                ray.normalize().distance(to_sun),
                i,
                area / ray.length().powi(3),
            )
        })
        .collect();
    assert!((middle.length() - 1.0).abs() < 1e-5);
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    let pixel = area.sqrt();
    let reach = f64::from(view.sun.angular_radius) + 2.0 * pixel;
    let ring: Vec<usize> = near
        .iter()
        .filter(|(angle, ..)| *angle > reach && *angle < reach + 2.0 * pixel)
        .map(|n| n.1)
        .collect();
    assert!(ring.len() > 8);
    [0, 1, 2].map(|c| {
        let around: f64 = ring
            .iter()
            .map(|&i| f64::from(picture.pixels[i][c]))
            .sum::<f64>()
            / ring.len() as f64;
        near.iter()
            .filter(|n| n.0 <= reach)
            .map(|n| (f64::from(picture.pixels[n.1][c]) - around) * n.2)
            .sum::<f64>()
            / f64::from(view.sun.irradiance[c])
    })
}

#[test]
fn the_suns_disc_keeps_its_irradiance_at_every_size() {
    let mut sky = background(Preset::High);
    for altitude in [2.0, 10_000.0, 100_000.0, 4e5] {
        for height in [5.0, 30.0, 70.0] {
            let to_sun = direction(f64::to_radians(height), 0.3);
            let ray = ProbeRay {
                altitude,
                dir: to_sun.to_array(),
                to_sun: to_sun.to_array(),
                distance: f64::INFINITY,
            };
            let through = fast(&Preset::High, true, &[ray])[0].transmittance;
            for fov in [2.0, 12.0, 60.0] {
                let yaw = 0.3_f64.to_degrees() + 0.13 * fov;
                let view = looking(
                    altitude,
                    [yaw, height + 0.071 * fov, fov],
                    [height, 0.3_f64.to_degrees()],
                );
                let found = disc_of(&shoot(&mut sky, &view), &view);
                let off = [0, 1, 2].map(|c| found[c] / f64::from(through[c]) - 1.0);
                println!("{altitude} m, sun {height}, fov {fov}: {off:.4?}");
                assert!(off.iter().all(|o| o.abs() < 0.03));
            }
        }
    }
    // Nor does it flicker while it wanders over pixels larger than itself.
    let mut seen = Vec::new();
    for step in 0..24 {
        let yaw = 17.19 + 0.113 * f64::from(step);
        let view = looking(
            2.0,
            [yaw, 33.0 + 0.031 * f64::from(step), 60.0],
            [30.0, 17.19],
        );
        seen.push(disc_of(&shoot(&mut sky, &view), &view)[1]);
    }
    let mean = seen.iter().sum::<f64>() / seen.len() as f64;
    let most = seen
        .iter()
        .map(|s| (s / mean - 1.0).abs())
        .fold(0.0, f64::max);
    println!("a wandering disc: mean {mean:.4}, {most:.4} off at most");
    assert!(most < 0.01);
    // Below the horizon there is none, neither from the ground nor from orbit.
    for (altitude, height) in [(2.0, -2.0), (4e5, -25.0)] {
        let view = looking(altitude, [0.0, height, 10.0], [height, 0.0]);
        let high = brightest(&shoot(&mut sky, &view));
        assert!(high < 20.0, "{altitude} m: {high}");
    }
    // Just above the limb from orbit, there is.
    let view = looking(4e5, [0.0, -15.0, 10.0], [-15.0, 0.0]);
    assert!(brightest(&shoot(&mut sky, &view)) > 1e4);
}

#[test]
fn four_samples_draw_the_same_sky_and_the_hosts_depth_stands() {
    let gpu = gpu();
    let format = wgpu::TextureFormat::Rgba16Float;
    let view = looking(2.0, [0.0, 15.0, 60.0], [40.0, 120.0]);
    let mut pictures = Vec::new();
    for sample_count in [1, 4] {
        let targets = Targets {
            color_format: format,
            sample_count,
            ..Default::default()
        };
        let mut sky = sky_with(&targets, SkyComposition::Background, Preset::Low);
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let many = view_of(&texture(format, sample_count, usage));
        let one = texture(format, 1, usage | wgpu::TextureUsages::COPY_SRC);
        let one_view = view_of(&one);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let _ = sky.prepare(&gpu.queue, &mut encoder, &view).unwrap();
        {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: if sample_count == 1 { &one_view } else { &many },
                    depth_slice: None,
                    resolve_target: (sample_count > 1).then_some(&one_view),
                    ops: wgpu::Operations::default(),
                })],
                ..Default::default()
            });
            let _ = sky.composite(&mut pass).unwrap();
        }
        gpu.queue.submit([encoder.finish()]);
        pictures.push(gpu.read_texture(&one).unwrap());
    }
    // Of halves, neighbours in bits are neighbours in value.
    let half = |b: &[u8]| i32::from(u16::from_le_bytes([b[0], b[1]]));
    let off = pictures[0]
        .chunks(2)
        .zip(pictures[1].chunks(2))
        .map(|(a, b)| (half(a) - half(b)).abs())
        .max();
    println!("{off:?} steps of a half");
    assert!(off <= Some(4));

    for depth in [Depth::Normal, Depth::ReversedInfinite] {
        let clear = if depth == Depth::Normal { 1.0 } else { 0.0 };
        let depths: Vec<f32> = (0..PIXELS)
            .map(|i| if i % 3 == 0 { 0.5 } else { clear })
            .collect();
        let buffer = depth_buffer(&depths);
        let targets = Targets {
            depth_format: Some(wgpu::TextureFormat::Depth32Float),
            ..targets(depth, Projection::Perspective)
        };
        let mut sky = sky_with(&targets, SkyComposition::Background, Preset::Low);
        // Towards the sun, so that its disc is drawn too.
        let view = looking(2.0, [120.0, 30.0, 60.0], [30.0, 120.0]);
        let out = texture(
            FLOAT,
            1,
            wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        );
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let _ = sky.prepare(&gpu.queue, &mut encoder, &view).unwrap();
        {
            let host = wgpu::Color {
                r: 7.0,
                g: 8.0,
                b: 9.0,
                a: 1.0,
            };
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &view_of(&out),
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(host),
                        store: wgpu::StoreOp::Store,
                    },
                })],
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &buffer,
                    depth_ops: Some(wgpu::Operations {
                        load: wgpu::LoadOp::Load,
                        store: wgpu::StoreOp::Store,
                    }),
                    stencil_ops: None,
                }),
                ..Default::default()
            });
            let work = sky.composite(&mut pass).unwrap();
            assert_eq!(work.draws, 2);
        }
        gpu.queue.submit([encoder.finish()]);
        let picture = floats(&out);
        for (i, pixel) in picture.pixels.iter().enumerate() {
            assert_eq!(pixel[..3] == [7.0, 8.0, 9.0], i % 3 == 0, "{i} {pixel:?}");
        }
        assert!(brightest(&picture) > 1000.0, "the disc shows");
    }
}

#[test]
fn a_still_frame_makes_nothing_anew() {
    let gpu = gpu();
    let mut sky = background(Preset::Low);
    let mut work = |view: &View| {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let work = sky.prepare(&gpu.queue, &mut encoder, view).unwrap();
        gpu.queue.submit([encoder.finish()]);
        (work.bakes, work.dispatches, work.writes)
    };
    let view = looking(100.0, [0.0, 10.0, 60.0], [30.0, 40.0]);
    assert_eq!(
        work(&view),
        (7, 7, 4),
        "the air's four tables, the eye's sky and the columns and rows between its own"
    );
    assert_eq!(work(&view), (0, 0, 0), "still");
    let turned = looking(100.0, [70.0, -20.0, 40.0], [30.0, 40.0]);
    assert_eq!(work(&turned), (0, 0, 1), "turned");
    let mut moved = turned;
    moved.eye = WorldPos::from_metres(DVec3::new(5e6, 100.0, -3e7));
    assert_eq!(work(&moved), (0, 0, 0), "elsewhere at this altitude");
    let later = looking(100.0, [70.0, -20.0, 40.0], [31.0, 40.0]);
    let (bakes, dispatches, writes) = work(&later);
    assert_eq!((bakes, dispatches), (3, 3), "another sun");
    assert!(writes <= 3);
    let higher = looking(200.0, [70.0, -20.0, 40.0], [31.0, 40.0]);
    assert_eq!(work(&higher).0, 3, "another altitude");
}

#[test]
fn what_the_view_does_not_show_is_not_drawn() {
    let gpu = gpu();
    let mut sky = background(Preset::Low);
    let mut draws = |view: &View| {
        let texture = texture(FLOAT, 1, wgpu::TextureUsages::RENDER_ATTACHMENT);
        let target = view_of(&texture);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let _ = sky.prepare(&gpu.queue, &mut encoder, view).unwrap();
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &target,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations::default(),
            })],
            ..Default::default()
        });
        sky.composite(&mut pass).unwrap().draws
    };
    // From the ground: sun in view, behind, set.
    assert_eq!(draws(&looking(2.0, [0.0, 20.0, 50.0], [20.0, 10.0])), 2);
    assert_eq!(draws(&looking(2.0, [0.0, 20.0, 50.0], [20.0, 180.0])), 1);
    assert_eq!(draws(&looking(2.0, [0.0, 0.0, 50.0], [-3.0, 0.0])), 1);
    // From space: away from the planet with the sun behind and before, and at its limb.
    let mut fresh = background(Preset::Low);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut prepared = |yaw: f64, pitch: f64| {
        let view = looking(2e7, [yaw, pitch, 50.0], [20.0, 180.0]);
        fresh
            .prepare(&gpu.queue, &mut encoder, &view)
            .unwrap()
            .bakes
    };
    // No table is made for a view without air, and all are once it shows.
    assert_eq!(prepared(0.0, 40.0), 0);
    assert!(prepared(0.0, -60.0) > 3);
    assert_eq!(prepared(10.0, -60.0), 0);
    assert_eq!(draws(&looking(2e7, [0.0, 40.0, 50.0], [20.0, 180.0])), 0);
    assert_eq!(draws(&looking(2e7, [0.0, 40.0, 50.0], [40.0, 0.0])), 1);
    assert_eq!(draws(&looking(2e7, [0.0, -60.0, 50.0], [40.0, 0.0])), 1);
}

#[test]
fn tables_take_at_most_four_mebibytes() {
    let targets = targets(Depth::default(), Projection::default());
    for (preset, most) in [
        (Preset::High, 4.0),
        (Preset::Medium, 2.0),
        (Preset::Low, 1.0),
    ] {
        for composition in [SkyComposition::Background, SkyComposition::OverPicture] {
            let sky = sky_with(&targets, composition, preset.clone());
            let mib = sky.resources().texture_bytes as f64 / f64::from(1 << 20);
            println!("{preset:?} {composition:?}: {mib:.2} MiB");
            assert!(mib > 0.0 && mib <= most);
        }
    }
}

#[test]
fn a_flight_from_the_ground_to_geostationary_orbit_has_no_pop() {
    let mut sky = background(Preset::Medium);
    let radius = Atmosphere::default().planet_radius;
    let steps = 200;
    let mut last: Option<Picture> = None;
    let mut changes: Vec<[f32; 2]> = Vec::new();
    for step in 0..=steps {
        let altitude = 2.0 * 1.8e7_f64.powf(f64::from(step) / f64::from(steps));
        let dip = (radius / (radius + altitude)).acos().to_degrees();
        // The horizon stays where it is; the sun is behind.
        let picture = shoot(
            &mut sky,
            &looking(altitude, [0.0, -dip, 40.0], [35.0, 150.0]),
        );
        assert_eq!(picture.not_finite(), 0, "{altitude} m");
        if let Some(last) = &last {
            let level = brightest(last);
            let (mut sum, mut most) = (0.0, 0.0_f32);
            for (p, q) in picture.pixels.iter().zip(&last.pixels) {
                for c in 0..3 {
                    let change = (p[c] - q[c]).abs() / level;
                    sum += change;
                    most = most.max(change);
                }
            }
            changes.push([sum / (3 * PIXELS) as f32, most]);
        }
        last = Some(picture);
    }
    let mut pops = Vec::new();
    for i in 2..changes.len() - 2 {
        for (kind, floor) in [(0, 0.001), (1, 0.01)] {
            let beside = [i - 2, i - 1, i + 1, i + 2].map(|k| changes[k][kind]);
            let most = beside.iter().fold(0.0_f32, |a, b| a.max(*b));
            if changes[i][kind] > 1.5 * most + floor {
                let altitude = 2.0 * 1.8e7_f64.powf((i + 1) as f64 / f64::from(steps));
                pops.push((altitude, kind, changes[i][kind], most));
            }
        }
    }
    let greatest = [0, 1].map(|k| changes.iter().fold(0.0_f32, |a, b| a.max(b[k])));
    println!(
        "greatest change of a step: mean {:.4}, pixel {:.4}",
        greatest[0], greatest[1]
    );
    assert!(pops.is_empty(), "{pops:?}");
    assert!(greatest[0] < 0.05);
}

#[test]
fn another_planet_needs_no_other_code() {
    let mut air = Atmosphere::named("mars").unwrap();
    air.planet_radius = 4.2e6;
    air.thickness = 7.5e4;
    air.layers.truncate(2);
    for layer in &mut air.layers {
        layer.scattering = [3.1e-5, 1.2e-5, 0.4e-5];
    }
    let options = SkyOptions {
        preset: Preset::Low,
        atmosphere: air,
        ..Default::default()
    };
    let targets = targets(Depth::default(), Projection::default());
    let mut sky = Sky::new(&gpu().device, veduta::programs(), &targets, &options).unwrap();
    for altitude in [2.0, 7.5e4, 5e5] {
        let view = looking(altitude, [0.0, -20.0, 90.0], [30.0, 180.0]);
        let picture = shoot(&mut sky, &view);
        assert_eq!(picture.not_finite(), 0);
        let mean = picture.mean(|_, _| true);
        println!("{altitude} m: {mean:.3?}");
        assert!(mean[0] > mean[2] && mean[2] > 0.0, "a red sky: {mean:?}");
    }
}

/// Row A18 by numbers: light scattered once over planets of other sizes, against quadrature.
#[test]
fn the_air_of_planets_of_all_sizes_meets_quadrature() {
    for (radius, thickness, bar) in [
        (5e5, 1e5, 0.03),
        (2e6, 4e5, 0.03),
        (7e7, 1e5, 0.04),
        (1e9, 2e5, 0.08),
    ] {
        let mut air = Atmosphere::named("thesis").unwrap();
        air.planet_radius = radius;
        air.thickness = thickness;
        let truth = Truth::new(&air).unwrap();
        let mut rays = Vec::new();
        for altitude in [2.0, 0.05 * thickness, 3.0 * thickness] {
            let dip = (radius / (radius + altitude)).acos();
            for elevation in [0.02, 0.3, 1.2] {
                for sun in [0.05, 0.6, 1.3] {
                    rays.push(ProbeRay {
                        altitude,
                        dir: direction(elevation - dip * f64::from(altitude > 3.0), 0.7).to_array(),
                        to_sun: direction(sun, 0.0).to_array(),
                        distance: f64::INFINITY,
                    });
                }
            }
        }
        let quality = SkyQuality {
            all_orders: false,
            ..quality(&Preset::High)
        };
        let found = FastProbe::new(&gpu().device, veduta::programs(), &air, &quality, 0)
            .and_then(|mut p| p.run(&gpu().device, &gpu().queue, &rays))
            .unwrap();
        let mut worst = 0.0_f64;
        for (ray, found) in rays.iter().zip(&found) {
            let light = truth.single_scatter(
                &SkyRay {
                    eye_altitude: ray.altitude,
                    dir: ray.dir,
                    to_sun: ray.to_sun,
                    distance: ray.distance,
                },
                1e-6,
            );
            for c in 0..3 {
                let off = f64::from(found.in_scatter[c]) - light.in_scatter[c];
                let off = off.abs() / light.in_scatter[c].max(1e-6);
                worst = worst.max(off);
            }
        }
        println!("{radius:.0e} m: {:.2} %", 100.0 * worst);
        assert!(worst < bar);
    }
}

/// Row A15: the ground that a picture shows is that of its albedo under sun and sky, behind the air before it.
#[test]
fn the_bare_ground_reflects_sun_and_sky() {
    let gpu = gpu();
    let air = Atmosphere {
        ground_albedo: [0.6, 0.4, 0.2],
        ..Default::default()
    };
    let options = SkyOptions {
        atmosphere: air.clone(),
        ..Default::default()
    };
    let targets = targets(Depth::default(), Projection::default());
    let mut sky = Sky::new(&gpu.device, veduta::programs(), &targets, &options).unwrap();
    let query = SkyQuery::new(&gpu.device, veduta::programs(), &air).unwrap();
    let irradiance =
        View::default().sun.irradiance * Vec3::from_array(air.sun.colour.map(|c| c as f32));
    for (altitude, height) in [(500.0, 60.0), (500.0, 12.0), (8e3, 30.0), (9e4, 50.0)] {
        let view = looking(altitude, [200.0, -60.0, 30.0], [height, 0.0]);
        let shown = shoot(&mut sky, &view);
        let to_sun = view.sun.to_light.as_dvec3().normalize().to_array();
        // The sun stands as high over what is seen to a hundredth of a degree.
        let place = LightPlace {
            altitude: 0.0,
            to_sun,
            normal: [0.0, 1.0, 0.0],
            sun_angular_radius: 0.0,
        };
        let light = query
            .run(&gpu.device, &gpu.queue, sky.tables_mut(), &[place])
            .unwrap()[0];
        let picked: Vec<usize> = (0..PIXELS).step_by(211).collect();
        let rays: Vec<ProbeRay> = picked
            .iter()
            .map(|&i| ProbeRay {
                altitude,
                dir: ray_of(&view, i).normalize().to_array(),
                to_sun,
                distance: f64::INFINITY,
            })
            .collect();
        let quality = SkyQuality::finest();
        let before = FastProbe::new(&gpu.device, veduta::programs(), &air, &quality, 0)
            .and_then(|mut p| p.run(&gpu.device, &gpu.queue, &rays))
            .unwrap();
        let mut worst = 0.0_f32;
        for (&i, before) in picked.iter().zip(&before) {
            for c in 0..3 {
                let lit = air.ground_albedo[c] as f32 * std::f32::consts::FRAC_1_PI;
                let expected = before.in_scatter[c]
                    + before.transmittance[c]
                        * lit
                        * (light.sun[c] * to_sun[1] as f32 + light.sky[c]);
                let found = shown.pixels[i][c] / irradiance[c];
                let off = relative(found, expected, 1e-6);
                worst = worst.max(off);
            }
        }
        println!("{altitude} m, sun at {height}: {:.2} %", 100.0 * worst);
        assert!(worst < 0.03);
    }
}

/// The penumbra of a large sun is the mean of those of its parts.
#[test]
fn a_wide_sun_lights_the_air_as_its_parts_do() {
    let radius = 0.004_67_f64;
    let mut sky = background(Preset::High);
    let mut seen = |height: f64, azimuth: f64, radius: f64| {
        let mut view = looking(2.0, [160.0, 25.0, 60.0], [height, azimuth]);
        view.sun.angular_radius = radius as f32;
        shoot(&mut sky, &view)
    };
    for height in [0.3, 0.0, -0.3, -1.0, -3.0] {
        let wide = seen(height, 0.0, radius);
        let mut parts = vec![[0.0_f32; 3]; PIXELS];
        let mut count = 0.0;
        for ring in 0..4 {
            let r = radius.to_degrees() * ((f64::from(ring) + 0.5) / 4.0).sqrt();
            for spoke in 0..8 {
                let angle =
                    std::f64::consts::TAU * (f64::from(spoke) + 0.5 * f64::from(ring % 2)) / 8.0;
                let part = seen(height + r * angle.sin(), r * angle.cos(), 1e-4);
                for (sum, p) in parts.iter_mut().zip(&part.pixels) {
                    for c in 0..3 {
                        sum[c] += p[c];
                    }
                }
                count += 1.0;
            }
        }
        let mut off: Vec<f32> = wide
            .pixels
            .iter()
            .zip(&parts)
            .flat_map(|(w, p)| (0..3).map(move |c| relative(w[c], p[c] / count, 1e-9)))
            .collect();
        off.sort_by(f32::total_cmp);
        let at = |share: f32| off[(share * (off.len() - 1) as f32) as usize];
        println!(
            "sun at {height}: median {:.2} %, 99th centile {:.2} %",
            100.0 * at(0.5),
            100.0 * at(0.99)
        );
        assert!(at(0.5) < 0.015 && at(0.99) < 0.06);
    }
}

#[test]
fn light_at_a_place_is_that_of_sun_and_sky() {
    let gpu = gpu();
    let air = Atmosphere::default();
    let mut sky = background(Preset::High);
    let query = SkyQuery::new(&gpu.device, veduta::programs(), &air).unwrap();
    let mut ask =
        |places: &[LightPlace]| query.run(&gpu.device, &gpu.queue, sky.tables_mut(), places);
    for (altitude, height) in [(0.0, 90.0), (0.0, 50.0), (2000.0, 20.0), (4000.0, 60.0)] {
        let to_sun = direction(f64::to_radians(height), 0.4).to_array();
        let place = LightPlace {
            altitude,
            to_sun,
            normal: [0.0, 1.0, 0.0],
            sun_angular_radius: 0.0,
        };
        let light = ask(&[place]).unwrap()[0];
        let along = ProbeRay {
            altitude,
            dir: to_sun,
            to_sun,
            distance: f64::INFINITY,
        };
        let through = fast(&Preset::High, true, &[along])[0].transmittance;
        // The sky's light on the plane, summed over rings of equal shares of it.
        let (rings, spokes) = (120, 120);
        let rays: Vec<ProbeRay> = (0..rings * spokes)
            .map(|k| {
                let sine = ((f64::from(k / spokes) + 0.5) / f64::from(rings)).sqrt();
                let angle =
                    std::f64::consts::TAU * (f64::from(k % spokes) + 0.5) / f64::from(spokes);
                let dir = [
                    sine * angle.cos(),
                    (1.0 - sine * sine).sqrt(),
                    sine * angle.sin(),
                ];
                ProbeRay { dir, ..along }
            })
            .collect();
        let seen = fast(&Preset::High, true, &rays);
        for (c, through) in through.into_iter().enumerate() {
            let sun = light.sun[c] / through - 1.0;
            let sum: f32 = seen.iter().map(|l| l.in_scatter[c]).sum();
            let truth = sum * std::f32::consts::PI / seen.len() as f32;
            let off = light.sky[c] / truth - 1.0;
            println!("{altitude} m, sun {height}, channel {c}: sun {sun:.4}, sky {off:.4}");
            assert!(sun.abs() < 0.01 && off.abs() < 0.02);
        }
        // A white Lambert plane: less than its albedo, by what the air lets through.
        if height == 90.0 {
            println!(
                "white plane at noon: {:?}",
                light.sun.map(|e| e / std::f32::consts::PI)
            );
            assert!(light.sun[0] > light.sun[1] && light.sun[1] > light.sun[2]);
            assert!(light.sun[0] < 0.96 && light.sun[2] > 0.5);
        }
    }
    let night = LightPlace {
        altitude: 0.0,
        to_sun: direction(-0.3, 0.0).to_array(),
        normal: [0.0, 1.0, 0.0],
        sun_angular_radius: 0.00467,
    };
    assert_eq!(ask(&[night]).unwrap()[0].sun, [0.0; 3]);
    assert!(ask(&[]).unwrap().is_empty());
    for (bad, name) in [
        (
            LightPlace {
                altitude: f64::NAN,
                ..night
            },
            "places[1].altitude",
        ),
        (
            LightPlace {
                altitude: 2e5,
                ..night
            },
            "places[1].altitude",
        ),
        (
            LightPlace {
                to_sun: [0.0; 3],
                ..night
            },
            "places[1].to_sun",
        ),
        (
            LightPlace {
                normal: [0.0, f64::NAN, 0.0],
                ..night
            },
            "places[1].normal",
        ),
        (
            LightPlace {
                sun_angular_radius: 1.0,
                ..night
            },
            "places[1].sun_angular_radius",
        ),
    ] {
        let error = ask(&[night, bad]).unwrap_err();
        assert!(
            matches!(&error, Error::OutOfDomain { name: n, .. } if n == name),
            "{error}"
        );
    }
}

#[test]
fn faults_have_names() {
    let gpu = gpu();
    let new = |targets: &Targets, composition| {
        let options = SkyOptions {
            preset: Preset::Low,
            composition,
            ..Default::default()
        };
        Sky::new(&gpu.device, veduta::programs(), targets, &options)
    };
    let named = |error: Error, name: &str| {
        println!("{error}");
        assert!(
            matches!(&error, Error::OutOfDomain { name: n, .. } if n == name),
            "{error}"
        );
    };
    let plain = targets(Depth::default(), Projection::default());
    let samples = Targets {
        sample_count: 4,
        ..plain
    };
    named(
        new(&samples, SkyComposition::OverPicture).unwrap_err(),
        "targets.sample_count",
    );
    named(
        new(&samples, SkyComposition::TwoTargets).unwrap_err(),
        "targets.sample_count",
    );
    for format in [
        wgpu::TextureFormat::Rgba8Uint,
        wgpu::TextureFormat::Depth32Float,
    ] {
        let wrong = Targets {
            color_format: format,
            ..plain
        };
        named(
            new(&wrong, SkyComposition::Background).unwrap_err(),
            "targets.color_format",
        );
    }
    let display = Targets {
        color_format: wgpu::TextureFormat::Rgba8Unorm,
        ..plain
    };
    named(
        new(&display, SkyComposition::TwoTargets).unwrap_err(),
        "targets.color_format",
    );

    let depth = depth_buffer(&[0.0; PIXELS]);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut over = new(&plain, SkyComposition::OverPicture).unwrap();
    named(
        over.set_host(&gpu.device, &depth, None).unwrap_err(),
        "picture",
    );
    let out = view_of(&texture(FLOAT, 1, wgpu::TextureUsages::RENDER_ATTACHMENT));
    {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &out,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations::default(),
            })],
            ..Default::default()
        });
        named(over.composite(&mut pass).unwrap_err(), "host");
    }
    let normal = View {
        projection: matrix(Depth::Normal, Projection::Perspective, 1.0, 1e5),
        ..Default::default()
    };
    named(
        over.prepare(&gpu.queue, &mut encoder, &normal).unwrap_err(),
        "view.projection",
    );
    let parallel = View {
        projection: matrix(Depth::Reversed, Projection::Orthographic, 1.0, 1e5),
        ..Default::default()
    };
    named(
        over.prepare(&gpu.queue, &mut encoder, &parallel)
            .unwrap_err(),
        "view.projection",
    );

    // Pictures of the wrong kind.
    let binding = wgpu::TextureUsages::TEXTURE_BINDING;
    let colour = view_of(&texture(FLOAT, 1, binding));
    for wrong in [
        colour.clone(),
        view_of(&texture(
            wgpu::TextureFormat::Depth32Float,
            1,
            wgpu::TextureUsages::RENDER_ATTACHMENT,
        )),
    ] {
        named(
            over.set_host(&gpu.device, &wrong, Some(&colour))
                .unwrap_err(),
            "depth",
        );
    }
    let integers = view_of(&texture(wgpu::TextureFormat::Rgba32Uint, 1, binding));
    for wrong in [&depth, &integers] {
        named(
            over.set_host(&gpu.device, &depth, Some(wrong)).unwrap_err(),
            "picture",
        );
    }
    let small = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d {
            width: 8,
            height: 8,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: FLOAT,
        usage: binding,
        view_formats: &[],
    });
    named(
        over.set_host(&gpu.device, &depth, Some(&view_of(&small)))
            .unwrap_err(),
        "picture",
    );
    over.set_host(&gpu.device, &depth, Some(&colour)).unwrap();

    // The textbook path.
    let march = |counts, composition| {
        let options = SkyOptions {
            preset: Preset::Low,
            composition,
            march: Some(counts),
            ..Default::default()
        };
        Sky::new(&gpu.device, veduta::programs(), &plain, &options)
    };
    for (counts, composition) in [
        ([0, 4], SkyComposition::Background),
        ([4, 65], SkyComposition::Background),
        ([512, 64], SkyComposition::Background),
        ([4, 4], SkyComposition::OverPicture),
    ] {
        named(march(counts, composition).unwrap_err(), "march");
    }
    let high = looking(5e4, [0.0; 3].map(|_| 30.0), [30.0, 0.0]);
    named(
        march([4, 4], SkyComposition::Background)
            .unwrap()
            .prepare(&gpu.queue, &mut encoder, &high)
            .unwrap_err(),
        "view.eye",
    );

    let mut sky = new(&plain, SkyComposition::Background).unwrap();
    named(
        sky.set_host(&gpu.device, &depth, None).unwrap_err(),
        "composition",
    );
    let flat = targets(Depth::Reversed, Projection::Orthographic);
    let mut flat = new(&flat, SkyComposition::Background).unwrap();
    named(
        flat.prepare(&gpu.queue, &mut encoder, &View::default())
            .unwrap_err(),
        "view.projection",
    );
    let mut nan = View::default();
    nan.world_from_view.x_axis.x = f32::NAN;
    named(
        sky.prepare(&gpu.queue, &mut encoder, &nan).unwrap_err(),
        "view.world_from_view",
    );
    nan = View::default();
    nan.eye.frac.y = f32::NAN;
    named(
        sky.prepare(&gpu.queue, &mut encoder, &nan).unwrap_err(),
        "view.eye.frac",
    );
    nan = View::default();
    nan.sun.to_light = Vec3::NAN;
    named(
        sky.prepare(&gpu.queue, &mut encoder, &nan).unwrap_err(),
        "view.sun.to_light",
    );
    let beyond = looking(2e9, [0.0; 3].map(|_| 30.0), [30.0, 0.0]);
    named(
        sky.prepare(&gpu.queue, &mut encoder, &beyond).unwrap_err(),
        "eye.altitude",
    );
    let eye = Eye {
        altitude: f64::NAN,
        to_sun: [0.0, 1.0, 0.0],
        sun_angular_radius: 0.0,
    };
    named(eye.check().unwrap_err(), "eye.altitude");
}

/// Greatest second difference over the local radiance along an arc, per channel the worst; radiance below the floor is not judged.
fn roughness(samples: &[[f64; 3]], floor: f64) -> f64 {
    samples
        .windows(3)
        .flat_map(|w| [0, 1, 2].map(|c| (w[0][c], w[1][c], w[2][c])))
        .filter(|(_, middle, _)| *middle > floor)
        .map(|(before, middle, after)| (before - 2.0 * middle + after).abs() / middle)
        .fold(0.0, f64::max)
}

#[test]
fn arcs_of_the_sky_are_as_smooth_as_the_reference() {
    let air = Atmosphere::default();
    let reference = Truth::new(&air).unwrap();
    let suns = [60.0, 20.0, 5.0, 0.0];
    let mut arcs: Vec<(String, f64, DVec3, Vec<DVec3>)> = Vec::new();
    for altitude in [2.0, 10_000.0, 400_000.0] {
        let dip = (air.planet_radius / (air.planet_radius + altitude)).acos();
        for sun in suns {
            let to_sun = direction(f64::to_radians(sun), 0.0);
            // Great circles from a start towards a second direction.
            let zenith = DVec3::Y;
            // A little above the horizon, where rays end on one side of it.
            let limb = direction(-dip + 0.01, 0.7);
            let starts = [
                ("zenith and sun", -dip - 0.35, direction(0.0, 0.0), zenith),
                ("zenith aside", -dip - 0.35, direction(0.0, 1.4), zenith),
                (
                    "zenith and antisun",
                    -dip - 0.35,
                    direction(0.0, 2.9),
                    zenith,
                ),
                (
                    "along the horizon",
                    0.0,
                    limb,
                    limb.cross(zenith).normalize(),
                ),
                (
                    "aslant over the horizon",
                    -0.5,
                    limb,
                    (zenith + limb.cross(zenith)).normalize(),
                ),
            ];
            for (name, from, ahead, towards) in starts {
                let aside = (towards - ahead * ahead.dot(towards)).normalize();
                let count = if altitude > 1e5 && towards == zenith {
                    160
                } else {
                    240
                };
                let dirs = (0..count)
                    .map(|k| {
                        let angle = from + f64::to_radians(0.25 * f64::from(k));
                        ahead * angle.cos() + aside * angle.sin()
                    })
                    .collect();
                arcs.push((
                    format!("{altitude} m, sun {sun}, {name}"),
                    altitude,
                    to_sun,
                    dirs,
                ));
            }
        }
    }
    // Through the sun and its opposite.
    for sun in [30.0, 10.0, 2.0, -3.0] {
        let to_sun = direction(f64::to_radians(sun), 0.0);
        let aside = to_sun.cross(DVec3::Y).normalize();
        let dirs = (-120..120)
            .map(|k| {
                let angle = f64::to_radians(0.25 * f64::from(k) + 0.07);
                to_sun * angle.cos() + aside * angle.sin()
            })
            .collect();
        arcs.push((format!("2 m, across the sun at {sun}"), 2.0, to_sun, dirs));
    }
    assert_eq!(arcs.len(), 64);
    let rays: Vec<ProbeRay> = arcs
        .iter()
        .flat_map(|(_, altitude, to_sun, dirs)| {
            dirs.iter().map(|dir| ProbeRay {
                altitude: *altitude,
                dir: dir.normalize().to_array(),
                to_sun: to_sun.to_array(),
                distance: f64::INFINITY,
            })
        })
        .collect();
    let found = fast(&Preset::High, false, &rays);
    let truth = parallel_map(rays.len(), |i| {
        let ray = &rays[i];
        reference
            .single_scatter(
                &SkyRay {
                    eye_altitude: ray.altitude,
                    dir: ray.dir,
                    to_sun: ray.to_sun,
                    distance: ray.distance,
                },
                1e-5,
            )
            .in_scatter
    });
    let mut first = 0;
    let mut factors: Vec<(f64, String)> = Vec::new();
    for (name, .., dirs) in &arcs {
        let range = first..first + dirs.len();
        first = range.end;
        let ours: Vec<[f64; 3]> = found[range.clone()]
            .iter()
            .map(|l| l.in_scatter.map(f64::from))
            .collect();
        let exact = roughness(&truth[range], 1e-6);
        let rough = roughness(&ours, 1e-6);
        // An arc without curvature is compared with the rounding of a picture.
        let factor = rough / exact.max(1e-4);
        factors.push((factor, format!("{name}: {rough:.5} against {exact:.5}")));
    }
    factors.sort_by(|a, b| b.0.total_cmp(&a.0));
    let failing = factors.iter().filter(|f| f.0 > 2.0).count();
    println!("{failing} of {} arcs above 2", factors.len());
    for (factor, arc) in factors.iter().take(failing.max(4)) {
        println!("{factor:8.2}  {arc}");
    }
    // What is left are the two along the horizon under a sun that touches it.
    assert!(factors.iter().all(|f| f.0.is_finite()) && failing <= 2);
}

/// Pictures of the tables of `Sky`, which show the ground and share reads between pixels (`sky_seen_by_pair`, and `sky_seen` where nothing is shared), against rays read from tables of the finest quality.
#[test]
fn a_marched_sky_is_that_of_the_reference() {
    let air = Atmosphere::default();
    let options = SkyOptions {
        preset: Preset::Low,
        march: Some([32, 16]),
        ..Default::default()
    };
    let targets = targets(Depth::default(), Projection::default());
    let mut sky = Sky::new(&gpu().device, veduta::programs(), &targets, &options).unwrap();
    let irradiance =
        View::default().sun.irradiance * Vec3::from_array(air.sun.colour.map(|c| c as f32));
    let truth = Truth::new(&air).unwrap();
    for (altitude, pitch, height) in [(2.0, 12.0, 40.0), (3e3, 0.0, 5.0), (2.0, 10.0, -3.0)] {
        let view = looking(altitude, [150.0, pitch, 50.0], [height, 0.0]);
        let shown = shoot(&mut sky, &view);
        let mut worst = 0.0_f64;
        for i in (0..PIXELS).step_by(97) {
            let ray = SkyRay {
                eye_altitude: altitude,
                dir: ray_of(&view, i).normalize().to_array(),
                to_sun: view.sun.to_light.as_dvec3().normalize().to_array(),
                distance: f64::INFINITY,
            };
            let light = truth.single_scatter(&ray, 1e-6).in_scatter;
            for c in 0..3 {
                let found = f64::from(shown.pixels[i][c] / irradiance[c]);
                worst = worst.max((found - light[c]).abs() / light[c].max(1e-6));
            }
        }
        println!("{altitude} m, sun at {height}: {worst:.1e}");
        assert!(worst < 2e-3);
    }
    // Afra's way: the depth to the sun from a table, and all orders.
    let options = SkyOptions {
        march: Some([48, 0]),
        ..Default::default()
    };
    let mut sky = Sky::new(&gpu().device, veduta::programs(), &targets, &options).unwrap();
    let quality = quality(&Preset::High);
    for (altitude, pitch, height) in [(2.0, 12.0, 40.0), (3e3, 0.0, 5.0), (2.0, 10.0, -3.0)] {
        let view = looking(altitude, [150.0, pitch, 50.0], [height, 0.0]);
        let shown = shoot(&mut sky, &view);
        let picked: Vec<usize> = (0..PIXELS).step_by(97).collect();
        let rays: Vec<ProbeRay> = picked
            .iter()
            .map(|&i| ProbeRay {
                altitude,
                dir: ray_of(&view, i).normalize().to_array(),
                to_sun: view.sun.to_light.as_dvec3().normalize().to_array(),
                distance: f64::INFINITY,
            })
            .collect();
        let found = FastProbe::new(&gpu().device, veduta::programs(), &air, &quality, 64)
            .and_then(|mut p| p.run(&gpu().device, &gpu().queue, &rays))
            .unwrap();
        let off = picked.iter().zip(&found).flat_map(|(&i, light)| {
            (0..3).map({
                let pixel = shown.pixels[i];
                move |c| relative(pixel[c] / irradiance[c], light.in_scatter[c], 1e-6)
            })
        });
        let worst = off.fold(0.0, f32::max);
        println!("by columns, {altitude} m, sun at {height}: {worst:.1e}");
        assert!(worst < 5e-3);
    }
}

#[test]
fn no_eye_is_too_low_or_too_high_for_a_picture() {
    let top = Atmosphere::default().thickness as f32;
    for composition in [SkyComposition::Background, SkyComposition::OverPicture] {
        let targets = targets(Depth::default(), Projection::default());
        let mut sky = sky_with(&targets, composition, Preset::Low);
        if composition == SkyComposition::OverPicture {
            let depths: Vec<f32> = (0..PIXELS).map(|i| [0.0, 1e-3, 1e-7][i % 3]).collect();
            let colour = upload(FLOAT, &vec![0.5; 4 * PIXELS]);
            sky.set_host(&gpu().device, &depth_buffer(&depths), Some(&colour))
                .unwrap();
        }
        for altitude in [
            0.0,
            1.7,
            f64::from(top.next_down()),
            f64::from(top),
            f64::from(top.next_up()),
            1e8,
        ] {
            for height in [90.0, 0.0, -18.0, -90.0] {
                for pitch in [-89.0, -30.0, 0.0, 60.0] {
                    let view = looking(altitude, [20.0, pitch, 60.0], [height, 40.0]);
                    let picture = shoot(&mut sky, &view);
                    assert_eq!(picture.not_finite(), 0, "{altitude} {height} {pitch}");
                    let negative = picture
                        .pixels
                        .iter()
                        .any(|p| p[..3].iter().any(|v| *v < 0.0));
                    assert!(!negative, "{altitude} {height} {pitch}");
                }
            }
        }
    }
}

#[test]
fn what_the_sky_draws_is_what_the_probe_finds() {
    let gpu = gpu();
    let air = Atmosphere::default();
    let irradiance =
        View::default().sun.irradiance * Vec3::from_array(air.sun.colour.map(|c| c as f32));
    let mut sky = background(Preset::High);
    let mut errors = Vec::new();
    for (altitude, pitch) in [
        (2.0, 12.0),
        (2.0, 3.0),
        (2e3, 0.0),
        (1.5e4, -4.0),
        (9e4, -6.0),
    ] {
        for (height, azimuth) in [(50.0, 40.0), (12.0, 100.0), (0.5, 20.0), (-4.0, 30.0)] {
            let view = looking(altitude, [10.0, pitch, 50.0], [height, azimuth]);
            let shown = shoot(&mut sky, &view);
            assert_eq!(shown.not_finite(), 0);
            let to_sun = view.sun.to_light.as_dvec3().normalize();
            let radius = air.planet_radius;
            let dip = -(altitude * (2.0 * radius + altitude)).sqrt() / (radius + altitude);
            // Above the horizon by more than a pixel, and beside the sun's disc.
            let kept: Vec<usize> = (0..PIXELS)
                .filter(|&i| {
                    let dir = ray_of(&view, i).normalize();
                    dir.y > dip + 0.01 && dir.dot(to_sun) < 0.9995
                })
                .collect();
            let rays: Vec<ProbeRay> = kept
                .iter()
                .map(|&i| ProbeRay {
                    altitude,
                    dir: ray_of(&view, i).normalize().to_array(),
                    to_sun: to_sun.to_array(),
                    distance: f64::INFINITY,
                })
                .collect();
            let quality = SkyQuality::finest();
            let truth = FastProbe::new(&gpu.device, veduta::programs(), &air, &quality, 0)
                .and_then(|mut p| p.run(&gpu.device, &gpu.queue, &rays))
                .unwrap();
            let mut own = Vec::new();
            for (&i, light) in kept.iter().zip(&truth) {
                for c in 0..3 {
                    let found = shown.pixels[i][c] / irradiance[c];
                    own.push(relative(found, light.in_scatter[c], 1e-6));
                }
            }
            own.sort_by(f32::total_cmp);
            let at = |share: f32| own[(share * (own.len() - 1) as f32) as usize];
            println!(
                "{altitude} m, sun at {height}: {} rays, median {:.4}, 99th centile {:.4}, worst {:.4}",
                kept.len(),
                at(0.5),
                at(0.99),
                at(1.0)
            );
            assert!(kept.len() > PIXELS / 4);
            errors.extend(own);
        }
    }
    errors.sort_by(f32::total_cmp);
    let at = |share: f32| errors[(share * (errors.len() - 1) as f32) as usize];
    println!("median {:.4}, 99th centile {:.4}", at(0.5), at(0.99));
    assert!(at(0.5) < 0.005 && at(0.99) < 0.03);
}

/// A dusk sky in eight bits: dithered, the local mean over blocks is that of the picture in floats to a fraction of a step, where rounding alone leaves bands.
#[test]
fn eight_bits_are_dithered_without_bands() {
    let gpu = gpu();
    // That of the dither's matrix.
    let block = 8;
    let mut worst = [0.0_f64; 2];
    for (height, exposure) in [(4.0, 0.3), (-4.0, 40.0), (-8.0, 2000.0)] {
        let mut view = looking(2.0, [20.0, 14.0, 1.0], [height, 70.0]);
        view.exposure = exposure;
        let exact = shoot(&mut background(Preset::High), &view);
        let bytes = |format| {
            let targets = Targets {
                color_format: format,
                ..targets(Depth::default(), Projection::default())
            };
            let mut sky = sky_with(&targets, SkyComposition::Background, Preset::High);
            let out = texture(
                format,
                1,
                wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            );
            let target = view_of(&out);
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let _ = sky.prepare(&gpu.queue, &mut encoder, &view).unwrap();
            {
                let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                    color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                        view: &target,
                        depth_slice: None,
                        resolve_target: None,
                        ops: wgpu::Operations::default(),
                    })],
                    ..Default::default()
                });
                let _ = sky.composite(&mut pass).unwrap();
            }
            gpu.queue.submit([encoder.finish()]);
            gpu.read_texture(&out).unwrap()
        };
        let signal = |radiance: f32| {
            let shown = 1.0 - (-f64::from(radiance) * f64::from(exposure)).exp();
            255.0
                * if shown <= 0.003_130_8 {
                    12.92 * shown
                } else {
                    1.055 * shown.powf(1.0 / 2.4) - 0.055
                }
        };
        let steps: Vec<[f64; 3]> = exact
            .pixels
            .iter()
            .map(|p| [0, 1, 2].map(|c| signal(p[c])))
            .collect();
        let span = |c: usize| {
            let of = steps.iter().map(|s| s[c]);
            [of.clone().fold(255.0, f64::min), of.fold(0.0, f64::max)]
        };
        println!("sun {height}: steps {:?}", [0, 1, 2].map(span));
        assert!((0..3).any(|c| span(c)[1] - span(c)[0] > 1.0 && span(c)[1] < 250.0));
        for format in [
            wgpu::TextureFormat::Rgba8Unorm,
            wgpu::TextureFormat::Rgba8UnormSrgb,
        ] {
            let found = bytes(format);
            let mut off = [0.0_f64; 2];
            for y in 0..SIZE[1] / block {
                for x in 0..SIZE[0] / block {
                    for c in 0..3 {
                        let mut sums = [0.0; 2];
                        for k in 0..block * block {
                            let i = ((y * block + k / block) * SIZE[0] + x * block + k % block)
                                as usize;
                            let true_step = steps[i][c];
                            sums[0] += f64::from(found[4 * i + c]) - true_step;
                            sums[1] += true_step.round() - true_step;
                        }
                        for (off, sum) in off.iter_mut().zip(sums) {
                            *off = off.max(sum.abs() / f64::from(block * block));
                        }
                    }
                }
            }
            println!("{format:?}: {:.3} of a step, rounded {:.3}", off[0], off[1]);
            for (worst, off) in worst.iter_mut().zip(off) {
                *worst = worst.max(off);
            }
        }
    }
    // Rounding alone would leave nearly half a step in a block: the test can tell.
    assert!(worst[0] < 0.3 && worst[1] > 0.35, "{worst:?}");
}
