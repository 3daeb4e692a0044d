//! `veduta diff`: how far a picture is from another.

use std::path::{Path, PathBuf};

use serde_json::json;
use veduta::reference::post::decode_srgb;

use crate::bench::table;
use crate::commands::render::write_json;
use crate::error::CliError;
use crate::image::{check_folder, check_output, read_exr, read_png, write_png};
use crate::metrics::{Difference, Picture, amplified};

/// Arguments of `veduta diff`.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct DiffArgs {
    /// The picture, .png or .exr
    #[arg(value_name = "PICTURE")]
    pub picture: PathBuf,
    /// What it should be, of the same size and kind
    #[arg(value_name = "REFERENCE")]
    pub reference: PathBuf,
    /// The exposure that linear pictures are shown with for PSNR and FLIP, from 0
    #[arg(long, default_value_t = 1.0)]
    pub exposure: f64,
    /// A file for the numbers
    #[arg(long, value_name = "FILE.json")]
    pub json: Option<PathBuf>,
    /// A file for eight times the difference around middle grey
    #[arg(long, value_name = "FILE.png")]
    pub out: Option<PathBuf>,
}

/// A picture as it is shown, and its light.
struct Shown {
    width: usize,
    height: usize,
    display: Vec<u8>,
    light: Vec<f32>,
    linear: bool,
}

impl Shown {
    fn read(path: &Path, exposure: f64) -> Result<Shown, CliError> {
        let ending = path.extension().map(|e| e.to_ascii_lowercase());
        if ending.as_deref() == Some("exr".as_ref()) {
            let (width, height, rgb) = read_exr(path)?;
            if let Some(at) = rgb.iter().position(|v| !v.is_finite()) {
                return Err(CliError::argument(
                    path.display().to_string(),
                    format!("{} at ({}, {})", rgb[at], at / 3 % width, at / 3 / width),
                    "finite",
                ));
            }
            let picture = Picture::new(width, height, rgb)?;
            return Ok(Shown {
                width,
                height,
                display: picture.display(exposure),
                light: picture.rgb,
                linear: true,
            });
        }
        if ending.as_deref() != Some("png".as_ref()) {
            return Err(CliError::argument(
                "PICTURE",
                path.display().to_string(),
                "a file whose name ends with .png or .exr",
            ));
        }
        let (width, height, display) = read_png(path)?;
        let light = display
            .chunks_exact(3)
            .flat_map(|p| decode_srgb([p[0], p[1], p[2]].map(|v| f64::from(v) / 255.0)))
            .map(|v| v as f32)
            .collect();
        Ok(Shown {
            width,
            height,
            display,
            light,
            linear: false,
        })
    }
}

/// Runs the command.
///
/// # Errors
/// [`CliError`] for files that cannot be read, pictures of different sizes or kinds, and an exposure out of its domain.
pub fn run(args: &DiffArgs) -> Result<(), CliError> {
    if !(args.exposure >= 0.0 && args.exposure.is_finite()) {
        return Err(CliError::argument(
            "--exposure",
            args.exposure.to_string(),
            "finite and at least 0",
        ));
    }
    if let Some(path) = &args.out {
        check_output("--out", path, "png")?;
    }
    if let Some(path) = &args.json {
        check_folder(path)?;
    }
    let shown = Shown::read(&args.picture, args.exposure)?;
    let wanted = Shown::read(&args.reference, args.exposure)?;
    let kind = |s: &Shown| {
        let kind = if s.linear { "linear" } else { "8 bits" };
        format!("{}x{}, {kind}", s.width, s.height)
    };
    if kind(&shown) != kind(&wanted) {
        return Err(CliError::argument(
            "PICTURE",
            kind(&shown),
            format!("{} as its reference", kind(&wanted)),
        ));
    }
    let difference = Difference::of_display(
        shown.width,
        shown.height,
        &shown.display,
        &wanted.display,
        crate::metrics::relative_rmse(&shown.light, &wanted.light),
    );
    let d = &difference;
    let rows = [
        ["measure".to_owned(), "value".to_owned()],
        ["PSNR [dB]".to_owned(), crate::bench::decibels(d.psnr)],
        [
            "FLIP".to_owned(),
            d.flip.map_or("-".to_owned(), |f| format!("{f:.5}")),
        ],
        [
            "relative RMSE".to_owned(),
            format!("{:.6}", d.relative_rmse),
        ],
        [
            "worst pixel".to_owned(),
            format!("{} of 255 at ({}, {})", d.worst.steps, d.worst.x, d.worst.y),
        ],
    ]
    .map(|r| r.to_vec());
    print!("{}", table(&rows));
    if let Some(path) = &args.json {
        let finite = d.psnr.is_finite().then_some(d.psnr);
        write_json(
            path,
            &json!({
                "psnr_db": finite, "equal": finite.is_none(), "flip": d.flip, "relative_rmse": d.relative_rmse,
                "worst": { "x": d.worst.x, "y": d.worst.y, "steps": d.worst.steps },
            }),
        )?;
    }
    if let Some(path) = &args.out {
        let bytes = amplified(&shown.display, &wanted.display);
        write_png(path, shown.width as u32, shown.height as u32, &bytes)?;
    }
    Ok(())
}
