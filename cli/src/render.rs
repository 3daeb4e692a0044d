//! Draws the landscape tile by tile into a texture, reads it back, and measures what that costs.

use std::time::{Duration, Instant};

use veduta::device::Gpu;
use veduta::landscape::Targets;
use veduta::{Landscape, LandscapeOptions, ProgramSet, Value, View, wgpu};

use crate::cpu::CpuTime;
use crate::error::CliError;

/// Width and height in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl std::str::FromStr for Size {
    type Err = CliError;

    fn from_str(text: &str) -> Result<Size, CliError> {
        let parsed = text
            .split_once(['x', 'X'])
            .and_then(|(w, h)| Some((w.trim().parse().ok()?, h.trim().parse().ok()?)));
        match parsed {
            Some((width, height)) => Ok(Size { width, height }),
            None => Err(CliError::argument(
                "--size",
                text,
                "two whole numbers with an x between, for instance 800x450",
            )),
        }
    }
}

impl std::fmt::Display for Size {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}

impl Size {
    /// Checks both sides against the device's limit.
    ///
    /// # Errors
    /// [`CliError::Argument`] with the size and the limit.
    pub fn check(self, device: &wgpu::Device) -> Result<(), CliError> {
        let limit = device.limits().max_texture_dimension_2d;
        if (1..=limit).contains(&self.width) && (1..=limit).contains(&self.height) {
            Ok(())
        } else {
            Err(CliError::argument(
                "--size",
                self.to_string(),
                format!("1 to {limit} pixels on each side (the device's limit)"),
            ))
        }
    }

    /// Width over height.
    pub fn aspect(self) -> f64 {
        f64::from(self.width) / f64::from(self.height)
    }
}

/// What the picture holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Output {
    /// Tone-mapped and sRGB-encoded, 8 bits a channel.
    Display,
    /// Scene radiance, 32-bit floats.
    Linear,
}

impl Output {
    fn format(self) -> wgpu::TextureFormat {
        match self {
            Output::Display => wgpu::TextureFormat::Rgba8Unorm,
            Output::Linear => wgpu::TextureFormat::Rgba32Float,
        }
    }

    fn bytes_per_pixel(self) -> u32 {
        match self {
            Output::Display => 4,
            Output::Linear => 16,
        }
    }
}

/// How a picture is divided into submissions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Tiling {
    /// Tiles that begin with 64x64 pixels and follow the speed of the device, a quarter of a second each.
    #[default]
    Adaptive,
    /// Squares of this many pixels a side.
    Fixed(u32),
    /// One submission.
    Whole,
}

/// What drawing one picture took.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Cost {
    /// Time on the clock.
    pub wall: Duration,
    /// Processor milliseconds of this process, driver threads included; `None` where the system does not tell.
    pub cpu_ms: Option<f64>,
    /// Submissions.
    pub submissions: u32,
    /// The longest submission.
    pub longest: Duration,
    /// Bytes uploaded.
    pub bytes: u64,
    /// Milliseconds by the device's timestamps, the sum over submissions; `None` unless they are in use.
    pub gpu_ms: Option<f64>,
}

/// How long a tile's submission should take; far below the second after which systems lose patience.
const TILE_TIME: f64 = 0.25;
const FIRST_TILE: u32 = 64;
/// Sides of tiles are multiples of this, so that no quad of pixels is cut.
const TILE_UNIT: u32 = 8;
/// The most bytes that one read-back copies.
const STRIP_BYTES: u64 = 32 << 20;

/// A landscape with a texture of its own.
#[derive(Debug)]
pub struct Renderer {
    gpu: Gpu,
    landscape: Landscape,
    texture: wgpu::Texture,
    target: wgpu::TextureView,
    size: Size,
    output: Output,
    pipeline_time: Duration,
    pipeline_cpu_ms: Option<f64>,
    timer: Option<Timer>,
}

/// Two timestamps around a pass.
#[derive(Debug)]
struct Timer {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
}

