//! The `.sp` format: one file holds one whole shader program, made of stages that are stitched from pieces.
//!
//! The format is described in `docs/sp-format.md`. [`parse`] reads a file without touching anything else;
//! [`SpFile::stitch`] builds the text of one stage, together with a map that leads each line of it back to the file and
//! line it came from.

use std::collections::BTreeMap;
use std::fmt;
use std::io;

pub use crate::diag::Place;
use crate::diag::{Diag, Diags, line_at, line_starts, without_mark};

/// After this many faults a file is given up.
const MOST_FAULTS: usize = 100;

/// The stages that WGSL has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum StageKind {
    /// The tag `VERTEX`.
    Vertex,
    /// The tag `FRAGMENT`.
    Fragment,
    /// The tag `COMPUTE`, an addition to the original format.
    Compute,
}

impl StageKind {
    /// The name of the stage's tag.
    pub fn tag(self) -> &'static str {
        match self {
            Self::Vertex => "VERTEX",
            Self::Fragment => "FRAGMENT",
            Self::Compute => "COMPUTE",
        }
    }
}

impl fmt::Display for StageKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Vertex => "vertex",
            Self::Fragment => "fragment",
            Self::Compute => "compute",
        })
    }
}

/// One child of a stage.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Piece {
    /// `CODE`: shader text, taken verbatim.
    Code {
        /// The text between the braces.
        text: String,
        /// Where the text begins (behind the opening brace).
        place: Place,
    },
    /// `SRC`: the text of another file.
    Src {
        /// The file's path relative to the folder of the `.sp` file, with `/` and without `.` and `..`.
        path: String,
        /// Where the path stands.
        place: Place,
    },
    /// `USE`: the text of a snippet.
    Use {
        /// Index of the snippet in [`SpFile::snippets`].
        snippet: usize,
        /// Where the name stands.
        place: Place,
    },
}

/// One stage of a program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SpStage {
    /// Which stage.
    pub kind: StageKind,
    /// Its children in the order of the file; at least one.
    pub pieces: Vec<Piece>,
    /// Where the stage's tag stands.
    pub place: Place,
}

/// A named text of `DEFINE`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Snippet {
    /// The name, which is the tag's name.
    pub name: String,
    /// The text between the braces.
    pub text: String,
    /// Where the tag stands.
    pub place: Place,
    /// Where the text begins (behind the opening brace).
    pub text_place: Place,
}

/// What a geometry stage takes (`IN`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum InputPrimitive {
    Points,
    Lines,
    LinesAdjacency,
    Triangles,
    TrianglesAdjacency,
}

/// What a geometry stage makes (`OUT`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum OutputPrimitive {
    Points,
    LineStrip,
    TriangleStrip,
}

const INPUTS: [(&str, InputPrimitive); 5] = [
    ("POINTS", InputPrimitive::Points),
    ("LINES", InputPrimitive::Lines),
    ("LINES_ADJACENCY", InputPrimitive::LinesAdjacency),
    ("TRIANGLES", InputPrimitive::Triangles),
    ("TRIANGLES_ADJACENCY", InputPrimitive::TrianglesAdjacency),
];

const OUTPUTS: [(&str, OutputPrimitive); 3] = [
    ("POINTS", OutputPrimitive::Points),
    ("LINE_STRIP", OutputPrimitive::LineStrip),
    ("TRIANGLE_STRIP", OutputPrimitive::TriangleStrip),
];

/// A geometry stage: it is read and checked, but no stage of a file that has one can be stitched.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Geometry {
    /// Its children in the order of the file, `PARAMS` left out; at least one.
    pub pieces: Vec<Piece>,
    /// `IN`, if given.
    pub input: Option<InputPrimitive>,
    /// `OUT`, if given.
    pub output: Option<OutputPrimitive>,
    /// `CNT`, the largest number of vertices that one invocation may emit, if given; at least 1.
    pub max_vertices: Option<u32>,
    /// Where the stage's tag stands.
    pub place: Place,
}

/// A `.sp` file that was read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SpFile {
    /// The program's name (`PROGRAM`).
    pub name: String,
    /// The stages in the order of the file, each kind at most once; at least one, unless there is a geometry stage.
    pub stages: Vec<SpStage>,
    /// The geometry stage, if there is one.
    pub geometry: Option<Geometry>,
    /// All snippets of the file in its order; the names are distinct.
    pub snippets: Vec<Snippet>,
    /// The file's name as it was given to [`parse`].
    file: String,
    /// The whole text, for error messages.
    text: String,
}

