//! A network fitted robustly, and which of its observations contradict.

use calibration_network::functional_model::{Excluded, Misfit, Scales, Setup, implausibility};
use nalgebra::{Isometry3, Vector3};
use statistics::upper_median;

use crate::Network;
use crate::contradictions::suspicion::{EXPLAINED_SCALE, is_too_many};
use crate::findings::contradiction::WorstValue;

/// Share of stations with too much wrong from which on the cause is looked for in all at once.
pub(super) const WIDESPREAD: f64 = 1.0 / 3.0;
/// Share of image points or ranges.
pub(super) const HALF: f64 = 0.5;
/// Robust standard deviation of unit weight beyond which the observations as a whole are in doubt.
const CONSPICUOUS: f64 = 1.5;
/// Factor within which a network is as large as it was given.
const SAME_SIZE: f64 = 1.5;

/// A network fitted robustly.
pub(super) struct Fit<'n> {
    pub(super) setup: Setup<'n>,
    pub(super) misfits: Vec<Misfit>,
    /// Of each station: sightings that contradict, and all.
    pub(super) wrong: Vec<(usize, usize)>,
}

impl<'n> Fit<'n> {
    pub(super) fn new(setup: Setup<'n>) -> Self {
        let misfits = setup.misfits();
        let contradicting = setup.contradicting();
        let mut wrong = vec![(0, 0); setup.network.stations.len()];
        for (index, seen) in setup.network.sightings.iter().enumerate() {
            wrong[seen.station].1 += 1;
            let image = contradicting.image_points.contains(&index);
            wrong[seen.station].0 += usize::from(image || contradicting.ranges.contains(&index));
        }
        Self { setup, misfits, wrong }
    }

    /// The same, where start values explain at least half of the observations: from farther off no fit explains them.
    pub(super) fn settled(mut setup: Setup<'n>) -> Option<Self> {
        if setup.misses().into_iter().any(|share| share > HALF) {
            return None;
        }
        setup.settle().ok()?;
        Some(Self::new(setup))
    }

    /// Stations with more wrong than single errors explain.
    pub(super) fn suspects(&self) -> Vec<usize> {
        let [wrong, of] = [0, 1].map(|part| self.wrong.iter().map(|(wrong, of)| [*wrong, *of][part]).sum::<usize>());
        let ordinary = |(own, seen): (usize, usize)| (wrong - own) as f64 / (of - seen).max(1) as f64;
        let suspected = |station: &usize| {
            let (own, seen) = self.wrong[*station];
            is_too_many(own, seen, ordinary((own, seen)))
        };
        (0..self.wrong.len()).filter(suspected).collect()
    }

    /// Whether anything speaks against the observations: a station, or how they scatter.
    pub(super) fn is_conspicuous(&self) -> bool {
        let scales = Scales::new(self.misfits.iter());
        !self.suspects().is_empty() || scales.image > CONSPICUOUS || scales.range > CONSPICUOUS
    }

    /// Whether most stations agree, with residuals of the size of the noise.
    pub(super) fn is_consistent(&self) -> bool {
        let few = self.suspects().len() as f64 <= WIDESPREAD * self.wrong.len() as f64;
        few && is_noise(&self.misfits)
    }

    /// Whether the network came out about as large as it was given. Ranges give a free network its scale: in another
    /// unit they would fit any.
    pub(super) fn keeps_scale(&self) -> bool {
        let start = &self.setup.start;
        let places = self.setup.network.stations.iter().zip(&start.stations);
        let places = places
            .filter_map(|(given, found)| Some((given.world_from_camera?.translation.vector, found.translation.vector)));
        let points = self.setup.network.targets.iter().zip(&start.targets);
        let points = points.filter_map(|(given, found)| Some((given.point?.coords, (*found)?.coords)));
        // Given poses may be wrong where coordinates are right, and the other way round.
        let ratios = [places.unzip(), points.unzip()].map(|(given, found): (Vec<Vector3<f64>>, Vec<Vector3<f64>>)| {
            (given.len() >= 3).then(|| size(&found) / size(&given))
        });
        let mut ratios = ratios.into_iter().flatten().peekable();
        ratios.peek().is_none() || ratios.any(|ratio| (1.0 / SAME_SIZE..=SAME_SIZE).contains(&ratio))
    }

