//! Terrain: sphere, marches, normals, shadows, light, materials (rows L11 to L23).

use crate::accuracy::{assert_promise, bits, direction, promise, rows, toward};
use crate::common::{Random, evaluator};
use std::time::Instant;
use veduta::reference::math::{dot, normalize};
use veduta::reference::planet;
use veduta::reference::terrain::{self, Rock, Terrain};

/// Height fields with a known form, chosen by the seed: 0 flat, 1 a slope along x, 2 waves, 3 a wall across x at
/// `wavelength`, 4 a ball about (`wavelength`, 0).
const FIELDS: &str = "
override fn veduta::terrain::height::height(terrain: Terrain, offset: vec2<f32>, octaves: i32) -> f32 {
    let a = terrain.amplitude;
    let w = terrain.wavelength;
    if terrain.seed == 1u { return a * offset.x; }
    if terrain.seed == 2u { return a * sin(offset.x / w) * cos(offset.y / w); }
    if terrain.seed == 3u { return select(0.0, a, abs(offset.x - w) < 50.0); }
    if terrain.seed == 4u { return sqrt(max(a * a - (offset.x - w) * (offset.x - w) - offset.y * offset.y, 0.0)); }
    return a;
}
fn field(amplitude: f32, wavelength: f32, seed: u32) -> Terrain {
    return Terrain(vec2i(0), vec2f(0.0), wavelength, amplitude, 1.0, 2.0, 0.0, seed);
}
";

const MOUNTAINS: &str = "
fn mountains() -> Terrain { return Terrain(vec2i(12, -7), vec2f(0.25, 0.625), 8192.0, 1400.0, 1.0, 2.0, 0.0, 1u); }
";

fn mountains() -> Terrain {
    Terrain {
        cell: [12, -7],
        frac: [0.25, 0.625],
        wavelength: 8192.0,
        amplitude: 1400.0,
        hurst: 1.0,
        gain: 2.0,
        smoothness: 0.0,
        seed: 1,
    }
}

const PARTS: &str = "
fn parts(h: TerrainHit) -> vec4f { return vec4f(h.distance, h.reached, h.clearance, f32(h.steps)); }
";

const RADIUS: f64 = 6.36e6;

/// Runs `expression` on the analytic fields; `function` is what it uses of `module`.
fn on_fields(
    module: &str,
    function: &str,
    expression: &str,
    columns: usize,
    device_rows: &[u32],
) -> Vec<f64> {
    let import = format!("veduta::terrain::{module}::{{{function}}}");
    let parts = if module == "march" { PARTS } else { "" };
    evaluator(
        &["veduta::terrain::height::{Terrain}", &import],
        &format!("{FIELDS}{parts}"),
        expression,
        columns,
    )
    .run(device_rows)
    .unwrap()
}

/// Distance, distance reached, clearance and steps of marches over rows.
struct Hits(Vec<f64>);

impl Hits {
    fn each(&self) -> impl Iterator<Item = [f64; 4]> + '_ {
        self.0.chunks(4).map(|v| [v[0], v[1], v[2], v[3]])
    }
}

#[test]
fn row_l11_spherical_terrain() {
    // Rays that meet a flat world from 1 km up: the ground has dropped below the tangent plane by d^2 / 2R.
    let list: Vec<[f32; 2]> = [2e3, 1e4, 3e4, 6e4, 1e5]
        .iter()
        .map(|d: &f64| {
            let down: f64 = 1000.0 + d * d / (2.0 * RADIUS);
            let length = d.hypot(down);
            [(d / length) as f32, (-down / length) as f32]
        })
        .collect();
    let expression = "parts(march(field(0.0, 1.0, 0u), 6.36e6, 1000.0, vec3f(in.f[0], in.f[1], 0.0), 0.1, 2e5, 0.9, 0.001, 5000, 1))";
    let hits = Hits(on_fields(
        "march",
        "TerrainHit, march",
        expression,
        2,
        &bits(&list),
    ));
    for (row, hit) in list.iter().zip(hits.each()) {
        let (x, y) = (hit[0] * f64::from(row[0]), hit[0] * f64::from(row[1]));
        let (drop, expected) = (-1000.0 - y, x * x / (2.0 * RADIUS));
        println!(
            "at {:.0} m the ground lies {:.3} m below the tangent plane, d^2/2R = {expected:.3} m",
            x, drop
        );
        assert!(hit[0] > 0.0);
        assert!((drop / expected - 1.0).abs() < 0.01, "{drop} {expected}");
    }
}

/// Rays from 500 m onto the slope of the field 1 and onto the ball of the field 4, with the true distances.
fn analytic_rays(count: usize) -> (Vec<[f32; 3]>, Vec<f64>, Vec<f64>) {
    let mut random = Random(12);
    let (mut list, mut slope, mut ball) = (vec![], vec![], vec![]);
    while list.len() < count {
        let down = random.between(0.1, 0.35);
        let aside = random.between(-0.1, 0.1);
        let d = normalize([1.0, -f64::from(down), f64::from(aside)]).map(|v| v as f32);
        let dir = d.map(f64::from);
        // 500 + t y = 0.2 t x on the slope.
        let on_slope = 500.0 / (0.2 * dir[0] - dir[1]);
        // |(t x - 2000, 500 + t y, t z)| = 1000 on the ball.
        let b = dot(dir, [-2000.0, 500.0, 0.0]);
        let c = 2000.0_f64.powi(2) + 500.0_f64.powi(2) - 1000.0_f64.powi(2);
        let disc = b * b - c;
        // Rays that meet the ball steeply, above its rim.
        if disc > 250_000.0 {
            let t = -b - disc.sqrt();
            if 500.0 + t * dir[1] > 100.0 {
                list.push(d);
                slope.push(on_slope);
                ball.push(t);
            }
        }
    }
    (list, slope, ball)
}

