//! Bounds over a square of ground: octave by octave, by interval arithmetic.

use std::ops::{Add, Mul};

use super::field::Kind;
use super::ground::{Prepared, strata};
use super::noise::{Place, gradient_noise, octave_seed};
use crate::error::Error;
use crate::view::WorldPos;

/// What holds of a field over a square, as samples of one footprint see it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalBounds {
    /// No height is below (m).
    pub minimum: f64,
    /// No height is above (m).
    pub maximum: f64,
    /// No slope is steeper (rise over run), where there is a slope.
    pub lipschitz: f64,
}

/// Squares a side that are bounded one by one: what octaves with cells as wide as the whole square vary is known that closely.
const PARTS: usize = 16;

/// The gradient of gradient noise in 2D changes by no more, per cell: the largest second derivative over all places, directions and vectors is 13.061
/// (of a search over 400 x 400 places and 360 directions, with the worst of all vectors at every corner).
const NOISE_BEND: f64 = 13.2;

/// No gradient noise in 2D is steeper, per cell.
const NOISE_SLOPE: f64 = 2.927;

/// All numbers between two.
#[derive(Debug, Clone, Copy)]
struct Span(f64, f64);

impl Add for Span {
    type Output = Span;
    fn add(self, other: Span) -> Span {
        Span(self.0 + other.0, self.1 + other.1)
    }
}

impl Mul for Span {
    type Output = Span;
    fn mul(self, other: Span) -> Span {
        let all = [
            self.0 * other.0,
            self.0 * other.1,
            self.1 * other.0,
            self.1 * other.1,
        ];
        Span(
            all.into_iter().fold(f64::INFINITY, f64::min),
            all.into_iter().fold(f64::NEG_INFINITY, f64::max),
        )
    }
}

impl Mul<f64> for Span {
    type Output = Span;
    fn mul(self, by: f64) -> Span {
        self * Span(by, by)
    }
}

impl Span {
    /// A value that may lie so far off, but not beyond a size.
    fn around(value: f64, off: f64, most: f64) -> Span {
        Span((value - off).max(-most), (value + off).min(most))
    }

    /// Of a value and what is never below 0.
    fn squared(self) -> Span {
        let far = self.0.abs().max(self.1.abs());
        let near = if self.0 <= 0.0 && self.1 >= 0.0 {
            0.0
        } else {
            self.0.abs().min(self.1.abs())
        };
        Span(near * near, far * far)
    }

    fn joined(self, other: Span) -> Span {
        Span(self.0.min(other.0), self.1.max(other.1))
    }

    fn size(self) -> f64 {
        self.0.abs().max(self.1.abs())
    }
}

/// A value with its slopes along x and z.
type Sloped = [Span; 3];

fn sum(a: Sloped, b: Sloped) -> Sloped {
    std::array::from_fn(|k| a[k] + b[k])
}

fn scaled(a: Sloped, by: f64) -> Sloped {
    a.map(|s| s * by)
}

fn times(a: Sloped, b: Sloped) -> Sloped {
    [
        a[0] * b[0],
        a[0] * b[1] + a[1] * b[0],
        a[0] * b[2] + a[2] * b[0],
    ]
}

/// A weight, which is 1 from 1 on.
fn clipped(a: Sloped) -> Sloped {
    let none = Span(0.0, 0.0);
    let slope = |s: Span| match a[0] {
        Span(low, _) if low >= 1.0 => none,
        Span(_, high) if high >= 1.0 => s.joined(none),
        _ => s,
    };
    [
        Span(a[0].0.min(1.0), a[0].1.min(1.0)),
        slope(a[1]),
        slope(a[2]),
    ]
}

