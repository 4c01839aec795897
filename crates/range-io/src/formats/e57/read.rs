use std::io::{BufReader, Read, Seek};
use std::path::Path;

use ::e57::{E57Reader, PointCloud, RecordDataType, RecordName};

use super::{E57Scan, fields};
use crate::formats::cloud_file::{COVARIANCE, CloudFile};
use crate::pose::pose_of;
use crate::text::fault::{Fault, reserve};
use crate::text::limits::MOST_SCANS;
use crate::{Error, Result};

/// Reads all scans of a file.
pub fn read_e57(path: impl AsRef<Path>) -> Result<Vec<E57Scan>> {
    let path = path.as_ref();
    let (file, length) = crate::open(path)?;
    let broken = |error: ::e57::Error| Error::format(path, format!("is no E57 file that can be read: {error}"));
    let mut reader = E57Reader::new(BufReader::with_capacity(1 << 16, file)).map_err(broken)?;
    let headers = reader.pointclouds();
    check_sizes(&headers, length).map_err(|fault| fault.of(path))?;
    let scans = headers.iter().enumerate().map(|(index, header)| {
        let cloud = read_scan(&mut reader, header)
            .map_err(|fault| fault.with(path, |reason| Error::format(path, format!("scan {index} {reason}"))))?;
        Ok(E57Scan { name: header.name.clone().unwrap_or_default(), cloud })
    });
    scans.collect()
}

/// Holds what the scans promise together against the `length` of the file: several could point at the same points.
fn check_sizes(headers: &[PointCloud], length: u64) -> Reason<()> {
    if headers.len() > MOST_SCANS {
        return Err(format!("has {} scans, expected at most {MOST_SCANS}", headers.len()).into());
    }
    let mut all = 0_u64;
    for (index, header) in headers.iter().enumerate() {
        let records = header.records;
        let bits: u64 = header.prototype.iter().map(|record| bits(&record.data_type)).sum();
        // Columns of one value throughout take no bits. Where most are such, a few bytes would become gigabytes.
        let columns = header.prototype.len() as u64;
        if bits < columns {
            return Err(format!("scan {index} has {columns} columns in {bits} bits a point").into());
        }
        let bytes = records.checked_mul(bits).map(|bits| bits / 8);
        all = bytes.and_then(|bytes| all.checked_add(bytes)).unwrap_or(u64::MAX);
        if all > length {
            let reason =
                format!("scan {index} promises {records} points, more than the {length} bytes of the file hold");
            return Err(reason.into());
        }
    }
    Ok(())
}

/// Columns of a scan; those there are have one value a point.
#[derive(Default)]
struct Scan {
    positions: [Vec<f64>; 3],
    /// Whether the position is one.
    valid: Option<Vec<f64>>,
    cells: [Option<Vec<f64>>; 2],
    cloud: CloudFile,
}

type Reason<T> = std::result::Result<T, Fault>;

fn read_scan<T: Read + Seek>(reader: &mut E57Reader<T>, header: &PointCloud) -> Reason<CloudFile> {
    let pose = header.transform.as_ref().map(|transform| {
        let (t, q) = (&transform.translation, &transform.rotation);
        pose_of(&[t.x, t.y, t.z], &[q.x, q.y, q.z, q.w]).ok_or("has a pose whose quaternion has not the length 1")
    });
    let pose = pose.transpose()?;
    let points = usize::try_from(header.records).map_err(|_| "has more points than this machine can address")?;
    let columns: std::io::Result<Vec<Vec<f64>>> = header.prototype.iter().map(|_| reserve(points)).collect();
    let mut columns = columns?;
    let broken = |error: ::e57::Error| format!("cannot be read: {error}");
    for point in reader.pointcloud_raw(header).map_err(broken)? {
        let values = point.map_err(broken)?;
        for ((column, value), record) in columns.iter_mut().zip(&values).zip(&header.prototype) {
            column.push(value.to_f64(&record.data_type).map_err(broken)?);
        }
    }
    let mut scan = Scan::of_columns(header, columns)?;
    scan.cloud.world_from_cloud = pose;
    Ok(scan.into_cloud())
}

impl Scan {
    fn of_columns(header: &PointCloud, mut columns: Vec<Vec<f64>>) -> Reason<Self> {
        let mut take = |name: &RecordName| {
            let index = header.prototype.iter().position(|record| record.name == *name)?;
            Some(std::mem::take(&mut columns[index]))
        };
        let mut all = |names: [RecordName; 3]| {
            let [a, b, c] = names.map(|name| take(&name));
            Some([a?, b?, c?])
        };
        let cartesian = all([RecordName::CartesianX, RecordName::CartesianY, RecordName::CartesianZ]);
        let spherical = all([RecordName::SphericalRange, RecordName::SphericalAzimuth, RecordName::SphericalElevation]);
        let normals = all([fields::normal(0), fields::normal(1), fields::normal(2)]);
        let (positions, invalid) = match (cartesian, spherical) {
            (Some(positions), _) => (positions, RecordName::CartesianInvalidState),
            (None, Some(directions)) => (cartesian_from_spherical(directions), RecordName::SphericalInvalidState),
            _ => return Err("has neither Cartesian nor spherical coordinates".into()),
        };
        let single = |values: Vec<f64>| values.into_iter().map(|value| value as f32).collect::<Vec<f32>>();
        let mut cloud = CloudFile { intensity: take(&RecordName::Intensity).map(single), ..CloudFile::default() };
        if let (Some(intensity), Some(invalid)) = (&mut cloud.intensity, take(&RecordName::IsIntensityInvalid)) {
            let bad = intensity.iter_mut().zip(invalid).filter(|(_, state)| *state != 0.0);
            bad.for_each(|(value, _)| *value = f32::NAN);
        }
        cloud.sigma = take(&fields::own("sigma")).map(single);
        // A cast from f64 saturates; the prototype of what was written here has no more than these bits.
        cloud.flags = take(&fields::own("flags")).map(|values| values.into_iter().map(|v| v as u16).collect());
        cloud.frame = take(&fields::own("frame")).map(|values| values.into_iter().map(|v| v as u32).collect());
        let terms = COVARIANCE.map(|name| take(&fields::own(name)));
        if terms.iter().all(Option::is_some) {
            let terms = terms.map(Option::unwrap_or_default);
            let term = |i: usize| std::array::from_fn(|term| terms[term][i] as f32);
            cloud.covariance = Some((0..terms[0].len()).map(term).collect());
        }
        cloud.normals = normals
            .map(|[x, y, z]| x.iter().zip(&y).zip(&z).map(|((x, y), z)| [*x as f32, *y as f32, *z as f32]).collect());
        let valid = take(&invalid);
        let cells = [take(&RecordName::ColumnIndex), take(&RecordName::RowIndex)];
        Ok(Self { positions, valid, cells, cloud })
    }

