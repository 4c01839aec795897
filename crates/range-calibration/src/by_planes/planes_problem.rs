//! Captures of planes as one adjustment.

use adjust::{
    Adjustment, BlockId, Covariance, LinearObservation, Method, Observation, ParameterBlock, RigidPose, Scale,
    Solution, SolveOptions,
};
use camera_model::Camera;
use error_models::AmplitudeHyperbola;
use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;

use crate::by_planes::planes_geometry::PlaneChart;
use crate::by_planes::planes_observation::{PlaneObservation, Weighting};
use crate::by_planes::planes_pixels::{PlanePixels, chosen_pixels};
use crate::by_planes::planes_start::plane_through;
use crate::observed::options::{HyperbolaUse, LinearTerms};
use crate::{Error, Plane, PlaneCalibrationOptions, PlaneCapture, Result};

/// An adjustment of the planes ends at steps of this share of a standard deviation.
const NEGLIGIBLE: f64 = 1e-4;

/// Full steps that are tried before damped ones.
const FULL_STEPS: usize = 50;

/// The robust stage only chooses pixels: it ends at steps of this share of a standard deviation.
const ROUGHLY: f64 = 1e-2;

/// The checked input, with a chart for each plane.
pub(crate) struct Problem<'a> {
    pub(crate) captures: &'a [PlaneCapture<'a>],
    pub(crate) options: &'a PlaneCalibrationOptions,
    pub(crate) terms: LinearTerms,
    pub(crate) hyperbola: Option<AmplitudeHyperbola>,
    pub(crate) pixels: Vec<PlanePixels>,
    pub(crate) charts: Vec<ChartedPlane>,
    /// Position of the chart of each capture.
    pub(crate) chart_of: Vec<usize>,
}

/// A plane with what is known of it.
pub(crate) struct ChartedPlane {
    pub(crate) name: String,
    pub(crate) chart: PlaneChart,
    pub(crate) held: bool,
}

/// A solution with the blocks it speaks of.
pub(crate) struct Solved {
    pub(crate) solution: Solution,
    pub(crate) terms: BlockId,
    /// One for each chart.
    pub(crate) planes: Vec<BlockId>,
    /// One for each capture whose pose is adjusted.
    pub(crate) poses: Vec<Option<BlockId>>,
}

