//! Run time against error: the yardstick that judges every effect.

pub mod baseline;
pub mod chapter6;
pub mod cloud_flight;
pub mod clouds;
pub mod frames;
pub mod ground;
pub mod knob;
pub mod noise;
pub mod plot;
pub mod presets;
pub mod sky;
pub mod terrain;
pub mod timing;
pub mod truth;

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

use veduta::device::Gpu;
use veduta::{Value, View, wgpu};

use crate::commands::render::{Job, RenderArgs};
use crate::error::CliError;
use crate::metrics::{Difference, Picture};
use crate::render::{Output, Renderer, Size, Tiling};

/// What a bench draws with.
#[derive(Debug, Clone)]
pub struct Bench {
    /// The device.
    pub gpu: Gpu,
    /// The clock.
    pub clock: timing::Clock,
    /// Size of the pictures.
    pub size: Size,
    /// A folder for references, which take long to draw; none: each is drawn anew.
    pub cache: Option<PathBuf>,
    /// Names of flight, preset, scene and sources that every job begins with.
    pub base: RenderArgs,
}

impl Bench {
    /// A job with preset and view and more values than the base's.
    ///
    /// # Errors
    /// As [`Job::new`].
    pub fn job(
        &self,
        scene: &str,
        preset: &str,
        view: &str,
        values: &[(&str, Value)],
    ) -> Result<Job, CliError> {
        let mut args = self.base.clone();
        args.scene = scene.to_owned();
        args.preset = Some(preset.to_owned());
        args.view = Some(view.to_owned());
        // What the measurement itself sets goes before the base's values.
        args.sets.retain(|set| {
            let key = set.split('=').next().unwrap_or("").trim();
            values.iter().all(|(name, _)| *name != key)
        });
        args.sets
            .extend(values.iter().map(|(key, value)| format!("{key}={value}")));
        Job::new(&args)
    }

    /// A subject for timing that draws as a user sees it.
    ///
    /// # Errors
    /// As [`Renderer::new`].
    pub fn subject(&self, job: &Job, time: f64) -> Result<timing::Subject, CliError> {
        Ok(timing::Subject {
            renderer: Renderer::new(
                &self.gpu,
                job.catalog.set(),
                &job.options,
                self.size,
                Output::Display,
            )?,
            view: job.view(time, self.size)?,
        })
    }

    /// The picture of a job as linear radiance, the mean of `samples` x `samples` rays a pixel. Rays of more than one a
    /// pixel are spread evenly: the picture is drawn larger and averaged.
    ///
    /// # Errors
    /// Faults of the device; a size beyond its limit.
    pub fn picture(&self, job: &Job, time: f64, samples: u32) -> Result<Picture, CliError> {
        let size = Size {
            width: self.size.width * samples,
            height: self.size.height * samples,
        };
        let mut renderer = Renderer::new(
            &self.gpu,
            job.catalog.set(),
            &job.options,
            size,
            Output::Linear,
        )?;
        let view: View = job.view(time, size)?;
        renderer.warm_up(&view)?;
        renderer.draw(&view, Tiling::Adaptive, &mut |_| {})?;
        let rgb: Vec<f32> = renderer
            .read_rgba32()?
            .chunks_exact(4)
            .flat_map(|p| [p[0], p[1], p[2]])
            .collect();
        Picture::new(size.width as usize, size.height as usize, rgb)?.averaged(samples as usize)
    }

    /// [`Bench::picture`], kept in the cache's folder under a name that shaders, values, view, size and device make.
    ///
    /// # Errors
    /// As [`Bench::picture`], and a folder that cannot be written.
    pub fn reference(&self, job: &Job, time: f64, samples: u32) -> Result<Picture, CliError> {
        let Some(folder) = &self.cache else {
            return self.picture(job, time, samples);
        };
        let set = job.catalog.set();
        let program = set.scene(&job.options.scene)?.program.to_string();
        let variant = set.get(&program, &job.settings.features())?;
        let mut hasher = DefaultHasher::new();
        for stage in variant.stages.iter() {
            stage.wgsl.hash(&mut hasher);
        }
        for (key, value) in job.settings.iter() {
            (key, value.to_string()).hash(&mut hasher);
        }
        let info = self.gpu.adapter.get_info();
        (info.name, info.driver_info, samples).hash(&mut hasher);
        format!("{:?}", job.view(time, self.size)?).hash(&mut hasher);
        let file = folder.join(format!("{:016x}_{}.radiance", hasher.finish(), self.size));
        let (width, height) = (self.size.width as usize, self.size.height as usize);
        if let Ok(bytes) = std::fs::read(&file) {
            let rgb = bytes
                .chunks_exact(4)
                .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
                .collect();
            if let Ok(picture) = Picture::new(width, height, rgb) {
                return Ok(picture);
            }
        }
        let picture = self.picture(job, time, samples)?;
        let bytes: Vec<u8> = picture.rgb.iter().flat_map(|v| v.to_le_bytes()).collect();
        std::fs::create_dir_all(folder).map_err(|e| CliError::write(folder, e))?;
        std::fs::write(&file, bytes).map_err(|e| CliError::write(&file, e))?;
        Ok(picture)
    }