#[test]
fn row_l12_constant_steps() {
    let (list, slope, ball) = analytic_rays(500);
    for (what, field, truth) in [
        ("slope", "field(0.2, 1.0, 1u)", slope),
        ("ball", "field(1000.0, 2000.0, 4u)", ball),
    ] {
        let run = |interpolate: bool| {
            let expression = format!(
                "parts(march_constant({field}, 1e8, 500.0, vec3f(in.f[0], in.f[1], in.f[2]), 0.0, 5000.0, 8.0, 1000, 1, {interpolate}))"
            );
            Hits(on_fields(
                "march",
                "TerrainHit, march_constant",
                &expression,
                3,
                &bits(&list),
            ))
        };
        let (plain, joined) = (run(false), run(true));
        let error = |hits: &Hits| -> (f64, f64) {
            let all: Vec<f64> = hits.each().zip(&truth).map(|(h, t)| h[0] - t).collect();
            (
                all.iter().map(|e| e.abs()).sum::<f64>() / all.len() as f64,
                all.iter().fold(0.0, |w, e| e.abs().max(w)),
            )
        };
        let ((mean, worst), (mean_joined, worst_joined)) = (error(&plain), error(&joined));
        println!(
            "{what}: step 8 m, first sample below {mean:.2} m off (at most {worst:.2}), interpolated {mean_joined:.3} m (at most {worst_joined:.3})"
        );
        assert!(
            plain
                .each()
                .zip(&truth)
                .all(|(h, t)| h[0] >= t - 0.2 && h[0] <= t + 8.2)
        );
        assert!(mean_joined < 0.1 * mean && worst_joined < 0.5 * worst);
    }
    // Neither a step limit nor the far end is a hit.
    let ends = on_fields(
        "march",
        "TerrainHit, march_constant",
        "parts(march_constant(field(0.2, 1.0, 1u), 1e8, 500.0, vec3f(1.0, 0.0, 0.0), 0.0, in.f[0], 8.0, in.i[1], 1, true))",
        2,
        &[1e5_f32.to_bits(), 20, 500_f32.to_bits(), 1000],
    );
    assert_eq!((ends[0], ends[4]), (-1.0, -1.0));
    assert!(ends[5] <= 500.0);
}

#[test]
fn row_l13_adaptive_steps() {
    let (list, slope, _) = analytic_rays(500);
    // Waves with slopes to 0.5, whose true hits are found with steps of 5 cm. (On the ball's rim no factor is safe.)
    let on_waves = |d: &[f32; 3]| {
        let dir = d.map(f64::from);
        let clearance = |t: f64| {
            terrain::clearance_over(
                |p| 100.0 * (p[0] / 200.0).sin() * (p[1] / 200.0).cos(),
                1e8,
                500.0,
                dir,
                t,
            )
        };
        terrain::march_constant_over(clearance, 0.0, 1e4, 0.05, 200_000, true).distance
    };
    let waves: Vec<f64> = list.iter().map(on_waves).collect();
    for (what, field, truth, steepest) in [
        ("slope", "field(0.2, 1.0, 1u)", slope, 0.2),
        ("waves", "field(100.0, 200.0, 2u)", waves, 0.5),
    ] {
        let expression = format!(
            "parts(march({field}, 1e8, 500.0, vec3f(in.f[0], in.f[1], in.f[2]), 0.1, 9000.0, 0.5, 1.0, 1000, 1))"
        );
        let hits = Hits(on_fields(
            "march",
            "TerrainHit, march",
            &expression,
            3,
            &bits(&list),
        ));
        let (mut mean, mut steps) = (0.0, 0.0);
        for ((hit, t), d) in hits.each().zip(&truth).zip(&list) {
            // Within the tolerance above the ground and, since half the clearance is a safe step here, never below it.
            let dir = d.map(f64::from);
            let ground = |p: [f64; 2]| {
                if what == "slope" {
                    0.2 * p[0]
                } else {
                    100.0 * (p[0] / 200.0).sin() * (p[1] / 200.0).cos()
                }
            };
            let clearance = terrain::clearance_over(ground, 1e8, 500.0, dir, hit[0]);
            assert!(
                clearance < 0.001 * hit[0] + 0.01 && clearance > -0.02,
                "{hit:?}: {clearance}"
            );
            assert!(hit[0] < t + 0.3, "{hit:?} {t}");
            // Falling at least so fast towards the ground, a ray that meets it head-on is as near along its own way.
            let falling = -dir[1] - steepest * dir[0];
            if falling > 0.0 {
                assert!(
                    (hit[0] - t).abs() < 0.001 * t / falling + 0.3,
                    "{hit:?} {t}"
                );
            }
            mean += (hit[0] - t).abs() / list.len() as f64;
            steps += hit[3] / list.len() as f64;
        }
        // Equal steps are half a step off on average; with the same mean error they need so many samples.
        let constant = truth.iter().sum::<f64>() / truth.len() as f64 / (2.0 * mean);
        println!(
            "{what}: mean error {mean:.2} m in {steps:.1} steps; equal steps of the same mean error: {constant:.1}"
        );
        assert!(steps < 0.9 * constant);
    }
    // A hit is never beyond `far`.
    let mut random = Random(13);
    let far: Vec<[f32; 4]> = (0..4000)
        .map(|i| {
            let d = list[i % list.len()];
            [d[0], d[1], d[2], random.between(10.0, 4000.0)]
        })
        .collect();
    let hits = Hits(on_fields(
        "march",
        "TerrainHit, march",
        "parts(march(field(0.2, 1.0, 1u), 1e8, 500.0, vec3f(in.f[0], in.f[1], in.f[2]), 0.1, in.f[3], 1.0, 1.0, 1000, 1))",
        4,
        &bits(&far),
    ));
    assert!(
        hits.each()
            .zip(&far)
            .all(|(h, r)| h[0] <= f64::from(r[3]) && h[1] <= f64::from(r[3]))
    );
    assert!(hits.each().any(|h| h[0] < 0.0) && hits.each().any(|h| h[0] > 0.0));
}

