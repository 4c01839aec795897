//! A second, cautious account of what tiles share, for networks in which products of differences tell too little: of two
//! stations that see a floor and a wall, whole walls may be off and no product of tiles stands out of its scatter.
//!
//! Differences between stations, summed over blocks of tiles, grow as the root of the number of tiles where these are
//! independent, and faster where they share something. The widest blocks are whole facets. By how much the squares of these
//! sums are too large is a factor of all variances. It tells neither where nor how far the errors reach; so it weighs
//! nothing, and only keeps the covariance from being less.

use std::collections::BTreeMap;

use adjust::Distribution;
use nalgebra::{DMatrix, SymmetricEigen};

use super::facets::Facet;
use super::scatter::{Scatter, TileMean, roughness};
use crate::error::{Error, Result};

/// Sides of blocks, tiles; the last holds every facet.
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

/// Tiles of a facet that tell of variances: seen by two stations or more, and none of them off.
fn telling(means: &[TileMean]) -> impl Iterator<Item = &[TileMean]> {
    means.chunk_by(|a, b| a.tile == b.tile).filter(|tile| tile.len() > 1 && tile.iter().all(|mean| mean.counts))
}

/// What tiles scatter beyond noise as if it were one variance in all of them, and the factor by which blocks exceed that.
#[derive(Debug, Clone, Default)]
pub(super) struct WideErrors {
    /// The variance that the points of each station in each tile share, tile by tile, metre².
    pub shared: Vec<f64>,
    /// Variance of the surface of a tile about the plane of each facet, metre².
    pub roughness: Vec<f64>,
    /// Factor of the variances.
    pub factor: f64,
}

impl WideErrors {
    /// `unknowns` have been fitted.
    pub(super) fn new(facets: &[Facet], means: &[Vec<TileMean>], scatter: &Scatter, unknowns: f64) -> Self {
        let mut sensitivity = 0.0;
        for tile in means.iter().flat_map(|means| telling(means)) {
            let all: f64 = tile.iter().map(|each| each.weight).sum();
            sensitivity += tile.iter().map(|each| each.weight * (1.0 - each.weight / all)).sum::<f64>();
        }
        let beyond = (scatter.squares - scatter.differences).max(0.0);
        let shared = if sensitivity > 0.0 { scatter.noise * beyond / sensitivity } else { 0.0 };
        let free = scatter.differences - unknowns;
        let of_tiles = if free > 0.0 { (scatter.squares / free).max(1.0) } else { 1.0 };
        Self {
            shared: vec![shared; scatter.shared.len()],
            roughness: means.iter().map(|means| roughness(means, |_| shared)).collect(),
            factor: factor(facets, means, scatter.noise, unknowns, of_tiles),
        }
    }

    /// The least change of a covariance that makes it, along every direction, at least these cofactors times the factor.
    pub(super) fn at_least(&self, covariance: DMatrix<f64>, cofactors: &DMatrix<f64>) -> Result<DMatrix<f64>> {
        // Unknowns that are held have no variance; all others count in units of their own.
        let free: Vec<usize> = (0..covariance.nrows()).filter(|&k| covariance[(k, k)] > 0.0).collect();
        if free.is_empty() {
            return Ok(covariance);
        }
        let unit: Vec<f64> = free.iter().map(|&k| covariance[(k, k)].sqrt()).collect();
        let lacking = DMatrix::from_fn(free.len(), free.len(), |row, column| {
            let of = |r: usize, c: usize| self.factor * cofactors[(r, c)] - covariance[(r, c)];
            let (r, c) = (free[row], free[column]);
            0.5 * (of(r, c) + of(c, r)) / (unit[row] * unit[column])
        });
        let failed = |why| Error::Numerical { what: "the covariance of all stations", why };
        if lacking.iter().any(|value| !value.is_finite()) {
            return Err(failed("it is not finite"));
        }
        let eigen = SymmetricEigen::try_new(lacking, 1e-12, 10_000).ok_or(failed("no eigenvalues were found"))?;
        let mut covariance = covariance;
        for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            if *value > 0.0 {
                for (row, &r) in free.iter().enumerate() {
                    for (column, &c) in free.iter().enumerate() {
                        covariance[(r, c)] += value * vector[row] * vector[column] * unit[row] * unit[column];
                    }
                }
            }
        }
        Ok(covariance)
    }
}

/// Factor of the variances that the errors shared by tiles ask for; at least that of single tiles, `of_tiles`.
fn factor(facets: &[Facet], means: &[Vec<TileMean>], noise: f64, unknowns: f64, of_tiles: f64) -> f64 {
    let mut largest = of_tiles;
    for side in SIDES {
        let (mut free, mut squares) = (-unknowns, 0.0);
        for (facet, means) in facets.iter().zip(means) {
            let mut blocks: BTreeMap<[usize; 2], Block> = BTreeMap::new();
            for tile in telling(means) {
                let place = facet.tiles.place_of(tile[0].tile).map(|at| at / side);
                blocks.entry(place).or_default().add(tile);
            }
            for block in blocks.values() {
                let (of_block, square) = block.squares();
                free += of_block;
                squares += square / noise;
            }
        }
        let distribution = Distribution::ChiSquared { dof: free };
        if free >= 1.0 && distribution.survival(squares / of_tiles) < LEVEL {
            largest = largest.max(squares / free);
        }
    }
    largest
}
