//! How what the stations saw of the tiles scatters: which of it is no common surface, and what noise there is beyond
//! that of the points.

use nalgebra::{DVector, Isometry3};

use super::elimination::{Eliminated, FacetSums};
use super::shared_errors::{SharedErrors, bearing};
use crate::kernel::{RobustKernel, mad_scale};

/// Widening of the kernel for means of tiles: what is on the surface keeps its weight.
const WIDE: f64 = 2.0;
/// Standard deviations beyond which a tile says nothing of the variances.
const CLIPPED: f64 = 4.0;
/// Times that the variances are estimated, each with weights by those before: a fourth changes them by less than a hundredth.
const PASSES: usize = 3;
/// Fewest tiles that show how plane a facet is.
const FEWEST_TILES: usize = 6;

/// The mean distance of a station's points in a tile from the facet.
#[derive(Debug, Clone, Copy)]
pub(super) struct TileMean {
    pub facet: u32,
    pub tile: usize,
    pub station: usize,
    pub mean_m: f64,
    /// One over its variance by the noise of the points.
    pub weight: f64,
    /// Variance of one of its points across the facet, metre².
    pub point_variance: f64,
    /// Where the station saw the tile.
    pub bearing: [u32; 3],
    /// Deviation from all stations' mean in standard deviations; zero where no other station saw the tile.
    pub deviation: f64,
    /// Whether the deviation is small enough to say something of the variances.
    pub counts: bool,
}

/// The means of all tiles of a facet, about its plane at the present poses, tile by tile.
pub(super) fn tile_means(
    seen: &FacetSums<'_>,
    eliminated: &Eliminated,
    (facet, poses): (u32, &[Isometry3<f64>]),
) -> Vec<TileMean> {
    let plane = eliminated.plane(&DVector::zeros(eliminated.right.len()));
    let mut means: Vec<TileMean> = Vec::new();
    for tile in seen.tiles() {
        for &station in &eliminated.stations {
            let Some(sums) = seen.sums[station].of(tile) else { continue };
            let weight = sums.weight();
            let of_plane: f64 = (0..3).map(|k| plane[k] * sums.product(k, 0)).sum();
            let mean_m = (sums.right(0) - of_plane) / weight;
            let place = seen.facet.at([1, 2].map(|k| sums.product(k, 0) / weight));
            let direction = poses[station].inverse_transform_point(&place.into());
            means.push(TileMean {
                facet,
                tile,
                station,
                mean_m,
                weight,
                point_variance: sums.count() / weight,
                bearing: bearing(direction.coords.into()),
                deviation: 0.0,
                counts: true,
            });
        }
    }
    means
}

/// What the tiles of all facets say together.
#[derive(Debug, Clone, Default)]
pub(super) struct Scatter {
    /// Robust weight of each tile and station, tile by tile.
    pub weights: Vec<f64>,
    /// Errors that neighbouring places of a station share.
    pub errors: SharedErrors,
    /// Variance of a mean with the weights of the kernel, times the sum of these weights.
    pub noise: f64,
    /// The variance by them of what each station saw of each tile, tile by tile, metre².
    pub shared: Vec<f64>,
    /// Sum of squares between stations within tiles, and the means less the tiles.
    pub squares: f64,
    pub differences: f64,
}

impl Scatter {
    /// Variance of what a station saw of a tile by itself, metre².
    pub(super) fn variance(&self, mean: &TileMean) -> f64 {
        self.noise / mean.weight + self.errors.total() * mean.point_variance
    }
}