    fn into_cloud(self) -> CloudFile {
        let Self { positions: [x, y, z], valid, cells, mut cloud } = self;
        let gap = |index: usize| valid.as_ref().is_some_and(|state| state[index] != 0.0);
        let point = |index: usize| if gap(index) { [f64::NAN; 3] } else { [x[index], y[index], z[index]] };
        cloud.points = (0..x.len()).map(point).collect();
        match cells {
            [Some(columns), Some(rows)] => arranged(cloud, &columns, &rows),
            _ => without_gaps(cloud),
        }
    }
}

/// Range, azimuth and elevation as x, y, z.
fn cartesian_from_spherical([range, azimuth, elevation]: [Vec<f64>; 3]) -> [Vec<f64>; 3] {
    let mut out = [Vec::with_capacity(range.len()), Vec::with_capacity(range.len()), Vec::with_capacity(range.len())];
    for ((range, azimuth), elevation) in range.into_iter().zip(azimuth).zip(elevation) {
        let level = range * elevation.cos();
        out[0].push(level * azimuth.cos());
        out[1].push(level * azimuth.sin());
        out[2].push(range * elevation.sin());
    }
    out
}

/// The points row by row, gaps as NaN; as they stand where cells are taken twice or most would be empty.
fn arranged(cloud: CloudFile, columns: &[f64], rows: &[f64]) -> CloudFile {
    const EMPTIEST: usize = 4;
    let extent = |cells: &[f64]| cells.iter().copied().fold(-1.0, f64::max) + 1.0;
    let (width, height) = (extent(columns), extent(rows));
    let negative = columns.iter().chain(rows).any(|cell| *cell < 0.0);
    let filled = width * height <= (EMPTIEST * cloud.len()) as f64;
    if negative || !filled || cloud.is_empty() {
        return without_gaps(cloud);
    }
    let (width, height) = (width as usize, height as usize);
    let mut of_cell: Vec<Option<usize>> = vec![None; width * height];
    for (index, (column, row)) in columns.iter().zip(rows).enumerate() {
        if of_cell[*row as usize * width + *column as usize].replace(index).is_some() {
            return without_gaps(cloud);
        }
    }
    CloudFile { size: Some([width, height]), ..picked(&cloud, &of_cell) }
}

/// Leaves out what is no point.
fn without_gaps(cloud: CloudFile) -> CloudFile {
    let valid = |index: &usize| cloud.points[*index].iter().all(|value| value.is_finite());
    let kept: Vec<Option<usize>> = (0..cloud.len()).filter(valid).map(Some).collect();
    if kept.len() == cloud.len() { cloud } else { picked(&cloud, &kept) }
}

/// The points of these indices; NaN and 0 where there is none.
fn picked(cloud: &CloudFile, indices: &[Option<usize>]) -> CloudFile {
    fn pick<T: Copy>(values: Option<&Vec<T>>, indices: &[Option<usize>], none: T) -> Option<Vec<T>> {
        values.map(|values| indices.iter().map(|index| index.map_or(none, |index| values[index])).collect())
    }
    CloudFile {
        colours: None,
        sigma_own: None,
        points: pick(Some(&cloud.points), indices, [f64::NAN; 3]).unwrap_or_default(),
        normals: pick(cloud.normals.as_ref(), indices, [f32::NAN; 3]),
        intensity: pick(cloud.intensity.as_ref(), indices, f32::NAN),
        sigma: pick(cloud.sigma.as_ref(), indices, f32::NAN),
        flags: pick(cloud.flags.as_ref(), indices, 0),
        frame: pick(cloud.frame.as_ref(), indices, 0),
        covariance: pick(cloud.covariance.as_ref(), indices, [f32::NAN; 6]),
        size: None,
        world_from_cloud: cloud.world_from_cloud,
    }
}

/// Bits of a value.
fn bits(kind: &RecordDataType) -> u64 {
    match kind {
        RecordDataType::Single { .. } => 32,
        RecordDataType::Double { .. } => 64,
        RecordDataType::ScaledInteger { min, max, .. } | RecordDataType::Integer { min, max } => {
            let range = i128::from(*max) - i128::from(*min);
            if range > 0 { u64::from(range.ilog2()) + 1 } else { 0 }
        }
    }
}
