//! Exit codes and help.

use crate::common::{folder, veduta};

#[test]
fn help_names_every_command() {
    let dir = folder("help");
    let help = veduta(&dir, &["--help"]).good().out;
    for command in ["render", "compose", "lint", "list", "bench", "cost", "eval"] {
        assert!(help.contains(command), "{help}");
        assert!(!veduta(&dir, &[command, "--help"]).good().out.is_empty());
    }
    veduta(&dir, &["--version"]).good();
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