/// Where one line of a stitched text comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LineOrigin {
    /// Index of the file in [`Stitched::files`].
    pub file: u32,
    /// The line in that file, from 1.
    pub line: u32,
    /// How many characters of the original line stand before the first character of the stitched line.
    pub column_shift: u32,
}

/// The text of one stage.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stitched {
    /// The pieces in their order, joined by line breaks. Every line break is `\n`, whatever the files use.
    pub text: String,
    /// The origin of each line of `text`.
    pub lines: Vec<LineOrigin>,
    /// Name and text of the files that the stage was made of; the first is the `.sp` file.
    pub files: Vec<(String, String)>,
}

impl Stitched {
    /// File, line, column and source line of a place in the stitched text.
    ///
    /// `line` and `column` count from 1, columns in characters; a line beyond the text is taken as its last.
    pub fn locate(&self, line: u32, column: u32) -> (&str, u32, u32, &str) {
        let index = (line.max(1) as usize - 1).min(self.lines.len().saturating_sub(1));
        let Some((origin, (name, text))) = self
            .lines
            .get(index)
            .and_then(|origin| Some((origin, self.files.get(origin.file as usize)?)))
        else {
            return ("", 0, 0, "");
        };
        (
            name,
            origin.line,
            column.max(1).saturating_add(origin.column_shift),
            line_at(text, origin.line),
        )
    }

    /// A fault at a place in the stitched text, located in the original file.
    pub fn diag(&self, line: u32, column: u32, message: impl Into<String>) -> Diag {
        let (file, line, column, source_line) = self.locate(line, column);
        Diag::new(file, line, column, source_line, message)
    }

    /// A fault at byte `offset` of the stitched text, located in the original file.
    pub fn diag_at(&self, offset: usize, message: impl Into<String>) -> Diag {
        let (line, column) = crate::diag::line_column(&self.text, offset);
        self.diag(line, column, message)
    }
}

impl SpFile {
    /// The file's name as it was given to [`parse`].
    pub fn file(&self) -> &str {
        &self.file
    }

    /// The file's text, without a byte order mark.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The stage of a kind, if the program has it.
    pub fn stage(&self, kind: StageKind) -> Option<&SpStage> {
        self.stages.iter().find(|stage| stage.kind == kind)
    }

    /// The paths of all `SRC` tags, relative to the folder of the `.sp` file, each once, in the order of the file.
    pub fn sources(&self) -> Vec<&str> {
        let mut paths: Vec<&str> = Vec::new();
        let geometry = self.geometry.iter().flat_map(|g| &g.pieces);
        for piece in self.stages.iter().flat_map(|s| &s.pieces).chain(geometry) {
            if let Piece::Src { path, .. } = piece
                && !paths.contains(&path.as_str())
            {
                paths.push(path);
            }
        }
        paths
    }

    /// A fault at a place of the file.
    pub fn diag(&self, place: Place, message: impl Into<String>) -> Diag {
        Diag::new(
            &self.file,
            place.line,
            place.column,
            line_at(&self.text, place.line),
            message,
        )
    }

    /// Builds the text of one stage.
    ///
    /// `read` is given the path of a `SRC` tag, relative to the folder of the `.sp` file, and returns the text of that
    /// file; an error of the kind `InvalidData` means that it is not UTF-8 (as `std::fs::read_to_string` has it).
    ///
    /// # Errors
    /// The program has a geometry stage (WGSL has none) or lacks the stage, a file cannot be read or contains tags, or
    /// the text is blank.
    pub fn stitch(
        &self,
        stage: StageKind,
        read: &mut dyn FnMut(&str) -> io::Result<String>,
    ) -> Result<Stitched, Diags> {
        if let Some(geometry) = &self.geometry {
            return Err(self
                .diag(
                    geometry.place,
                    "WGSL has no geometry stage, so a program with `GEOMETRY` cannot be composed",
                )
                .note("make the primitives in a COMPUTE stage or by instancing in the VERTEX stage")
                .into());
        }
        let Some(stage) = self.stage(stage) else {
            return Err(Diag::whole_file(
                &self.file,
                format!("program `{}` has no {} stage", self.name, stage.tag()),
            )
            .into());
        };
        let mut diags = Diags::new();
        let mut out = Stitched {
            text: String::new(),
            lines: Vec::new(),
            files: vec![(self.file.clone(), self.text.clone())],
        };
        for piece in &stage.pieces {
            match piece {
                Piece::Code { text, place } => out.push(text, 0, *place),
                Piece::Use { snippet, .. } => {
                    if let Some(snippet) = self.snippets.get(*snippet) {
                        out.push(&snippet.text, 0, snippet.text_place);
                    }
                }
                Piece::Src { path, place } => {
                    let name = join(&self.file, path);
                    let known = out.files[1..].iter().position(|(n, _)| *n == name);
                    let index = match known {
                        Some(known) => known + 1,
                        None => match self.read_source(path, &name, *place, read) {
                            Ok(text) => {
                                out.files.push((name, text));
                                out.files.len() - 1
                            }
                            Err(diag) => {
                                diags.push(diag);
                                continue;
                            }
                        },
                    };
                    let text = out.files[index].1.clone();
                    out.push(&text, index as u32, Place { line: 1, column: 1 });
                }
            }
        }
        if diags.is_empty() && out.text.trim().is_empty() {
            diags.push(self.diag(stage.place, format!("the {} stage is empty", stage.kind)));
        }
        diags.ok(out)
    }

