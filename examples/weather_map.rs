//! The map of `examples/weather/front.ron`: a wavy line of towers, broken cumulus behind it, few flat clouds before it. Run it with
//! `cargo run --release --example weather_map -- examples/weather/front.png`.

use std::f64::consts::TAU;

type Fallible<T> = Result<T, Box<dyn std::error::Error>>;

/// Texels of an edge.
const EDGE: usize = 64;

/// Coverage and kind at a place of the map, which repeats.
fn weather(x: f64, z: f64) -> [f64; 2] {
    // From the line eastwards, in (-1/2, 1/2].
    let line = 0.5 + 0.06 * (TAU * z).sin() + 0.03 * (2.0 * TAU * z + 1.0).sin();
    let off = x - line - (x - line).round();
    let tower = (-(off / 0.06).powi(2)).exp();
    let behind = if off < 0.0 { 1.0 + 2.0 * off } else { 0.0 };
    let broken = behind * (0.5 + 0.25 * (5.0 * TAU * x).sin() * (4.0 * TAU * z).cos());
    let coverage = (0.25 + 0.75 * tower + 0.5 * broken * (1.0 - tower)).min(1.0);
    let kind = (0.15 + 0.3 * behind).mul_add(1.0 - tower, tower);
    [coverage, kind]
}

fn main() -> Fallible<()> {
    let path = std::env::args().nth(1).unwrap_or("front.png".to_owned());
    let middle = |k: usize| (k as f64 + 0.5) / EDGE as f64;
    let bytes: Vec<u8> = (0..EDGE * EDGE)
        .flat_map(|k| weather(middle(k % EDGE), middle(k / EDGE)))
        .map(|v| (255.0 * v).round() as u8)
        .collect();
    let file = std::io::BufWriter::new(std::fs::File::create(path)?);
    let mut encoder = png::Encoder::new(file, EDGE as u32, EDGE as u32);
    encoder.set_color(png::ColorType::GrayscaleAlpha);
    encoder.set_compression(png::Compression::High);
    encoder.write_header()?.write_image_data(&bytes)?;
    Ok(())
}
