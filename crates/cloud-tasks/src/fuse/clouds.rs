//! The clouds as files.

use std::path::Path;

use commands::Result;
use fusion::Fused;
use range_io::clouds::{CloudFile, CloudFormat, Precision, write_any_cloud};

use super::input::{Usable, moved, slip};

/// The ending of the files of a format that clouds are written in.
pub(crate) fn ending(format: CloudFormat) -> Result<&'static str> {
    match format {
        CloudFormat::Ply => Ok("ply"),
        CloudFormat::Pcd => Ok("pcd"),
        CloudFormat::E57 => Ok("e57"),
        other => Err(slip(format!("clouds are not written as {other:?}: expected PLY, PCD or E57"))),
    }
}

/// The fused points, with their standard deviations along their normals.
pub(crate) fn write_fused(path: impl AsRef<Path>, fused: &Fused) -> Result<()> {
    let surfels = &fused.surfels;
    let has_amplitudes = surfels.iter().any(|surfel| surfel.amplitude.is_finite());
    let cloud = CloudFile {
        points: surfels.iter().map(|surfel| surfel.position.coords.into()).collect(),
        normals: Some(surfels.iter().map(|surfel| surfel.normal.map(|value| value as f32).into()).collect()),
        intensity: has_amplitudes.then(|| surfels.iter().map(|surfel| surfel.amplitude as f32).collect()),
        sigma: Some(surfels.iter().map(|surfel| surfel.sigma_m() as f32).collect()),
        sigma_own: Some(surfels.iter().map(|surfel| surfel.own_sigma_m() as f32).collect()),
        ..CloudFile::default()
    };
    Ok(write_any_cloud(path, &cloud, Precision::Single)?)
}

/// All points with a position that are in no fused point, flagged ones among them, moved as those that are; how many.
pub(crate) fn write_unfused(path: impl AsRef<Path>, usable: &Usable<'_>, fused: &Fused) -> Result<usize> {
    let cloud = usable.cloud;
    let mut is_fused = vec![false; cloud.points.len()];
    for (index, surfel) in usable.indices.iter().zip(&fused.surfel_of_point) {
        is_fused[*index] = surfel.is_some();
    }
    let mut buffer = Vec::new();
    let mut kept = Vec::new();
    let mut points = Vec::new();
    for index in (0..cloud.points.len()).filter(|index| !is_fused[*index]) {
        let mut place = moved(cloud, index, &fused.corrections, &mut buffer);
        if !place.iter().all(|value| value.is_finite()) {
            // Without amplitude, a range error that depends on it is not known.
            place = cloud.points[index];
        }
        if place.iter().all(|value| value.is_finite()) {
            kept.push(index);
            points.push(place.coords.into());
        }
    }
    let file = CloudFile {
        points,
        intensity: pick(cloud.errors.intensity.as_deref(), &kept),
        sigma: pick(cloud.errors.sigma.as_deref(), &kept),
        flags: pick(cloud.flags.as_deref(), &kept),
        frame: pick(Some(&cloud.errors.frame), &kept),
        ..CloudFile::default()
    };
    write_any_cloud(path, &file, Precision::Single)?;
    Ok(kept.len())
}

fn pick<T: Copy>(all: Option<&[T]>, kept: &[usize]) -> Option<Vec<T>> {
    all.map(|all| kept.iter().map(|index| all[*index]).collect())
}
