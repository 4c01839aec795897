use std::io::BufRead;

use nalgebra::Isometry3;

use crate::pose::pose_of;
use crate::text::fault::Fault;
use crate::text::limits::{LONGEST_POINT, MOST_HEADER_LINES};
use crate::text::lines::read_line;

/// How the numbers of a file are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    Binary,
    Compressed,
}

/// One field of a point.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Field {
    pub name: String,
    /// `I`, `U` or `F`.
    pub kind: char,
    /// Bytes of one value.
    pub size: usize,
    /// Values of a point.
    pub count: usize,
}

/// What stands above the points.
#[derive(Debug)]
pub(super) struct Header {
    pub fields: Vec<Field>,
    pub width: usize,
    pub height: usize,
    pub points: usize,
    pub viewpoint: Option<Isometry3<f64>>,
    pub encoding: Encoding,
}

impl Header {
    /// Reads up to the line `DATA`; the error says what was expected.
    pub fn read(reader: &mut impl BufRead) -> Result<Self, Fault> {
        let mut bytes = Vec::new();
        let mut lines: Vec<(String, Vec<String>)> = Vec::new();
        for _ in 0..MOST_HEADER_LINES {
            let line = read_line(reader, &mut bytes)?.filter(|line| line.ends_with('\n'));
            let line = line.ok_or("ends within its header")?;
            let mut words = line.split_whitespace().map(str::to_owned);
            let Some(key) = words.next().filter(|key| !key.starts_with('#')) else { continue };
            let last = key == "DATA";
            if lines.iter().any(|(earlier, _)| *earlier == key) {
                return Err(format!("has the line `{key}` twice in its header").into());
            }
            lines.push((key, words.collect()));
            if last {
                return Ok(Self::of_lines(&Lines(lines))?);
            }
        }
        Err(format!("has no line `DATA` among its first {MOST_HEADER_LINES}").into())
    }

    fn of_lines(lines: &Lines) -> Result<Self, String> {
        let version = lines.words("VERSION")?;
        if !matches!(version, [version] if matches!(version.as_str(), "0.7" | ".7")) {
            return Err(format!("has the version `{}`, expected 0.7", version.join(" ")));
        }
        let fields = fields(lines)?;
        let [width, height] = [lines.number("WIDTH")?, lines.number("HEIGHT")?];
        let area = width.checked_mul(height).ok_or_else(|| format!("has {width} x {height} points, too many"))?;
        let points = if lines.get("POINTS").is_some() { lines.number("POINTS")? } else { area };
        if points != area {
            return Err(format!("says `POINTS` {points}, expected `WIDTH` x `HEIGHT` = {area}"));
        }
        let encoding = match lines.words("DATA")? {
            [word] if word == "ascii" => Encoding::Ascii,
            [word] if word == "binary" => Encoding::Binary,
            [word] if word == "binary_compressed" => Encoding::Compressed,
            other => {
                return Err(format!("has `DATA {}`, expected ascii, binary or binary_compressed", other.join(" ")));
            }
        };
        Ok(Self { fields, width, height, points, viewpoint: viewpoint(lines)?, encoding })
    }

    /// Bytes of one point in a binary file.
    pub fn point_size(&self) -> usize {
        self.fields.iter().map(Field::bytes).sum()
    }
}

impl Field {
    pub fn bytes(&self) -> usize {
        self.size * self.count
    }
}

/// The header's lines: first word and the words behind it.
struct Lines(Vec<(String, Vec<String>)>);

impl Lines {
    fn get(&self, key: &str) -> Option<&[String]> {
        self.0.iter().find(|(found, _)| found == key).map(|(_, words)| words.as_slice())
    }

    fn words(&self, key: &str) -> Result<&[String], String> {
        self.get(key).ok_or_else(|| format!("has no line `{key}` in its header"))
    }

    fn number(&self, key: &str) -> Result<usize, String> {
        match self.words(key)? {
            [word] => word.parse().map_err(|_| format!("has `{key} {word}`, expected a number")),
            words => Err(format!("has `{key} {}`, expected one number", words.join(" "))),
        }
    }
}

fn fields(lines: &Lines) -> Result<Vec<Field>, String> {
    let names = lines.words("FIELDS")?;
    let of_each = |key: &str| -> Result<&[String], String> {
        let words = lines.words(key)?;
        let (found, expected) = (words.len(), names.len());
        if found == expected { Ok(words) } else { Err(format!("has {found} words in `{key}`, expected {expected}")) }
    };
    let (sizes, kinds) = (of_each("SIZE")?, of_each("TYPE")?);
    let counts = if lines.get("COUNT").is_some() { Some(of_each("COUNT")?) } else { None };
    let mut fields = Vec::with_capacity(names.len());
    let mut total = 0_usize;
    for (index, name) in names.iter().enumerate() {
        let (kind, size) = (kinds[index].as_str(), sizes[index].as_str());
        let (kind, size) = match (kind, size) {
            ("I" | "U", "1" | "2" | "4" | "8") | ("F", "4" | "8") => (kind, usize::from(size.as_bytes()[0] - b'0')),
            _ => return Err(format!("has field `{name}` of unknown type {kind} with size {size}")),
        };
        let count = counts.map_or("1", |counts| counts[index].as_str());
        let count: usize = count.parse().map_err(|_| format!("has `COUNT` {count} of `{name}`, expected a number"))?;
        total = count.saturating_mul(size).saturating_add(total);
        if total > LONGEST_POINT {
            return Err(format!("has points of more than {LONGEST_POINT} bytes"));
        }
        fields.push(Field { name: name.clone(), kind: kind.chars().next().unwrap_or('F'), size, count });
    }
    Ok(fields)
}

/// The pose; none for the one that says nothing.
fn viewpoint(lines: &Lines) -> Result<Option<Isometry3<f64>>, String> {
    let Some(words) = lines.get("VIEWPOINT") else { return Ok(None) };
    let numbers: Option<Vec<f64>> = words.iter().map(|word| word.parse().ok()).collect();
    // The quaternion stands w x y z.
    let pose = match numbers.as_deref() {
        Some(&[tx, ty, tz, qw, qx, qy, qz]) => pose_of(&[tx, ty, tz], &[qx, qy, qz, qw]),
        _ => None,
    };
    let pose = pose.ok_or_else(|| {
        format!("has `VIEWPOINT {}`, expected a position and a unit quaternion w x y z", words.join(" "))
    })?;
    Ok(Some(pose).filter(|pose| *pose != Isometry3::identity()))
}