    fn read_source(
        &self,
        path: &str,
        name: &str,
        place: Place,
        read: &mut dyn FnMut(&str) -> io::Result<String>,
    ) -> Result<String, Diag> {
        let mut text = read(path).map_err(|error| {
            let fault = match error.kind() {
                io::ErrorKind::NotFound => format!("there is no file `{name}`"),
                io::ErrorKind::InvalidData => format!("file `{name}` is not UTF-8 text"),
                io::ErrorKind::IsADirectory => {
                    format!("`{name}` is a folder; SRC inserts one file")
                }
                _ => format!("file `{name}` cannot be read: {error}"),
            };
            self.diag(place, fault)
        })?;
        let mark = text.len() - without_mark(&text).len();
        text.drain(..mark);
        if let Some(at) = nested_tag(&text) {
            return Err(Diag::at(
                name,
                &text,
                at,
                format!(
                    "`{}` in an inserted file: tags are read in the .sp file only",
                    opener_text(&text[at..])
                ),
            )
            .note(format!(
                "inserted by SRC at {}:{}:{}",
                self.file, place.line, place.column
            )));
        }
        Ok(text)
    }
}

impl Stitched {
    fn push(&mut self, text: &str, file: u32, place: Place) {
        let mut first = true;
        for ((from, to), line) in line_starts(text).zip(place.line..) {
            if !self.lines.is_empty() {
                self.text.push('\n');
            }
            self.text.push_str(&text[from..to]);
            self.lines.push(LineOrigin {
                file,
                line,
                column_shift: if first { place.column - 1 } else { 0 },
            });
            first = false;
        }
    }
}

/// The path of a `SRC` file for messages: the folder of the `.sp` file and the path.
fn join(file: &str, path: &str) -> String {
    match file.rfind(['/', '\\']) {
        Some(end) => format!("{}{path}", &file[..=end]),
        None => path.to_owned(),
    }
}

/// The tags of the format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Tag {
    Program,
    Define,
    Stage(StageKind),
    Geometry,
    Code,
    Src,
    Use,
    Params,
    In,
    Out,
    Cnt,
}

const TAGS: [(&str, Tag); 13] = [
    ("PROGRAM", Tag::Program),
    ("DEFINE", Tag::Define),
    ("VERTEX", Tag::Stage(StageKind::Vertex)),
    ("FRAGMENT", Tag::Stage(StageKind::Fragment)),
    ("COMPUTE", Tag::Stage(StageKind::Compute)),
    ("GEOMETRY", Tag::Geometry),
    ("CODE", Tag::Code),
    ("SRC", Tag::Src),
    ("USE", Tag::Use),
    ("PARAMS", Tag::Params),
    ("IN", Tag::In),
    ("OUT", Tag::Out),
    ("CNT", Tag::Cnt),
];

fn tag_of(name: &str) -> Option<Tag> {
    TAGS.iter().find(|(n, _)| *n == name).map(|(_, tag)| *tag)
}

impl Tag {
    fn name(self) -> &'static str {
        TAGS.iter()
            .find(|(_, tag)| *tag == self)
            .map_or("", |(name, _)| name)
    }

    /// Where the tag belongs, in words.
    fn home(self) -> &'static str {
        match self {
            Tag::Program | Tag::Define | Tag::Stage(_) | Tag::Geometry => "at the top level",
            Tag::Code | Tag::Src | Tag::Use => "directly inside VERTEX, FRAGMENT or COMPUTE",
            Tag::Params => "directly inside GEOMETRY",
            Tag::In | Tag::Out | Tag::Cnt => "inside PARAMS of GEOMETRY",
        }
    }

    fn is_top_level(self) -> bool {
        matches!(
            self,
            Tag::Program | Tag::Define | Tag::Stage(_) | Tag::Geometry
        )
    }
}

