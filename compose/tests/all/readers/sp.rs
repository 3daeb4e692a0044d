//! The `.sp` reader: checklist rows 1 to 3 of the weather source, and every fault with its message.

use super::blocks;
use std::io;
use std::path::{Path, PathBuf};

use veduta_compose::sp::{
    InputPrimitive, LineOrigin, OutputPrimitive, Piece, SpFile, StageKind, Stitched, parse,
    parse_bytes,
};

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/appendix_a")
}

fn load(name: &str) -> SpFile {
    let bytes = std::fs::read(fixtures().join(name)).unwrap();
    parse_bytes(name, &bytes).unwrap_or_else(|e| panic!("{e}"))
}

fn stitch(program: &SpFile, stage: StageKind) -> Stitched {
    program
        .stitch(stage, &mut |path| {
            std::fs::read_to_string(fixtures().join(path))
        })
        .unwrap_or_else(|e| panic!("{e}"))
}

fn no_files(path: &str) -> io::Result<String> {
    panic!("the test has no file {path}")
}

/// The whole message of a text that must be refused.
fn fault(text: &str) -> String {
    match parse("a.sp", text) {
        Ok(program) => panic!("accepted: {program:?}"),
        Err(faults) => faults.to_string(),
    }
}

/// A program with one fragment stage of the given children.
fn fragment(children: &str) -> String {
    format!("#PROGRAM{{ P }}#\n#FRAGMENT{{\n{children}\n}}#\n")
}

/// The fragment stage of a program that needs no file.
fn stitched(text: &str) -> String {
    let program = parse("a.sp", text).unwrap_or_else(|e| panic!("{e}"));
    program
        .stitch(StageKind::Fragment, &mut no_files)
        .unwrap_or_else(|e| panic!("{e}"))
        .text
}

fn validate(name: &str, text: &str) -> naga::Module {
    let module = naga::front::wgsl::parse_str(text)
        .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(text)));
    naga::valid::Validator::new(
        naga::valid::ValidationFlags::all(),
        naga::valid::Capabilities::default(),
    )
    .validate(&module)
    .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(text)));
    module
}

#[test]
fn row_w01_appendix_files_parse() {
    let speeds = load("speeds.sp");
    assert_eq!(speeds.name, "Speeds");
    assert_eq!(speeds.stages.len(), 2);
    assert!(speeds.snippets.is_empty() && speeds.geometry.is_none());
    let kinds = |program: &SpFile, stage| -> Vec<&str> {
        let pieces = &program.stage(stage).unwrap().pieces;
        pieces
            .iter()
            .map(|piece| match piece {
                Piece::Code { .. } => "CODE",
                Piece::Src { .. } => "SRC",
                Piece::Use { .. } => "USE",
            })
            .collect()
    };
    assert_eq!(kinds(&speeds, StageKind::Vertex), ["SRC"]);
    assert_eq!(kinds(&speeds, StageKind::Fragment), ["CODE"]);

    let terrain = load("terrain.sp");
    assert_eq!(terrain.name, "Terrain");
    assert_eq!(kinds(&terrain, StageKind::Vertex), ["USE", "CODE"]);
    assert_eq!(
        kinds(&terrain, StageKind::Fragment),
        ["USE", "SRC", "SRC", "CODE", "SRC", "CODE"]
    );
    assert_eq!(terrain.sources(), ["cursor.wgsl", "pcf.wgsl", "fog.wgsl"]);
    for (program, stage, entry) in [
        (&speeds, StageKind::Vertex, "vertex"),
        (&speeds, StageKind::Fragment, "fragment"),
        (&terrain, StageKind::Vertex, "vertex"),
        (&terrain, StageKind::Fragment, "fragment"),
    ] {
        let text = stitch(program, stage).text;
        let module = validate(&format!("{} {stage}", program.name), &text);
        let entries: Vec<&str> = module
            .entry_points
            .iter()
            .map(|entry| entry.name.as_str())
            .collect();
        assert_eq!(entries, [entry]);
    }
}

