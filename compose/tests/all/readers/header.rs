//! The header grammar: what is read, its documentation, and every fault with its message.

use super::blocks;
use veduta_compose::header::{Bound, ErrorKind, Headers, Param, Spacing, parse_headers};

const GRAMMAR: &str = include_str!("../../../../docs/header-grammar.md");

fn read(text: &str) -> Headers {
    parse_headers("k.wgsl", text).unwrap_or_else(|e| panic!("{e}"))
}

/// A module with one function of the given header lines.
fn module(lines: &[&str], function: &str) -> String {
    let mut text = "//! Title.\n//! source   ours\n\n/// One.\n///\n".to_owned();
    for line in lines {
        text.push_str(&format!("/// {line}\n"));
    }
    text + function
}

const GOOD: [&str; 4] = [
    "domain  h in [0, 1] m lin",
    "range   [0, 1] m",
    "error   0 abs of reference::a::f",
    "source  ours",
];
const FUNCTION: &str = "fn f(h: f32) -> f32 { return h; }\n";

/// The fault of a header whose line `index` is replaced, without the file name.
fn fault(index: usize, line: &str) -> String {
    let mut lines = GOOD;
    lines[index] = line;
    faults(&module(&lines, FUNCTION))
}

fn faults(text: &str) -> String {
    match parse_headers("k.wgsl", text) {
        Ok(headers) => panic!("accepted: {headers:?}"),
        Err(faults) => faults.to_string(),
    }
}

#[test]
fn the_examples_of_the_documentation_are_read() {
    let accepted = blocks(GRAMMAR, "wgsl");
    assert_eq!(accepted.len(), 2);
    let shell = read(accepted[0]);
    assert_eq!(shell.title, "Rays and altitudes over a spherical planet.");
    assert_eq!(
        shell.sources,
        ["Bruneton2017 (boundary distances); altitude form: ours"]
    );
    assert!(shell.symbols.unwrap().starts_with("h altitude [m] · mu"));
    assert_eq!(shell.functions.len(), 2);
    let top = &shell.functions[0];
    assert_eq!(
        (top.name.as_str(), top.place.line, top.place.column),
        ("top_distance", 15, 4)
    );
    assert_eq!(top.result.as_deref(), Some("f32"));
    assert_eq!(
        top.header.summary,
        "Distance from altitude `h`, along zenith cosine `mu`, to the top of the shell."
    );
    let radius = top.header.domain("ground_radius").unwrap();
    assert_eq!(radius.interval.lo, Bound::Number(3e6));
    assert_eq!(
        (radius.spacing, radius.interval.unit.as_str()),
        (Spacing::Log, "m")
    );
    let h = top.header.domain("h").unwrap();
    assert_eq!(
        h.interval.hi,
        Bound::Name {
            name: "top".into(),
            negative: false
        }
    );
    assert_eq!(
        h.interval.hi.value(|name| (name == "top").then_some(7.0)),
        Some(7.0)
    );
    let error = top.header.error.as_ref().unwrap();
    assert_eq!((error.value, error.kind), (4e-7, ErrorKind::Rel));
    assert_eq!(error.reference, "reference::planet::top_distance");
    assert_eq!(top.header.range.as_ref().unwrap().hi, Bound::Number(2.1e8));
    assert!(shell.functions[1].header.internal && !top.header.internal);

    let more = read(accepted[1]);
    assert_eq!(
        more.sources,
        ["ours", "Bruneton2017, of which a second line"]
    );
    let between = &more.functions[0];
    let param = |name: &str, ty: &str| Param {
        name: name.into(),
        ty: ty.into(),
    };
    assert_eq!(
        between.params,
        [
            param("a", "f32"),
            param("b", "f32"),
            param("layer", "Layer"),
            param("count", "i32"),
            param("at", "vec2<i32>"),
            param("seed", "u32"),
        ]
    );
    let header = &between.header;
    assert_eq!(
        header.summary,
        "Angle between two directions, in a header of two lines."
    );
    assert_eq!(
        header.source.as_deref(),
        Some("Someone2020 eq. 1; departs: guarded; Other2021")
    );
    assert_eq!(header.monotone, ["a", "layer.bottom"]);
    assert!(header.outside_undefined);
    let a = &header.domain("a").unwrap().interval;
    assert_eq!(a.lo, Bound::Number(-std::f64::consts::PI));
    assert_eq!((a.lo_open, a.hi_open), (false, true));
    let b = &header.domain("b").unwrap().interval;
    assert_eq!(b.lo.value(|_| Some(2.0)), Some(-2.0));
    assert_eq!(b.lo.to_string(), "-a");
    let bottom = &header.domain("layer.bottom").unwrap().interval;
    assert_eq!(bottom.hi, Bound::Number(f64::INFINITY));
    assert_eq!(bottom.lo, Bound::Number(1e-3));
    assert!(bottom.lo_open && bottom.hi_open);
}

