//! Codes whose targets have no coordinates, held against what the other stations see under the same name.

use std::collections::BTreeMap;

use camera_model::LensDistortion;
use orientation::{ImagePoint, NameCheckOptions, NameVerdict, ObservedRange, TieObservation as Tie, check_names};
use pipeline::{Error, Result};

use crate::find::single::Singles;
use crate::find::single::names::{NOMINAL_SIGMA, REACH_SHARE};
use crate::find::station::{LeftOut, StationPicture};
use crate::kind::SingleKind;

/// Standard deviation of what a lens of which nothing is known does to image points, as a share of the image's diagonal: what it does at
/// most lies at three. Smaller, and right codes in the corners of an image are doubted; larger, and a code that was read wrongly near
/// its place is not.
const LENS_SHARE: f64 = REACH_SHARE / 3.0;

impl Singles {
    /// Checks the codes of all stations against each other and leaves out those that the geometry contradicts.
    ///
    /// # Errors
    /// Numbers that no image point has.
    pub(crate) fn check_codes(&self, stations: &mut [StationPicture]) -> Result<()> {
        let is_coded = matches!(self.kind, SingleKind::Rings { .. });
        let is_open = |station: &StationPicture| station.seen.as_ref().is_ok_and(|seen| seen.unchecked > 0);
        if !is_coded || !stations.iter().any(is_open) {
            return Ok(());
        }
        let (places, ties) = self.ties(stations);
        let verdicts = check_names(&self.camera, &ties, &NameCheckOptions::default())
            .map_err(|error| Error::Estimate { what: "names of targets", source: error.into() })?;
        let names: Vec<String> = stations.iter().map(|station| station.station.clone()).collect();
        let seen_by = |target: usize| {
            let own = places.iter().zip(&ties).filter(|(_, tie)| tie.target == target);
            own.map(|([station, _], _)| names[*station].as_str()).collect::<Vec<_>>().join(", ")
        };
        let mut wrong: Vec<([usize; 2], String)> = Vec::new();
        for ((place, tie), verdict) in places.iter().zip(&ties).zip(&verdicts) {
            let Some(seen) = stations[place[0]].seen.as_mut().ok().filter(|seen| seen.unchecked > 0) else { continue };
            match verdict {
                NameVerdict::Open => continue,
                NameVerdict::Agrees => {}
                NameVerdict::Contradicts { .. } => wrong.push((*place, reason(verdict, &seen_by(tie.target)))),
            }
            seen.unchecked -= 1;
        }
        // From the last, so that rows keep their places.
        for ([station, row], reason) in wrong.into_iter().rev() {
            let picture = &mut stations[station];
            let out = picture.observations.remove(row);
            if let (Ok(seen), Some(pixel)) = (&mut picture.seen, out.pixel) {
                seen.left_out.push(LeftOut { target: out.target, pixel, reason });
            }
        }
        Ok(())
    }

    /// What all stations see under names, with its station and row.
    fn ties(&self, stations: &[StationPicture]) -> (Vec<[usize; 2]>, Vec<Tie>) {
        let format = &self.camera.format;
        let is_nominal = self.camera.lens == LensDistortion::default();
        let lens_px = if is_nominal { LENS_SHARE * (format.width as f64).hypot(format.height as f64) } else { 0.0 };
        let mut targets: BTreeMap<&str, usize> = BTreeMap::new();
        let (mut places, mut ties) = (Vec::new(), Vec::new());
        let seeing = stations.iter().enumerate().filter(|(_, picture)| !picture.observations.is_empty());
        for (number, (station, picture)) in seeing.enumerate() {
            for (row, seen) in picture.observations.iter().enumerate() {
                let (Some(pixel), Some(sigma)) = (seen.pixel, seen.sigma_pixel) else { continue };
                let next = targets.len();
                let target = *targets.entry(&seen.target).or_insert(next);
                let image = ImagePoint { pixel, sigma_pixel: sigma.map(|sigma| sigma.hypot(lens_px)) };
                let range = seen.range_m.zip(seen.sigma_range_m).map(|(range_m, sigma)| {
                    // They are not corrected.
                    ObservedRange { range_m, sigma_m: sigma.hypot(NOMINAL_SIGMA[1]) }
                });
                places.push([station, row]);
                ties.push(Tie { station: number, target, image, range });
            }
        }
        (places, ties)
    }
}

fn reason(verdict: &NameVerdict, stations: &str) -> String {
    match verdict {
        NameVerdict::Contradicts { deviations, limit, is_alone: true } => format!(
            "the other stations that see this code put it elsewhere, by {deviations:.0} standard deviations (right ones reach {limit:.1} \
             in one survey of a thousand): it is read wrongly here"
        ),
        NameVerdict::Contradicts { deviations, limit, is_alone: false } => format!(
            "stations {stations} contradict each other about where this code is, by {deviations:.0} standard deviations (right ones \
             reach {limit:.1} in one survey of a thousand): one of them reads it wrongly, and nothing tells which"
        ),
        _ => String::new(),
    }
}
