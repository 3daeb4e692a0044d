//! What air consists of: coefficients, phase functions, named atmospheres, and the block that the device reads (rows A01 to
//! A06 and A17).

use std::f64::consts::PI;

use crate::common::gpu;
use veduta::atmosphere::{
    AIR_WORDS, Aerosol, Atmosphere, Layer, Lobe, MOST_LANES, Molecules, Orders, Phase,
    ProbeOptions, ProbePath, ProbeRay, Profile, aerosol_scattering, cornette_shanks_asymmetry,
    probe, rayleigh_scattering,
};
use veduta::reference::probe::{Effort, probe as reference};
use veduta::reference::quadrature::Rule;
use veduta::reference::sky::Sky;
use veduta::reference::{medium, phase};
use veduta::{Error, wgpu};

/// The air of Afra and of Preetham et al. at a wavelength in nm.
fn rayleigh(nanometres: f64) -> f64 {
    rayleigh_scattering(nanometres * 1e-9, 1.0003, 2.545e25, 0.035)
}

/// Integral over the sphere of a function of the scattering angle's cosine.
fn over_sphere(f: impl Fn(f64) -> f64) -> f64 {
    2.0 * PI * Rule::new(64).composite(|nu| [f(nu)], -1.0, 1.0, 50)[0]
}

#[track_caller]
fn assert_near(value: f64, expected: f64, relative: f64) {
    assert!(
        (value / expected - 1.0).abs() <= relative,
        "{value:e}, not {expected:e}"
    );
}

/// A number that a table gives with three decimals or two significant digits.
#[track_caller]
fn assert_tabled(value: f64, expected: f64) {
    assert!(
        (value - expected).abs() <= (0.01 * expected).max(5.1e-5),
        "{value}, not {expected}"
    );
}

#[test]
fn row_a01_rayleigh_totals_are_those_of_the_table_and_of_the_angular_form() {
    let table = [
        (680.0, 5.8045e-6),
        (570.0, 1.1757e-5),
        (550.0, 1.3563e-5),
        (475.0, 2.4380e-5),
        (440.0, 3.3113e-5),
    ];
    for (wavelength, expected) in table {
        assert_near(rayleigh(wavelength), expected, 1e-3);
        // (2.2): pi^2 / 2 (n^2 - 1)^2 / (N l^4) (6 + 3 p) / (6 - 7 p) (1 + cos^2).
        let k = (1.0003_f64.powi(2) - 1.0).powi(2) / (2.545e25 * (wavelength * 1e-9).powi(4))
            * (6.0 + 3.0 * 0.035)
            / (6.0 - 7.0 * 0.035);
        let angular = over_sphere(|nu| PI * PI / 2.0 * k * (1.0 + nu * nu));
        assert_near(angular, rayleigh(wavelength), 1e-6);
    }
    // Without depolarisation, as column 3 has it, and standard air.
    assert_near(
        rayleigh_scattering(550e-9, 1.0003, 2.545e25, 0.0),
        1.2785e-5,
        1e-3,
    );
    assert_near(
        rayleigh_scattering(550e-9, 1.000_277_9, 2.5469e25, 0.0279),
        1.1487e-5,
        3e-3,
    );
}

/// (5.6): c, and scattering at 680, 570, 475 and 550 nm.
const HAZE: [(f64, [f64; 4]); 6] = [
    (1.0, [2.72e-7, 3.83e-7, 5.43e-7, 4.10e-7]),
    (1.3, [1.595e-5, 2.247e-5, 3.188e-5, 2.410e-5]),
    (2.0, [5.253e-5, 7.402e-5, 1.0499e-4, 7.936e-5]),
    (3.0, [1.0479e-4, 1.4766e-4, 2.0943e-4, 1.5831e-4]),
    (6.0, [2.6156e-4, 3.6858e-4, 5.2276e-4, 3.9516e-4]),
    (10.0, [4.7059e-4, 6.6314e-4, 9.4053e-4, 7.1095e-4]),
];

