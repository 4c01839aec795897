//! Which of the targets of known coordinates is which, where nothing but their arrangement tells.

use std::f64::consts::PI;

use camera_model::Camera;
use nalgebra::{Isometry3, Point3};
use statistics::upper_median;

use super::options::{Identification, IdentificationOptions, UnnamedTarget};
use crate::{Error, Result, TargetObservation, approximate_poses, robust_resection};

/// Share of the image's diagonal within which a target is looked for about its predicted place: 4.5 pixels of 176 x 144, what a
/// nominal lens misses at the rim. More finds chance neighbours, less loses targets there.
const REACH_SHARE: f64 = 0.02;
/// Least distance that counts as one, pixel: residuals that happen to vanish prove no more than this.
const LEAST_PX: f64 = 0.25;
/// Nearest neighbours of a target among which those of its neighbours in the image are looked for: in a grid all about it.
const NEIGHBOURS: usize = 8;
/// Points in the image that a search begins from, each with two of its nearest neighbours: enough that some are no false ones.
const STARTS: usize = 12;
/// Poses of one start that are looked at closely, the best first.
const LOOKED_AT: usize = 40;
/// Times that a pose is adjusted to the targets that it names and names them anew.
const ROUNDS: usize = 3;
/// Another way to name at least this share of the points makes the answer ambiguous: a row of seven that is shifted by one keeps
/// six.
const RIVAL_SHARE: f64 = 0.75;
/// Part of a distance, and metre, by which ranges that were not corrected make distances wrong.
const RANGE_ERROR: [f64; 2] = [0.1, 0.1];
/// Another point within so many times the distance of the nearest makes a name uncertain.
const CLEARLY_NEARER: f64 = 2.0;
/// Standard deviation of an image point for a start value, pixel: the lens is not known yet.
const NOMINAL_SIGMA_PX: f64 = 1.0;

/// Names targets by their arrangement: the pose of the camera at which most of them are where targets of known coordinates
/// (`known`, metre) are predicted, without a start value.
///
/// Three neighbours in the image are tried with all threes of neighbouring targets; each of the poses that they leave predicts the
/// others. With n points, k of them within r pixels of m predicted places, and ranges whose median misses are g of the
/// extent S of all targets, chance does as well `N C(n, k) (m π r² / area)^(k−3) C(k, h) (2 g / S)^h` times in N trials, h half of the
/// ranges; k is what makes this least \[Moisan2004\]. Points that are no targets and targets that are hidden do no harm.
///
/// # Errors
/// [`Error::Unidentified`] where chance explains the best arrangement, [`Error::AmbiguousArrangement`] where several fit and no
/// approximate pose decides, [`Error::InvalidTarget`] for numbers that cannot be used.
///
/// ```
/// use orientation::camera_model::{self, Camera, ImageFormat, InteriorOrientation, LensDistortion, pose_from_euler};
/// use orientation::nalgebra::{Point3, Vector3};
/// use orientation::{IdentificationOptions, UnnamedTarget, identify_targets};
///
/// let camera = Camera::new(
///     ImageFormat::new(176, 144, [0.04, 0.04]).map_err(camera_model::Error::from)?,
///     InteriorOrientation { principal_point_mm: [0.0, 0.0], principal_distance_mm: 8.0 },
///     LensDistortion::default(),
/// )?;
/// let known: Vec<_> = (0..12)
///     .map(|k| f64::from(k))
///     .map(|k| Point3::new((1.7 * k).sin(), 0.8 * (2.9 * k).cos(), 0.4 * (1.3 * k).sin()))
///     .collect();
/// let pose = pose_from_euler(Vector3::new(0.2, -0.1, 4.5), [0.05, -0.1, 0.02]);
/// let pixel = |point: &Point3<f64>| camera.project(&pose.inverse_transform_point(point));
/// // The last nine of them, the last first.
/// let seen = known.iter().rev().take(9).map(|point| Ok(UnnamedTarget { pixel: pixel(point)?, range_m: None }));
/// let seen = seen.collect::<Result<Vec<_>, camera_model::Error>>()?;
/// let found = identify_targets(&camera, &known, &seen, &IdentificationOptions::default())?;
/// assert_eq!((found.pairs.len(), found.pairs[0]), (9, [0, 11]));
/// # Ok::<(), orientation::Error>(())
/// ```
pub fn identify_targets(
    camera: &Camera,
    known: &[Point3<f64>],
    seen: &[UnnamedTarget],
    options: &IdentificationOptions,
) -> Result<Identification> {
    camera.validate()?;
    check(known, seen)?;
    let search = Search::new(camera, known, seen);
    let mut best = f64::INFINITY;
    for start in search.starts() {
        let mut fitting: Vec<Hypothesis> = Vec::new();
        for hypothesis in search.from(start) {
            let adjusted = search.adjusted(hypothesis);
            best = best.min(adjusted.log_chance);
            if adjusted.log_chance <= options.level.ln() && !fitting.iter().any(|other| other.is_same(&adjusted)) {
                fitting.push(adjusted);
            }
        }
        if !fitting.is_empty() {
            return search.decided(fitting, options.approximate.as_ref());
        }
    }
    if let Some(pose) = &options.approximate {
        let adjusted = search.adjusted(search.named(pose, 0));
        best = best.min(adjusted.log_chance);
        if adjusted.log_chance <= options.level.ln() {
            return Ok(search.identification(&adjusted));
        }
    }
    Err(Error::Unidentified { seen: seen.len(), known: known.len(), expected_by_chance: best.exp() })
}

