//! What is refused before anything is computed, each with the name of what is wrong.

use std::collections::BTreeSet;

use nalgebra::DMatrix;

use crate::{DistanceEnd, Error, Network, OutsideImage, Result, Sighting};

/// How far beyond the edge of the image the centre of a target at the edge may be measured: five of its standard
/// deviations, from half a pixel to three.
const BEYOND_EDGE_SIGMAS: f64 = 5.0;
const BEYOND_EDGE: [f64; 2] = [0.5, 3.0];
/// Targets that orient a station.
const TARGETS_OF_A_STATION: usize = 3;

impl Network {
    /// Numbers of the sightings of each station.
    pub fn sightings_by_station(&self) -> Vec<Vec<usize>> {
        self.listed(self.stations.len(), |seen| seen.station)
    }

    /// Numbers of the sightings of each target.
    pub fn sightings_by_target(&self) -> Vec<Vec<usize>> {
        self.listed(self.targets.len(), |seen| seen.target)
    }

    fn listed(&self, count: usize, end: impl Fn(&Sighting) -> usize) -> Vec<Vec<usize>> {
        let mut lists = vec![Vec::new(); count];
        for (index, seen) in self.sightings.iter().enumerate() {
            if let Some(list) = lists.get_mut(end(seen)) {
                list.push(index);
            }
        }
        lists
    }

    /// Checks names, numbers and references of a network.
    pub fn validate(&self) -> Result<()> {
        self.camera.validate()?;
        self.range_model.validate()?;
        unique("station", self.stations.iter().map(|station| station.name.as_str()))?;
        unique("target", self.targets.iter().map(|target| target.name.as_str()))?;
        self.check_control()?;
        self.check_sightings()?;
        self.check_distances()?;
        self.check_passive()
    }

    fn check_control(&self) -> Result<()> {
        for station in &self.stations {
            let what = || format!("station `{}`", station.name);
            if let Some(pose) = &station.world_from_camera {
                finite(what, "a value of its pose", pose.translation.vector.iter().chain(pose.rotation.coords.iter()))?;
            }
            if let Some(covariance) = &station.covariance {
                check_covariance(what, &DMatrix::from_fn(6, 6, |row, column| covariance[(row, column)]))?;
                if station.world_from_camera.is_none() {
                    return Err(Error::Datum { reason: format!("{} has a covariance but no pose", what()) });
                }
            }
            finite(what, "drift_m", [station.drift_m].iter())?;
            if let Some(time) = station.integration_time_s {
                positive(what, "integration_time_s", time)?;
            }
        }
        for target in &self.targets {
            let what = || format!("target `{}`", target.name);
            if let Some(point) = &target.point {
                finite(what, "a coordinate", point.iter())?;
            }
            if let Some(covariance) = &target.covariance {
                check_covariance(what, &DMatrix::from_fn(3, 3, |row, column| covariance[(row, column)]))?;
                if target.point.is_none() {
                    return Err(Error::Datum { reason: format!("{} has a covariance but no coordinates", what()) });
                }
            }
        }
        Ok(())
    }

    fn check_sightings(&self) -> Result<()> {
        for (index, seen) in self.sightings.iter().enumerate() {
            self.check_ends(&format!("sighting {index}"), seen.station, seen.target)?;
            let what = || self.pair(seen.station, seen.target);
            if let Some(pixel) = &seen.pixel {
                finite(what, "the image point", pixel.iter())?;
                seen.sigma_pixel.iter().try_for_each(|sigma| positive(what, "sigma of the image point", *sigma))?;
                self.check_inside(index)?;
            }
            if let Some(range_m) = seen.range_m {
                positive(what, "range", range_m)?;
                positive(what, "sigma of the range", seen.sigma_range_m)?;
                if seen.pixel.is_none() {
                    let expected = "an image point with each range: range corrections depend on it";
                    return Err(Error::BadNetworkValue {
                        what: what(),
                        name: "image point",
                        value: f64::NAN,
                        expected,
                    });
                }
            }
            if let Some(amplitude) = seen.amplitude {
                positive(what, "amplitude", amplitude)?;
            }
        }
        Ok(())
    }