impl<'a> Problem<'a> {
    pub(crate) fn new(
        captures: &'a [PlaneCapture<'a>],
        planes: &[Option<Plane>],
        camera: &Camera,
        ambiguity_interval_m: f64,
        options: &'a PlaneCalibrationOptions,
    ) -> Result<Self> {
        options.validate()?;
        camera.validate()?;
        let hyperbola = match options.terms.hyperbola {
            HyperbolaUse::None => None,
            HyperbolaUse::Hold(hyperbola) => Some(hyperbola),
            HyperbolaUse::Estimate => return Err(Error::HyperbolaNotHeld),
        };
        let terms = LinearTerms::new(&options.terms, ambiguity_interval_m)?;
        if terms.unknowns() == 0 {
            return Err(Error::NothingToEstimate);
        }
        let chosen = chosen_pixels(camera, &terms.model, &options.pixels);
        let usable = |capture: &PlaneCapture<'_>| {
            PlanePixels::new(capture, camera, &chosen, &terms.model, hyperbola.as_ref(), &options.pixels)
        };
        let pixels = captures.par_iter().map(usable).collect::<Result<Vec<_>>>()?;
        let (charts, chart_of) = (Vec::new(), Vec::new());
        let mut problem = Self { captures, options, terms, hyperbola, pixels, charts, chart_of };
        problem.chart_planes(planes)?;
        problem.leave_out_grazing_pixels();
        Ok(problem)
    }

    /// A chart for each plane in the world, and for each capture without a pose.
    fn chart_planes(&mut self, planes: &[Option<Plane>]) -> Result<()> {
        let mut of_world: Vec<Option<usize>> = vec![None; planes.len()];
        for (capture, pixels) in self.captures.iter().zip(&self.pixels) {
            let seen = plane_through(pixels)?.ok_or_else(|| Error::NoPlane { station: capture.name.clone() })?;
            let middle = Point3::from(pixels.points().sum::<Vector3<f64>>() / pixels.len() as f64);
            let Some(pose) = &capture.world_from_camera else {
                let name = format!("plane of {}", capture.name);
                self.chart_of.push(self.charts.len());
                self.charts.push(ChartedPlane { name, chart: PlaneChart::new(&seen, &middle), held: false });
                continue;
            };
            let unknown =
                Error::UnknownPlane { station: capture.name.clone(), plane: capture.plane, planes: planes.len() };
            let (Some(known), Some(place)) = (planes.get(capture.plane), of_world.get_mut(capture.plane)) else {
                return Err(unknown);
            };
            let chart = *place.get_or_insert(self.charts.len());
            self.chart_of.push(chart);
            if chart == self.charts.len() {
                let plane = known.map_or_else(|| seen.moved(pose), Ok)?;
                let chart = PlaneChart::new(&plane, &(pose * middle));
                self.charts.push(ChartedPlane {
                    name: format!("plane {}", capture.plane),
                    chart,
                    held: known.is_some(),
                });
            }
        }
        Ok(())
    }

    /// Pixels that see the plane at a grazing angle, or not at all, do not take part.
    fn leave_out_grazing_pixels(&mut self) {
        let smallest_cosine = self.options.pixels.largest_incidence_rad.cos();
        for ((capture, pixels), chart) in self.captures.iter().zip(&mut self.pixels).zip(&self.chart_of) {
            let seen = self.charts[*chart].chart.seen_from(&[0.0; 3], &pose_of(capture));
            // The derivative by the plane's distance is one over the cosine.
            pixels.retain(|ray| seen(ray).is_some_and(|range| range.by_plane[2].abs() * smallest_cosine <= 1.0));
        }
    }

    /// Residuals of these pixels, capture by capture, in standard deviations.
    pub(crate) fn residuals(&self, pixels: &[PlanePixels], solved: &Solved) -> Result<Vec<Vec<f64>>> {
        let terms = solved.solution.values(solved.terms)?;
        let of_capture = |index: usize| {
            let chart = self.chart_of[index];
            let plane = solved.solution.values(solved.planes[chart])?;
            let pose = solved.pose(index, &self.captures[index])?;
            Ok(pixels[index].residuals(&self.charts[chart].chart, plane, terms, &pose))
        };
        (0..self.captures.len()).into_par_iter().map(of_capture).collect()
    }

    /// One adjustment of the pixels that take part, from an earlier one where there is one.
    pub(crate) fn solve(&self, pixels: &[PlanePixels], weighting: Weighting, from: Option<&Solved>) -> Result<Solved> {
        let mut adjustment = Adjustment::new();
        let terms = adjustment.add_block(self.terms.block());
        self.terms.hold(&mut adjustment, terms)?;
        let planes = self.charts.iter().map(|chart| chart.add_to(&mut adjustment)).collect::<Result<Vec<_>>>()?;
        let poses = self.captures.iter().map(|capture| add_pose(&mut adjustment, capture));
        let poses = poses.collect::<Result<Vec<_>>>()?;
        let group = adjustment.add_group("ranges to planes");
        for (index, pose) in poses.iter().enumerate() {
            let blocks: Vec<_> = [planes[self.chart_of[index]], terms].into_iter().chain(*pose).collect();
            let observation = self.observation(index, &pixels[index], blocks, weighting);
            let covariance = Covariance::from_sigmas(&vec![1.0; observation.dimension()]);
            adjustment.add_observation(group, observation, &covariance)?;
        }
        if let Some(earlier) = from {
            let of_planes = planes.iter().zip(&earlier.planes);
            let of_poses = poses.iter().flatten().zip(earlier.poses.iter().flatten());
            for (block, before) in [(&terms, &earlier.terms)].into_iter().chain(of_planes).chain(of_poses) {
                adjustment.set_values(*block, earlier.solution.values(*before)?)?;
            }
        }
        match descend(&adjustment, weighting) {
            Ok(solution) => Ok(Solved { solution, terms, planes, poses }),
            // What is not determined often has no end either: then that is the better answer.
            Err(error @ adjust::Error::NotConverged { .. }) => {
                let undetermined = self.undetermined_at_start(pixels, self.options.terms.largest_inflation)?;
                Err(undetermined.unwrap_or(error.into()))
            }
            Err(error) => Err(not_determined(error)),
        }
    }

    fn observation<'p>(
        &'p self,
        index: usize,
        pixels: &'p PlanePixels,
        blocks: Vec<BlockId>,
        weighting: Weighting,
    ) -> PlaneObservation<'p> {
        PlaneObservation {
            sizes: [3, self.terms.held.len(), 6][..blocks.len()].to_vec(),
            blocks,
            chart: &self.charts[self.chart_of[index]].chart,
            pixels,
            world_from_camera: pose_of(&self.captures[index]),
            weighting,
        }
    }

    /// What is not determined, if anything, as far as the derivatives at the start values tell: the same adjustment
    /// made linear, which always ends.
    pub(crate) fn undetermined_at_start(
        &self,
        pixels: &[PlanePixels],
        largest_inflation: f64,
    ) -> Result<Option<Error>> {
        let mut adjustment = Adjustment::new();
        let terms = adjustment.add_block(self.terms.block());
        self.terms.hold(&mut adjustment, terms)?;
        let planes = self.charts.iter().map(|chart| chart.add_to(&mut adjustment)).collect::<Result<Vec<_>>>()?;
        let group = adjustment.add_group("derivatives at the start");
        let start = self.terms.model.parameter_values();
        for (index, capture) in self.captures.iter().enumerate() {
            let mut blocks = vec![planes[self.chart_of[index]], terms];
            let pose = capture.world_from_camera.map(|pose| RigidPose::values(&pose));
            let mut parameters: Vec<&[f64]> = vec![&[0.0; 3], &start];
            if let (Some((_, covariance)), Some(values)) = (weighted(capture), &pose) {
                let step = ParameterBlock::euclidean([0.0; 6]).named(format!("pose of {}", capture.name));
                blocks.push(adjustment.add_block(step));
                adjustment.add_prior(blocks[2], &[0.0; 6], &Covariance::from_matrix(covariance))?;
                parameters.push(values);
            }
            let observation = self.observation(index, &pixels[index], blocks.clone(), Weighting::LeastSquares);
            let reduction =
                observation.reduction(&parameters).map_err(|_| Error::NoPlane { station: capture.name.clone() })?;
            for row in reduction.rows() {
                let [plane, own_terms, pose] = parts(row, self.terms.held.len());
                let parts = blocks.iter().copied().zip([plane, own_terms, pose]);
                adjustment.add_observation(group, LinearObservation::new(0.0, parts), &Covariance::from_sigma(1.0))?;
            }
        }
        match adjustment.solve(&SolveOptions::default()) {
            Ok(solution) => {
                let diagnosis = solution.diagnosis(1.0);
                let (combination, inflation) = (diagnosis.weakest.to_string(), diagnosis.weakest_inflation);
                let weak = inflation > largest_inflation;
                Ok(weak.then_some(Error::PlanesNotDetermined { combination, inflation }))
            }
            Err(error) => Ok(Some(not_determined(error))),
        }
    }

    /// Unknowns of the adjustment.
    pub(crate) fn unknowns(&self) -> usize {
        let planes = self.charts.iter().filter(|chart| !chart.held).count();
        let poses = self.captures.iter().filter(|capture| weighted(capture).is_some()).count();
        self.terms.unknowns() + 3 * planes + 6 * poses
    }

    /// Pixels that take part and weighted components of poses.
    pub(crate) fn observations(&self, pixels: &[PlanePixels]) -> usize {
        let poses = self.captures.iter().filter(|capture| weighted(capture).is_some()).count();
        pixels.iter().map(PlanePixels::used_count).sum::<usize>() + 6 * poses
    }

    pub(crate) fn require_redundancy(&self, pixels: &[PlanePixels]) -> Result<()> {
        if let Some(index) = pixels.iter().position(|pixels| pixels.used_count() < 3) {
            return Err(Error::NoPlane { station: self.captures[index].name.clone() });
        }
        let (differences, unknowns) = (self.observations(pixels), self.unknowns());
        if differences > unknowns { Ok(()) } else { Err(Error::TooFewDifferences { differences, unknowns }) }
    }
}