impl Prepared<f64> {
    /// Least and greatest height and steepest slope over the square between `corner` and `size` metres farther along x and z, as samples `footprint` metres wide see the field; 0 takes it as it is.
    /// Nothing over the square exceeds them. Octaves with cells wider than the square are followed closely; finer ones count with all that they can be. Of craters, the mix and maps the
    /// height is bounded by that in the middles of 16 x 16 parts and the slope of the whole field, which is also what is said of their slopes.
    ///
    /// ```
    /// use veduta::WorldPos;
    /// use veduta::terrain::Land;
    /// let field = Land::named("hills")?.field.prepare::<f64>()?;
    /// let corner = WorldPos::from_metres([3000.0, 0.0, -500.0].into());
    /// let over = field.bounds_over(corner, 40.0, 0.0)?;
    /// let height = field.ground(corner, 0.0).height;
    /// assert!(over.minimum <= height && height <= over.maximum);
    /// # Ok::<(), veduta::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for a position that is not finite, a size and a footprint that are not in [0, 1e6] m, and a program's own function of which nothing is said.
    pub fn bounds_over(
        &self,
        corner: WorldPos,
        size: f64,
        footprint: f64,
    ) -> Result<LocalBounds, Error> {
        let fault = |name: &str, value: String, domain: &str| Error::OutOfDomain {
            name: name.to_owned(),
            value,
            domain: domain.to_owned(),
        };
        for (name, value) in [("size", size), ("footprint", footprint)] {
            if !(0.0..=1e6).contains(&value) {
                return Err(fault(name, value.to_string(), "in [0, 1e6] m"));
            }
        }
        if !corner.frac.is_finite() {
            return Err(fault("corner", format!("{corner:?}"), "finite"));
        }
        let Some(all) = self.bounds() else {
            return Err(fault(
                "field.kind.bounds",
                "None".to_owned(),
                "what holds of the program's own function",
            ));
        };
        let whole = LocalBounds {
            minimum: all.minimum,
            maximum: all.maximum,
            lipschitz: all.lipschitz,
        };
        if let Kind::Own { .. } = self.kind() {
            return Ok(whole);
        }
        let eye = self.place(corner);
        let width = size / PARTS as f64;
        let mut over: Option<LocalBounds> = None;
        for k in 0..PARTS * PARTS {
            let middle = [k % PARTS, k / PARTS].map(|i| (i as f64 + 0.5) * width);
            let mut part = self.part(&whole, eye, middle, 0.5 * width, footprint);
            // Below the sea nothing is left of them.
            part.minimum = part.minimum.max(self.sea);
            part.maximum = part.maximum.max(self.sea);
            over = Some(over.map_or(part, |o| LocalBounds {
                minimum: o.minimum.min(part.minimum),
                maximum: o.maximum.max(part.maximum),
                lipschitz: o.lipschitz.max(part.lipschitz),
            }));
        }
        Ok(over.unwrap_or(whole))
    }

    /// The same over a square around a place, so far on each side.
    fn part(
        &self,
        whole: &LocalBounds,
        eye: Place<f64>,
        middle: [f64; 2],
        half: f64,
        footprint: f64,
    ) -> LocalBounds {
        let exact = matches!(
            self.kind(),
            Kind::Fbm | Kind::Hybrid { .. } | Kind::Ridged { .. } | Kind::Mesa { .. }
        );
        // For what rounding takes off.
        let slack = 1e-9 * (whole.maximum - whole.minimum);
        if !exact {
            let height = self.ground_from(eye, middle, footprint).height;
            let off = whole.lipschitz * half * std::f64::consts::SQRT_2 + slack;
            return LocalBounds {
                minimum: (height - off).max(whole.minimum),
                maximum: (height + off).min(whole.maximum),
                lipschitz: whole.lipschitz,
            };
        }
        let cells = middle.map(|m| m / self.wavelength);
        let place = Place::new(eye.cell, std::array::from_fn(|k| eye.frac[k] + cells[k]));
        let [value, x, z] = self.spans(place, half / self.wavelength, footprint);
        let steepness = self.amplitude / self.wavelength;
        LocalBounds {
            minimum: (self.base + self.amplitude * value.0 - slack).max(whole.minimum),
            maximum: (self.base + self.amplitude * value.1 + slack).min(whole.maximum),
            lipschitz: (1.000_001 * steepness * x.size().hypot(z.size())).min(whole.lipschitz),
        }
    }