#[test]
fn row_w01_wrong_case_is_not_recognised() {
    for tag in [
        "PROGRAM", "DEFINE", "VERTEX", "FRAGMENT", "COMPUTE", "GEOMETRY",
    ] {
        let lower = tag.to_lowercase();
        let message = fault(&format!("#{lower}{{ x }}#"));
        assert_eq!(
            message,
            format!(
                "a.sp:1:1: unknown tag `#{lower}{{`\n#{lower}{{ x }}#\n^\n\
                 note: tags are case-sensitive: did you mean `#{tag}{{`?"
            )
        );
    }
}

#[test]
fn row_w01_text_outside_tags_is_ignored() {
    let plain = "#PROGRAM{P}##FRAGMENT{#CODE{x}##CODE{y}#}#";
    let noisy = "// a comment { with } braces\n/* #if 0 */ #version 130\n#PROGRAM { P }# <b>&amp;</b>\n\
                 # FRAGMENT is next, a #{SIZE}#{SIZE} here is none of ours, nor #define X {\n\
                 #FRAGMENT\t{ junk } # { #CODE{x}# more, 100 % junk\n é }} #CODE \t {y}# }# the end #";
    let (a, b) = (
        parse("a.sp", plain).unwrap(),
        parse("b.sp", noisy).unwrap_or_else(|e| panic!("{e}")),
    );
    let text = |p: &SpFile| p.stitch(StageKind::Fragment, &mut no_files).unwrap().text;
    assert_eq!(text(&a), "x\ny");
    assert_eq!(text(&b), "x\ny");
    assert_eq!((a.name.as_str(), b.name.as_str()), ("P", "P"));
}

#[test]
fn row_w01_stage_text_is_the_ordered_pieces() {
    let read = |name: &str| std::fs::read_to_string(fixtures().join(name)).unwrap();
    let terrain = load("terrain.sp");
    let file = read("terrain.sp");
    let fragment = &file[file.find("#FRAGMENT").unwrap()..];
    let code: Vec<&str> = fragment
        .split("#CODE {")
        .skip(1)
        .map(|rest| &rest[..rest.find("}#").unwrap()])
        .collect();
    let common = &file[file.find("#COMMON {").unwrap() + "#COMMON {".len()..];
    let common = &common[..common.find("}#").unwrap()];
    let expected = [
        common,
        &read("cursor.wgsl"),
        &read("pcf.wgsl"),
        code[0],
        &read("fog.wgsl"),
        code[1],
    ]
    .join("\n");
    assert_eq!(stitch(&terrain, StageKind::Fragment).text, expected);
    let fog = expected.find("fn fog(").unwrap();
    assert!(expected.find("var<private> ground_position").unwrap() < fog);
    assert!(fog < expected.find("fn fragment(").unwrap());

    let speeds = load("speeds.sp");
    assert_eq!(
        stitch(&speeds, StageKind::Vertex).text,
        read("compute_vertex.wgsl")
    );
}

#[test]
fn row_w02_a_snippet_of_two_stages_is_in_both() {
    let terrain = load("terrain.sp");
    let common = &terrain.snippets[0];
    assert_eq!(common.name, "COMMON");
    for stage in [StageKind::Vertex, StageKind::Fragment] {
        assert!(stitch(&terrain, stage).text.starts_with(&common.text));
    }
    assert!(common.text.contains("fn terrain_at"));
}

#[test]
fn row_w02_a_snippet_may_be_defined_after_its_use() {
    let text = format!(
        "{}#DEFINE{{ #A{{ one }}# }}# text #DEFINE{{ #B-2{{two}}# }}#",
        fragment("#USE{A}##CODE{,}##USE{ B-2 }##USE{A}#")
    );
    assert_eq!(stitched(&text), " one \n,\ntwo\n one ");
}

#[test]
fn row_w02_a_missing_snippet_is_reported() {
    assert_eq!(
        fault("#PROGRAM{P}#\n#DEFINE{#COMMON{x}#}#\n#VERTEX{ #USE{ COMON }# }#"),
        "a.sp:3:16: no snippet `COMON` in DEFINE\n#VERTEX{ #USE{ COMON }# }#\n               ^\n\
         note: did you mean `COMMON`?"
    );
    assert_eq!(
        fault(&fragment("#USE{X}#")),
        "a.sp:3:6: no snippet `X` in DEFINE\n#USE{X}#\n     ^\nnote: the file defines no snippet"
    );
    let far = fault(&format!(
        "{}#DEFINE{{#A{{}}##B{{}}#}}#",
        fragment("#USE{long}#")
    ));
    assert!(far.ends_with("note: the file defines A, B"), "{far}");
}

