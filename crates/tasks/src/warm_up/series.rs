//! Mean changes of range of all frames of a survey.

use commands::Progress;
use error_models::RateHistory;
use pipeline::survey::frame_rates;
use pipeline::{Error, Result};
use range_image::Raster;
use range_io::survey::ReferencePath;
use warm_up::{ChangeMeter, ChangeOptions, DriftSample, PixelMeans, RangeChange};

use crate::warm_up::frames::FrameSource;
use crate::warm_up::{ReferenceUse, WarmUpRequest};

/// One sample a frame, and what they come from.
pub(crate) struct Series {
    pub(crate) samples: Vec<DriftSample>,
    /// The frame rates since power-on, where the survey states them.
    pub(crate) stated_rates: Option<RateHistory>,
    /// Pixels of the scene, or of the reference where that takes its place.
    pub(crate) pixels: usize,
    /// Share of them that wander from the change of all.
    pub(crate) moved_share: f64,
    /// Where power-on is known from, in words.
    pub(crate) power_on: String,
    /// Size of the frames.
    pub(crate) size: [usize; 2],
}

impl Series {
    pub(crate) fn read(request: &WarmUpRequest, progress: &dyn Progress) -> Result<Self> {
        let refused = Error::estimation("warm-up", &request.survey);
        let mut source = FrameSource::new(&request.survey)?;
        let (power_on_s, power_on) = power_on(request, &source)?;
        let size = [source.survey().camera.width, source.survey().camera.height];
        let masks = masks(request, source.survey().reference_path.as_ref(), size)?;
        let interval_m = source.interval_m()?;
        let mut meters = Vec::new();
        for (place, _) in masks.iter().enumerate() {
            // A fibre shows on a few pixels only.
            let of_reference = place > 0 || request.reference == ReferenceUse::Instead;
            let least_pixels = if of_reference { 1 } else { request.pixels.least_pixels };
            meters.push(ChangeOptions { interval_m, least_pixels, ..request.pixels });
        }
        let means = masks.iter().zip(&meters).map(|(mask, options)| PixelMeans::new(mask, options));
        let mut means = means.collect::<std::result::Result<Vec<PixelMeans>, _>>().map_err(&refused)?;
        each_frame(&mut source, "mean of the pixels", progress, |_, frame| {
            means.iter_mut().try_for_each(|means| means.add(frame)).map_err(&refused)
        })?;
        let meters = means.into_iter().map(PixelMeans::finish);
        let mut meters = meters.collect::<std::result::Result<Vec<ChangeMeter>, _>>().map_err(&refused)?;
        let mut changes: Vec<RangeChange> = Vec::with_capacity(source.survey().frames.len());
        each_frame(&mut source, "change of range", progress, |_, frame| {
            let own = meters.iter_mut().map(|meter| meter.measure(frame));
            let own = own.collect::<std::result::Result<Vec<RangeChange>, _>>().map_err(&refused)?;
            changes.push(difference(&own));
            Ok(())
        })?;
        let sample = |(entry, change): (&range_io::survey::FrameEntry, &RangeChange)| DriftSample {
            time_s: entry.timestamp_s.unwrap_or(f64::NAN) - power_on_s,
            mean_change_m: change.mean_m,
            sigma_m: change.sigma_m,
            temperature_c: entry.temperature_c,
        };
        let samples = source.survey().frames.iter().zip(&changes).map(sample).collect();
        let (pixels, moved_share) = (meters[0].pixels(), meters[0].moved_share().map_err(&refused)?);
        let stated_rates = frame_rates::stated(source.survey(), power_on_s).transpose();
        let stated_rates = stated_rates.map_err(warm_up::DriftError::from).map_err(&refused)?;
        Ok(Self { samples, stated_rates, pixels, moved_share, power_on, size })
    }
}

/// The change of the scene, less that of the reference where there is one.
fn difference(changes: &[RangeChange]) -> RangeChange {
    match changes {
        [scene, reference] => {
            RangeChange { mean_m: scene.mean_m - reference.mean_m, sigma_m: scene.sigma_m.hypot(reference.sigma_m) }
        }
        others => others.first().copied().unwrap_or(RangeChange { mean_m: f64::NAN, sigma_m: f64::NAN }),
    }
}

/// When the camera was switched on, and who says so.
fn power_on(request: &WarmUpRequest, source: &FrameSource) -> Result<(f64, String)> {
    let survey = source.survey();
    if let Some(power_on_s) = request.power_on_s.or(survey.power_on_s) {
        return Ok((power_on_s, format!("at {power_on_s} s on the frames' clock")));
    }
    if request.calibration.is_some() {
        let message = "it does not state power_on_s, and a calibration states the drift by the time since power-on: \
                       add it to survey.ron, or name it (--power-on)";
        return Err(Error::Survey { path: request.survey.clone(), message: message.to_owned() });
    }
    let first = survey.frames.first().and_then(|frame| frame.timestamp_s).unwrap_or(0.0);
    Ok((first, "not known: times count from the first frame".to_owned()))
}

/// The pixels that tell the change, and those whose change is subtracted.
fn masks(request: &WarmUpRequest, path: Option<&ReferencePath>, size: [usize; 2]) -> Result<Vec<Raster<bool>>> {
    let inside = |col: usize, row: usize| {
        path.is_some_and(|path| {
            (path.columns[0]..=path.columns[1]).contains(&col) && (path.rows[0]..=path.rows[1]).contains(&row)
        })
    };
    let [width, height] = size;
    let scene = Raster::from_fn(width, height, |col, row| !inside(col, row));
    if request.reference == ReferenceUse::Ignore {
        return Ok(vec![scene]);
    }
    let refused = |message: &str| Error::Survey { path: request.survey.clone(), message: message.to_owned() };
    if path.is_none() {
        return Err(refused("it states no reference_path, whose change is asked for"));
    }
    let reference = Raster::from_fn(width, height, inside);
    if request.reference == ReferenceUse::Instead {
        return Ok(vec![reference]);
    }
    if request.calibration.is_some() {
        return Err(refused(
            "what is left beside the optical reference is no drift of a calibration: leave the calibration away, or \
             use the reference instead of the scene",
        ));
    }
    Ok(vec![scene, reference])
}

/// All frames, one after the other.
fn each_frame(
    source: &mut FrameSource,
    work: &str,
    progress: &dyn Progress,
    mut act: impl FnMut(usize, &range_image::RangeFrame) -> Result<()>,
) -> Result<()> {
    let count = source.survey().frames.len();
    progress.begin(work, count);
    let at_once = source.at_once;
    for start in (0..count).step_by(at_once) {
        let end = count.min(start + at_once);
        for (place, frame) in source.read(start..end, progress)?.iter().enumerate() {
            act(start + place, frame)?;
        }
        progress.advance(end);
    }
    Ok(())
}
