//! Atmospheres as arguments: a column chooses one of a few, because none fits into columns.

use std::fmt::Write as _;
use std::sync::OnceLock;

use veduta::Atmosphere;
use veduta::atmosphere::{AIR_WORDS, Layer, Phase, Profile};

/// The type in WGSL whose values are chosen.
pub const TYPE: &str = "Air";

/// How many there are.
pub const COUNT: u32 = 4;

/// Eight lobes with all kinds of phase functions. Layers of constant density are missing: the device rounds their edges off.
fn eight() -> Atmosphere {
    let layer = |name: &str, profile, scattering, absorption, phase| Layer {
        name: name.to_owned(),
        profile,
        scattering: [scattering, 2.0 * scattering, 0.5 * scattering],
        absorption: [absorption, 0.0, 2.0 * absorption],
        phase,
    };
    let exponential = |scale_height| Profile::Exponential { scale_height };
    let tent = |bottom, peak, top| Profile::Tent { bottom, peak, top };
    Atmosphere {
        planet_radius: 1.5e6,
        thickness: 5e4,
        ground_albedo: [0.1, 0.5, 0.9],
        layers: vec![
            layer("a", exponential(6e3), 1e-5, 0.0, Phase::Rayleigh),
            layer(
                "b",
                exponential(900.0),
                3e-5,
                1e-5,
                Phase::CornetteShanks { g: 0.99 },
            ),
            layer("c", tent(-1e3, 0.0, 3e3), 1e-5, 1e-5, Phase::Isotropic),
            layer("d", tent(1e4, 1.2e4, 3e4), 0.0, 2e-6, Phase::Isotropic),
            layer(
                "e",
                exponential(2.5e4),
                1e-7,
                1e-7,
                Phase::HenyeyGreenstein { g: -0.5 },
            ),
            layer(
                "f",
                tent(2e3, 4e3, 5e3),
                1e-6,
                0.0,
                Phase::Draine {
                    g: 0.6,
                    alpha: 20.0,
                },
            ),
            layer(
                "g",
                exponential(1.2e3),
                1e-4,
                1e-6,
                Phase::TwoLobes {
                    forward: 0.8,
                    backward: -0.3,
                    backward_share: 0.25,
                },
            ),
        ],
        ..Atmosphere::default()
    }
}

/// The one that a column chooses.
pub fn chosen(bits: u32) -> &'static Atmosphere {
    static ALL: OnceLock<[Atmosphere; COUNT as usize]> = OnceLock::new();
    let named = |name| Atmosphere::named(name).unwrap_or_default();
    &ALL.get_or_init(|| [named("earth"), named("hazy"), named("mars"), eight()])
        [(bits % COUNT) as usize]
}

/// A WGSL function `stress_air` that gives the one of a number.
pub fn wgsl() -> String {
    let mut text = format!("fn stress_air(which: u32) -> {TYPE} {{\n");
    for i in 0..COUNT {
        let words = chosen(i).air_words().unwrap_or([0; AIR_WORDS]);
        let number = |k: usize| format!("{:e}f", f32::from_bits(words[k]));
        let vector = |k: usize, n: usize| {
            let parts: Vec<String> = (k..k + n).map(number).collect();
            format!("vec{n}<f32>({})", parts.join(", "))
        };
        let lanes = |k: usize| {
            let parts: Vec<String> = (0..17).map(|m| vector(k + 4 * m, 4)).collect();
            format!("FourLayers({})", parts.join(", "))
        };
        let _ = writeln!(
            text,
            "    if which % {COUNT}u == {i}u {{ return {TYPE}({}, {}, {}u, {}, {}, {}, {}, {}, {}, {}); }}",
            number(0),
            number(1),
            words[2],
            number(3),
            number(4),
            number(5),
            number(6),
            vector(8, 3),
            lanes(12),
            lanes(80)
        );
    }
    let _ = writeln!(text, "    var none: {TYPE};\n    return none;\n}}");
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_are_valid_and_the_last_has_eight_lanes() {
        for i in 0..COUNT {
            chosen(i).check().unwrap();
        }
        assert_eq!(chosen(3).lanes().len(), 8);
        assert_eq!(chosen(0), &Atmosphere::default());
    }
}
