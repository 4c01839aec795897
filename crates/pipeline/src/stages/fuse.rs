use std::f64::consts::TAU;

use range_image::{Exposure, FusionOptions, Modulation, RangeFrame, fuse_exposures};

use crate::stages::Found;
use crate::survey::view::{View, ViewData};
use crate::{Error, Result};
use commands::plan::FuseExposuresOptions;

/// Below this ratio of signal to noise the noise of a phase is not normal.
const NORMAL_SNR: f64 = 5.0;

/// All views of a station, which differ in their integration times, become one; a station with one view keeps it.
pub(super) struct Fuse {
    pub(super) options: FuseExposuresOptions,
}

impl Fuse {
    /// Makes one view of those of a station, and adds what it finds.
    pub(super) fn apply(&self, views: &mut Vec<View>, found: &mut Found) -> Result<()> {
        let (mut fused, mut pixels) = (0, [0; 2]);
        if views.len() > 1 {
            let view;
            (view, pixels) = fuse(std::mem::take(views), &self.options)?;
            views.push(view);
            fused = 1;
        }
        found.add("fused_stations", fused);
        found.add("contradictory_px", pixels[0]);
        found.add("saturated_px", pixels[1]);
        Ok(())
    }
}

/// The longest exposure's view with the ranges of all; how many pixels contradict each other, and how many have no value.
fn fuse(group: Vec<View>, options: &FuseExposuresOptions) -> Result<(View, [usize; 2])> {
    let station = group.first().map_or_else(String::new, |view| format!("station {}", view.station));
    let times = exposure_times(&group, &station)?;
    let frames = group.iter().map(|view| match &view.data {
        ViewData::Range(frame) => Ok(frame),
        _ => Err(Error::Needs { stage: "FuseExposures", needs: "Unwrap" }),
    });
    let frames = frames.collect::<Result<Vec<&RangeFrame>>>()?;
    let exposures: Vec<Exposure<'_>> =
        frames.into_iter().zip(&times).map(|(frame, time)| Exposure { frame, integration_time_s: *time }).collect();
    let fusion = fuse_exposures(&exposures, &fusion_options(&group, options));
    let fusion = fusion.map_err(Error::stage("FuseExposures", &station))?;
    let found = [fusion.contradictory_pixels, fusion.saturated_pixels];
    let frames: Vec<usize> = group.iter().flat_map(|view| view.frames.iter().copied()).collect();
    let longest = times.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).map(|(index, _)| index);
    let Some(mut view) = longest.and_then(|index| group.into_iter().nth(index)) else {
        return Err(Error::unfit("FuseExposures", &station, "no frame"));
    };
    // The frequencies of one exposure no longer belong to the ranges.
    view.channels.clear();
    (view.frames, view.data) = (frames, ViewData::Range(fusion.frame));
    Ok((view, found))
}

/// The integration times, all stated and all different.
fn exposure_times(group: &[View], station: &str) -> Result<Vec<f64>> {
    let times: Option<Vec<f64>> = group.iter().map(|view| view.integration_time_s).collect();
    let Some(times) = times else {
        let message = "the survey states no integration time for some of its frames";
        return Err(Error::unfit("FuseExposures", station, message));
    };
    let same = |time: &f64, other: &f64| time.to_bits() == other.to_bits();
    let twice = times.iter().enumerate().find(|(index, time)| times[..*index].iter().any(|other| same(time, other)));
    match twice {
        None => Ok(times),
        Some((_, time)) => {
            let message = format!("several frames of {time} s: stage Average makes one of them");
            Err(Error::unfit("FuseExposures", station, message))
        }
    }
}

fn fusion_options(group: &[View], options: &FuseExposuresOptions) -> FusionOptions {
    let modulations = group.iter().flat_map(|view| view.modulations.iter().chain(&view.modulation));
    let shortest = modulations.map(Modulation::ambiguity_interval_m).min_by(f64::total_cmp);
    let default = FusionOptions::default();
    FusionOptions {
        false_alarm_probability: options.false_alarm_probability,
        floor_m: options.floor_m,
        normal_sigma_m: shortest.map_or(default.normal_sigma_m, |interval| interval / TAU / NORMAL_SNR),
    }
}