#[test]
fn row_w02_a_missing_file_is_reported() {
    let program = parse("dir/a.sp", &fragment("  #SRC{ sub/../fog.wgsl }#")).unwrap();
    assert_eq!(program.sources(), ["fog.wgsl"]);
    let stitch = |error: io::ErrorKind| {
        program
            .stitch(StageKind::Fragment, &mut |path| {
                assert_eq!(path, "fog.wgsl");
                Err(error.into())
            })
            .unwrap_err()
            .to_string()
    };
    let place = "\n  #SRC{ sub/../fog.wgsl }#\n        ^";
    for (error, message) in [
        (io::ErrorKind::NotFound, "there is no file `dir/fog.wgsl`"),
        (
            io::ErrorKind::InvalidData,
            "file `dir/fog.wgsl` is not UTF-8 text",
        ),
        (
            io::ErrorKind::IsADirectory,
            "`dir/fog.wgsl` is a folder; SRC inserts one file",
        ),
        (
            io::ErrorKind::PermissionDenied,
            "file `dir/fog.wgsl` cannot be read: permission denied",
        ),
    ] {
        assert_eq!(stitch(error), format!("dir/a.sp:3:9: {message}{place}"));
    }
}

#[test]
fn row_w02_files_on_disk_that_cannot_be_inserted_are_told_apart() {
    let folder = std::env::temp_dir().join(format!("veduta-sp-{}", std::process::id()));
    std::fs::create_dir_all(folder.join("sub")).unwrap();
    std::fs::write(folder.join("latin.wgsl"), b"// caf\xe9").unwrap();
    let message = |path: &str| {
        let program = parse("a.sp", &fragment(&format!("#SRC{{{path}}}#"))).unwrap();
        let faults = program
            .stitch(StageKind::Fragment, &mut |path| {
                std::fs::read_to_string(folder.join(path))
            })
            .unwrap_err();
        faults.0[0].message.clone()
    };
    let messages = [message("none.wgsl"), message("latin.wgsl"), message("sub")];
    std::fs::remove_dir_all(&folder).unwrap();
    assert_eq!(messages[0], "there is no file `none.wgsl`");
    assert_eq!(messages[1], "file `latin.wgsl` is not UTF-8 text");
    assert!(
        messages[2].starts_with("`sub` is a folder") || cfg!(windows),
        "{}",
        messages[2]
    );
}

#[test]
fn row_w03_geometry_params() {
    let geometry = |params: &str| {
        format!("#PROGRAM{{P}}#\n#GEOMETRY{{ #PARAMS{{ {params} }}# #CODE{{x}}# }}#")
    };
    for (name, input) in [
        ("POINTS", InputPrimitive::Points),
        ("LINES", InputPrimitive::Lines),
        ("LINES_ADJACENCY", InputPrimitive::LinesAdjacency),
        ("TRIANGLES", InputPrimitive::Triangles),
        ("TRIANGLES_ADJACENCY", InputPrimitive::TrianglesAdjacency),
    ] {
        let program = parse("a.sp", &geometry(&format!("#IN{{ {name} }}#"))).unwrap();
        assert_eq!(program.geometry.unwrap().input, Some(input));
    }
    for (name, output) in [
        ("POINTS", OutputPrimitive::Points),
        ("LINE_STRIP", OutputPrimitive::LineStrip),
        ("TRIANGLE_STRIP", OutputPrimitive::TriangleStrip),
    ] {
        let program = parse("a.sp", &geometry(&format!("#OUT{{{name}}}#"))).unwrap();
        let geometry = program.geometry.unwrap();
        assert_eq!((geometry.output, geometry.input), (Some(output), None));
    }
    let all = geometry("#IN{LINES}# and #OUT{POINTS}##CNT{ 12 }#");
    let read = parse("a.sp", &all).unwrap().geometry.unwrap();
    assert_eq!(read.max_vertices, Some(12));
    assert_eq!(read.pieces.len(), 1);

    let line = "#GEOMETRY{ #PARAMS{ #IN{ TRIANGLE }# }# #CODE{x}# }#";
    assert_eq!(
        fault(&geometry("#IN{ TRIANGLE }#")),
        format!(
            "a.sp:2:26: `TRIANGLE` is no value of IN: POINTS, LINES, LINES_ADJACENCY, TRIANGLES, \
             TRIANGLES_ADJACENCY is expected\n{line}\n{}^\nnote: did you mean `TRIANGLES`?",
            " ".repeat(25)
        )
    );
    let message = |params: &str| {
        let faults = parse("a.sp", &geometry(params)).unwrap_err();
        assert_eq!(faults.0.len(), 1, "{faults}");
        faults.0[0].message.clone()
    };
    assert_eq!(
        message("#OUT{LINES}#"),
        "`LINES` is no value of OUT: POINTS, LINE_STRIP, TRIANGLE_STRIP is expected"
    );
    for bad in ["0", "-1", "1.5", "many", "4294967296", "0x10"] {
        assert_eq!(
            message(&format!("#CNT{{{bad}}}#")),
            format!("`{bad}` is no value of CNT: a whole number from 1 is expected")
        );
    }
    assert_eq!(message("#CNT{1}##CNT{2}#"), "a second `CNT` in PARAMS");
}