/// Length of a size substitution `#{NAME}` at the start of `bytes`, 0 if there is none.
fn substitution(bytes: &[u8]) -> usize {
    if !bytes.starts_with(b"#{") {
        return 0;
    }
    let name = bytes[2..]
        .iter()
        .take_while(|b| b.is_ascii_alphanumeric() || **b == b'_')
        .count();
    if name > 0 && bytes.get(2 + name) == Some(&b'}') {
        name + 3
    } else {
        0
    }
}

/// Whether `bytes` begin with `}#` that is a closing brace, and not `}` before a size substitution.
fn closes(bytes: &[u8]) -> bool {
    bytes.starts_with(b"}#") && substitution(&bytes[1..]) == 0
}

/// Name and whole length of an opening `#NAME{` (blanks or tabs may stand before the brace) at the start of `text`.
fn opener(text: &str) -> Option<(&str, usize)> {
    let rest = text.strip_prefix('#')?;
    let name = &rest[..rest
        .find(|c: char| !(c.is_alphanumeric() || matches!(c, '_' | '-' | '.')))
        .unwrap_or(rest.len())];
    if name.is_empty() {
        return None;
    }
    let after = rest[name.len()..].trim_start_matches([' ', '\t']);
    after
        .starts_with('{')
        .then(|| (name, text.len() - after.len() + 1))
}

/// An opener at the start of `text` as it is shown in messages.
fn opener_text(text: &str) -> String {
    opener(text).map_or_else(String::new, |(name, _)| format!("#{name}{{"))
}

/// The first place in raw text where a tag of the format seems to open.
fn nested_tag(text: &str) -> Option<usize> {
    text.match_indices('#').map(|(at, _)| at).find(|&at| {
        // Names of tags are short; the check keeps the scan linear.
        let head = &text.as_bytes()[at + 1..];
        head.first().is_some_and(u8::is_ascii_uppercase)
            && opener(&text[at..]).is_some_and(|(name, _)| tag_of(name).is_some())
    })
}

/// What stands next between tags.
enum Event<'a> {
    /// Offset of `#`, and the name.
    Open(usize, &'a str),
    /// Offset of `}#`.
    Close(usize),
    End,
}

/// Where the reader is.
enum Level {
    Top,
    Define(usize),
    Stage(StageKind, usize, Vec<Piece>),
    Geometry(Box<Geometry>, usize),
    Params(Box<Geometry>, usize, usize),
}

impl Level {
    fn describe(&self) -> &'static str {
        match self {
            Level::Top => "at the top level",
            Level::Define(_) => "inside `DEFINE`",
            Level::Stage(StageKind::Vertex, ..) => "inside `VERTEX`",
            Level::Stage(StageKind::Fragment, ..) => "inside `FRAGMENT`",
            Level::Stage(StageKind::Compute, ..) => "inside `COMPUTE`",
            Level::Geometry(..) => "inside `GEOMETRY`",
            Level::Params(..) => "inside `PARAMS`",
        }
    }

    fn opened_at(&self) -> Option<usize> {
        match self {
            Level::Top => None,
            Level::Define(at)
            | Level::Stage(_, at, _)
            | Level::Geometry(_, at)
            | Level::Params(_, _, at) => Some(*at),
        }
    }
}

/// Reads a `.sp` file.
///
/// `file` is the name for messages; nothing is read but `text`. A byte order mark is left out.
///
/// # Errors
/// All faults that can be told apart from their consequences, in the order of the file.
pub fn parse(file: &str, text: &str) -> Result<SpFile, Diags> {
    let text = without_mark(text);
    let mut reader = Reader {
        file,
        text,
        starts: line_starts(text).map(|(from, _)| from).collect(),
        at: 0,
        faults: Vec::new(),
        name: None,
        stages: Vec::new(),
        geometry: None,
        snippets: Vec::new(),
        names: BTreeMap::new(),
        uses: Vec::new(),
    };
    reader.read();
    reader.finish()
}

/// [`parse`] for bytes that may not be UTF-8.
///
/// # Errors
/// As [`parse`], and for the first byte that is not UTF-8.
pub fn parse_bytes(file: &str, bytes: &[u8]) -> Result<SpFile, Diags> {
    match std::str::from_utf8(bytes) {
        Ok(text) => parse(file, text),
        Err(error) => {
            let end = error.valid_up_to();
            let valid = String::from_utf8_lossy(&bytes[..end]);
            let byte = bytes.get(end).copied().unwrap_or_default();
            Err(Diag::at(
                file,
                &valid,
                end,
                format!("the file is not UTF-8 text: byte 0x{byte:02x}"),
            )
            .into())
        }
    }
}

