use std::io::{Seek, SeekFrom, Write};
use std::path::Path;

use super::{COVARIANCE, CloudFile, NORMAL, POSITION};
use crate::atomic::FileWriter;
use crate::{Error, Result};

/// Type that positions are written in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Precision {
    /// `float`: right to 0.1 micrometre at 1 m, to 8 micrometres at 100 m.
    #[default]
    Single,
    /// `double`: all digits.
    Double,
}

/// Points that are turned into bytes at a time.
const BLOCK: usize = 1 << 12;

/// Writer of a cloud that grows block by block.
///
/// The first block decides which attributes the file has. The number of points is put into the header at the end.
pub struct PlyWriter {
    writer: FileWriter,
    precision: Precision,
    attributes: Vec<&'static str>,
    points: u64,
    bytes: Vec<u8>,
}

/// Writes a cloud as a whole.
pub fn write_cloud(path: impl AsRef<Path>, cloud: &CloudFile, precision: Precision) -> Result<()> {
    let mut writer = PlyWriter::create(path, precision)?;
    writer.append(cloud)?;
    writer.commit()
}

impl PlyWriter {
    /// Begins a file that appears under its name at [`PlyWriter::commit`].
    pub fn create(path: impl AsRef<Path>, precision: Precision) -> Result<Self> {
        let writer = FileWriter::create(path)?;
        Ok(Self { writer, precision, attributes: Vec::new(), points: 0, bytes: Vec::new() })
    }

    /// Adds points; they must have the attributes of those before.
    pub fn append(&mut self, cloud: &CloudFile) -> Result<()> {
        let attributes = cloud.attributes();
        let names: Vec<_> = attributes.iter().map(|(name, _)| *name).collect();
        if let Some((name, length)) = attributes.iter().find(|(_, length)| *length != cloud.len()) {
            return Err(value_error(name, format!("has {length} values for {} points", cloud.len())));
        }
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
                self.put_point(cloud, index);
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
        self.writer.commit()
    }

    /// A header whose length does not depend on the number of points: a comment takes up what the number leaves.
    fn write_header(&mut self) -> Result<()> {
        let count = self.points.to_string();
        let filling = "-".repeat(20_usize.saturating_sub(count.len()));
        let start = format!("ply\nformat binary_little_endian 1.0\ncomment metres {filling}\nelement vertex {count}\n");
        let properties: Vec<_> = self.properties().map(|(kind, name)| format!("property {kind} {name}\n")).collect();
        let text = start + &properties.concat() + "end_header\n";
        self.writer.write_all(text.as_bytes()).map_err(Error::io(self.writer.path(), "write"))
    }

    /// Type and name of each property of a vertex.
    fn properties(&self) -> impl Iterator<Item = (&'static str, &'static str)> {
        let position = match self.precision {
            Precision::Single => "float",
            Precision::Double => "double",
        };
        let attributes = self.attributes.iter().flat_map(|attribute| match *attribute {
            "normals" => NORMAL.map(|name| ("float", name)).to_vec(),
            "covariance" => COVARIANCE.map(|name| ("float", name)).to_vec(),
            "flags" => vec![("ushort", "flags")],
            "frame" => vec![("uint", "frame")],
            other => vec![("float", other)],
        });
        POSITION.into_iter().map(move |name| (position, name)).chain(attributes)
    }

    /// The values in the order of [`CloudFile::attributes`].
    fn put_point(&mut self, cloud: &CloudFile, index: usize) {
        let bytes = &mut self.bytes;
        for value in cloud.points[index] {
            match self.precision {
                Precision::Single => bytes.extend_from_slice(&(value as f32).to_le_bytes()),
                Precision::Double => bytes.extend_from_slice(&value.to_le_bytes()),
            }
        }
        let mut put = |value: f32| bytes.extend_from_slice(&value.to_le_bytes());
        cloud.normals.iter().for_each(|normals| normals[index].into_iter().for_each(&mut put));
        cloud.intensity.iter().for_each(|values| put(values[index]));
        cloud.sigma.iter().for_each(|values| put(values[index]));
        cloud.flags.iter().for_each(|values| bytes.extend_from_slice(&values[index].to_le_bytes()));
        cloud.frame.iter().for_each(|values| bytes.extend_from_slice(&values[index].to_le_bytes()));
        let mut put = |value: f32| bytes.extend_from_slice(&value.to_le_bytes());
        cloud.covariance.iter().for_each(|terms| terms[index].into_iter().for_each(&mut put));
    }
}

fn value_error(field: &str, reason: String) -> Error {
    Error::Value { what: "cloud", field: field.to_owned(), reason }
}