#[test]
fn row_a02_haze_is_that_of_the_table_and_turbidity_comes_out_as_it_goes_in() {
    for (turbidity, row) in HAZE {
        for ((wavelength, k), expected) in [
            (680e-9, 0.686),
            (570e-9, 0.679),
            (475e-9, 0.669),
            (550e-9, 0.678),
        ]
        .into_iter()
        .zip(row)
        {
            // The first row has three digits.
            let digits = if turbidity == 1.0 { 2e-3 } else { 1e-3 };
            assert_near(
                aerosol_scattering(turbidity, wavelength, k),
                expected,
                digits,
            );
        }
        // T = 1 + optical depth of the haze over that of the molecules, at 550 nm.
        let haze = 1250.0 * aerosol_scattering(turbidity, 550e-9, 0.678);
        assert_near(1.0 + haze / (8400.0 * 1.162e-5), turbidity, 0.03);
    }
    for turbidity in [0.0, 0.5, 0.99, 1.0, 1.000_1] {
        assert!(aerosol_scattering(turbidity, 550e-9, 0.67) >= 0.0);
    }
    assert_eq!(aerosol_scattering(0.99, 550e-9, 0.67), 0.0);
}

fn haze(turbidity: f64, mean_cosine: f64) -> Aerosol {
    Aerosol {
        name: "haze".to_owned(),
        turbidity,
        wavelengths: [680e-9, 570e-9, 475e-9],
        k: [0.686, 0.679, 0.669],
        scale_height: 1200.0,
        mean_cosine,
    }
}

#[test]
fn row_a03_angular_scattering_of_haze_sums_to_its_total() {
    for u in [0.0, 0.5, 0.7, 0.75, 0.8] {
        let layer = haze(2.0, u).layer().unwrap();
        for (c, expected) in HAZE[2].1.iter().take(3).enumerate() {
            let total = over_sphere(|nu| layer.scattering[c] * layer.phase.value(nu));
            assert_near(total, layer.scattering[c], 1e-4);
            assert_near(total, *expected, 1e-3);
        }
    }
}

#[test]
fn row_a04_phase_functions_have_mean_1_and_the_mean_cosine_that_was_asked_for() {
    for u in [0.0, 0.5, 0.7, 0.8] {
        let phase = Phase::CornetteShanksMean { u };
        assert!((over_sphere(|nu| phase.value(nu)) - 1.0).abs() < 1e-9);
        assert!((over_sphere(|nu| nu * phase.value(nu)) - u).abs() < 1e-9);
    }
    for i in 0..=20 {
        let nu = f64::from(i) / 10.0 - 1.0;
        let none = Phase::CornetteShanks { g: 0.0 }.value(nu);
        assert_near(none, phase::phase_rayleigh(nu), 1e-14);
        assert_near(Phase::Rayleigh.value(nu), phase::phase_rayleigh(nu), 1e-14);
        assert_near(Phase::Isotropic.value(nu), phase::phase_isotropic(), 1e-14);
        for g in [-0.6, 0.3, 0.9] {
            let pairs = [
                (
                    Phase::HenyeyGreenstein { g },
                    phase::phase_henyey_greenstein(nu, g),
                ),
                (
                    Phase::CornetteShanks { g },
                    phase::phase_cornette_shanks(nu, g),
                ),
                (
                    Phase::Draine { g, alpha: 2.5 },
                    phase::phase_draine(nu, g, 2.5),
                ),
                (
                    Phase::TwoLobes {
                        forward: g,
                        backward: -0.2,
                        backward_share: 0.3,
                    },
                    phase::phase_double_henyey_greenstein(nu, g, -0.2, 0.3),
                ),
            ];
            for (phase, expected) in pairs {
                assert_near(phase.value(nu), expected, 1e-13);
            }
        }
    }
    // The moments that tables need.
    for phase in [
        Phase::Rayleigh,
        Phase::HenyeyGreenstein { g: 0.8 },
        Phase::CornetteShanks { g: 0.76 },
        Phase::Draine {
            g: -0.4,
            alpha: 7.0,
        },
    ] {
        let [lobe]: [Lobe; 1] = phase.lobes().try_into().unwrap();
        let moment = |p: fn(f64) -> f64| over_sphere(|nu| p(nu) * lobe.value(nu));
        assert!((moment(|_| 1.0) - 1.0).abs() < 1e-10, "{phase:?}");
        assert!((moment(|nu| nu) - lobe.first).abs() < 1e-10, "{phase:?}");
        let second = moment(|nu| 1.5 * nu * nu - 0.5);
        assert!((second - lobe.second).abs() < 1e-10, "{phase:?}");
    }
}

