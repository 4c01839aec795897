//! How fast the camera of a survey took frames since it was switched on.

use error_models::{RateHistory, RatePhase};
use range_io::survey::Survey;

use commands::DriftError;

/// The rates that a survey states, second since power-on; `None` where it states none.
pub fn stated(survey: &Survey, power_on_s: f64) -> Option<Result<RateHistory, error_models::Error>> {
    let phase =
        |rate: &range_io::survey::FrameRate| RatePhase { since_s: rate.since_s - power_on_s, rate_hz: rate.rate_hz };
    (!survey.frame_rates.is_empty()).then(|| RateHistory::new(survey.frame_rates.iter().map(phase).collect()))
}

/// The rates that a survey states, or else those of the stream that its frames are.
///
/// Until `known_from_s`, from when on the drift was seen, the camera counts as run at the rate of the first frames, as it
/// counted then.
pub fn rate_history(survey: &Survey, power_on_s: f64, known_from_s: f64) -> Result<RateHistory, DriftError> {
    if let Some(stated) = stated(survey, power_on_s) {
        return stated.map_err(DriftError::FrameRates);
    }
    let time = |(frame, entry): (usize, &range_io::survey::FrameEntry)| {
        let field = format!("frames[{frame}].timestamp_s");
        let missing = DriftError::Missing { quantity: "the frame rate since power-on", field };
        entry.timestamp_s.map(|time_s| time_s - power_on_s).ok_or(missing)
    };
    let mut times = survey.frames.iter().enumerate().map(time).collect::<Result<Vec<f64>, _>>()?;
    // Stations may be listed in another order than they were taken in.
    times.sort_by(f64::total_cmp);
    times.dedup();
    RateHistory::of_frames(&times, known_from_s).map_err(DriftError::FrameRates)
}
