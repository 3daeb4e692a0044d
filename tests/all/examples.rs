//! The examples, run without a window.

#[allow(dead_code)] // Its `main` only prints what `draw` returns.
#[path = "../../examples/host_app.rs"]
mod host_app;

#[test]
fn host_app_draws_a_landscape_in_under_80_lines() {
    let source = include_str!("../../examples/host_app.rs");
    assert!(source.lines().count() < 80, "{}", source.lines().count());

    let pixels = host_app::draw().unwrap();
    let (width, height) = (128, 72);
    assert_eq!(pixels.len(), 4 * width * height);
    let mean = |rows: std::ops::Range<usize>, channel: usize| {
        let part = &pixels[4 * width * rows.start..4 * width * rows.end];
        let sum: f64 = part
            .iter()
            .skip(channel)
            .step_by(4)
            .map(|b| f64::from(*b))
            .sum();
        sum / (width * rows.len()) as f64
    };
    let sky = [0, 1, 2].map(|c| mean(0..8, c));
    let ground = [0, 1, 2].map(|c| mean(height - 8..height, c));
    println!("sky {sky:.1?}, ground {ground:.1?}");
    // The clear sky away from the sun is blue and brighter than black, and the ground is something else.
    assert!(sky[2] > sky[0] + 5.0 && sky[2] > 30.0, "{sky:?}");
    assert!(
        (sky[2] - sky[0]) > (ground[2] - ground[0]) + 5.0,
        "{sky:?} {ground:?}"
    );
    assert!(
        pixels.chunks(4).all(|p| p[3] == 255),
        "every pixel is opaque"
    );
}
