//! Two views of the same targets.

use adjust::SolveOptions;
use camera_model::Camera;
use nalgebra::{Isometry3, Matrix6, Point3, SMatrix};
use statistics::chi_squared_limit;

use crate::relative::bundle::{Bundle, ObjectPoint, TieObservation};
use crate::relative::candidates::{CUT, LEVEL, SAMPLE, candidates, cost, rivals, squares};
use crate::relative::epipolar::EpipolarCondition;
use crate::relative::minima::{Minimum, hold_base, minimum, robust};
use crate::relative::rays::{ImagePoint, Pair};
use crate::relative::rotation_only::{across, rotation_only};
use crate::{Error, Result};

/// What the pose half-way between two minima may cost more than the worse of them where they are one, which some
/// pairs at the edge of the test for gross errors have pulled apart: one standard deviation of one pair.
const BARRIER: f64 = 1.0;
/// Starts that cost more than the best by so many times what decides lead to no rival.
const HOPELESS: f64 = 3.0;
/// Largest standard deviation (radian) of the direction of the base: beyond, a linearisation does not describe it.
const WEAKEST_DIRECTION: f64 = 0.3;
/// Angles at which rays meet, in their standard deviations, below which a pair gives no point: its distance would be
/// known to less than 10 %, and a covariance does not describe that.
const LEAST_PARALLAX: f64 = 10.0;

/// How to orient two views.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RelativeOrientationOptions {
    /// Seed of the choice of samples, where there are too many to try all. Default 0.
    pub seed: u64,
    /// Options of the adjustment. Default: that of [`SolveOptions`].
    pub solve: SolveOptions,
}

/// The pose of a second view in the frame of the first, up to scale, and the points that both see.
#[derive(Debug, Clone, PartialEq)]
pub struct RelativeOrientation {
    /// Pose of the second camera in the frame of the first. Its translation, the base, has length one: nothing in two
    /// images says how long it is.
    pub first_from_second: Isometry3<f64>,
    /// Covariance of the tangent step `[dt (axes of the first), dtheta (axes of the second, radian)]`, prior-scaled.
    /// Its rank is five: there is no variance along the base. See [`Self::five_parameters`].
    pub covariance: Matrix6<f64>,
    /// The object points, in the order of the pairs; `None` for gross errors, and where the rays meet at an angle of less
    /// than ten standard deviations (such pairs tell attitude, but their distance is hardly known).
    pub points: Vec<Option<ObjectPoint>>,
    /// Pairs that contradict the others and took no part, ascending. An error along the epipolar line cannot be seen.
    pub gross_errors: Vec<usize>,
    /// Standardised residual of each pair's epipolar condition; NaN for gross errors and where nothing controls it.
    pub standardised: Vec<f64>,
    /// Pairs that agree, minus five.
    pub redundancy: i64,
    /// Posterior standard deviation of unit weight; `None` without redundancy.
    pub sigma0: Option<f64>,
}

impl RelativeOrientation {
    /// The five independent parameters: basis (6 × 5) of the tangent step, two directions across the base and the three
    /// turns, and their covariance.
    pub fn five_parameters(&self) -> (SMatrix<f64, 6, 5>, SMatrix<f64, 5, 5>) {
        let mut basis = SMatrix::<f64, 6, 5>::zeros();
        basis.fixed_view_mut::<3, 2>(0, 0).copy_from(&across(&self.first_from_second.translation.vector).transpose());
        basis.fixed_view_mut::<3, 3>(3, 2).fill_with_identity();
        (basis, basis.transpose() * self.covariance * basis)
    }
}

