//! Located errors: every fault that the composer finds in a `.sp`, `.wgsl` or `.ron` file is a [`Diag`].

use std::fmt;

/// One fault, with the place in the original file where it was found.
///
/// Displayed as `file:line:column: message`, the source line, a line with a caret under the column, and one
/// `note: ...` line for each of the notes.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Diag {
    /// The file's name as the reader was given it.
    pub file: String,
    /// Line, counted from 1; 0 if the fault concerns the file as a whole (then `column` is 0 too).
    pub line: u32,
    /// Column, counted from 1 in characters (not bytes); 0 if unknown.
    pub column: u32,
    /// What is wrong, in one sentence without a full stop.
    pub message: String,
    /// The source line that `line` names, without its line break; may be empty.
    pub source_line: String,
    /// Further remarks: where the other half of a clash stands, what may have been meant.
    pub notes: Vec<String>,
}

/// A place in a file; both numbers count from 1, the column in characters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Place {
    /// The line.
    pub line: u32,
    /// The column.
    pub column: u32,
}

impl Place {
    /// The place of byte `offset` in `text`.
    pub fn of(text: &str, offset: usize) -> Self {
        let (line, column) = line_column(text, offset);
        Self { line, column }
    }
}

/// A line longer than this many characters is shown as a window around the column.
const SHOWN_WIDTH: usize = 160;

impl Diag {
    /// A fault at byte `offset` of `text`.
    ///
    /// An offset beyond the text or inside a character is moved back to the nearest character boundary.
    pub fn at(
        file: impl Into<String>,
        text: &str,
        offset: usize,
        message: impl Into<String>,
    ) -> Self {
        let (line, column) = line_column(text, offset);
        Self {
            file: file.into(),
            line,
            column,
            message: message.into(),
            source_line: line_at(text, line).to_owned(),
            notes: Vec::new(),
        }
    }

    /// A fault at a place that is already known as line and column (both counted from 1).
    pub fn new(
        file: impl Into<String>,
        line: u32,
        column: u32,
        source_line: impl Into<String>,
        message: impl Into<String>,
    ) -> Self {
        Self {
            file: file.into(),
            line,
            column,
            message: message.into(),
            source_line: source_line.into(),
            notes: Vec::new(),
        }
    }

    /// A fault of a whole file (unreadable, not UTF-8, missing), or of something that is in no file, for instance
    /// a command line argument; `file` is then the name of that thing.
    pub fn whole_file(file: impl Into<String>, message: impl Into<String>) -> Self {
        Self::new(file, 0, 0, "", message)
    }

    /// The same fault with one more note.
    #[must_use]
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.notes.push(note.into());
        self
    }

    /// The same fault with the note "did you mean `X`?" if one of the candidates resembles `name`.
    #[must_use]
    pub fn suggest<'a>(self, name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Self {
        match nearest(name, candidates) {
            Some(candidate) => self.note(format!("did you mean `{candidate}`?")),
            None => self,
        }
    }
}

impl fmt::Display for Diag {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.line == 0 {
            write!(f, "{}: {}", self.file, self.message)?;
        } else {
            write!(
                f,
                "{}:{}:{}: {}",
                self.file, self.line, self.column, self.message
            )?;
        }
        if self.line != 0 && self.column != 0 && !self.source_line.is_empty() {
            let (shown, caret) = window(&self.source_line, self.column as usize - 1);
            write!(f, "\n{shown}\n{caret}")?;
        }
        for note in &self.notes {
            write!(f, "\nnote: {note}")?;
        }
        Ok(())
    }
}

impl std::error::Error for Diag {}

/// The source line (or a window of it, if it is long) and the line with the caret; `at` counts from 0.
fn window(line: &str, at: usize) -> (String, String) {
    let chars: Vec<char> = line.chars().collect();
    let at = at.min(chars.len());
    let (start, end) = if chars.len() <= SHOWN_WIDTH {
        (0, chars.len())
    } else {
        let start = at
            .saturating_sub(SHOWN_WIDTH / 2)
            .min(chars.len() - SHOWN_WIDTH);
        (start, start + SHOWN_WIDTH)
    };
    let mut shown = String::new();
    let mut caret = String::new();
    if start > 0 {
        shown.push_str("...");
        caret.push_str("   ");
    }
    for (i, &c) in chars[start..end].iter().enumerate() {
        shown.push(if c.is_control() && c != '\t' {
            '\u{fffd}'
        } else {
            c
        });
        if start + i < at {
            caret.push(if c == '\t' { '\t' } else { ' ' });
        }
    }
    if end < chars.len() {
        shown.push_str("...");
    }
    caret.push('^');
    (shown, caret)
}

/// Some faults, in the order in which they were found; never empty when returned as an error.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Diags(pub Vec<Diag>);

impl Diags {
    /// No fault yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a fault.
    pub fn push(&mut self, diag: Diag) {
        self.0.push(diag);
    }

