//! How far pictures are from one another.

use crate::error::CliError;

/// A picture of linear radiance: red, green and blue of every pixel, rows from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `3 width height` numbers.
    pub rgb: Vec<f32>,
}

/// The pixel that differs most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Worst {
    /// Column from the left.
    pub x: usize,
    /// Row from the top.
    pub y: usize,
    /// Largest difference of its channels, in steps of the 8-bit picture.
    pub steps: u8,
}

/// What separates a picture from its reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// Of the 8-bit pictures, in dB; infinite for equal ones.
    pub psnr: f64,
    /// Of the radiance: root of the mean square difference over that of the mean square of the reference.
    pub relative_rmse: f64,
    /// Mean FLIP error of the 8-bit pictures, 0 the same to 1; `None` in a build without the feature `flip`.
    pub flip: Option<f64>,
    /// The pixel that differs most.
    pub worst: Worst,
}

impl Picture {
    /// A picture of `rgb`.
    ///
    /// # Errors
    /// [`CliError::Argument`] when the numbers are not `3 width height` or a side is 0.
    pub fn new(width: usize, height: usize, rgb: Vec<f32>) -> Result<Picture, CliError> {
        if width == 0 || height == 0 || rgb.len() != 3 * width * height {
            return Err(CliError::argument(
                "picture",
                format!("{} numbers", rgb.len()),
                format!("3 x {width} x {height} of them, no side 0"),
            ));
        }
        Ok(Picture { width, height, rgb })
    }

    /// The mean of every square of `samples` x `samples` pixels.
    ///
    /// # Errors
    /// [`CliError::Argument`] when the sides are no multiples of `samples`.
    pub fn averaged(&self, samples: usize) -> Result<Picture, CliError> {
        if samples == 0
            || !self.width.is_multiple_of(samples)
            || !self.height.is_multiple_of(samples)
        {
            return Err(CliError::argument(
                "samples",
                samples.to_string(),
                format!("a divisor of {} and {}", self.width, self.height),
            ));
        }
        let (width, height) = (self.width / samples, self.height / samples);
        let share = 1.0 / (samples * samples) as f64;
        let mut rgb = Vec::with_capacity(3 * width * height);
        for y in 0..height {
            for x in 0..width {
                for channel in 0..3 {
                    let mut sum = 0.0;
                    for row in y * samples..(y + 1) * samples {
                        for column in x * samples..(x + 1) * samples {
                            sum += f64::from(self.rgb[3 * (row * self.width + column) + channel]);
                        }
                    }
                    rgb.push((sum * share) as f32);
                }
            }
        }
        Picture::new(width, height, rgb)
    }

    /// The 8-bit picture: exponential tone map, sRGB transfer, rounded, without dither.
    pub fn display(&self, exposure: f64) -> Vec<u8> {
        use veduta::reference::{post::encode_srgb, tone_map::exponential};
        self.rgb
            .chunks_exact(3)
            .flat_map(|p| {
                let color = [p[0], p[1], p[2]].map(f64::from);
                encode_srgb(exponential(color, exposure)).map(|c| (255.0 * c).round() as u8)
            })
            .collect()
    }

    /// The difference from a reference of the same size; both are shown with `exposure`.
    ///
    /// # Errors
    /// [`CliError::Argument`] for pictures of different sizes.
    pub fn difference(&self, reference: &Picture, exposure: f64) -> Result<Difference, CliError> {
        if (self.width, self.height) != (reference.width, reference.height) {
            return Err(CliError::argument(
                "picture",
                format!("{}x{}", self.width, self.height),
                format!("{}x{} as its reference", reference.width, reference.height),
            ));
        }
        Ok(Difference::of_display(
            self.width,
            self.height,
            &self.display(exposure),
            &reference.display(exposure),
            relative_rmse(&self.rgb, &reference.rgb),
        ))
    }
}

impl Difference {
    /// Of two 8-bit RGB pictures of `width` x `height` pixels, and a relative RMSE that is known.
    pub fn of_display(
        width: usize,
        height: usize,
        shown: &[u8],
        wanted: &[u8],
        relative_rmse: f64,
    ) -> Difference {
        let mut worst = Worst {
            x: 0,
            y: 0,
            steps: 0,
        };
        for (i, (a, b)) in shown.iter().zip(wanted).enumerate() {
            let steps = a.abs_diff(*b);
            if steps > worst.steps {
                let pixel = i / 3;
                worst = Worst {
                    x: pixel % width.max(1),
                    y: pixel / width.max(1),
                    steps,
                };
            }
        }
        Difference {
            psnr: psnr(shown, wanted),
            relative_rmse,
            flip: flip(wanted, shown, width, height),
            worst,
        }
    }
}

