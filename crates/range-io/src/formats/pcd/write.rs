use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;

use nalgebra::Isometry3;

use crate::formats::cloud_file::{CloudFile, Kind, Precision, properties, put_point, value_error};
use crate::pose::numbers_of;
use crate::{Error, Result};
use atomic_output::FileWriter;

/// Points that are turned into bytes at a time.
const BLOCK: usize = 1 << 12;

/// Writes a cloud as binary PCD 0.7.
///
/// PCL's own point types have single positions; Open3D and others read both.
pub fn write_pcd(path: impl AsRef<Path>, cloud: &CloudFile, precision: Precision) -> Result<()> {
    cloud.check_lengths()?;
    cloud.check_size()?;
    let header = header(cloud, precision)?;
    let mut writer = FileWriter::create(path)?;
    let target = writer.path().to_path_buf();
    writer.write_all(header.as_bytes()).map_err(Error::io(&target, "write"))?;
    let mut bytes = Vec::new();
    for start in (0..cloud.len()).step_by(BLOCK) {
        bytes.clear();
        for index in start..cloud.len().min(start + BLOCK) {
            put_point(&mut bytes, cloud, index, precision);
        }
        writer.write_all(&bytes).map_err(Error::io(&target, "write"))?;
    }
    Ok(writer.commit()?)
}

fn header(cloud: &CloudFile, precision: Precision) -> Result<String> {
    let attributes: Vec<_> = cloud.attributes().iter().map(|(name, _)| *name).collect();
    let fields = properties(&attributes, precision);
    let line = |word: fn(&(Kind, &'static str)) -> &'static str| fields.iter().map(word).collect::<Vec<_>>().join(" ");
    let [width, height] = cloud.size.unwrap_or([cloud.len(), 1]);
    let pose = cloud.world_from_cloud.unwrap_or_else(Isometry3::identity);
    let [tx, ty, tz, qx, qy, qz, qw] =
        numbers_of(&pose).ok_or_else(|| value_error("world_from_cloud", "is not finite".into()))?;
    let mut text = String::from("# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n");
    // Writing to a string can't fail.
    let _ = writeln!(text, "FIELDS {}", line(|(_, name)| field_name(name)));
    let _ = writeln!(text, "SIZE {}", line(|(kind, _)| size_and_type(*kind)[0]));
    let _ = writeln!(text, "TYPE {}", line(|(kind, _)| size_and_type(*kind)[1]));
    let _ = writeln!(text, "COUNT {}", line(|_| "1"));
    let _ = writeln!(text, "WIDTH {width}\nHEIGHT {height}\nVIEWPOINT {tx} {ty} {tz} {qw} {qx} {qy} {qz}");
    let _ = writeln!(text, "POINTS {}\nDATA binary", cloud.len());
    Ok(text)
}

/// Names that other programs expect.
fn field_name(name: &'static str) -> &'static str {
    match name {
        "nx" => "normal_x",
        "ny" => "normal_y",
        "nz" => "normal_z",
        other => other,
    }
}

fn size_and_type(kind: Kind) -> [&'static str; 2] {
    match kind {
        Kind::U8 => ["1", "U"],
        Kind::F32 => ["4", "F"],
        Kind::F64 => ["8", "F"],
        Kind::U16 => ["2", "U"],
        Kind::U32 => ["4", "U"],
    }
}