#[test]
fn row_w03_params_are_read_only_inside_geometry() {
    let message = |text: &str| parse("a.sp", text).unwrap_err().0[0].message.clone();
    assert_eq!(
        message(&fragment("#PARAMS{ #CNT{1}# }##CODE{x}#")),
        "`#PARAMS{` inside `FRAGMENT`: it belongs directly inside GEOMETRY"
    );
    for tag in ["IN", "OUT", "CNT"] {
        assert_eq!(
            message(&fragment(&format!("#{tag}{{POINTS}}##CODE{{x}}#"))),
            format!("`#{tag}{{` inside `FRAGMENT`: it belongs inside PARAMS of GEOMETRY")
        );
        assert_eq!(
            message(&format!(
                "#PROGRAM{{P}}##GEOMETRY{{#{tag}{{POINTS}}##CODE{{x}}#}}#"
            )),
            format!("`#{tag}{{` inside `GEOMETRY`: it belongs inside PARAMS of GEOMETRY")
        );
    }
    assert_eq!(
        message("#PROGRAM{P}##GEOMETRY{#PARAMS{#CODE{x}#}#}#"),
        "`#CODE{` inside `PARAMS`: it belongs directly inside VERTEX, FRAGMENT or COMPUTE"
    );
}

#[test]
fn row_w03_a_geometry_stage_is_refused_when_composing() {
    let text = "#PROGRAM{P}#\n  #GEOMETRY{ #CODE{x}# }#\n#FRAGMENT{#CODE{y}#}#";
    let program = parse("a.sp", text).unwrap();
    assert_eq!(
        program
            .stitch(StageKind::Fragment, &mut no_files)
            .unwrap_err()
            .to_string(),
        "a.sp:2:3: WGSL has no geometry stage, so a program with `GEOMETRY` cannot be composed\n  \
         #GEOMETRY{ #CODE{x}# }#\n  ^\n\
         note: make the primitives in a COMPUTE stage or by instancing in the VERTEX stage"
    );
}

#[test]
fn a_compute_stage_is_a_stage() {
    let text = "#PROGRAM{Fill}##COMPUTE{#CODE{@compute @workgroup_size(#{TILE}) fn fill() {}}#}#";
    let program = parse("a.sp", text).unwrap();
    let compute = program.stitch(StageKind::Compute, &mut no_files).unwrap();
    assert_eq!(
        compute.text,
        "@compute @workgroup_size(#{TILE}) fn fill() {}"
    );
    let message = program
        .stitch(StageKind::Vertex, &mut no_files)
        .unwrap_err();
    assert_eq!(
        message.to_string(),
        "a.sp: program `Fill` has no VERTEX stage"
    );
}