#[test]
fn row_l14_linear_error_growth() {
    // Rays onto flat ground 500 m below, hits from 1 to 20 km.
    let list: Vec<[f32; 3]> = (0..60)
        .map(|i| {
            let t = 1000.0 * 1.052_f64.powi(i);
            let down: f64 = (500.0 + t * t / 2e8) / t;
            [(1.0 - down * down).sqrt() as f32, -down as f32, t as f32]
        })
        .collect();
    let run = |epsilon: &str| {
        let expression = format!(
            "parts(march(field(0.0, 1.0, 0u), 1e8, 500.0, vec3f(in.f[0], in.f[1], 0.0), 0.1, 1e5, 0.5, {epsilon}, 5000, 1))"
        );
        Hits(on_fields(
            "march",
            "TerrainHit, march",
            &expression,
            3,
            &bits(&list),
        ))
    };
    let growing = run("1.0");
    // The same tolerance at every distance: that of 1 km.
    let constant = run("1000.0 / in.f[2]");
    let (mut saved, mut far) = (0.0, 0.0);
    let mut largest: f64 = 0.0;
    for ((g, c), row) in growing.each().zip(constant.each()).zip(&list) {
        assert!(g[0] > 0.0 && c[0] > 0.0);
        assert!(g[2] <= 0.001 * g[0], "{g:?}");
        largest = largest.max(g[2] / g[0]);
        assert!(g[3] <= c[3], "never more steps");
        if row[2] > 5000.0 {
            saved += c[3] - g[3];
            far += c[3];
        }
    }
    println!(
        "clearance at the hit: at most {largest:.2e} of the distance; far hits save {:.0} % of the steps of a constant tolerance",
        100.0 * saved / far
    );
    assert!(largest > 5e-4 && saved > 0.15 * far);
}

#[test]
fn row_l15_octave_counts_act_on_their_own_term_only() {
    let prelude = format!(
        "{MOUNTAINS}
fn all(o: i32, n: i32, s: i32, dir: vec3f) -> vec4f {{
    let hit = march(mountains(), 6.36e6, 3500.0, dir, 0.1, 6e4, 0.5, 1.0, 500, o);
    let point = dir * 4000.0;
    let normal = terrain_normal(mountains(), 6.36e6, 3500.0, point, 4.0, n);
    let shadow = soft_shadow(mountains(), 6.36e6, 3500.0, vec3f(point.x, -2800.0, point.z), vec3f(0.0, 1.0, 0.0), vec3f(0.8, 0.6, 0.0), 0.5, 3e4, 8.0, 0.5, 1.0, 60, s);
    return vec4f(hit.distance, normal.x, normal.z, shadow.light);
}}
"
    );
    let imports = &[
        "veduta::terrain::height::{Terrain}",
        "veduta::terrain::march::{TerrainHit, march}",
        "veduta::terrain::normal::{terrain_normal}",
        "veduta::terrain::shadow::{TerrainShadow, soft_shadow}",
    ];
    let rays: Vec<[f32; 3]> = (0..2000)
        .map(|i| toward(-5.0 - f64::from(i % 10) * 3.0, f64::from(i) * 0.18))
        .collect();
    let run = |octaves: [u32; 3]| -> Vec<[f64; 4]> {
        let rows: Vec<u32> = rays
            .iter()
            .flat_map(|d| {
                [
                    octaves[0],
                    octaves[1],
                    octaves[2],
                    d[0].to_bits(),
                    d[1].to_bits(),
                    d[2].to_bits(),
                ]
            })
            .collect();
        let values = evaluator(
            imports,
            &prelude,
            "all(in.i[0], in.i[1], in.i[2], vec3f(in.f[3], in.f[4], in.f[5]))",
            6,
        )
        .run(&rows)
        .unwrap();
        values.chunks(4).map(|v| [v[0], v[1], v[2], v[3]]).collect()
    };
    let base = run([10, 11, 6]);
    let differ = |a: &[[f64; 4]]| -> [bool; 3] {
        let any = |k: usize| a.iter().zip(&base).any(|(x, y)| x[k] != y[k]);
        [any(0), any(1) || any(2), any(3)]
    };
    assert_eq!(differ(&run([7, 11, 6])), [true, false, false]);
    assert_eq!(differ(&run([10, 8, 6])), [false, true, false]);
    assert_eq!(differ(&run([10, 11, 1])), [false, false, true]);
}

#[test]
fn row_l16_normals() {
    let (device_rows, list) = rows(2000, 16, |r| {
        [r.between(-3000.0, 3000.0), r.between(-3000.0, 3000.0)]
    });
    let (a, w) = (100.0, 200.0);
    let truth: Vec<[f64; 3]> = list
        .iter()
        .map(|p| {
            let (x, z) = (p[0] / w, p[1] / w);
            normalize([-a / w * x.cos() * z.cos(), 1.0, a / w * x.sin() * z.sin()])
        })
        .collect();
    let worst = |step: f64| -> f64 {
        let expression =
            format!("local_normal(field(100.0, 200.0, 2u), vec2f(in.f[0], in.f[1]), {step:?}, 1)");
        let values = on_fields("normal", "local_normal", &expression, 2, &device_rows);
        values
            .chunks(3)
            .zip(&truth)
            .map(|(v, t)| (0..3).map(|k| (v[k] - t[k]).abs()).fold(0.0, f64::max))
            .fold(0.0, f64::max)
    };
    let (wide, half, quarter) = (worst(80.0), worst(40.0), worst(20.0));
    println!(
        "normals of waves: error {wide:.2e}, {half:.2e}, {quarter:.2e} at steps of 80, 40, 20 m"
    );
    assert!((3.4..4.6).contains(&(wide / half)) && (3.4..4.6).contains(&(half / quarter)));
    // On the mountains every normal points up, unit length, also far off where "up" has turned.
    let (device_rows, list) = rows(5000, 17, |r| {
        [
            r.between(-6e4, 6e4),
            r.between(-1500.0, 0.0),
            r.between(-6e4, 6e4),
            r.between(0.1, 50.0),
        ]
    });
    let imports = &[
        "veduta::terrain::height::{Terrain}",
        "veduta::terrain::normal::{local_normal, terrain_normal}",
    ];
    let prelude = format!(
        "{MOUNTAINS}fn both(p: vec3f, step: f32) -> vec4f {{ return vec4f(local_normal(mountains(), p.xz, step, 11).y, terrain_normal(mountains(), 6.36e6, 1000.0, p, step, 11)); }}"
    );
    let values = evaluator(
        imports,
        &prelude,
        "both(vec3f(in.f[0], in.f[1], in.f[2]), in.f[3])",
        4,
    )
    .run(&device_rows)
    .unwrap();
    for (v, p) in values.chunks(4).zip(&list) {
        let normal = [v[1], v[2], v[3]];
        let up = planet::up_at(RADIUS, 1000.0, [p[0], p[1], p[2]]);
        assert!(
            v[0] > 0.0 && normal[1] > 0.0 && dot(normal, up) > 0.0,
            "{v:?}"
        );
        assert!((dot(normal, normal) - 1.0).abs() < 1e-5);
        // The eye's frame sees the slope of the surface over the turned ground: the same cosine to second order.
        assert!(
            (dot(normal, up) - v[0]).abs() < 0.02,
            "{} {}",
            dot(normal, up),
            v[0]
        );
    }
}

