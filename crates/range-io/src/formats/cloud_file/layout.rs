//! How a point is laid out in the binary files that are written: the same bytes in PLY and PCD.

use super::file::{COVARIANCE, CloudFile, NORMAL, POSITION, Precision};

/// Type of a property that is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    U8,
    F32,
    F64,
    U16,
    U32,
}

/// Type and name of each property of a point with these attributes.
pub(crate) fn properties(attributes: &[&'static str], precision: Precision) -> Vec<(Kind, &'static str)> {
    let position = match precision {
        Precision::Single => Kind::F32,
        Precision::Double => Kind::F64,
    };
    let attributes = attributes.iter().flat_map(|attribute| match *attribute {
        "normals" => NORMAL.map(|name| (Kind::F32, name)).to_vec(),
        "covariance" => COVARIANCE.map(|name| (Kind::F32, name)).to_vec(),
        "colours" => ["red", "green", "blue"].map(|name| (Kind::U8, name)).to_vec(),
        "flags" => vec![(Kind::U16, "flags")],
        "frame" => vec![(Kind::U32, "frame")],
        other => vec![(Kind::F32, other)],
    });
    POSITION.into_iter().map(|name| (position, name)).chain(attributes).collect()
}

/// Appends the values of a point, little-endian, in the order of [`CloudFile::attributes`].
pub(crate) fn put_point(bytes: &mut Vec<u8>, cloud: &CloudFile, index: usize, precision: Precision) {
    for value in cloud.points[index] {
        match precision {
            Precision::Single => bytes.extend_from_slice(&(value as f32).to_le_bytes()),
            Precision::Double => bytes.extend_from_slice(&value.to_le_bytes()),
        }
    }
    let mut put = |value: f32| bytes.extend_from_slice(&value.to_le_bytes());
    cloud.normals.iter().for_each(|normals| normals[index].into_iter().for_each(&mut put));
    cloud.intensity.iter().for_each(|values| put(values[index]));
    cloud.sigma.iter().for_each(|values| put(values[index]));
    cloud.sigma_own.iter().for_each(|values| put(values[index]));
    cloud.flags.iter().for_each(|values| bytes.extend_from_slice(&values[index].to_le_bytes()));
    cloud.frame.iter().for_each(|values| bytes.extend_from_slice(&values[index].to_le_bytes()));
    let mut put = |value: f32| bytes.extend_from_slice(&value.to_le_bytes());
    cloud.covariance.iter().for_each(|terms| terms[index].into_iter().for_each(&mut put));
    cloud.colours.iter().for_each(|colours| bytes.extend_from_slice(&colours[index]));
}