#[test]
fn a_size_substitution_neither_opens_nor_closes_a_tag() {
    for code in [
        "#{A}#{B}",
        "array<f32, #{A}>",
        "fn f() {}#{A}",
        "{#{A}}",
        "x#{A}#{B}#{C_9}y",
        "if (1) {}#{X}{}",
        "#{CODE}#{IN}",
    ] {
        assert_eq!(stitched(&fragment(&format!("#CODE{{{code}}}#"))), code);
        let text = format!("{}#DEFINE{{#S{{{code}}}#}}#", fragment("#USE{S}##CODE{.}#"));
        assert_eq!(stitched(&text), format!("{code}\n."));
    }
    // What is no substitution is no exception.
    assert_eq!(stitched(&fragment("#CODE{#{}#")), "#{");
    assert_eq!(stitched(&fragment("#CODE{fn f() {} }#{A B}")), "fn f() {} ");
}

#[test]
fn raw_text_is_taken_verbatim() {
    let code = "\n#import veduta::a::{b}\n#ifdef WATER\n\tlet x = 1; // # } #\n#endif {} # }\n";
    assert_eq!(stitched(&fragment(&format!("#CODE{{{code}}}#"))), code);
    assert_eq!(stitched(&fragment("#CODE{x}#\n#CODE{}#")), "x\n");
}

#[test]
fn line_breaks_and_a_byte_order_mark_do_not_matter() {
    let text = "\u{feff}#PROGRAM{P}#\r\n#FRAGMENT{\r\n#CODE{a\r\nb\rc}#\r\n#SRC{s}#}#";
    let program = parse("a.sp", text).unwrap();
    let out = program
        .stitch(StageKind::Fragment, &mut |_| Ok("\u{feff}d\r\ne".into()))
        .unwrap();
    assert_eq!(out.text, "a\nb\nc\nd\ne");
    assert_eq!(out.locate(1, 1), ("a.sp", 3, 7, "#CODE{a"));
    assert_eq!(out.locate(3, 1), ("a.sp", 5, 1, "c}#"));
    assert_eq!(out.locate(4, 1), ("s", 1, 1, "d"));
}

#[test]
fn each_line_is_led_back_to_its_file() {
    let terrain = load("terrain.sp");
    let out = stitch(&terrain, StageKind::Fragment);
    let texts: Vec<(String, String)> = ["terrain.sp", "cursor.wgsl", "pcf.wgsl", "fog.wgsl"]
        .iter()
        .map(|name| {
            let text = std::fs::read_to_string(fixtures().join(name)).unwrap();
            ((*name).to_owned(), text)
        })
        .collect();
    assert_eq!(out.files, texts);
    assert_eq!(out.lines.len(), out.text.split('\n').count());
    for (number, line) in (1..).zip(out.text.split('\n')) {
        for at in [0, line.chars().count()] {
            let (file, row, column, source_line) = out.locate(number, at as u32 + 1);
            let original = &texts.iter().find(|(name, _)| name == file).unwrap().1;
            assert_eq!(
                original.lines().nth(row as usize - 1).unwrap_or(""),
                source_line
            );
            let from: String = source_line.chars().skip(column as usize - 1).collect();
            let rest: String = line.chars().skip(at).collect();
            assert!(from.starts_with(&rest), "{file}:{row}:{column} {rest:?}");
        }
    }
    let main = out.text.find("fn fragment").unwrap();
    let diag = out.diag_at(main, "here");
    assert_eq!((diag.file.as_str(), diag.column), ("terrain.sp", 1));
    assert!(diag.source_line.starts_with("fn fragment(@location(0)"));

    let inline = parse("a.sp", &fragment("é #CODE{ab}#")).unwrap();
    let out = inline.stitch(StageKind::Fragment, &mut no_files).unwrap();
    assert_eq!(
        out.lines,
        [LineOrigin {
            file: 0,
            line: 3,
            column_shift: 8
        }]
    );
    assert_eq!(out.locate(1, 2), ("a.sp", 3, 10, "é #CODE{ab}#"));
    assert_eq!(out.locate(9, 1), ("a.sp", 3, 9, "é #CODE{ab}#"));
    assert_eq!(
        out.diag(1, 2, "m").to_string(),
        "a.sp:3:10: m\né #CODE{ab}#\n         ^"
    );
}

#[test]
fn one_file_inserted_twice_is_read_once() {
    let program = parse("a.sp", &fragment("#SRC{x}##SRC{./x}#")).unwrap();
    let mut reads = 0;
    let out = program
        .stitch(StageKind::Fragment, &mut |_| {
            reads += 1;
            Ok("one\n".into())
        })
        .unwrap();
    assert_eq!(
        (out.text.as_str(), reads, out.files.len()),
        ("one\n\none\n", 1, 2)
    );
}

