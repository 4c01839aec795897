use std::io::Write;
use std::path::{Path, PathBuf};

use csv::{ReaderBuilder, StringRecord, Trim};

use crate::read_text;
use crate::text::limits::MOST_ROWS;
use crate::{Error, Result};
use atomic_output::FileWriter;

/// The columns of a kind of table.
pub(super) struct Columns {
    pub required: &'static [&'static str],
    pub optional: &'static [&'static str],
}

/// A table with a checked header.
pub(super) struct Table {
    file: PathBuf,
    /// Names of the file's columns in their order.
    header: Vec<String>,
    /// Line and fields of each row, the header first.
    records: Vec<(usize, StringRecord)>,
}

impl Table {
    pub fn read(file: &Path, columns: &Columns) -> Result<Self> {
        Self::parse(file, &read_text(file)?, columns)
    }

    pub fn parse(file: &Path, text: &str, columns: &Columns) -> Result<Self> {
        let mut reader =
            ReaderBuilder::new().has_headers(false).flexible(true).trim(Trim::All).from_reader(text.as_bytes());
        let mut records = Vec::new();
        let mut lines = Lines { text: text.as_bytes(), offset: 0, line: 1 };
        for record in reader.records() {
            let record = record.map_err(|error| Error::format(file, error.to_string()))?;
            if records.len() > MOST_ROWS {
                return Err(Error::format(file, format!("has more than {MOST_ROWS} rows")));
            }
            let offset = record.position().map_or(0, |position| position.byte() as usize);
            records.push((lines.line_at(offset), record));
        }
        if records.is_empty() {
            let expected = columns.required.join(",");
            return Err(Error::format(file, format!("is empty, expected a header row with {expected}")));
        }
        let header = records.remove(0).1.iter().map(str::to_owned).collect();
        let table = Self { file: file.to_path_buf(), header, records };
        table.check_header(columns)?;
        Ok(table)
    }

    fn check_header(&self, columns: &Columns) -> Result<()> {
        let known = || columns.required.iter().chain(columns.optional);
        for (index, name) in self.header.iter().enumerate() {
            if !known().any(|known| known == name) {
                let expected: Vec<_> = known().copied().collect();
                let reason = format!("is no column of this table, expected {}", expected.join(","));
                return Err(self.error(1, index, name, reason));
            }
            if self.header[..index].contains(name) {
                return Err(self.error(1, index, name, "is given twice"));
            }
        }
        match columns.required.iter().find(|name| !self.header.iter().any(|found| found == *name)) {
            Some(missing) => Err(self.error(1, self.header.len(), missing, "is missing in the header row")),
            None => Ok(()),
        }
    }

    /// All rows, each read by `read`, with their places.
    pub fn placed<T>(self, read: impl Fn(&Row) -> Result<T>) -> Result<PlacedRows<T>> {
        let rows = self.rows().map(|row| read(&row)).collect::<Result<Vec<T>>>()?;
        let lines = self.records.iter().map(|(line, _)| *line).collect();
        Ok(PlacedRows { rows, file: self.file, header: self.header, lines })
    }

    pub fn rows(&self) -> impl Iterator<Item = Row<'_>> {
        self.records.iter().map(|(line, record)| Row { table: self, line: *line, record })
    }

    /// Refuses a second row with the same name in a column.
    pub fn require_unique(&self, column: &str) -> Result<()> {
        let mut names = std::collections::BTreeMap::new();
        for row in self.rows() {
            if let Some(first) = names.insert(row.text(column)?, row.line) {
                return Err(row.error(column, format!("is given twice, first in line {first}")));
            }
        }
        Ok(())
    }

    fn error(&self, line: usize, index: usize, name: &str, reason: impl Into<String>) -> Error {
        let file = self.file.clone();
        Error::Text { file, line, column: index + 1, field: name.to_owned(), reason: reason.into() }
    }
}

/// The rows of a table with their places, so that a fault found later can still be named by file, line and column.
#[derive(Debug, Clone, PartialEq)]
pub struct PlacedRows<T> {
    /// The rows in the order of the file.
    pub rows: Vec<T>,
    file: PathBuf,
    header: Vec<String>,
    lines: Vec<usize>,
}

impl<T> PlacedRows<T> {
    /// No rows of a file that is not there.
    pub fn none(file: impl Into<PathBuf>) -> Self {
        Self { rows: Vec::new(), file: file.into(), header: Vec::new(), lines: Vec::new() }
    }

    /// The file.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// Line of a row, from 1; 0 where there is no such row.
    pub fn line(&self, row: usize) -> usize {
        self.lines.get(row).copied().unwrap_or(0)
    }

    /// What is wrong with a column of a row.
    pub fn error(&self, row: usize, column: &str, reason: impl Into<String>) -> Error {
        let index = self.header.iter().position(|name| name == column).unwrap_or(0);
        Error::Text {
            file: self.file.clone(),
            line: self.line(row),
            column: index + 1,
            field: column.to_owned(),
            reason: reason.into(),
        }
    }
}

/// Counts lines up to ever later places of a text.
struct Lines<'a> {
    text: &'a [u8],
    offset: usize,
    line: usize,
}

