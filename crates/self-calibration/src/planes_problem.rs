//! Captures of planes as one adjustment.

use adjust::{
    Adjustment, BlockId, Covariance, LinearObservation, Observation, ParameterBlock, RigidPose, Solution, SolveOptions,
};
use camera_model::Camera;
use error_models::AmplitudeHyperbola;
use nalgebra::{Isometry3, Point3, Vector3};

use crate::options::{HyperbolaUse, LinearTerms};
use crate::planes_geometry::PlaneChart;
use crate::planes_observation::{PlaneObservation, Weighting};
use crate::planes_pixels::PlanePixels;
use crate::planes_start::plane_through;
use crate::{Error, Plane, PlaneCalibrationOptions, PlaneCapture, Result};

/// Rounds in which pixels are left out and taken in again. A few at the limit may go to and fro for ever; it does not
/// matter which of them the last round had.
const ROUNDS: usize = 20;

/// Multiple of the largest inflation from which the start values are enough to refuse.
const HOPELESS: f64 = 10.0;

/// The robust stage only chooses pixels: it ends at steps of this share of a standard deviation.
const ROUGHLY: f64 = 1e-2;

/// Median of the absolute values of a normal distribution, in standard deviations.
const MEDIAN_OF_NORMAL: f64 = 0.674_489_75;

/// Scatter, in standard deviations as given, below which it is rounding.
const SMALLEST_SCATTER: f64 = 1e-6;

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
        let pixels = captures
            .iter()
            .map(|capture| PlanePixels::new(capture.frame, camera, &terms.model, hyperbola.as_ref(), &options.pixels));
        let pixels = pixels.collect::<Result<Vec<_>>>()?;
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

    /// Least squares, without the pixels that a robust adjustment finds far off.
    pub(crate) fn solve_without_gross_errors(&mut self) -> Result<Solved> {
        self.require_redundancy()?;
        // Far beyond the limit no descent is worth while; near it the solution tells better than the start.
        if let Some(error) = self.undetermined_at_start(HOPELESS * self.options.terms.largest_inflation)? {
            return Err(error);
        }
        let Some(limit) = self.options.rejection else { return self.solve(Weighting::LeastSquares, None) };
        let mut solved = self.solve(Weighting::Huber, None)?;
        let limit = limit * scatter(self.residuals(&solved)?.concat());
        for round in 0..ROUNDS {
            let changed = self.select(&self.residuals(&solved)?, limit);
            if !changed && round > 0 {
                break;
            }
            self.require_redundancy()?;
            solved = self.solve(Weighting::LeastSquares, Some(&solved))?;
        }
        Ok(solved)
    }

    /// Lets the pixels take part whose residual is within the limit. Whether that is a change.
    fn select(&mut self, residuals: &[Vec<f64>], limit: f64) -> bool {
        let mut changed = false;
        for (pixels, residuals) in self.pixels.iter_mut().zip(residuals) {
            for (used, residual) in pixels.used.iter_mut().zip(residuals) {
                let within = residual.abs() <= limit;
                changed |= *used != within;
                *used = within;
            }
        }
        changed
    }

    /// Residuals of all pixels, capture by capture, in standard deviations.
    pub(crate) fn residuals(&self, solved: &Solved) -> Result<Vec<Vec<f64>>> {
        let terms = solved.solution.values(solved.terms)?;
        let mut residuals = Vec::with_capacity(self.captures.len());
        for (index, capture) in self.captures.iter().enumerate() {
            let chart = self.chart_of[index];
            let plane = solved.solution.values(solved.planes[chart])?;
            let pose = solved.poses[index].map_or(Ok(pose_of(capture)), |pose| solved.solution.pose(pose))?;
            residuals.push(self.pixels[index].residuals(&self.charts[chart].chart, plane, terms, &pose));
        }
        Ok(residuals)
    }

    /// One adjustment of the pixels that take part, from an earlier one where there is one.
    fn solve(&self, weighting: Weighting, from: Option<&Solved>) -> Result<Solved> {
        let mut adjustment = Adjustment::new();
        let terms = adjustment.add_block(self.terms.block());
        self.terms.hold(&mut adjustment, terms)?;
        let planes = self.charts.iter().map(|chart| chart.add_to(&mut adjustment)).collect::<Result<Vec<_>>>()?;
        let poses = self.captures.iter().map(|capture| add_pose(&mut adjustment, capture));
        let poses = poses.collect::<Result<Vec<_>>>()?;
        let group = adjustment.add_group("ranges to planes");
        for (index, pose) in poses.iter().enumerate() {
            let blocks: Vec<_> = [planes[self.chart_of[index]], terms].into_iter().chain(*pose).collect();
            let observation = self.observation(index, blocks, weighting);
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
        let mut options = SolveOptions::default();
        if weighting == Weighting::Huber {
            options.step_tolerance = ROUGHLY;
        }
        match adjustment.solve(&options) {
            Ok(solution) => Ok(Solved { solution, terms, planes, poses }),
            // What is not determined often has no end either: then that is the better answer.
            Err(error @ adjust::Error::NotConverged { .. }) => {
                Err(self.undetermined_at_start(self.options.terms.largest_inflation)?.unwrap_or(error.into()))
            }
            Err(error) => Err(not_determined(error)),
        }
    }

    fn observation(&self, index: usize, blocks: Vec<BlockId>, weighting: Weighting) -> PlaneObservation<'_> {
        PlaneObservation {
            sizes: [3, self.terms.held.len(), 6][..blocks.len()].to_vec(),
            blocks,
            chart: &self.charts[self.chart_of[index]].chart,
            pixels: &self.pixels[index],
            world_from_camera: pose_of(&self.captures[index]),
            weighting,
        }
    }

    /// What is not determined, if anything, as far as the derivatives at the start values tell: the same adjustment
    /// made linear, which always ends.
    fn undetermined_at_start(&self, largest_inflation: f64) -> Result<Option<Error>> {
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
            let observation = self.observation(index, blocks.clone(), Weighting::LeastSquares);
            let mut reduction =
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
    pub(crate) fn observations(&self) -> usize {
        let poses = self.captures.iter().filter(|capture| weighted(capture).is_some()).count();
        self.pixels.iter().map(PlanePixels::used_count).sum::<usize>() + 6 * poses
    }

    fn require_redundancy(&self) -> Result<()> {
        if let Some(index) = self.pixels.iter().position(|pixels| pixels.used_count() < 3) {
            return Err(Error::NoPlane { station: self.captures[index].name.clone() });
        }
        let (differences, unknowns) = (self.observations(), self.unknowns());
        if differences > unknowns { Ok(()) } else { Err(Error::TooFewDifferences { differences, unknowns }) }
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

/// Standard deviation of the bulk of some residuals.
fn scatter(mut residuals: Vec<f64>) -> f64 {
    if residuals.is_empty() {
        return SMALLEST_SCATTER;
    }
    let middle = residuals.len() / 2;
    for residual in &mut residuals {
        *residual = residual.abs();
    }
    let (_, median, _) = residuals.select_nth_unstable_by(middle, f64::total_cmp);
    (*median / MEDIAN_OF_NORMAL).max(SMALLEST_SCATTER)
}