    /// The exposure that a job's pictures are shown with.
    pub fn exposure(&self, job: &Job) -> f64 {
        job.settings.number("EXPOSURE").unwrap_or(1.0)
    }

    /// Whether a driver that ends loops after 65,535 rounds (llvmpipe, over all loops of eight pixels) may cut a picture short.
    /// `counts` are mean and maximum a pixel of noise, density, light and air samples; a sample is about a round, and the
    /// six octaves of a cloud's density are none.
    ///
    /// # Errors
    /// [`CliError::Argument`] that names `what` and the rounds that it takes.
    pub fn check_loops(&self, what: &str, counts: &[(f64, f64); 4]) -> Result<(), CliError> {
        const LIMIT: f64 = 65_535.0;
        let [noise, density, light, air] = counts.map(|c| c.1);
        let rounds = (noise - 6.0 * (density + light)).max(0.0) + density + light + air;
        if self.gpu.adapter.get_info().name.contains("llvmpipe") && rounds > LIMIT {
            return Err(CliError::argument(
                "--knob",
                format!("{what}, about {rounds:.0} rounds of loops in a pixel"),
                format!(
                    "at most {LIMIT:.0} on this driver, which ends all loops there and says nothing"
                ),
            ));
        }
        Ok(())
    }

    /// What was run on which machine, as the head of a JSON document.
    pub fn head(&self, command: &str) -> serde_json::Value {
        let info: wgpu::AdapterInfo = self.gpu.adapter.get_info();
        serde_json::json!({
            "command": command,
            "adapter": info.name,
            "backend": info.backend.to_string(),
            "driver": info.driver,
            "driver_info": info.driver_info,
            "processor": processor(),
            "clock": self.clock.describe(),
            "size": [self.size.width, self.size.height],
        })
    }

    /// Device, driver, processor and clock, as lines of a document.
    pub fn machine(&self) -> String {
        format!(
            "{}- clock: {}; pictures {}\n",
            device_lines(&self.gpu),
            self.clock.describe(),
            self.size,
        )
    }
}

/// Device, driver and processor, as lines of a document.
pub fn device_lines(gpu: &Gpu) -> String {
    let info: wgpu::AdapterInfo = gpu.adapter.get_info();
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    format!(
        "- device: {}, {} ({:?}), {} {}\n- processor: {}, {threads} threads\n",
        info.name,
        info.backend,
        info.device_type,
        info.driver,
        info.driver_info,
        processor(),
    )
}

/// The processor's name, where the system tells.
fn processor() -> String {
    std::fs::read_to_string("/proc/cpuinfo")
        .ok()
        .and_then(|text| {
            let line = text.lines().find(|l| l.starts_with("model name"))?;
            Some(line.split_once(':')?.1.trim().to_owned())
        })
        .unwrap_or_else(|| std::env::consts::ARCH.to_owned())
}

/// A table in Markdown: the first row is the head, and the columns are as wide as their widest cell, except the last.
pub fn table(rows: &[Vec<String>]) -> String {
    let columns = rows.first().map_or(0, Vec::len);
    let width = |c: usize| {
        rows.iter()
            .filter_map(|r| r.get(c))
            .map(|t| t.chars().count())
            .max()
            .unwrap_or(0)
    };
    let mut widths: Vec<usize> = (0..columns).map(width).collect();
    if let (Some(last), Some(head)) = (widths.last_mut(), rows.first().and_then(|r| r.last())) {
        *last = head.chars().count();
    }
    let mut text = String::new();
    for (i, row) in rows.iter().enumerate() {
        for (cell, width) in row.iter().zip(&widths) {
            text += &format!("| {cell:width$} ");
        }
        text += "|\n";
        if i == 0 {
            for width in &widths {
                text += &format!("|{}", "-".repeat(width + 2));
            }
            text += "|\n";
        }
    }
    text
}

