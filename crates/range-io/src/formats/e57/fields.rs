//! Names of the values that E57 itself does not know.

use ::e57::RecordName;

/// Extension for surface normals.
pub(super) const NORMALS: [&str; 2] = ["nor", "http://www.libe57.org/E57_NOR_surface_normals.txt"];
/// Name space of what a range camera knows besides.
pub(super) const OWN: [&str; 2] = ["rangecam", "https://docs.rs/range-io"];

pub(super) const NORMAL: [&str; 3] = ["normalX", "normalY", "normalZ"];

pub(super) fn normal(axis: usize) -> RecordName {
    RecordName::Unknown { namespace: NORMALS[0].to_owned(), name: NORMAL[axis].to_owned() }
}

pub(super) fn own(name: &str) -> RecordName {
    RecordName::Unknown { namespace: OWN[0].to_owned(), name: name.to_owned() }
}
