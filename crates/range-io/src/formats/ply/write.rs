use std::fmt::Write as _;
use std::io::{Seek, SeekFrom, Write};
use std::path::Path;

use super::{CloudFile, Precision};
use crate::formats::cloud_file::{Kind, properties, put_point, value_error};
use crate::pose::numbers_of;
use crate::{Error, Result};
use atomic_output::FileWriter;

/// Points that are turned into bytes at a time.
const BLOCK: usize = 1 << 12;

/// Writer of a cloud that grows block by block.
///
/// The first block decides which attributes the file has; how points lie (columns and rows, pose) is not kept, as blocks
/// make one list. The number of points is put into the header at the end.
pub struct PlyWriter {
    writer: FileWriter,
    precision: Precision,
    attributes: Vec<&'static str>,
    points: u64,
    /// Lines of the header that say how the points lie.
    remarks: String,
    bytes: Vec<u8>,
}

/// Writes a cloud as a whole, with its columns and rows and its pose.
pub fn write_cloud(path: impl AsRef<Path>, cloud: &CloudFile, precision: Precision) -> Result<()> {
    cloud.check_size()?;
    let mut writer = PlyWriter::create(path, precision)?;
    writer.remarks = remarks(cloud)?;
    writer.append(cloud)?;
    writer.commit()
}

fn remarks(cloud: &CloudFile) -> Result<String> {
    let mut text = String::new();
    if let Some([width, height]) = cloud.size {
        // Writing to a string can't fail.
        let _ = writeln!(text, "obj_info num_cols {width}\nobj_info num_rows {height}");
    }
    if let Some(pose) = &cloud.world_from_cloud {
        let numbers = numbers_of(pose).ok_or_else(|| value_error("world_from_cloud", "is not finite".into()))?;
        let _ = writeln!(text, "obj_info world_from_cloud {}", numbers.map(|number| number.to_string()).join(" "));
    }
    Ok(text)
}

impl PlyWriter {
    /// Begins a file that appears under its name at [`PlyWriter::commit`].
    pub fn create(path: impl AsRef<Path>, precision: Precision) -> Result<Self> {
        let writer = FileWriter::create(path)?;
        Ok(Self { writer, precision, attributes: Vec::new(), points: 0, remarks: String::new(), bytes: Vec::new() })
    }

    /// Adds points; they must have the attributes of those before.
    pub fn append(&mut self, cloud: &CloudFile) -> Result<()> {
        let attributes = cloud.attributes();
        let names: Vec<_> = attributes.iter().map(|(name, _)| *name).collect();
        cloud.check_lengths()?;
        if self.points == 0 {
            self.attributes = names;
            // An empty block before this one has left a header of its own.
            self.writer.seek(SeekFrom::Start(0)).map_err(Error::io(self.writer.path(), "write"))?;
            self.write_header()?;
        } else if self.attributes != names {
            let reason = format!("are {names:?}, expected {:?} as in the blocks before", self.attributes);
            return Err(value_error("attributes", reason));
        }
        for start in (0..cloud.len()).step_by(BLOCK) {
            self.bytes.clear();
            for index in start..cloud.len().min(start + BLOCK) {
                put_point(&mut self.bytes, cloud, index, self.precision);
            }
            self.writer.write_all(&self.bytes).map_err(Error::io(self.writer.path(), "write"))?;
        }
        self.points += cloud.len() as u64;
        Ok(())
    }

    /// Completes the header and gives the file its name.
    pub fn commit(mut self) -> Result<()> {
        self.writer.seek(SeekFrom::Start(0)).map_err(Error::io(self.writer.path(), "write"))?;
        self.write_header()?;
        Ok(self.writer.commit()?)
    }

    /// A header whose length does not depend on the number of points: a comment takes up what the number leaves.
    fn write_header(&mut self) -> Result<()> {
        let count = self.points.to_string();
        let filling = "-".repeat(20_usize.saturating_sub(count.len()));
        let start = format!("ply\nformat binary_little_endian 1.0\ncomment metres {filling}\n");
        let properties: Vec<_> = properties(&self.attributes, self.precision)
            .iter()
            .map(|(kind, name)| format!("property {} {name}\n", type_name(*kind)))
            .collect();
        let element = format!("element vertex {count}\n");
        let text = start + &self.remarks + &element + &properties.concat() + "end_header\n";
        self.writer.write_all(text.as_bytes()).map_err(Error::io(self.writer.path(), "write"))
    }
}

fn type_name(kind: Kind) -> &'static str {
    match kind {
        Kind::U8 => "uchar",
        Kind::F32 => "float",
        Kind::F64 => "double",
        Kind::U16 => "ushort",
        Kind::U32 => "uint",
    }
}
