//! What surfaces gave, in the form of a network's outcome.

use error_models::{ModelSet, NamedParameter, ParameterStatus};
use nalgebra::{Point3, Vector3};
use range_calibration::{SurfaceCalibration, SurfaceCapture};
use range_image::Flags;
use range_io::calibration::Calibration;
use self_calibration::{
    AdjustedStation, CalibratedParameter, CalibrationOutcome, Component, GroupQuality, Method, ObservationQuality,
    Verdict,
};

use crate::calibrate::start::Start;

/// Residuals kept of all stations together: more would make the report heavy and show nothing new.
const MOST_RESIDUALS: usize = 20_000;

type Result<T> = std::result::Result<T, self_calibration::Error>;

/// The calibration as tables, summary and report want it.
pub(super) fn outcome(
    found: &SurfaceCalibration,
    captures: &[SurfaceCapture<'_>],
    start: &Start,
    time: Option<f64>,
) -> Result<CalibrationOutcome> {
    let covariance = found.covariance();
    let registration = &found.after;
    let residuals = residuals(found, captures, start)?;
    let squares: f64 = residuals.iter().map(|quality| quality.residual.powi(2)).sum();
    let group = GroupQuality {
        name: Component::Range.name().to_owned(),
        observations: residuals.len(),
        redundancy: registration.redundancy as f64,
        rms: (squares / residuals.len().max(1) as f64).sqrt(),
        sigma0: registration.sigma0,
    };
    let poses = registration.world_from_station.iter().zip(&registration.covariance).zip(captures);
    let stations = poses.map(|((pose, covariance), capture)| AdjustedStation {
        name: capture.name.to_owned(),
        world_from_camera: *pose,
        covariance: *covariance,
    });
    let unknowns = 6 * captures.len() - 6 + found.estimated_names().len();
    let vtpv = registration.sigma0.map_or(f64::NAN, |sigma0| sigma0 * sigma0 * registration.redundancy as f64);
    let observations = usize::try_from(registration.redundancy).unwrap_or(0) + unknowns;
    let (n, k) = (observations as f64, unknowns as f64);
    Ok(CalibrationOutcome {
        method: Method::OneStep,
        camera: *found.camera(),
        range_models: vec![(time, found.model().clone())],
        parameters: parameters(found)?,
        estimated: found.estimated_names().to_vec(),
        first_order_covariance: covariance.clone(),
        covariance,
        stations: stations.collect(),
        targets: Vec::new(),
        residuals,
        groups: vec![group],
        decisions: Vec::new(),
        diagnosis: diagnosis(found),
        doubts: doubts(found, captures),
        causes: Vec::new(),
        unestimated: Vec::new(),
        observations,
        unknowns,
        datum_defect: 6,
        redundancy: registration.redundancy,
        vtpv,
        sigma0: registration.sigma0,
        aic: vtpv + 2.0 * k,
        bic: vtpv + k * n.ln(),
        trace: Vec::new(),
    })
}

fn parameters(found: &SurfaceCalibration) -> Result<Vec<CalibratedParameter>> {
    let covariance = found.covariance();
    let sigma = |name: &str| {
        let at = found.estimated_names().iter().position(|estimated| estimated == name);
        at.map(|at| covariance[(at, at)].max(0.0).sqrt())
    };
    let camera = Calibration::from_models(found.camera(), &ModelSet::default(), None);
    let camera = camera.map_or_else(|_| Vec::new(), |calibration| calibration.parameters);
    let calibrated = |parameter: NamedParameter| {
        let sigma = sigma(&parameter.name);
        CalibratedParameter {
            // The covariance carries what residuals are beyond their noise already.
            sigma_posterior: sigma.unwrap_or(0.0),
            sigma_prior: sigma.unwrap_or(0.0),
            status: if sigma.is_some() { ParameterStatus::Estimated } else { ParameterStatus::Held },
            name: parameter.name,
            value: parameter.value,
            unit: parameter.unit,
            significance_p: f64::NAN,
        }
    };
    Ok(camera.into_iter().chain(found.parameters()?).map(calibrated).collect())
}

/// Distances of pixels from the surfaces that other stations saw there, along their rays.
fn residuals(
    found: &SurfaceCalibration,
    captures: &[SurfaceCapture<'_>],
    start: &Start,
) -> Result<Vec<ObservationQuality>> {
    let format = start.camera.format;
    let pixels = format.width * format.height * captures.len();
    let step = (pixels as f64 / MOST_RESIDUALS as f64).sqrt().ceil().max(1.0) as usize;
    let mut all = Vec::new();
    for (station, capture) in captures.iter().enumerate() {
        let (mut points, mut seen) = (Vec::new(), Vec::new());
        for row in (0..format.height).step_by(step) {
            for col in (0..format.width).step_by(step) {
                let Some(pixel) = Pixel::new(found, capture, [col, row]) else { continue };
                points.push(Point3::from(pixel.ray * (pixel.range_m - pixel.correction_m)));
                seen.push(pixel);
            }
        }
        let across = found
            .after
            .point_residuals(station, &points)
            .map_err(|reason| range_calibration::Error::Registration { station: capture.name.to_owned(), reason })?;
        let across = of_these_surfaces(across);
        all.extend(seen.iter().zip(across).filter_map(|(pixel, across)| pixel.quality(capture.name, across)));
    }
    Ok(all)
}

/// Robust standard deviations beyond which a point within half a patch of a surface belongs to another one, which stands before it.
const ANOTHER_SURFACE: f64 = 5.0;

/// Distances with those from other surfaces taken out.
fn of_these_surfaces(mut across: Vec<f64>) -> Vec<f64> {
    let mut known: Vec<f64> = across.iter().filter(|value| value.is_finite()).map(|value| value.abs()).collect();
    let limit = ANOTHER_SURFACE * statistics::mad_scale(&mut known);
    across.iter_mut().filter(|value| value.abs() > limit).for_each(|value| *value = f64::NAN);
    across
}

/// A pixel that takes part.
struct Pixel {
    at: [f64; 2],
    ray: Vector3<f64>,
    range_m: f64,
    correction_m: f64,
    sigma_m: f64,
    amplitude: f64,
}

impl Pixel {
    fn new(found: &SurfaceCalibration, capture: &SurfaceCapture<'_>, place: [usize; 2]) -> Option<Self> {
        let (frame, camera) = (capture.frame, found.camera());
        let place = (place[0], place[1]);
        let (range_m, amplitude) = (f64::from(frame.range[place]), f64::from(frame.amplitude[place]));
        if !(range_m > 0.0 && range_m.is_finite()) || frame.flags[place].intersects(Flags::all()) {
            return None;
        }
        let at = [place.0 as f64, place.1 as f64];
        let [x, y] = camera.format.image_from_pixel(at);
        let [xp, yp] = camera.interior.principal_point_mm;
        let correction_m = found.model().correction(range_m, x - xp, y - yp, amplitude).total_m();
        let sigma_m = f64::from(frame.sigma[place]);
        Some(Self { at, ray: camera.ray(at), range_m, correction_m, sigma_m, amplitude })
    }

    /// `across`: in front of the other stations' surface, metre.
    fn quality(&self, station: &str, across: f64) -> Option<ObservationQuality> {
        across.is_finite().then(|| ObservationQuality {
            station: station.to_owned(),
            target: "surface".to_owned(),
            component: Component::Range,
            observed: self.range_m,
            sigma: self.sigma_m,
            // In front of the surface the range is too short.
            residual: -across,
            redundancy_number: f64::NAN,
            standardised: f64::NAN,
            smallest_detectable: f64::NAN,
            verdict: Verdict::Used,
            pixel: self.at,
            range_m: self.range_m,
            amplitude: self.amplitude,
            uncorrected_m: -across + self.correction_m,
        })
    }
}

/// What the surfaces did for the terms, and what they left open.
fn diagnosis(found: &SurfaceCalibration) -> Vec<String> {
    let [before, after] = found.surface_rms_m().map(|rms_m| 1e3 * rms_m);
    let seen = format!(
        "surfaces seen from two stations lie {after:.2} mm apart (root mean square), {before:.2} mm before the terms were \
         estimated"
    );
    let held = found.held.iter().map(ToString::to_string);
    std::iter::once(seen).chain(held).collect()
}

/// Stations that do not lie where the others see what they see.
fn doubts(found: &SurfaceCalibration, captures: &[SurfaceCapture<'_>]) -> Vec<String> {
    let named = |station: usize| captures.get(station).map_or("?", |capture| capture.name);
    let open = found.after.undetermined.iter().map(|open| {
        format!(
            "station `{}`: a motion of it is told by no surface; more overlap, or furniture across it, is needed",
            named(open.station)
        )
    });
    let doubtful = found.after.placements.doubtful().map(|station| {
        format!(
            "station `{}`: what it sees contradicts what the others see; look at it with `rangecam register --multi`",
            named(station)
        )
    });
    open.chain(doubtful).collect()
}