impl Timer {
    const BYTES: u64 = 16;

    fn new(device: &wgpu::Device) -> Timer {
        Timer {
            queries: device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("time"),
                ty: wgpu::QueryType::Timestamp,
                count: 2,
            }),
            resolved: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("time"),
                size: wgpu::QUERY_RESOLVE_BUFFER_ALIGNMENT.max(Timer::BYTES),
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
        }
    }

    fn milliseconds(&self, gpu: &Gpu) -> Result<f64, CliError> {
        let bytes = gpu.read_buffer(&self.resolved, Timer::BYTES)?;
        let ticks: Vec<u64> = bytes
            .chunks_exact(8)
            .map(|b| u64::from_le_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]]))
            .collect();
        let ticks = ticks[1].saturating_sub(ticks[0]) as f64;
        Ok(ticks * f64::from(gpu.queue.get_timestamp_period()) * 1e-6)
    }
}

/// Runs `work` and turns the device's complaints into an error instead of a panic.
pub(crate) fn guarded<T>(
    gpu: &Gpu,
    work: impl FnOnce() -> Result<T, CliError>,
) -> Result<T, CliError> {
    let memory = gpu.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let validation = gpu.device.push_error_scope(wgpu::ErrorFilter::Validation);
    let outcome = work();
    let complaints = [
        pollster::block_on(validation.pop()),
        pollster::block_on(memory.pop()),
    ];
    let value = outcome?;
    match complaints.into_iter().flatten().next() {
        Some(error) => Err(veduta::Error::Device(error.to_string()).into()),
        None => Ok(value),
    }
}

/// A texture to draw a picture into and to read it from.
pub fn picture(device: &wgpu::Device, size: Size, format: wgpu::TextureFormat) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("picture"),
        size: wgpu::Extent3d {
            width: size.width,
            height: size.height,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::COPY_SRC
            | wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    })
}

impl Renderer {
    /// Creates the pipeline and the texture.
    ///
    /// # Errors
    /// [`CliError::Argument`] for a size that the device does not allow, and the faults of [`Landscape::new`].
    pub fn new(
        gpu: &Gpu,
        programs: &ProgramSet,
        options: &LandscapeOptions,
        size: Size,
        output: Output,
    ) -> Result<Renderer, CliError> {
        size.check(&gpu.device)?;
        guarded(gpu, || {
            let texture = picture(&gpu.device, size, output.format());
            let targets = Targets {
                color_format: output.format(),
                ..Targets::default()
            };
            let cpu = CpuTime::now();
            let start = Instant::now();
            let landscape = Landscape::new(&gpu.device, programs, &targets, options)?;
            Ok(Renderer {
                gpu: gpu.clone(),
                landscape,
                target: texture.create_view(&Default::default()),
                texture,
                size,
                output,
                pipeline_time: start.elapsed(),
                pipeline_cpu_ms: since(cpu.as_ref()),
                timer: None,
            })
        })
    }

    /// The resolved values.
    pub fn settings(&self) -> &veduta::Settings {
        self.landscape.settings()
    }

    /// Width and height.
    pub fn size(&self) -> Size {
        self.size
    }

    /// How long [`Landscape::new`] took.
    pub fn pipeline_time(&self) -> Duration {
        self.pipeline_time
    }

    /// Processor milliseconds of [`Landscape::new`], driver threads included; `None` where the system does not tell.
    pub fn pipeline_cpu_ms(&self) -> Option<f64> {
        self.pipeline_cpu_ms
    }

    /// Turns the device's timestamps on or off; they are off at first.
    ///
    /// # Errors
    /// [`CliError::Argument`] when the device has none.
    pub fn use_timestamps(&mut self, on: bool) -> Result<(), CliError> {
        if on
            && !self
                .gpu
                .device
                .features()
                .contains(wgpu::Features::TIMESTAMP_QUERY)
        {
            return Err(CliError::argument(
                "clock",
                "gpu",
                "cpu or wall: this device has no timestamps",
            ));
        }
        match (on, self.timer.is_some()) {
            (true, false) => self.timer = Some(Timer::new(&self.gpu.device)),
            (false, true) => self.timer = None,
            _ => {}
        }
        Ok(())
    }

