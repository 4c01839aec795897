//! Spatial resection of one station.

use adjust::{Adjustment, BlockId, Covariance, ObservationId, ParameterBlock, Scale, Solution, SolveOptions};
use camera_model::Camera;
use nalgebra::{Isometry3, Matrix6};

use crate::approximation::approximations;
use crate::linearity::curvature;
use crate::model::{TargetEquations, sigmas};
use crate::target::check;
use crate::{Error, Result, TargetObservation};

/// Two adjusted poses closer than this (radian, and metre for each metre of distance) are one: each is converged to
/// far less.
const SAME_POSE: f64 = 1e-4;

/// The second minimum is refused as an explanation when its `v'Pv` is larger by this: chi-squared of one degree of
/// freedom exceeds it once in a thousand.
const DECISIVE: f64 = 10.83;

/// Curvature beyond which a pose is refused: the errors of simulated stations there are several times what their
/// covariances say, and up to half of it they are what they say.
const TOO_CURVED: f64 = 1.0;

/// How to orient a station.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ResectionOptions {
    /// An approximate pose `world_from_camera`. Without one (the default) the start is found in closed form, and other
    /// poses that explain the observations as well are reported; with one, the minimum next to it is taken.
    pub approximate: Option<Isometry3<f64>>,
    /// Options of the adjustment. Default: that of [`SolveOptions`].
    pub solve: SolveOptions,
}

/// Where the approximate pose came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Start {
    /// It was given.
    Given,
    /// Absolute orientation of the points that ranges and image points make.
    Ranges,
    /// Grunert's resection from three image points.
    ImagePoints,
}

/// The pose of a station with its quality.
#[derive(Debug, Clone, PartialEq)]
pub struct Resection {
    /// Pose; its translation is the perspective centre.
    pub world_from_camera: Isometry3<f64>,
    /// Covariance of the tangent step `[dt (world axes, metre), dtheta (camera axes, radian)]`, prior-scaled: the
    /// standard deviations of the observations are taken as they were given.
    pub covariance: Matrix6<f64>,
    /// Share of the observations' change that the linearisation misses two standard deviations along the weakest
    /// direction. Up to 0.5 the errors are distributed as the covariance says; over 1 the pose is refused.
    pub curvature: f64,
    /// Observations minus unknowns.
    pub redundancy: i64,
    /// Posterior standard deviation of unit weight; `None` without redundancy. Far from 1, the given standard
    /// deviations are wrong or there is a gross error.
    pub sigma0: Option<f64>,
    /// Residuals of the targets, in their order.
    pub residuals: Vec<TargetResidual>,
    /// Iterations of the adjustment.
    pub iterations: usize,
    /// Where the approximate pose came from.
    pub start: Start,
}

/// Residuals `observed - model` of one target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetResidual {
    /// Column and row.
    pub pixel: [f64; 2],
    /// Range in metre, where one was observed.
    pub range_m: Option<f64>,
    /// Largest of them over its own standard deviation (Baarda's w, prior-scaled); NaN where nothing controls them.
    /// Over 3.3 (one in a thousand) a gross error is suspected; the largest of all is looked at first.
    pub standardised: f64,
}

/// Finds the pose of a camera from targets of known coordinates: image points and, where there are, ranges.
///
/// Three targets that are not collinear suffice with a range on each; from image points alone three have up to four
/// solutions, which is answered with [`Error::Ambiguous`], and four or more decide. Ranges must be corrected for their
/// systematic errors before.
///
/// # Errors
/// [`Error::TooFewTargets`], [`Error::CollinearTargets`], [`Error::InvalidTarget`]; [`Error::NoApproximation`],
/// [`Error::Ambiguous`] and [`Error::WeakGeometry`] where the observations do not settle one pose;
/// [`Error::Adjustment`] where the adjustment does not converge or is rank deficient.
///
/// ```
/// use orientation::camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion, pose_from_euler};
/// use orientation::nalgebra::{Point3, Vector3};
/// use orientation::{ResectionOptions, TargetObservation, resect};
///
/// let interior = InteriorOrientation { principal_point_mm: [0.0, 0.0], principal_distance_mm: 8.0 };
/// let camera = Camera::new(ImageFormat::new(176, 144, [0.04, 0.04])?, interior, LensDistortion::default())?;
/// let truth = pose_from_euler(Vector3::new(0.2, -0.1, 3.0), [0.05, -0.1, 0.02]);
/// // Three targets, metre: image points good to 0.1 pixel, ranges to 5 mm.
/// let mut targets = Vec::new();
/// for xyz in [[-0.8, -0.6, 0.0], [0.8, -0.6, 0.0], [0.1, 0.6, 0.3]] {
///     let point = Point3::from(xyz);
///     let seen = camera.observe(&truth, &point)?;
///     let pixel = camera.format.pixel_from_image(seen.image_mm);
///     targets.push(TargetObservation::new(point, pixel, 0.1).with_range(seen.range_m, 0.005));
/// }
/// let station = resect(&camera, &targets, &ResectionOptions::default())?;
/// assert!((station.world_from_camera.translation.vector - truth.translation.vector).norm() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn resect(camera: &Camera, targets: &[TargetObservation], options: &ResectionOptions) -> Result<Resection> {
    camera.validate()?;
    check(targets)?;
    let found = match options.approximate {
        Some(pose) => vec![adjusted(camera, targets, &pose, Start::Given, &options.solve)?],
        None => minima(camera, targets, &options.solve)?,
    };
    let Some((best, others)) = found.split_first() else {
        return Err(Error::NoApproximation { targets: targets.len() });
    };
    require_decision(best, others)?;
    require_strength(&best.resection)?;
    Ok(best.resection.clone())
}

