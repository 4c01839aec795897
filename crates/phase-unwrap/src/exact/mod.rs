//! Unwrapping by the cheapest set of cuts: a minimum-cost flow between residues `[Costantini1998]`.

mod flow;
mod integrate;
mod network;
mod regions;

use range_image::Raster;

use crate::tree::cycle::{count_from_given, into_cycle};
use crate::tree::grid::Grid;
use crate::{Error, Result};
use flow::Flow;
use integrate::Integration;
use network::Network;
use regions::Regions;

/// How cuts are priced and how much work is allowed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExactOptions {
    /// Price of an edge between neighbours before the weights are applied. Default: [`CutPrice::Smoothness`].
    pub price: CutPrice,
    /// More residues than this are refused, so that the work is bounded: time grows with their number and with the
    /// distances between them. Default: 100 000.
    pub maximum_residues: usize,
}

impl Default for ExactOptions {
    fn default() -> Self {
        Self { price: CutPrice::default(), maximum_residues: 100_000 }
    }
}

/// What it costs to add a cycle to the step between two neighbours.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum CutPrice {
    /// The same everywhere: the cuts are as short as they can be.
    Uniform,
    /// Cheap where the phase is not smooth along the step, and where the step comes near half a cycle.
    #[default]
    Smoothness,
}

/// Wrap counts of the cheapest cuts.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ExactUnwrapped {
    /// Whole cycles to add to the phase; relative, the lowest of each island is 0; 0 where masked.
    pub wraps: Raster<i32>,
    /// Island of each pixel: 0 where masked, else from 1 in scan order. Counts of different islands are free of each
    /// other.
    pub island: Raster<u32>,
    /// Number of islands.
    pub islands: usize,
    /// Loops of four pixels, and holes, around which the smaller steps do not close.
    pub residues: usize,
    /// Sum over all edges of price times the cycles added to the smaller step.
    pub cost: u64,
    /// The bound from the dual problem: no other counts are cheaper than this. It equals `cost`, which proves the
    /// optimum; a result for which it does not is an error.
    pub lower_bound: u64,
}

/// Unwraps one image; see [`LeastCuts::unwrap_into`]. Allocates its buffers anew.
pub fn unwrap_least_cuts(
    phase: &Raster<f32>,
    weights: Option<&Raster<f32>>,
    mask: Option<&Raster<bool>>,
    options: &ExactOptions,
) -> Result<ExactUnwrapped> {
    let mut out = ExactUnwrapped::default();
    LeastCuts::new(*options).unwrap_into(phase, weights, mask, &mut out)?;
    Ok(out)
}

/// Unwraps images one after the other and keeps its buffers.
#[derive(Debug, Default)]
pub struct LeastCuts {
    options: ExactOptions,
    phase: Vec<f32>,
    network: Network,
    regions: Regions,
    flow: Flow,
    integration: Integration,
}

impl LeastCuts {
    /// With the given prices and limit.
    pub fn new(options: ExactOptions) -> Self {
        Self { options, ..Self::default() }
    }

    /// Wrap counts of `phase`, in radians of any cycle as in [`Unwrapper::unwrap`](crate::Unwrapper::unwrap); what is not
    /// finite is masked. In `mask`, true means use.
    ///
    /// Between neighbours the smaller step is assumed. Where such steps do not close around a loop (a residue), cycles
    /// are added to some of them so that all loops close, at the smallest sum of prices. Prices are whole numbers from 1
    /// to 100; `weights` (not negative, larger where the phase is better, such as `1 / sigma^2`) scale them by the
    /// smaller of the two pixels over the 95 % quantile of all, and what is not finite counts as 0. Cuts end at the
    /// image's border and at masked pixels free of charge; a masked hole is one large loop that must close as a whole.
    /// Equal optima are chosen by position, so results depend on the input alone.
    ///
    /// The cycles come from shortest paths between residues, one after the other, on the edges near them only. Fails
    /// with [`Error::TooManyResidues`] beyond the limit of the options. After an error `out` holds nothing of use.
    pub fn unwrap_into(
        &mut self,
        phase: &Raster<f32>,
        weights: Option<&Raster<f32>>,
        mask: Option<&Raster<bool>>,
        out: &mut ExactUnwrapped,
    ) -> Result<()> {
        if let Some(weights) = weights {
            phase.require_same_size(weights, "weights")?;
        }
        let (grid, residues) = self.start(phase, mask)?;
        let limit = self.options.maximum_residues;
        if residues > limit {
            return Err(Error::TooManyResidues { residues, limit });
        }
        if residues > 0 {
            self.network.set_prices(&grid, self.options.price, weights);
            self.flow.solve(&grid, &self.phase, &mut self.network, &self.regions);
        }
        let (cost, lower_bound) = self.flow.certificate(&grid, &self.network, &self.regions);
        if lower_bound != Some(cost) {
            return Err(Error::NotOptimal { cost, lower_bound: lower_bound.unwrap_or(0) });
        }
        (out.residues, out.cost, out.lower_bound) = (residues, cost, cost);
        self.integration.run(&grid, &self.phase, &self.network, out);
        let island = out.island.as_slice();
        count_from_given(phase, |index| island[index] > 0, &mut out.wraps);
        Ok(())
    }

    /// Loops and holes of `phase` around which the smaller steps do not close.
    pub(crate) fn residues(&mut self, phase: &Raster<f32>) -> Result<usize> {
        Ok(self.start(phase, None)?.1)
    }

    fn start(&mut self, phase: &Raster<f32>, mask: Option<&Raster<bool>>) -> Result<(Grid, usize)> {
        let grid = Grid::new(phase.width(), phase.height())?;
        load_phase(&grid, phase, mask, &mut self.phase)?;
        self.network.build(&grid, &self.phase);
        self.regions.find(&grid, &self.network);
        let residues = self.flow.start(&grid, &self.network, &self.regions);
        Ok((grid, residues))
    }
}

fn load_phase(grid: &Grid, phase: &Raster<f32>, mask: Option<&Raster<bool>>, padded: &mut Vec<f32>) -> Result<()> {
    if let Some(mask) = mask {
        phase.require_same_size(mask, "mask")?;
    }
    grid.pad(&into_cycle(phase), f32::NAN, padded);
    let mut used = 0_usize;
    for (row, start) in grid.row_starts().enumerate() {
        let masked = mask.map(|mask| &mask.as_slice()[row * grid.width..][..grid.width]);
        for (col, value) in padded[start..start + grid.width].iter_mut().enumerate() {
            if !value.is_finite() || masked.is_some_and(|mask| !mask[col]) {
                *value = f32::NAN;
            } else {
                used += 1;
            }
        }
    }
    if used == 0 { Err(Error::AllMasked { pixels: phase.len() }) } else { Ok(()) }
}