/// Orients a second view relative to a first one from the image points of the same targets in both: `views[0][i]` and
/// `views[1][i]` belong to target i. Lenses are taken off by the cameras, which may be one and the same.
///
/// Essential matrices of samples of five pairs `[Nister2004]` are judged by all pairs, with what a gross error costs cut;
/// each distinct one is brought to its minimum on conditions `a · (t × R b) = 0`, gross errors are left out by data
/// snooping, and the best is adjusted together with the points.
///
/// # Errors
/// [`Error::TooFewTargets`] below five pairs, [`Error::LengthMismatch`], [`Error::InvalidTarget`], [`Error::Camera`];
/// [`Error::NoAgreement`] where no pose fits at least half of the pairs; [`Error::NoBase`] where a rotation alone explains them;
/// [`Error::WeakBase`]; [`Error::Ambiguous`] with all poses that fit as well: two for a flat field of targets, up to ten for five
/// pairs; [`Error::Adjustment`].
///
/// ```
/// use orientation::camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion};
/// use orientation::nalgebra::{Isometry3, Point3, Vector3};
/// use orientation::{ImagePoint, RelativeOrientationOptions, orient_two_views};
///
/// let interior = InteriorOrientation { principal_point_mm: [0.0, 0.0], principal_distance_mm: 8.0 };
/// let camera = Camera::new(ImageFormat::new(176, 144, [0.04, 0.04])?, interior, LensDistortion::default())?;
/// let second = Isometry3::new(Vector3::new(1.0, 0.1, 0.0), Vector3::new(0.02, 0.3, -0.05));
/// let targets = (0..12).map(|i| {
///     let t = f64::from(i);
///     Point3::new((2.0 * t).sin(), (3.1 * t).cos(), -3.5 + (5.3 * t).sin())
/// });
/// let (mut left, mut right) = (Vec::new(), Vec::new());
/// for target in targets {
///     left.push(ImagePoint::new(camera.project(&target)?, 0.1));
///     right.push(ImagePoint::new(camera.project(&second.inverse_transform_point(&target))?, 0.1));
/// }
/// let found = orient_two_views([&camera; 2], [&left, &right], &RelativeOrientationOptions::default())?;
/// assert!(found.first_from_second.rotation.angle_to(&second.rotation) < 1e-6);
/// assert!(found.first_from_second.translation.vector.angle(&second.translation.vector) < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn orient_two_views(
    cameras: [&Camera; 2],
    views: [&[ImagePoint]; 2],
    options: &RelativeOrientationOptions,
) -> Result<RelativeOrientation> {
    cameras[0].validate()?;
    cameras[1].validate()?;
    let pairs = Pair::all(cameras, views)?;
    if pairs.len() < SAMPLE {
        return Err(Error::TooFewTargets { found: pairs.len(), needed: SAMPLE });
    }
    let found = minima(&pairs, options)?;
    let Some(best) = found.first() else { return Err(Error::NoAgreement { agreeing: 0, pairs: pairs.len() }) };
    let agreeing = best.used.iter().filter(|used| **used).count();
    if 2 * agreeing < pairs.len() {
        return Err(Error::NoAgreement { agreeing, pairs: pairs.len() });
    }
    let unit = unit(best.vtpv, agreeing);
    // By the pairs that agree with the best: what other gross errors have in common makes no rival.
    let used: Vec<Pair> = pairs.iter().zip(&best.used).filter(|(_, used)| **used).map(|(pair, _)| *pair).collect();
    require_base(&used, unit, &options.solve)?;
    let is_rival = |other: &&Minimum| {
        // Uncut: it has to explain each of them.
        let second = squares(&used, &other.first_from_second);
        other.cost - best.cost < CUT * unit || rivals([best.vtpv, second], (agreeing - SAMPLE) as f64, unit)
    };
    let equal: Vec<&Minimum> = found.iter().filter(is_rival).collect();
    if let Some(second) = equal.get(1) {
        let poses = equal.iter().map(|minimum| minimum.first_from_second).collect();
        return Err(Error::Ambiguous { poses, difference: second.cost - best.cost });
    }
    with_points(cameras, views, &pairs, best, &options.solve)
}

/// All different minima that the samples lead to, best first.
fn minima(pairs: &[Pair], options: &RelativeOrientationOptions) -> Result<Vec<Minimum>> {
    let starts = candidates(pairs, options.seed).into_iter().map(|start| robust(pairs, &start).unwrap_or(start));
    let starts = distinct(pairs, starts.map(|pose| (cost(pairs, &pose), pose)).collect());
    let least = starts.first().map_or(0.0, Valley::cost);
    let hopeless = least + HOPELESS * CUT * unit(least, pairs.len());
    let (mut found, mut failure): (Vec<Minimum>, _) = (Vec::new(), None);
    for (_, start) in starts.iter().filter(|start| start.cost() <= hopeless) {
        match minimum(pairs, start, &options.solve) {
            Ok(new) => found.push(new),
            Err(error) => failure = failure.or(Some(error)),
        }
    }
    match failure {
        Some(error) if found.is_empty() => Err(error),
        _ => Ok(distinct(pairs, found)),
    }
}

/// A pose and what it costs.
trait Valley {
    fn pose(&self) -> &Isometry3<f64>;
    fn cost(&self) -> f64;
}

