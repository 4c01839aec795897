//! Which target each point is: by its code, or by where it is among targets of known coordinates.

use camera_model::Camera;
use nalgebra::{Isometry3, Point3};
use orientation::{Error, IdentificationOptions, TargetObservation, UnnamedTarget, identify_targets, robust_resection};
use range_io::tables::Target;
use statistics::{mad_scale, upper_median};

use crate::find::single::points::Point;
use crate::kind::SingleKind;

/// Codes with coordinates from which on a wrong one shows: with five, two may agree on a wrong pose.
const LEAST_CODES: usize = 6;
/// Share of the image's diagonal that a right code may lie off where the others put it: the nominal lens misses 4.5 pixels of 176 x
/// 144. More, and a code that was read wrongly beside its place is kept.
pub(crate) const REACH_SHARE: f64 = 0.02;
/// Robust standard deviations beyond which a code contradicts, where the lens is worse than that.
const OUTLYING: f64 = 5.0;
/// Standard deviation of image points and ranges for the pose by which codes are judged, pixel and metre: nothing is calibrated.
pub(crate) const NOMINAL_SIGMA: [f64; 2] = [1.0, 0.1];

/// What names are given by.
pub(crate) struct Names<'a> {
    pub(crate) kind: SingleKind,
    pub(crate) camera: &'a Camera,
    pub(crate) known: &'a [Target],
}

/// The points of a station with their names.
pub(crate) struct Named {
    /// Of each point; `None` where it is none of the targets, or takes no part.
    pub(crate) names: Vec<Option<String>>,
    /// Why a point takes no part though it is a target.
    pub(crate) faults: Vec<Option<String>>,
    /// Median distance from where the coordinates put the targets, pixel; `None` where there are no coordinates.
    pub(crate) residual_px: Option<f64>,
    /// Targets that lie in the image and were not seen.
    pub(crate) not_seen: Vec<String>,
    /// Whether names are held against coordinates; else a code that was read wrongly does not show.
    pub(crate) is_checked: bool,
}

