//! Pictures as files: 8-bit PNG and linear OpenEXR.

use std::fs::File;
use std::io::{BufReader, BufWriter};
use std::path::{Path, PathBuf};

use crate::error::CliError;

/// Writes 8-bit RGB, sRGB-encoded, rows from the top.
///
/// # Errors
/// [`CliError::Write`], also when `rgb` does not hold `width * height` pixels.
pub fn write_png(path: &Path, width: u32, height: u32, rgb: &[u8]) -> Result<(), CliError> {
    let file = File::create(path).map_err(|e| CliError::write(path, e))?;
    let mut encoder = png::Encoder::new(BufWriter::new(file), width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let fault = |e: png::EncodingError| CliError::write(path, e);
    let mut writer = encoder.write_header().map_err(fault)?;
    writer.write_image_data(rgb).map_err(fault)?;
    writer.finish().map_err(fault)
}

/// Writes linear RGB as 32-bit floats, rows from the top.
///
/// # Errors
/// [`CliError::Write`], also when `rgb` does not hold `width * height` pixels.
pub fn write_exr(path: &Path, width: u32, height: u32, rgb: &[f32]) -> Result<(), CliError> {
    let (width, height) = (width as usize, height as usize);
    if rgb.len() != 3 * width * height {
        return Err(CliError::write(
            path,
            format!("{} numbers are no {width}x{height} picture", rgb.len()),
        ));
    }
    exr::prelude::write_rgb_file(path, width, height, |x, y| {
        let at = 3 * (y * width + x);
        (rgb[at], rgb[at + 1], rgb[at + 2])
    })
    .map_err(|e| CliError::write(path, e))
}

/// Width, height and 8-bit RGB of a PNG; grey becomes three equal channels, an alpha channel is left out, 16 bits lose the
/// lower ones.
///
/// # Errors
/// [`CliError::Read`] for a file that cannot be read or is no PNG.
pub fn read_png(path: &Path) -> Result<(usize, usize, Vec<u8>), CliError> {
    let fault = |e: png::DecodingError| CliError::read(path, std::io::Error::other(e));
    let file = File::open(path).map_err(|e| CliError::read(path, e))?;
    let mut decoder = png::Decoder::new(BufReader::new(file));
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().map_err(fault)?;
    let size = reader
        .output_buffer_size()
        .ok_or_else(|| CliError::read(path, std::io::Error::other("the picture is too large")))?;
    let mut bytes = vec![0; size];
    let frame = reader.next_frame(&mut bytes).map_err(fault)?;
    let channels = frame.color_type.samples();
    let rgb = bytes
        .get(..frame.buffer_size())
        .unwrap_or(&bytes)
        .chunks_exact(channels)
        .flat_map(|p| {
            if channels < 3 {
                [p[0]; 3]
            } else {
                [p[0], p[1], p[2]]
            }
        })
        .collect();
    Ok((frame.width as usize, frame.height as usize, rgb))
}

/// Width, height and linear RGB of the first layer of an OpenEXR file that has these channels.
///
/// # Errors
/// [`CliError::Read`] for a file that cannot be read or has no such layer.
pub fn read_exr(path: &Path) -> Result<(usize, usize, Vec<f32>), CliError> {
    let image = exr::prelude::read_first_rgba_layer_from_file(
        path,
        |size, _| (size.width(), vec![0.0; 3 * size.width() * size.height()]),
        |(width, rgb): &mut (usize, Vec<f32>), at, (r, g, b, _): (f32, f32, f32, f32)| {
            let first = 3 * (at.y() * *width + at.x());
            if let Some(pixel) = rgb.get_mut(first..first + 3) {
                pixel.copy_from_slice(&[r, g, b]);
            }
        },
    )
    .map_err(|e| CliError::read(path, std::io::Error::other(e.to_string())))?;
    let size = image.layer_data.size;
    Ok((
        size.width(),
        size.height(),
        image.layer_data.channel_data.pixels.1,
    ))
}

/// The path of frame `number`: `picture.png` becomes `picture_0007.png`.
pub fn numbered(path: &Path, number: u32) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name = match path.extension() {
        Some(ending) => format!("{stem}_{number:04}.{}", ending.to_string_lossy()),
        None => format!("{stem}_{number:04}"),
    };
    path.with_file_name(name)
}

/// Fails early when a picture could not be written at the end of long work: wrong ending or missing folder.
///
/// # Errors
/// [`CliError::Argument`] for another ending than `ending`, [`CliError::Write`] for a missing folder.
pub fn check_output(name: &str, path: &Path, ending: &str) -> Result<(), CliError> {
    if path
        .extension()
        .is_none_or(|e| !e.eq_ignore_ascii_case(ending))
    {
        return Err(CliError::argument(
            name,
            path.display().to_string(),
            format!("a path that ends in `.{ending}`"),
        ));
    }
    check_folder(path)
}

/// Fails early when a file could not be written at the end of long work.
///
/// # Errors
/// [`CliError::Write`] for a missing folder and for a path that is a folder.
pub fn check_folder(path: &Path) -> Result<(), CliError> {
    let folder = path.parent().filter(|f| !f.as_os_str().is_empty());
    if folder.is_some_and(|f| !f.is_dir()) {
        return Err(CliError::write(path, "its folder does not exist"));
    }
    if path.is_dir() {
        return Err(CliError::write(path, "it is a folder"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_numbered() {
        assert_eq!(
            numbered(Path::new("a/b.c.png"), 7),
            Path::new("a/b.c_0007.png")
        );
        assert_eq!(numbered(Path::new("b"), 12345), Path::new("b_12345"));
    }
}