impl Solved {
    /// The pose of a capture, adjusted or as given.
    pub(crate) fn pose(&self, index: usize, capture: &PlaneCapture<'_>) -> Result<Isometry3<f64>> {
        Ok(self.poses[index].map_or(Ok(pose_of(capture)), |pose| self.solution.pose(pose))?)
    }

    /// The largest change of a term or of a plane since an earlier solution, in standard deviations.
    pub(crate) fn moved_from(&self, earlier: &Self) -> Result<f64> {
        let mut largest = 0.0_f64;
        let pairs = self.planes.iter().zip(&earlier.planes);
        for (block, before) in [(&self.terms, &earlier.terms)].into_iter().chain(pairs) {
            let deviations = self.solution.standard_deviations(*block, Scale::Prior)?;
            let values = self.solution.values(*block)?.iter().zip(earlier.solution.values(*before)?);
            let moves = values.zip(deviations).filter(|(_, deviation)| *deviation > 0.0);
            largest = moves.fold(largest, |largest, ((a, b), deviation)| largest.max((a - b).abs() / deviation));
        }
        Ok(largest)
    }
}

/// Full steps first, as the problem is nearly linear; damped ones where these do not end.
fn descend(adjustment: &Adjustment<'_>, weighting: Weighting) -> std::result::Result<Solution, adjust::Error> {
    let step_tolerance = if weighting == Weighting::Huber { ROUGHLY } else { NEGLIGIBLE };
    let options = |method| SolveOptions { method, step_tolerance, ..SolveOptions::default() };
    let full = SolveOptions { max_iterations: FULL_STEPS, ..options(Method::GaussNewton) };
    match adjustment.solve(&full) {
        Err(adjust::Error::NotConverged { .. }) => adjustment.solve(&options(Method::LevenbergMarquardt)),
        answer => answer,
    }
}