const LIGHTS: &str = "
fn lights() -> ThreeLights { return ThreeLights(vec3f(1.0, 0.9, 0.75), vec3f(0.05, 0.08, 0.13), vec3f(0.13, 0.11, 0.09)); }
fn only(k: i32) -> ThreeLights {
    let a = lights();
    return ThreeLights(a.sun_color * f32(k == 0), a.sky_color * f32(k == 1), a.bounce_color * f32(k == 2));
}
";

/// Light on (normal, direction to the sun, shadow) rows; `which` is an expression of type `ThreeLights`.
fn shade(which: &str, list: &[([f32; 3], [f32; 3], f32)]) -> Vec<[f64; 3]> {
    let rows: Vec<[f32; 7]> = list
        .iter()
        .map(|(n, s, a)| [n[0], n[1], n[2], s[0], s[1], s[2], *a])
        .collect();
    let expression = format!(
        "shade_three_lights({which}, vec3f(in.f[0], in.f[1], in.f[2]), vec3f(in.f[3], in.f[4], in.f[5]), in.f[6])"
    );
    let values = evaluator(
        &["veduta::terrain::shading::{ThreeLights, shade_three_lights}"],
        LIGHTS,
        &expression,
        7,
    )
    .run(&bits(&rows))
    .unwrap();
    values.chunks(3).map(|v| [v[0], v[1], v[2]]).collect()
}

const SUNLIGHT: [f64; 3] = [1.0, 0.9, 0.75];

#[test]
fn row_l17_direct_light() {
    let sun = toward(35.0, 20.0);
    let mut random = Random(17);
    let list: Vec<([f32; 3], [f32; 3], f32)> = (0..500)
        .map(|_| (direction(&mut random), sun, 1.0))
        .collect();
    for (value, (normal, ..)) in shade("only(0)", &list).iter().zip(&list) {
        let cosine = dot(normal.map(f64::from), sun.map(f64::from)).max(0.0);
        for k in 0..3 {
            assert!((value[k] - cosine * f64::from(SUNLIGHT[k] as f32)).abs() < 1e-6);
        }
        if cosine == 0.0 {
            assert_eq!(*value, [0.0; 3]);
        }
    }
    // The only light with a shadow.
    let slope = toward(60.0, 100.0);
    for (which, shadowed) in [("only(0)", true), ("only(1)", false), ("only(2)", false)] {
        let v = shade(which, &[(slope, sun, 0.0), (slope, sun, 1.0)]);
        assert_eq!(v[0] != v[1], shadowed, "{which}");
    }
    assert_eq!(shade("only(0)", &[(slope, sun, 0.0)])[0], [0.0; 3]);
}

#[test]
fn row_l18_ambient_light() {
    let normal = toward(50.0, 10.0);
    let around: Vec<_> = (0..12)
        .map(|i| (normal, toward(30.0, 30.0 * f64::from(i)), 0.0))
        .collect();
    let values = shade("only(1)", &around);
    assert!(
        values
            .iter()
            .all(|v| *v == values[0] && v[2] > v[1] && v[1] > v[0]),
        "sky-coloured, whatever the sun's azimuth"
    );
    assert!((values[0][2] - 0.13 * f64::from(normal[1])).abs() < 1e-6);
    let all = shade("lights()", &around[..1])[0];
    assert!(all[2] >= values[0][2], "present in shadow");
    assert_eq!(
        shade("only(1)", &[([0.0, -1.0, 0.0], toward(30.0, 0.0), 1.0)])[0],
        [0.0; 3]
    );
}

#[test]
fn row_l19_bounce_light() {
    let sun = toward(30.0, 70.0);
    let faces: Vec<_> = (0..72)
        .map(|i| (toward(20.0, 5.0 * f64::from(i)), sun, 1.0))
        .collect();
    let values = shade("only(2)", &faces);
    let brightest = (0..72)
        .max_by(|a, b| values[*a][0].total_cmp(&values[*b][0]))
        .unwrap();
    assert_eq!(
        5 * brightest,
        250,
        "brightest away from the sun's azimuth of 70"
    );
    // Each light on the face that it meets squarely: bounce between ambient and direct.
    let square =
        |which: &str, normal: [f32; 3]| shade(which, &[(normal, sun, 1.0)])[0].iter().sum::<f64>();
    let (direct, ambient, bounce) = (
        square("only(0)", sun),
        square("only(1)", [0.0, 1.0, 0.0]),
        square("only(2)", toward(0.0, 250.0)),
    );
    println!("direct {direct:.3}, bounce {bounce:.3}, ambient {ambient:.3}");
    assert!(direct > 2.0 * bounce && bounce > ambient && bounce < 1.5 * ambient);
    // With the sun in the zenith there is no direction to come from, and no NaN.
    let zenith = shade(
        "only(2)",
        &[
            (toward(0.0, 0.0), [0.0, 1.0, 0.0], 1.0),
            (toward(0.0, 0.0), [1e-30, 1.0, 0.0], 1.0),
        ],
    );
    assert!(zenith.iter().all(|v| *v == [0.0; 3]), "{zenith:?}");
}

