//! What the tests share: the device, the modules of this repository, rows and comparisons.

use veduta::Atmosphere;
use veduta::atmosphere::ProbeLight;
use veduta::device::{Gpu, shared};
use veduta::eval::{Evaluator, Spec};
use veduta::reference::monte_carlo::splitmix64;
use veduta::reference::probe::Probed;
use veduta::reference::sky::SkyRadiance;
use veduta_compose::library::Library;

/// The shared device; its absence fails the test with the line that installs a driver.
pub fn gpu() -> &'static Gpu {
    match shared() {
        Ok(gpu) => gpu,
        Err(e) => panic!("{e}"),
    }
}

/// The modules in this repository's `wgsl` folder, as they are now.
pub fn modules() -> Library {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("wgsl");
    match Library::load(&[folder]) {
        Ok(library) => library,
        Err(e) => panic!("{e}"),
    }
}

/// An evaluator of `expression` over rows of `columns` numbers, with our modules to import from.
pub fn evaluator(imports: &[&str], prelude: &str, expression: &str, columns: usize) -> Evaluator {
    let spec = Spec {
        imports,
        prelude,
        prelude_file: "",
        expression,
        columns,
        features: &["AIR_EIGHT_LANES"],
    };
    match Evaluator::new(gpu(), &modules(), &spec) {
        Ok(e) => e,
        Err(e) => panic!("{e}"),
    }
}

/// A small generator of random bits (splitmix64), so that every run sees the same numbers.
pub struct Random(pub u64);

impl Random {
    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        splitmix64(&mut self.0)
    }

    /// The next number in [0, 1), a multiple of 2^-24 and so exact in `f32`.
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1_u32 << 24) as f32
    }

    /// The next number in [low, high).
    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// The next number in [low, high) with all digits of `f64`.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// A shipped atmosphere.
pub fn named(name: &str) -> Atmosphere {
    Atmosphere::named(name).unwrap()
}

/// The unit vector of an elevation and an azimuth in radians, y up.
pub fn heading(elevation: f64, azimuth: f64) -> [f64; 3] {
    let (e, a) = (elevation, azimuth);
    [e.cos() * a.cos(), e.sin(), e.cos() * a.sin()]
}

/// What a reference says of a ray.
pub trait Truth {
    /// Radiance scattered into it.
    fn in_scatter(&self) -> [f64; 3];
    /// Transmittance to its end.
    fn transmittance(&self) -> [f64; 3];
}

impl Truth for Probed {
    fn in_scatter(&self) -> [f64; 3] {
        self.in_scatter
    }
    fn transmittance(&self) -> [f64; 3] {
        self.transmittance
    }
}

impl Truth for SkyRadiance {
    fn in_scatter(&self) -> [f64; 3] {
        self.in_scatter
    }
    fn transmittance(&self) -> [f64; 3] {
        self.transmittance
    }
}

/// A channel of the light that a ray brings, and the truth of it.
pub fn light(found: &ProbeLight, truth: &impl Truth, c: usize) -> (f64, f64) {
    (f64::from(found.in_scatter[c]), truth.in_scatter()[c])
}

/// A channel of the light that is left, and the truth of it.
pub fn left(found: &ProbeLight, truth: &impl Truth, c: usize) -> (f64, f64) {
    (f64::from(found.transmittance[c]), truth.transmittance()[c])
}

/// Errors of all channels over the truth or a floor, with their rays; the smallest first.
pub fn errors<T>(
    found: &[ProbeLight],
    truth: &[T],
    floor: f64,
    part: fn(&ProbeLight, &T, usize) -> (f64, f64),
) -> Vec<(f64, usize)> {
    let mut all: Vec<(f64, usize)> = (0..3 * found.len())
        .map(|k| {
            let (f, t) = part(&found[k / 3], &truth[k / 3], k % 3);
            assert!(f.is_finite(), "ray {}", k / 3);
            ((f - t).abs() / t.abs().max(floor), k / 3)
        })
        .collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all
}

/// The error that a share of all stays below.
pub fn centile(all: &[(f64, usize)], share: f64) -> f64 {
    all[((all.len() - 1) as f64 * share) as usize].0
}

/// A picture in `f32`, four channels a pixel, row after row from the top.
pub struct Picture {
    /// Pixels a row.
    pub width: u32,
    /// Red, green, blue, alpha of each pixel.
    pub pixels: Vec<[f32; 4]>,
}

/// Draws one frame of a landscape into a texture of `format` (`Rgba32Float` or a four-byte one) and reads it back.
pub fn draw(
    landscape: &mut veduta::Landscape,
    view: &veduta::View,
    size: [u32; 2],
    format: wgpu::TextureFormat,
) -> Picture {
    let gpu = gpu();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let _ = landscape
        .prepare(&gpu.device, &gpu.queue, &mut encoder, view)
        .unwrap();
    gpu.queue.submit([encoder.finish()]);
    draw_with(size, format, |pass| {
        let _ = landscape.composite(pass);
    })
}

/// Records one pass into a texture and reads it back.
pub fn draw_with(
    size: [u32; 2],
    format: wgpu::TextureFormat,
    record: impl FnOnce(&mut wgpu::RenderPass<'_>),
) -> Picture {
    let gpu = gpu();
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("picture"),
        size: wgpu::Extent3d {
            width: size[0],
            height: size[1],
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let target = texture.create_view(&Default::default());
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    record(&mut encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &target,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations::default(),
        })],
        ..Default::default()
    }));
    gpu.queue.submit([encoder.finish()]);
    let data = gpu.read_texture(&texture).unwrap();
    let texel = format.block_copy_size(None).unwrap() as usize;
    let pixels = data
        .chunks_exact(texel)
        .map(|pixel| match texel {
            4 => [0, 1, 2, 3].map(|i| f32::from(pixel[i]) / 255.0),
            _ => [0, 4, 8, 12]
                .map(|i| f32::from_le_bytes([pixel[i], pixel[i + 1], pixel[i + 2], pixel[i + 3]])),
        })
        .collect();
    Picture {
        width: size[0],
        pixels,
    }
}

impl Picture {
    /// Every component that is not finite.
    pub fn not_finite(&self) -> usize {
        self.pixels
            .iter()
            .flatten()
            .filter(|v| !v.is_finite())
            .count()
    }

    /// The mean of the first three channels over the pixels that `keep` wants.
    pub fn mean(&self, keep: impl Fn(usize, usize) -> bool) -> [f64; 3] {
        let mut sum = [0.0; 3];
        let mut count = 0.0;
        for (i, pixel) in self.pixels.iter().enumerate() {
            if keep(i % self.width as usize, i / self.width as usize) {
                count += 1.0;
                for c in 0..3 {
                    sum[c] += f64::from(pixel[c]);
                }
            }
        }
        sum.map(|s| s / count)
    }
}

/// CPU seconds of this process so far, user and system, over all its threads.
///
/// The device's own threads belong to the process on a software driver, so that this is what a frame costs there.
pub fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap();
    let fields: Vec<&str> = stat
        .rsplit_once(')')
        .unwrap()
        .1
        .split_whitespace()
        .collect();
    // Clock ticks are hundredths of a second on every Linux that runs this.
    (fields[11].parse::<f64>().unwrap() + fields[12].parse::<f64>().unwrap()) / 100.0
}
