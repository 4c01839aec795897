//! What a calibration's page shows beside its summary.

use std::collections::BTreeMap;

use pipeline::Result;
use range_io::calibration::Calibration;
use report::{Figure, pattern_figures};
use self_calibration::CalibrationOutcome;

use crate::calibrate::FoundTable;
use crate::calibrate::figures::{
    coverage, image_residuals, map, point_uncertainty, range_error, range_terms, residuals,
};
use crate::calibrate::point_uncertainty::{PointUncertainty, amplitude_of};

/// The figures of each section.
#[derive(Default)]
pub(crate) struct Figures {
    /// Probability of a value as far from zero if the parameter were zero, by its name; known while the adjustment is.
    pub(crate) significance_p: BTreeMap<String, f64>,
    pub(crate) range_errors: Vec<Figure>,
    pub(crate) range_coverage: Vec<Figure>,
    /// Range terms part by part, of a calibration from surfaces.
    pub(crate) range_terms: Vec<Figure>,
    pub(crate) offsets: Vec<Figure>,
    pub(crate) point_uncertainty: Vec<Figure>,
    pub(crate) image_residuals: Vec<Figure>,
    pub(crate) residuals: Vec<Figure>,
    pub(crate) network: Vec<Figure>,
}

impl Figures {
    pub(crate) fn new(outcome: &CalibrationOutcome, table: Option<&FoundTable>) -> Result<Self> {
        let plain = |figures: Vec<(Figure, String)>| figures.into_iter().map(Figure::from).collect::<Vec<_>>();
        let source = PointUncertainty { camera: &outcome.camera, range_models: &outcome.range_models };
        let covariance = &outcome.first_order_covariance;
        let points = point_uncertainty::figures(&source, &outcome.estimated, covariance, amplitude_of(outcome))?;
        let range_errors = plain(range_error::figures(outcome));
        let range_coverage = if range_errors.is_empty() { Vec::new() } else { plain(coverage::range_figure(outcome)) };
        let mut image = image_residuals::figures(outcome);
        image.extend(coverage::image_figure(outcome));
        let network = match outcome.stations.as_slice() {
            [] => Vec::new(),
            stations => plain(map::figures(&outcome.camera, stations, &outcome.targets, &[])),
        };
        let significance =
            outcome.parameters.iter().map(|parameter| (parameter.name.clone(), parameter.significance_p));
        Ok(Self {
            significance_p: significance.collect(),
            range_errors,
            range_coverage,
            range_terms: Vec::new(),
            offsets: table.map(offset_figures).transpose()?.unwrap_or_default(),
            point_uncertainty: plain(points),
            image_residuals: plain(image),
            residuals: plain(residuals::figures(outcome)),
            network,
        })
    }
}

impl Figures {
    /// With the range terms part by part, beside those of a calibration where it has any.
    pub(crate) fn with_range_terms(self, outcome: &CalibrationOutcome, beside: Option<&Calibration>) -> Self {
        let range_terms = range_terms::figures(outcome, beside).into_iter().map(Figure::from).collect();
        Self { range_terms, ..self }
    }
}

fn offset_figures(table: &FoundTable) -> Result<Vec<Figure>> {
    let pattern = &table.pattern;
    Ok(pattern_figures(pattern.width, &pattern.offset_m, &pattern.sigma_m)?)
}
