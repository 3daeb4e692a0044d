//! Maps from files: PNG, OpenEXR and NPY, of one number a texel or of two.

use std::path::Path;

/// Bytes of a file at most: a map of 16384 x 16384 numbers of 8 bytes, and a header.
const MOST_BYTES: u64 = (1 << 31) + (1 << 16);

/// Texels of a row, and the numbers of all, texel after texel; or what is wrong with the file.
pub(crate) type Found = Result<(usize, Vec<f32>), String>;

/// What a texel holds.
pub(crate) struct Channels {
    /// Numbers of a texel, 1 or 2.
    count: usize,
    /// What OpenEXR calls them, by preference; a file of one channel has that of one.
    names: &'static [&'static [&'static str]],
}

impl Channels {
    /// One height.
    pub const HEIGHT: Channels = Channels {
        count: 1,
        names: &[&["Y"], &["Z"], &["height"]],
    };
    /// Coverage and kind of clouds.
    pub const WEATHER: Channels = Channels {
        count: 2,
        names: &[&["coverage", "kind"], &["R", "G"]],
    };
}

fn png(bytes: &[u8], channels: &Channels) -> Found {
    let words = |e: png::DecodingError| e.to_string();
    let decoder = png::Decoder::new(std::io::Cursor::new(bytes));
    let mut reader = decoder.read_info().map_err(words)?;
    let (color, depth) = reader.output_color_type();
    let (fits, domain) = match channels.count {
        1 => (
            color == png::ColorType::Grayscale,
            "Grayscale: one number each",
        ),
        _ => (
            !matches!(color, png::ColorType::Grayscale | png::ColorType::Indexed),
            "Rgb, Rgba or GrayscaleAlpha, of which the first two numbers count",
        ),
    };
    if !fits {
        return Err(format!("its pixels are {color:?}, but must be {domain}"));
    }
    let wide = match depth {
        png::BitDepth::Eight => false,
        png::BitDepth::Sixteen => true,
        other => {
            return Err(format!(
                "it has {other:?} bits a pixel, but 8 or 16 must be"
            ));
        }
    };
    let size = reader.output_buffer_size().ok_or("it is too large")?;
    let mut data = vec![0; size];
    let frame = reader.next_frame(&mut data).map_err(words)?;
    let data = &data[..frame.buffer_size()];
    let numbers: Vec<f32> = if wide {
        data.chunks_exact(2)
            .map(|b| f32::from(u16::from_be_bytes([b[0], b[1]])) / 65535.0)
            .collect()
    } else {
        data.iter().map(|b| f32::from(*b) / 255.0).collect()
    };
    let texels = numbers.chunks_exact(color.samples());
    let values = texels.flat_map(|t| &t[..channels.count]).copied();
    Ok((frame.width as usize, values.collect()))
}

fn exr(bytes: &[u8], channels: &Channels) -> Found {
    use exr::prelude::{FlatSamples, ReadChannels as _, ReadLayers as _};
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(std::io::Cursor::new(bytes))
        .map_err(|e| e.to_string())?;
    let layer = image.layer_data;
    let list = layer.channel_data.list;
    let names: Vec<String> = list.iter().map(|c| c.name.to_string()).collect();
    let wanted = if list.len() == channels.count && channels.count == 1 {
        Some(vec![0])
    } else {
        channels.names.iter().find_map(|wanted| {
            let at = |n: &&str| names.iter().position(|have| have == n);
            wanted.iter().map(at).collect()
        })
    };
    let Some(wanted) = wanted else {
        let known: Vec<String> = channels.names.iter().map(|n| n.join(" and ")).collect();
        let alone = if channels.count == 1 {
            "one alone, or "
        } else {
            ""
        };
        return Err(format!(
            "its channels are {}, but there must be {alone}{}",
            names.join(", "),
            known.join(", or ")
        ));
    };
    let found: Vec<Vec<f32>> = wanted
        .into_iter()
        .map(|at: usize| match &list[at].sample_data {
            FlatSamples::F16(v) => v.iter().map(|h| h.to_f32()).collect(),
            FlatSamples::F32(v) => v.clone(),
            FlatSamples::U32(v) => v.iter().map(|h| *h as f32).collect(),
        })
        .collect();
    let values = (0..found[0].len()).flat_map(|k| found.iter().map(move |c| c[k]));
    Ok((layer.size.width(), values.collect()))
}

/// What follows a key of the header, up to the next comma outside of brackets or its end.
fn entry<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    let at = header.find(&format!("'{key}'"))?;
    let rest = header[at..].split_once(':')?.1.trim_start();
    let end = if rest.starts_with('(') {
        rest.find(')')? + 1
    } else {
        rest.find([',', '}'])?
    };
    Some(rest[..end].trim())
}

