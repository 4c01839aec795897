//! Stations held against what is usual among the others.

use crate::agreement::placement::{FEWEST_STATIONS, PairAgreement};
use statistics::Distribution;

/// Fewest sampled points seen in common by which a station is judged.
const FEWEST_POINTS: usize = 100;
/// Contradicting for each agreeing point that are usual even where the others have fewer: voxels beside edges.
const USUAL: f64 = 0.02;

/// Agreeing and contradicting points.
type Counts = (usize, usize);

/// The sound stations of a survey, with the odds of each by its pairs with the others that are sound.
pub(crate) struct Judges {
    sound: Vec<bool>,
    /// The others that each station has points in common with.
    partners: Vec<Vec<(usize, Counts)>>,
    /// Of each station by its pairs with sound ones.
    sums: Vec<Counts>,
    /// The odds of the sound stations that have enough points, ascending, and the stations.
    odds: Vec<(f64, usize)>,
    /// Most partners of a station.
    most: usize,
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
        let sums: Vec<Counts> = partners.iter().map(of).collect();
        let most = partners.iter().map(Vec::len).max().unwrap_or(0);
        let mut this = Self { sound, partners, sums, odds: Vec::new(), most };
        let known = (0..this.sound.len()).filter(|&station| this.sound[station]);
        this.odds = known.filter_map(|station| Some((odds_of(this.sums[station])?, station))).collect();
        this.odds.sort_unstable_by(|a, b| ascending(*a, *b));
        this
    }

    /// Agreeing and contradicting points of a station's pairs with sound ones.
    pub(crate) fn sums(&self, station: usize) -> Counts {
        self.sums[station]
    }

    /// Standard deviation of the odds above their median, over what is usual: the fifth that has the most, and what is wrong with it, does
    /// not count.
    pub(crate) fn scatter(&self) -> f64 {
        let at = |share: f64| self.odds.get((share * self.odds.len() as f64) as usize).map_or(0.0, |odds| odds.0);
        let usual = at(0.5).max(USUAL);
        (at(0.8) - usual).max(0.0) / usual / Distribution::Normal.quantile(0.8)
    }

    /// Contradictions of a station over what the other sound ones have among themselves, in the median; `None` of fewer than five,
    /// and where too little is seen in common.
    pub(crate) fn times_usual(&self, station: usize) -> Option<f64> {
        let own = odds_of(self.sums[station])?;
        // What the others have without this one.
        let (mut without, mut instead) = (Vec::new(), Vec::new());
        if self.sound[station] {
            without.push(own);
            for &(other, counts) in self.partners[station].iter().filter(|(other, _)| self.sound[*other]) {
                without.extend(odds_of(self.sums[other]));
                instead.extend(odds_of(less(self.sums[other], counts)));
            }
        }
        let count = self.odds.len() + instead.len() - without.len();
        (count + 1 >= FEWEST_STATIONS).then(|| own / self.upper_median(without, instead).max(USUAL))
    }

    /// Upper median of the odds without some and with others instead.
    fn upper_median(&self, mut without: Vec<f64>, mut instead: Vec<f64>) -> f64 {
        without.sort_unstable_by(f64::total_cmp);
        instead.sort_unstable_by(f64::total_cmp);
        let middle = (self.odds.len() + instead.len() - without.len()) / 2;
        let up_to = |sorted: &[f64], value: f64| sorted.partition_point(|other| *other <= value);
        // Whether more than half are at or below a value.
        let is_reached = |value: f64| {
            let own = self.odds.partition_point(|(other, _)| *other <= value);
            own + up_to(&instead, value) - up_to(&without, value) > middle
        };
        let of_own = self.odds.partition_point(|(value, _)| !is_reached(*value));
        let of_instead = instead.partition_point(|value| !is_reached(*value));
        let first = |value: Option<f64>| value.unwrap_or(f64::INFINITY);
        first(self.odds.get(of_own).map(|odds| odds.0)).min(first(instead.get(of_instead).copied()))
    }

    /// The sound station that is contradicted most; of equal ones the last.
    pub(crate) fn worst(&self) -> Option<(usize, f64)> {
        // Leaving out one station changes no more than its own odds and those of its partners: the median of the others is
        // no lower than this.
        let least = (self.odds.len() / 2).checked_sub(2 * self.most + 3).map_or(0.0, |at| self.odds[at].0).max(USUAL);
        let mut worst: Option<(usize, f64)> = None;
        for &(odds, station) in self.odds.iter().rev() {
            if worst.is_some_and(|(_, times)| odds / least < times) {
                break;
            }
            let Some(times) = self.times_usual(station) else { continue };
            if worst.is_none_or(|(other, most)| times.total_cmp(&most).then(station.cmp(&other)).is_gt()) {
                worst = Some((station, times));
            }
        }
        worst
    }

    /// A station is sound no more.
    pub(crate) fn remove(&mut self, station: usize) {
        self.forget(station);
        self.sound[station] = false;
        for (other, counts) in self.partners[station].clone() {
            self.forget(other);
            self.sums[other] = less(self.sums[other], counts);
            if let Some(odds) = odds_of(self.sums[other]).filter(|_| self.sound[other]) {
                let place = self.odds.partition_point(|own| ascending(*own, (odds, other)).is_lt());
                self.odds.insert(place, (odds, other));
            }
        }
    }

    /// Takes the odds of a station out.
    fn forget(&mut self, station: usize) {
        let Some(odds) = odds_of(self.sums[station]) else { return };
        if let Ok(place) = self.odds.binary_search_by(|own| ascending(*own, (odds, station))) {
            self.odds.remove(place);
        }
    }
}

fn ascending(a: (f64, usize), b: (f64, usize)) -> std::cmp::Ordering {
    a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))
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