impl Valley for (f64, Isometry3<f64>) {
    fn pose(&self) -> &Isometry3<f64> {
        &self.1
    }
    fn cost(&self) -> f64 {
        self.0
    }
}

impl Valley for Minimum {
    fn pose(&self) -> &Isometry3<f64> {
        &self.first_from_second
    }
    fn cost(&self) -> f64 {
        self.cost
    }
}

/// Those between which a barrier lies, best first.
fn distinct<T: Valley>(pairs: &[Pair], mut found: Vec<T>) -> Vec<T> {
    found.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
    let mut distinct: Vec<T> = Vec::new();
    for new in found {
        if !distinct.iter().any(|better| is_one(pairs, better, &new)) {
            distinct.push(new);
        }
    }
    distinct
}

/// Whether nothing separates two minima.
fn is_one<T: Valley>(pairs: &[Pair], a: &T, b: &T) -> bool {
    let (first, second) = (a.pose(), b.pose());
    let base = first.translation.vector + second.translation.vector;
    let Some(base) = base.try_normalize(f64::EPSILON) else { return false };
    let half = first.rotation.try_slerp(&second.rotation, 0.5, f64::EPSILON).unwrap_or(first.rotation);
    cost(pairs, &Isometry3::from_parts(base.into(), half)) <= a.cost().max(b.cost()) + BARRIER
}

/// Variance factor by which differences are judged: where the given deviations are too small, so are the differences that
/// they make look decisive.
fn unit(vtpv: f64, agreeing: usize) -> f64 {
    if agreeing > SAMPLE { (vtpv / (agreeing - SAMPLE) as f64).max(1.0) } else { 1.0 }
}

/// Fails where a rotation alone explains the pairs. Not the fall of `vᵀPv` by a base is tested: its direction and the
/// distances of all pairs are free to follow the noise, and no chi-squared says how far.
fn require_base(used: &[Pair], unit: f64, options: &SolveOptions) -> Result<()> {
    let vtpv = rotation_only(used, options)?;
    let limit = unit * chi_squared_limit((2 * used.len() - 3) as f64, LEVEL);
    if vtpv > limit { Ok(()) } else { Err(Error::NoBase { vtpv, limit }) }
}

/// The pose adjusted together with the points: those that have no distance take part with their condition.
fn with_points(
    cameras: [&Camera; 2],
    views: [&[ImagePoint]; 2],
    pairs: &[Pair],
    best: &Minimum,
    options: &SolveOptions,
) -> Result<RelativeOrientation> {
    let pose = best.first_from_second;
    let place = |(pair, used): (&Pair, &bool)| {
        let far = pair.parallax(&pose) < LEAST_PARALLAX;
        let point = Point3::from(pair.first.direction * (pair.depths(&pose)[0] / pair.sine_squared(&pose)));
        (*used && !far).then_some(point)
    };
    let points: Vec<Option<Point3<f64>>> = pairs.iter().zip(&best.used).map(place).collect();
    let seen = |station: usize| {
        let tie =
            move |(target, image): (usize, &ImagePoint)| TieObservation { station, target, image: *image, range: None };
        views[station].iter().enumerate().map(tie)
    };
    let sightings: Vec<TieObservation> = seen(0).chain(seen(1)).collect();
    let mut bundle = Bundle::new(&cameras, &[Isometry3::identity(), pose], &points, &sightings)?;
    let conditions = bundle.adjustment.add_group("conditions");
    let second = bundle.stations[1];
    for (index, pair) in pairs.iter().enumerate() {
        if best.used[index] && points[index].is_none() {
            EpipolarCondition::new(pair).add(&mut bundle.adjustment, conditions, second)?;
        }
    }
    hold_base(&mut bundle.adjustment, second)?;
    let solution = bundle.adjustment.solve(options)?;
    let (first_from_second, covariance) = bundle.pose(&solution, 1)?;
    let found = RelativeOrientation {
        first_from_second,
        covariance,
        points: bundle.object_points(&solution)?,
        gross_errors: (0..pairs.len()).filter(|&index| !best.used[index]).collect(),
        standardised: best.standardised.clone(),
        redundancy: solution.redundancy(),
        sigma0: solution.sigma0(),
    };
    let sigma_direction_rad = found.covariance.fixed_view::<3, 3>(0, 0).symmetric_eigenvalues().max().max(0.0).sqrt();
    // Not `>`: NaN is no direction either.
    if sigma_direction_rad <= WEAKEST_DIRECTION { Ok(found) } else { Err(Error::WeakBase { sigma_direction_rad }) }
}