#[test]
fn fault_unknown_tag() {
    assert_eq!(
        fault("#PROGRAM{P}#\n  #FRAGMNT{ #CODE{x}# }#"),
        "a.sp:2:3: unknown tag `#FRAGMNT{`\n  #FRAGMNT{ #CODE{x}# }#\n  ^\n\
         note: did you mean `#FRAGMENT{`?"
    );
    assert_eq!(
        fault(&fragment("#code{x}#")),
        "a.sp:3:1: unknown tag `#code{`\n#code{x}#\n^\n\
         note: tags are case-sensitive: did you mean `#CODE{`?"
    );
    assert_eq!(
        fault("#PENGUIN{ x }#"),
        "a.sp:1:1: unknown tag `#PENGUIN{`\n#PENGUIN{ x }#\n^"
    );
}

#[test]
fn fault_duplicate_program() {
    assert_eq!(
        fault("#PROGRAM{P}#\n#PROGRAM{Q}#\n#VERTEX{#CODE{x}#}#"),
        "a.sp:2:1: a second `PROGRAM` in one file\n#PROGRAM{Q}#\n^\nnote: the first is at a.sp:1:1"
    );
}

#[test]
fn fault_duplicate_stage() {
    for tag in ["VERTEX", "FRAGMENT", "COMPUTE", "GEOMETRY"] {
        assert_eq!(
            fault(&format!(
                "#PROGRAM{{P}}#\n#{tag}{{#CODE{{x}}#}}#\n #{tag}{{#CODE{{y}}#}}#"
            )),
            format!(
                "a.sp:3:2: a second `{tag}` in one program\n #{tag}{{#CODE{{y}}#}}#\n ^\n\
                 note: the first is at a.sp:2:1"
            )
        );
    }
}

#[test]
fn fault_duplicate_snippet() {
    let text = format!(
        "{}#DEFINE{{#A{{x}}#}}#\n#DEFINE{{ #A{{y}}# }}#",
        fragment("#USE{A}#")
    );
    assert_eq!(
        fault(&text),
        "a.sp:6:10: a second snippet `A`\n#DEFINE{ #A{y}# }#\n         ^\nnote: the first is at a.sp:5:9"
    );
}

#[test]
fn fault_unclosed_tag() {
    assert_eq!(
        fault("#PROGRAM{P}#\n#VERTEX{\n  #CODE{ x\n"),
        "a.sp:3:3: `#CODE{` is never closed: `}#` is missing\n  #CODE{ x\n  ^"
    );
    assert_eq!(
        fault("#PROGRAM{P}#\n#VERTEX{\n  #CODE{ x }#\n"),
        "a.sp:2:1: `#VERTEX{` is never closed: `}#` is missing\n#VERTEX{\n^"
    );
    assert_eq!(
        fault("#DEFINE{ #A{x}#"),
        "a.sp:1:1: `#DEFINE{` is never closed: `}#` is missing\n#DEFINE{ #A{x}#\n^"
    );
    assert_eq!(
        fault("#GEOMETRY{ #PARAMS{ #CNT{3}#"),
        "a.sp:1:12: `#PARAMS{` is never closed: `}#` is missing\n#GEOMETRY{ #PARAMS{ #CNT{3}#\n           ^"
    );
    assert_eq!(
        fault("#PROGRAM{ P\n#VERTEX{ #CODE{x}# }#"),
        "a.sp:1:1: `#PROGRAM{` is not closed: its value is one line\n#PROGRAM{ P\n^"
    );
    assert_eq!(
        fault(&fragment("#USE{ A #CODE{x}#")),
        "a.sp:3:1: `#USE{` is not closed: its value is one line\n#USE{ A #CODE{x}#\n^"
    );
}

#[test]
fn fault_stray_closing_brace() {
    assert_eq!(
        fault(&fragment("#CODE{ // ends with }#\nlet x = 1;\n}#")),
        "a.sp:6:1: `}#` closes nothing\n}#\n^\n\
         note: the first `}#` in raw text ends it, also in a comment"
    );
}