fn check(known: &[Point3<f64>], seen: &[UnnamedTarget]) -> Result<()> {
    let refuse = |target, name, value, expected| Err(Error::InvalidTarget { target, name, value, expected });
    for (target, point) in known.iter().enumerate() {
        if let Some(value) = point.iter().find(|value| !value.is_finite()) {
            return refuse(target, "coordinate", *value, "a coordinate is finite");
        }
    }
    for (target, point) in seen.iter().enumerate() {
        if let Some(value) = point.pixel.iter().find(|value| !value.is_finite()) {
            return refuse(target, "pixel", *value, "a coordinate is finite");
        }
        if let Some(value) = point.range_m.filter(|range| !(range.is_finite() && *range > 0.0)) {
            return refuse(target, "range", value, "a range is positive and finite");
        }
    }
    Ok(())
}

/// A point that was seen where a target is predicted.
#[derive(Debug, Clone, Copy)]
struct Match {
    seen: usize,
    known: usize,
    off_px: f64,
    off_m: Option<f64>,
}

/// A pose with what it names.
#[derive(Debug, Clone)]
struct Hypothesis {
    pose: Isometry3<f64>,
    /// The nearest first, as many as chance explains least.
    matches: Vec<Match>,
    /// Logarithm of how often chance does as well.
    log_chance: f64,
    /// Points that the pose came from, which prove nothing.
    free: usize,
}

impl Hypothesis {
    /// Whether most points that both name have one name.
    fn is_same(&self, other: &Self) -> bool {
        let name = |seen: usize| other.matches.iter().find(|other| other.seen == seen).map(|other| other.known);
        let both = || self.matches.iter().filter_map(|own| Some((own.known, name(own.seen)?)));
        2 * both().filter(|(own, other)| own == other).count() > both().count()
    }
}

struct Search<'a> {
    camera: &'a Camera,
    known: &'a [Point3<f64>],
    seen: &'a [UnnamedTarget],
    /// The nearest of each target.
    neighbours: Vec<Vec<usize>>,
    reach_px: f64,
    /// Largest distance of a target from their middle, twice, metre.
    extent_m: f64,
    log_trials: f64,
}

impl<'a> Search<'a> {
    fn new(camera: &'a Camera, known: &'a [Point3<f64>], seen: &'a [UnnamedTarget]) -> Self {
        let nearest = |own: &Point3<f64>| {
            let mut order: Vec<usize> = (0..known.len()).filter(|&k| known[k] != *own).collect();
            order.sort_by(|a, b| (known[*a] - own).norm().total_cmp(&(known[*b] - own).norm()).then(a.cmp(b)));
            order.truncate(NEIGHBOURS);
            order
        };
        let neighbours: Vec<Vec<usize>> = known.iter().map(nearest).collect();
        let middle = known.iter().map(|point| point.coords).sum::<nalgebra::Vector3<f64>>() / known.len().max(1) as f64;
        let extent_m = 2.0 * known.iter().map(|point| (point.coords - middle).norm()).fold(0.0, f64::max);
        let threes: usize = neighbours.iter().map(|near| near.len() * near.len().saturating_sub(1)).sum();
        let size = [camera.format.width, camera.format.height].map(|size| size as f64);
        Self {
            camera,
            known,
            seen,
            neighbours,
            reach_px: REACH_SHARE * size[0].hypot(size[1]),
            extent_m,
            // Three points leave up to four poses.
            log_trials: ((4 * threes * STARTS.min(seen.len())).max(1) as f64).ln(),
        }
    }