#[test]
fn the_refused_examples_of_the_documentation_are_refused() {
    let refused = blocks(GRAMMAR, "wgsl refused");
    assert_eq!(refused.len(), 3);
    for block in refused {
        let (message, text) = block.split_once('\n').unwrap();
        let message = message.strip_prefix("// ").unwrap();
        let faults = faults(text);
        assert_eq!(faults.lines().next(), Some(message));
    }
}

#[test]
fn the_grammar_of_the_documentation_names_every_key() {
    let grammar = blocks(GRAMMAR, "ebnf");
    for key in [
        "domain", "range", "error", "monotone", "outside", "source", "internal",
    ] {
        assert!(grammar[0].contains(&format!("\n{key} ")), "{key}");
        assert!(grammar[0].contains(&format!("\"{key}\"")), "{key}");
    }
}

#[test]
fn a_header_is_found_past_attributes_comments_and_directives() {
    let text = format!(
        "//! T\n//! source   s\n#define_import_path a::b\n#import c::{{\n    d,\n    e\n}}\n\
         /// A struct: {{ not a header.\nstruct S {{\n    /// member\n    x: f32, // fn g(\n}}\n\
         /* fn no() {{ /* nested */ */ const A: f32 = 1.0;\n{}{}",
        module(&GOOD, "#ifdef X\n@must_use\n/* { */ @diagnostic(off, a.b)\nvirtual fn f(\n    // first\n    @x(1) h: f32,\n) -> f32 {\n    // } fn\n    return h;\n}\n#endif\n")
            .replace("//! Title.\n//! source   ours\n", ""),
        "/// Two.\n/// internal\nfn g(p: ptr<function, vec3<f32>>, t: array<f32, 4>) -> vec2<f32> { return 1; }"
    );
    let headers = read(&text);
    let names: Vec<&str> = headers.functions.iter().map(|f| f.name.as_str()).collect();
    assert_eq!(names, ["f", "g"]);
    assert_eq!(headers.functions[0].params.len(), 1);
    assert_eq!(headers.functions[1].params[0].ty, "ptr<function,vec3<f32>>");
    assert_eq!(headers.functions[1].params[1].ty, "array<f32,4>");
    assert_eq!(headers.functions[1].result.as_deref(), Some("vec2<f32>"));
}

#[test]
fn windows_line_breaks_are_read() {
    let text = module(&GOOD, FUNCTION).replace('\n', "\r\n");
    assert_eq!(read(&text), {
        let mut headers = read(&module(&GOOD, FUNCTION));
        headers.title = "Title.".into();
        headers
    });
}

#[test]
fn fault_module_header() {
    assert_eq!(
        faults("#define_import_path a\n"),
        "k.wgsl:1:1: the module has no header: it begins with `//!` lines, the first is its title\n\
         #define_import_path a\n^"
    );
    assert_eq!(
        faults("//! Title.\n"),
        "k.wgsl:1:1: the module's header has no line `source`\n//! Title.\n^"
    );
    assert_eq!(
        faults("//! source   ours\n//! source   x\n"),
        "k.wgsl:1:5: the first line of the module's header is its title\n//! source   ours\n    ^"
    );
    assert_eq!(
        faults("//! T\n//! source\n"),
        "k.wgsl:2:11: `source` is empty\n//! source\n          ^"
    );
}

#[test]
fn fault_no_header() {
    assert_eq!(
        faults(
            "//! T\n//! source   s\n/// Of the constant.\nconst A: f32 = 1.0;\nfn f() -> f32 { return A; }"
        ),
        "k.wgsl:5:4: function `f` has no header\nfn f() -> f32 { return A; }\n   ^"
    );
}