#[test]
fn fault_empty_stage_and_program() {
    assert_eq!(
        fault("#PROGRAM{P}#\n#VERTEX{ let x = 1; }#"),
        "a.sp:2:1: the vertex stage is empty: it has no CODE, SRC or USE (text outside them is ignored)\n\
         #VERTEX{ let x = 1; }#\n^"
    );
    assert_eq!(
        fault("#GEOMETRY{}#"),
        "a.sp:1:1: the geometry stage is empty: it has no CODE, SRC or USE (text outside them is ignored)\n\
         #GEOMETRY{}#\n^"
    );
    assert_eq!(
        fault("\n#PROGRAM{P}# nothing else"),
        "a.sp:2:1: the program is empty: it has no VERTEX, FRAGMENT or COMPUTE\n\
         #PROGRAM{P}# nothing else\n^"
    );
    assert_eq!(
        fault("#PROGRAM{  }#\n#VERTEX{#CODE{x}#}#"),
        "a.sp:1:1: `PROGRAM` is empty\n#PROGRAM{  }#\n^"
    );
    let blank = parse("a.sp", &fragment("#CODE{ \n }##SRC{s}#")).unwrap();
    assert_eq!(
        blank
            .stitch(StageKind::Fragment, &mut |_| Ok("\t".into()))
            .unwrap_err()
            .to_string(),
        "a.sp:2:1: the fragment stage is empty\n#FRAGMENT{\n^"
    );
}

#[test]
fn fault_missing_program() {
    assert_eq!(
        fault("#VERTEX{#CODE{x}#}#"),
        "a.sp:1:1: the file has no `#PROGRAM{ name }#`\n#VERTEX{#CODE{x}#}#\n^"
    );
    assert!(fault("").starts_with("a.sp:1:1: the file has no `#PROGRAM{ name }#`"));
}

#[test]
fn fault_nested_tags() {
    assert_eq!(
        fault(&fragment("#CODE{ a #USE{X}# b }#")),
        "a.sp:3:10: `#USE{` inside `CODE`: its text is raw, tags cannot be nested in it\n\
         #CODE{ a #USE{X}# b }#\n         ^\nnote: `#CODE{` was opened at line 3; is its `}#` missing?\n\
         a.sp:3:15: no snippet `X` in DEFINE\n#CODE{ a #USE{X}# b }#\n              ^\n\
         note: the file defines no snippet\n\
         a.sp:4:1: `}#` closes nothing\n}#\n^\n\
         note: the first `}#` in raw text ends it, also in a comment"
    );
    assert_eq!(
        fault("#PROGRAM{P}#\n#VERTEX{\n#CODE{ x\n}#\n#FRAGMENT{\n#CODE{y}# }#"),
        "a.sp:5:1: `#FRAGMENT{` inside `VERTEX`: it belongs at the top level\n#FRAGMENT{\n^\n\
         note: `#VERTEX{` was opened at line 2; is its `}#` missing?"
    );
    assert_eq!(
        fault("#DEFINE{ #CODE{x}# }#"),
        "a.sp:1:10: `#CODE{` inside `DEFINE`: the name of a tag cannot name a snippet\n\
         #DEFINE{ #CODE{x}# }#\n         ^\n\
         note: `#DEFINE{` was opened at line 1; is its `}#` missing?"
    );
    let snippet = fault("#DEFINE{ #A{ #SRC{x}# }# }#");
    assert!(
        snippet.starts_with("a.sp:1:14: `#SRC{` inside `A`: its text is raw"),
        "{snippet}"
    );
    let define = fault(&fragment("#DEFINE{#A{x}#}##CODE{x}#"));
    assert!(
        define.starts_with("a.sp:3:1: `#DEFINE{` inside `FRAGMENT`: it belongs at the top level"),
        "{define}"
    );
}

#[test]
fn fault_stage_child_at_the_top_level() {
    for tag in ["CODE", "SRC", "USE"] {
        assert_eq!(
            fault(&format!("#PROGRAM{{P}}#\n#{tag}{{ x }}#")),
            format!(
                "a.sp:2:1: `#{tag}{{` at the top level: it belongs directly inside VERTEX, FRAGMENT or \
                 COMPUTE\n#{tag}{{ x }}#\n^"
            )
        );
    }
}

