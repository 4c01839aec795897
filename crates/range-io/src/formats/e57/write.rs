use std::path::Path;

use ::e57::{
    E57Writer, Extension, IntensityLimits, PointCloudWriter, Quaternion, RawValues, Record, RecordDataType, RecordName,
    RecordValue, Transform, Translation,
};

use super::{E57Scan, fields};
use crate::formats::cloud_file::{COVARIANCE, CloudFile, Precision, value_error};
use crate::pose::numbers_of;
use crate::{Error, Result};
use atomic_output::FileWriter;

/// Writes scans, each with its name and pose.
pub fn write_e57(path: impl AsRef<Path>, scans: &[E57Scan], precision: Precision) -> Result<()> {
    let path = path.as_ref();
    for scan in scans {
        scan.cloud.check_lengths()?;
        scan.cloud.check_size()?;
    }
    let mut file = FileWriter::create(path)?;
    let failed = |error: ::e57::Error| match system_error(&error) {
        Some(kind) => Error::io(path, "write")(kind.into()),
        None => Error::format(path, format!("cannot be written: {error}")),
    };
    let clouds = scans.iter().map(|scan| &scan.cloud);
    let mut writer = E57Writer::new(&mut file, &identity(clouds.clone(), 0)).map_err(failed)?;
    let has = |find: fn(&CloudFile) -> bool| scans.iter().any(|scan| find(&scan.cloud));
    if has(|cloud| cloud.normals.is_some()) {
        let [name, url] = fields::NORMALS;
        writer.register_extension(Extension::new(name, url)).map_err(failed)?;
    }
    if has(|c| {
        c.sigma.is_some() || c.sigma_own.is_some() || c.flags.is_some() || c.frame.is_some() || c.covariance.is_some()
    }) {
        let [name, url] = fields::OWN;
        writer.register_extension(Extension::new(name, url)).map_err(failed)?;
    }
    for (index, scan) in scans.iter().enumerate() {
        let layout = Layout::of(&scan.cloud, precision);
        let guid = identity([&scan.cloud].into_iter(), index as u64 + 1);
        let mut target = writer.add_pointcloud(&guid, layout.prototype()).map_err(failed)?;
        describe(&mut target, scan)?;
        for point in 0..scan.cloud.len() {
            target.add_point(layout.values(point)).map_err(failed)?;
        }
        target.finalize().map_err(failed)?;
    }
    writer.finalize().map_err(failed)?;
    drop(writer);
    Ok(file.commit()?)
}

/// What the system refused, where that is behind the error.
fn system_error(error: &::e57::Error) -> Option<std::io::ErrorKind> {
    let mut cause = std::error::Error::source(error);
    while let Some(inner) = cause {
        if let Some(found) = inner.downcast_ref::<std::io::Error>() {
            return Some(found.kind());
        }
        cause = inner.source();
    }
    None
}

fn describe<T: std::io::Read + std::io::Write + std::io::Seek>(
    target: &mut PointCloudWriter<'_, T>,
    scan: &E57Scan,
) -> Result<()> {
    target.set_name(Some(scan.name.clone()).filter(|name| !name.is_empty()));
    if let Some(pose) = &scan.cloud.world_from_cloud {
        let numbers = numbers_of(pose).ok_or_else(|| value_error("world_from_cloud", "is not finite".into()))?;
        let [tx, ty, tz, x, y, z, w] = numbers;
        let (rotation, translation) = (Quaternion { w, x, y, z }, Translation { x: tx, y: ty, z: tz });
        target.set_transform(Some(Transform { rotation, translation }));
    }
    let finite = || scan.cloud.intensity.iter().flatten().copied().filter(|value| value.is_finite());
    let limits = (finite().reduce(f32::min), finite().reduce(f32::max));
    if let (Some(low), Some(high)) = limits {
        let value = |value| Some(RecordValue::Single(value));
        target.set_intensity_limits(Some(IntensityLimits { intensity_min: value(low), intensity_max: value(high) }));
    }
    Ok(())
}

/// Which values a point of a cloud has in the file.
struct Layout<'a> {
    cloud: &'a CloudFile,
    precision: Precision,
    /// Some points are no points.
    gaps: bool,
    /// Some intensities are none.
    dark: bool,
}

impl<'a> Layout<'a> {
    fn of(cloud: &'a CloudFile, precision: Precision) -> Self {
        let gaps = cloud.points.iter().any(|point| !is_point(point));
        let dark = cloud.intensity.iter().flatten().any(|value| !value.is_finite());
        Self { cloud, precision, gaps, dark }
    }