struct Reader<'a> {
    file: &'a str,
    text: &'a str,
    /// Offset of each line.
    starts: Vec<usize>,
    /// How far the text is read.
    at: usize,
    /// Faults with their offsets.
    faults: Vec<(usize, Diag)>,
    name: Option<(String, usize)>,
    stages: Vec<(SpStage, usize)>,
    geometry: Option<(Geometry, usize)>,
    snippets: Vec<Snippet>,
    /// Offset and index of each snippet by its name.
    names: BTreeMap<&'a str, (usize, usize)>,
    /// Names in USE: offset and name; the index stands in `Piece::Use::snippet` until `finish`.
    uses: Vec<(usize, &'a str)>,
}

impl<'a> Reader<'a> {
    fn place(&self, offset: usize) -> Place {
        let index = self.starts.partition_point(|start| *start <= offset);
        let start = self.starts[index.max(1) - 1];
        Place {
            line: index.max(1) as u32,
            column: self.text[start..offset].chars().count() as u32 + 1,
        }
    }

    fn fault(&mut self, offset: usize, message: impl Into<String>) -> &mut Diag {
        let place = self.place(offset);
        let line = line_at(&self.text[self.starts[place.line as usize - 1]..], 1);
        let diag = Diag::new(self.file, place.line, place.column, line, message);
        self.faults.push((offset, diag));
        let last = self.faults.len() - 1;
        &mut self.faults[last].1
    }

    fn fault_with(&mut self, offset: usize, message: impl Into<String>, notes: &[String]) {
        self.fault(offset, message)
            .notes
            .extend(notes.iter().cloned());
    }

    /// Whether a fault was found behind `opened`, of which another one may be a consequence.
    fn is_faulty_since(&self, opened: usize) -> bool {
        self.faults.iter().any(|(at, _)| *at >= opened)
    }

    /// The note on a duplicate.
    fn first_at(&self, offset: usize) -> String {
        let place = self.place(offset);
        format!(
            "the first is at {}:{}:{}",
            self.file, place.line, place.column
        )
    }