    /// Sets the number of the frame, which seeds the jitter.
    pub fn set_frame(&mut self, frame: u32) {
        self.landscape.set_frame(frame);
    }

    /// Gives a content key a value, as [`Landscape::set_content`].
    ///
    /// # Errors
    /// As [`Landscape::set_content`].
    pub fn set_content(&mut self, name: &str, value: Value) -> Result<(), CliError> {
        Ok(self.landscape.set_content(name, value)?)
    }

    /// Draws one pixel: drivers that compile at the first draw do it now.
    ///
    /// # Errors
    /// The faults of [`Landscape::prepare`] and of the device.
    pub fn warm_up(&mut self, view: &View) -> Result<Cost, CliError> {
        let start = Instant::now();
        let cpu = CpuTime::now();
        let (bytes, gpu_ms) = self.submit(view, [0, 0, 1, 1])?;
        Ok(Cost {
            wall: start.elapsed(),
            cpu_ms: since(cpu.as_ref()),
            submissions: 1,
            longest: start.elapsed(),
            bytes,
            gpu_ms,
        })
    }

    /// Draws every pixel; `progress` hears the share that is done, up to 1.
    ///
    /// # Errors
    /// [`CliError::Argument`] for tiles without pixels, the faults of [`Landscape::prepare`] and of the device.
    pub fn draw(
        &mut self,
        view: &View,
        tiling: Tiling,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Cost, CliError> {
        if tiling == Tiling::Fixed(0) {
            return Err(CliError::argument("tile", "0", "at least 1 pixel"));
        }
        let Size { width, height } = self.size;
        let total = f64::from(width) * f64::from(height);
        let mut cost = Cost::default();
        let mut done = 0.0;
        let mut tile = [FIRST_TILE, FIRST_TILE];
        let cpu = CpuTime::now();
        let start = Instant::now();
        let mut y = 0;
        while y < height {
            // A band of tiles: the height holds for the band, the width follows the speed.
            match tiling {
                Tiling::Adaptive => tile[1] = tile[0],
                Tiling::Fixed(side) => tile = [side, side],
                Tiling::Whole => tile = [width, height],
            }
            let rows = tile[1].min(height - y);
            let mut x = 0;
            while x < width {
                let columns = tile[0].min(width - x);
                let begun = Instant::now();
                let (bytes, gpu_ms) = self.submit(view, [x, y, columns, rows])?;
                cost.bytes += bytes;
                if let Some(ms) = gpu_ms {
                    *cost.gpu_ms.get_or_insert(0.0) += ms;
                }
                let took = begun.elapsed();
                cost.submissions += 1;
                cost.longest = cost.longest.max(took);
                let pixels = f64::from(columns) * f64::from(rows);
                done += pixels;
                progress(done / total);
                x += columns;
                if tiling == Tiling::Adaptive {
                    tile[0] = next_side(tile[0], pixels, rows, took.as_secs_f64(), width);
                }
            }
            y += rows;
        }
        cost.wall = start.elapsed();
        cost.cpu_ms = since(cpu.as_ref());
        Ok(cost)
    }

    /// Draws a rectangle `[x, y, width, height]` and waits for it.
    fn submit(
        &mut self,
        view: &View,
        [x, y, w, h]: [u32; 4],
    ) -> Result<(u64, Option<f64>), CliError> {
        let Renderer {
            gpu,
            landscape,
            target,
            timer,
            ..
        } = self;
        let gpu = gpu.clone();
        guarded(&gpu, || {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let work = landscape.prepare(&gpu.device, &gpu.queue, &mut encoder, view)?;
            {
                let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                    label: Some("tile"),
                    color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                        view: target,
                        depth_slice: None,
                        resolve_target: None,
                        ops: wgpu::Operations {
                            load: wgpu::LoadOp::Load,
                            store: wgpu::StoreOp::Store,
                        },
                    })],
                    timestamp_writes: timer.as_ref().map(|t| wgpu::RenderPassTimestampWrites {
                        query_set: &t.queries,
                        beginning_of_pass_write_index: Some(0),
                        end_of_pass_write_index: Some(1),
                    }),
                    ..Default::default()
                });
                pass.set_scissor_rect(x, y, w, h);
                let _ = landscape.composite(&mut pass);
            }
            if let Some(timer) = timer {
                encoder.resolve_query_set(&timer.queries, 0..2, &timer.resolved, 0);
            }
            gpu.queue.submit([encoder.finish()]);
            gpu.device
                .poll(wgpu::PollType::wait_indefinitely())
                .map_err(|e| veduta::Error::Device(e.to_string()))?;
            let ms = timer.as_ref().map(|t| t.milliseconds(&gpu)).transpose()?;
            Ok((work.bytes, ms))
        })
    }

    /// The texture's bytes, rows from the top without padding.
    fn read(&self) -> Result<Vec<u8>, CliError> {
        let Size { width, height } = self.size;
        let row = width * self.output.bytes_per_pixel();
        let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let rows_a_strip = (STRIP_BYTES / u64::from(padded)).clamp(1, u64::from(height)) as u32;
        let mut pixels = Vec::with_capacity(row as usize * height as usize);
        let mut y = 0;
        while y < height {
            let rows = rows_a_strip.min(height - y);
            let data = guarded(&self.gpu, || {
                let staging = self.gpu.device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("picture"),
                    size: u64::from(padded) * u64::from(rows),
                    usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                    mapped_at_creation: false,
                });
                let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
                encoder.copy_texture_to_buffer(
                    wgpu::TexelCopyTextureInfo {
                        texture: &self.texture,
                        mip_level: 0,
                        origin: wgpu::Origin3d { x: 0, y, z: 0 },
                        aspect: wgpu::TextureAspect::All,
                    },
                    wgpu::TexelCopyBufferInfo {
                        buffer: &staging,
                        layout: wgpu::TexelCopyBufferLayout {
                            offset: 0,
                            bytes_per_row: Some(padded),
                            rows_per_image: None,
                        },
                    },
                    wgpu::Extent3d {
                        width,
                        height: rows,
                        depth_or_array_layers: 1,
                    },
                );
                self.gpu.queue.submit([encoder.finish()]);
                Ok(self.gpu.read_staging(&staging)?)
            })?;
            for line in data.chunks_exact(padded as usize) {
                pixels.extend_from_slice(&line[..row as usize]);
            }
            y += rows;
        }
        Ok(pixels)
    }

    /// Red, green and blue of every pixel as bytes, rows from the top.
    ///
    /// # Errors
    /// [`CliError::Argument`] for an output of floats, the faults of the device.
    pub fn read_rgb8(&self) -> Result<Vec<u8>, CliError> {
        if self.output != Output::Display {
            return Err(CliError::argument("output", "Linear", "Display"));
        }
        Ok(self
            .read()?
            .chunks_exact(4)
            .flat_map(|p| [p[0], p[1], p[2]])
            .collect())
    }

    /// All four channels of every pixel as floats, rows from the top.
    ///
    /// # Errors
    /// [`CliError::Argument`] for an output of bytes, the faults of the device.
    pub fn read_rgba32(&self) -> Result<Vec<f32>, CliError> {
        if self.output != Output::Linear {
            return Err(CliError::argument("output", "Display", "Linear"));
        }
        Ok(self
            .read()?
            .chunks_exact(4)
            .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            .collect())
    }
}