#[test]
fn shading_keeps_its_promised_error() {
    let (device_rows, list) = rows(20_000, 18, |r| {
        let (n, s) = (direction(r), direction(r));
        [
            n[0],
            n[1],
            n[2],
            s[0],
            s[1],
            s[2],
            r.unit(),
            r.between(-2.0, 2.0),
        ]
    });
    let model = terrain::ThreeLights {
        sun_color: [1.0_f32, 0.9, 0.75].map(f64::from),
        sky_color: [0.05_f32, 0.08, 0.13].map(f64::from),
        bounce_color: [0.13_f32, 0.11, 0.09].map(f64::from),
    };
    let truth: Vec<f64> = list
        .iter()
        .flat_map(|r| {
            terrain::shade_three_lights(&model, [r[0], r[1], r[2]], [r[3], r[4], r[5]], r[6])
        })
        .collect();
    let values = evaluator(
        &["veduta::terrain::shading::{ThreeLights, shade_three_lights}"],
        LIGHTS,
        "shade_three_lights(lights(), vec3f(in.f[0], in.f[1], in.f[2]), vec3f(in.f[3], in.f[4], in.f[5]), in.f[6])",
        8,
    )
    .run(&device_rows)
    .unwrap();
    assert_promise("terrain/shading", "shade_three_lights", &values, &truth);
    let truth: Vec<f64> = list
        .iter()
        .flat_map(|r| terrain::bounce_direction([r[3], r[4], r[5]]))
        .collect();
    let values = evaluator(
        &["veduta::terrain::shading::{bounce_direction}"],
        "",
        "bounce_direction(vec3f(in.f[3], in.f[4], in.f[5]))",
        8,
    )
    .run(&device_rows)
    .unwrap();
    assert_promise("terrain/shading", "bounce_direction", &values, &truth);
    let truth: Vec<f64> = list
        .iter()
        .map(|r| {
            terrain::snow_blend(
                r[1].abs(),
                r[7],
                f64::from(0.1_f32),
                f64::from(0.9_f32),
                f64::from(0.2_f32),
            )
        })
        .collect();
    let values = evaluator(
        &["veduta::terrain::material::{snow_blend}"],
        "",
        "snow_blend(abs(in.f[1]), in.f[7], 0.1, 0.9, 0.2)",
        8,
    )
    .run(&device_rows)
    .unwrap();
    assert_promise("terrain/material", "snow_blend", &values, &truth);
    let change = |r: &[f64; 8]| [4, 5, 3].map(|k| f64::from(r[k] as f32 * 0.007_812_5));
    let truth: Vec<f64> = list
        .iter()
        .flat_map(|r| {
            terrain::surface_footprint([r[0], r[1], r[2]], change(r), 1e5, [r[3], r[4], r[5]])
        })
        .collect();
    let values = evaluator(
        &["veduta::terrain::material::{surface_footprint}"],
        "",
        "surface_footprint(vec3f(in.f[0], in.f[1], in.f[2]), vec3f(in.f[4], in.f[5], in.f[3]) * 0.0078125, 1e5, vec3f(in.f[3], in.f[4], in.f[5]))",
        8,
    )
    .run(&device_rows)
    .unwrap();
    assert_promise("terrain/material", "surface_footprint", &values, &truth);
}

#[test]
fn row_l20_soft_terrain_shadow() {
    // A wall of growing height 1 km away on flat ground, the sun 20 degrees high behind it.
    let heights: Vec<[f32; 1]> = (0..=120).map(|i| [5.0 * i as f32]).collect();
    let sun = toward(20.0, 0.0);
    let shadow = |sharpness: f32| -> Vec<f64> {
        let expression = format!(
            "soft_shadow(field(in.f[0], 1000.0, 3u), 1e8, 2.0, vec3f(0.0, -2.0, 0.0), vec3f(0.0, 1.0, 0.0), vec3f({:?}, {:?}, 0.0), 0.5, 2e4, {sharpness:?}, 0.25, 0.01, 400, 1).light",
            sun[0], sun[1]
        );
        on_fields(
            "shadow",
            "TerrainShadow, soft_shadow",
            &expression,
            1,
            &bits(&heights),
        )
    };
    let light = shadow(16.0);
    // The ray passes the wall's near edge at 0.5 + 950 tan 20 degrees = 346 m.
    let edge = 0.5 + 950.0 * 20.0_f64.to_radians().tan();
    println!(
        "wall 0, 250, 300, 330, 340, 350 m: {:?}",
        [0, 50, 60, 66, 68, 70].map(|i| light[i])
    );
    assert_eq!(light[0], 1.0, "clear ray");
    for (height, l) in heights.iter().zip(&light) {
        assert!((0.0..=1.0).contains(l));
        if f64::from(height[0]) > edge + 40.0 {
            assert_eq!(*l, 0.0, "occluder of {} m", height[0]);
        }
    }
    assert!(
        light.windows(2).all(|w| w[1] <= w[0] + 1e-6),
        "monotone in the clearance"
    );
    assert!(
        light.iter().filter(|l| **l > 0.02 && **l < 0.98).count() > 3,
        "near misses lie between"
    );
    let hard = shadow(200.0);
    let between = |v: &[f64]| v.iter().filter(|l| **l > 0.0 && **l < 1.0).count();
    assert!(between(&hard) < between(&light), "sharper");
}

const ROCK: &str = "
fn rock() -> Rock {
    return Rock(vec3i(5, -3, 9), vec3f(0.5, 0.25, 0.125), 32.0, 5, 1.0, vec3f(0.10, 0.09, 0.08), vec3f(0.34, 0.30, 0.26), vec3f(0.06, 0.05, 0.05), 7u);
}
";