/// The heads of [`judged_cells`].
pub const JUDGED: [&str; 8] = [
    "noise",
    "density",
    "light",
    "air",
    "PSNR [dB]",
    "FLIP",
    "rel. RMSE",
    "worst pixel",
];

/// A picture's counts a pixel and its distance from a reference, as cells of a table.
pub fn judged_cells(counts: &[f64; 4], difference: &Difference) -> Vec<String> {
    let d = difference;
    let mut cells: Vec<String> = counts.iter().map(|c| format!("{c:.1}")).collect();
    cells.extend([
        decibels(d.psnr),
        d.flip.map_or("-".to_owned(), |f| format!("{f:.4}")),
        format!("{:.5}", d.relative_rmse),
        format!("{} at ({}, {})", d.worst.steps, d.worst.x, d.worst.y),
    ]);
    cells
}

/// The same as members of `object`.
pub fn judged_json(object: &mut serde_json::Value, counts: &[f64; 4], difference: &Difference) {
    for (name, count) in JUDGED.iter().zip(counts) {
        object[*name] = (*count).into();
    }
    let d = difference;
    object["psnr_db"] = d.psnr.into();
    object["flip"] = d.flip.into();
    object["relative_rmse"] = d.relative_rmse.into();
    object["worst"] = serde_json::json!({ "x": d.worst.x, "y": d.worst.y, "steps": d.worst.steps });
}

/// A decibel figure; equal pictures have none.
pub fn decibels(psnr: f64) -> String {
    if psnr.is_finite() {
        format!("{psnr:.2}")
    } else {
        "equal".to_owned()
    }
}

/// The indices of what nothing else beats in both: less time and less error, by time.
pub fn pareto(points: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|a, b| {
        points[*a]
            .0
            .total_cmp(&points[*b].0)
            .then(points[*a].1.total_cmp(&points[*b].1))
    });
    let mut least = f64::INFINITY;
    order.retain(|k| {
        let better = points[*k].1 < least;
        least = least.min(points[*k].1);
        better
    });
    order
}

/// Pictures of one size side by side, rows from the top, white between them; 8-bit RGB with its width and height.
pub fn side_by_side(pictures: &[Vec<u8>], width: usize, height: usize) -> (u32, u32, Vec<u8>) {
    const GAP: usize = 4;
    let total = pictures.len() * width + pictures.len().saturating_sub(1) * GAP;
    let mut rgb = vec![255; 3 * total * height];
    for (k, picture) in pictures.iter().enumerate() {
        for (y, row) in picture.chunks_exact(3 * width).take(height).enumerate() {
            let at = 3 * (y * total + k * (width + GAP));
            rgb[at..at + row.len()].copy_from_slice(row);
        }
    }
    (total as u32, height as u32, rgb)
}

/// Writes a file of text.
///
/// # Errors
/// [`CliError::Write`].
pub fn write_text(path: &Path, text: &str) -> Result<(), CliError> {
    std::fs::write(path, text).map_err(|e| CliError::write(path, e))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_is_what_nothing_beats() {
        let points = [
            (1.0, 5.0),
            (2.0, 5.0),
            (2.0, 3.0),
            (3.0, 4.0),
            (4.0, 1.0),
            (0.5, 9.0),
        ];
        assert_eq!(pareto(&points), [5, 0, 2, 4]);
        assert_eq!(pareto(&[]), [0; 0]);
    }

    #[test]
    fn tables_are_even() {
        let text = table(&[
            vec!["a".into(), "long".into()],
            vec!["wide one".into(), "1".into()],
        ]);
        assert_eq!(
            text,
            "| a        | long |\n|----------|------|\n| wide one | 1    |\n"
        );
    }

    #[test]
    fn pictures_stand_side_by_side() {
        let (w, h, rgb) = side_by_side(&[vec![1; 6], vec![2; 6]], 1, 2);
        assert_eq!((w, h, rgb.len()), (6, 2, 36));
        assert_eq!((rgb[0], rgb[3], rgb[15], rgb[18]), (1, 255, 2, 1));
    }
}