#[test]
fn row_a05_asymmetry_is_that_of_the_table_and_goes_back() {
    let table = [
        (0.0, 0.0, 1.5, 0.75),
        (0.5, 0.4355, 6.17, 0.428),
        (0.7, 0.6371, 15.5, 0.222),
        (0.75, 0.6918, 21.6, 0.176),
        (0.8, 0.7486, 32.4, 0.132),
        (0.85, 0.8076, 55.3, 0.093),
        (0.9, 0.8691, 118.8, 0.057),
    ];
    for (u, g, forward, across) in table {
        assert!((cornette_shanks_asymmetry(u) - g).abs() < 1e-4, "{u}");
        let phase = Phase::CornetteShanksMean { u };
        assert_near(4.0 * PI * phase.value(1.0), forward, 3e-3);
        assert!((4.0 * PI * phase.value(0.0) - across).abs() < 6e-4, "{u}");
    }
    for i in -980..=980 {
        let u = f64::from(i) / 1000.0;
        let g = cornette_shanks_asymmetry(u);
        let back = 3.0 * g * (4.0 + g * g) / (5.0 * (2.0 + g * g));
        assert!((back - u).abs() < 1e-12, "{u}: {g}, {back}");
    }
}

/// Molecules at Afra's wavelengths alone.
fn molecules() -> Layer {
    Molecules {
        name: "molecules".to_owned(),
        wavelengths: [680e-9, 570e-9, 475e-9],
        refractive_index: 1.0003,
        number_density: 2.545e25,
        depolarisation: 0.035,
        scale_height: 8000.0,
    }
    .layer()
    .unwrap()
}

#[test]
fn row_a06_columns_are_scale_heights_and_transmittances_those_of_the_table() {
    for height in [8000.0, 1200.0] {
        let profile = Profile::Exponential {
            scale_height: height,
        };
        let column = Rule::new(16).composite(|h| [profile.density(h)], 0.0, 1e5, 100)[0];
        assert_near(column, height, 1e-3);
    }
    let tent = Profile::Tent {
        bottom: 1e4,
        peak: 2.5e4,
        top: 4e4,
    };
    for (h, density) in [
        (0.0, 0.0),
        (1e4, 0.0),
        (2e4, 2.0 / 3.0),
        (2.5e4, 1.0),
        (3.7e4, 0.2),
    ] {
        assert!((tent.density(h) - density).abs() < 1e-15, "{h}");
    }
    let air = Atmosphere {
        layers: vec![molecules()],
        ..Atmosphere::default()
    };
    for (layer, depth) in [(0, 0.0464), (1, 0.0941), (2, 0.1950)] {
        assert_near(8000.0 * air.layers[0].scattering[layer], depth, 2e-3);
    }
    let sky = Sky::new(&air).unwrap();
    let table = [
        (0.0_f64, [0.955, 0.910, 0.823]),
        (85.0, [0.625, 0.385, 0.139]),
        (90.0, [0.194, 0.036, 0.0010]),
    ];
    for (zenith, expected) in table {
        let ray = ProbeRay::from_row(
            0,
            [
                0.0,
                zenith.to_radians().sin(),
                zenith.to_radians().cos(),
                0.0,
                0.0,
                1.0,
                0.0,
                f64::INFINITY,
            ],
        )
        .unwrap();
        let found = sky.single_scatter(&ray.into(), 1e-6).transmittance;
        println!("{zenith} degrees: {found:?}");
        for (value, expected) in found.iter().zip(expected) {
            // The table's last digit is half a thousandth.
            assert!((value - expected).abs() <= (0.01 * expected).max(5e-4));
        }
        if zenith == 90.0 {
            assert_tabled(found[2], 0.0010);
        }
    }
}