    /// The next tag or closing brace between tags.
    fn event(&mut self) -> Event<'a> {
        let bytes = self.text.as_bytes();
        while self.at < bytes.len() {
            match bytes[self.at] {
                b'#' => {
                    let skip = substitution(&bytes[self.at..]);
                    if skip > 0 {
                        self.at += skip;
                        continue;
                    }
                    if let Some((name, length)) = opener(&self.text[self.at..]) {
                        let from = self.at;
                        self.at += length;
                        return Event::Open(from, name);
                    }
                }
                b'}' if closes(&bytes[self.at..]) => {
                    let from = self.at;
                    self.at += 2;
                    return Event::Close(from);
                }
                _ => {}
            }
            self.at += 1;
        }
        Event::End
    }

    /// Raw text from the current place to its `}#`, without tags; `opened` and `name` are those of its tag.
    fn raw(&mut self, opened: usize, name: &str) -> Option<&'a str> {
        let bytes = self.text.as_bytes();
        let from = self.at;
        let mut at = from;
        loop {
            match bytes.get(at) {
                None => {
                    self.at = bytes.len();
                    self.unclosed(opened, name);
                    return None;
                }
                Some(b'#') => at += substitution(&bytes[at..]).max(1),
                Some(b'}') if closes(&bytes[at..]) => break,
                Some(_) => at += 1,
            }
        }
        self.at = at + 2;
        Some(&self.text[from..at])
    }

    /// Shader text of `CODE` or a snippet. A tag in it is a fault: its `}#` would end the text.
    fn code(&mut self, opened: usize, name: &str) -> Option<&'a str> {
        let from = self.at;
        let text = self.raw(opened, name)?;
        if let Some(at) = nested_tag(text) {
            let nested = opener_text(&text[at..]);
            let opened_at = self.place(opened);
            let note = format!(
                "`#{name}{{` was opened at line {}; is its `}}#` missing?",
                opened_at.line
            );
            self.fault_with(
                from + at,
                format!("`{nested}` inside `{name}`: its text is raw, tags cannot be nested in it"),
                &[note],
            );
            // Go on as if the missing brace stood before the nested tag.
            self.at = from + at;
            return None;
        }
        Some(text)
    }

    /// The trimmed value of a one-line tag and its offset.
    fn value(&mut self, opened: usize, name: &str) -> Option<(&'a str, usize)> {
        let from = self.at;
        let text = self.raw(opened, name)?;
        let value = text.trim();
        let offset = from + (text.len() - text.trim_start().len());
        if value.is_empty() {
            self.fault(opened, format!("`{name}` is empty"));
            return None;
        }
        if value.contains(['\n', '\r']) || nested_tag(value).is_some() {
            let line_end = value.find(['\n', '\r']).unwrap_or(value.len());
            let tag = nested_tag(value).unwrap_or(value.len());
            self.fault(
                opened,
                format!("`#{name}{{` is not closed: its value is one line"),
            );
            self.at = offset + line_end.min(tag);
            return None;
        }
        if let Some((at, c)) = value.char_indices().find(|(_, c)| c.is_control()) {
            self.fault(
                offset + at,
                format!("control character {c:?} in the value of `{name}`"),
            );
            return None;
        }
        Some((value, offset))
    }

    fn unclosed(&mut self, opened: usize, name: &str) {
        self.fault(
            opened,
            format!("`#{name}{{` is never closed: `}}#` is missing"),
        );
    }

    /// Skips the rest of a block whose tag was at fault, with the blocks in it.
    fn skip_block(&mut self) {
        let mut depth = 1usize;
        while depth > 0 {
            match self.event() {
                Event::Open(..) => depth += 1,
                Event::Close(_) => depth -= 1,
                Event::End => return,
            }
        }
    }

    fn read(&mut self) {
        let mut level = Level::Top;
        while self.faults.len() < MOST_FAULTS {
            match self.event() {
                Event::End => {
                    if let Some(opened) = level.opened_at()
                        && !self.is_faulty_since(opened)
                    {
                        let name = opener(&self.text[opened..]).map_or("", |(name, _)| name);
                        self.unclosed(opened, name);
                    }
                    return;
                }
                Event::Close(at) => level = self.close(level, at),
                Event::Open(at, name) => level = self.open(level, at, name),
            }
        }
    }

    fn close(&mut self, level: Level, at: usize) -> Level {
        match level {
            Level::Top => {
                self.fault_with(
                    at,
                    "`}#` closes nothing",
                    &["the first `}#` in raw text ends it, also in a comment".to_owned()],
                );
                Level::Top
            }
            Level::Define(_) => Level::Top,
            Level::Stage(kind, opened, pieces) => {
                self.end_stage(kind, opened, pieces);
                Level::Top
            }
            Level::Geometry(geometry, opened) => {
                self.end_geometry(*geometry, opened);
                Level::Top
            }
            Level::Params(geometry, opened, _) => Level::Geometry(geometry, opened),
        }
    }

    fn end_stage(&mut self, kind: StageKind, opened: usize, pieces: Vec<Piece>) {
        if pieces.is_empty() && !self.is_faulty_since(opened) {
            self.fault(
                opened,
                format!(
                    "the {kind} stage is empty: it has no CODE, SRC or USE (text outside them is ignored)"
                ),
            );
        }
        if let Some(first) = self
            .stages
            .iter()
            .find(|(s, _)| s.kind == kind)
            .map(|s| s.1)
        {
            let note = self.first_at(first);
            self.fault_with(
                opened,
                format!("a second `{}` in one program", kind.tag()),
                &[note],
            );
            return;
        }
        let place = self.place(opened);
        self.stages.push((
            SpStage {
                kind,
                pieces,
                place,
            },
            opened,
        ));
    }

    fn end_geometry(&mut self, geometry: Geometry, opened: usize) {
        if geometry.pieces.is_empty() && !self.is_faulty_since(opened) {
            self.fault(
                opened,
                "the geometry stage is empty: it has no CODE, SRC or USE (text outside them is ignored)",
            );
        }
        if let Some(first) = self.geometry.as_ref().map(|(_, at)| *at) {
            let note = self.first_at(first);
            self.fault_with(opened, "a second `GEOMETRY` in one program", &[note]);
            return;
        }
        self.geometry = Some((geometry, opened));
    }

    fn open(&mut self, level: Level, at: usize, name: &'a str) -> Level {
        let Some(tag) = tag_of(name) else {
            if let Level::Define(_) = level {
                self.snippet(at, name);
                return level;
            }
            self.unknown(at, name);
            return level;
        };
        match (level, tag) {
            (Level::Top, Tag::Program) => {
                if let Some((value, _)) = self.value(at, name) {
                    match self.name.as_ref().map(|(_, first)| *first) {
                        Some(first) => {
                            let note = self.first_at(first);
                            self.fault_with(at, "a second `PROGRAM` in one file", &[note]);
                        }
                        None => self.name = Some((value.to_owned(), at)),
                    }
                } else if self.name.is_none() {
                    self.name = Some((String::new(), at));
                }
                Level::Top
            }
            (Level::Top, Tag::Define) => Level::Define(at),
            (Level::Top, Tag::Stage(kind)) => Level::Stage(kind, at, Vec::new()),
            (Level::Top, Tag::Geometry) => Level::Geometry(
                Box::new(Geometry {
                    pieces: Vec::new(),
                    input: None,
                    output: None,
                    max_vertices: None,
                    place: self.place(at),
                }),
                at,
            ),
            (Level::Stage(kind, opened, mut pieces), Tag::Code | Tag::Src | Tag::Use) => {
                pieces.extend(self.piece(tag, at));
                Level::Stage(kind, opened, pieces)
            }
            (Level::Geometry(mut geometry, opened), Tag::Code | Tag::Src | Tag::Use) => {
                geometry.pieces.extend(self.piece(tag, at));
                Level::Geometry(geometry, opened)
            }
            (Level::Geometry(geometry, opened), Tag::Params) => Level::Params(geometry, opened, at),
            (Level::Params(mut geometry, opened, params), Tag::In | Tag::Out | Tag::Cnt) => {
                self.param(tag, at, &mut geometry);
                Level::Params(geometry, opened, params)
            }
            (level, tag) => self.misplaced(level, tag, at),
        }
    }

    fn unknown(&mut self, at: usize, name: &str) {
        let upper = name.to_uppercase();
        let mut notes = Vec::new();
        if tag_of(&upper).is_some() {
            notes.push(format!(
                "tags are case-sensitive: did you mean `#{upper}{{`?"
            ));
        } else if let Some(near) = crate::diag::nearest(name, TAGS.iter().map(|(n, _)| *n)) {
            notes.push(format!("did you mean `#{near}{{`?"));
        }
        self.fault_with(at, format!("unknown tag `#{name}{{`"), &notes);
        self.skip_block();
    }

    fn misplaced(&mut self, level: Level, tag: Tag, at: usize) -> Level {
        let mut notes = Vec::new();
        if let Some(opened) = level.opened_at() {
            let place = self.place(opened);
            let name = opener_text(&self.text[opened..]);
            notes.push(format!(
                "`{name}` was opened at line {}; is its `}}#` missing?",
                place.line
            ));
        }
        let message = if let Level::Define(_) = level {
            format!(
                "`#{}{{` inside `DEFINE`: the name of a tag cannot name a snippet",
                tag.name()
            )
        } else {
            format!(
                "`#{}{{` {}: it belongs {}",
                tag.name(),
                level.describe(),
                tag.home()
            )
        };
        self.fault_with(at, message, &notes);
        if tag.is_top_level() && level.opened_at().is_some() {
            // Go on as if the missing brace stood before the tag.
            match level {
                Level::Stage(kind, opened, pieces) => self.end_stage(kind, opened, pieces),
                Level::Geometry(geometry, opened) | Level::Params(geometry, opened, _) => {
                    self.end_geometry(*geometry, opened);
                }
                Level::Top | Level::Define(_) => {}
            }
            return self.open(Level::Top, at, tag.name());
        }
        self.skip_block();
        level
    }

    fn snippet(&mut self, at: usize, name: &'a str) {
        let from = self.at;
        // A snippet with a fault counts as defined, so that no USE of it is reported.
        let text = self.code(at, name).unwrap_or_default();
        if let Some(&(first, _)) = self.names.get(name) {
            let note = self.first_at(first);
            self.fault_with(at, format!("a second snippet `{name}`"), &[note]);
            return;
        }
        self.names.insert(name, (at, self.snippets.len()));
        self.snippets.push(Snippet {
            name: name.to_owned(),
            text: text.to_owned(),
            place: self.place(at),
            text_place: self.place(from),
        });
    }

    fn piece(&mut self, tag: Tag, at: usize) -> Option<Piece> {
        match tag {
            Tag::Code => {
                let from = self.at;
                let text = self.code(at, "CODE")?.to_owned();
                let place = self.place(from);
                Some(Piece::Code { text, place })
            }
            Tag::Src => {
                let (value, offset) = self.value(at, "SRC")?;
                match source_path(value) {
                    Ok(path) => Some(Piece::Src {
                        path,
                        place: self.place(offset),
                    }),
                    Err(message) => {
                        self.fault(offset, message);
                        None
                    }
                }
            }
            Tag::Use => {
                let (value, offset) = self.value(at, "USE")?;
                self.uses.push((offset, value));
                Some(Piece::Use {
                    snippet: self.uses.len() - 1,
                    place: self.place(offset),
                })
            }
            _ => None,
        }
    }

    fn param(&mut self, tag: Tag, at: usize, geometry: &mut Geometry) {
        let Some((value, offset)) = self.value(at, tag.name()) else {
            return;
        };
        let twice = match tag {
            Tag::In => match INPUTS.iter().find(|(name, _)| *name == value) {
                Some((_, input)) => geometry.input.replace(*input).is_some(),
                None => return self.bad_choice(tag, value, offset, &INPUTS.map(|(n, _)| n)),
            },
            Tag::Out => match OUTPUTS.iter().find(|(name, _)| *name == value) {
                Some((_, output)) => geometry.output.replace(*output).is_some(),
                None => return self.bad_choice(tag, value, offset, &OUTPUTS.map(|(n, _)| n)),
            },
            _ => match value.parse::<u32>() {
                Ok(count) if count > 0 => geometry.max_vertices.replace(count).is_some(),
                _ => {
                    self.fault(
                        offset,
                        format!("`{value}` is no value of CNT: a whole number from 1 is expected"),
                    );
                    return;
                }
            },
        };
        if twice {
            self.fault(at, format!("a second `{}` in PARAMS", tag.name()));
        }
    }

    fn bad_choice(&mut self, tag: Tag, value: &str, offset: usize, choices: &[&'static str]) {
        let notes: Vec<String> = crate::diag::nearest(value, choices.iter().copied())
            .map(|near| format!("did you mean `{near}`?"))
            .into_iter()
            .collect();
        self.fault_with(
            offset,
            format!(
                "`{value}` is no value of {}: {} is expected",
                tag.name(),
                choices.join(", ")
            ),
            &notes,
        );
    }

    fn finish(mut self) -> Result<SpFile, Diags> {
        // A USE may stand before its snippet, so names are looked up only now.
        let names: Vec<String> = self.snippets.iter().map(|s| s.name.clone()).collect();
        let mut indices = Vec::with_capacity(self.uses.len());
        let mut missing = Vec::new();
        for &(offset, name) in &self.uses {
            let index = self.names.get(name).map(|(_, index)| *index);
            indices.push(index.unwrap_or(0));
            if index.is_none() {
                missing.push((offset, name));
            }
        }
        missing.truncate(MOST_FAULTS);
        for (offset, name) in missing {
            let note = match crate::diag::nearest(name, names.iter().map(String::as_str)) {
                Some(near) => vec![format!("did you mean `{near}`?")],
                None if names.is_empty() => vec!["the file defines no snippet".to_owned()],
                None => vec![format!("the file defines {}", names.join(", "))],
            };
            self.fault_with(offset, format!("no snippet `{name}` in DEFINE"), &note);
        }
        for piece in self
            .stages
            .iter_mut()
            .flat_map(|(s, _)| &mut s.pieces)
            .chain(self.geometry.iter_mut().flat_map(|(g, _)| &mut g.pieces))
        {
            if let Piece::Use { snippet, .. } = piece {
                *snippet = indices.get(*snippet).copied().unwrap_or(0);
            }
        }
        if self.faults.is_empty() {
            if self.name.is_none() {
                self.fault(0, "the file has no `#PROGRAM{ name }#`");
            }
            if self.stages.is_empty() && self.geometry.is_none() {
                let at = self.name.as_ref().map_or(0, |(_, at)| *at);
                self.fault(
                    at,
                    "the program is empty: it has no VERTEX, FRAGMENT or COMPUTE",
                );
            }
        }
        if !self.faults.is_empty() {
            self.faults.sort_by_key(|(at, _)| *at);
            return Err(Diags(self.faults.into_iter().map(|(_, d)| d).collect()));
        }
        Ok(SpFile {
            name: self.name.map(|(name, _)| name).unwrap_or_default(),
            stages: self.stages.into_iter().map(|(s, _)| s).collect(),
            geometry: self.geometry.map(|(g, _)| g),
            snippets: self.snippets,
            file: self.file.to_owned(),
            text: self.text.to_owned(),
        })
    }
}

/// The normalised form of a `SRC` path, or why it is refused.
fn source_path(path: &str) -> Result<String, String> {
    if path.contains('\\') {
        return Err(format!(
            "`{path}`: folders in a SRC path are separated by `/`"
        ));
    }
    let drive = path.as_bytes().get(1) == Some(&b':') && path.as_bytes()[0].is_ascii_alphabetic();
    if path.starts_with('/') || drive {
        return Err(format!(
            "`{path}` is absolute: a SRC path is relative to the folder of the .sp file"
        ));
    }
    let mut parts: Vec<&str> = Vec::new();
    for part in path.split('/') {
        match part {
            "" | "." => {}
            ".." => {
                if parts.pop().is_none() {
                    return Err(format!("`{path}` leaves the folder of the .sp file"));
                }
            }
            part => parts.push(part),
        }
    }
    let last = path.rsplit('/').next().unwrap_or_default();
    if matches!(last, "" | "." | "..") {
        return Err(format!("`{path}` is a folder; SRC inserts one file"));
    }
    Ok(parts.join("/"))
}