impl Lines<'_> {
    /// Line of the row that begins at or, behind empty lines, after an offset in bytes.
    fn line_at(&mut self, offset: usize) -> usize {
        while let Some(byte) = self.text.get(self.offset) {
            if self.offset >= offset && !matches!(byte, b'\n' | b'\r') {
                break;
            }
            self.line += usize::from(*byte == b'\n');
            self.offset += 1;
        }
        self.line
    }
}

/// One row behind the header.
pub(super) struct Row<'a> {
    table: &'a Table,
    line: usize,
    record: &'a StringRecord,
}

impl<'a> Row<'a> {
    pub fn error(&self, column: &str, reason: impl Into<String>) -> Error {
        let index = self.table.header.iter().position(|name| name == column).unwrap_or(0);
        self.table.error(self.line, index, column, reason)
    }

    /// The field of a column, empty where the table has no such column; a row too short or too long is an error.
    fn field(&self, column: &str) -> Result<&'a str> {
        let (found, expected) = (self.record.len(), self.table.header.len());
        if found != expected {
            let index = found.min(expected);
            let reason = format!("the row has {found} fields, expected {expected}");
            return Err(self.table.error(self.line, index, "", reason));
        }
        let index = self.table.header.iter().position(|name| name == column);
        Ok(index.and_then(|index| self.record.get(index)).unwrap_or(""))
    }

    /// A name, which must not be empty and goes into other tables, reports and onto terminals.
    pub fn text(&self, column: &str) -> Result<String> {
        match self.field(column)? {
            "" => Err(self.error(column, "is empty, expected a name")),
            text if text.contains(char::is_control) => {
                Err(self.error(column, format!("is {text:?}, expected a name without control characters")))
            }
            text => Ok(text.to_owned()),
        }
    }

    /// Words, `None` where the field is empty.
    pub fn words(&self, column: &str) -> Result<Option<String>> {
        Ok(Some(self.field(column)?).filter(|text| !text.is_empty()).map(str::to_owned))
    }

    /// A finite number, `None` where the field is empty.
    pub fn number(&self, column: &str) -> Result<Option<f64>> {
        let text = self.field(column)?;
        if text.is_empty() {
            return Ok(None);
        }
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(Some(value)),
            _ => Err(self.error(column, format!("is `{text}`, expected a finite number"))),
        }
    }

    /// A finite number that must be there.
    pub fn needed(&self, column: &str) -> Result<f64> {
        self.number(column)?.ok_or_else(|| self.error(column, "is empty, expected a number"))
    }

    /// A positive number, `None` where the field is empty.
    pub fn positive(&self, column: &str) -> Result<Option<f64>> {
        match self.number(column)? {
            Some(value) if value <= 0.0 => Err(self.error(column, format!("is {value}, expected a positive number"))),
            value => Ok(value),
        }
    }

    /// Numbers of which all must be there.
    pub fn all<const N: usize>(&self, columns: [&str; N]) -> Result<[f64; N]> {
        let mut values = [0.0; N];
        for (value, column) in values.iter_mut().zip(columns) {
            *value = self.needed(column)?;
        }
        Ok(values)
    }

    /// Numbers of which all or none must be there, as `read` reads them.
    pub fn all_or_none<const N: usize>(
        &self,
        columns: [&str; N],
        read: fn(&Self, &str) -> Result<Option<f64>>,
    ) -> Result<Option<[f64; N]>> {
        let mut values = [0.0; N];
        let mut empty = None;
        for (value, column) in values.iter_mut().zip(columns) {
            match read(self, column)? {
                Some(number) => *value = number,
                None => empty = empty.or(Some(column)),
            }
        }
        match empty {
            None => Ok(Some(values)),
            Some(_) if columns.iter().all(|column| matches!(self.field(column), Ok(""))) => Ok(None),
            Some(column) => {
                Err(self.error(column, format!("is empty, expected all or none of {}", columns.join(", "))))
            }
        }
    }
}

/// Writes a table: the header, then rows of fields.
pub(super) fn write(path: &Path, header: &[&str], rows: impl Iterator<Item = Vec<String>>) -> Result<()> {
    // In memory first, so that what the system says against the file is not behind what csv makes of it.
    let mut writer = csv::Writer::from_writer(Vec::new());
    let failed = |error: csv::Error| Error::format(path, format!("cannot be written: {error}"));
    writer.write_record(header).map_err(failed)?;
    for row in rows {
        writer.write_record(row).map_err(failed)?;
    }
    let text = writer.into_inner().map_err(|error| Error::format(path, format!("cannot be written: {error}")))?;
    let mut file = FileWriter::create(path)?;
    file.write_all(&text).map_err(Error::io(path, "write"))?;
    Ok(file.commit()?)
}

/// The shortest text that reads back as the same number; nothing for nothing.
pub(super) fn text(value: Option<f64>) -> String {
    value.map_or_else(String::new, |value| value.to_string())
}

/// The same for several numbers.
pub(super) fn texts<const N: usize>(values: Option<[f64; N]>) -> [String; N] {
    std::array::from_fn(|index| text(values.map(|values| values[index])))
}
