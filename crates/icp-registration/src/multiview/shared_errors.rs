//! Errors that neighbouring places of a station share: what a camera does wrong over a sixth of its image does not
//! average out over pixels, nor over tiles.
//!
//! The variance is estimated from the differences between stations at several scales. With differences d of tiles in
//! units of the noise of a point there, products of two tiles have as expectation the variance that these share: noise
//! is in none of them, however many points a tile has. Tiles share a *block*, a cell of directions seen from their station;
//! blocks of twice the side share less. So the variance of each scale is the mean product of tiles that are in one block
//! of that side and in none of half of it.
//!
//! Shared errors are taken to grow with range and slant as the noise does: true of disparities, and of phases.

use std::collections::{BTreeMap, HashMap, HashSet};

use nalgebra::{DMatrix, DVector};

use super::scatter::TileMean;

/// Normal deviate from which tiles count as sharing errors, at each scale: one in a thousand where they do not.
const LEVEL: f64 = 3.09;
/// Cells of directions along a face of the cube, the finest: half a milliradian.
const CELLS: f64 = 4096.0;
/// Blocks that there must be for each unknown: what is wider the poses take up, and no difference tells of it.
const BLOCKS_FOR_UNKNOWN: f64 = 2.0;

/// Variances that tiles in one block share, in variances of a point there.
#[derive(Debug, Clone, Default)]
pub(super) struct SharedErrors {
    /// Of the points of a tile.
    pub of_tile: f64,
    /// Of wider blocks: by how many halvings of the cells they are told, and what they add to what still wider ones share.
    wider: Vec<(u32, f64)>,
}

/// A cell of directions from a station: face of a cube, column, row.
pub(super) fn bearing(direction: [f64; 3]) -> [u32; 3] {
    let face = (0..3).fold(0, |best, k| if direction[k].abs() > direction[best].abs() { k } else { best });
    let largest = direction[face].abs().max(f64::MIN_POSITIVE);
    let cell = |axis: usize| ((direction[axis % 3] / largest + 1.0) * 0.5 * CELLS) as u32;
    [2 * face as u32 + u32::from(direction[face] < 0.0), cell(face + 1), cell(face + 2)]
}

/// Part of the sums below which their difference is rounding.
const ROUNDING: f64 = 1e-9;

/// In place of halvings: the tiles of a facet, in whatever direction. What light that bounces does to a whole wall, or to a
/// floor seen at a slant.
const FACET: u32 = u32::MAX;

/// A station and a block that it saw.
type Seen = (usize, [u32; 3]);

fn block(mean: &TileMean, halvings: u32) -> Seen {
    let [face, column, row] = mean.bearing;
    let block = if halvings == FACET { [mean.facet, 0, 0] } else { [face, column >> halvings, row >> halvings] };
    (mean.station, block)
}

/// What two stations saw of a tile: the difference in units of the noise of a point, its variance by noise, and its weight.
struct Difference<'a> {
    between: [&'a TileMean; 2],
    value: f64,
    noise: f64,
    weight: f64,
}

impl<'a> Difference<'a> {
    fn new(first: &'a TileMean, second: &'a TileMean, known: f64, noise: f64) -> Self {
        let point = first.point_variance + second.point_variance;
        let noise = noise * (1.0 / first.weight + 1.0 / second.weight) / point;
        let value = (first.mean_m - second.mean_m) / point.sqrt();
        Self { between: [first, second], value, noise, weight: 1.0 / (noise + known) }
    }

    fn blocks(&self, halvings: u32) -> [Seen; 2] {
        self.between.map(|mean| block(mean, halvings))
    }

    /// Whether the stations saw the tile in blocks that are not the same part of their images: what a camera always does
    /// wrong there would be in no difference.
    fn tells(&self, halvings: u32) -> bool {
        let [first, second] = self.blocks(halvings);
        first.1 != second.1
    }
}