/// The side of the next tile of a band of `rows` rows: what fits in [`TILE_TIME`] at the speed of the last tile, at most
/// twice as much as that.
fn next_side(side: u32, pixels: f64, rows: u32, seconds: f64, width: u32) -> u32 {
    let fitting = pixels / seconds.max(1e-6) * TILE_TIME / f64::from(rows);
    let wanted = fitting.clamp(f64::from(TILE_UNIT), 2.0 * f64::from(side)) as u32;
    (wanted / TILE_UNIT * TILE_UNIT).clamp(TILE_UNIT, width.next_multiple_of(TILE_UNIT))
}

fn since(start: Option<&CpuTime>) -> Option<f64> {
    Some(CpuTime::now()?.since(start?))
}

/// What frames cost.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurement {
    /// The draw of one pixel before, with what the driver compiles at the first draw.
    pub warm_up: Cost,
    /// Every frame after it.
    pub frames: Vec<Cost>,
}

impl Measurement {
    /// Median of the frames' processor milliseconds; `None` where the system does not tell.
    pub fn median_cpu_ms(&self) -> Option<f64> {
        let all: Option<Vec<f64>> = self.frames.iter().map(|c| c.cpu_ms).collect();
        median(all?)
    }

    /// Median of the frames' milliseconds on the clock.
    pub fn median_wall_ms(&self) -> Option<f64> {
        median(
            self.frames
                .iter()
                .map(|c| c.wall.as_secs_f64() * 1e3)
                .collect(),
        )
    }
}