    /// Threes of neighbours in the image, spread over it.
    fn starts(&self) -> Vec<[usize; 3]> {
        let place = |k: usize| nalgebra::Vector2::from(self.seen[k].pixel);
        let start = |own: usize| {
            let mut others: Vec<usize> = (0..self.seen.len()).filter(|&other| other != own).collect();
            others.sort_by(|a, b| (place(*a) - place(own)).norm().total_cmp(&(place(*b) - place(own)).norm()));
            let first = *others.first()?;
            let [u, v] = [first, own].map(place);
            // Three in a line leave their pose open.
            let is_beside = |&other: &usize| {
                let (a, b) = (u - v, place(other) - v);
                a.perp(&b).abs() > 0.3 * a.norm() * b.norm()
            };
            Some([own, first, others.iter().copied().skip(1).find(is_beside)?])
        };
        let step = self.seen.len().div_ceil(STARTS).max(1);
        (0..self.seen.len()).step_by(step).filter_map(start).collect()
    }

    /// The poses that three points leave, the most convincing first.
    fn from(&self, start: [usize; 3]) -> Vec<Hypothesis> {
        let mut found: Vec<Hypothesis> = Vec::new();
        for (first, near) in self.neighbours.iter().enumerate() {
            for &second in near {
                for &third in near.iter().filter(|third| **third != second) {
                    let three = [first, second, third];
                    if self.ranges_allow(start, three) {
                        let targets = [0, 1, 2].map(|k| self.target(start[k], three[k], false));
                        let poses = approximate_poses(self.camera, &targets);
                        found.extend(poses.iter().map(|pose| self.named(pose, 3)));
                    }
                }
            }
            // The order is one of numbers and of the trials: the same in every run.
            found.sort_by(|a, b| a.log_chance.total_cmp(&b.log_chance));
            found.truncate(LOOKED_AT);
        }
        found
    }

    /// Whether the distances of three points agree with those of three targets, where there are ranges.
    fn ranges_allow(&self, seen: [usize; 3], known: [usize; 3]) -> bool {
        let point = |k: usize| {
            let seen = &self.seen[seen[k]];
            seen.range_m.map(|range| self.camera.point(seen.pixel, range))
        };
        [[0, 1], [1, 2], [2, 0]].into_iter().all(|[a, b]| {
            let (Some(from), Some(to)) = (point(a), point(b)) else { return true };
            let (observed, true_m) = ((from - to).norm(), (self.known[known[a]] - self.known[known[b]]).norm());
            (observed - true_m).abs() <= RANGE_ERROR[0] * true_m + RANGE_ERROR[1]
        })
    }

    fn target(&self, seen: usize, known: usize, with_range: bool) -> TargetObservation {
        let target = TargetObservation::new(self.known[known], self.seen[seen].pixel, NOMINAL_SIGMA_PX);
        match self.seen[seen].range_m.filter(|_| with_range) {
            Some(range) => target.with_range(range, RANGE_ERROR[1]),
            None => target,
        }
    }

    /// All points that lie where targets are predicted, one to one, the nearest first; and how many targets are in the image.
    fn matches(&self, pose: &Isometry3<f64>, reach_px: f64) -> (Vec<Match>, usize) {
        let (mut near, mut predicted) = (Vec::new(), 0_usize);
        for (known, point) in self.known.iter().enumerate() {
            let Ok(observed) = self.camera.observe(pose, point) else { continue };
            let pixel = self.camera.format.pixel_from_image(observed.image_mm);
            if !self.camera.contains(pixel) {
                continue;
            }
            predicted += 1;
            for (seen, own) in self.seen.iter().enumerate() {
                let off_px = (own.pixel[0] - pixel[0]).hypot(own.pixel[1] - pixel[1]);
                if off_px <= reach_px {
                    let off_m = own.range_m.map(|range| (range - observed.range_m).abs());
                    near.push(Match { seen, known, off_px, off_m });
                }
            }
        }
        near.sort_by(|a, b| a.off_px.total_cmp(&b.off_px));
        let mut matches: Vec<Match> = Vec::new();
        for own in near {
            if !matches.iter().any(|other| other.seen == own.seen || other.known == own.known) {
                matches.push(own);
            }
        }
        (matches, predicted)
    }

    /// What a pose names, of as many points as chance explains least.
    fn named(&self, pose: &Isometry3<f64>, free: usize) -> Hypothesis {
        let (mut matches, predicted) = self.matches(pose, self.reach_px);
        let trials = if free > 0 { self.log_trials } else { 0.0 };
        let area = (self.camera.format.width * self.camera.format.height) as f64;
        let log_chance = |k: usize| {
            let radius = matches[k - 1].off_px.max(LEAST_PX);
            let share = (predicted as f64 * PI * radius * radius / area).min(1.0);
            let by_place = log_choices(self.seen.len(), k) + (k - free) as f64 * share.ln();
            trials + by_place + self.log_chance_of_ranges(&matches[..k])
        };
        let counts = free + 1..=matches.len();
        let best = counts.map(|k| (log_chance(k), k)).min_by(|a, b| a.0.total_cmp(&b.0));
        let (log_chance, count) = best.unwrap_or((f64::INFINITY, 0));
        matches.truncate(count);
        Hypothesis { pose: *pose, matches, log_chance, free }
    }

