use std::path::Path;

use super::source::{Scalar, Source};
use crate::formats::cloud_file::{CloudFile, Columns};
use crate::text::fault::Fault;
use crate::text::limits::LONGEST_VTK;
use crate::{Error, Result};

/// Reads the points of a legacy VTK file.
pub fn read_vtk(path: impl AsRef<Path>) -> Result<CloudFile> {
    let path = path.as_ref();
    let bytes = crate::read_bytes(path, LONGEST_VTK)?;
    let mut source = Source::new(&bytes);
    read_from(&mut source).map_err(|fault| match fault {
        // Binary values have no lines.
        Fault::Content(reason) if !source.binary => {
            let read = &bytes[..bytes.len() - source.left()];
            let line = read.trim_ascii_end().split(|byte| *byte == b'\n').count();
            Error::format(path, format!("{reason} (line {line})"))
        }
        fault => fault.of(path),
    })
}

/// What is collected on the way through a file.
#[derive(Default)]
struct Parts {
    dimensions: Option<[usize; 3]>,
    points: Option<Vec<f64>>,
    /// Name and values of each attribute of the points.
    attributes: Vec<(String, Vec<f64>)>,
    /// Whether attributes now belong to the points, and how many values they have.
    tuples: Option<usize>,
    of_cells: bool,
}

fn read_from(source: &mut Source<'_>) -> std::result::Result<CloudFile, Fault> {
    if !source.line()?.is_some_and(|line| line.starts_with("# vtk DataFile Version")) {
        return Err("does not begin with the line `# vtk DataFile Version`".into());
    }
    source.line()?.ok_or("ends behind its first line")?;
    let kind = source.line()?.unwrap_or_default();
    source.binary = match &*kind {
        "ASCII" => false,
        "BINARY" => true,
        other => return Err(format!("has `{other}` in its third line, expected ASCII or BINARY").into()),
    };
    let mut parts = Parts::default();
    while let Some(line) = source.keyword_line()? {
        let words: Vec<&str> = line.split_whitespace().collect();
        section(&words, &line, source, &mut parts)?;
    }
    parts.into_cloud()
}

fn section(words: &[&str], line: &str, source: &mut Source<'_>, parts: &mut Parts) -> std::result::Result<(), Fault> {
    let keyword = words.first().map(|word| word.to_ascii_uppercase()).unwrap_or_default();
    match (keyword.as_str(), &words[1..]) {
        ("DATASET", [kind]) => match kind.to_ascii_uppercase().as_str() {
            "POLYDATA" | "UNSTRUCTURED_GRID" | "STRUCTURED_GRID" => {}
            other => {
                return Err(format!("is a data set `{other}`, expected points (POLYDATA, UNSTRUCTURED_GRID)").into());
            }
        },
        ("DIMENSIONS", [x, y, z]) => parts.dimensions = Some([number(x)?, number(y)?, number(z)?]),
        ("POINTS", [count, kind]) => {
            let values = number(count)?.checked_mul(3).ok_or("has too many points")?;
            parts.points = Some(source.values(values, kind.parse()?, "POINTS")?);
        }
        ("VERTICES" | "LINES" | "POLYGONS" | "TRIANGLE_STRIPS" | "CELLS", [cells, size]) => {
            skip_cells(source, number(cells)?, number(size)?, &keyword)?;
        }
        ("CELL_TYPES", [count]) => source.skip(number(count)?, Scalar::I32, &keyword)?,
        ("POINT_DATA", [count]) => (parts.tuples, parts.of_cells) = (Some(number(count)?), false),
        ("CELL_DATA", [count]) => (parts.tuples, parts.of_cells) = (Some(number(count)?), true),
        ("METADATA", _) => while source.line()?.is_some_and(|line| !line.is_empty()) {},
        ("LOOKUP_TABLE", [_, size]) => {
            // In a binary file a table's colours are bytes.
            source.skip(number(size)?.saturating_mul(4), Scalar::U8, "LOOKUP_TABLE")?;
        }
        _ => return attribute(&keyword, words, line, source, parts),
    }
    Ok(())
}

