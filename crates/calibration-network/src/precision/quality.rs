//! What an adjustment says of each observed value.

use std::collections::BTreeMap;

use adjust::{BlockId, Differentiated, Manifold, Observation, RigidPose, Scale};
use nalgebra::{Isometry3, Point3};
use statistics::Distribution;

use crate::functional_model::equations::{KnownLength, PassivePoint};
use crate::functional_model::setup::{Row, Setup, Solved, Source};
use crate::functional_model::terms::{camera_names, range_names};
use crate::{Component, GroupQuality, ObservationQuality, Result, Verdict};

/// Level of the outlier test where none is asked for.
const USUAL_LEVEL: f64 = 0.001;
/// Probability with which the smallest detectable error is found.
const POWER: f64 = 0.8;
/// Redundancy number below which nothing checks an observation.
const UNCONTROLLED: f64 = 1e-6;

/// Baarda's non-centrality: an error of so many standard deviations of the residual is found with a probability of 80 % by the
/// test of the options.
pub fn noncentrality(level: Option<f64>) -> f64 {
    let level = level.unwrap_or(USUAL_LEVEL);
    Distribution::Normal.critical(level) + Distribution::Normal.quantile(POWER)
}

/// Figures of one value, whatever adjustment it took part in.
#[derive(Debug, Clone, Copy)]
pub struct Figures {
    /// Observed minus modelled value.
    pub residual: f64,
    /// Redundancy number; NaN of a value that was not used.
    pub redundancy: f64,
    /// `v / σ_v`; NaN where nothing checks the value.
    pub standardised: f64,
    /// Whether the value was used.
    pub verdict: Verdict,
}

impl Figures {
    /// Of a value that was used.
    pub fn used(residual: f64, redundancy: f64, standardised: f64) -> Self {
        let controlled = redundancy > UNCONTROLLED;
        let verdict = if controlled { Verdict::Used } else { Verdict::Uncontrolled };
        Self { residual, redundancy, standardised: if controlled { standardised } else { f64::NAN }, verdict }
    }

    /// The gross error that is found with 80 %; infinite where nothing checks the value.
    fn smallest_detectable(&self, sigma: f64, noncentrality: f64) -> f64 {
        match self.verdict {
            Verdict::Used => noncentrality * sigma / self.redundancy.sqrt(),
            Verdict::Uncontrolled => f64::INFINITY,
            _ => f64::NAN,
        }
    }

    /// Of a value that was not.
    pub fn unused(residual: f64, verdict: Verdict) -> Self {
        Self { residual, redundancy: f64::NAN, standardised: f64::NAN, verdict }
    }
}

/// Adjusted poses and coordinates.
#[derive(Debug, Clone, Default)]
pub struct Geometry {
    /// `world_from_camera` of each station.
    pub stations: Vec<Isometry3<f64>>,
    /// Place of each target, metre.
    pub targets: Vec<Option<Point3<f64>>>,
}

impl Geometry {
    /// Distance of a station and a target; NaN where the target has no coordinates.
    pub fn distance(&self, station: usize, target: usize) -> f64 {
        let (Some(pose), Some(Some(point))) = (self.stations.get(station), self.targets.get(target)) else {
            return f64::NAN;
        };
        (point.coords - pose.translation.vector).norm()
    }
}

impl Solved {
    /// Poses of the camera and coordinates of the solution.
    pub fn geometry(&self) -> Result<Geometry> {
        let mounting = self.blocks.mounting.map(|block| self.solution.pose(block)).transpose()?;
        let mounting = mounting.unwrap_or_else(Isometry3::identity);
        let stations = self.blocks.stations.iter().map(|&block| Ok(self.solution.pose(block)? * mounting));
        let point = |block: &Option<BlockId>| {
            let Some(block) = block else { return Ok(None) };
            Ok(Some(Point3::from_slice(self.solution.values(*block)?)))
        };
        Ok(Geometry {
            stations: stations.collect::<Result<_>>()?,
            targets: self.blocks.targets.iter().map(point).collect::<Result<_>>()?,
        })
    }
}