/// The scatter between stations in the same tiles, `unknowns` having been fitted; shared errors are about those of `known`.
pub(super) fn between(
    means: &mut [Vec<TileMean>],
    (stations, tiles): (usize, usize),
    kernel: RobustKernel,
    known: &SharedErrors,
    unknowns: f64,
) -> Scatter {
    let mut errors = known.clone();
    let mut noise = 1.0;
    for _ in 0..PASSES {
        noise = noise_of_means(kernel, &errors);
        deviations(means, &errors, noise);
        errors = SharedErrors::estimated(means, &errors, noise, unknowns);
    }
    let scale = deviations(means, &errors, noise);
    let mut scatter =
        Scatter { weights: vec![1.0; tiles * stations], shared: vec![0.0; tiles * stations], ..Scatter::default() };
    for mean in means.iter().flatten() {
        scatter.weights[mean.tile * stations + mean.station] = kernel.weight(mean.deviation / (WIDE * scale));
    }
    errors.variances(means, noise, |mean, variance| scatter.shared[mean.tile * stations + mean.station] = variance);
    for own in means.iter().flat_map(|facet| facet.chunk_by(|a, b| a.tile == b.tile)).filter(|own| own.len() > 1) {
        if own.iter().all(|mean| mean.counts) {
            let (mean, _) = mean_of(own, |each| each.weight);
            scatter.squares += own.iter().map(|each| each.weight * (each.mean_m - mean).powi(2)).sum::<f64>() / noise;
            scatter.differences += own.len() as f64 - 1.0;
        }
    }
    Scatter { errors, noise, ..scatter }
}

/// Deviations of what each station saw from the mean of all, by noise and shared errors; their scale, at least one.
fn deviations(means: &mut [Vec<TileMean>], errors: &SharedErrors, noise: f64) -> f64 {
    let shared = errors.total();
    let weight = |mean: &TileMean| 1.0 / (noise / mean.weight + shared * mean.point_variance);
    for own in means.iter_mut().flat_map(|facet| facet.chunk_by_mut(|a, b| a.tile == b.tile)) {
        let (mean, all) = mean_of(own, weight);
        for each in own {
            let variance = 1.0 / weight(each) - 1.0 / all;
            let is_told = variance > 1e-9 / weight(each);
            each.deviation = if is_told { (each.mean_m - mean) / variance.sqrt() } else { 0.0 };
        }
    }
    let told = means.iter().flatten().map(|mean| mean.deviation.abs()).filter(|deviation| *deviation > 0.0);
    let scale = mad_scale(&mut told.collect::<Vec<f64>>()).max(1.0);
    means.iter_mut().flatten().for_each(|mean| mean.counts = mean.deviation.abs() <= CLIPPED * scale);
    scale
}

fn mean_of(means: &[TileMean], weight: impl Fn(&TileMean) -> f64) -> (f64, f64) {
    let all: f64 = means.iter().map(&weight).sum();
    (means.iter().map(|mean| weight(mean) * mean.mean_m).sum::<f64>() / all, all)
}

/// Variance of a mean with the weights of a kernel times the sum of these weights, for normal noise: `E k²u² / E k`. The
/// kernel is as wide as noise and shared errors together.
fn noise_of_means(kernel: RobustKernel, errors: &SharedErrors) -> f64 {
    let wide = (1.0 + errors.total()).sqrt();
    let (mut squares, mut weights) = (0.0, 0.0);
    for step in 0..100 {
        let u = 0.05 * f64::from(step);
        let (density, weight) = ((-u * u / 2.0).exp(), kernel.weight(u / wide));
        squares += density * (weight * u).powi(2);
        weights += density * weight * if step == 0 { 0.5 } else { 1.0 };
    }
    squares / weights
}

/// Variance of the surface of a tile about the plane of its facet, metre²; `shared`: the variance of each mean beyond noise.
pub(super) fn roughness(means: &[TileMean], shared: impl Fn(&TileMean) -> f64) -> f64 {
    let (mut squares, mut weights, mut tiles) = (0.0, 0.0, 0_usize);
    for own in means.chunk_by(|a, b| a.tile == b.tile) {
        let (mean, sum) = mean_of(own, |each| each.weight / (1.0 + shared(each) * each.weight));
        squares += sum * mean * mean;
        weights += sum;
        tiles += 1;
    }
    if tiles < FEWEST_TILES { 0.0 } else { ((squares - (tiles as f64 - 3.0)) / weights).max(0.0) }
}