    /// Refuses an image point outside the image.
    fn check_inside(&self, sighting: usize) -> Result<()> {
        let format = &self.camera.format;
        let sizes = [format.width, format.height].map(|count| count as f64);
        let inside = |[col, row]: [f64; 2], seen: &Sighting| {
            let beyond = |sigma: f64| (BEYOND_EDGE_SIGMAS * sigma).clamp(BEYOND_EDGE[0], BEYOND_EDGE[1]);
            let within = |value: f64, size: f64, sigma: f64| {
                (-0.5 - beyond(sigma)..=size - 0.5 + beyond(sigma)).contains(&value)
            };
            [within(col, sizes[0], seen.sigma_pixel[0]), within(row, sizes[1], seen.sigma_pixel[1])]
        };
        let seen = &self.sightings[sighting];
        let Some(pixel) = seen.pixel else { return Ok(()) };
        let Some(axis) = inside(pixel, seen).iter().position(|inside| !inside) else { return Ok(()) };
        let points = || self.sightings.iter().filter_map(|seen| Some((seen.pixel?, seen)));
        let outside = points().filter(|(pixel, seen)| inside(*pixel, seen) != [true; 2]).count();
        let exchanged = points().all(|([col, row], seen)| inside([row, col], seen) == [true; 2]);
        let image = format!(
            "{} x {} pixels; {outside} of {} image points are outside{}",
            format.width,
            format.height,
            points().count(),
            if exchanged { ", none if columns and rows are exchanged" } else { "" }
        );
        let component = ["col", "row"][axis];
        let (what, limits) = (self.pair(seen.station, seen.target), [-0.5, sizes[axis] - 0.5]);
        Err(Box::new(OutsideImage { what, sighting, component, value: pixel[axis], limits, image }).into())
    }

    fn check_distances(&self) -> Result<()> {
        for (index, known) in self.distances.iter().enumerate() {
            for end in [known.from, known.to] {
                let (station, target) = match end {
                    DistanceEnd::Station(station) => (Some(station), None),
                    DistanceEnd::Target(target) => (None, Some(target)),
                };
                let what = format!("known distance {index}");
                self.check_ends(&what, station.unwrap_or_default(), target.unwrap_or_default())?;
            }
            let what = || format!("known distance {} to {}", self.end_name(known.from), self.end_name(known.to));
            positive(what, "distance", known.distance_m)?;
            positive(what, "sigma", known.sigma_m)?;
            if known.from == known.to {
                let expected = "two different ends";
                return Err(Error::BadNetworkValue {
                    what: what(),
                    name: "distance",
                    value: known.distance_m,
                    expected,
                });
            }
        }
        Ok(())
    }

    fn check_passive(&self) -> Result<()> {
        let Some(passive) = &self.passive else { return Ok(()) };
        passive.camera.validate()?;
        if let Some(covariance) = &passive.covariance {
            finite(|| "passive camera".to_owned(), "a value of its covariance", covariance.iter())?;
        }
        for (index, seen) in passive.image_points.iter().enumerate() {
            self.check_ends(&format!("passive image point {index}"), seen.station, seen.target)?;
            let what = || format!("passive image of {}", self.pair(seen.station, seen.target));
            finite(what, "the image point", seen.pixel.iter())?;
            seen.sigma_pixel.iter().try_for_each(|sigma| positive(what, "sigma of the image point", *sigma))?;
        }
        Ok(())
    }

    fn check_ends(&self, what: &str, station: usize, target: usize) -> Result<()> {
        for (kind, index, count) in [("station", station, self.stations.len()), ("target", target, self.targets.len())]
        {
            if index >= count {
                let (what, name, known) = (what.to_owned(), format!("number {index}"), format!("{count} of them"));
                return Err(Error::UnknownName { what, kind, name, known });
            }
        }
        Ok(())
    }

    /// Names of a station and a target, for messages.
    pub fn pair(&self, station: usize, target: usize) -> String {
        format!("target `{}` from station `{}`", self.targets[target].name, self.stations[station].name)
    }