impl Setup<'_> {
    /// All observed values of the network with their figures, in the order of the network.
    pub fn qualities(&self, solved: &Solved, noncentrality: f64) -> Result<Vec<ObservationQuality>> {
        let solution = &solved.solution;
        let scale = if solution.sigma0().is_some() { Scale::Posterior } else { Scale::Prior };
        let standardised = solution.standardised_residuals(scale)?;
        let redundancy = solution.redundancy_numbers();
        let geometry = solved.geometry()?;
        let mut out = Vec::with_capacity(solved.rows.len());
        for (index, row) in solved.rows.iter().enumerate() {
            let at = solved.first_row + index;
            let figures = Figures::used(solution.residuals()[at], redundancy[at], standardised[at]);
            out.push((*row, figures));
        }
        for (row, verdict) in self.unused_rows() {
            out.push((row, Figures::unused(self.predicted(solved, &row)?, verdict)));
        }
        out.sort_by_key(|(row, _)| (row.source, row.component));
        Ok(out.iter().map(|(row, figures)| self.quality(row, *figures, noncentrality, &geometry)).collect())
    }

    /// One entry of the list.
    pub fn quality(&self, row: &Row, figures: Figures, noncentrality: f64, geometry: &Geometry) -> ObservationQuality {
        let seen = match row.source {
            Source::Sighting(index) => Some(&self.network.sightings[index]),
            _ => None,
        };
        let (station, target) = self.names(row.source);
        let is_range = row.component == Component::Range;
        let reference = seen.filter(|_| is_range).map(|seen| geometry.distance(seen.station, seen.target));
        ObservationQuality {
            station,
            target,
            component: row.component,
            observed: row.observed,
            sigma: row.sigma,
            residual: figures.residual,
            redundancy_number: figures.redundancy,
            standardised: figures.standardised,
            smallest_detectable: figures.smallest_detectable(row.sigma, noncentrality),
            verdict: figures.verdict,
            pixel: seen.and_then(|seen| seen.pixel).unwrap_or([f64::NAN; 2]),
            range_m: seen.and_then(|seen| seen.range_m).unwrap_or(f64::NAN),
            amplitude: seen.and_then(|seen| seen.amplitude).unwrap_or(f64::NAN),
            uncorrected_m: reference.map_or(f64::NAN, |reference| row.observed - reference),
        }
    }

    /// Names of station and target, or of the ends of a distance.
    fn names(&self, source: Source) -> (String, String) {
        let network = self.network;
        let pair = |station: usize, target: usize| {
            (network.stations[station].name.clone(), network.targets[target].name.clone())
        };
        match source {
            Source::Sighting(index) => pair(network.sightings[index].station, network.sightings[index].target),
            Source::Passive(index) => {
                let seen = network.passive.as_ref().map(|passive| passive.image_points[index]);
                seen.map_or_else(Default::default, |seen| pair(seen.station, seen.target))
            }
            Source::Distance(index) => {
                let known = &network.distances[index];
                (network.end_name(known.from).to_owned(), network.end_name(known.to).to_owned())
            }
            Source::Target(index, _) => (String::new(), network.targets[index].name.clone()),
            Source::Station(index, _) => (network.stations[index].name.clone(), String::new()),
            Source::Camera => ("camera".to_owned(), String::new()),
            Source::PassiveCamera => ("passive camera".to_owned(), String::new()),
            Source::Term(place, component) => ("camera".to_owned(), self.term_name(place, component)),
        }
    }

    /// Name of a term by its block - the camera, then the range sets - and component.
    fn term_name(&self, place: usize, component: usize) -> String {
        let set = place.checked_sub(1).map(|index| &self.calibration.sets[index]);
        let name = set.map_or_else(
            || camera_names().get(component).map(ToString::to_string),
            |set| range_names(&set.model).get(component).map(|name| format!("{name}{}", set.suffix)),
        );
        name.unwrap_or_default()
    }

    /// Observed values that take no part, and why.
    pub fn unused_rows(&self) -> Vec<(Row, Verdict)> {
        let mut out = Vec::new();
        for (index, seen) in self.network.sightings.iter().enumerate() {
            let source = Source::Sighting(index);
            if let Some(pixel) = seen.pixel.filter(|_| !self.uses_pixel(index)) {
                for (axis, component) in [Component::Col, Component::Row].into_iter().enumerate() {
                    let row = Row { source, component, observed: pixel[axis], sigma: seen.sigma_pixel[axis] };
                    out.push((row, Verdict::Rejected));
                }
            }
            if let Some(observed) = seen.range_m.filter(|_| !self.uses_range(index)) {
                let row = Row { source, component: Component::Range, observed, sigma: seen.sigma_range_m };
                let rejected = self.excluded.ranges.contains(&index);
                out.push((row, if rejected { Verdict::Rejected } else { Verdict::LeftOut }));
            }
        }
        for &index in &self.excluded.distances {
            let known = &self.network.distances[index];
            let (source, component) = (Source::Distance(index), Component::Distance);
            out.push((Row { source, component, observed: known.distance_m, sigma: known.sigma_m }, Verdict::Rejected));
        }
        let points = self.excluded.control_points.iter().filter_map(|&index| self.target_control(index));
        let poses = self.excluded.control_poses.iter().filter_map(|&index| self.station_control(index));
        out.extend(points.chain(poses).flatten().map(|row| (row, Verdict::Rejected)));
        let passive = self.network.passive.iter().flat_map(|passive| passive.image_points.iter().enumerate());
        for (index, seen) in passive.filter(|(index, _)| !self.passive || self.excluded.passive.contains(index)) {
            let verdict = if self.passive { Verdict::Rejected } else { Verdict::LeftOut };
            for (axis, component) in [Component::PassiveCol, Component::PassiveRow].into_iter().enumerate() {
                let source = Source::Passive(index);
                out.push((
                    Row { source, component, observed: seen.pixel[axis], sigma: seen.sigma_pixel[axis] },
                    verdict,
                ));
            }
        }
        out
    }

    /// Residual of a value that took no part; NaN where the solution says nothing about it.
    pub fn predicted(&self, solved: &Solved, row: &Row) -> Result<f64> {
        let (solution, blocks) = (&solved.solution, &solved.blocks);
        let (equation, component): (Box<dyn Observation>, usize) = match row.source {
            Source::Sighting(index) => {
                let seen = &self.network.sightings[index];
                let Some(target) = blocks.targets[seen.target] else { return Ok(f64::NAN) };
                let is_range = row.component == Component::Range;
                let set = blocks.sets.get(self.set_of(seen.station)).copied().filter(|_| is_range);
                if is_range && set.is_none() {
                    return Ok(f64::NAN);
                }
                let own = blocks.of_sighting(seen.station, target, set);
                let equation = self.equation(&self.shared_models(), index, !is_range, is_range);
                let equation = equation.on(&self.calibration.camera, own, blocks.mounting.is_some());
                (Box::new(equation), usize::from(row.component == Component::Row))
            }
            Source::Passive(index) => {
                let Some((passive, [relative, camera])) = self.network.passive.as_ref().zip(blocks.passive) else {
                    return Ok(f64::NAN);
                };
                let seen = passive.image_points[index];
                let Some(target) = blocks.targets[seen.target] else { return Ok(f64::NAN) };
                let own = [blocks.stations[seen.station], target, relative, camera];
                let function = PassivePoint { camera: passive.camera, pixel: seen.pixel };
                (
                    Box::new(Differentiated::new(solution.as_ref(), own, function).map_err(adjust::Error::from)?),
                    usize::from(row.component == Component::PassiveRow),
                )
            }
            Source::Distance(index) => {
                let known = &self.network.distances[index];
                let (Some(from), Some(to)) = (blocks.end(known.from), blocks.end(known.to)) else {
                    return Ok(f64::NAN);
                };
                (
                    Box::new(
                        Differentiated::new(solution.as_ref(), [from, to], KnownLength(known.distance_m))
                            .map_err(adjust::Error::from)?,
                    ),
                    0,
                )
            }
            Source::Target(index, axis) => {
                let Some(block) = blocks.targets[index] else { return Ok(f64::NAN) };
                return Ok(row.observed - solution.values(block)?[axis]);
            }
            Source::Station(index, component) => {
                let Some(given) = &self.network.stations[index].world_from_camera else { return Ok(f64::NAN) };
                let adjusted = RigidPose::values(&solution.pose(blocks.stations[index])?);
                let mut off = [0.0; 6];
                RigidPose.minus(&RigidPose::values(given), &adjusted, &mut off);
                return Ok(off[component]);
            }
            Source::Camera | Source::PassiveCamera | Source::Term(..) => return Ok(f64::NAN),
        };
        let parameters =
            equation.blocks().iter().map(|&block| Ok(solution.values(block)?)).collect::<Result<Vec<_>>>()?;
        let mut residual = vec![0.0; equation.dimension()];
        // A model without a value there predicts nothing.
        let known = equation.evaluate(&parameters, &mut residual, None).is_ok();
        Ok(if known { residual[component] } else { f64::NAN })
    }
}

