use std::sync::Arc;

use camera_model::RayTable;
use multipath::{
    DetectionOptions, Evidence, FrequencyResponse, RiskEvidence, RiskOptions, Systematics, TwoPathOptions, Verdict,
    assess_risk, detect, estimate_response, solve_two_paths,
};
use range_image::{ComplexFrame, Flags, Raster};

use crate::stages::line::Making;
use crate::stages::{Found, ViewStage};
use crate::survey::view::{View, ViewData};
use crate::{Error, Result};
use commands::plan::{MultipathOptions, MultipathTreatment};

/// Pixels of smaller amplitude, in standard deviations, do not tell the response of the frequencies.
pub(super) const RESPONSE_SNR: f64 = 20.0;

/// Light that came by more than one way: found by contradiction between frequencies where there are several, and
/// estimated from the scene's own shape everywhere.
pub(super) struct Multipath {
    options: MultipathOptions,
    rays: Arc<RayTable>,
}

impl Multipath {
    pub(super) fn new(options: &MultipathOptions, making: &Making<'_>) -> Self {
        Self { options: options.clone(), rays: Arc::clone(&making.rays) }
    }
}

impl ViewStage for Multipath {
    fn apply(&self, view: &mut View, found: &mut Found) -> Result<()> {
        let options = &self.options;
        if !matches!(view.data, ViewData::Range(_)) {
            return Err(Error::Needs { stage: "Multipath", needs: "Unwrap" });
        }
        if view.channels.len() > 1 {
            match flag_contradictions(view, options)? {
                Some(flagged) => {
                    found.add("contradictions_px", flagged);
                    if view.channels.len() > 2 && options.treatment == MultipathTreatment::Resolve {
                        found.add("resolved_px", resolve(view, options)?);
                    }
                }
                None => found.add("views_not_compared", 1),
            }
        }
        found.add("at_risk_px", assess(view, self.rays.directions(), options)?);
        Ok(())
    }
}

fn systematics(options: &MultipathOptions) -> Systematics {
    Systematics { floor_m: options.floor_m, ..Systematics::default() }
}

fn detection(options: &MultipathOptions) -> DetectionOptions {
    DetectionOptions {
        false_alarm: options.false_alarm_probability,
        systematics: systematics(options),
        ..DetectionOptions::default()
    }
}

/// How the frequencies respond where one range serves all of them: other pixels have amplitudes of two ways. Where hardly
/// any are left, all tell it.
fn response(
    frame: &ComplexFrame,
    range_m: &Raster<f32>,
    options: &DetectionOptions,
) -> std::result::Result<FrequencyResponse, multipath::Error> {
    let flat = FrequencyResponse::flat(frame.channels.len());
    let mut agreeing = frame.clone();
    detect(&mut agreeing, range_m, &flat, &DetectionOptions { evidence: Evidence::Ranges, ..*options })?;
    let estimate = match estimate_response(&agreeing, RESPONSE_SNR) {
        Err(multipath::Error::TooFewPixels { .. }) => estimate_response(frame, RESPONSE_SNR),
        estimate => estimate,
    };
    Ok(estimate?.response)
}

/// Flags pixels whose frequencies contradict each other; `None` where too few pixels tell how the frequencies respond.
fn flag_contradictions(view: &mut View, options: &MultipathOptions) -> Result<Option<usize>> {
    let name = view.name();
    let fail = |error| Error::stage("Multipath", &name)(error);
    let Some(mut frame) = view.complex_channels() else { return Ok(None) };
    let ViewData::Range(range) = &mut view.data else { return Ok(None) };
    let options = detection(options);
    let response = match response(&frame, &range.range, &options) {
        // Without sigma no pixel tells anything.
        Err(multipath::Error::TooFewPixels { .. } | multipath::Error::SigmaUnknown { .. }) => return Ok(None),
        response => response.map_err(fail)?,
    };
    frame.flags.clone_from(&range.flags);
    let found = detect(&mut frame, &range.range, &response, &options).map_err(fail)?;
    range.flags = frame.flags;
    Ok(Some(found.flagged))
}

/// Replaces the ranges of flagged pixels by those of the direct path, where the frequencies tell it.
fn resolve(view: &mut View, options: &MultipathOptions) -> Result<usize> {
    let name = view.name();
    let fail = |error| Error::stage("Multipath", &name)(error);
    let Some(mut frame) = view.complex_channels() else { return Ok(0) };
    let ViewData::Range(range) = &mut view.data else { return Ok(0) };
    let response = response(&frame, &range.range, &detection(options)).map_err(fail)?;
    // Only flagged pixels are solved for; to all others one range serves well.
    for (flags, known) in frame.flags.as_mut_slice().iter_mut().zip(range.flags.as_slice()) {
        *flags = if known.contains(Flags::MULTIPATH) { *known } else { *known | Flags::NO_DATA };
    }
    let options = TwoPathOptions { systematics: systematics(options), ..TwoPathOptions::default() };
    let image = solve_two_paths(&frame, &response, &options).map_err(fail)?;
    let mut resolved = 0;
    let pixels = range.range.as_mut_slice().iter_mut().zip(range.sigma.as_mut_slice());
    let pixels = pixels.zip(range.flags.as_mut_slice()).zip(image.paths.as_slice());
    for (((value, sigma), flags), paths) in pixels {
        if flags.contains(Flags::MULTIPATH) && paths.verdict == Verdict::Two {
            (*value, *sigma) = (paths.direct_m, paths.sigma_direct_m);
            flags.remove(Flags::MULTIPATH);
            resolved += 1;
        }
    }
    Ok(resolved)
}

/// What the scene in view does to its own ranges.
fn assess(view: &mut View, directions: &[[f64; 3]], options: &MultipathOptions) -> Result<usize> {
    let name = view.name();
    let modulation = view.modulation;
    let ViewData::Range(frame) = &mut view.data else { return Ok(0) };
    let options = RiskOptions {
        modulation_hz: modulation.map(|modulation| modulation.frequency_hz()),
        floor_m: options.flag_risk_above_m.unwrap_or(f64::MAX),
        evidence: RiskEvidence::Bending { false_alarm: options.bending_false_alarm_probability },
        ..RiskOptions::default()
    };
    let risk = assess_risk(frame, directions, &options).map_err(Error::stage("Multipath", &name))?;
    view.multipath_risk_m = Some(risk.risk_m);
    Ok(risk.flagged)
}