#[test]
fn row_a17_an_atmosphere_is_changed_as_a_whole_and_zeniths_have_their_colours() {
    // Blue over red at the zenith, the sun at 45 degrees, scattered once.
    let ratio = |air: &Atmosphere| {
        let s = 0.5_f64.sqrt();
        let ray = ProbeRay::from_row(0, [0.0, 0.0, 1.0, 0.0, s, s, 0.0, f64::INFINITY]).unwrap();
        let light = reference(air, &[ray], Orders::Single, &Effort::default()).unwrap();
        light[0].in_scatter[2] / light[0].in_scatter[0]
    };
    let thesis = Atmosphere::named("thesis").unwrap();
    let clear = Atmosphere {
        layers: vec![molecules(), thesis.layers[1].clone()],
        ..thesis.clone()
    };
    let mut afra = Atmosphere::named("afra").unwrap();
    let own = ratio(&afra);
    afra.layers[1] = haze(2.0, 0.8).layer().unwrap();
    let found = [ratio(&thesis), ratio(&clear), ratio(&afra)];
    println!("zenith B/R {found:?}; afra as it comes {own:.3}");
    for (value, expected) in found.into_iter().zip([4.22, 3.39, 2.3]) {
        assert_near(value, expected, 0.02);
    }
    // Everything is afra's own.
    let afra = Atmosphere::named("afra").unwrap();
    for (value, expected) in afra.layers[0]
        .scattering
        .iter()
        .zip([5.8045e-6, 1.1757e-5, 2.4380e-5])
    {
        assert_near(*value, expected, 1e-3);
    }
    for (value, expected) in afra.layers[1].scattering.iter().zip(HAZE[2].1) {
        assert_near(*value, expected, 1e-3);
    }
    assert_eq!(afra.layers[1].phase, Phase::CornetteShanksMean { u: 0.75 });
    assert!(afra.layers.iter().all(|l| l.absorption == [0.0; 3]));
}

#[test]
fn named_atmospheres_are_valid_and_go_through_ron() {
    let names: Vec<&str> = Atmosphere::names().collect();
    assert_eq!(names, ["earth", "thesis", "hazy", "afra", "mars"]);
    for name in names {
        let air = Atmosphere::named(name).unwrap();
        air.check().unwrap();
        let text = air.to_ron().unwrap();
        assert_eq!(Atmosphere::from_ron(&text).unwrap(), air, "{text}");
    }
    assert_eq!(Atmosphere::named("earth").unwrap(), Atmosphere::default());
    let extinction = |name: &str| {
        let lanes = Atmosphere::named(name).unwrap().lanes();
        lanes.last().unwrap().extinction[0]
    };
    assert_near(extinction("thesis"), 2.22e-6, 1e-12);
    assert_near(extinction("hazy"), 1.11 * 21e-6, 1e-12);
    assert_near(extinction("earth"), 4.44e-6, 1e-12);
    // What is not exponential comes first.
    let ozone = Atmosphere::default().lanes()[0];
    assert!(matches!(ozone.profile, Profile::Tent { .. }));
    let error = Atmosphere::named("venus").unwrap_err();
    assert!(error.to_string().contains("`venus`") && error.to_string().contains("`mars`"));
    let error = Atmosphere::from_ron("(planet_radius: 6e6,\n thicknes: 1e5)").unwrap_err();
    assert!(error.to_string().contains("2:"), "{error}");
}