fn rock() -> Rock {
    Rock {
        cell: [5, -3, 9],
        frac: [0.5, 0.25, 0.125],
        wavelength: 32.0,
        octaves: 5,
        hurst: 1.0,
        dark: [0.10_f32, 0.09, 0.08].map(f64::from),
        light: [0.34_f32, 0.30, 0.26].map(f64::from),
        stain: [0.06_f32, 0.05, 0.05].map(f64::from),
        seed: 7,
    }
}

#[test]
fn row_l21_two_rock_textures() {
    let (device_rows, list) = rows(1 << 15, 21, |r| {
        [
            r.between(-1e4, 1e4),
            r.between(0.0, 3000.0),
            r.between(-1e4, 1e4),
        ]
    });
    let place = "vec3f(in.f[0], in.f[1], in.f[2])";
    let build = |name: &str, body: &str| {
        let prelude = format!(
            "{ROCK}fn many(p: vec3f) -> vec3f {{ var sum = vec3f(0.0); for (var i = 0; i < 16; i++) {{ sum += {name}(rock(), p + f32(i)); }} return sum; }}"
        );
        let prelude = if body == "many" {
            prelude
        } else {
            ROCK.to_owned()
        };
        evaluator(
            &[&format!("veduta::terrain::material::{{Rock, {name}}}")],
            &prelude,
            &format!(
                "{body}({})",
                if body == "many" {
                    place.to_owned()
                } else {
                    format!("rock(), {place}")
                }
            ),
            3,
        )
    };
    let (low, high) = (
        build("rock_low", "rock_low").run(&device_rows).unwrap(),
        build("rock_high", "rock_high").run(&device_rows).unwrap(),
    );
    assert_ne!(low, high);
    let n = 2000;
    let truth: Vec<f64> = list[..n]
        .iter()
        .flat_map(|p| terrain::rock_low(&rock(), *p))
        .collect();
    assert_promise("terrain/material", "rock_low", &low[..3 * n], &truth);
    let truth: Vec<f64> = list[..n]
        .iter()
        .flat_map(|p| terrain::rock_high(&rock(), *p))
        .collect();
    assert_promise("terrain/material", "rock_high", &high[..3 * n], &truth);
    for (name, values) in [("cheap", &low), ("fine", &high)] {
        let red: Vec<f64> = values.chunks(3).map(|v| v[0]).collect();
        let (least, most) = red
            .iter()
            .fold((1.0_f64, 0.0_f64), |s, v| (s.0.min(*v), s.1.max(*v)));
        println!("{name} rock: red albedo {least:.3} to {most:.3}");
        assert!(most - least > 0.1 && least >= 0.05 && most <= 0.35);
    }
    // Time of 16 samples a row, turn and turn about, the best of five.
    let (cheap, fine) = (build("rock_low", "many"), build("rock_high", "many"));
    let mut times = [f64::INFINITY; 2];
    for _ in 0..5 {
        for (k, e) in [&cheap, &fine].into_iter().enumerate() {
            let start = Instant::now();
            e.run(&device_rows).unwrap();
            times[k] = times[k].min(start.elapsed().as_secs_f64());
        }
    }
    println!(
        "cheap rock {:.1} ms, fine rock {:.1} ms for {} samples",
        1e3 * times[0],
        1e3 * times[1],
        16 * list.len()
    );
    assert!(times[0] < 0.6 * times[1], "{times:?}");
}

#[test]
fn row_l22_snow_by_slope() {
    let snow = |list: &[[f32; 2]]| {
        evaluator(
            &["veduta::terrain::material::{snow_blend}"],
            "",
            "snow_blend(in.f[0], in.f[1], 0.1, 0.32, 0.15)",
            2,
        )
        .run(&bits(list))
        .unwrap()
    };
    // Neither altitude nor position is an argument: slope and noise alone decide.
    assert_eq!(snow(&[[1.0, 0.0], [0.5, 0.0], [0.0, 0.0]]), [1.0, 0.0, 0.0]);
    let ramp: Vec<[f32; 2]> = (0..=100).map(|i| [0.6 + 0.004 * i as f32, 0.0]).collect();
    assert!(
        snow(&ramp).windows(2).all(|w| w[0] <= w[1]),
        "flatter is whiter"
    );
    // The noise moves the border: more of it, more snow on the same slope.
    let moved = snow(&[[0.8, -0.5], [0.8, 0.0], [0.8, 0.5]]);
    assert!(moved[0] < moved[1] && moved[1] < moved[2], "{moved:?}");
    // However large the noise, the edges keep their order: no NaN, no inversion.
    let wild: Vec<[f32; 2]> = (0..=40)
        .flat_map(|i| {
            [
                [0.5 + 0.0125 * i as f32, 30.0],
                [0.5 + 0.0125 * i as f32, -30.0],
            ]
        })
        .collect();
    let values = snow(&wild);
    assert!(values.iter().all(|v| (0.0..=1.0).contains(v)));
    assert!(
        values
            .chunks(2)
            .collect::<Vec<_>>()
            .windows(2)
            .all(|w| w[0][0] <= w[1][0] && w[0][1] <= w[1][1])
    );
}

