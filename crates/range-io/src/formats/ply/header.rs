use std::io::BufRead;

use nalgebra::Isometry3;

use crate::pose::pose_of;
use crate::text::fault::Fault;
use crate::text::limits::MOST_HEADER_LINES;
use crate::text::lines::read_line;

/// How the numbers of a file are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// Type of a property.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn from_name(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

/// The vertices of a file and what stands before them.
#[derive(Debug)]
pub(super) struct Header {
    pub encoding: Encoding,
    /// Number of vertices.
    pub vertices: u64,
    /// Name and type of each property of a vertex.
    pub properties: Vec<(String, Scalar)>,
    /// Elements before the vertices: their number and the bytes of one.
    pub before: Vec<(u64, usize)>,
    /// Columns and rows, where the header states them.
    pub size: Option<[usize; 2]>,
    /// Pose of the points, where the header states it.
    pub world_from_cloud: Option<Isometry3<f64>>,
}

/// What `obj_info` lines say of the points.
#[derive(Default)]
struct Remarks {
    columns: Option<usize>,
    rows: Option<usize>,
    pose: Option<Isometry3<f64>>,
}

impl Remarks {
    /// Takes what is known; a remark of other programs' is left alone.
    fn take(&mut self, words: &[&str]) -> Result<(), String> {
        match words {
            ["num_cols", count] => self.columns = count.parse().ok(),
            ["num_rows", count] => self.rows = count.parse().ok(),
            ["world_from_cloud", rest @ ..] => {
                let numbers: Option<Vec<f64>> = rest.iter().map(|word| word.parse().ok()).collect();
                let pose = numbers.and_then(|n| pose_of(n.get(..3)?, n.get(3..)?));
                self.pose =
                    Some(pose.ok_or("has `world_from_cloud`, expected tx ty tz and a unit quaternion x y z w")?);
            }
            _ => {}
        }
        Ok(())
    }
}

/// One `element` of a header.
struct Element {
    name: String,
    count: u64,
    properties: Vec<(String, Scalar)>,
    has_list: bool,
}

impl Header {
    /// Reads up to the line `end_header`; the error says what was expected.
    pub fn read(reader: &mut impl BufRead) -> Result<Self, Fault> {
        let mut bytes = Vec::new();
        let mut line = || -> Result<String, Fault> {
            let line = read_line(reader, &mut bytes)?.filter(|line| line.ends_with('\n'));
            Ok(line.ok_or("ends within its header")?.trim_end().to_owned())
        };
        if line()? != "ply" {
            return Err("does not begin with the line `ply`".into());
        }
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        let mut remarks = Remarks::default();
        for _ in 0..MOST_HEADER_LINES {
            let line = line()?;
            let words: Vec<_> = line.split_whitespace().collect();
            match words.as_slice() {
                ["end_header"] => {
                    let encoding = encoding.ok_or("says no `format` in its header")?;
                    return Ok(Self::of_elements(encoding, elements, &remarks)?);
                }
                ["format", format, "1.0"] => encoding = Some(encoding_of(format)?),
                ["element", name, count] => {
                    let count =
                        count.parse().map_err(|_| format!("has `{count}` of element `{name}`, expected a number"))?;
                    elements.push(Element { name: (*name).into(), count, properties: Vec::new(), has_list: false });
                }
                ["property", "list", ..] => {
                    elements.last_mut().ok_or("has a property before any element")?.has_list = true;
                }
                ["property", kind, name] => {
                    let scalar = Scalar::from_name(kind)
                        .ok_or_else(|| format!("has property `{name}` of unknown type `{kind}`"))?;
                    let element = elements.last_mut().ok_or("has a property before any element")?;
                    element.properties.push(((*name).into(), scalar));
                }
                ["obj_info", rest @ ..] => remarks.take(rest)?,
                [] | ["comment", ..] => {}
                _ => return Err(format!("has the line `{line}` in its header, which is not understood").into()),
            }
        }
        Err(format!("has no line `end_header` among its first {MOST_HEADER_LINES}").into())
    }

    fn of_elements(encoding: Encoding, mut elements: Vec<Element>, remarks: &Remarks) -> Result<Self, String> {
        let position = elements.iter().position(|element| element.name == "vertex");
        let position = position.ok_or("has no element `vertex`")?;
        // Lists have no fixed length, so what lies behind them can only be found by reading them all.
        if let Some(element) = elements[..=position].iter().find(|element| element.has_list) {
            return Err(format!("has lists in element `{}`, expected none before or in the vertices", element.name));
        }
        let size = |element: &Element| element.properties.iter().map(|(_, scalar)| scalar.size()).sum();
        let before = elements[..position].iter().map(|element| (element.count, size(element))).collect();
        let vertex = elements.swap_remove(position);
        Ok(Self {
            encoding,
            vertices: vertex.count,
            properties: vertex.properties,
            before,
            size: remarks.columns.zip(remarks.rows).map(|(columns, rows)| [columns, rows]),
            world_from_cloud: remarks.pose,
        })
    }

    /// Bytes of one vertex in a binary file.
    pub fn vertex_size(&self) -> usize {
        self.properties.iter().map(|(_, scalar)| scalar.size()).sum()
    }

    /// Bytes that the file holds at least behind its header; `None` where no file holds as many.
    pub fn least_length(&self) -> Option<u64> {
        let ascii = self.encoding == Encoding::Ascii;
        // A number in ASCII takes a digit and a blank or a line's end, a line its end.
        let vertex = if ascii { 2 * self.properties.len() } else { self.vertex_size() };
        let mut least = self.vertices.checked_mul(vertex.max(1) as u64)?;
        for &(count, size) in &self.before {
            least = least.checked_add(count.checked_mul(if ascii { 1 } else { size as u64 })?)?;
        }
        Some(least)
    }
}

fn encoding_of(name: &str) -> Result<Encoding, String> {
    match name {
        "ascii" => Ok(Encoding::Ascii),
        "binary_little_endian" => Ok(Encoding::LittleEndian),
        "binary_big_endian" => Ok(Encoding::BigEndian),
        other => Err(format!("has the format `{other}`, expected ascii, binary_little_endian or binary_big_endian")),
    }
}