impl Names<'_> {
    /// Names of the points, or why there are none.
    pub(crate) fn of(&self, points: &[Point], approximate: Option<Isometry3<f64>>) -> Result<Named, String> {
        let noun = self.kind.noun();
        if points.is_empty() {
            return Err(format!("no {noun} are seen"));
        }
        if let (true, Some(first)) = (points.iter().all(|point| point.fault.is_some()), points.first()) {
            let reason = first.fault.as_deref().unwrap_or_default();
            return Err(format!("none of {} {noun} can be used; of the first: {reason}", points.len()));
        }
        match self.kind {
            SingleKind::Rings { .. } => self.by_code(points),
            _ => self.by_place(points, approximate),
        }
    }

    fn by_code(&self, points: &[Point]) -> Result<Named, String> {
        let mut faults: Vec<Option<String>> = points.iter().map(|point| point.fault.clone()).collect();
        let coordinates: Vec<Option<Point3<f64>>> = points.iter().map(|point| self.position(point)).collect();
        if !self.known.is_empty() && coordinates.iter().all(Option::is_none) {
            let listed = |names: Vec<String>| names.into_iter().take(3).collect::<Vec<_>>().join(", ");
            return Err(format!(
                "none of its codes ({}, ...) is among the targets of targets.csv ({}, ...)",
                listed(points.iter().filter_map(|point| point.code.clone()).collect()),
                listed(self.known.iter().map(|target| target.target.clone()).collect())
            ));
        }
        let usable: Vec<usize> =
            (0..points.len()).filter(|&k| coordinates[k].is_some() && faults[k].is_none()).collect();
        let pose = self.pose(points, &coordinates, &usable)?;
        let mut residual_px = None;
        if let Some(pose) = pose {
            let off = |k: &usize| self.off_px(&pose, coordinates[*k], points[*k].pixel);
            let distances: Vec<f64> = usable.iter().map(off).collect();
            let limit = self.reach_px().max(OUTLYING * mad_scale(&mut distances.clone()));
            residual_px = Some(upper_median(&mut distances.clone()));
            for (k, distance) in usable.iter().zip(&distances).filter(|(_, distance)| **distance > limit) {
                faults[*k] = Some(format!(
                    "it lies {distance:.1} pixels from where the other codes and targets.csv put it: its code is read wrongly, or its \
                     coordinates are another's"
                ));
            }
        }
        let name = |(point, fault): (&Point, &Option<String>)| point.code.clone().filter(|_| fault.is_none());
        let names: Vec<Option<String>> = points.iter().zip(&faults).map(name).collect();
        Ok(Named { not_seen: self.not_seen(pose, points), names, faults, residual_px, is_checked: pose.is_some() })
    }

    /// The pose that most codes agree with; `None` where there are too few to judge, or the geometry is too weak.
    fn pose(
        &self,
        points: &[Point],
        coordinates: &[Option<Point3<f64>>],
        usable: &[usize],
    ) -> Result<Option<Isometry3<f64>>, String> {
        if usable.len() < LEAST_CODES {
            return Ok(None);
        }
        let target = |&k: &usize| {
            let target = TargetObservation::new(coordinates[k]?, points[k].pixel, NOMINAL_SIGMA[0]);
            Some(match points[k].range {
                Some([range, _]) => target.with_range(range, NOMINAL_SIGMA[1]),
                None => target,
            })
        };
        let targets: Vec<TargetObservation> = usable.iter().filter_map(target).collect();
        match robust_resection(self.camera, &targets) {
            Ok(pose) => Ok(Some(pose)),
            // Which of them it is makes little difference to where the targets are in the image.
            Err(Error::Ambiguous { poses, .. }) => Ok(poses.first().copied()),
            Err(error @ Error::NoApproximation { .. }) => Err(format!("its codes contradict targets.csv: {error}")),
            Err(_) => Ok(None),
        }
    }

    fn by_place(&self, points: &[Point], approximate: Option<Isometry3<f64>>) -> Result<Named, String> {
        let faults: Vec<Option<String>> = points.iter().map(|point| point.fault.clone()).collect();
        let usable: Vec<usize> = (0..points.len()).filter(|&k| faults[k].is_none()).collect();
        let mut names = vec![None; points.len()];
        if let ([only], true) = (usable.as_slice(), self.known.len() <= 1) {
            // One target in the world and one in the image.
            let name = self.known.first().map_or_else(|| self.kind.only().to_owned(), |target| target.target.clone());
            names[*only] = Some(name);
            return Ok(Named { names, faults, residual_px: None, not_seen: Vec::new(), is_checked: true });
        }
        if self.known.is_empty() {
            let (count, noun) = (usable.len(), self.kind.noun());
            return Err(format!(
                "{count} {noun} are seen, and nothing tells which is which: their coordinates in targets.csv do, or coded rings"
            ));
        }
        let known: Vec<Point3<f64>> = self.known.iter().map(|target| target.position_m.into()).collect();
        let seen =
            |&k: &usize| UnnamedTarget { pixel: points[k].pixel, range_m: points[k].range.map(|[range, _]| range) };
        let seen: Vec<UnnamedTarget> = usable.iter().map(seen).collect();
        let options = IdentificationOptions { approximate, ..IdentificationOptions::default() };
        let found = identify_targets(self.camera, &known, &seen, &options).map_err(|error| error.to_string())?;
        let mut distances = Vec::new();
        for [seen, target] in &found.pairs {
            names[usable[*seen]] = Some(self.known[*target].target.clone());
            distances.push(self.off_px(&found.world_from_camera, Some(known[*target]), points[usable[*seen]].pixel));
        }
        let named: Vec<&String> = names.iter().flatten().collect();
        let is_missing = |name: &String| !named.contains(&name);
        let not_seen = self.inside(&found.world_from_camera).filter(is_missing).collect();
        let residual_px = Some(upper_median(&mut distances));
        Ok(Named { names, faults, residual_px, not_seen, is_checked: true })
    }

    fn position(&self, point: &Point) -> Option<Point3<f64>> {
        let name = point.code.as_ref()?;
        self.known.iter().find(|target| target.target == *name).map(|target| target.position_m.into())
    }

    fn reach_px(&self) -> f64 {
        REACH_SHARE * (self.camera.format.width as f64).hypot(self.camera.format.height as f64)
    }

    fn off_px(&self, pose: &Isometry3<f64>, position: Option<Point3<f64>>, pixel: [f64; 2]) -> f64 {
        let at = position.and_then(|position| self.camera.project(&pose.inverse_transform_point(&position)).ok());
        at.map_or(f64::INFINITY, |at| (at[0] - pixel[0]).hypot(at[1] - pixel[1]))
    }

    /// Names of the targets that lie in the image of a camera at a pose.
    fn inside(&self, pose: &Isometry3<f64>) -> impl Iterator<Item = String> {
        let is_inside = move |target: &&Target| {
            let in_camera = pose.inverse_transform_point(&target.position_m.into());
            in_camera.z < 0.0 && self.camera.project(&in_camera).is_ok_and(|pixel| self.camera.contains(pixel))
        };
        self.known.iter().filter(is_inside).map(|target| target.target.clone())
    }

    fn not_seen(&self, pose: Option<Isometry3<f64>>, points: &[Point]) -> Vec<String> {
        let seen: Vec<&String> = points.iter().filter_map(|point| point.code.as_ref()).collect();
        pose.map_or_else(Vec::new, |pose| self.inside(&pose).filter(|name| !seen.contains(&name)).collect())
    }
}