#[test]
fn row_l23_texture_filtering() {
    // A distant wall: pixels 24 m apart on a texture whose first octave is 32 m.
    let grid: Vec<[f32; 3]> = (0..64 * 64)
        .map(|i| [24.0 * (i % 64) as f32, 24.0 * (i / 64) as f32, 3.0])
        .collect();
    for name in ["rock_low", "rock_high"] {
        let run = |text: &str| {
            let expression = text
                .replace("P", "vec3f(in.f[0], in.f[1], in.f[2])")
                .replace("D", "vec3f(24.0, 0.0, 0.0), vec3f(0.0, 24.0, 0.0)");
            let function = expression.split('(').next().unwrap().to_owned();
            evaluator(
                &[&format!("veduta::terrain::material::{{Rock, {function}}}")],
                ROCK,
                &expression,
                3,
            )
            .run(&bits(&grid))
            .unwrap()
        };
        let plain = run(&format!("{name}(rock(), P)"));
        assert_eq!(
            plain,
            run(&format!("{name}_filtered(rock(), P, D, 1)")),
            "one sample is the unfiltered texture"
        );
        let spread = |v: &[f64]| {
            let red: Vec<f64> = v.chunks(3).map(|c| c[0]).collect();
            let mean = red.iter().sum::<f64>() / red.len() as f64;
            (
                mean,
                red.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / red.len() as f64,
            )
        };
        let (mean, variance) = spread(&plain);
        let mut last = variance;
        for n in [2, 4] {
            let values = run(&format!("{name}_filtered(rock(), P, D, {n})"));
            let (own_mean, own) = spread(&values);
            println!(
                "{name} {n} x {n}: variance {:.3} of the unfiltered, mean {own_mean:.4} instead of {mean:.4}",
                own / variance
            );
            assert!(own < 0.95 * last, "variance drops");
            assert!(
                (own_mean / mean - 1.0).abs() < 0.03,
                "the mean colour stays"
            );
            last = own;
        }
        assert!(last < 0.6 * variance);
        let values = run(&format!("{name}_filtered(rock(), P, D, 3)"));
        let twin = |p: &[f32; 3]| {
            let (at, x, y) = (p.map(f64::from), [24.0, 0.0, 0.0], [0.0, 24.0, 0.0]);
            if name == "rock_low" {
                terrain::rock_low_filtered(&rock(), at, x, y, 3)
            } else {
                terrain::rock_high_filtered(&rock(), at, x, y, 3)
            }
        };
        let truth: Vec<f64> = grid[..300].iter().flat_map(twin).collect();
        assert_promise(
            "terrain/material",
            &format!("{name}_filtered"),
            &values[..900],
            &truth,
        );
    }
}

#[test]
fn terrain_functions_keep_their_promised_error() {
    let model = mountains();
    let (device_rows, list) = rows(3000, 41, |r| {
        let d = direction(r);
        [
            r.between(-6e4, 6e4),
            r.between(-1500.0, 0.0),
            r.between(-6e4, 6e4),
            r.between(1.0, 50.0),
            d[0],
            d[1],
            d[2],
            r.between(0.0, 6e4),
        ]
    });
    let run = |module: &str, name: &str, expression: &str| {
        let import = format!("veduta::terrain::{module}::{{{name}}}");
        let mut imports = vec!["veduta::terrain::height::{Terrain}"];
        if module == "height" {
            imports.clear();
        }
        let import = if module == "height" {
            "veduta::terrain::height::{Terrain, height}".to_owned()
        } else {
            import
        };
        imports.push(&import);
        evaluator(&imports, MOUNTAINS, expression, 8)
            .run(&device_rows)
            .unwrap()
    };
    let place = "vec3f(in.f[0], in.f[1], in.f[2])";
    // The height over its whole domain: far out, with many octaves.
    let (far_rows, far) = rows(20_000, 42, |r| {
        let reach = if r.unit() < 0.5 { 1e5 } else { 6e4 };
        [r.between(-reach, reach), r.between(-reach, reach)]
    });
    for octaves in [1, 10, 16] {
        let truth: Vec<f64> = far
            .iter()
            .map(|r| terrain::height(&model, [r[0], r[1]], octaves))
            .collect();
        let values = evaluator(
            &["veduta::terrain::height::{Terrain, height}"],
            MOUNTAINS,
            &format!("height(mountains(), vec2f(in.f[0], in.f[1]), {octaves})"),
            2,
        )
        .run(&far_rows)
        .unwrap();
        if octaves == 16 {
            assert_promise("terrain/height", "height", &values, &truth);
        } else {
            let worst = values
                .iter()
                .zip(&truth)
                .map(|(v, t)| (v - t).abs())
                .fold(0.0, f64::max);
            println!("height with {octaves} octaves: error {worst:.1e} m");
            assert!(worst <= 1.5e-2);
        }
    }
    let truth: Vec<f64> = list
        .iter()
        .map(|r| terrain::height(&model, [r[0], r[2]], 10))
        .collect();
    println!(
        "heights {:.0} to {:.0} m",
        truth.iter().copied().fold(f64::INFINITY, f64::min),
        truth.iter().copied().fold(0.0, f64::max)
    );
    let truth: Vec<f64> = list
        .iter()
        .map(|r| terrain::ray_clearance(&model, RADIUS, 1000.0, [r[4], r[5], r[6]], r[7], 10))
        .collect();
    let values = run(
        "march",
        "ray_clearance",
        "ray_clearance(mountains(), 6.36e6, 1000.0, vec3f(in.f[4], in.f[5], in.f[6]), in.f[7], 10)",
    );
    assert_promise("terrain/march", "ray_clearance", &values, &truth);
    let truth: Vec<f64> = list
        .iter()
        .flat_map(|r| terrain::terrain_slope(&model, [r[0], r[2]], r[3], 11))
        .collect();
    assert_promise(
        "terrain/normal",
        "terrain_slope",
        &run(
            "normal",
            "terrain_slope",
            "terrain_slope(mountains(), vec2f(in.f[0], in.f[2]), in.f[3], 11)",
        ),
        &truth,
    );
    let truth: Vec<f64> = list
        .iter()
        .flat_map(|r| terrain::local_normal(&model, [r[0], r[2]], r[3], 11))
        .collect();
    assert_promise(
        "terrain/normal",
        "local_normal",
        &run(
            "normal",
            "local_normal",
            "local_normal(mountains(), vec2f(in.f[0], in.f[2]), in.f[3], 11)",
        ),
        &truth,
    );
    let truth: Vec<f64> = list
        .iter()
        .flat_map(|r| terrain::terrain_normal(&model, RADIUS, 1000.0, [r[0], r[1], r[2]], r[3], 11))
        .collect();
    let values = run(
        "normal",
        "terrain_normal",
        &format!("terrain_normal(mountains(), 6.36e6, 1000.0, {place}, in.f[3], 11)"),
    );
    assert_promise("terrain/normal", "terrain_normal", &values, &truth);
}