/// Eight times the difference of 8-bit pictures around middle grey.
pub fn amplified(shown: &[u8], wanted: &[u8]) -> Vec<u8> {
    shown
        .iter()
        .zip(wanted)
        .map(|(a, b)| (128 + 8 * (i32::from(*a) - i32::from(*b))).clamp(0, 255) as u8)
        .collect()
}

/// Peak signal-to-noise ratio of 8-bit values in dB, of the mean square difference over all channels; infinite for equal
/// ones and for none.
pub fn psnr(a: &[u8], b: &[u8]) -> f64 {
    let sum: f64 = a
        .iter()
        .zip(b)
        .map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2))
        .sum();
    if sum == 0.0 {
        return f64::INFINITY;
    }
    10.0 * (255.0_f64.powi(2) * a.len().min(b.len()) as f64 / sum).log10()
}

/// Root mean square difference over the root mean square of the reference; 0 over 0 is 0.
///
/// Both are cut at 16 times the value that 1 % of the reference exceed: a pixel of the sun's disc, ten thousand times as bright
/// as the sky, would otherwise outweigh all others.
pub fn relative_rmse(a: &[f32], reference: &[f32]) -> f64 {
    let mut sorted = reference.to_vec();
    sorted.sort_by(f32::total_cmp);
    let bright = sorted.get(sorted.len() * 99 / 100).copied().unwrap_or(0.0);
    let limit = if bright > 0.0 {
        16.0 * f64::from(bright)
    } else {
        f64::INFINITY
    };
    let square = |x: f64| x * x;
    let cut = |x: &f32| f64::from(*x).min(limit);
    let difference: f64 = a
        .iter()
        .zip(reference)
        .map(|(a, r)| square(cut(a) - cut(r)))
        .sum();
    let size: f64 = reference.iter().map(|r| square(cut(r))).sum();
    if difference == 0.0 {
        0.0
    } else {
        (difference / size).sqrt()
    }
}

/// Mean FLIP error (low dynamic range, 67 pixels a degree) of two 8-bit sRGB pictures.
#[cfg(feature = "flip")]
pub fn flip(reference: &[u8], test: &[u8], width: usize, height: usize) -> Option<f64> {
    use nv_flip::{DEFAULT_PIXELS_PER_DEGREE, FlipImageRgb8, FlipPool};
    let (w, h) = (u32::try_from(width).ok()?, u32::try_from(height).ok()?);
    if reference.len() != 3 * width * height
        || test.len() != reference.len()
        || reference.is_empty()
    {
        return None;
    }
    let image = |bytes| FlipImageRgb8::with_data(w, h, bytes);
    let error = nv_flip::flip(image(reference), image(test), DEFAULT_PIXELS_PER_DEGREE);
    Some(f64::from(FlipPool::from_image(&error).mean()))
}

/// Mean FLIP error; this build has no FLIP.
#[cfg(not(feature = "flip"))]
pub fn flip(_reference: &[u8], _test: &[u8], _width: usize, _height: usize) -> Option<f64> {
    None
}

/// What separates two sets of distances to the first surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthDifference {
    /// Rays that hit in one and miss in the other.
    pub flips: usize,
    /// Rays that hit in both.
    pub both: usize,
    /// Of those: the middle relative difference of the distances.
    pub median: f64,
    /// The relative difference that 1 % of them exceed.
    pub percentile_99: f64,
    /// The largest.
    pub largest: f64,
}