    /// Name of an end of a distance.
    pub fn end_name(&self, end: DistanceEnd) -> &str {
        match end {
            DistanceEnd::Station(station) => &self.stations[station].name,
            DistanceEnd::Target(target) => &self.targets[target].name,
        }
    }

    /// Refuses stations with fewer than three targets and targets that their sightings cannot place.
    /// `ranged` says of each station whether its ranges take part.
    pub fn check_coverage(&self, ranged: &[bool], passive: bool) -> Result<()> {
        let sightings = self.sightings_by_station();
        let images = |station: usize| {
            let own = sightings[station].iter().map(|&index| &self.sightings[index]);
            own.filter(|seen| seen.pixel.is_some()).map(|seen| seen.target).collect::<BTreeSet<_>>().len()
        };
        let partner = |station: usize| {
            let points = self.passive.iter().filter(|_| passive).flat_map(|passive| &passive.image_points);
            points.filter(|seen| seen.station == station).map(|seen| seen.target).collect::<BTreeSet<_>>().len()
        };
        for (index, station) in self.stations.iter().enumerate() {
            let found = images(index).max(partner(index));
            if found < TARGETS_OF_A_STATION && station.covariance.is_none() {
                let found = format!("{found} target{} in its image", if found == 1 { "" } else { "s" });
                let needed = "at least three targets, not in one line";
                return Err(Error::TooFewSightings { kind: "station", name: station.name.clone(), found, needed });
            }
        }
        let mut known = vec![0_usize; self.targets.len()];
        let mut sightings = vec![0_usize; self.targets.len()];
        for seen in &self.sightings {
            let range = seen.range_m.is_some() && ranged.get(seen.station) == Some(&true);
            known[seen.target] += 2 * usize::from(seen.pixel.is_some()) + usize::from(range);
            sightings[seen.target] += 1;
        }
        for seen in self.passive.iter().filter(|_| passive).flat_map(|passive| &passive.image_points) {
            known[seen.target] += 2;
            sightings[seen.target] += 1;
        }
        for (target, (known, sightings)) in self.targets.iter().zip(known.into_iter().zip(sightings)) {
            if sightings > 0 && known < 3 && target.covariance.is_none() {
                let found = format!("{sightings} sighting{} without a range", if sightings == 1 { "" } else { "s" });
                let needed = "an image point in two stations, or a range, or coordinates with standard deviations";
                return Err(Error::TooFewSightings { kind: "target", name: target.name.clone(), found, needed });
            }
        }
        Ok(())
    }
}

fn unique<'n>(kind: &'static str, names: impl Iterator<Item = &'n str>) -> Result<()> {
    let mut seen = BTreeSet::new();
    for name in names {
        if !seen.insert(name) {
            return Err(Error::DuplicateName { kind, name: name.to_owned() });
        }
    }
    Ok(())
}

fn positive(what: impl Fn() -> String, name: &'static str, value: f64) -> Result<()> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(Error::BadNetworkValue { what: what(), name, value, expected: "a positive number" })
}

fn finite<'v>(what: impl Fn() -> String, name: &'static str, mut values: impl Iterator<Item = &'v f64>) -> Result<()> {
    match values.find(|value| !value.is_finite()) {
        None => Ok(()),
        Some(&value) => Err(Error::BadNetworkValue { what: what(), name, value, expected: "a finite number" }),
    }
}

fn check_covariance(what: impl Fn() -> String, matrix: &DMatrix<f64>) -> Result<()> {
    let asymmetric = (matrix - matrix.transpose()).amax() > 1e-9 * matrix.amax();
    if matrix.iter().all(|value| value.is_finite()) && !asymmetric && matrix.clone().cholesky().is_some() {
        return Ok(());
    }
    let value = matrix.diagonal().min();
    let expected = "a symmetric positive definite covariance (no standard deviation is zero)";
    Err(Error::BadNetworkValue { what: what(), name: "smallest variance", value, expected })
}