/// Squares of the sums over blocks, of differences and of weights.
fn squares(differences: &[&Difference<'_>], halvings: u32) -> (f64, f64) {
    let mut sums: HashMap<[Seen; 2], (f64, f64)> = HashMap::new();
    for d in differences {
        let sum = sums.entry(d.blocks(halvings)).or_default();
        *sum = (sum.0 + d.weight * d.value, sum.1 + d.weight);
    }
    // In a fixed order: sums of floating-point numbers depend on it.
    let mut sums: Vec<_> = sums.into_iter().collect();
    sums.sort_unstable_by_key(|(blocks, _)| *blocks);
    sums.iter().fold((0.0, 0.0), |all, (_, (d, w))| (all.0 + d * d, all.1 + w * w))
}

/// Variance of differences beyond that by noise.
fn variance(differences: &[&Difference<'_>]) -> f64 {
    let sum = |of: &dyn Fn(&Difference<'_>) -> f64| differences.iter().map(|d| d.weight.powi(2) * of(d)).sum::<f64>();
    let all = sum(&|_| 1.0);
    if all > 0.0 { (sum(&|d| d.value.powi(2) - d.noise) / all).max(0.0) } else { 0.0 }
}

/// What tiles share that are in one block and in none of half its side; `None` where that is within the noise, or the poses
/// take it up.
fn covariance(differences: &[&Difference<'_>], halvings: u32, unknowns: f64) -> Option<f64> {
    let blocks: HashSet<Seen> = differences.iter().flat_map(|d| d.blocks(halvings)).collect();
    let lost = unknowns / blocks.len().max(1) as f64;
    if lost * BLOCKS_FOR_UNKNOWN > 1.0 {
        return None;
    }
    let (all, inner) =
        (squares(differences, halvings), squares(differences, if halvings == FACET { 0 } else { halvings - 1 }));
    let (products, pairs) = (all.0 - inner.0, all.1 - inner.1);
    let is_told = pairs > ROUNDING * all.1 && products > LEVEL * (2.0 * pairs).sqrt();
    is_told.then_some(products / pairs / (1.0 - lost))
}

impl SharedErrors {
    /// Those of patches, from the distances of partners: squares, what noise leaves of them, and the variance of a point,
    /// each summed over both. Half of the distances are smaller than the median, whatever the others are.
    pub(super) fn of_contacts(contacts: impl Iterator<Item = (f64, f64, f64)>) -> Self {
        /// Median of a chi-squared with one degree of freedom.
        const MEDIAN: f64 = 0.4549;
        let (mut squares, mut noise): (Vec<f64>, Vec<f64>) =
            contacts.filter(|(_, _, point)| *point > 0.0).map(|(s, noise, point)| (s / point, noise / point)).unzip();
        if squares.is_empty() {
            return Self::default();
        }
        let median = |values: &mut Vec<f64>| crate::kernel::quantile(values, 0.5);
        Self { of_tile: (median(&mut squares) / MEDIAN - median(&mut noise)).max(0.0), wider: Vec::new() }
    }

    /// The variance of the points of a tile that they share, in variances of a point.
    pub(super) fn total(&self) -> f64 {
        self.of_tile + self.wider.iter().map(|(_, variance)| variance).sum::<f64>()
    }

    /// Whether no more than the points of a tile share them.
    pub(super) fn is_local(&self) -> bool {
        self.wider.is_empty()
    }

    /// Estimates them from what the stations saw of the tiles, `unknowns` having been fitted: those of `known` weigh, and
    /// the noise of a mean is `noise` over its weight.
    pub(super) fn estimated(means: &[Vec<TileMean>], known: &Self, noise: f64, unknowns: f64) -> Self {
        let mut differences = Vec::new();
        for tile in means.iter().flat_map(|facet| facet.chunk_by(|a, b| a.tile == b.tile)) {
            if tile.iter().all(|mean| mean.counts) {
                let pairs = tile
                    .iter()
                    .enumerate()
                    .flat_map(|(k, first)| tile[k + 1..].iter().map(move |other| (first, other)));
                differences.extend(pairs.map(|(first, other)| Difference::new(first, other, known.total(), noise)));
            }
        }
        let all: Vec<&Difference<'_>> = differences.iter().collect();
        let (mut single, mut covariances) = (variance(&all), Vec::new());
        for halvings in (1..CELLS.log2() as u32).chain([FACET]) {
            // All differences are more, those from other parts of the images tell more.
            let apart: Vec<&Difference<'_>> =
                all.iter().copied().filter(|d| halvings != FACET && d.tells(halvings)).collect();
            for some in [&all, &apart] {
                if let Some(covariance) = covariance(some, halvings, unknowns) {
                    covariances.push((halvings, covariance));
                    single = single.max(variance(some));
                }
            }
        }
        Self::nested(single, &covariances)
    }

    /// What each scale adds to the wider ones, from what tiles share at each: never less than at wider ones.
    fn nested(single: f64, covariances: &[(u32, f64)]) -> Self {
        let (mut wider, mut shared) = (Vec::new(), 0.0);
        for &(halvings, covariance) in covariances.iter().rev() {
            if covariance > shared {
                wider.push((halvings, covariance - shared));
                shared = covariance;
            }
        }
        wider.reverse();
        Self { of_tile: (single - shared).max(0.0), wider }
    }

    /// What errors add to the covariance that a camera makes in all stations alike: those of neighbouring ones bend the
    /// survey the same way, and no difference between them grows. `answers`: what the equations of all unknowns get from an
    /// error of one standard deviation of a point in each cell of directions.
    pub(super) fn bent(&self, answers: &BTreeMap<[u32; 3], DVector<f64>>, covariance: &DMatrix<f64>) -> DMatrix<f64> {
        let mut sum = DMatrix::zeros(covariance.nrows(), covariance.ncols());
        for &(halvings, variance) in self.wider.iter().filter(|(halvings, _)| *halvings != FACET) {
            let mut blocks: BTreeMap<[u32; 3], DVector<f64>> = BTreeMap::new();
            for ([face, column, row], answer) in answers {
                let block = blocks.entry([*face, column >> halvings, row >> halvings]);
                *block.or_insert_with(|| DVector::zeros(answer.len())) += answer;
            }
            for answer in blocks.values() {
                let moved = covariance * answer;
                sum.ger(variance, &moved, &moved, 1.0);
            }
        }
        sum
    }

    /// The variance beyond noise that each mean has, metre², so that the tiles of a block together weigh as much as what
    /// they share allows: for the mean over a block that is exact.
    pub(super) fn variances(&self, means: &[Vec<TileMean>], noise: f64, mut give: impl FnMut(&TileMean, f64)) {
        let all: Vec<&TileMean> = means.iter().flatten().collect();
        let of_noise = |mean: &TileMean| noise / (mean.weight * mean.point_variance);
        let mut variances: Vec<f64> = all.iter().map(|mean| of_noise(mean) + self.of_tile).collect();
        for &(halvings, variance) in &self.wider {
            let mut weights: HashMap<(usize, [u32; 3]), f64> = HashMap::new();
            for (mean, own) in all.iter().zip(&variances) {
                *weights.entry(block(mean, halvings)).or_default() += 1.0 / own;
            }
            for (mean, own) in all.iter().zip(&mut variances) {
                *own *= 1.0 + variance * weights.get(&block(mean, halvings)).copied().unwrap_or(0.0);
            }
        }
        for (mean, own) in all.iter().zip(&variances) {
            give(mean, (own - of_noise(mean)).max(0.0) * mean.point_variance);
        }
    }
}
