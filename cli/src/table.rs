//! Rows of numbers in NPY and CSV files: what `veduta eval` reads and writes.
//!
//! NPY: `float32`, `float64` or `int64` in C order, of one or two dimensions, one row a sample. CSV: one line a row,
//! commas, an optional header line, `#` begins a comment line.

use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::Path;

use npyz::WriterBuilder as _;
use veduta::eval::{Column, ResultKind};

use crate::error::CliError;

/// The longest header of an NPY file that is read, in bytes: the limit that NumPy itself has.
const LONGEST_NPY_HEADER: usize = 10_000;

/// Rows of numbers as a file holds them.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Numbers a row, at least 1.
    pub columns: usize,
    /// The numbers, row after row.
    pub cells: Cells,
}

/// The numbers of a [`Table`] in the type of the file.
#[derive(Debug, Clone, PartialEq)]
pub enum Cells {
    /// `float32`
    F32(Vec<f32>),
    /// `float64`
    F64(Vec<f64>),
    /// `int64`
    I64(Vec<i64>),
    /// The text of each cell of a CSV file, which the column's type interprets.
    Text(Vec<String>),
}

impl Cells {
    /// How many numbers there are.
    pub fn len(&self) -> usize {
        match self {
            Cells::F32(v) => v.len(),
            Cells::F64(v) => v.len(),
            Cells::I64(v) => v.len(),
            Cells::Text(v) => v.len(),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// The format of a file of rows, which its ending says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// `.npy`
    Npy,
    /// `.csv`
    Csv,
}

impl Format {
    /// The format of `path`.
    ///
    /// # Errors
    /// [`CliError::Table`] for any other ending than `.npy` and `.csv`.
    pub fn of(path: &Path) -> Result<Format, CliError> {
        match path
            .extension()
            .and_then(|e| e.to_str())
            .map(str::to_lowercase)
            .as_deref()
        {
            Some("npy") => Ok(Format::Npy),
            Some("csv") => Ok(Format::Csv),
            _ => Err(table(
                path,
                "the name must end in `.npy` or `.csv`, which says the format",
            )),
        }
    }
}

fn table(path: &Path, what: impl Into<String>) -> CliError {
    CliError::Table {
        path: path.to_owned(),
        what: what.into(),
    }
}

impl Table {
    /// Reads a file of rows with `columns` numbers each.
    ///
    /// # Errors
    /// [`CliError::Read`], and [`CliError::Table`] for a malformed or truncated file, another type, order or shape.
    pub fn read(path: &Path, columns: usize) -> Result<Table, CliError> {
        let format = Format::of(path)?;
        let bytes = std::fs::read(path).map_err(|e| CliError::read(path, e))?;
        match format {
            Format::Npy => Table::from_npy(path, &bytes, columns),
            Format::Csv => Table::from_csv(path, &bytes, columns),
        }
    }

    /// Reads the bytes of an NPY file; `path` stands in messages only.
    ///
    /// # Errors
    /// As [`Table::read`].
    pub fn from_npy(path: &Path, bytes: &[u8], columns: usize) -> Result<Table, CliError> {
        let fault = |what: String| table(path, what);
        check_npy_header(bytes).map_err(&fault)?;
        let mut rest = bytes;
        let header = npyz::NpyHeader::from_reader(&mut rest)
            .map_err(|e| fault(format!("is no NPY file: {e}")))?;
        let dtype = header.dtype();
        let descr = dtype.descr();
        let needed = "the type must be float32, float64 or int64";
        let npyz::DType::Plain(ty) = &dtype else {
            return Err(fault(format!("the type is {descr}, but {needed}")));
        };
        let width = ty.size_field();
        let kind = match (ty.type_char(), width) {
            (npyz::TypeChar::Float, 4 | 8) | (npyz::TypeChar::Int, 8) => ty.type_char(),
            _ => return Err(fault(format!("the type is {descr}, but {needed}"))),
        };
        let shape = header.shape();
        let shown = format!(
            "({})",
            shape
                .iter()
                .map(u64::to_string)
                .collect::<Vec<_>>()
                .join(", ")
        );
        match shape {
            [_] if columns == 1 => {}
            [_, n] if *n == columns as u64 => {}
            _ => {
                let one = if columns == 1 { " or (rows)" } else { "" };
                return Err(fault(format!(
                    "the shape is {shown}, but must be (rows, {columns}){one}: one row a sample, one column for each of \
                     `--columns`"
                )));
            }
        }
        let order_matters = shape.iter().filter(|n| **n > 1).count() > 1;
        if header.order() == npyz::Order::Fortran && order_matters {
            return Err(fault(
                "the numbers lie in Fortran order, but must lie in C order (numpy.ascontiguousarray)"
                    .to_owned(),
            ));
        }
        // The header was checked not to overflow.
        let count = shape.iter().product::<u64>();
        let expected = count * width;
        if rest.len() as u64 != expected {
            let relation = if (rest.len() as u64) < expected {
                "is truncated"
            } else {
                "has bytes behind its end"
            };
            return Err(fault(format!(
                "{relation}: the shape {shown} needs {expected} bytes of numbers, but there are {}",
                rest.len()
            )));
        }
        let big = ty.endianness() == npyz::Endianness::Big;
        let cells = match (kind, width) {
            (npyz::TypeChar::Float, 4) => {
                Cells::F32(words::<4>(rest, big).map(f32::from_le_bytes).collect())
            }
            (npyz::TypeChar::Float, _) => {
                Cells::F64(words::<8>(rest, big).map(f64::from_le_bytes).collect())
            }
            _ => Cells::I64(words::<8>(rest, big).map(i64::from_le_bytes).collect()),
        };
        Ok(Table { columns, cells })
    }

    /// Reads the bytes of a CSV file; `path` stands in messages only.
    ///
    /// A first line of which no cell is a number is a header and left out.
    ///
    /// # Errors
    /// As [`Table::read`]; what the cells hold is judged by [`Table::to_bits`].
    pub fn from_csv(path: &Path, bytes: &[u8], columns: usize) -> Result<Table, CliError> {
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .comment(Some(b'#'))
            .trim(csv::Trim::All)
            .from_reader(bytes);
        let mut cells = Vec::new();
        for (index, record) in reader.records().enumerate() {
            let record = record.map_err(|e| table(path, format!("is no CSV file: {e}")))?;
            if record.len() != columns {
                let line = record.position().map_or(0, csv::Position::line);
                return Err(table(
                    path,
                    format!(
                        "line {line} has {} column{}, but `--columns` names {columns}",
                        record.len(),
                        if record.len() == 1 { "" } else { "s" }
                    ),
                ));
            }
            if index == 0 && record.iter().all(|cell| cell.parse::<f64>().is_err()) {
                continue;
            }
            cells.extend(record.iter().map(str::to_owned));
        }
        Ok(Table {
            columns,
            cells: Cells::Text(cells),
        })
    }

    /// The 32-bit patterns that [`veduta::eval::Evaluator::run_bits`] takes.
    ///
    /// Floats round to the nearest `f32`; NaN and infinities pass. `path` stands in messages only.
    ///
    /// # Errors
    /// [`CliError::Cell`] for a number that is not whole or out of range in an integer column, for a finite number beyond
    /// the range of `f32`, and for text that is no number; [`CliError::Table`] when the columns are not those of the table.
    pub fn to_bits(&self, path: &Path, columns: &[Column]) -> Result<Vec<u32>, CliError> {
        if columns.len() != self.columns {
            return Err(table(
                path,
                format!(
                    "has {} columns, but {} types were given",
                    self.columns,
                    columns.len()
                ),
            ));
        }
        let mut bits = Vec::with_capacity(self.cells.len());
        for index in 0..self.cells.len() {
            let column = index % columns.len();
            let ty = columns[column];
            let word = match &self.cells {
                Cells::F32(v) => float_bits(f64::from(v[index]), Some(v[index]), ty),
                Cells::F64(v) => float_bits(v[index], None, ty),
                Cells::I64(v) => integer_bits(v[index], ty),
                Cells::Text(v) => text_bits(&v[index], ty),
            };
            bits.push(word.map_err(|(value, needed)| CliError::Cell {
                path: path.to_owned(),
                row: index / columns.len(),
                column,
                value,
                needed: needed.to_owned(),
            })?);
        }
        Ok(bits)
    }
}

impl Table {
    /// The numbers in `f64`, row after row; infinities and NaN pass.
    ///
    /// # Errors
    /// [`CliError::Cell`] for text that is no number.
    pub fn to_numbers(&self, path: &Path) -> Result<Vec<f64>, CliError> {
        match &self.cells {
            Cells::F32(v) => Ok(v.iter().map(|x| f64::from(*x)).collect()),
            Cells::F64(v) => Ok(v.clone()),
            Cells::I64(v) => Ok(v.iter().map(|x| *x as f64).collect()),
            Cells::Text(v) => v
                .iter()
                .enumerate()
                .map(|(index, text)| {
                    text.parse().map_err(|_| CliError::Cell {
                        path: path.to_owned(),
                        row: index / self.columns,
                        column: index % self.columns,
                        value: format!("`{text}`"),
                        needed: "a number is needed".to_owned(),
                    })
                })
                .collect(),
        }
    }
}

/// The shape and the numbers of an NPY file of `float32` with three dimensions in C order.
///
/// # Errors
/// [`CliError::Read`], and [`CliError::Table`] for a malformed or truncated file, another type, order or shape.
pub fn read_cube(path: &Path) -> Result<([usize; 3], Vec<f32>), CliError> {
    let bytes = std::fs::read(path).map_err(|e| CliError::read(path, e))?;
    let fault = |what: String| table(path, what);
    check_npy_header(&bytes).map_err(&fault)?;
    let mut rest = bytes.as_slice();
    let header = npyz::NpyHeader::from_reader(&mut rest)
        .map_err(|e| fault(format!("is no NPY file: {e}")))?;
    let dtype = header.dtype();
    let big = match &dtype {
        npyz::DType::Plain(ty)
            if ty.type_char() == npyz::TypeChar::Float && ty.size_field() == 4 =>
        {
            ty.endianness() == npyz::Endianness::Big
        }
        _ => {
            let descr = dtype.descr();
            return Err(fault(format!("the type is {descr}, but must be float32")));
        }
    };
    let shape = header.shape();
    let &[z, y, x] = shape else {
        return Err(fault(format!(
            "the shape is {shape:?}, but must be (values along z, along y, along x)"
        )));
    };
    if header.order() == npyz::Order::Fortran && shape.iter().filter(|n| **n > 1).count() > 1 {
        return Err(fault(
            "the numbers lie in Fortran order, but must lie in C order (numpy.ascontiguousarray)"
                .to_owned(),
        ));
    }
    let expected = 4 * x * y * z;
    if rest.len() as u64 != expected {
        return Err(fault(format!(
            "the shape {shape:?} needs {expected} bytes of numbers, but there are {}",
            rest.len()
        )));
    }
    let numbers = words::<4>(rest, big).map(f32::from_le_bytes).collect();
    Ok(([z as usize, y as usize, x as usize], numbers))
}

/// Writes an NPY file of `float32` with three dimensions in C order.
///
/// # Errors
/// [`CliError::Write`].
pub fn write_cube(path: &Path, shape: [usize; 3], numbers: &[f32]) -> Result<(), CliError> {
    let fault = |e: std::io::Error| CliError::write(path, e);
    let mut out = BufWriter::new(File::create(path).map_err(fault)?);
    let shape = shape.map(|n| n as u64);
    let mut writer = npyz::WriteOptions::new()
        .default_dtype()
        .shape(&shape)
        .writer(&mut out)
        .begin_nd()
        .map_err(fault)?;
    writer.extend(numbers.iter().copied()).map_err(fault)?;
    writer.finish().map_err(fault)?;
    out.flush().map_err(fault)
}

type Misfit = (String, &'static str);

fn whole_number_needed(ty: Column) -> &'static str {
    match ty {
        Column::I => "a column of type i needs a whole number in [-2147483648, 2147483647]",
        Column::U => "a column of type u needs a whole number in [0, 4294967295]",
        Column::F => "a column of type f needs a number that f32 can hold, up to 3.4028235e38",
    }
}

/// `exact` is the value when it is an `f32` already, so that a NaN keeps its bits.
fn float_bits(value: f64, exact: Option<f32>, ty: Column) -> Result<u32, Misfit> {
    let misfit = || Err((format!("{value:?}"), whole_number_needed(ty)));
    if ty == Column::F {
        let rounded = exact.unwrap_or(value as f32);
        if value.is_finite() && !rounded.is_finite() {
            return misfit();
        }
        return Ok(rounded.to_bits());
    }
    // i64 holds every value that can pass, and the comparison with 2^62 is exact.
    if value.fract() == 0.0 && value.abs() < 4.6e18 {
        return integer_bits(value as i64, ty)
            .map_err(|(_, needed)| (format!("{value:?}"), needed));
    }
    misfit()
}

fn integer_bits(value: i64, ty: Column) -> Result<u32, Misfit> {
    let misfit = |_| (value.to_string(), whole_number_needed(ty));
    match ty {
        Column::I => i32::try_from(value).map(i32::cast_unsigned).map_err(misfit),
        Column::U => u32::try_from(value).map_err(misfit),
        Column::F => Ok((value as f32).to_bits()),
    }
}

fn text_bits(text: &str, ty: Column) -> Result<u32, Misfit> {
    let misfit = || (format!("`{text}`"), whole_number_needed(ty));
    match ty {
        // Parsed as f32 at once: rounding only once.
        Column::F => {
            let value: f32 = text.parse().map_err(|_| misfit())?;
            if value.is_infinite() && !text.to_lowercase().contains("inf") {
                return Err(misfit());
            }
            Ok(value.to_bits())
        }
        Column::I | Column::U => match text.parse::<i64>() {
            Ok(value) => integer_bits(value, ty).map_err(|_| misfit()),
            Err(_) => {
                let value: f64 = text.parse().map_err(|_| misfit())?;
                float_bits(value, None, ty).map_err(|_| misfit())
            }
        },
    }
}

fn words<const N: usize>(bytes: &[u8], big: bool) -> impl Iterator<Item = [u8; N]> + '_ {
    bytes.chunks_exact(N).map(move |chunk| {
        let mut word = [0; N];
        word.copy_from_slice(chunk);
        if big {
            word.reverse();
        }
        word
    })
}

/// Refuses headers that a parser would choke on: longer than the file, nested, or with a shape beyond 2^53 bytes.
fn check_npy_header(bytes: &[u8]) -> Result<(), String> {
    if bytes.len() < 10 || &bytes[..6] != b"\x93NUMPY" {
        return Err("is no NPY file: it does not begin with \\x93NUMPY".to_owned());
    }
    let (start, length) = if bytes[6] == 1 {
        (10, usize::from(u16::from_le_bytes([bytes[8], bytes[9]])))
    } else if let Some(&[a, b, c, d]) = bytes.get(8..12).and_then(|b| b.first_chunk()) {
        (12, u32::from_le_bytes([a, b, c, d]) as usize)
    } else {
        return Err("is truncated inside its header".to_owned());
    };
    if length > LONGEST_NPY_HEADER {
        return Err(format!(
            "has a header of {length} bytes; at most {LONGEST_NPY_HEADER} are read"
        ));
    }
    let Some(header) = bytes.get(start..start + length) else {
        return Err("is truncated inside its header".to_owned());
    };
    let mut quoted = false;
    let mut nested = 0;
    let mut number: Option<u128> = None;
    let mut product: u128 = 8;
    for &byte in header.iter().chain(b" ") {
        if byte == b'\'' || byte == b'"' {
            quoted = !quoted;
        }
        match byte {
            b'0'..=b'9' if !quoted => {
                let digit = u128::from(byte - b'0');
                number = Some(number.unwrap_or(0).saturating_mul(10).saturating_add(digit));
            }
            b'(' | b'[' | b'{' => nested += 1,
            _ => {}
        }
        if !byte.is_ascii_digit() {
            product = product.saturating_mul(number.take().unwrap_or(1).max(1));
        }
    }
    if nested > 16 {
        return Err(
            "the type is structured, but the type must be float32, float64 or int64".to_owned(),
        );
    }
    if product > 1 << 53 {
        return Err("the shape in the header is larger than any file".to_owned());
    }
    Ok(())
}

/// Writes the results of an evaluation: `float32` for floats, `int64` for integers and flags; rows x `width`, or one
/// dimension when the width is 1. CSV: one line a row without a header, floats with as many digits as their bits need.
///
/// # Errors
/// [`CliError::Table`] for another ending than `.npy` and `.csv`, [`CliError::Write`].
pub fn write_results(
    path: &Path,
    bits: &[u32],
    width: usize,
    kind: ResultKind,
) -> Result<(), CliError> {
    let format = Format::of(path)?;
    let fault = |e: std::io::Error| CliError::write(path, e);
    let file = File::create(path).map_err(fault)?;
    let mut out = BufWriter::new(file);
    let integer = |word: u32| match kind {
        ResultKind::I32 => i64::from(word.cast_signed()),
        _ => i64::from(word),
    };
    match format {
        Format::Npy => {
            let rows = (bits.len() / width.max(1)) as u64;
            let shape = [rows, width as u64];
            let shape = if width == 1 { &shape[..1] } else { &shape[..] };
            if kind == ResultKind::F32 {
                let mut writer = npyz::WriteOptions::new()
                    .default_dtype()
                    .shape(shape)
                    .writer(&mut out)
                    .begin_nd()
                    .map_err(fault)?;
                writer
                    .extend(bits.iter().map(|w| f32::from_bits(*w)))
                    .map_err(fault)?;
                writer.finish().map_err(fault)?;
            } else {
                let mut writer = npyz::WriteOptions::new()
                    .default_dtype()
                    .shape(shape)
                    .writer(&mut out)
                    .begin_nd()
                    .map_err(fault)?;
                writer
                    .extend(bits.iter().map(|w| integer(*w)))
                    .map_err(fault)?;
                writer.finish().map_err(fault)?;
            }
        }
        Format::Csv => {
            for row in bits.chunks(width.max(1)) {
                let cells: Vec<String> = row
                    .iter()
                    .map(|w| match kind {
                        ResultKind::F32 => format!("{:?}", f32::from_bits(*w)),
                        _ => integer(*w).to_string(),
                    })
                    .collect();
                writeln!(out, "{}", cells.join(",")).map_err(fault)?;
            }
        }
    }
    out.flush().map_err(fault)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn npy(header: &str, data: &[u8]) -> Vec<u8> {
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend(data);
        bytes
    }

    #[test]
    fn hostile_headers_are_faults() {
        let path = Path::new("x.npy");
        let nested = "(".repeat(9000);
        for bytes in [
            Vec::new(),
            b"\x93NUMPY".to_vec(),
            b"\x93NUMPY\x02\x00\xff\xff\xff\xff".to_vec(),
            b"\x93NUMPY\x01\x00\xff\xff".to_vec(),
            npy(&nested, &[]),
            npy("", &[]),
            npy(
                "{'descr': '<f8', 'fortran_order': False, 'shape': (18446744073709551615, 18446744073709551615)}",
                &[],
            ),
            npy(
                "{'descr': '<f8', 'fortran_order': False, 'shape': (4294967296, 4294967296)}",
                &[],
            ),
            npy("{'descr': '<f8', 'fortran_order': 3, 'shape': (1,)}", &[]),
            npy(
                "{'descr': '<f8', 'fortran_order': False, 'shape': (-1,)}",
                &[],
            ),
            npy(
                "{'descr': '<f16', 'fortran_order': False, 'shape': (1,)}",
                &[0; 16],
            ),
            npy(
                "{'descr': '|O', 'fortran_order': False, 'shape': (1,)}",
                &[0; 8],
            ),
        ] {
            assert!(matches!(
                Table::from_npy(path, &bytes, 1),
                Err(CliError::Table { .. })
            ));
        }
        // Every truncation and every single damaged byte: no panic.
        let good = npy(
            "{'descr': '>f4', 'fortran_order': False, 'shape': (2, 1), }",
            &[0x3f, 0x80, 0, 0, 0x40, 0, 0, 0],
        );
        assert_eq!(
            Table::from_npy(path, &good, 1).unwrap().cells,
            Cells::F32(vec![1.0, 2.0])
        );
        for end in 0..good.len() {
            assert!(Table::from_npy(path, &good[..end], 1).is_err());
        }
        for at in 0..good.len() {
            for value in [0, b'(', b'9', 0xff] {
                let mut bytes = good.clone();
                bytes[at] = value;
                let _ = Table::from_npy(path, &bytes, 1);
            }
        }
    }

    #[test]
    fn numbers_fit_their_columns_or_are_faults() {
        let i = |v: f64| float_bits(v, None, Column::I);
        assert_eq!(i(-2_147_483_648.0), Ok(0x8000_0000));
        assert!(i(2_147_483_648.0).is_err());
        assert!(i(0.5).is_err() && i(f64::NAN).is_err() && i(f64::INFINITY).is_err());
        assert_eq!(float_bits(4_294_967_295.0, None, Column::U), Ok(u32::MAX));
        assert!(float_bits(-1.0, None, Column::U).is_err());
        assert_eq!(float_bits(0.1, None, Column::F), Ok(0.1_f32.to_bits()));
        assert!(float_bits(1e39, None, Column::F).is_err());
        assert_eq!(
            float_bits(f64::INFINITY, None, Column::F),
            Ok(f32::INFINITY.to_bits())
        );
        let nan = f32::from_bits(0x7fc0_1234);
        assert_eq!(
            float_bits(f64::from(nan), Some(nan), Column::F),
            Ok(0x7fc0_1234)
        );
        assert_eq!(text_bits("1e3", Column::I), Ok(1000));
        assert_eq!(text_bits("-7", Column::I), Ok((-7_i32).cast_unsigned()));
        assert!(text_bits("1e39", Column::F).is_err());
        assert_eq!(
            text_bits("-inf", Column::F),
            Ok(f32::NEG_INFINITY.to_bits())
        );
        assert!(text_bits("", Column::F).is_err());
        assert!(text_bits("9007199254740993", Column::U).is_err());
    }
}