#[test]
fn mars_has_a_blue_sunset_under_a_brown_day() {
    let mars = Atmosphere::named("mars").unwrap();
    let toward = |degrees: f64| {
        let a = degrees.to_radians();
        [a.cos(), a.sin(), 0.0]
    };
    let light = |view: f64, sun: f64| {
        let ([x, y, z], [a, b, c]) = (toward(view), toward(sun));
        let ray = ProbeRay::from_row(0, [2.0, x, y, z, a, b, c, f64::INFINITY]).unwrap();
        let effort = Effort {
            samples: 20_000,
            ..Effort::default()
        };
        reference(&mars, &[ray], Orders::All, &effort).unwrap()[0].in_scatter
    };
    let (aureole, aside, day) = (light(6.0, 4.0), light(50.0, 4.0), light(70.0, 30.0));
    println!("beside the low sun {aureole:?}, high above it {aside:?}, by day {day:?}");
    assert!(aureole[2] > 1.15 * aureole[0], "blue beside the sun");
    assert!(aside[0] > aside[2], "not elsewhere");
    assert!(
        day[0] > 1.2 * day[1] && day[1] > 1.2 * day[2],
        "brown by day"
    );
}

/// Names, values and domains of what is refused.
#[test]
fn values_outside_of_their_domains_are_named() {
    type Change = fn(&mut Atmosphere);
    let cases: [(Change, &str, &str, &str); 14] = [
        (
            |a| a.planet_radius = 10.0,
            "planet_radius",
            "10.0",
            "[1000.0",
        ),
        (|a| a.thickness = f64::NAN, "thickness", "NaN", "[1.0"),
        (
            |a| a.ground_albedo[1] = 1.5,
            "ground_albedo (green)",
            "1.5",
            "[0.0, 1.0]",
        ),
        (
            |a| a.sun.angular_radius = -1.0,
            "sun.angular_radius",
            "-1.0",
            "rad",
        ),
        (
            |a| a.sun.colour[2] = f64::INFINITY,
            "sun.colour (blue)",
            "inf",
            "1000",
        ),
        (
            |a| a.layers[1].scattering[0] = -1e-6,
            "layers[1] (haze).scattering (red)",
            "-1e-6",
            "1/m",
        ),
        (
            |a| a.layers[2].absorption[2] = 2.0,
            "layers[2] (ozone).absorption (blue)",
            "2.0",
            "1/m",
        ),
        (
            |a| a.layers[0].profile = Profile::Exponential { scale_height: 0.0 },
            "layers[0] (molecules).profile.scale_height",
            "0.0",
            "[1.0",
        ),
        (
            |a| {
                a.layers[2].profile = Profile::Tent {
                    bottom: 1e4,
                    peak: 1e4,
                    top: 4e4,
                }
            },
            "layers[2] (ozone).profile.peak",
            "10000.0",
            "1 m above `bottom`",
        ),
        (
            |a| {
                a.layers[2].profile = Profile::Tent {
                    bottom: 1e4,
                    peak: 2e4,
                    top: 1.5e4,
                }
            },
            "layers[2] (ozone).profile.top",
            "15000.0",
            "1 m above `peak`",
        ),
        (
            |a| {
                a.layers[2].profile = Profile::Constant {
                    bottom: 1e4,
                    top: -1e4,
                }
            },
            "layers[2] (ozone).profile.top",
            "-10000.0",
            "1 m above `bottom`",
        ),
        (
            |a| a.layers[1].phase = Phase::CornetteShanks { g: 1.0 },
            "layers[1] (haze).phase.g",
            "1.0",
            "0.99",
        ),
        (
            |a| {
                a.layers[1].phase = Phase::Draine {
                    g: 0.0,
                    alpha: -1.0,
                }
            },
            "layers[1] (haze).phase.alpha",
            "-1.0",
            "100",
        ),
        (
            |a| a.layers = vec![a.layers[1].clone(); 9],
            "layers",
            "9 with 9 lobes",
            "at most 8",
        ),
    ];
    for (change, name, value, domain) in cases {
        let mut air = Atmosphere::default();
        change(&mut air);
        match air.check() {
            Err(Error::OutOfDomain {
                name: n,
                value: v,
                domain: d,
            }) => {
                assert_eq!((n.as_str(), v.as_str()), (name, value));
                assert!(d.contains(domain), "{d}");
            }
            other => panic!("{name}: {other:?}"),
        }
        assert!(air.air_words().is_err() && air.to_ron().is_err());
        assert!(Sky::new(&air).is_err());
    }
    let mut clear = Atmosphere::default();
    for layer in &mut clear.layers {
        (layer.scattering, layer.absorption) = ([0.0; 3], [0.0; 3]);
    }
    clear.check().unwrap();
    clear.layers.clear();
    clear.check().unwrap();
    assert!(haze(0.9, 0.75).layer().is_err());
    assert!(
        Atmosphere::from_ron("(planet_radius: 6e6, thickness: 1e5, ground_albedo: (0, 0, 0), sun: (angular_radius: 0, colour: (1, 1, 1)), layers: [Aerosol(turbidity: 0.5, wavelengths: (680e-9, 570e-9, 475e-9), k: (1, 1, 1), scale_height: 1200, mean_cosine: 0.7)])")
            .unwrap_err()
            .to_string()
            .contains("turbidity of aerosol")
    );
    let options = ProbeOptions {
        path: ProbePath::Fast,
        ..ProbeOptions::default()
    };
    assert_eq!(probe(gpu(), &clear, &[], &options).unwrap().len(), 0);
}