    /// What [`Prepared::ground_at`] computes, of all places so many cells around one.
    fn spans(&self, start: Place<f64>, half: f64, footprint: f64) -> Sloped {
        let (one, none) = (Span(1.0, 1.0), Span(0.0, 0.0));
        let (mut p, mut half) = (start, half);
        let mut reach = self.wavelength / footprint.max(1e-6);
        let (mut amplitude, mut frequency) = (1.0, 1.0);
        let mut weight = [one, none, none];
        let mut total = [none; 3];
        let [mut tail, mut tail_step, ratio, bend] = self.mean;
        let [mut rough, mut rough_step, rough_ratio, _] = self.lost;
        let mesa = matches!(self.kind(), Kind::Mesa { .. });
        let hybrid = matches!(self.kind(), Kind::Hybrid { .. });
        let first = if mesa { 0.0 } else { tail };
        let mut mean = [Span(first, first), none, none];
        let (mut variance, mut lost) = (tail, rough);
        for i in 0..self.octaves() {
            if reach <= 1.0 {
                break;
            }
            let x = (reach - 1.0).min(1.0);
            let keep = x * x * (3.0 - 2.0 * x);
            let n = gradient_noise(p.shifted(i), octave_seed(self.seed(), i));
            p = p.finer();
            let turn = NOISE_BEND * half * std::f64::consts::SQRT_2;
            let off = (n[1].abs() + n[2].abs()) * half + NOISE_BEND * half * half;
            let noise = [
                Span::around(n[0], off, 1.0),
                Span::around(n[1], turn, NOISE_SLOPE) * frequency,
                Span::around(n[2], turn, NOISE_SLOPE) * frequency,
            ];
            let term = match self.kind() {
                Kind::Ridged { .. } => {
                    let square = noise[0].squared();
                    let size = Span(
                        (square.0 + self.detail).sqrt(),
                        (square.1 + self.detail).sqrt(),
                    );
                    let ridge = one + size * -1.0;
                    // The slope of the size over that of the noise, which never falls.
                    let share = |v: f64| {
                        if v == 0.0 {
                            0.0
                        } else {
                            v / (v * v + self.detail).sqrt()
                        }
                    };
                    let lean = Span(share(noise[0].0), share(noise[0].1));
                    let height = [
                        ridge.squared(),
                        ridge * lean * noise[1] * -2.0,
                        ridge * lean * noise[2] * -2.0,
                    ];
                    let term = times(height, weight);
                    weight = clipped(scaled(term, self.shape));
                    scaled(term, amplitude)
                }
                Kind::Hybrid { .. } => {
                    let lifted = [noise[0] + Span(self.shape, self.shape), noise[1], noise[2]];
                    let term = times(scaled(lifted, amplitude), weight);
                    weight = clipped(term);
                    term
                }
                _ => scaled(noise, amplitude),
            };
            total = sum(total, term);
            if hybrid {
                tail *= ratio;
                rough *= rough_ratio;
            } else {
                tail -= tail_step;
                rough -= rough_step;
            }
            tail_step *= ratio;
            rough_step *= rough_ratio;
            frequency *= 2.0;
            half *= 2.0;
            amplitude *= self.fall;
            reach *= 0.5;
            let left = if i + 1 == self.octaves() { 0.0 } else { 1.0 };
            let means = if mesa { 0.0 } else { left * tail };
            // What follows, given the weight, and its slope.
            let bent = |by: f64| one * (1.0 + bend) + weight[0] * (-by * bend);
            let after = [
                total[0] + bent(1.0) * weight[0] * means,
                total[1] + bent(2.0) * weight[1] * means,
                total[2] + bent(2.0) * weight[2] * means,
            ];
            mean = sum(scaled(mean, 1.0 - keep), scaled(after, keep));
            // Of a sum these do not depend on the place.
            let after_variance = left * tail.max(0.0);
            variance = after_variance + (1.0 - keep * keep) * (variance - after_variance);
            let after_lost = left * rough.max(0.0);
            lost = (after_lost + (1.0 - keep * keep) * (lost - after_lost)).max(0.0);
        }
        if mesa {
            let across = footprint / self.wavelength;
            let within = 0.083_333_333 * across * across * (self.lost[0] - lost).max(0.0);
            let [low, high] = [mean[0].0, mean[0].1]
                .map(|v| strata(v, self.shape, self.detail, variance.max(0.0) + within)[0]);
            // Strata never fall, and are five times as steep as the fBm at the most.
            let steep = Span(0.0, 1.0 + 4.0 * self.detail);
            mean = [Span(low, high), mean[1] * steep, mean[2] * steep];
        }
        mean
    }
}