#[test]
fn terrain_marches_keep_their_promised_error() {
    let model = mountains();
    let list: Vec<[f32; 4]> = {
        let mut random = Random(42);
        (0..300)
            .map(|_| {
                let d = toward(
                    f64::from(random.between(-30.0, 3.0)),
                    f64::from(random.between(0.0, 360.0)),
                );
                [d[0], d[1], d[2], random.between(2000.0, 3500.0)]
            })
            .collect()
    };
    let imports = &[
        "veduta::terrain::height::{Terrain}",
        "veduta::terrain::march::{TerrainHit, march, march_constant}",
    ];
    let prelude = format!(
        "{MOUNTAINS}{PARTS}fn used(d: vec3f, h: f32) -> f32 {{ return march(mountains(), 6.36e6, h, d, 0.1, 1.0, 0.5, 1.0, 1, 1).distance + march_constant(mountains(), 6.36e6, h, d, 0.1, 1.0, 0.5, 1, 1, true).distance; }}"
    );
    let run = |expression: &str| {
        Hits(
            evaluator(imports, &prelude, expression, 4)
                .run(&bits(&list))
                .unwrap(),
        )
    };
    let dir = |r: &[f32; 4]| [r[0], r[1], r[2]].map(f64::from);
    // A ray whose own hit moves when the eye moves by a centimetre is decided by rounding; it is left out.
    let judge = |name: &str, hits: &Hits, twin: &dyn Fn(&[f32; 4], f64) -> f64| {
        let (mut device, mut truth, mut left) = (vec![], vec![], 0);
        let bound = promise("terrain/march", name).value;
        for (hit, row) in hits.each().zip(&list) {
            let middle = twin(row, 0.0);
            if (hit[0] - middle).abs() > bound
                && [-0.02, 0.02]
                    .iter()
                    .any(|e| (twin(row, *e) - middle).abs() > 0.1 * bound)
            {
                left += 1;
                continue;
            }
            device.push(hit[0]);
            truth.push(middle);
        }
        println!(
            "{name}: {left} of {} rays left out as unstable, {} hits",
            list.len(),
            truth.iter().filter(|t| **t > 0.0).count()
        );
        assert!(left <= 6 && truth.iter().filter(|t| **t > 0.0).count() > 150);
        assert_promise("terrain/march", name, &device, &truth);
    };
    let hits = run(
        "parts(march(mountains(), 6.36e6, in.f[3], vec3f(in.f[0], in.f[1], in.f[2]), 0.1, 6e4, 0.5, 1.0, 200, 10))",
    );
    let rays: Vec<f64> = hits.each().map(|h| h[3]).collect();
    println!(
        "steps of a ray: {:.1} on average",
        rays.iter().sum::<f64>() / rays.len() as f64
    );
    judge("march", &hits, &|r, e| {
        terrain::march(
            &model,
            RADIUS,
            f64::from(r[3]) + e,
            dir(r),
            f64::from(0.1_f32),
            6e4,
            0.5,
            1.0,
            200,
            10,
        )
        .distance
    });
    let hits = run(
        "parts(march_constant(mountains(), 6.36e6, in.f[3], vec3f(in.f[0], in.f[1], in.f[2]), 0.1, 2e4, 50.0, 1000, 6, true))",
    );
    judge("march_constant", &hits, &|r, e| {
        terrain::march_constant(
            &model,
            RADIUS,
            f64::from(r[3]) + e,
            dir(r),
            f64::from(0.1_f32),
            2e4,
            50.0,
            1000,
            6,
            true,
        )
        .distance
    });
    // Shadows at points on the ground.
    let mut random = Random(43);
    let spots: Vec<[f32; 6]> = (0..400)
        .map(|_| {
            let (x, z) = (random.between(-2e4, 2e4), random.between(-2e4, 2e4));
            let height = terrain::height(&model, [f64::from(x), f64::from(z)], 6);
            let s = toward(
                f64::from(random.between(3.0, 50.0)),
                f64::from(random.between(0.0, 360.0)),
            );
            let drop = f64::from(x * x + z * z) / (2.0 * RADIUS);
            [x, (height - 1000.0 - drop) as f32, z, s[0], s[1], s[2]]
        })
        .collect();
    let values = evaluator(
        &["veduta::terrain::height::{Terrain}", "veduta::terrain::shadow::{TerrainShadow, soft_shadow}"],
        MOUNTAINS,
        "soft_shadow(mountains(), 6.36e6, 1000.0, vec3f(in.f[0], in.f[1], in.f[2]), vec3f(0.0, 1.0, 0.0), vec3f(in.f[3], in.f[4], in.f[5]), 5.0, 6e4, 24.0, 0.5, 1.0, 60, 6).light",
        6,
    )
    .run(&bits(&spots))
    .unwrap();
    let twin = |r: &[f32; 6], up: f64| {
        let p = [f64::from(r[0]), f64::from(r[1]) + up, f64::from(r[2])];
        terrain::soft_shadow(
            &model,
            RADIUS,
            1000.0,
            p,
            [0.0, 1.0, 0.0],
            [r[3], r[4], r[5]].map(f64::from),
            5.0,
            6e4,
            24.0,
            0.5,
            1.0,
            60,
            6,
        )
    };
    let bound = promise("terrain/shadow", "soft_shadow").value;
    let (mut device, mut truth, mut left) = (vec![], vec![], 0);
    for (v, r) in values.iter().zip(&spots) {
        let middle = twin(r, 0.0);
        if (v - middle).abs() > bound
            && [-0.02, 0.02]
                .iter()
                .any(|e| (twin(r, *e) - middle).abs() > 0.1 * bound)
        {
            left += 1;
        } else {
            device.push(*v);
            truth.push(middle);
        }
    }
    let dark = truth.iter().filter(|v| **v == 0.0).count();
    println!(
        "soft_shadow: {left} of 400 points left out as unstable, {dark} in shadow, {} clear",
        truth.iter().filter(|v| **v == 1.0).count()
    );
    assert!(left <= 8 && dark > 30 && truth.len() - dark > 100);
    assert_promise("terrain/shadow", "soft_shadow", &device, &truth);
}
