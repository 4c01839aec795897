use multiview_registration::PointModel;
use nalgebra::Point3;

use super::SurfaceTerm;
use super::pixels::StationPixels;

/// How the points of all stations depend on the estimated terms: along their rays, by the design row of Eq. 14.
pub(super) struct RangeTermModel<'a> {
    pub(super) terms: &'a [SurfaceTerm],
    /// Values of the known model.
    pub(super) start: Vec<f64>,
    pub(super) stations: Vec<StationPixels>,
}

impl PointModel for RangeTermModel<'_> {
    fn names(&self) -> Vec<String> {
        self.terms.iter().map(|term| term.name.clone()).collect()
    }

    fn prior(&self) -> (Vec<f64>, Vec<f64>) {
        (self.start.clone(), self.terms.iter().map(|term| term.prior_sigma).collect())
    }

    fn point(
        &self,
        station: usize,
        index: usize,
        parameters: &[f64],
        derivatives: Option<&mut [[f64; 3]]>,
    ) -> Point3<f64> {
        let pixels = &self.stations[station];
        let ray = pixels.rays[index];
        if let Some(derivatives) = derivatives {
            for (derivative, change) in derivatives.iter_mut().zip(pixels.row(index, parameters.len())) {
                *derivative = (ray * -change).into();
            }
        }
        Point3::from(ray * pixels.range_m(index, parameters))
    }
}

impl RangeTermModel<'_> {
    /// Root mean square effect on the ranges of a unit of each term, metre per unit.
    pub(super) fn effects(&self) -> Vec<f64> {
        let count = self.terms.len();
        let mut squares = vec![0.0; count];
        let mut pixels = 0_usize;
        for station in &self.stations {
            pixels += station.rays.len();
            for row in station.rows.chunks_exact(count) {
                for (sum, value) in squares.iter_mut().zip(row) {
                    *sum += f64::from(*value).powi(2);
                }
            }
        }
        squares.into_iter().map(|sum| (sum / pixels.max(1) as f64).sqrt()).collect()
    }
}