#[test]
fn fault_missing_lines() {
    let place = |message: &str| {
        format!(
            "k.wgsl:10:4: the header of `f` has no {message}\nfn f(h: f32) -> f32 {{ return h; }}\n   ^"
        )
    };
    let note = "\nnote: a helper that is not meant for importers has the line `internal`";
    for (index, message) in [
        (
            0,
            "domain of `h`: `domain NAME in [LO, HI] UNIT lin|log`".to_owned(),
        ),
        (1, "line `range [LO, HI] UNIT`".to_owned()),
        (2, "line `error VALUE abs|rel|ulp of REFERENCE`".to_owned()),
        (3, "line `source KEY ...`".to_owned()),
    ] {
        let expected = place(&message) + if index == 0 { "" } else { note };
        assert_eq!(fault(index, ""), expected);
    }
    let no_summary = module(&GOOD, FUNCTION).replace("/// One.\n///\n", "");
    assert_eq!(
        faults(&no_summary),
        "k.wgsl:4:1: the header of `f` does not begin with a sentence that says what it is\n\
         /// domain  h in [0, 1] m lin\n^"
    );
    for (ty, needed) in [
        ("f32", true),
        ("i32", true),
        ("vec2<u32>", true),
        ("vec3f", true),
        ("u32", false),
        ("bool", false),
        ("sampler", false),
        ("texture_2d<f32>", false),
        ("vector", false),
    ] {
        let function = format!("fn f(h: f32, other: {ty}) -> f32 {{ return h; }}");
        let refused = parse_headers("k.wgsl", &module(&GOOD, &function)).is_err();
        assert_eq!(refused, needed, "{ty}");
    }
}

#[test]
fn fault_in_a_domain() {
    for (line, column, message) in [
        (
            "domain",
            11,
            "the form is `domain NAME in [LO, HI] UNIT lin|log`",
        ),
        (
            "domain  h [0, 1] m lin",
            15,
            "the form is `domain NAME in [LO, HI] UNIT lin|log`",
        ),
        (
            "domain  k in [0, 1] m lin",
            13,
            "`k` is no parameter of `f`",
        ),
        (
            "domain  h in 0..1 m lin",
            18,
            "an interval `[LO, HI]` is expected: `domain NAME in [LO, HI] UNIT lin|log`",
        ),
        (
            "domain  h in [0 1] m lin",
            18,
            "an interval `[LO, HI]` is expected: `domain NAME in [LO, HI] UNIT lin|log`",
        ),
        (
            "domain  h in [0, 1] lin",
            25,
            "a unit is expected (`1` for none): `domain NAME in [LO, HI] UNIT lin|log`",
        ),
        (
            "domain  h in [0, 1] m",
            26,
            "`lin` or `log` is expected: `domain NAME in [LO, HI] UNIT lin|log`",
        ),
        (
            "domain  h in [0, 1] m lin, say",
            27,
            "`lin` or `log` is expected: `domain NAME in [LO, HI] UNIT lin|log`",
        ),
        (
            "domain  h in [0, 1] m lin of it",
            31,
            "more than `domain NAME in [LO, HI] UNIT lin|log`",
        ),
        (
            "domain  h in [0, 1] m log",
            27,
            "`log` needs a lower bound above 0, not 0",
        ),
        (
            "domain  h in [1, 0] m lin",
            18,
            "the interval from 1 to 0 is empty",
        ),
        (
            "domain  h in [1, 1) m lin",
            18,
            "the interval from 1 to 1 is empty",
        ),
        (
            "domain  h in [inf, inf] m lin",
            18,
            "the interval from inf to inf is empty",
        ),
        (
            "domain  h in [0, 1e39] m lin",
            22,
            "1e39 is no value of the parameter's type",
        ),
        (
            "domain  h in [0, .5] m lin",
            22,
            "`.5` is no bound: a number, `inf`, `pi` or a parameter's name is expected",
        ),
        (
            "domain  h in [0, NaN(] m lin",
            22,
            "`NaN(` is no bound: a number, `inf`, `pi` or a parameter's name is expected",
        ),
        (
            "domain  h in [-top, 1] m lin",
            20,
            "`top` is no parameter of `f`",
        ),
    ] {
        let got = fault(0, line);
        let note = match message {
            message if message.contains("is no parameter") => "\nnote: the parameters are h",
            _ => "",
        };
        assert_eq!(
            got,
            format!(
                "k.wgsl:6:{column}: {message}\n/// {line}\n{}^{note}",
                " ".repeat(column - 1)
            )
        );
    }
    let twice = module(
        &[
            GOOD[0],
            "domain  h in [0, 2] m lin",
            GOOD[1],
            GOOD[2],
            GOOD[3],
        ],
        FUNCTION,
    );
    assert!(faults(&twice).starts_with("k.wgsl:7:13: a second domain of `h`\n"));
    let whole = module(
        &["domain  n in [0.5, 2] 1 lin", GOOD[1], GOOD[2], GOOD[3]],
        "fn f(n: i32) -> f32 { return 1.0; }",
    );
    assert!(faults(&whole).starts_with("k.wgsl:6:19: 0.5 is no value of the parameter's type\n"));
}

