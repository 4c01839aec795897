//! The clouds of views, written as they come.
//!
//! Where the survey says where all stations stand, or has one alone, points go straight into the cloud of the common frame.
//! Else each view's cloud is a file of its own in the frame of its camera; once poses were found, these are read back one by
//! one into the common cloud.

use std::collections::BTreeSet;
use std::path::Path;

use atomic_output::OutputFolder;
use error_models::sigma_beside_edges;
use nalgebra::{Isometry3, Point3};
use range_io::ply::{CloudFile, PlyWriter, Precision, read_cloud, read_some_of_cloud, write_cloud};
use serde::{Deserialize, Serialize};

use commands::tiles::{self, LastPoints, TiledCloud};

use crate::survey::open::OpenSurvey;
use crate::survey::records::StationPose;
use crate::survey::view::View;
use crate::{Error, Result};

/// The file of a cloud that is in no frame but its camera's.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct OwnCloud {
    /// Station, and frame or number of frames.
    pub view: String,
    /// The file, relative to the output folder; x right, y up, the camera looking along -z.
    pub file: String,
}

/// Whether a view does not belong to the others.
type LeftOut<'a> = &'a dyn Fn(usize) -> bool;

/// The clouds so far.
pub(crate) struct Clouds<'a> {
    folder: &'a OutputFolder,
    /// Whether poses are sought.
    joins: bool,
    /// Whether the survey has one station alone, whose frame is then the common one.
    one_station: bool,
    /// Whether poses of all views are known before.
    placed: bool,
    views: usize,
    common: Option<PlyWriter>,
    /// Points in it.
    points: u64,
    /// Points of split pixels in the common frame, which are written last.
    further: LastPoints<'a>,
    own: Vec<Own>,
}

/// A view's file in its own frame.
struct Own {
    cloud: OwnCloud,
    number: usize,
    /// Points at its end that are those of split pixels.
    further: usize,
}

impl<'a> Clouds<'a> {
    /// `views`: those before the first one here.
    pub(crate) fn new(folder: &'a OutputFolder, survey: &OpenSurvey, joins: bool, views: usize) -> Self {
        let stations: BTreeSet<&str> = survey.survey.frames.iter().map(|frame| frame.station.as_str()).collect();
        let one_station = stations.len() == 1;
        let known = |station: &&str| survey.approximate_pose(station).is_some();
        let placed = !joins && (one_station || stations.iter().all(known));
        let further = LastPoints::new(folder);
        Self { folder, joins, one_station, placed, views, common: None, points: 0, further, own: Vec::new() }
    }

    /// Writes the cloud of a view, where it has one.
    pub(crate) fn add(&mut self, view: &View) -> Result<()> {
        let number = self.views;
        self.views += 1;
        let Some(cloud) = CloudOfView::new(view, number) else { return Ok(()) };
        let stated = view.approximate_world_from_camera;
        let own = self.one_station.then(Isometry3::identity);
        if let Some(pose) = stated.or(own).filter(|_| self.placed) {
            self.append(&moved(cloud.points, &pose))?;
            self.further.add(&moved(cloud.further, &pose))?;
            return Ok(());
        }
        let further = cloud.further.points.len();
        // A station's name may hold what no file's name can.
        let plain = |c: char| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' };
        let station: String = view.station.chars().take(LONGEST_NAME).map(plain).collect();
        let file = format!("clouds/{number:03}_{station}.ply");
        // What is read back keeps all digits.
        let precision = if self.joins { Precision::Double } else { Precision::Single };
        write_cloud(self.folder.file(&file)?, &joined(cloud.points, cloud.further), precision)?;
        self.own.push(Own { cloud: OwnCloud { view: view.name(), file }, number, further });
        Ok(())
    }

    /// How many points of split pixels end the common cloud that [`Self::finish`] writes.
    pub(crate) fn further(&self) -> usize {
        self.further.points()
    }

    /// Adds the files of another part of the views, so many points at a time; those of split pixels end its common cloud.
    pub(crate) fn add_part(
        &mut self,
        folder: &Path,
        (points, further, own): (u64, usize, Vec<OwnCloud>),
        at_once: usize,
    ) -> Result<()> {
        let (common, all, of_pixels) = (folder.join("cloud.ply"), points, points.saturating_sub(further as u64));
        let mut next = common.is_file().then_some(0);
        while let Some(first) = next {
            let is_further = (of_pixels..all).contains(&first);
            let end = if is_further { all } else { of_pixels };
            let points = read_some_of_cloud(&common, first, at_once.min((end - first) as usize))?;
            if points.is_empty() && first < all {
                let message = format!("{}: has fewer points than its part wrote: run it anew", common.display());
                return Err(Error::Request { command: "merge", message });
            }
            if is_further {
                self.further.add(&points)?;
            } else {
                self.append(&points)?;
            }
            next = Some(first + points.len() as u64).filter(|next| *next < all);
        }
        for cloud in own {
            let (from, to) = (folder.join(&cloud.file), self.folder.file(&cloud.file)?);
            std::fs::copy(&from, to).map_err(|source| Error::Access { path: from, source })?;
            self.own.push(Own { cloud, number: self.views, further: 0 });
            self.views += 1;
        }
        Ok(())
    }

    fn append(&mut self, points: &CloudFile) -> Result<()> {
        let writer = match &mut self.common {
            Some(writer) => writer,
            None => self.common.insert(PlyWriter::create(self.folder.file("cloud.ply")?, Precision::Single)?),
        };
        self.points += points.points.len() as u64;
        Ok(writer.append(points)?)
    }