    /// Implausibility of a station's sightings where the network is another at that station; `None` where more of them
    /// contradict than single errors explain.
    pub(super) fn with_station(&self, network: &Network, station: usize, pose: Isometry3<f64>) -> Option<f64> {
        let mut setup = Setup { network, excluded: Excluded::default(), ..self.setup.clone() };
        setup.start.stations[station] = pose;
        setup.resettle().ok()?;
        let fit = Fit::new(setup);
        let (wrong, of) = fit.wrong[station];
        let own = fit.misfits.iter().zip(&network.sightings).filter(|(_, seen)| seen.station == station);
        let own: Vec<Misfit> = own.map(|(misfit, _)| *misfit).collect();
        (is_noise(&own) && !is_too_many(wrong, of, 0.0)).then(|| implausibility(own.iter(), self.scales()))
    }

    /// How much more than stated most observations scatter. Explanations are compared with deviations that are true: where all are
    /// stated five times too small, one that fits a hundredth better than another would seem certain.
    pub(super) fn scales(&self) -> Scales {
        Scales::new(self.misfits.iter()).at_least_one()
    }

    /// Of all sightings, which scatter as `scales` say, and all known places.
    pub(super) fn implausibility(&self, scales: Scales) -> f64 {
        // A sighting that nothing predicts is as implausible as can be.
        let lost = Misfit { image: Some(f64::INFINITY), ..Misfit::default() };
        let pairs = self.misfits.iter().zip(&self.setup.network.sightings);
        let known = pairs.map(|(m, seen)| if m.image.is_none() && seen.pixel.is_some() { &lost } else { m });
        implausibility(known, scales) + self.implausibility_of_places()
    }

    pub(super) fn worst(&self) -> Option<WorstValue> {
        let size = |m: &Misfit| m.image.unwrap_or(0.0).max(m.range.unwrap_or(0.0));
        let (index, misfit) = self.misfits.iter().enumerate().max_by(|a, b| size(a.1).total_cmp(&size(b.1)))?;
        Some(worst_value(self.setup.network, index, misfit))
    }
}

/// Whether residuals scatter about as stated.
fn is_noise(misfits: &[Misfit]) -> bool {
    let scales = Scales::new(misfits.iter());
    // NaN: there are none.
    [scales.image, scales.range].into_iter().all(|scale| scale.is_nan() || scale <= EXPLAINED_SCALE)
}

fn worst_value(network: &Network, sighting: usize, misfit: &Misfit) -> WorstValue {
    let seen = &network.sightings[sighting];
    let of_image = misfit.image.unwrap_or(0.0) >= misfit.range.unwrap_or(0.0);
    let (component, observed, residual) = if of_image {
        let [col, row] = seen.pixel.unwrap_or([f64::NAN; 2]);
        let [v_col, v_row] = misfit.pixel.unwrap_or([f64::NAN; 2]);
        ("image point", format!("col {col:.2}, row {row:.2}"), format!("{v_col:.2} and {v_row:.2} pixel"))
    } else {
        let [range, residual] = [seen.range_m, misfit.range_m].map(|value| value.unwrap_or(f64::NAN));
        ("range", format!("{range:.3} m"), format!("{residual:.3} m"))
    };
    let station = network.stations[seen.station].name.clone();
    let target = network.targets[seen.target].name.clone();
    WorstValue { sighting, station, target, component, observed, residual, place: None }
}

/// Median distance of points from their centre.
fn size(points: &[Vector3<f64>]) -> f64 {
    let centre = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    upper_median(&mut points.iter().map(|point| (point - centre).norm()).collect::<Vec<f64>>())
}
