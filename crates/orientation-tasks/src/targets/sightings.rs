//! Rows of `observations.csv` as sightings of one station after the other.

use std::collections::{BTreeMap, BTreeSet};

use orientation::ObservedRange;
use pipeline::Result;
use range_io::tables::{PlacedRows, TargetObservation};

use crate::camera::SurveyCamera;

/// An image point, with a range where there is one that is corrected.
#[derive(Debug, Clone)]
pub(crate) struct Sighting {
    pub(crate) target: String,
    pub(crate) pixel: [f64; 2],
    pub(crate) sigma_pixel: [f64; 2],
    pub(crate) range: Option<ObservedRange>,
    /// Line of the file.
    pub(crate) line: usize,
}

/// Stations in the order of the file with what they see.
#[derive(Debug, Default)]
pub(crate) struct Sightings {
    pub(crate) stations: Vec<(String, Vec<Sighting>)>,
    /// Ranges that the calibration has no correction for.
    pub(crate) without_range: usize,
}

impl Sightings {
    pub(crate) fn new(
        camera: &SurveyCamera,
        observations: &PlacedRows<TargetObservation>,
        [sigma_pixel, sigma_range_m]: [Option<f64>; 2],
    ) -> Result<Self> {
        let mut found = Self::default();
        let (mut places, mut seen) = (BTreeMap::new(), BTreeSet::new());
        for (index, row) in observations.rows.iter().enumerate() {
            let place = *places.entry(row.station.clone()).or_insert_with(|| {
                found.stations.push((row.station.clone(), Vec::new()));
                found.stations.len() - 1
            });
            if !seen.insert((place, row.target.as_str())) {
                let reason = format!("is `{}`, which station {} has observed in a row above", row.target, row.station);
                return Err(observations.error(index, "target", reason).into());
            }
            // A range alone gives no direction.
            let Some(pixel) = row.pixel else { continue };
            let without = |column: &str, option: &str| {
                observations.error(index, column, format!("is empty: state it, or give {option}"))
            };
            let sigma_pixel = row.sigma_pixel.or(sigma_pixel.map(|sigma| [sigma; 2]));
            let sigma_pixel = sigma_pixel.ok_or_else(|| without("sigma_col", "--sigma-pixel"))?;
            let mut range = None;
            if let Some(range_m) = row.range_m {
                let sigma = row.sigma_range_m.or(sigma_range_m);
                let sigma_m = sigma.ok_or_else(|| without("sigma_range", "--sigma-range"))?;
                let time = row.integration_time_s.or(camera.times(&row.station)[1]);
                let range_m = camera.corrected(range_m, pixel, row.amplitude, time)?;
                range = (range_m > 0.0 && range_m.is_finite()).then_some(ObservedRange { range_m, sigma_m });
                found.without_range += usize::from(range.is_none());
            }
            let sighting =
                Sighting { target: row.target.clone(), pixel, sigma_pixel, range, line: observations.line(index) };
            if let Some((_, own)) = found.stations.get_mut(place) {
                own.push(sighting);
            }
        }
        Ok(found)
    }

    pub(crate) fn uses_ranges(&self) -> bool {
        self.stations.iter().flat_map(|(_, own)| own).any(|seen| seen.range.is_some())
    }
}
