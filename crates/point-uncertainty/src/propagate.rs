//! From errors of points to the variance of what is computed from them.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, Matrix3, Vector3};

use crate::{CommonErrors, Source};

/// The errors of a cloud's points.
pub trait PointErrors: Sync {
    /// Covariance of what the point has for itself, square metre, world axes.
    fn noise(&self, point: usize) -> Matrix3<f64>;

    /// The neighbourhood that shares an error of the sensor with the point, and the point's shift by one standard deviation of
    /// it, metre, world axes. `None` where nothing is shared.
    fn sensor(&self, point: usize) -> Option<(u64, Vector3<f64>)>;

    /// Adds the derivatives of the point by the common errors that move it: column and metre a unit, world axes.
    fn common(&self, point: usize, derivatives: &mut Vec<(usize, Vector3<f64>)>);
}

/// Derivatives of a quantity by points: indices of points, and change of the quantity a metre of shift. A point may stand
/// in it more than once; its derivatives add up.
pub type Gradient = Vec<(usize, Vector3<f64>)>;

/// Parts of a variance by their source, in the quantity's unit squared.
///
/// Where sources are correlated, as poses are with the calibration that they were found with, each takes half of what both
/// have in common; a part may then be negative. The parts add up to the variance.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Shares {
    /// In the order of [`Source::ALL`].
    pub parts: [f64; 5],
}

impl Shares {
    /// The part of a source.
    pub fn of(&self, source: Source) -> f64 {
        self.parts[source as usize]
    }

    /// The variance.
    pub fn variance(&self) -> f64 {
        self.parts.iter().sum::<f64>().max(0.0)
    }

    /// The standard deviation.
    pub fn sigma(&self) -> f64 {
        self.variance().sqrt()
    }
}

/// Variance of a quantity with the shares of all sources.
pub fn shares(gradient: &Gradient, points: &dyn PointErrors, common: &CommonErrors) -> Shares {
    let form = Form::new(gradient, points, common);
    let mut shares = Shares::default();
    for (source, part) in Source::ALL.into_iter().zip(&mut shares.parts) {
        *part = match source {
            Source::Noise => form.noise_with(&form, points),
            Source::Sensor => form.sensor_with(&form),
            _ => form.common_with(&form, common, |error| common.errors()[error].source == source),
        };
    }
    shares
}

/// Covariance matrix of several quantities from all sources.
pub fn covariance(gradients: &[Gradient], points: &dyn PointErrors, common: &CommonErrors) -> DMatrix<f64> {
    let forms: Vec<Form> = gradients.iter().map(|gradient| Form::new(gradient, points, common)).collect();
    let mut covariance = DMatrix::zeros(forms.len(), forms.len());
    for (row, first) in forms.iter().enumerate() {
        for (column, second) in forms.iter().enumerate().take(row + 1) {
            let together = first.noise_with(second, points)
                + first.sensor_with(second)
                + first.common_with(second, common, |_| true);
            covariance[(row, column)] = together;
            covariance[(column, row)] = together;
        }
    }
    covariance
}

/// Covariance of one point from all sources, square metre, world axes.
pub fn point_covariance(point: usize, points: &dyn PointErrors, common: &CommonErrors) -> Matrix3<f64> {
    let mut derivatives = Vec::new();
    points.common(point, &mut derivatives);
    let mut covariance = points.noise(point);
    if let Some((_, shift)) = points.sensor(point) {
        covariance += shift * shift.transpose();
    }
    for (row, first) in &derivatives {
        for (column, second) in &derivatives {
            covariance += first * second.transpose() * common.covariance()[(*row, *column)];
        }
    }
    (covariance + covariance.transpose()) * 0.5
}

/// A quantity as a linear function of all errors.
struct Form {
    points: BTreeMap<usize, Vector3<f64>>,
    neighbourhoods: BTreeMap<u64, f64>,
    common: Vec<f64>,
}

impl Form {
    fn new(gradient: &Gradient, cloud: &dyn PointErrors, all: &CommonErrors) -> Self {
        let mut points = BTreeMap::new();
        for (point, by) in gradient {
            *points.entry(*point).or_insert_with(Vector3::zeros) += by;
        }
        let mut neighbourhoods = BTreeMap::new();
        let mut common = vec![0.0; all.errors().len()];
        let mut derivatives = Vec::new();
        for (point, by) in &points {
            if let Some((neighbourhood, shift)) = cloud.sensor(*point) {
                *neighbourhoods.entry(neighbourhood).or_insert(0.0) += by.dot(&shift);
            }
            derivatives.clear();
            cloud.common(*point, &mut derivatives);
            for (column, derivative) in &derivatives {
                common[*column] += by.dot(derivative);
            }
        }
        Self { points, neighbourhoods, common }
    }

    fn noise_with(&self, other: &Self, points: &dyn PointErrors) -> f64 {
        let both = self.points.iter().filter_map(|(point, by)| Some((point, by, other.points.get(point)?)));
        both.map(|(point, first, second)| first.dot(&(points.noise(*point) * second))).sum()
    }

    fn sensor_with(&self, other: &Self) -> f64 {
        self.neighbourhoods.iter().filter_map(|(at, by)| Some(by * other.neighbourhoods.get(at)?)).sum()
    }

    /// Of the rows that `takes_part`, with all columns.
    fn common_with(&self, other: &Self, common: &CommonErrors, takes_part: impl Fn(usize) -> bool) -> f64 {
        let covariance = common.covariance();
        let mut sum = 0.0;
        for (row, first) in self.common.iter().enumerate().filter(|(row, first)| **first != 0.0 && takes_part(*row)) {
            let with: f64 = other.common.iter().enumerate().map(|(at, second)| covariance[(row, at)] * second).sum();
            sum += first * with;
        }
        sum
    }
}