fn npy(bytes: &[u8], channels: &Channels) -> Found {
    let none = || "it is no NPY file".to_owned();
    if bytes.len() < 12 || &bytes[..6] != b"\x93NUMPY" {
        return Err(none());
    }
    let (from, length): (usize, usize) = match bytes[6] {
        1 => (10, usize::from(u16::from_le_bytes([bytes[8], bytes[9]]))),
        2 | 3 => {
            let word = u32::from_le_bytes([bytes[8], bytes[9], bytes[10], bytes[11]]);
            (12, word as usize)
        }
        _ => return Err(none()),
    };
    let header = from
        .checked_add(length)
        .and_then(|end| bytes.get(from..end));
    let header = header.ok_or_else(none)?;
    let data = &bytes[from + length..];
    let header = std::str::from_utf8(header).map_err(|_| none())?;
    let known = |key: &str| entry(header, key).ok_or_else(|| format!("its header has no `{key}`"));
    let kind = known("descr")?.trim_matches('\'');
    let shape: Vec<usize> = known("shape")?
        .trim_matches(['(', ')'])
        .split(',')
        .map(str::trim)
        .filter(|n| !n.is_empty())
        .map(|n| n.parse().map_err(|_| none()))
        .collect::<Result<_, _>>()?;
    let (rows, width) = match (&shape[..], channels.count) {
        (&[rows, width], 1) => (rows, width),
        (&[rows, width, 2], 2) => (rows, width),
        (_, 1) => {
            return Err(format!(
                "its shape is {shape:?}, but must be (rows, columns)"
            ));
        }
        _ => {
            return Err(format!(
                "its shape is {shape:?}, but must be (rows, columns, 2)"
            ));
        }
    };
    if known("fortran_order")? != "False" {
        return Err("its numbers must lie in C order (numpy.ascontiguousarray)".to_owned());
    }
    let big = kind.starts_with('>');
    macro_rules! numbers {
        ($ty:ty) => {{
            const SIZE: usize = size_of::<$ty>();
            let size = SIZE * channels.count;
            let needed = rows.checked_mul(width).and_then(|n| n.checked_mul(size));
            if needed != Some(data.len()) {
                return Err(format!(
                    "{rows} x {width} texels of {size} bytes do not fill its {} bytes",
                    data.len()
                ));
            }
            data.chunks_exact(SIZE)
                .map(|b| {
                    let mut word = [0; SIZE];
                    word.copy_from_slice(b);
                    if big {
                        <$ty>::from_be_bytes(word) as f32
                    } else {
                        <$ty>::from_le_bytes(word) as f32
                    }
                })
                .collect()
        }};
    }
    let values: Vec<f32> = match kind.trim_start_matches(['<', '>', '|', '=']) {
        "f4" => numbers!(f32),
        "f8" => numbers!(f64),
        "u1" => numbers!(u8),
        "u2" => numbers!(u16),
        "i2" => numbers!(i16),
        "i4" => numbers!(i32),
        other => {
            return Err(format!(
                "its type is {other}, but must be f4, f8, u1, u2, i2 or i4"
            ));
        }
    };
    Ok((width, values))
}

/// Reads a map's file: its kind is that of its name.
pub(crate) fn decode(path: &Path, channels: &Channels) -> Found {
    let ending = path
        .extension()
        .map(|e| e.to_string_lossy().to_ascii_lowercase());
    let decode = match ending.as_deref() {
        Some("png") => png,
        Some("exr") => exr,
        Some("npy") => npy,
        _ => return Err("its name must end in .png, .exr or .npy".to_owned()),
    };
    let size = std::fs::metadata(path).map_err(|e| e.to_string())?.len();
    if size > MOST_BYTES {
        return Err(format!("its {size} bytes are more than {MOST_BYTES}"));
    }
    let bytes = std::fs::read(path).map_err(|e| e.to_string())?;
    decode(&bytes, channels)
}
