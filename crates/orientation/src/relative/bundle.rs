//! Stations and points in one adjustment; the first station is held.

use adjust::{Adjustment, BlockId, Covariance, Descent, GroupId, ObservationId, ParameterBlock, Scale, Solution};
use camera_model::Camera;
use nalgebra::{Isometry3, Matrix3, Matrix6, Point3};

use crate::model::{TargetEquations, sigmas};
use crate::relative::network::ObservedPart;
use crate::relative::network_start::Start;
use crate::relative::rays::ImagePoint;
use crate::{ObservedRange, Result, TargetObservation};

/// A point of the object that was found, with its covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObjectPoint {
    /// Coordinates in the frame of the first view or station, in the unit of the base (metre, where ranges give it).
    pub point: Point3<f64>,
    /// Their covariance, in the square of that unit.
    pub covariance: Matrix3<f64>,
}

/// What one station observes of one target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TieObservation {
    /// Number of the station, from 0.
    pub station: usize,
    /// Number of the target, from 0.
    pub target: usize,
    /// The image point.
    pub image: ImagePoint,
    /// The range, where there is one, metre.
    pub range: Option<ObservedRange>,
}

impl TieObservation {
    /// The parts of the observation, in the order of its components.
    pub(crate) fn parts(&self) -> &'static [ObservedPart] {
        let all = &[ObservedPart::Column, ObservedPart::Row, ObservedPart::Range];
        if self.range.is_some() { all } else { &all[..2] }
    }

    /// As of a target whose coordinates are an unknown.
    fn of_unknown(&self) -> TargetObservation {
        TargetObservation {
            sigma_pixel: self.image.sigma_pixel,
            range: self.range,
            ..TargetObservation::new(Point3::origin(), self.image.pixel, 1.0)
        }
    }
}

/// An adjustment of stations and points.
pub(crate) struct Bundle<'a> {
    pub(crate) adjustment: Adjustment<'a>,
    cameras: Vec<&'a Camera>,
    pub(crate) stations: Vec<BlockId>,
    pub(crate) points: Vec<Option<BlockId>>,
    pub(crate) group: GroupId,
    /// The observations of points that take part: number in the list, and name in the adjustment.
    pub(crate) observations: Vec<(usize, ObservationId)>,
}

impl<'a> Bundle<'a> {
    /// Of approximate poses and points; what sees a point that has none, or a station that has none, takes no part.
    pub(crate) fn new(
        cameras: &[&'a Camera],
        stations: &[Isometry3<f64>],
        points: &[Option<Point3<f64>>],
        sightings: &[TieObservation],
    ) -> Result<Self> {
        let mut adjustment = Adjustment::new();
        let name = |(index, pose): (usize, &Isometry3<f64>)| {
            adjustment.add_block(ParameterBlock::pose(pose).named(format!("station {index}")))
        };
        let stations: Vec<BlockId> = stations.iter().enumerate().map(name).collect();
        let name = |(index, point): (usize, &Option<Point3<f64>>)| {
            let coordinates: [f64; 3] = (*point)?.into();
            Some(adjustment.add_block(ParameterBlock::euclidean(coordinates).named(format!("target {index}"))))
        };
        let points: Vec<Option<BlockId>> = points.iter().enumerate().map(name).collect();
        if let Some(&first) = stations.first() {
            adjustment.hold(first)?;
        }
        let group = adjustment.add_group("tie points");
        let mut bundle =
            Self { adjustment, cameras: cameras.to_vec(), stations, points, group, observations: Vec::new() };
        for (index, seen) in sightings.iter().enumerate() {
            let Some(point) = bundle.points[seen.target] else { continue };
            let camera = cameras[seen.station];
            let target = seen.of_unknown();
            let equations = TargetEquations::new(camera, &target, bundle.stations[seen.station], Some(point));
            let covariance = Covariance::from_sigmas(&sigmas(camera, &target));
            let id = bundle.adjustment.add_observation(group, equations, &covariance)?;
            bundle.observations.push((index, id));
        }
        Ok(bundle)
    }

    /// The camera of a station.
    pub(crate) fn camera(&self, station: usize) -> &'a Camera {
        self.cameras[station]
    }

    /// Takes the values of a descent as start values.
    pub(crate) fn take(&self, descent: &Descent, start: &mut Start) -> Result<()> {
        for (pose, &block) in start.stations.iter_mut().zip(&self.stations) {
            *pose = descent.pose(block)?;
        }
        for (point, block) in start.points.iter_mut().zip(&self.points) {
            if let Some(block) = *block {
                *point = Some(Point3::from_slice(descent.values(block)?));
            }
        }
        Ok(())
    }

    /// Leaves out what lies more than so many standard deviations from where the start puts it: image points as a whole, and
    /// ranges. Points that nothing determines without it keep everything.
    pub(crate) fn exclude_contradicting(
        &mut self,
        start: &Start,
        sightings: &[TieObservation],
        deviations: f64,
    ) -> Result<()> {
        let mut wrong: Vec<(usize, ObservationId, usize)> = Vec::new();
        let mut kept = vec![0_usize; self.points.len()];
        for &(index, id) in &self.observations {
            let seen = &sightings[index];
            let Some(point) = start.points[seen.target] else { continue };
            let camera = self.cameras[seen.station];
            let modelled = camera.observe(&start.stations[seen.station], &point).ok();
            let misses = |part: &ObservedPart| {
                let Some(modelled) = &modelled else { return true };
                let [col, row] = camera.format.pixel_from_image(modelled.image_mm);
                let image = ((seen.image.pixel[0] - col) / seen.image.sigma_pixel[0])
                    .hypot((seen.image.pixel[1] - row) / seen.image.sigma_pixel[1]);
                let range = seen.range.map_or(0.0, |range| ((range.range_m - modelled.range_m) / range.sigma_m).abs());
                if *part == ObservedPart::Range { range > deviations } else { image > deviations }
            };
            for (component, part) in seen.parts().iter().enumerate() {
                if misses(part) {
                    wrong.push((seen.target, id, component));
                } else {
                    kept[seen.target] += 1;
                }
            }
        }
        for (target, id, component) in wrong {
            if kept[target] >= 3 {
                self.adjustment.exclude(id, component)?;
            }
        }
        Ok(())
    }

    /// Pose of a station with its covariance; zero for what is held.
    pub(crate) fn pose(&self, solution: &Solution, station: usize) -> Result<(Isometry3<f64>, Matrix6<f64>)> {
        let block = self.stations[station];
        let covariance = solution.covariance(block, Scale::Prior)?;
        Ok((solution.pose(block)?, Matrix6::from_fn(|row, column| covariance[(row, column)])))
    }

    /// All points that took part.
    pub(crate) fn object_points(&self, solution: &Solution) -> Result<Vec<Option<ObjectPoint>>> {
        let found = |block: &Option<BlockId>| {
            let Some(block) = *block else { return Ok(None) };
            let covariance = solution.covariance(block, Scale::Prior)?;
            let covariance = Matrix3::from_fn(|row, column| covariance[(row, column)]);
            Ok(Some(ObjectPoint { point: Point3::from_slice(solution.values(block)?), covariance }))
        };
        self.points.iter().map(found).collect()
    }
}