/// Sections with values of points or cells.
fn attribute(
    keyword: &str,
    words: &[&str],
    line: &str,
    source: &mut Source<'_>,
    parts: &mut Parts,
) -> std::result::Result<(), Fault> {
    if let ("FIELD", [_, arrays]) = (keyword, &words[1..]) {
        for _ in 0..number(arrays)? {
            let line = source.keyword_line()?.ok_or("ends within its FIELD")?;
            let words: Vec<&str> = line.split_whitespace().collect();
            let [name, components, tuples, kind] = words[..] else {
                let expected = "expected name, components, tuples, type";
                return Err(format!("has the line `{line}` in its FIELD, {expected}").into());
            };
            let (components, tuples) = (number(components)?, number(tuples)?);
            let count = components.checked_mul(tuples).ok_or("has a FIELD of too many values")?;
            let values = source.values(count, kind.parse()?, name)?;
            parts.keep(name, components, values);
        }
        return Ok(());
    }
    let Some(tuples) = parts.tuples else {
        return Err(not_understood(line));
    };
    let (name, components, kind) = match (keyword, &words[1..]) {
        ("NORMALS", [_, kind]) => ("normals", 3, *kind),
        ("VECTORS", [name, kind]) => (*name, 3, *kind),
        ("SCALARS", [name, kind]) => (*name, 1, *kind),
        ("COLOR_SCALARS", [name, components]) => {
            (*name, number(components)?, if source.binary { "unsigned_char" } else { "float" })
        }
        ("TENSORS", [name, kind]) => (*name, 9, *kind),
        ("SCALARS", [name, kind, components]) | ("TEXTURE_COORDINATES", [name, components, kind]) => {
            (*name, number(components)?, *kind)
        }
        _ => return Err(not_understood(line)),
    };
    if keyword == "SCALARS" {
        let table = source.keyword_line()?.unwrap_or_default();
        if !table.to_ascii_uppercase().starts_with("LOOKUP_TABLE") {
            return Err(format!("has the line `{table}` behind SCALARS, expected LOOKUP_TABLE").into());
        }
    }
    let count = components.checked_mul(tuples).ok_or("has too many values")?;
    let values = source.values(count, kind.parse()?, name)?;
    parts.keep(name, components, values);
    Ok(())
}

/// Cells as lists of numbers, or from version 5 on as two arrays.
fn skip_cells(source: &mut Source<'_>, cells: usize, size: usize, keyword: &str) -> std::result::Result<(), Fault> {
    // Where the numbers follow at once, they may all stand in one long line.
    let ahead = source.line_ahead().ok().flatten().unwrap_or_default();
    let ahead: Vec<&str> = ahead.split_whitespace().collect();
    let &["OFFSETS", kind] = ahead.as_slice() else {
        return source.skip(size, Scalar::I32, keyword);
    };
    source.keyword_line()?;
    source.skip(cells, kind.parse()?, "OFFSETS")?;
    let line = source.keyword_line()?.unwrap_or_default();
    let line: Vec<&str> = line.split_whitespace().collect();
    match line.as_slice() {
        ["CONNECTIVITY", kind] => source.skip(size, kind.parse()?, "CONNECTIVITY"),
        _ => Err(format!("has no CONNECTIVITY behind the OFFSETS of {keyword}").into()),
    }
}

fn not_understood(line: &str) -> Fault {
    format!("has the line `{line}`, which is not understood").into()
}

fn number(word: &str) -> std::result::Result<usize, String> {
    word.parse().map_err(|_| format!("has `{word}`, expected a number"))
}

impl Parts {
    /// Keeps an attribute of the points: one column a component.
    fn keep(&mut self, name: &str, components: usize, values: Vec<f64>) {
        if self.of_cells || self.tuples.is_none() {
            return;
        }
        if components == 1 {
            self.attributes.push((name.to_owned(), values));
        } else if components == 3 && name.eq_ignore_ascii_case("normals") {
            for (axis, name) in ["nx", "ny", "nz"].into_iter().enumerate() {
                self.attributes.push((name.to_owned(), values.iter().skip(axis).step_by(3).copied().collect()));
            }
        }
    }

    fn into_cloud(self) -> std::result::Result<CloudFile, Fault> {
        let points = self.points.ok_or("has no section POINTS")?;
        let count = points.len() / 3;
        let axes = ["x", "y", "z"].into_iter().enumerate();
        let axes = axes.map(|(axis, name)| (name.to_owned(), points.iter().skip(axis).step_by(3).copied().collect()));
        let all: Vec<(String, Vec<f64>)> = axes.chain(self.attributes).collect();
        let mut columns = Columns::new(all.iter().map(|(name, _)| name.as_str()), 0)?;
        for (index, (_, values)) in all.into_iter().enumerate() {
            if let Some(column) = columns.of_property(index) {
                *column = values;
            }
        }
        let mut cloud = columns.into_cloud(count)?;
        cloud.size = match self.dimensions {
            Some([width, height, 1]) if height > 1 && width.checked_mul(height) == Some(count) => Some([width, height]),
            _ => None,
        };
        Ok(cloud)
    }
}