/// Classes of equal size that ranges are divided into by their amplitude.
const AMPLITUDE_CLASSES: usize = 4;

/// Figures of the groups of values of one kind. Terms have no unit in common, and none was observed.
pub fn groups(qualities: &[ObservationQuality]) -> Vec<GroupQuality> {
    let mut kinds: BTreeMap<Component, Vec<&ObservationQuality>> = BTreeMap::new();
    for quality in used(qualities).filter(|quality| quality.component != Component::Term) {
        kinds.entry(quality.component).or_default().push(quality);
    }
    kinds.into_iter().map(|(component, group)| figures(component.name().to_owned(), &group)).collect()
}

/// Figures of the ranges by amplitude, in four classes of equal size, the darkest first: whether the standard
/// deviations that were stated hold for dark and for bright targets. Empty where no range has an amplitude, or a
/// redundancy number.
pub fn amplitude_classes(qualities: &[ObservationQuality]) -> Vec<GroupQuality> {
    let telling = |q: &&ObservationQuality| {
        q.component == Component::Range && q.amplitude.is_finite() && q.redundancy_number.is_finite()
    };
    let mut ranges: Vec<_> = used(qualities).filter(telling).collect();
    ranges.sort_by(|a, b| a.amplitude.total_cmp(&b.amplitude));
    let class = |class: &[&ObservationQuality]| {
        let [darkest, brightest] = [class[0], class[class.len() - 1]].map(|quality| quality.amplitude);
        figures(format!("range, amplitude {darkest:.0} to {brightest:.0}"), class)
    };
    ranges.chunks(ranges.len().div_ceil(AMPLITUDE_CLASSES).max(1)).map(class).collect()
}

fn used(qualities: &[ObservationQuality]) -> impl Iterator<Item = &ObservationQuality> {
    qualities.iter().filter(|quality| matches!(quality.verdict, Verdict::Used | Verdict::Uncontrolled))
}

fn figures(name: String, group: &[&ObservationQuality]) -> GroupQuality {
    let sum = |part: fn(&ObservationQuality) -> f64| group.iter().map(|quality| part(quality)).sum::<f64>();
    let count = group.len() as f64;
    let redundancy = sum(|quality| quality.redundancy_number);
    let vtpv = sum(|quality| (quality.residual / quality.sigma).powi(2));
    GroupQuality {
        name,
        observations: group.len(),
        redundancy,
        rms: (sum(|quality| quality.residual.powi(2)) / count).sqrt(),
        sigma0: (redundancy > UNCONTROLLED * count).then(|| (vtpv / redundancy).sqrt()),
    }
}
