use std::collections::BTreeMap;

use range_image::{Rest, RestOptions, RestVerdict, average, average_ranges, check_rest, check_rest_of_ranges};

use super::Findings;
use crate::plan::AverageOptions;
use crate::progress::Progress;
use crate::view::{View, ViewData};
use crate::work::Work;
use crate::{Error, Result};

/// All views of a station become one: the mean of the complex images, or of the ranges where there are only those.
pub(super) fn run(work: &mut Work, options: &AverageOptions, progress: &dyn Progress) -> Result<Findings> {
    let views = std::mem::take(&mut work.outcome.views);
    let before = views.len();
    // Stations keep the order in which the survey lists them.
    let mut order: Vec<String> = Vec::new();
    let mut groups: BTreeMap<String, Vec<View>> = BTreeMap::new();
    for view in views {
        let group = groups.entry(view.station.clone()).or_default();
        if group.is_empty() {
            order.push(view.station.clone());
        }
        group.push(view);
    }
    let mut findings = Findings::new();
    for (index, station) in order.iter().enumerate() {
        if let Some(group) = groups.remove(station) {
            let (view, rest) = mean(group, &options.rest)?;
            work.outcome.views.push(view);
            if let Some(rest) = &rest {
                record(&mut findings, rest);
            }
        }
        progress.advance(index + 1);
    }
    let per_station = before as f64 / order.len().max(1) as f64;
    findings.insert("frames_per_station".to_owned(), per_station);
    Ok(findings)
}

/// Adds what the test of one station found.
fn record(findings: &mut Findings, rest: &Rest) {
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

/// The mean of a station's views, with the test for rest where there are several.
fn mean(group: Vec<View>, options: &RestOptions) -> Result<(View, Option<Rest>)> {
    let name = format!("station {}", group[0].station);
    let frames: Vec<usize> = group.iter().flat_map(|view| view.frames.iter().copied()).collect();
    let (mut complex, mut ranges) = (Vec::new(), Vec::new());
    let mut views = group.into_iter();
    let Some(mut first) = views.next() else {
        return Err(Error::stage("Average", &name)("no frame"));
    };
    for data in std::iter::once(first.data).chain(views.map(|view| view.data)) {
        match data {
            ViewData::Samples(_) => return Err(Error::Needs { stage: "Average", needs: "Demodulate" }),
            ViewData::Phase(frame) => complex.push(frame),
            ViewData::Range(frame) => ranges.push(frame),
        }
    }
    let fail = |error| Error::stage("Average", &name)(error);
    let options = Some(options).filter(|_| frames.len() > 1);
    let rest = if ranges.is_empty() {
        let tested = options.map(|options| check_rest(&complex, options)).transpose().map_err(fail)?;
        let mut mean = average(&complex).map_err(fail)?;
        if let Some(rest) = &tested {
            rest.flag(&mut mean.flags);
        }
        first.data = ViewData::Phase(mean);
        tested
    } else {
        let tested = options.map(|options| check_rest_of_ranges(&ranges, options)).transpose().map_err(fail)?;
        let mut mean = average_ranges(&ranges).map_err(fail)?;
        if let Some(rest) = &tested {
            rest.flag(&mut mean.flags);
        }
        first.data = ViewData::Range(mean);
        tested
    };
    first.frames = frames;
    Ok((first, rest))
}
