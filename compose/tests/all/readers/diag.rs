//! Places, suggestions and the form of messages.

use veduta_compose::diag::{Diag, Diags, line_at, line_column, nearest};

#[test]
fn a_diag_shows_place_line_and_caret() {
    let text = "one\n\tzwö = x1\nthree";
    let offset = text.find("x1").unwrap();
    let diag = Diag::at("a.sp", text, offset, "wrong").note("seen before");
    assert_eq!((diag.line, diag.column), (2, 8));
    assert_eq!(
        diag.to_string(),
        "a.sp:2:8: wrong\n\tzwö = x1\n\t      ^\nnote: seen before"
    );
    let both = Diags(vec![diag, Diag::whole_file("b.sp", "not UTF-8")]);
    assert!(both.to_string().ends_with("\nb.sp: not UTF-8"));
}

#[test]
fn places_count_characters_and_all_line_breaks() {
    let text = "a\r\nb\rc\nd";
    for (name, line) in [("a", 1), ("b", 2), ("c", 3), ("d", 4)] {
        let offset = text.find(name).unwrap();
        assert_eq!(line_column(text, offset), (line, 1), "{name}");
        assert_eq!(line_at(text, line), name);
    }
    assert_eq!(line_column("ä", 1), (1, 1), "inside a character");
    assert_eq!(line_column("ab\n", 99), (2, 1), "beyond the end");
    assert_eq!(line_at("ab", 7), "");
    assert_eq!(line_at("ab", 0), "");
}

#[test]
fn a_long_line_is_shown_as_a_window_around_the_column() {
    let text = format!("{}!{}", "x".repeat(400), "y".repeat(400));
    let shown = Diag::at("a", &text, 400, "m").to_string();
    let lines: Vec<&str> = shown.lines().collect();
    assert_eq!(lines[1].chars().count(), 166);
    let caret = lines[2].chars().position(|c| c == '^').unwrap();
    assert_eq!(lines[1].chars().nth(caret), Some('!'));
}

#[test]
fn the_nearest_name_is_found_and_a_far_one_is_not() {
    let names = ["CLOUD_STEPS", "ATMOS_STEPS", "SNOW", "VERTEX"];
    assert_eq!(nearest("CLOUD_STEP", names), Some("CLOUD_STEPS"));
    assert_eq!(nearest("CLUOD_STEPS", names), Some("CLOUD_STEPS"));
    assert_eq!(nearest("vertex", names), Some("VERTEX"));
    assert_eq!(nearest("SNWO", names), Some("SNOW"));
    assert_eq!(nearest("PENGUIN", names), None);
    assert_eq!(nearest("", names), None);
    assert_eq!(nearest("k", ["h"]), None);
    assert_eq!(nearest("H", ["k", "h"]), Some("h"));
    assert_eq!(nearest("hh", ["h"]), Some("h"));
    assert_eq!(nearest(&"x".repeat(100_000), names), None);
}
