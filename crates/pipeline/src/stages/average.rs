use range_image::{
    ComplexFrame, Interference, InterferenceVerdict, RangeFrame, Rest, RestVerdict, average, average_ranges,
    check_interference, check_rest, check_rest_of_ranges,
};

use crate::command::progress::Progress;
use crate::plan::AverageOptions;
use crate::stages::Findings;
use crate::survey::view::{View, ViewData, by_station};
use crate::survey::work::Work;
use crate::{Error, Result};

/// All views of a station with one integration time become one: the mean of the complex images, or of the ranges where
/// there are only those.
pub(super) fn run(work: &mut Work, options: &AverageOptions, progress: &dyn Progress) -> Result<Findings> {
    let views = std::mem::take(&mut work.outcome.views);
    let before = views.len();
    let groups: Vec<Vec<View>> = by_station(views).into_iter().flat_map(by_time).collect();
    let count = groups.len();
    let mut findings = Findings::new();
    for (index, group) in groups.into_iter().enumerate() {
        let (view, tests) = mean(group, options, work.low_amplitude)?;
        work.outcome.views.push(view);
        record(&mut findings, &tests);
        progress.advance(index + 1);
    }
    let per_station = before as f64 / count.max(1) as f64;
    findings.insert("frames_per_station".to_owned(), per_station);
    Ok(findings)
}

/// Parts the views of a station by their integration times.
fn by_time(views: Vec<View>) -> Vec<Vec<View>> {
    let mut groups: Vec<Vec<View>> = Vec::new();
    for view in views {
        let time = view.integration_time_s.map(f64::to_bits);
        match groups.iter_mut().find(|group| group[0].integration_time_s.map(f64::to_bits) == time) {
            Some(group) => group.push(view),
            None => groups.push(vec![view]),
        }
    }
    groups
}

/// What was tested of several frames.
#[derive(Default)]
struct Tests {
    rest: Option<Rest>,
    interference: Option<Interference>,
}

/// Adds what the tests of one station found.
fn record(findings: &mut Findings, tests: &Tests) {
    if let Some(Interference { disturbed_pixels, verdict, .. }) = &tests.interference {
        let found = u32::from(matches!(verdict, InterferenceVerdict::Found { .. }));
        *findings.entry("interference_px".to_owned()).or_default() += *disturbed_pixels as f64;
        *findings.entry("stations_with_interference".to_owned()).or_default() += f64::from(found);
    }
    let Some(rest) = &tests.rest else { return };
    let (moved, drifting) = match rest.verdict {
        RestVerdict::SigmaUnknown => return,
        RestVerdict::AtRest => (0.0, 0.0),
        RestVerdict::SceneMoved { .. } => (1.0, 0.0),
        RestVerdict::Drifts { .. } => (0.0, 1.0),
    };
    *findings.entry("moved_px".to_owned()).or_default() += rest.moved_pixels as f64;
    *findings.entry("moved_stations".to_owned()).or_default() += moved;
    *findings.entry("drifting_stations".to_owned()).or_default() += drifting;
}

/// The mean of a station's views, with the tests for rest and interference where there are several.
fn mean(group: Vec<View>, options: &AverageOptions, low_amplitude: Option<f64>) -> Result<(View, Tests)> {
    let name = format!("station {}", group[0].station);
    let frames: Vec<usize> = group.iter().flat_map(|view| view.frames.iter().copied()).collect();
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
    let several = frames.len() > 1;
    let averaged = if ranges.is_empty() {
        let mean = mean_of_phases(&complex, options, several);
        mean.map(|(mut mean, tests)| {
            if let Some(limit) = low_amplitude {
                mean.flag_low_amplitude(limit / (complex.len() as f64).sqrt());
            }
            (ViewData::Phase(mean), tests)
        })
    } else {
        mean_of_ranges(&ranges, options, several).map(|(mean, tests)| (ViewData::Range(mean), tests))
    };
    let (data, tests) = averaged.map_err(Error::stage("Average", &name))?;
    (first.data, first.frames) = (data, frames);
    Ok((first, tests))
}

fn mean_of_phases(
    frames: &[ComplexFrame],
    options: &AverageOptions,
    several: bool,
) -> range_image::Result<(ComplexFrame, Tests)> {
    let mut mean = average(frames)?;
    if !several {
        return Ok((mean, Tests::default()));
    }
    let rest = check_rest(frames, &options.rest)?;
    let interference = check_interference(frames, &options.interference)?;
    rest.flag(&mut mean.flags);
    interference.flag(&mut mean.flags);
    Ok((mean, Tests { rest: Some(rest), interference: Some(interference) }))
}

fn mean_of_ranges(
    frames: &[RangeFrame],
    options: &AverageOptions,
    several: bool,
) -> range_image::Result<(RangeFrame, Tests)> {
    let mut mean = average_ranges(frames)?;
    if !several {
        return Ok((mean, Tests::default()));
    }
    let rest = check_rest_of_ranges(frames, &options.rest)?;
    rest.flag(&mut mean.flags);
    Ok((mean, Tests { rest: Some(rest), interference: None }))
}