/// Air without anything, and with a pure absorber, does not trouble the references.
#[test]
fn empty_and_black_air_give_nothing() {
    let mut air = Atmosphere::default();
    let ray = ProbeRay::from_row(0, [2.0, 0.6, 0.8, 0.0, 0.0, 1.0, 0.0, f64::INFINITY]).unwrap();
    let effort = Effort {
        samples: 100,
        ..Effort::default()
    };
    air.layers.remove(0);
    air.layers.remove(0);
    let found = reference(&air, &[ray], Orders::All, &effort).unwrap()[0];
    assert_eq!((found.in_scatter, found.error), ([0.0; 3], [0.0; 3]));
    let depth: f64 = 0.65e-6 * 15_000.0 / 0.8;
    assert!((found.transmittance[0] - (-depth).exp()).abs() < 1e-4);
    air.layers.clear();
    let found = reference(&air, &[ray], Orders::All, &effort).unwrap()[0];
    assert_eq!(
        (found.in_scatter, found.transmittance),
        ([0.0; 3], [1.0; 3])
    );
}

/// Eight lobes, a step and two phase functions of two lobes.
fn full() -> Atmosphere {
    let mut air = Atmosphere {
        ground_albedo: [0.1, 0.2, 0.3],
        ..Atmosphere::default()
    };
    air.layers[1].phase = Phase::TwoLobes {
        forward: 0.85,
        backward: -0.35,
        backward_share: 0.2,
    };
    let mut step = air.layers[1].clone();
    step.profile = Profile::Constant {
        bottom: 3000.0,
        top: 70_000.0,
    };
    step.scattering = [1e-7, 2e-7, 3e-7];
    let mut third = air.layers[0].clone();
    third.phase = Phase::Draine { g: 0.5, alpha: 4.0 };
    third.profile = Profile::Tent {
        bottom: -500.0,
        peak: 0.0,
        top: 9000.0,
    };
    let mut fourth = air.layers[2].clone();
    fourth.scattering = [0.0, 1e-8, 0.0];
    air.layers.extend([step, third, fourth]);
    air
}

