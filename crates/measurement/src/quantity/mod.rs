//! Quantities with their derivatives by points, and their intervals.

mod angles;
mod distances;
mod magnitude;

use nalgebra::{Point3, Unit as UnitVector, Vector3};
use point_uncertainty::{CommonErrors, Gradient, Shares, Source, shares};
use statistics::Distribution;

pub use angles::angle;
pub use distances::{PlaneDistance, axis_distance, plane_distance, plane_to_plane, point_distance};

use crate::{Cloud, Error, Result};

/// Unit of a quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// Lengths.
    Metre,
    /// Angles.
    Radian,
    /// Volumes.
    CubicMetre,
}

impl Unit {
    /// `m`, `rad` or `m3`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Metre => "m",
            Self::Radian => "rad",
            Self::CubicMetre => "m3",
        }
    }
}

/// A value computed from points, with its derivatives by them.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    /// The value.
    pub value: f64,
    /// Its unit.
    pub unit: Unit,
    /// Its derivatives by points.
    pub gradient: Gradient,
    /// Where the value is the length of a vector (a distance, an angle between directions): derivatives of what stands across that
    /// vector, in the same unit. Beside them, a short vector's length is not normally distributed.
    pub across: Vec<Gradient>,
}

/// A value with its standard deviation by sources and its interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Its unit.
    pub unit: Unit,
    /// Standard deviation from all sources.
    pub sigma: f64,
    /// Lower and upper end of the two-sided interval.
    pub interval: [f64; 2],
    /// Probability that an interval found this way does not hold the true value.
    pub level: f64,
    /// Parts of the variance by source.
    pub shares: Shares,
}

/// Probability that an interval misses the true value: the 95 % of metrology.
pub(crate) const LEVEL: f64 = 0.05;

impl Quantity {
    pub(crate) fn new(value: f64, unit: Unit, gradient: Gradient) -> Self {
        Self { value, unit, gradient, across: Vec::new() }
    }

    pub(crate) fn times(self, factor: f64) -> Self {
        let scaled = |gradient: Gradient| scaled(&gradient, factor);
        Self {
            value: self.value * factor,
            unit: self.unit,
            gradient: scaled(self.gradient),
            across: self.across.into_iter().map(scaled).collect(),
        }
    }

    /// The same without its sign, for distances whose side means nothing.
    #[must_use]
    pub fn magnitude(self) -> Self {
        let sign = if self.value < 0.0 { -1.0 } else { 1.0 };
        self.times(sign)
    }

    /// Value, standard deviation and two-sided 95 % interval from all sources.
    ///
    /// Standard deviations are stated, not estimated from few residuals: the interval is that of a normal distribution, and of the
    /// length of a normally distributed vector where the value is one.
    pub fn estimate(&self, cloud: &Cloud<'_>) -> Estimate {
        self.with_shares(&|gradient| shares(gradient, cloud.errors, cloud.common))
    }

    /// The same as if one source had no errors: what a result would state that knows nothing of it.
    pub fn estimate_without(&self, cloud: &Cloud<'_>, source: Source) -> Estimate {
        let common: CommonErrors = cloud.common.without(source);
        self.with_shares(&|gradient| {
            let mut shares = shares(gradient, cloud.errors, &common);
            if matches!(source, Source::Noise | Source::Sensor) {
                shares.parts[source as usize] = 0.0;
            }
            shares
        })
    }

    fn with_shares(&self, shares_of: &dyn Fn(&Gradient) -> Shares) -> Estimate {
        let shares = shares_of(&self.gradient);
        let (value, sigma) = (self.value, shares.sigma());
        let across: Vec<f64> = self.across.iter().map(|gradient| shares_of(gradient).sigma()).collect();
        let interval = if across.is_empty() {
            let half = Distribution::Normal.critical(LEVEL) * sigma;
            [value - half, value + half]
        } else {
            magnitude::interval(value, sigma, &across, LEVEL)
        };
        Estimate { value, unit: self.unit, sigma, interval, level: LEVEL, shares }
    }
}

/// A place with the derivatives of its coordinates by points of the cloud.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// The place, metre.
    pub position: Point3<f64>,
    /// Derivatives of x, y and z.
    pub gradients: [Gradient; 3],
}

impl Place {
    /// A place that is known without error.
    pub fn fixed(position: Point3<f64>) -> Self {
        Self { position, gradients: [const { Vec::new() }; 3] }
    }

    /// One point of the cloud.
    ///
    /// # Errors
    /// [`Error::NoSuchPoint`]; [`Error::OutOfDomain`] where it has no position.
    pub fn of_point(cloud: &Cloud<'_>, point: usize) -> Result<Self> {
        Self::mean(cloud, &[point])
    }

    /// The mean of several points.
    ///
    /// # Errors
    /// [`Error::NoSuchPoint`]; [`Error::OutOfDomain`] of none, or of points without position.
    pub fn mean(cloud: &Cloud<'_>, points: &[usize]) -> Result<Self> {
        let count = points.len() as f64;
        let mut sum = Vector3::zeros();
        for index in points {
            let missing = Error::NoSuchPoint { index: *index, points: cloud.points.len() };
            sum += cloud.points.get(*index).ok_or(missing)?.coords;
        }
        let mean = sum / count;
        if let Some(value) = mean.iter().find(|value| !value.is_finite()) {
            let expected = "a mean needs at least one point, each with finite coordinates";
            return Err(Error::OutOfDomain { name: "mean of points", value: *value, expected });
        }
        let by = |axis| points.iter().map(|point| (*point, Vector3::ith(axis, 1.0 / count))).collect();
        Ok(Self { position: mean.into(), gradients: [by(0), by(1), by(2)] })
    }

    /// Derivatives of the coordinate along a direction.
    pub(crate) fn along(&self, direction: &Vector3<f64>) -> Gradient {
        sum(&[(&self.gradients[0], direction.x), (&self.gradients[1], direction.y), (&self.gradients[2], direction.z)])
    }
}

/// A direction with its derivatives by points of the cloud.
#[derive(Debug, Clone, PartialEq)]
pub struct Direction {
    /// The direction.
    pub vector: UnitVector<Vector3<f64>>,
    /// Directions across it that it tilts to, with the derivatives of the tilt, radian.
    pub(crate) tilts: Vec<(Vector3<f64>, Gradient)>,
}

impl Direction {
    /// A direction that is known without error, such as the vertical.
    pub fn fixed(vector: UnitVector<Vector3<f64>>) -> Self {
        Self { vector, tilts: Vec::new() }
    }

    /// Derivatives of the tilt towards a direction.
    pub(crate) fn towards(&self, direction: &Vector3<f64>) -> Gradient {
        let parts: Vec<(&Gradient, f64)> =
            self.tilts.iter().map(|(tilt, gradient)| (gradient, tilt.dot(direction))).collect();
        sum(&parts)
    }
}

/// A gradient times a number.
pub(crate) fn scaled(gradient: &Gradient, factor: f64) -> Gradient {
    gradient.iter().map(|(point, by)| (*point, by * factor)).collect()
}

/// Gradients times numbers, added up.
pub(crate) fn sum(parts: &[(&Gradient, f64)]) -> Gradient {
    parts.iter().flat_map(|(gradient, factor)| scaled(gradient, *factor)).collect()
}