#[test]
fn fault_in_the_other_lines() {
    for (index, line, column, message) in [
        (
            1,
            "range",
            10,
            "an interval `[LO, HI]` is expected: `range [LO, HI] UNIT`",
        ),
        (
            1,
            "range   [0, 1]",
            19,
            "a unit is expected (`1` for none): `range [LO, HI] UNIT`",
        ),
        (
            1,
            "range   [0, 1] m lin",
            22,
            "more than `range [LO, HI] UNIT`",
        ),
        (
            2,
            "error   small abs of reference::a::f",
            13,
            "a number from 0 is expected: `error VALUE abs|rel|ulp of REFERENCE`",
        ),
        (
            2,
            "error   -1 abs of reference::a::f",
            13,
            "a number from 0 is expected: `error VALUE abs|rel|ulp of REFERENCE`",
        ),
        (
            2,
            "error   1e999 abs of reference::a::f",
            13,
            "a number from 0 is expected: `error VALUE abs|rel|ulp of REFERENCE`",
        ),
        (
            2,
            "error   1e-6 of reference::a::f",
            18,
            "`abs`, `rel` or `ulp` is expected: `error VALUE abs|rel|ulp of REFERENCE`",
        ),
        (
            2,
            "error   1e-6 abs reference::a::f",
            22,
            "`of` is expected: `error VALUE abs|rel|ulp of REFERENCE`",
        ),
        (
            2,
            "error   1e-6 abs of f",
            25,
            "a path `reference::TOPIC::NAME` is expected, that of the function's f64 twin",
        ),
        (
            2,
            "error   1e-6 abs of reference::f",
            25,
            "a path `reference::TOPIC::NAME` is expected, that of the function's f64 twin",
        ),
        (
            2,
            "error   1e-6 abs of reference::a::f here",
            41,
            "more than `error VALUE abs|rel|ulp of REFERENCE`",
        ),
        (3, "source", 11, "`source` is empty"),
        (3, "monotone", 13, "the form is `monotone NAME`"),
        (3, "monotone h g", 16, "the form is `monotone NAME`"),
        (3, "outside finite", 5, "the form is `outside undefined`"),
        (
            3,
            "soruce  ours",
            5,
            "`soruce` is no key of a header: domain, range, error, monotone, outside, source, internal are",
        ),
        (
            1,
            "range   [0, 1] m\n/// range   [0, 2] m",
            5,
            "a second `range`",
        ),
        (
            2,
            "error   0 abs of reference::a::f\n/// error   0 abs of reference::a::f",
            5,
            "a second `error`",
        ),
        (3, "monotone h\n/// monotone h", 14, "a second `monotone h`"),
    ] {
        let got = fault(index, line);
        let row = 6 + index + line.matches('\n').count();
        let last = line.lines().last().unwrap();
        let shown = if line.contains('\n') {
            last.to_owned()
        } else {
            format!("/// {last}")
        };
        let note = if line.starts_with("soruce") {
            "\nnote: did you mean `source`?"
        } else {
            ""
        };
        assert_eq!(
            got,
            format!(
                "k.wgsl:{row}:{column}: {message}\n{shown}\n{}^{note}",
                " ".repeat(column - 1)
            )
        );
    }
    assert_eq!(
        fault(3, "monotone g"),
        "k.wgsl:9:14: `g` is no parameter of `f`\n/// monotone g\n             ^\nnote: the parameters are h"
    );
}

#[test]
fn structures_are_read_with_the_types_of_their_members() {
    let text = "//! T\n//! source   s\n\nstruct Empty {}\n/// Doc.\nstruct Layer {\n    /// The bottom [m], {not a brace}.\n    \
                @size(16) bottom: f32,\n    cell : vec3 < i32 > , // the last\n    both: array<vec2f, 2>\n}\n";
    let structs = parse_headers("k.wgsl", text).unwrap().structs;
    let names: Vec<&str> = structs.iter().map(|s| s.name.as_str()).collect();
    assert_eq!(names, ["Empty", "Layer"]);
    let members: Vec<String> = structs[1]
        .members
        .iter()
        .map(|m| format!("{}: {}", m.name, m.ty))
        .collect();
    assert_eq!(
        members,
        ["bottom: f32", "cell: vec3<i32>", "both: array<vec2f,2>"]
    );
    assert!(structs[0].members.is_empty());
}