/// What the device makes of the block: 32 numbers for each altitude and cosine.
fn on_device(air: &Atmosphere, places: &[[f32; 2]]) -> Vec<f32> {
    let module = include_str!("../../wgsl/atmosphere/medium.wgsl");
    let module: String = module
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| format!("{line}\n"))
        .collect();
    let source = format!(
        "{module}
@group(0) @binding(0) var<uniform> air: Air;
@group(0) @binding(1) var<storage, read> places: array<vec2<f32>>;
@group(0) @binding(2) var<storage, read_write> found: array<f32>;
@compute @workgroup_size(1)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {{
    let place = places[id.x];
    let densities = air_densities(air, place.x);
    let phases = air_phases(air, place.y);
    var numbers: array<f32, 32>;
    for (var k = 0u; k < 4u; k++) {{
        numbers[k] = densities.low[k];
        numbers[4u + k] = densities.high[k];
        numbers[8u + k] = phases.low[k];
        numbers[12u + k] = phases.high[k];
    }}
    let extinction = air_extinction(air, densities);
    let scattering = air_scattering(air, densities, phases);
    for (var c = 0u; c < 3u; c++) {{
        numbers[16u + c] = extinction[c];
        numbers[19u + c] = scattering[c];
        numbers[22u + c] = air.ground_albedo[c];
    }}
    numbers[25] = peak_phase(air, place.y);
    numbers[26] = air.ground_radius;
    numbers[27] = air.top;
    numbers[28] = f32(air.lane_count);
    numbers[29] = air.low.peaked.y + 2.0 * air.high.peaked.x + 4.0 * air.low.peaked.x;
    numbers[30] = air.low.phase_first.y;
    numbers[31] = air.high.phase_second.x;
    for (var k = 0u; k < 32u; k++) {{
        found[32u * id.x + k] = numbers[k];
    }}
}}"
    );
    let gpu = gpu();
    let device = &gpu.device;
    let buffer = |bytes: &[u8], usage| {
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: bytes.len() as u64,
            usage: usage | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        gpu.queue.write_buffer(&buffer, 0, bytes);
        buffer
    };
    let flat: Vec<u8> = places
        .iter()
        .flatten()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    let buffers = [
        buffer(&air.air_bytes().unwrap(), wgpu::BufferUsages::UNIFORM),
        buffer(&flat, wgpu::BufferUsages::STORAGE),
        buffer(&vec![0; 128 * places.len()], wgpu::BufferUsages::STORAGE),
    ];
    let shader = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("air"),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("air"),
        layout: None,
        module: &shader,
        entry_point: Some("main"),
        compilation_options: Default::default(),
        cache: None,
    });
    let entries: Vec<wgpu::BindGroupEntry<'_>> = buffers
        .iter()
        .enumerate()
        .map(|(i, b)| wgpu::BindGroupEntry {
            binding: i as u32,
            resource: b.as_entire_binding(),
        })
        .collect();
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &entries,
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(places.len() as u32, 1, 1);
    }
    gpu.queue.submit([encoder.finish()]);
    let bytes = gpu
        .read_buffer(&buffers[2], 128 * places.len() as u64)
        .unwrap();
    let words = bytes.as_chunks::<4>().0;
    words.iter().map(|w| f32::from_le_bytes(*w)).collect()
}