/// Compares distances ray by ray; one that is negative or not finite is a miss.
pub fn depth_difference(depths: &[f64], reference: &[f64]) -> DepthDifference {
    let hit = |d: f64| d >= 0.0 && d.is_finite();
    let mut flips = 0;
    let mut errors = Vec::new();
    for (d, r) in depths.iter().zip(reference) {
        match (hit(*d), hit(*r)) {
            (true, true) if d == r => errors.push(0.0),
            (true, true) => errors.push((d - r).abs() / r.max(f64::MIN_POSITIVE)),
            (false, false) => {}
            _ => flips += 1,
        }
    }
    errors.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let index = (share * errors.len() as f64) as usize;
        errors
            .get(index.min(errors.len().saturating_sub(1)))
            .copied()
            .unwrap_or(0.0)
    };
    DepthDifference {
        flips,
        both: errors.len(),
        median: at(0.5),
        percentile_99: at(0.99),
        largest: at(1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gradient(width: usize, height: usize) -> Picture {
        let rgb = (0..3 * width * height)
            .map(|i| (i % 97) as f32 / 50.0)
            .collect();
        Picture::new(width, height, rgb).unwrap()
    }

    #[test]
    fn an_offset_of_one_step_is_48_13_db() {
        let a: Vec<u8> = (0..=254).collect();
        let b: Vec<u8> = a.iter().map(|v| v + 1).collect();
        assert!((psnr(&a, &b) - 48.130_803).abs() < 1e-6);
        // Only one channel of three: a third of the mean square.
        let c: Vec<u8> = a
            .iter()
            .enumerate()
            .map(|(i, v)| v + u8::from(i % 3 == 0))
            .collect();
        assert!((psnr(&a, &c) - (48.130_803 + 10.0 * 3_f64.log10())).abs() < 1e-3);
        assert_eq!(psnr(&a, &a), f64::INFINITY);
    }

    #[test]
    fn relative_rmse_of_scaled_radiance_is_the_scale() {
        let a = gradient(10, 7).rgb;
        let b: Vec<f32> = a.iter().map(|v| v * 1.01).collect();
        assert!((relative_rmse(&b, &a) - 0.01).abs() < 1e-6);
        assert_eq!(relative_rmse(&a, &a), 0.0);
        assert_eq!(relative_rmse(&[0.0], &[0.0]), 0.0);
        assert_eq!(relative_rmse(&[1.0], &[0.0]), f64::INFINITY);
    }

    #[test]
    fn a_pixel_of_the_sun_does_not_outweigh_the_others() {
        let reference = vec![1.0_f32; 3000];
        let mut sun = reference.clone();
        sun[7] = 1e5;
        let mut dim = reference.clone();
        dim.iter_mut().for_each(|v| *v *= 0.5);
        // One of 3000 counts as 16: 15 / sqrt(3000).
        assert!((relative_rmse(&sun, &reference) - 15.0 / 3000_f64.sqrt()).abs() < 1e-6);
        assert!(relative_rmse(&dim, &reference) > relative_rmse(&sun, &reference));
        assert_eq!(relative_rmse(&[1.0], &[0.0]), f64::INFINITY);
    }

    #[test]
    fn the_worst_pixel_has_its_place() {
        let a = gradient(16, 9);
        let mut b = a.clone();
        b.rgb[3 * (4 * 16 + 11) + 1] += 5.0;
        let d = b.difference(&a, 1.0).unwrap();
        assert_eq!((d.worst.x, d.worst.y), (11, 4));
        assert!(d.worst.steps > 10 && d.psnr < 60.0 && d.relative_rmse > 0.0);
        let same = a.difference(&a, 1.0).unwrap();
        assert_eq!(
            (same.psnr, same.relative_rmse, same.worst.steps),
            (f64::INFINITY, 0.0, 0)
        );
        assert!(a.difference(&gradient(9, 16), 1.0).is_err());
    }

    #[cfg(feature = "flip")]
    #[test]
    fn flip_is_0_of_equal_pictures_and_large_of_black_and_white() {
        let (black, white) = (vec![0; 3 * 32 * 32], vec![255; 3 * 32 * 32]);
        assert_eq!(flip(&black, &black, 32, 32), Some(0.0));
        assert!(flip(&black, &white, 32, 32).unwrap() > 0.9);
        // A slight change is a slight error, and more of it is more.
        let gray = |v| vec![v; 3 * 32 * 32];
        let [a, b] = [102, 120].map(|v| flip(&gray(100), &gray(v), 32, 32).unwrap());
        assert!(a > 0.0 && a < b && b < 0.3, "{a} {b}");
    }

    #[test]
    fn squares_are_averaged() {
        let mut p = gradient(4, 2);
        p.rgb = (0..24).map(|i| i as f32).collect();
        let q = p.averaged(2).unwrap();
        assert_eq!((q.width, q.height), (2, 1));
        // Red of the pixels 0, 1, 4, 5: 0, 3, 12, 15.
        assert_eq!(q.rgb[..3], [7.5, 8.5, 9.5]);
        assert!(p.averaged(3).is_err() && p.averaged(0).is_err());
    }

    #[test]
    fn display_ends_at_black_and_white() {
        let p = Picture::new(2, 1, vec![0.0, 0.0, 0.0, 1e6, 1e6, 1e6]).unwrap();
        assert_eq!(p.display(1.0), [0, 0, 0, 255, 255, 255]);
        assert!(Picture::new(2, 1, vec![0.0; 5]).is_err() && Picture::new(0, 1, vec![]).is_err());
    }

    #[test]
    fn hits_and_misses_flip() {
        let reference = [10.0, 20.0, -1.0, f64::INFINITY, 40.0, 0.0];
        let depths = [10.1, 20.0, -2.0, 3.0, f64::NAN, 0.0];
        let d = depth_difference(&depths, &reference);
        assert_eq!((d.flips, d.both, d.median), (2, 3, 0.0));
        assert!((d.largest - 0.01).abs() < 1e-12 && (d.percentile_99 - 0.01).abs() < 1e-12);
        assert_eq!(depth_difference(&[], &[]).both, 0);
    }
}
