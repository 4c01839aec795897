//! Stations held against what is usual among the others.

use crate::agreement::placement::{FEWEST_STATIONS, PairAgreement};
use rayon::prelude::*;
use statistics::{Distribution, upper_median};

/// Fewest sampled points seen in common by which a station is judged: at four times what is usual eight of them contradict. Half and twice as
/// many change no verdict in rooms, buildings, and sets of a Kinect's frames: all see more in common.
const FEWEST_POINTS: usize = 100;
/// Contradicting for each agreeing point that are usual even where the others have fewer: voxels beside edges. Half and twice as many change how
/// often what is usual eight stations of a room are contradicted by as much (1.0 to 1.3; 0.5 to 1.6), and no verdict there or among frames.
const USUAL: f64 = 0.02;

/// Agreeing and contradicting points.
type Counts = (usize, usize);

/// The sound stations of a survey, with what each has in common with the others that are sound.
pub(crate) struct Judges {
    sound: Vec<bool>,
    /// The others that each station has points in common with.
    partners: Vec<Vec<(usize, Counts)>>,
    /// Of each station by its pairs with sound ones.
    sums: Vec<Counts>,
}

impl Judges {
    pub(crate) fn new(sound: Vec<bool>, pairs: &[PairAgreement]) -> Self {
        let mut partners = vec![Vec::new(); sound.len()];
        for pair in pairs {
            let counts = (pair.agreeing, pair.contradicting);
            partners[pair.target].push((pair.source, counts));
            partners[pair.source].push((pair.target, counts));
        }
        let of = |partners: &Vec<(usize, Counts)>| {
            let own = partners.iter().filter(|(other, _)| sound[*other]);
            own.fold((0, 0), |sums: Counts, (_, counts)| (sums.0 + counts.0, sums.1 + counts.1))
        };
        let sums = partners.iter().map(of).collect();
        Self { sound, partners, sums }
    }

    /// Agreeing and contradicting points of a station's pairs with sound ones.
    pub(crate) fn sums(&self, station: usize) -> Counts {
        self.sums[station]
    }

    /// Standard deviation of the odds above their median, over what is usual: the fifth that has the most, and what is wrong with it, does
    /// not count.
    pub(crate) fn scatter(&self) -> f64 {
        let mut odds = self.odds(&self.sums, None);
        odds.sort_unstable_by(f64::total_cmp);
        let at = |share: f64| odds.get((share * odds.len() as f64) as usize).copied().unwrap_or(0.0);
        let usual = at(0.5).max(USUAL);
        (at(0.8) - usual).max(0.0) / usual / Distribution::Normal.quantile(0.8)
    }

    /// Contradictions of a station over what the other sound ones have among themselves, in the median; `None` of fewer than five,
    /// and where too little is seen in common.
    pub(crate) fn times_usual(&self, station: usize) -> Option<f64> {
        let own = odds_of(self.sums[station])?;
        let mut without = self.sums.clone();
        for &(other, counts) in self.partners[station].iter().filter(|_| self.sound[station]) {
            without[other] = less(without[other], counts);
        }
        let mut odds = self.odds(&without, Some(station));
        (odds.len() + 1 >= FEWEST_STATIONS).then(|| own / upper_median(&mut odds).max(USUAL))
    }

    /// The odds by these sums of all sound stations, but for one, that have enough points.
    fn odds(&self, sums: &[Counts], but: Option<usize>) -> Vec<f64> {
        let others = (0..sums.len()).filter(|other| self.sound[*other] && Some(*other) != but);
        others.filter_map(|other| odds_of(sums[other])).collect()
    }

    /// The sound station that is contradicted most; of equal ones the last.
    pub(crate) fn worst(&self) -> Option<(usize, f64)> {
        let sound = (0..self.sound.len()).into_par_iter().filter(|station| self.sound[*station]);
        let times: Vec<(usize, f64)> =
            sound.filter_map(|station| Some((station, self.times_usual(station)?))).collect();
        times.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// A station is sound no more.
    pub(crate) fn remove(&mut self, station: usize) {
        self.sound[station] = false;
        for &(other, counts) in &self.partners[station] {
            self.sums[other] = less(self.sums[other], counts);
        }
    }
}

fn less(all: Counts, some: Counts) -> Counts {
    (all.0 - some.0, all.1 - some.1)
}

/// Contradicting for each agreeing point: of what is wrong there may be many times more than of what is right. `None` of too few.
fn odds_of((agreeing, contradicting): Counts) -> Option<f64> {
    (agreeing + contradicting >= FEWEST_POINTS).then(|| contradicting as f64 / agreeing.max(1) as f64)
}

#[cfg(test)]
#[path = "../../tests/inside/judges.rs"]
mod tests;
