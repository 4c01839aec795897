use std::collections::BTreeMap;

use range_image::{average, average_ranges};

use super::Findings;
use crate::progress::Progress;
use crate::view::{View, ViewData};
use crate::work::Work;
use crate::{Error, Result};

/// All views of a station become one: the mean of the complex images, or of the ranges where there are only those.
pub(super) fn run(work: &mut Work, progress: &dyn Progress) -> Result<Findings> {
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
    for (index, station) in order.iter().enumerate() {
        if let Some(group) = groups.remove(station) {
            work.outcome.views.push(mean(group)?);
        }
        progress.advance(index + 1);
    }
    let per_station = before as f64 / order.len().max(1) as f64;
    Ok(Findings::from([("frames_per_station".to_owned(), per_station)]))
}

fn mean(group: Vec<View>) -> Result<View> {
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
    first.data = if ranges.is_empty() {
        ViewData::Phase(average(&complex).map_err(Error::stage("Average", &name))?)
    } else {
        ViewData::Range(average_ranges(&ranges).map_err(Error::stage("Average", &name))?)
    };
    first.frames = frames;
    Ok(first)
}