#[test]
fn the_block_is_what_the_device_reads() {
    assert_eq!(
        Atmosphere::default().air_bytes().unwrap().len(),
        4 * AIR_WORDS
    );
    let airs = [
        full(),
        Atmosphere::default(),
        Atmosphere::named("mars").unwrap(),
    ];
    assert_eq!(airs[0].lanes().len(), MOST_LANES);
    for air in airs {
        // No place lies within half a metre of a step.
        let places: Vec<[f32; 2]> = [
            0.0, 1.0, 1999.0, 2999.0, 3001.0, 25e3, 39e3, 69_999.0, 70_001.0, 99e3,
        ]
        .into_iter()
        .flat_map(|h| [-1.0, 0.0, 0.7, 0.99, 1.0].map(|nu| [h, nu]))
        .collect();
        let found = on_device(&air, &places);
        for (place, found) in places.iter().zip(found.chunks(32)) {
            let [h, nu] = place.map(f64::from);
            let densities = medium::air_densities(&air, h);
            let phases = medium::air_phases(&air, nu);
            let mut expected: Vec<f64> = densities.into_iter().chain(phases).collect();
            expected.extend(medium::air_extinction(&air, densities));
            expected.extend(medium::air_scattering(&air, densities, phases));
            expected.extend(air.ground_albedo);
            let lanes = air.lanes();
            let peaked = |k: usize| f64::from(u8::from(lanes.get(k).is_some_and(|l| l.peaked())));
            let lobe = |k: usize| lanes.get(k).and_then(|l| l.lobe);
            expected.extend([
                medium::peak_phase(&air, nu),
                air.planet_radius,
                air.thickness,
                lanes.len() as f64,
                peaked(1) + 2.0 * peaked(4) + 4.0 * peaked(0),
                lobe(1).map_or(0.0, |l| l.first),
                lobe(4).map_or(0.0, |l| l.second),
            ]);
            for (k, (f, e)) in found.iter().zip(&expected).enumerate() {
                let error = (f64::from(*f) - e).abs();
                assert!(
                    error <= 1e-6 + 3e-5 * e.abs(),
                    "{k} at {place:?}: {f}, not {e}"
                );
                // Coefficients are far below 1.
                assert!(
                    !(16..22).contains(&k) || error <= 3e-6 * e.abs() + 1e-12,
                    "{k} at {place:?}: {f}, not {e}"
                );
            }
        }
    }
}

#[test]
fn rays_of_probes_are_checked() {
    let good = [2.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, f64::INFINITY];
    let ray = ProbeRay::from_row(3, good).unwrap();
    assert_eq!(ray.distance, f64::INFINITY);
    // Within a thousandth it is made a unit vector.
    let mut long = good;
    long[2] = 1.0009;
    assert_eq!(ProbeRay::from_row(3, long).unwrap().dir, [0.0, 1.0, 0.0]);
    let bad = [
        (0, -1.0, "the altitude of row 3", "-1.0"),
        (0, f64::INFINITY, "the altitude of row 3", "inf"),
        (2, 1.01, "the length of the direction of row 3", "1.01"),
        (
            5,
            f64::NAN,
            "the length of the direction to the sun of row 3",
            "NaN",
        ),
        (7, -1.0, "the distance of row 3", "-1.0"),
        (7, f64::NAN, "the distance of row 3", "NaN"),
    ];
    for (column, number, name, value) in bad {
        let mut row = good;
        row[column] = number;
        match ProbeRay::from_row(3, row) {
            Err(Error::OutOfDomain {
                name: n, value: v, ..
            }) => assert_eq!((n.as_str(), v.as_str()), (name, value)),
            other => panic!("{name}: {other:?}"),
        }
    }
}

#[test]
fn probes_of_the_reference_are_exact_where_there_is_no_air() {
    let air = Atmosphere::default();
    let up = [0.0, 1.0, 0.0];
    let ray = |altitude, dir: [f64; 3], distance| ProbeRay {
        altitude,
        dir,
        to_sun: up,
        distance,
    };
    let misses = [
        ray(4e5, up, f64::INFINITY),
        ray(4e5, [1.0, 0.0, 0.0], f64::INFINITY),
        ray(4e5, [0.0, -1.0, 0.0], 1e5),
        ray(1e5, up, f64::INFINITY),
    ];
    let effort = Effort {
        samples: 200,
        ..Effort::default()
    };
    for found in reference(&air, &misses, Orders::All, &effort).unwrap() {
        assert_eq!(
            (found.in_scatter, found.transmittance),
            ([0.0; 3], [1.0; 3])
        );
    }
    // The ground at the end is not counted, and the light that it sends into the air is.
    let down = [ray(50.0, [0.0, -1.0, 0.0], f64::INFINITY)];
    let light = |albedo: f64| {
        let air = Atmosphere {
            ground_albedo: [albedo; 3],
            ..air.clone()
        };
        reference(&air, &down, Orders::All, &effort).unwrap()[0].in_scatter
    };
    let (black, white) = (light(0.0), light(1.0));
    assert!(
        white[2] > 1.3 * black[2] && white[2] < 0.01,
        "{black:?} {white:?}"
    );
}
