//! Point lists as text: one point a line, numbers separated by blanks, commas or semicolons.
//!
//! A first line of names says what the columns are, with or without `#` or `//` before it: `x y z`, normals, `intensity`
//! and so on, as in [`crate::formats::cloud_file::CloudFile`]; columns of other names are left alone. Without names three columns are
//! positions, and four or more are refused but where the ending says what they are (`.xyzn` normals, `.xyzi`
//! intensity). Other lines that begin with `#` or `//` are comments. Positions are metres, as nothing in such a file says.

use std::io::BufReader;
use std::path::Path;

use crate::formats::cloud_file::{CloudFile, Columns, canonical};
use crate::text::lines::read_line;
use crate::{Error, Result};

/// Reads a point list (`.xyz`, `.xyzn`, `.xyzi`, `.txt`, `.asc`, `.csv`).
pub fn read_xyz(path: impl AsRef<Path>) -> Result<CloudFile> {
    let path = path.as_ref();
    let (file, _) = crate::open(path)?;
    let mut list = List { path, names: Vec::new(), columns: None, points: 0 };
    let mut reader = BufReader::with_capacity(1 << 16, file);
    let mut bytes = Vec::new();
    for line in 1.. {
        let text = read_line(&mut reader, &mut bytes)
            .map_err(|fault| fault.with(path, |reason| Error::format(path, format!("{reason}: line {line}"))))?;
        let Some(text) = text else { break };
        list.line(line, text.trim_start_matches('\u{feff}').trim())?;
    }
    list.finish()
}

struct List<'a> {
    path: &'a Path,
    /// Names of the columns, known from the first line that is no comment.
    names: Vec<String>,
    columns: Option<Columns>,
    points: usize,
}

impl List<'_> {
    fn line(&mut self, line: usize, text: &str) -> Result<()> {
        let bare = text.trim_start_matches(['#', '/']).trim();
        let comment = bare.len() != text.len();
        let fields = split(bare);
        if self.columns.is_none() && names_points(&fields) {
            return self.begin(fields.iter().map(|name| canonical(name)).collect());
        }
        if text.is_empty() || comment {
            return Ok(());
        }
        if self.columns.is_none() {
            self.begin_without_names(line, fields.len())?;
        }
        if fields.len() != self.names.len() {
            let reason = format!("has {} fields, expected {} as in the lines before", fields.len(), self.names.len());
            return Err(self.error(line, fields.len().min(self.names.len()) + 1, "", reason));
        }
        for (index, field) in fields.iter().enumerate() {
            let Some(column) = self.columns.as_mut().and_then(|columns| columns.of_property(index)) else { continue };
            if let Ok(value) = field.parse() {
                column.push(value);
            } else {
                let name = self.names[index].clone();
                return Err(self.error(line, index + 1, &name, format!("is `{field}`, expected a number")));
            }
        }
        self.points += 1;
        Ok(())
    }

    fn begin(&mut self, names: Vec<String>) -> Result<()> {
        let columns = Columns::new(names.iter().map(String::as_str), 0);
        self.columns = Some(columns.map_err(|fault| fault.of(self.path))?);
        self.names = names;
        Ok(())
    }

    fn begin_without_names(&mut self, line: usize, fields: usize) -> Result<()> {
        let ending = self.path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        let names: &[&str] = match (fields, ending.as_deref()) {
            (3, _) => &["x", "y", "z"],
            (4, Some("xyzi")) => &["x", "y", "z", "intensity"],
            (6, Some("xyzn")) => &["x", "y", "z", "nx", "ny", "nz"],
            _ => {
                let reason =
                    format!("has {fields} fields without names, expected 3 or a first line such as `x y z nx ny nz`");
                return Err(self.error(line, 1, "", reason));
            }
        };
        self.begin(names.iter().map(|name| (*name).to_owned()).collect())
    }

    fn finish(self) -> Result<CloudFile> {
        let columns = self.columns.ok_or_else(|| Error::format(self.path, "has no point"))?;
        columns.into_cloud(self.points).map_err(|fault| fault.of(self.path))
    }

    fn error(&self, line: usize, column: usize, field: &str, reason: String) -> Error {
        Error::Text { file: self.path.to_path_buf(), line, column, field: field.to_owned(), reason }
    }
}

/// Fields between commas or semicolons where there are some, between blanks otherwise.
fn split(text: &str) -> Vec<&str> {
    match text.find([',', ';']) {
        Some(at) => text.split(&text[at..=at]).map(|field| field.trim().trim_matches('"')).collect(),
        None => text.split_whitespace().collect(),
    }
}

fn names_points(fields: &[&str]) -> bool {
    ["x", "y", "z"].iter().all(|axis| fields.iter().any(|field| field.eq_ignore_ascii_case(axis)))
}

/// Whether a line can be the first of a point list: names with `x y z`, or at least three numbers.
#[cfg(feature = "clouds")]
pub(crate) fn looks_like_points(text: &str) -> bool {
    let fields = split(text.trim().trim_start_matches(['#', '/']).trim());
    names_points(&fields) || (fields.len() >= 3 && fields.iter().all(|field| field.parse::<f64>().is_ok()))
}
