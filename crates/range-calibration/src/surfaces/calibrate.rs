use camera_model::Camera;
use error_models::RangeErrorModel;
use multiview_registration::{
    Datum, SharedParameters, Start, StationRegistration, StationRegistrationOptions, register_stations,
};
use nalgebra::Isometry3;
use point_cloud::Cloud;

use super::amplitude::{AmplitudeModel, NAMES};
use super::options::Asked;
use super::outcome::Estimate;
use super::pixels::{Known, StationPixels};
use super::selection::{HeldTerm, undetermined};
use super::sensor_model::{Parameter, SensorModel, camera_values};
use super::{SurfaceCalibration, SurfaceCalibrationOptions, SurfaceCapture};
use crate::{Error, Result};

/// What points move by for a deviation of a term about which nothing is known, metre: cameras err by less before they are
/// calibrated, and what stays that wide is not determined. Half or twice as much changes no term by a hundredth of its deviation.
const UNKNOWN_M: f64 = 0.1;
/// An amplitude's part below so many deviations has no shape to be told.
const SIGNIFICANT: f64 = 3.0;

/// Estimates range terms of one modulation frequency, the amplitude's hyperbola and parameters of the camera together with the
/// poses of all stations, from the surfaces that they see in common.
///
/// Of `known` and `camera` what is not named in the options is held; what is named starts from their values. The stations are
/// registered first with the known model, then, from there, with the terms as unknowns. A combination of terms that the
/// surfaces leave open is named, and the term with the largest part in it is held at its start value:
/// [`SurfaceCalibration::held`].
/// `progress(done, total)` is told the steps of each registration.
///
/// # Errors
/// [`Error::SurfacesNotDetermined`] where no term is left to estimate: the poses take its place, as with a single
/// wall. [`Error::SurfacesNotSettled`] where the stations still slide at the end. [`Error::UnknownName`] for a term that
/// neither has; [`Error::Registration`] where the stations do not come together; [`Error::OutOfDomain`], [`Error::Image`] for the
/// input; [`Error::Model`] if the estimated terms are no usable model.
pub fn calibrate_surfaces(
    captures: &[SurfaceCapture<'_>],
    camera: &Camera,
    known: &RangeErrorModel,
    datum: Datum,
    options: &SurfaceCalibrationOptions<'_>,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<SurfaceCalibration> {
    known.validate()?;
    camera.validate()?;
    let asked = options.asked(&known.parameter_names())?;
    if let [only] = captures {
        return Err(Error::OneStation { station: only.name.to_owned() });
    }
    let columns: Vec<usize> = asked.range.iter().map(|(column, _)| *column).collect();
    let given = Known { camera, model: known, columns: &columns, amplitude: asked.amplitude };
    let (mut stations, mut clouds) = (Vec::new(), Vec::new());
    for capture in captures {
        let (pixels, cloud) = StationPixels::new(capture, &given, options)?;
        stations.push(pixels);
        clouds.push(cloud);
    }
    let approximate: Option<Vec<Isometry3<f64>>> = captures.iter().map(|capture| capture.world_from_camera).collect();
    let network = Network { clouds: &clouds, datum, options, progress };
    let before = network.register(approximate.as_ref().map_or(Start::Order, |poses| Start::Poses(poses)), None)?;
    let mut model = start_model(&asked, known, camera, &stations);
    let mut held = Vec::new();
    if asked.amplitude && model.amplitude.is_none() {
        let combination = "the pixels have no amplitudes that differ by a factor of two".to_owned();
        held.push(HeldTerm { name: HYPERBOLA.to_owned(), combination, sigma_m: f64::INFINITY });
    }
    let (after, shared) = network.estimate(&mut model, &mut held, &before)?;
    // With the terms left out, stations may go back and forth between what these bend: only how they end counts.
    if !after.settled {
        return Err(Error::SurfacesNotSettled { rounds: [before.rounds, after.rounds], held });
    }
    let camera = model.camera_at(&shared.values);
    Estimate { known, camera, model: &model, shared, held }.outcome(before, after)
}

/// Name of the hyperbola among terms that are held.
const HYPERBOLA: &str = "h1, h2, h3";

/// All terms that are asked for, at the known values.
fn start_model<'a>(
    asked: &Asked<'_>,
    known: &RangeErrorModel,
    camera: &'a Camera,
    stations: &'a [StationPixels],
) -> SensorModel<'a> {
    let (terms, lens) = (known.parameter_values(), camera_values(camera));
    let parameter =
        |name: &str, start, prior_sigma, column| Parameter { name: name.to_owned(), start, prior_sigma, column };
    let range = asked.range.iter().enumerate();
    let range = range.map(|(at, (column, term))| parameter(&term.name, terms[*column], term.prior_sigma, at));
    let lens = asked.lens.iter().map(|(at, term)| (*at, parameter(&term.name, lens[*at], term.prior_sigma, 0)));
    let amplitude = asked.amplitude.then(|| AmplitudeModel::start(stations, known.hyperbola.as_ref())).flatten();
    let mut model = SensorModel {
        range: range.collect(),
        held_range: Vec::new(),
        shaped: false,
        amplitude,
        lens: lens.collect(),
        camera,
        stations,
    };
    // What is not known at all still keeps to what cameras show, so that an open combination shows as one.
    let (values, _) = multiview_registration::PointModel::prior(&model);
    let effects = model.effects(&values);
    let (range, rest) = effects.split_at(model.range.len());
    let (_, lens) = rest.split_at(model.amplitudes());
    for (parameter, effect) in model.range.iter_mut().zip(range) {
        parameter.prior_sigma = parameter.prior_sigma.min(UNKNOWN_M / effect);
    }
    for ((_, parameter), effect) in model.lens.iter_mut().zip(lens) {
        parameter.prior_sigma = parameter.prior_sigma.min(UNKNOWN_M / effect);
    }
    model
}

