//! The numbers that a field is computed in: `f32` exactly as the device does it, `f64` for accuracy.

use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

/// `f32` or `f64`.
pub trait Real:
    Copy
    + PartialOrd
    + std::fmt::Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
{
    /// The nearest number.
    fn of(value: f64) -> Self;
    /// As `f64`.
    fn wide(self) -> f64;
    /// Square root of a number that is not negative.
    fn root(self) -> Self;
    /// Two numbers whose sum it is, the first of so few digits that it may be multiplied by a whole number below 32,768 exactly.
    fn parts(self) -> (Self, Self);
    /// Largest whole number that is not above.
    fn whole(self) -> Self;
    /// The vector of gradient noise that a random word stands for; see `veduta::noise::gradient`.
    fn vector(word: u32) -> [Self; 2];
    /// The two coordinates that the vectors of noise in 3D have.
    fn sides() -> (Self, Self);

    /// The greater of two.
    #[inline]
    fn most(self, other: Self) -> Self {
        if self > other { self } else { other }
    }

    /// The lesser of two.
    #[inline]
    fn least(self, other: Self) -> Self {
        if self < other { self } else { other }
    }

    /// The size.
    #[inline]
    fn size(self) -> Self {
        if self < Self::of(0.0) { -self } else { self }
    }
}

impl Real for f32 {
    #[inline]
    fn of(value: f64) -> f32 {
        value as f32
    }
    #[inline]
    fn wide(self) -> f64 {
        f64::from(self)
    }
    #[inline]
    fn root(self) -> f32 {
        self.sqrt()
    }
    #[inline]
    fn parts(self) -> (f32, f32) {
        let high = f32::from_bits(self.to_bits() & 0xffff_8000);
        (high, self - high)
    }
    #[inline]
    fn whole(self) -> f32 {
        self.floor()
    }
    #[inline]
    fn sides() -> (f32, f32) {
        (f32::from_bits(0x3f96_c54d), f32::from_bits(0x3f3a_5ce4))
    }
    // The polynomial and the bit operations of the module, in their order.
    #[allow(clippy::excessive_precision)]
    #[inline]
    fn vector(word: u32) -> [f32; 2] {
        let u = f32::from_bits((word >> 9) | 0x3f80_0000) - 1.0;
        let q = u * u;
        let short = u + u
            * (q * (q * (q * -5.0847045569e-5 + 0.00352140138907) - 0.114191288864)
                + 0.110720731116);
        let long = (2.0 - short * short).sqrt();
        let [x, y] = if word & 4 != 0 {
            [short, long]
        } else {
            [long, short]
        };
        [
            f32::from_bits(x.to_bits() ^ (word << 31)),
            f32::from_bits(y.to_bits() ^ ((word << 30) & 0x8000_0000)),
        ]
    }
}

impl Real for f64 {
    #[inline]
    fn of(value: f64) -> f64 {
        value
    }
    #[inline]
    fn wide(self) -> f64 {
        self
    }
    #[inline]
    fn root(self) -> f64 {
        self.sqrt()
    }
    #[inline]
    fn parts(self) -> (f64, f64) {
        (self, 0.0)
    }
    #[inline]
    fn whole(self) -> f64 {
        self.floor()
    }
    #[inline]
    fn sides() -> (f64, f64) {
        let golden = (1.0 + 5_f64.sqrt()) / 2.0;
        let short = 1.3847 / (1.0 + golden * golden).sqrt();
        (golden * short, short)
    }
    #[inline]
    fn vector(word: u32) -> [f64; 2] {
        let angle = std::f64::consts::FRAC_PI_4 * f64::from(word >> 9) / f64::from(1_u32 << 23);
        let (sine, cosine) = angle.sin_cos();
        let [x, y] = if word & 4 != 0 {
            [sine, cosine]
        } else {
            [cosine, sine]
        };
        let sign = |bit: u32| if word >> bit & 1 == 1 { -1.0 } else { 1.0 };
        let length = std::f64::consts::SQRT_2;
        [length * sign(0) * x, length * sign(1) * y]
    }
}