    /// Adds all faults of another list.
    pub fn append(&mut self, mut other: Diags) {
        self.0.append(&mut other.0);
    }

    /// Whether there is no fault.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The faults in the order in which they were found.
    pub fn iter(&self) -> std::slice::Iter<'_, Diag> {
        self.0.iter()
    }

    /// `Ok(value)` without a fault, otherwise the faults.
    pub fn ok<T>(self, value: T) -> Result<T, Diags> {
        if self.0.is_empty() {
            Ok(value)
        } else {
            Err(self)
        }
    }
}

impl From<Diag> for Diags {
    fn from(diag: Diag) -> Self {
        Self(vec![diag])
    }
}

impl fmt::Display for Diags {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, diag) in self.0.iter().enumerate() {
            if i > 0 {
                f.write_str("\n")?;
            }
            diag.fmt(f)?;
        }
        Ok(())
    }
}

impl std::error::Error for Diags {}

/// Line and column (both from 1, the column in characters) of byte `offset` in `text`.
///
/// Line breaks are `\n`, `\r\n` and a lone `\r`. An offset beyond the end is the end.
pub fn line_column(text: &str, offset: usize) -> (u32, u32) {
    let mut offset = offset.min(text.len());
    while !text.is_char_boundary(offset) {
        offset -= 1;
    }
    let (mut line, mut start) = (1u32, 0usize);
    for (from, _) in line_starts(text).skip(1) {
        if from > offset {
            break;
        }
        line += 1;
        start = from;
    }
    let column = text[start..offset].chars().count() as u32 + 1;
    (line, column)
}

/// Line `line` (from 1) of `text` without its line break; empty if there is no such line.
pub fn line_at(text: &str, line: u32) -> &str {
    (line as usize)
        .checked_sub(1)
        .and_then(|n| line_starts(text).nth(n))
        .map_or("", |(from, to)| &text[from..to])
}

/// Start and end (without the line break) of each line of `text`, in bytes.
pub(crate) fn line_starts(text: &str) -> impl Iterator<Item = (usize, usize)> + '_ {
    let bytes = text.as_bytes();
    let mut next = Some(0usize);
    std::iter::from_fn(move || {
        let from = next?;
        let mut end = from;
        while end < bytes.len() && bytes[end] != b'\n' && bytes[end] != b'\r' {
            end += 1;
        }
        next = if end >= bytes.len() {
            None
        } else if bytes[end] == b'\r' && bytes.get(end + 1) == Some(&b'\n') {
            Some(end + 2)
        } else {
            Some(end + 1)
        };
        Some((from, end))
    })
}

/// `text` without a byte order mark.
pub(crate) fn without_mark(text: &str) -> &str {
    text.strip_prefix('\u{feff}').unwrap_or(text)
}

/// The candidate that resembles `name` most, if one does: the fewest insertions, deletions, replacements and swaps of
/// neighbours, at most a third of the name's length (but one from two letters on); case counts half. Ties go to the first candidate.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    const LONGEST: usize = 128;
    let wanted: Vec<char> = name.chars().take(LONGEST + 1).collect();
    if wanted.is_empty() || wanted.len() > LONGEST {
        return None;
    }
    // In half edits. Of a name of one letter nothing is left after an edit.
    let allowed = if wanted.len() == 1 {
        0
    } else {
        2 * (wanted.len() / 3).max(1)
    };
    let mut best: Option<(usize, &'a str)> = None;
    for candidate in candidates {
        let other: Vec<char> = candidate.chars().take(LONGEST + 1).collect();
        // A name that differs in nothing but case always counts as near.
        let same = candidate.to_lowercase() == name.to_lowercase();
        if other.is_empty()
            || other.len() > LONGEST
            || (!same && 2 * wanted.len().abs_diff(other.len()) > allowed)
        {
            continue;
        }
        let distance = if same { 1 } else { distance(&wanted, &other) };
        if (same || distance <= allowed) && best.is_none_or(|(d, _)| distance < d) {
            best = Some((distance, candidate));
        }
    }
    best.map(|(_, candidate)| candidate)
}

/// Twice the edit distance of `a` and `b` (a replacement by the other case costs one half).
fn distance(a: &[char], b: &[char]) -> usize {
    let replace = |x: char, y: char| {
        if x == y {
            0
        } else if x.eq_ignore_ascii_case(&y) {
            1
        } else {
            2
        }
    };
    let mut before: Vec<usize> = Vec::new();
    let mut previous: Vec<usize> = (0..=b.len()).map(|j| 2 * j).collect();
    for i in 1..=a.len() {
        let mut row = vec![2 * i; b.len() + 1];
        for j in 1..=b.len() {
            let mut d = (previous[j] + 2)
                .min(row[j - 1] + 2)
                .min(previous[j - 1] + replace(a[i - 1], b[j - 1]));
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                d = d.min(before[j - 2] + 2);
            }
            row[j] = d;
        }
        before = std::mem::replace(&mut previous, row);
    }
    previous[b.len()]
}
