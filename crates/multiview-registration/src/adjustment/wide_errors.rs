//! Errors that tiles share: what a camera does wrong over a whole wall is no independent error of each tile on it.
//!
//! Differences between stations, summed over blocks of tiles, grow as the root of the number of tiles where these are
//! independent, and faster where they share something. The widest blocks are whole shared planes.

use std::collections::BTreeMap;

use nalgebra::{DVector, Vector3, Vector6};
use statistics::Distribution;

use crate::adjustment::simultaneous::Adjusted;
use crate::planes::elimination::motion_of;
use crate::planes::scatter::TileMean;
use crate::planes::shared_planes::SharedPlane;

/// Sides of blocks, tiles; the last holds every shared plane.
const SIDES: [usize; 4] = [2, 4, 8, usize::MAX];
/// Probability at which independent tiles pass for ones that share errors, at each size of blocks.
const LEVEL: f64 = 1e-3;

/// Stations of which all are looked at. Of more only so many: of each the whole factor is needed.
const MANY: usize = 200;

/// What a station saw of the tiles of a block off the mean of all stations.
struct OfStation {
    /// The weighted sum, its variance if tiles are independent, and its derivatives by all unknowns.
    sum: f64,
    variance: f64,
    derivatives: Derivatives,
}

/// Derivatives by the poses of some stations and by the shared parameters.
#[derive(Debug, Clone)]
pub(crate) struct Derivatives {
    pub poses: BTreeMap<usize, Vector6<f64>>,
    pub parameters: DVector<f64>,
}

impl Derivatives {
    fn zeros(parameters: usize) -> Self {
        Self { poses: BTreeMap::new(), parameters: DVector::zeros(parameters) }
    }

    fn add(&mut self, factor: f64, other: &Self) {
        for (&station, own) in &other.poses {
            *self.poses.entry(station).or_default() += factor * own;
        }
        self.parameters.axpy(factor, &other.parameters, 1.0);
    }
}

/// What the stations saw of a block, by station.
type Block = BTreeMap<usize, OfStation>;

impl Adjusted {
    /// Factor of the variances that the errors shared by tiles ask for; at least that of single tiles. Of many stations it takes as long
    /// as a round, so it is found once, at the end; without it what is asked before rounds end is stricter.
    pub(crate) fn factor_of_wide_errors(&self) -> f64 {
        let of_tiles = self.factor_of_tiles();
        let mut largest = of_tiles;
        let one_of = (self.state.poses.len() / MANY).max(1);
        for side in SIDES {
            let (mut free, mut squares, mut counted) = (0.0, 0.0, 0);
            for (shared_plane, means) in self.shared_planes.iter().zip(&self.means) {
                for block in self.blocks(shared_plane, means, side).values() {
                    let looked_at = block.values().filter(|_| {
                        counted += 1;
                        counted % one_of == 0
                    });
                    let (of_block, square) = self.squares(looked_at, block.len(), of_tiles);
                    free += of_block;
                    squares += square;
                }
            }
            let distribution = Distribution::ChiSquared { dof: free };
            if free >= 1.0 && distribution.survival(squares / of_tiles) < LEVEL {
                largest = largest.max(squares / free);
            }
        }
        largest
    }

    /// The blocks of a shared plane, by their place.
    fn blocks(&self, shared_plane: &SharedPlane, means: &[TileMean], side: usize) -> BTreeMap<[usize; 2], Block> {
        let mut blocks: BTreeMap<[usize; 2], Block> = BTreeMap::new();
        for tile in means.chunk_by(|a, b| a.tile == b.tile) {
            let counts = |mean: &TileMean| self.scatter.weight(mean) > 0.0;
            if tile.len() > 1 && tile.iter().all(counts) {
                let place = shared_plane.tiles.place_of(tile[0].tile).map(|at| at / side);
                self.add(blocks.entry(place).or_default(), shared_plane, tile);
            }
        }
        blocks
    }

    fn add(&self, block: &mut Block, shared_plane: &SharedPlane, tile: &[TileMean]) {
        let all: f64 = tile.iter().map(|each| each.weight).sum();
        let mean = tile.iter().map(|each| each.weight * each.mean_m).sum::<f64>() / all;
        let derivatives: Vec<Derivatives> = tile.iter().map(|each| self.derivatives(shared_plane, each)).collect();
        let parameters = self.cofactors.parameters();
        let mut of_mean = Derivatives::zeros(parameters);
        for (each, own) in tile.iter().zip(&derivatives) {
            of_mean.add(each.weight / all, own);
        }
        for (each, mut own) in tile.iter().zip(derivatives) {
            let zero = || OfStation { sum: 0.0, variance: 0.0, derivatives: Derivatives::zeros(parameters) };
            let of_station = block.entry(each.station).or_insert_with(zero);
            of_station.sum += each.weight * (each.mean_m - mean);
            of_station.variance += each.weight * (1.0 - each.weight / all);
            own.add(-1.0, &of_mean);
            of_station.derivatives.add(each.weight, &own);
        }
    }

    /// Derivatives of the mean distance of a station's points in a tile.
    fn derivatives(&self, shared_plane: &SharedPlane, mean: &TileMean) -> Derivatives {
        let mut derivatives = Derivatives::zeros(self.cofactors.parameters());
        let Some(sums) = self.sums[mean.station].at(mean.slot as usize) else { return derivatives };
        let at = Vector3::from_fn(|k, _| sums.product(k, 0) / sums.weight());
        let of_pose = motion_of(shared_plane, &self.state.poses[mean.station]) * at;
        derivatives.poses.insert(mean.station, of_pose);
        for (k, derivative) in derivatives.parameters.iter_mut().enumerate() {
            *derivative = sums.product(3 + k, 0) / sums.weight();
        }
        derivatives
    }

    /// Degrees of freedom and sum of squares of some of the stations of a block: of k deviations from a mean k - 1 are free, less what the
    /// adjustment takes of each by its unknowns.
    fn squares<'b>(&self, some: impl Iterator<Item = &'b OfStation>, all: usize, of_tiles: f64) -> (f64, f64) {
        let share = (all as f64 - 1.0) / all as f64;
        let (mut free, mut squares) = (0.0, 0.0);
        for of_station in some {
            let taken = self.cofactors.variance(&of_station.derivatives);
            free += share * (1.0 - taken / (of_station.variance * of_tiles)).clamp(0.0, 1.0);
            squares += share * of_station.sum * of_station.sum / (of_station.variance * self.scatter.noise);
        }
        (free, squares)
    }
}