impl ChartedPlane {
    fn add_to(&self, adjustment: &mut Adjustment<'_>) -> Result<BlockId> {
        let names = ["tilt 1", "tilt 2", "distance"].map(|part| format!("{} {part}", self.name));
        let block = adjustment.add_block(ParameterBlock::euclidean([0.0; 3]).with_parameter_names(names));
        if self.held {
            adjustment.hold(block)?;
        }
        Ok(block)
    }
}

/// The error of an adjustment, a defect in the words of planes.
fn not_determined(error: adjust::Error) -> Error {
    let adjust::Error::RankDeficient { combinations, .. } = error else { return error.into() };
    let names: Vec<String> = combinations.iter().map(ToString::to_string).collect();
    Error::PlanesNotDetermined { combination: names.join("; "), inflation: f64::INFINITY }
}

/// The parts of a row that belong to plane, terms and pose.
fn parts(row: &[f64], terms: usize) -> [&[f64]; 3] {
    let (plane, rest) = row.split_at(3);
    let (terms, rest) = rest.split_at(terms);
    [plane, terms, &rest[..rest.len() - 1]]
}

/// The pose of a capture as given; without one its plane is in the camera frame.
pub(crate) fn pose_of(capture: &PlaneCapture<'_>) -> Isometry3<f64> {
    capture.world_from_camera.unwrap_or_else(Isometry3::identity)
}

/// Pose and covariance of a capture whose pose is adjusted.
fn weighted<'c>(capture: &'c PlaneCapture<'_>) -> Option<(&'c Isometry3<f64>, &'c nalgebra::Matrix6<f64>)> {
    capture.world_from_camera.as_ref().zip(capture.covariance.as_ref())
}

fn add_pose(adjustment: &mut Adjustment<'_>, capture: &PlaneCapture<'_>) -> Result<Option<BlockId>> {
    let Some((pose, covariance)) = weighted(capture) else { return Ok(None) };
    let block = adjustment.add_block(ParameterBlock::pose(pose).named(format!("pose of {}", capture.name)));
    adjustment.add_prior(block, &RigidPose::values(pose), &Covariance::from_matrix(covariance))?;
    Ok(Some(block))
}