/// The middle value, the mean of both middle values for an even number; `None` of nothing.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    let upper = *values.get(middle)?;
    if values.len().is_multiple_of(2) {
        Some((values[middle - 1] + upper) / 2.0)
    } else {
        Some(upper)
    }
}

/// Draws `frames` whole frames of one view, each in one submission, after a warm-up draw.
///
/// # Errors
/// [`CliError::Argument`] for no frame at all, the faults of [`Renderer::draw`].
pub fn measure(
    renderer: &mut Renderer,
    view: &View,
    frames: usize,
) -> Result<Measurement, CliError> {
    if frames == 0 {
        return Err(CliError::argument("frames", "0", "at least 1"));
    }
    let warm_up = renderer.warm_up(view)?;
    let frames = (0..frames)
        .map(|_| renderer.draw(view, Tiling::Whole, &mut |_| {}))
        .collect::<Result<_, _>>()?;
    Ok(Measurement { warm_up, frames })
}

/// Mean and maximum over all pixels of the four counts that COUNT_OPERATIONS draws: noise evaluations, cloud density
/// samples, cloud light samples, atmosphere samples.
pub fn operation_counts(rgba: &[f32]) -> [(f64, f64); 4] {
    let pixels = (rgba.len() / 4).max(1) as f64;
    std::array::from_fn(|channel| {
        let counts = || rgba.iter().skip(channel).step_by(4).map(|v| f64::from(*v));
        (counts().sum::<f64>() / pixels, counts().fold(0.0, f64::max))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_follow_the_speed() {
        // 64x64 pixels in 1 ms: twice as wide; in 25 s: the smallest.
        assert_eq!(next_side(64, 4096.0, 64, 1e-3, 4096), 128);
        assert_eq!(next_side(64, 4096.0, 64, 25.0, 4096), 8);
        assert_eq!(next_side(64, 4096.0, 64, 0.0, 70), 72);
        assert_eq!(next_side(64, 4096.0, 64, 0.5, 4096), 32);
    }

    #[test]
    fn sizes_are_read() {
        assert_eq!(
            "800x450".parse::<Size>().unwrap(),
            Size {
                width: 800,
                height: 450
            }
        );
        for text in ["", "800", "x", "ax3", "3x-1", "1.5x2", "99999999999x1"] {
            assert!(text.parse::<Size>().is_err(), "{text}");
        }
    }

    #[test]
    fn medians_and_counts() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![4.0, 1.0]), Some(2.5));
        assert_eq!(median(vec![]), None);
        let counts = operation_counts(&[1.0, 2.0, 3.0, 4.0, 3.0, 2.0, 1.0, 0.0]);
        assert_eq!(counts, [(2.0, 3.0), (2.0, 2.0), (2.0, 3.0), (2.0, 4.0)]);
    }
}
