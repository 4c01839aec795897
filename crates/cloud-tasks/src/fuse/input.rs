//! The usable points of a result, as the crate `fusion` takes them.

use commands::{Error, Result, json};
use nalgebra::{Matrix3, Point3, Vector3};
use point_uncertainty::PointErrors;

use super::summary::FuseSummary;
use crate::request::FuseRequest;
use crate::result::ResultCloud;

/// Points without flag that have a position and a noise.
pub(crate) struct Usable<'a> {
    pub cloud: &'a ResultCloud,
    /// Index of each among the points of the cloud.
    pub indices: Vec<usize>,
    pub points: Vec<Point3<f64>>,
    pub frames: Vec<u32>,
    /// Perspective centre of each frame.
    pub centres: Vec<Point3<f64>>,
    /// NaN where there is none.
    pub amplitudes: Vec<f64>,
}

impl<'a> Usable<'a> {
    pub fn new(cloud: &'a ResultCloud, asked: &FuseRequest) -> Result<Self> {
        let errors = &cloud.errors;
        if !cloud.has_common {
            let remedy = match &cloud.fused_from {
                Some(result) => format!("it is a fused cloud: name the result that it was made of, {result}"),
                None => "run the pipeline again to have it written".to_owned(),
            };
            return Err(slip(format!(
                "{}: there is no common_errors.ron, which tells where the frames stood and what their points have in common; {remedy}",
                asked.result.display()
            )));
        }
        let is_known = |index: &usize| {
            let variance = errors.noise(*index).trace();
            cloud.points[*index].iter().all(|value| value.is_finite()) && variance.is_finite()
        };
        let indices: Vec<usize> = cloud.usable.iter().copied().filter(is_known).collect();
        Ok(Self {
            points: indices.iter().map(|index| cloud.points[*index]).collect(),
            frames: indices.iter().map(|index| errors.frame[*index]).collect(),
            centres: errors.stations.iter().map(|of| of.world_from_camera().translation.vector.into()).collect(),
            amplitudes: indices.iter().map(|index| errors.amplitude(*index)).collect(),
            cloud,
            indices,
        })
    }

    /// The points with what was found of their common errors taken off.
    pub fn moved(&self, corrections: &[f64]) -> Vec<Point3<f64>> {
        let mut buffer = Vec::new();
        self.indices.iter().map(|index| moved(self.cloud, *index, corrections, &mut buffer)).collect()
    }

    /// The same error with the points as the cloud counts them.
    pub fn in_cloud(&self, error: fusion::Error) -> fusion::Error {
        use fusion::Error as E;
        let of = |point: usize| self.indices.get(point).copied().unwrap_or(point);
        match error {
            E::AtCentre { point, frame } => E::AtCentre { point: of(point), frame },
            E::Variance { point, value } => E::Variance { point: of(point), value },
            E::Derivative { point, column, errors, value } => E::Derivative { point: of(point), column, errors, value },
            E::NonFinite { what: "point", index } => E::NonFinite { what: "point", index: of(index) },
            other => other,
        }
    }
}

/// A point of the cloud with these values of the common errors taken off.
pub(crate) fn moved(
    cloud: &ResultCloud,
    index: usize,
    corrections: &[f64],
    buffer: &mut Vec<(usize, Vector3<f64>)>,
) -> Point3<f64> {
    buffer.clear();
    cloud.errors.common(index, buffer);
    cloud.points[index] - buffer.iter().map(|(column, by)| by * corrections[*column]).sum::<Vector3<f64>>()
}

impl PointErrors for Usable<'_> {
    fn noise(&self, point: usize) -> Matrix3<f64> {
        self.cloud.errors.noise(self.indices[point])
    }

    fn sensor(&self, point: usize) -> Option<(u64, Vector3<f64>)> {
        self.cloud.errors.sensor(self.indices[point])
    }

    fn common(&self, point: usize, derivatives: &mut Vec<(usize, Vector3<f64>)>) {
        self.cloud.errors.common(self.indices[point], derivatives);
    }
}

/// What is wrong with what was asked for.
pub(crate) fn slip(message: impl Into<String>) -> Error {
    Error::Request { command: "fuse", message: message.into() }
}

/// Why there is no fused cloud: a finding, or a slip in what was asked for.
pub(crate) fn refused(summary: &FuseSummary, error: fusion::Error) -> Result<Error> {
    use fusion::Error as E;
    match error {
        E::Empty | E::NoSurface { .. } | E::Coincident(_) | E::CellsBelowNoise { .. } => {
            let mut summary = summary.clone();
            summary.refused = Some(error.to_string());
            Ok(Error::Refused { summary: json(&summary)?, source: error.into(), written: None })
        }
        other => Ok(slip(other.to_string())),
    }
}