/// What all registrations have in common.
struct Network<'a> {
    clouds: &'a [Cloud],
    datum: Datum,
    options: &'a SurfaceCalibrationOptions<'a>,
    progress: &'a (dyn Fn(usize, usize) + Sync),
}

impl Network<'_> {
    fn register(&self, start: Start<'_>, model: Option<&SensorModel<'_>>) -> Result<StationRegistration> {
        let model = model.map(|model| model as &dyn multiview_registration::PointModel);
        let options = StationRegistrationOptions { model, ..self.options.registration.clone() };
        register_stations(self.clouds, start, self.datum, &options, self.progress)
            .map_err(|error| Error::registration("all stations", error))
    }

    /// Registers with the terms until what is left of them is determined, and the amplitude's part has its shape.
    fn estimate(
        &self,
        model: &mut SensorModel<'_>,
        held: &mut Vec<HeldTerm>,
        before: &StationRegistration,
    ) -> Result<(StationRegistration, SharedParameters)> {
        let mut poses = before.world_from_station.clone();
        loop {
            let after = self.register(Start::Poses(&poses), Some(model))?;
            let Some(shared) = after.parameters.clone() else { return Err(Error::NothingToEstimate) };
            let effects = model.effects(&shared.values);
            let open = undetermined(&shared, &effects, self.options.largest_sigma_m);
            if !open.is_empty() {
                if open.len() == shared.values.len() {
                    return Err(self.nothing_determined(&shared, &open[0]));
                }
                held.extend(hold(model, open));
            } else if !model.follow_shape(&shared, held) {
                return Ok((after, shared));
            }
            if model.is_empty() {
                return Err(Error::NothingToEstimate);
            }
            poses.clone_from(&after.world_from_station);
        }
    }

    fn nothing_determined(&self, shared: &SharedParameters, (index, worst): &(usize, HeldTerm)) -> Error {
        let (station, component, correlation) = shared.largest_pose_correlation[*index];
        Error::SurfacesNotDetermined {
            term: worst.name.clone(),
            sigma_m: worst.sigma_m,
            limit_m: self.options.largest_sigma_m,
            station,
            motion: if component < 3 { "position" } else { "attitude" },
            correlation,
        }
    }
}

/// Takes the terms out of the model, so that they stay at their start values.
fn hold(model: &mut SensorModel<'_>, open: Vec<(usize, HeldTerm)>) -> Vec<HeldTerm> {
    let (ranges, amplitudes) = (model.range.len(), model.amplitudes());
    let is_open = |index: usize| open.iter().any(|(at, _)| *at == index);
    // Ranges have no asked term taken off yet: that of a held one is its start value's.
    for (_, parameter) in model.range.iter().enumerate().filter(|(index, _)| is_open(*index)) {
        model.held_range.push((parameter.column, parameter.start));
    }
    retain(&mut model.range, |index| !is_open(index));
    if let Some(amplitude) = &mut model.amplitude {
        retain(&mut amplitude.free, |index| !is_open(ranges + index));
    }
    // Without its value in the dark there is no hyperbola to shape.
    if model.amplitude.as_ref().is_some_and(|amplitude| !amplitude.free.contains(&0)) {
        model.amplitude = None;
    }
    retain(&mut model.lens, |index| !is_open(ranges + amplitudes + index));
    open.into_iter().map(|(_, term)| term).collect()
}

/// Keeps the entries at positions that are wanted.
fn retain<T>(entries: &mut Vec<T>, wanted: impl Fn(usize) -> bool) {
    let mut index = 0;
    entries.retain(|_| {
        index += 1;
        wanted(index - 1)
    });
}

impl SensorModel<'_> {
    fn is_empty(&self) -> bool {
        self.range.is_empty() && self.amplitudes() == 0 && self.lens.is_empty()
    }

    /// Goes from the start of the amplitude's part to its shape; false where it has it already, or there is none.
    fn follow_shape(&mut self, shared: &SharedParameters, held: &mut Vec<HeldTerm>) -> bool {
        let at = self.range.len();
        let Some(amplitude) = self.amplitude.as_mut().filter(|_| !std::mem::replace(&mut self.shaped, true)) else {
            return false;
        };
        let (dark, sigma) = (shared.values[at], shared.sigma()[at]);
        if dark > SIGNIFICANT * sigma {
            amplitude.start[0] = dark;
            amplitude.free = (0..NAMES.len()).collect();
        } else {
            let combination =
                format!("no range error that falls with the amplitude: {dark:+.4} +- {sigma:.4} m in the dark");
            held.push(HeldTerm { name: HYPERBOLA.to_owned(), combination, sigma_m: f64::INFINITY });
            self.amplitude = None;
        }
        true
    }
}