    fn prototype(&self) -> Vec<Record> {
        let cloud = self.cloud;
        let single = || RecordDataType::Single { min: None, max: None };
        let position = || match self.precision {
            Precision::Single => single(),
            Precision::Double => RecordDataType::Double { min: None, max: None },
        };
        let whole = |max: usize| RecordDataType::Integer { min: 0, max: max as i64 };
        let mut records = Vec::new();
        let mut add = |wanted: bool, name: RecordName, data_type: RecordDataType| {
            if wanted {
                records.push(Record { name, data_type });
            }
        };
        add(true, RecordName::CartesianX, position());
        add(true, RecordName::CartesianY, position());
        add(true, RecordName::CartesianZ, position());
        add(self.gaps, RecordName::CartesianInvalidState, whole(2));
        add(cloud.intensity.is_some(), RecordName::Intensity, single());
        add(self.dark, RecordName::IsIntensityInvalid, whole(1));
        let [width, height] = cloud.size.unwrap_or_default();
        add(cloud.size.is_some(), RecordName::RowIndex, whole(height.saturating_sub(1)));
        add(cloud.size.is_some(), RecordName::ColumnIndex, whole(width.saturating_sub(1)));
        for axis in 0..3 {
            add(cloud.normals.is_some(), fields::normal(axis), single());
        }
        add(cloud.sigma.is_some(), fields::own("sigma"), single());
        add(cloud.sigma_own.is_some(), fields::own("sigma_own"), single());
        add(cloud.flags.is_some(), fields::own("flags"), whole(usize::from(u16::MAX)));
        add(cloud.frame.is_some(), fields::own("frame"), whole(u32::MAX as usize));
        for name in COVARIANCE {
            add(cloud.covariance.is_some(), fields::own(name), single());
        }
        records
    }

    /// The values of a point in the order of the prototype.
    fn values(&self, index: usize) -> RawValues {
        let cloud = self.cloud;
        let mut values = RawValues::new();
        let point = cloud.points[index];
        let valid = is_point(&point);
        for value in if valid { point } else { [0.0; 3] } {
            values.push(match self.precision {
                Precision::Single => RecordValue::Single(value as f32),
                Precision::Double => RecordValue::Double(value),
            });
        }
        if self.gaps {
            values.push(RecordValue::Integer(if valid { 0 } else { 2 }));
        }
        if let Some(intensities) = &cloud.intensity {
            let value = intensities[index];
            values.push(RecordValue::Single(if value.is_finite() { value } else { 0.0 }));
            if self.dark {
                values.push(RecordValue::Integer(i64::from(!value.is_finite())));
            }
        }
        if let Some([width, _]) = cloud.size {
            values.push(RecordValue::Integer((index / width.max(1)) as i64));
            values.push(RecordValue::Integer((index % width.max(1)) as i64));
        }
        values.extend(cloud.normals.iter().flat_map(|normals| normals[index]).map(RecordValue::Single));
        values.extend(cloud.sigma.iter().chain(&cloud.sigma_own).map(|sigma| RecordValue::Single(sigma[index])));
        values.extend(cloud.flags.iter().map(|flags| RecordValue::Integer(i64::from(flags[index]))));
        values.extend(cloud.frame.iter().map(|frame| RecordValue::Integer(i64::from(frame[index]))));
        values.extend(cloud.covariance.iter().flat_map(|terms| terms[index]).map(RecordValue::Single));
        values
    }
}

fn is_point(point: &[f64; 3]) -> bool {
    point.iter().all(|value| value.is_finite())
}

/// An identifier in the form of a UUID of version 8 that depends on the points alone: same cloud, same file.
fn identity<'a>(clouds: impl Iterator<Item = &'a CloudFile>, salt: u64) -> String {
    let mut hashes = [0xcbf2_9ce4_8422_2325_u64 ^ salt, 0x9e37_79b9_7f4a_7c15 ^ salt];
    for value in clouds.flat_map(|cloud| cloud.points.iter().flatten()) {
        for (hash, factor) in hashes.iter_mut().zip([0x0100_0000_01b3_u64, 0x0100_0000_01b5]) {
            *hash = (*hash ^ value.to_bits()).wrapping_mul(factor).rotate_left(29);
        }
    }
    let [a, b] = hashes;
    format!(
        "{{{:08X}-{:04X}-8{:03X}-A{:03X}-{:012X}}}",
        a >> 32,
        (a >> 16) & 0xffff,
        a & 0xfff,
        (b >> 48) & 0xfff,
        b & 0xffff_ffff_ffff
    )
}