    /// Of half the ranges agreeing as well as they do: some may be those of something else.
    fn log_chance_of_ranges(&self, matches: &[Match]) -> f64 {
        let mut off: Vec<f64> = matches.iter().filter_map(|own| own.off_m).collect();
        if off.is_empty() || self.extent_m <= 0.0 {
            return 0.0;
        }
        let (count, half) = (off.len(), off.len().div_ceil(2));
        let share = (2.0 * upper_median(&mut off).max(1e-3) / self.extent_m).min(1.0);
        (log_choices(count, half) + half as f64 * share.ln()).min(0.0)
    }

    /// The same, with poses that are adjusted to what they name.
    fn adjusted(&self, mut hypothesis: Hypothesis) -> Hypothesis {
        for _ in 0..ROUNDS {
            let targets: Vec<TargetObservation> =
                hypothesis.matches.iter().map(|own| self.target(own.seen, own.known, true)).collect();
            let pose = match robust_resection(self.camera, &targets) {
                Ok(pose) => Some(pose),
                // Which of the poses it is makes no difference to the names.
                Err(Error::Ambiguous { poses, .. }) => poses.first().copied(),
                Err(_) => None,
            };
            let next = pose.map(|pose| self.named(&pose, hypothesis.free));
            let Some(next) = next.filter(|next| next.log_chance < hypothesis.log_chance) else { break };
            hypothesis = next;
        }
        hypothesis
    }

    /// The best of those that fit, if no other is as good, or the approximate pose decides.
    fn decided(&self, mut fitting: Vec<Hypothesis>, approximate: Option<&Isometry3<f64>>) -> Result<Identification> {
        fitting.sort_by(|a, b| a.log_chance.total_cmp(&b.log_chance));
        let most = fitting.iter().map(|own| own.matches.len()).max().unwrap_or(0);
        fitting.retain(|own| own.matches.len() as f64 >= RIVAL_SHARE * most as f64);
        if let (Some(pose), true) = (approximate, fitting.len() > 1) {
            let off = |own: &Hypothesis| {
                let distance = |own: &Match| {
                    let predicted = self.camera.project(&pose.inverse_transform_point(&self.known[own.known])).ok()?;
                    let pixel = self.seen[own.seen].pixel;
                    Some((pixel[0] - predicted[0]).hypot(pixel[1] - predicted[1]))
                };
                let distances = own.matches.iter().map(|own| distance(own).unwrap_or(f64::INFINITY));
                upper_median(&mut distances.collect::<Vec<_>>())
            };
            let mut ways: Vec<(f64, Hypothesis)> = fitting.drain(..).map(|own| (off(&own), own)).collect();
            ways.sort_by(|a, b| a.0.total_cmp(&b.0));
            let nearest = ways[0].0;
            let near = ways.into_iter().filter(|(off, _)| *off <= CLEARLY_NEARER * nearest);
            fitting = near.map(|(_, own)| own).collect();
        }
        match fitting.as_slice() {
            [only] => Ok(self.identification(only)),
            ways => Err(Error::AmbiguousArrangement { ways: ways.len() }),
        }
    }

    /// With the points farther off, where the lens moves them, that no other target is near to.
    fn identification(&self, found: &Hypothesis) -> Identification {
        let (all, _) = self.matches(&found.pose, CLEARLY_NEARER * self.reach_px);
        let own = |own: &Match| found.matches.iter().any(|other| (other.seen, other.known) == (own.seen, own.known));
        let place = |known: usize| self.camera.project(&found.pose.inverse_transform_point(&self.known[known])).ok();
        let is_alone = |own: &Match| {
            let pixel = self.seen[own.seen].pixel;
            let is_far =
                |at: [f64; 2]| (at[0] - pixel[0]).hypot(at[1] - pixel[1]) > CLEARLY_NEARER * own.off_px.max(LEAST_PX);
            let mut others = (0..self.known.len()).filter(|known| *known != own.known).filter_map(place);
            own.off_px <= self.reach_px && others.all(is_far)
        };
        let mut pairs: Vec<[usize; 2]> =
            all.iter().filter(|m| own(m) || is_alone(m)).map(|m| [m.seen, m.known]).collect();
        pairs.sort_unstable();
        Identification { pairs, world_from_camera: found.pose, expected_by_chance: found.log_chance.exp() }
    }
}

/// Logarithm of the number of ways to choose k of n.
fn log_choices(n: usize, k: usize) -> f64 {
    (0..k.min(n)).map(|i| ((n - i) as f64 / (i + 1) as f64).ln()).sum()
}