    /// Completes the files of a part, which are in the common frame where the survey knows it; how many points that has.
    pub(crate) fn finish_part(mut self) -> Result<(Vec<OwnCloud>, u64)> {
        self.complete(self.placed.then_some(&[]), &|_| false)
    }

    /// Completes the files: one cloud where there are poses in a common frame, of all views but those that are left out. Else the
    /// files of the views. A common one of many points is in tiles.
    pub(crate) fn finish(
        mut self,
        common: Option<&[StationPose]>,
        left_out: LeftOut<'_>,
    ) -> Result<(Vec<OwnCloud>, Option<TiledCloud>)> {
        let (own, points) = self.complete(common, left_out)?;
        Ok((own, tiles::of_cloud(self.folder, "cloud", points)?))
    }

    fn complete(&mut self, common: Option<&[StationPose]>, left_out: LeftOut<'_>) -> Result<(Vec<OwnCloud>, u64)> {
        let own = std::mem::take(&mut self.own);
        let Some(poses) = common else {
            for file in own.iter().filter(|_| self.joins) {
                let path = self.folder.file(&file.cloud.file)?;
                write_cloud(&path, &read_cloud(&path)?, Precision::Single)?;
            }
            return Ok((own.into_iter().map(|own| own.cloud).collect(), 0));
        };
        for file in &own {
            if !left_out(file.number) {
                let number = (0..file.number).filter(|view| !left_out(*view)).count();
                let mut cloud =
                    moved(read_cloud(self.folder.file(&file.cloud.file)?)?, &poses[number].world_from_camera);
                cloud.frame.iter_mut().for_each(|frames| frames.fill(number as u32));
                let (points, further) = parted(cloud, file.further);
                self.append(&points)?;
                self.further.add(&further)?;
            }
            self.folder.discard(&file.cloud.file)?;
        }
        for number in 0..self.further.close()? {
            let further = self.further.take(number)?;
            self.append(&further)?;
        }
        if let Some(writer) = self.common.take() {
            writer.commit()?;
        }
        Ok((Vec::new(), self.points))
    }
}

/// Characters of a station's name in a file's name.
const LONGEST_NAME: usize = 100;

/// The points of a view in its camera's frame.
struct CloudOfView {
    /// All finite points of pixels, flagged ones with their flags.
    points: CloudFile,
    /// Those of split pixels.
    further: CloudFile,
}

impl CloudOfView {
    fn new(view: &View, number: usize) -> Option<Self> {
        let cloud = view.cloud.as_ref()?;
        // Registration and tests went by the noise; who reads a point wants to know what an edge in it may have done, too.
        let sigma = sigma_beside_edges(&cloud.points, &cloud.sigma, cloud.width);
        let sigma = sigma.unwrap_or_else(|_| cloud.sigma.clone());
        let finite = || (0..cloud.points.len()).filter(|&index| cloud.points[index].iter().all(|x| x.is_finite()));
        let points = CloudFile {
            points: finite().map(|index| cloud.points[index]).collect(),
            intensity: Some(finite().map(|index| cloud.amplitude[index]).collect()),
            sigma: Some(finite().map(|index| sigma[index]).collect()),
            flags: Some(finite().map(|index| cloud.flags[index].bits()).collect()),
            frame: Some(finite().map(|_| number as u32).collect()),
            ..CloudFile::default()
        };
        let further = CloudFile {
            points: view.further_points.iter().map(|further| further.point).collect(),
            intensity: Some(view.further_points.iter().map(|further| further.amplitude).collect()),
            sigma: Some(view.further_points.iter().map(|further| further.sigma_m).collect()),
            flags: Some(vec![0; view.further_points.len()]),
            frame: Some(vec![number as u32; view.further_points.len()]),
            ..CloudFile::default()
        };
        Some(Self { points, further })
    }
}

fn moved(mut cloud: CloudFile, pose: &Isometry3<f64>) -> CloudFile {
    for point in &mut cloud.points {
        *point = (pose * Point3::from(*point)).coords.into();
    }
    cloud
}

/// The points of two clouds that have the same attributes.
fn joined(mut cloud: CloudFile, other: CloudFile) -> CloudFile {
    fn extend<T>(values: &mut Option<Vec<T>>, others: Option<Vec<T>>) {
        if let (Some(values), Some(others)) = (values, others) {
            values.extend(others);
        }
    }
    cloud.points.extend(other.points);
    extend(&mut cloud.intensity, other.intensity);
    extend(&mut cloud.sigma, other.sigma);
    extend(&mut cloud.flags, other.flags);
    extend(&mut cloud.frame, other.frame);
    cloud
}

/// The cloud without its last points, and these.
fn parted(mut cloud: CloudFile, last: usize) -> (CloudFile, CloudFile) {
    fn part<T>(values: &mut Option<Vec<T>>, first: usize) -> Option<Vec<T>> {
        values.as_mut().map(|values| values.split_off(first))
    }
    let first = cloud.points.len().saturating_sub(last);
    let further = CloudFile {
        points: cloud.points.split_off(first),
        intensity: part(&mut cloud.intensity, first),
        sigma: part(&mut cloud.sigma, first),
        flags: part(&mut cloud.flags, first),
        frame: part(&mut cloud.frame, first),
        ..CloudFile::default()
    };
    (cloud, further)
}