#[test]
fn fault_not_utf8() {
    assert_eq!(
        parse_bytes("a.sp", b"#PROGRAM{P}#\n caf\xe9 #VERTEX{")
            .unwrap_err()
            .to_string(),
        "a.sp:2:5: the file is not UTF-8 text: byte 0xe9\n caf\n    ^"
    );
}

#[test]
fn fault_source_path() {
    let message = |path: &str| {
        let faults = parse("a.sp", &fragment(&format!(" #SRC{{ {path} }}#"))).unwrap_err();
        assert_eq!(faults.0.len(), 1);
        assert_eq!(faults.0[0].line, 3);
        let column = faults.0[0].column as usize;
        assert_eq!(column, 8 + path.find('\0').unwrap_or(0));
        faults.0[0].message.clone()
    };
    for path in ["/etc/a.wgsl", "C:/a.wgsl", "c:a.wgsl"] {
        assert_eq!(
            message(path),
            format!("`{path}` is absolute: a SRC path is relative to the folder of the .sp file")
        );
    }
    for path in ["../a.wgsl", "x/../../a.wgsl", "./.././a.wgsl"] {
        assert_eq!(
            message(path),
            format!("`{path}` leaves the folder of the .sp file")
        );
    }
    for path in ["sub/", ".", "sub/..", "a/."] {
        assert_eq!(
            message(path),
            format!("`{path}` is a folder; SRC inserts one file")
        );
    }
    assert_eq!(
        message("sub\\a.wgsl"),
        "`sub\\a.wgsl`: folders in a SRC path are separated by `/`"
    );
    assert_eq!(
        message("a\u{0}b"),
        "control character '\\0' in the value of `SRC`"
    );
    assert_eq!(
        fault(&fragment("#SRC{ }#")),
        "a.sp:3:1: `SRC` is empty\n#SRC{ }#\n^"
    );
}

#[test]
fn fault_tags_in_an_inserted_file() {
    let program = parse("d/a.sp", &fragment("#SRC{b.wgsl}#")).unwrap();
    assert_eq!(
        program
            .stitch(StageKind::Fragment, &mut |_| Ok(
                "let x = 1;\n #CODE{ }#".into()
            ))
            .unwrap_err()
            .to_string(),
        "d/b.wgsl:2:2: `#CODE{` in an inserted file: tags are read in the .sp file only\n #CODE{ }#\n ^\n\
         note: inserted by SRC at d/a.sp:3:6"
    );
}

#[test]
fn several_faults_are_reported_together_in_the_order_of_the_file() {
    let faults = parse(
        "a.sp",
        "#PROGRAM{P}#\n#VERTEX{ #USE{A}# #SRC{/x}# }#\n#fragment{ #CODE{x}# }#\n#IN{POINTS}#",
    )
    .unwrap_err();
    let lines: Vec<(u32, u32)> = faults.iter().map(|d| (d.line, d.column)).collect();
    assert_eq!(lines, [(2, 15), (2, 24), (3, 1), (4, 1)]);
}

#[test]
fn a_hostile_file_is_given_up_after_a_hundred_faults() {
    let faults = parse("a.sp", &"#X{}#".repeat(100_000)).unwrap_err();
    assert_eq!(faults.0.len(), 100);
}

#[test]
fn the_example_of_the_documentation_is_read() {
    let document = include_str!("../../../../docs/sp-format.md");
    let examples = blocks(document, "sp");
    assert_eq!(examples.len(), 1);
    let program = parse("a.sp", examples[0]).unwrap_or_else(|e| panic!("{e}"));
    let compute = program
        .stitch(StageKind::Compute, &mut |path| {
            assert_eq!(path, "noise/octaves.wgsl");
            Ok("fn octaves(x: vec2f) -> f32 { return x.x; }".into())
        })
        .unwrap();
    validate("Fill", &compute.text.replace("#{TILE}", "8"));
    for tag in [
        "PROGRAM", "DEFINE", "VERTEX", "FRAGMENT", "COMPUTE", "GEOMETRY", "CODE", "SRC", "USE",
        "PARAMS",
    ] {
        assert!(document.contains(&format!("`{tag}`")), "{tag}");
        assert!(document.contains(&format!("\"#{tag}\"")), "{tag}");
    }
}
