//! Errors that tiles share: what a camera does wrong over a whole wall is no independent error of each tile on it.
//!
//! Differences between stations, summed over blocks of tiles, grow as the root of the number of tiles where these are
//! independent, and faster where they share something. The widest blocks are whole shared planes.

use std::collections::BTreeMap;

use statistics::Distribution;

use crate::planes::scatter::{Scatter, TileMean};
use crate::planes::shared_planes::SharedPlane;

/// Sides of blocks, tiles; the last holds every shared plane.
const SIDES: [usize; 4] = [2, 4, 8, usize::MAX];
/// Probability at which independent tiles pass for ones that share errors, at each size of blocks.
const LEVEL: f64 = 1e-3;

/// Sums of what the stations saw of the tiles of a block off their mean.
#[derive(Default)]
struct Block {
    /// By station: the weighted sum, and its variance if tiles are independent.
    of_station: BTreeMap<usize, (f64, f64)>,
}

impl Block {
    fn add(&mut self, tile: &[TileMean]) {
        let all: f64 = tile.iter().map(|each| each.weight).sum();
        let mean = tile.iter().map(|each| each.weight * each.mean_m).sum::<f64>() / all;
        for each in tile {
            let sum = self.of_station.entry(each.station).or_default();
            sum.0 += each.weight * (each.mean_m - mean);
            sum.1 += each.weight * (1.0 - each.weight / all);
        }
    }

    /// Degrees of freedom and sum of squares.
    fn squares(&self) -> (f64, f64) {
        let stations = self.of_station.len() as f64;
        let sum: f64 = self.of_station.values().map(|(sum, variance)| sum * sum / variance).sum();
        // Of k deviations from a mean, k - 1 are free.
        (stations - 1.0, sum * (stations - 1.0) / stations)
    }
}

/// Factor of the variances that the errors shared by tiles ask for, `unknowns` having been fitted; at least that of single
/// tiles, `of_tiles`.
pub fn factor(
    shared_planes: &[SharedPlane],
    means: &[Vec<TileMean>],
    scatter: &Scatter,
    stations: usize,
    unknowns: f64,
    of_tiles: f64,
) -> f64 {
    let mut largest = of_tiles;
    for side in SIDES {
        let (mut free, mut squares) = (-unknowns, 0.0);
        for (shared_plane, means) in shared_planes.iter().zip(means) {
            let mut blocks: BTreeMap<[usize; 2], Block> = BTreeMap::new();
            for tile in means.chunk_by(|a, b| a.tile == b.tile) {
                let counts = |mean: &TileMean| scatter.weights[mean.tile * stations + mean.station] > 0.0;
                if tile.len() > 1 && tile.iter().all(counts) {
                    let place = shared_plane.tiles.place_of(tile[0].tile).map(|at| at / side);
                    blocks.entry(place).or_default().add(tile);
                }
            }
            for block in blocks.values() {
                let (of_block, square) = block.squares();
                free += of_block;
                squares += square / scatter.noise;
            }
        }
        let distribution = Distribution::ChiSquared { dof: free };
        if free >= 1.0 && distribution.survival(squares / of_tiles) < LEVEL {
            largest = largest.max(squares / free);
        }
    }
    largest
}