/// A converged pose and its objective.
struct Minimum {
    resection: Resection,
    vtpv: f64,
}

/// All different minima that the approximations lead to, best first.
fn minima(camera: &Camera, targets: &[TargetObservation], options: &SolveOptions) -> Result<Vec<Minimum>> {
    let mut found: Vec<Minimum> = Vec::new();
    let mut failure = None;
    for approximation in approximations(camera, targets) {
        match adjusted(camera, targets, &approximation.world_from_camera, approximation.start, options) {
            Ok(minimum) if found.iter().any(|other| is_same(targets, &other.resection, &minimum.resection)) => {}
            Ok(minimum) => found.push(minimum),
            Err(error) => failure = failure.or(Some(error)),
        }
    }
    found.sort_by(|a, b| a.vtpv.total_cmp(&b.vtpv));
    match failure {
        Some(error) if found.is_empty() => Err(error),
        _ => Ok(found),
    }
}

fn is_same(targets: &[TargetObservation], a: &Resection, b: &Resection) -> bool {
    let (a, b) = (&a.world_from_camera, &b.world_from_camera);
    let shift = (a.translation.vector - b.translation.vector).norm();
    a.rotation.angle_to(&b.rotation) < SAME_POSE && shift < SAME_POSE * mean_distance(targets, a)
}

fn mean_distance(targets: &[TargetObservation], world_from_camera: &Isometry3<f64>) -> f64 {
    let centre = world_from_camera.translation.vector;
    targets.iter().map(|target| (target.point.coords - centre).norm()).sum::<f64>() / targets.len() as f64
}

/// Fails where another minimum explains the observations about as well.
fn require_decision(best: &Minimum, others: &[Minimum]) -> Result<()> {
    // Where the given deviations are too small, so are the differences that they make look decisive.
    let unit = best.resection.sigma0.unwrap_or(1.0).max(1.0);
    let rivals: Vec<_> = others.iter().filter(|other| other.vtpv - best.vtpv < DECISIVE * unit * unit).collect();
    match rivals.first() {
        Some(second) => Err(Error::Ambiguous {
            poses: std::iter::once(best).chain(rivals.iter().copied()).map(|m| m.resection.world_from_camera).collect(),
            difference: second.vtpv - best.vtpv,
        }),
        None => Ok(()),
    }
}

/// Fails where the pose is so uncertain that its covariance cannot be believed.
fn require_strength(resection: &Resection) -> Result<()> {
    if resection.curvature <= TOO_CURVED {
        return Ok(());
    }
    let largest = |start: usize| resection.covariance.diagonal().fixed_rows::<3>(start).max().sqrt();
    let [sigma_position_m, sigma_attitude_rad] = [largest(0), largest(3)];
    Err(Error::WeakGeometry { sigma_position_m, sigma_attitude_rad, curvature: resection.curvature })
}

/// Improves an approximate pose by least squares.
fn adjusted(
    camera: &Camera,
    targets: &[TargetObservation],
    approximate: &Isometry3<f64>,
    start: Start,
    options: &SolveOptions,
) -> Result<Minimum> {
    let mut adjustment = Adjustment::new();
    let pose = adjustment.add_block(ParameterBlock::pose(approximate).named("pose"));
    let group = adjustment.add_group("targets");
    let mut observations = Vec::with_capacity(targets.len());
    for (index, target) in targets.iter().enumerate() {
        let point = weighted_point(&mut adjustment, index, target)?;
        let equations = TargetEquations::new(camera, target, pose, point);
        let covariance = Covariance::from_sigmas(&sigmas(camera, target));
        observations.push(adjustment.add_observation(group, equations, &covariance)?);
    }
    let solution = adjustment.solve(options)?;
    let covariance = solution.covariance(pose, Scale::Prior)?;
    let covariance = Matrix6::from_fn(|row, column| covariance[(row, column)]);
    let world_from_camera = solution.pose(pose)?;
    let distance = mean_distance(targets, &world_from_camera);
    let resection = Resection {
        world_from_camera,
        covariance,
        curvature: curvature(camera, targets, &world_from_camera, &covariance, distance),
        redundancy: solution.redundancy(),
        sigma0: solution.sigma0(),
        residuals: residuals(camera, &solution, &observations)?,
        iterations: solution.iterations(),
        start,
    };
    Ok(Minimum { resection, vtpv: solution.vtpv() })
}

/// A target whose coordinates are observations too is an unknown with a prior.
fn weighted_point(
    adjustment: &mut Adjustment<'_>,
    index: usize,
    target: &TargetObservation,
) -> Result<Option<BlockId>> {
    let Some(covariance) = target.point_covariance else { return Ok(None) };
    let coordinates: [f64; 3] = target.point.into();
    let block = adjustment.add_block(ParameterBlock::euclidean(coordinates).named(format!("target {index}")));
    adjustment.add_prior(block, &coordinates, &Covariance::from_matrix(&covariance))?;
    Ok(Some(block))
}

fn residuals(camera: &Camera, solution: &Solution, observations: &[ObservationId]) -> Result<Vec<TargetResidual>> {
    let standardised = solution.standardised_residuals(Scale::Prior)?;
    let [pitch_x, pitch_y] = camera.format.pixel_pitch_mm;
    observations
        .iter()
        .map(|&id| {
            let v = solution.residual(id)?;
            let largest = standardised[solution.rows(id)?].iter().map(|w| w.abs()).fold(f64::NAN, f64::max);
            // Rows run downwards, y upwards.
            let pixel = [v[0] / pitch_x, -v[1] / pitch_y];
            Ok(TargetResidual { pixel, range_m: v.get(2).copied(), standardised: largest })
        })
        .collect()
}
