//! Exit codes and help.

use veduta_cli::image::{read_exr, read_png, write_exr, write_png};

use crate::common::{folder, json, veduta};

#[test]
fn help_names_every_command() {
    let dir = folder("help");
    let help = veduta(&dir, &["--help"]).good().out;
    for command in [
        "render", "compose", "lint", "list", "bench", "cost", "stress", "diff", "eval", "probe",
    ] {
        assert!(help.contains(command), "{help}");
        assert!(!veduta(&dir, &[command, "--help"]).good().out.is_empty());
    }
    veduta(&dir, &["--version"]).good();
}

#[test]
fn no_command_defines_an_argument_twice() {
    <veduta_cli::args::Args as clap::CommandFactory>::command().debug_assert();
}

#[test]
fn arguments_that_cannot_be_read_exit_with_2() {
    let dir = folder("usage");
    veduta(&dir, &[]).bad(2, &["Usage"]);
    veduta(&dir, &["rendr"]).bad(2, &["rendr"]);
    veduta(&dir, &["render", "--size", "axb", "--out", "x.png"]).bad(2, &["axb", "800x450"]);
    veduta(&dir, &["render", "--camera", "1,2", "--out", "x.png"]).bad(2, &["1,2", "3 numbers"]);
    veduta(&dir, &["render", "--time", "soon", "--out", "x.png"]).bad(2, &["soon"]);
    veduta(&dir, &["compose", "landscape", "--target", "glsl"]).bad(2, &["glsl", "msl"]);
    veduta(&dir, &["eval", "--expr", "1.0"]).bad(2, &["--columns"]);
    veduta(&dir, &["lint"]).bad(2, &["PATHS"]);
}

#[test]
fn pictures_are_compared() {
    let dir = folder("diff");
    let grey = |v: u8| vec![v; 3 * 8 * 4];
    let png = |name: &str, bytes: &[u8]| write_png(&dir.join(name), 8, 4, bytes).unwrap();
    png("a.png", &grey(100));
    png("b.png", &grey(101));
    // One step everywhere is 48.13 dB.
    let run = veduta(
        &dir,
        &[
            "diff", "a.png", "b.png", "--json", "d.json", "--out", "d.png",
        ],
    )
    .good();
    assert!(run.out.contains("48.13"), "{}", run.out);
    let found = json(&dir.join("d.json"));
    assert!((found["psnr_db"].as_f64().unwrap() - 48.130_8).abs() < 1e-3);
    assert_eq!(found["worst"]["steps"], 1);
    assert_eq!(read_png(&dir.join("d.png")).unwrap().2, grey(120));
    // Linear: a tenth more is a relative RMSE of 0.1.
    let light: Vec<f32> = (0..96).map(|i| 0.1 + i as f32 / 96.0).collect();
    let more: Vec<f32> = light.iter().map(|v| 1.1 * v).collect();
    write_exr(&dir.join("a.exr"), 8, 4, &more).unwrap();
    write_exr(&dir.join("b.exr"), 8, 4, &light).unwrap();
    assert_eq!(read_exr(&dir.join("b.exr")).unwrap(), (8, 4, light.clone()));
    veduta(&dir, &["diff", "a.exr", "b.exr", "--json", "e.json"]).good();
    let found = json(&dir.join("e.json"))["relative_rmse"].as_f64().unwrap();
    assert!((found - 0.1).abs() < 1e-6, "{found}");
    assert_eq!(
        json(&{
            veduta(&dir, &["diff", "b.exr", "b.exr", "--json", "f.json"]).good();
            dir.join("f.json")
        })["equal"],
        true
    );
    write_exr(&dir.join("nan.exr"), 8, 4, &[f32::NAN; 96]).unwrap();
    veduta(&dir, &["diff", "nan.exr", "b.exr"]).bad(1, &["nan.exr", "NaN at (0, 0)", "finite"]);
    veduta(&dir, &["diff", "a.png", "b.exr"]).bad(1, &["8 bits", "linear"]);
    veduta(&dir, &["diff", "a.png", "none.png"]).bad(1, &["none.png"]);
    veduta(&dir, &["diff", "a.tif", "b.png"]).bad(1, &["a.tif", ".png or .exr"]);
    veduta(&dir, &["diff", "a.exr", "b.exr", "--exposure", "-1"]).bad(2, &["-1"]);
    veduta(&dir, &["diff", "a.exr", "b.exr", "--exposure", "NaN"]).bad(1, &["NaN", "at least 0"]);
    std::fs::write(dir.join("torn.png"), b"\x89PNG no picture").unwrap();
    veduta(&dir, &["diff", "torn.png", "b.png"]).bad(1, &["torn.png"]);
    std::fs::write(dir.join("torn.exr"), b"v/1\x01 no picture").unwrap();
    veduta(&dir, &["diff", "torn.exr", "b.exr"]).bad(1, &["torn.exr"]);
}
