//! How what the stations saw of the tiles scatters: which of it is no common surface, and what noise there is beyond
//! that of the points.

use nalgebra::DVector;
use statistics::mad_scale;

use crate::planes::elimination::{Eliminated, SharedPlaneSums, Variances};
use crate::planes::sightings::KERNEL;
use crate::planes::sums::Sums;
use crate::surfaces::patches::FEWEST_POINTS;

/// Widening of the kernel for means of tiles: what is on the surface keeps its weight.
const WIDE: f64 = 2.0;
/// Standard deviations beyond which a tile says nothing of the variances.
const CLIPPED: f64 = 4.0;

/// The mean distance of a station's points in a tile from the shared plane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TileMean {
    pub tile: usize,
    pub station: usize,
    /// Place of the tile among those of the station.
    pub slot: u32,
    pub mean_m: f64,
    /// One over its variance by the noise of the points.
    pub weight: f64,
    /// Deviation from all stations' mean in standard deviations; zero where no other station saw the tile.
    pub deviation: f64,
}

/// The means of all tiles of a shared plane, about its plane at the present poses, tile by tile.
pub(crate) fn tile_means(seen: &SharedPlaneSums<'_>, eliminated: &Eliminated) -> Vec<TileMean> {
    let plane = eliminated.plane(&DVector::zeros(eliminated.right.len()));
    let mut means: Vec<TileMean> = Vec::new();
    for of_tile in seen.seen(&eliminated.stations).chunk_by(|a, b| a.tile == b.tile) {
        let first = means.len();
        for one in of_tile {
            let (sums, weight) = (&one.sums, one.sums.weight());
            let of_plane: f64 = (0..3).map(|k| plane[k] * sums.product(k, 0)).sum();
            let mean_m = (sums.right(0) - of_plane) / weight;
            let (station, slot) = (eliminated.stations[one.of], one.slot as u32);
            means.push(TileMean { tile: one.tile, station, slot, mean_m, weight, deviation: 0.0 });
        }
        let own = &mut means[first..];
        let (mean, weight) = mean_of(own);
        for each in own {
            let variance = 1.0 / each.weight - 1.0 / weight;
            if variance > 1e-9 / each.weight {
                each.deviation = (each.mean_m - mean) / variance.sqrt();
            }
        }
    }
    means
}

fn mean_of(means: &[TileMean]) -> (f64, f64) {
    let weight: f64 = means.iter().map(|mean| mean.weight).sum();
    (means.iter().map(|mean| mean.weight * mean.mean_m).sum::<f64>() / weight, weight)
}

/// What the tiles of all shared planes say together.
#[derive(Debug, Clone, Default)]
pub(crate) struct Scatter {
    /// Robust weights of the tiles of each station, in their order.
    pub weights: Vec<Vec<f64>>,
    /// Variance of what the points of a station in a tile share, metre².
    pub shared: f64,
    /// Sum of squares between stations within tiles, and the means less the tiles.
    pub squares: f64,
    pub differences: f64,
    /// Variance of a mean with the weights of the kernel, times the sum of these weights.
    pub noise: f64,
}

impl Scatter {
    pub(crate) fn weight(&self, mean: &TileMean) -> f64 {
        self.weights[mean.station][mean.slot as usize]
    }
}

/// The scatter between stations in the same tiles.
pub(crate) fn between(means: &[Vec<TileMean>], sums: &[Sums]) -> Scatter {
    let deviations = means.iter().flatten().map(|mean| mean.deviation.abs()).filter(|deviation| *deviation > 0.0);
    let scale = mad_scale(&mut deviations.collect::<Vec<f64>>()).max(1.0);
    let noise = noise_of_means();
    let weights = sums.iter().map(|sums| vec![1.0; sums.tiles()]).collect();
    let mut scatter = Scatter { weights, noise, ..Scatter::default() };
    let mut sensitivity = 0.0;
    for mean in means.iter().flatten() {
        scatter.weights[mean.station][mean.slot as usize] = KERNEL.weight(mean.deviation / (WIDE * scale));
    }
    for own in
        means.iter().flat_map(|shared_plane| shared_plane.chunk_by(|a, b| a.tile == b.tile)).filter(|own| own.len() > 1)
    {
        if own.iter().any(|mean| mean.deviation.abs() > CLIPPED * scale) {
            continue;
        }
        let (mean, weight) = mean_of(own);
        scatter.squares += own.iter().map(|each| each.weight * (each.mean_m - mean).powi(2)).sum::<f64>() / noise;
        scatter.differences += own.len() as f64 - 1.0;
        sensitivity += own.iter().map(|each| each.weight * (1.0 - each.weight / weight)).sum::<f64>();
    }
    if sensitivity > 0.0 {
        scatter.shared = noise * ((scatter.squares - scatter.differences) / sensitivity).max(0.0);
    }
    scatter
}

/// Variance of a mean with the weights of the kernel times the sum of these weights, for normal noise: `E k²u² / E k`.
fn noise_of_means() -> f64 {
    let (mut squares, mut weights) = (0.0, 0.0);
    for step in 0..100 {
        let u = 0.05 * f64::from(step);
        let (density, weight) = ((-u * u / 2.0).exp(), KERNEL.weight(u));
        squares += density * (weight * u).powi(2);
        weights += density * weight * if step == 0 { 0.5 } else { 1.0 };
    }
    squares / weights
}

/// Variance of the surface of a tile about the plane of its shared plane, metre².
pub(crate) fn roughness(means: &[TileMean], shared: f64) -> f64 {
    let (mut squares, mut weights, mut tiles) = (0.0, 0.0, 0_usize);
    for own in means.chunk_by(|a, b| a.tile == b.tile) {
        let weight = |mean: &TileMean| mean.weight / (1.0 + shared * mean.weight);
        let sum: f64 = own.iter().map(weight).sum();
        let mean = own.iter().map(|each| weight(each) * each.mean_m).sum::<f64>() / sum;
        squares += sum * mean * mean;
        weights += sum;
        tiles += 1;
    }
    if tiles < FEWEST_POINTS { 0.0 } else { ((squares - (tiles as f64 - 3.0)) / weights).max(0.0) }
}

/// Variances of a shared plane.
pub(crate) fn variances(means: &[TileMean], shared: f64) -> Variances {
    Variances { surface: roughness(means, shared), shared }
}
