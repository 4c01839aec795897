use range_image::{
    ComplexFrame, Interference, InterferenceVerdict, RangeFrame, Rest, RestOptions, RestVerdict, average,
    average_ranges, check_interference, check_rest, check_rest_of_ranges,
};

use crate::stages::{Findings, Found};
use crate::survey::view::{View, ViewData};
use crate::{Error, Result};
use commands::plan::AverageOptions;

/// All views of a station with one integration time become one: the mean of the complex images, or of the ranges where
/// there are only those.
///
/// Whether scene and camera were at rest is asked of all frames against their mean, which takes them all at once. So that
/// many frames never are in memory together, a station of many is averaged in parts of equal size, and the means of the
/// parts are averaged and tested as frames are: what moves slowly shows between parts, what comes and goes within one.
pub(super) struct Average {
    pub(super) options: AverageOptions,
    /// Amplitude below which the phase of a single frame is too noisy.
    pub(super) low_amplitude: Option<f64>,
}

/// What was tested of several frames.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Tests {
    moved_px: Option<usize>,
    moved: bool,
    drifts: bool,
    interference_px: Option<usize>,
    interferes: bool,
}

impl Tests {
    /// Of a whole that was averaged in parts: what the part that shows most of it shows.
    pub(crate) fn join(self, other: Self) -> Self {
        Self {
            moved_px: self.moved_px.max(other.moved_px),
            moved: self.moved || other.moved,
            drifts: self.drifts || other.drifts,
            interference_px: self.interference_px.max(other.interference_px),
            interferes: self.interferes || other.interferes,
        }
    }

    fn new(rest: &Rest, interference: Option<&Interference>) -> Self {
        Self {
            moved_px: (rest.verdict != RestVerdict::SigmaUnknown).then_some(rest.moved_pixels),
            moved: matches!(rest.verdict, RestVerdict::SceneMoved { .. }),
            drifts: matches!(rest.verdict, RestVerdict::Drifts { .. }),
            interference_px: interference.map(|found| found.disturbed_pixels),
            interferes: interference.is_some_and(|it| matches!(it.verdict, InterferenceVerdict::Found { .. })),
        }
    }
}

impl Average {
    /// Adds what the tests of one station found.
    pub(super) fn record(tests: &Tests, frames: usize, found: &mut Found) {
        found.add(STATIONS, 1);
        found.add(FRAMES, frames);
        if let Some(pixels) = tests.interference_px {
            found.add("interference_px", pixels);
            found.add("stations_with_interference", usize::from(tests.interferes));
        }
        if let Some(pixels) = tests.moved_px {
            found.add("moved_px", pixels);
            found.add("moved_stations", usize::from(tests.moved));
            found.add("drifting_stations", usize::from(tests.drifts));
        }
    }

    pub(super) fn findings(found: &Found) -> Findings {
        let mut findings = found.sums.clone();
        let [frames, stations] = [FRAMES, STATIONS].map(|name| findings.remove(name).unwrap_or_default());
        findings.insert("frames_per_station".to_owned(), frames / stations.max(1.0));
        findings
    }

    /// The mean of a station's views, single frames or means of them, with the tests where there are several.
    pub(super) fn mean(&self, group: Vec<View>) -> Result<(View, Tests)> {
        let name = group.first().map_or_else(String::new, |view| format!("station {}", view.station));
        let (count, frames): (usize, Vec<usize>) =
            (group.len(), group.iter().flat_map(|view| view.frames.iter().copied()).collect());
        // A drift is told in standard deviations of single frames.
        let drift_sigmas = self.options.rest.largest_drift_sigmas * (frames.len() as f64 / count.max(1) as f64).sqrt();
        let rest = RestOptions { largest_drift_sigmas: drift_sigmas, ..self.options.rest };
        let options = AverageOptions { rest, ..self.options.clone() };
        let several = count > 1;
        let (mut complex, mut ranges) = (Vec::new(), Vec::new());
        let mut views = group.into_iter();
        let Some(mut first) = views.next() else {
            return Err(Error::unfit("Average", &name, "no frame"));
        };
        for data in std::iter::once(first.data).chain(views.map(|view| view.data)) {
            match data {
                ViewData::Samples(_) => return Err(Error::Needs { stage: "Average", needs: "Demodulate" }),
                ViewData::Phase(frame) => complex.push(frame),
                ViewData::Range(frame) => ranges.push(frame),
            }
        }
        let averaged = if ranges.is_empty() {
            // A beat is one of single frames.
            let beats = several && frames.len() == count;
            let mean = mean_of_phases(&complex, &options, several, beats);
            mean.map(|(mut mean, tests)| {
                if let Some(limit) = self.low_amplitude {
                    mean.flag_low_amplitude(limit / (frames.len() as f64).sqrt());
                }
                (ViewData::Phase(mean), tests)
            })
        } else {
            mean_of_ranges(&ranges, &options, several).map(|(mean, tests)| (ViewData::Range(mean), tests))
        };
        let (data, tests) = averaged.map_err(Error::stage("Average", &name))?;
        (first.data, first.frames) = (data, frames);
        Ok((first, tests))
    }
}

/// Numbers behind the finding `frames_per_station`.
const FRAMES: &str = "frames";
const STATIONS: &str = "stations";

fn mean_of_phases(
    frames: &[ComplexFrame],
    options: &AverageOptions,
    several: bool,
    beats: bool,
) -> std::result::Result<(ComplexFrame, Tests), range_image::Error> {
    let mut mean = average(frames)?;
    if !several {
        return Ok((mean, Tests::default()));
    }
    let rest = check_rest(frames, &options.rest)?;
    let interference = beats.then(|| check_interference(frames, &options.interference)).transpose()?;
    rest.flag(&mut mean.flags);
    if let Some(interference) = &interference {
        interference.flag(&mut mean.flags);
    }
    Ok((mean, Tests::new(&rest, interference.as_ref())))
}

fn mean_of_ranges(
    frames: &[RangeFrame],
    options: &AverageOptions,
    several: bool,
) -> std::result::Result<(RangeFrame, Tests), range_image::Error> {
    let mut mean = average_ranges(frames)?;
    if !several {
        return Ok((mean, Tests::default()));
    }
    let rest = check_rest_of_ranges(frames, &options.rest)?;
    rest.flag(&mut mean.flags);
    Ok((mean, Tests::new(&rest, None)))
}
