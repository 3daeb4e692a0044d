//! What the tests share: the device, the modules of this repository, rows and comparisons.

use veduta::device::{Gpu, shared};
use veduta::eval::{Evaluator, Spec};
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
        expression,
        columns,
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
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// The next number in [0, 1), a multiple of 2^-24 and so exact in `f32`.
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1_u32 << 24) as f32
    }

    /// The next number in [low, high).
    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }
}
