//! ICP on sparse clouds of feature points: partners by place and descriptor together.

use nalgebra::{Isometry3, Point3};

use crate::description::features::Features;
use crate::error::Result;
use rigid_pose::{InputError, absolute_orientation, require_length, require_option, require_points};

/// Options of [`align_features`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SparseIcpOptions {
    /// Largest distance of partners at the start, metre; halved whenever the pairs stay the same.
    pub initial_distance_m: f64,
    /// Largest distance of partners at the end, metre.
    pub final_distance_m: f64,
    /// Descriptors of partners resemble each other at least this much: product of the unit vectors. Default 0.7.
    pub min_likeness: f64,
    /// Iterations. Default 50.
    pub max_iterations: usize,
}

impl SparseIcpOptions {
    /// Distances of partners at the start and at the end, metre.
    pub fn new(initial_distance_m: f64, final_distance_m: f64) -> Self {
        Self { initial_distance_m, final_distance_m, min_likeness: 0.7, max_iterations: 50 }
    }

    fn validate(&self) -> Result<()> {
        let is_start = |distance: f64| distance >= self.final_distance_m && distance.is_finite();
        require_option(
            "initial_distance_m",
            self.initial_distance_m,
            "finite and at least the final distance",
            is_start,
        )?;
        require_option("final_distance_m", self.final_distance_m, "positive", |distance| distance > 0.0)?;
        let is_likeness = |likeness| (-1.0..=1.0).contains(&likeness);
        Ok(require_option("min_likeness", self.min_likeness, "between -1 and 1", is_likeness)?)
    }
}

/// Result of [`align_features`].
#[derive(Debug, Clone, PartialEq)]
pub struct SparseAlignment {
    /// Pose: `target = target_from_source * source`.
    pub target_from_source: Isometry3<f64>,
    /// Pairs `[source, target]` of the last iteration.
    pub pairs: Vec<[usize; 2]>,
    /// Root mean square distance of the pairs, metre.
    pub rms_m: f64,
    /// Iterations done.
    pub iterations: usize,
}

/// ICP between feature points `[BeslMcKay1992]`: the partner of a source feature is, among the target features within
/// reach, the one whose descriptor resembles it most. The reach is halved whenever the pairs no longer change.
///
/// # Errors
/// [`InputError::InvalidOption`], [`InputError::LengthMismatch`] for descriptors of different width, [`InputError::NonFinite`] for the
/// guess, [`InputError::TooFewCorrespondences`] below 4 pairs, and those of [`absolute_orientation`].
pub fn align_features(
    source: &Features,
    target: &Features,
    guess: &Isometry3<f64>,
    options: &SparseIcpOptions,
) -> Result<SparseAlignment> {
    options.validate()?;
    require_length("descriptors of the source", target.table.width(), source.table.width())?;
    require_points("guess", &[guess * Point3::origin()])?;
    let mut found = SparseAlignment { target_from_source: *guess, pairs: Vec::new(), rms_m: f64::NAN, iterations: 0 };
    let mut reach = options.initial_distance_m;
    while found.iterations < options.max_iterations.max(1) {
        let pairs = partners(source, target, &found.target_from_source, reach, options.min_likeness as f32);
        if pairs.len() < 4 {
            return Err(InputError::TooFewCorrespondences {
                found: pairs.len(),
                of: source.len(),
                needed: 4,
                max_distance_m: reach,
                iteration: found.iterations,
            }
            .into());
        }
        let from: Vec<Point3<f64>> = pairs.iter().map(|pair| source.points[pair[0]]).collect();
        let to: Vec<Point3<f64>> = pairs.iter().map(|pair| target.points[pair[1]]).collect();
        let orientation = absolute_orientation(&from, &to, None)?;
        found.target_from_source = orientation.target_from_source;
        found.rms_m = orientation.rms_m;
        found.iterations += 1;
        let stays = pairs == found.pairs;
        found.pairs = pairs;
        if stays && reach <= options.final_distance_m {
            break;
        }
        if stays {
            reach = (reach / 2.0).max(options.final_distance_m);
        }
    }
    Ok(found)
}

/// Clouds of features are small: all pairs are looked at. Ties go to the lower index.
fn partners(source: &Features, target: &Features, pose: &Isometry3<f64>, reach: f64, least: f32) -> Vec<[usize; 2]> {
    let partner = |i: usize| {
        let moved = pose * source.points[i];
        let mut best = (least, None);
        for (j, q) in target.points.iter().enumerate() {
            if (q - moved).norm_squared() > reach * reach {
                continue;
            }
            let likeness: f32 = source.table.row(i).iter().zip(target.table.row(j)).map(|(a, b)| a * b).sum();
            if likeness > best.0 {
                best = (likeness, Some(j));
            }
        }
        best.1.map(|j| [i, j])
    };
    (0..source.len()).filter_map(partner).collect()
}
