//! A pixel's ranges that its phases allow, for those who choose among them by knowledge of their own.

use range_image::{Modulation, Raster, with_wide_registers};
use rayon::prelude::*;

use crate::frequencies::frame::Planes;
use crate::frequencies::lanes::LANES;
use crate::frequencies::lattice::Lattice;
use crate::tree::cycle::all_into_cycle;
use crate::{Error, MultiFrequencyOptions, Result};

/// Largest number of hypotheses kept of each pixel.
const MAXIMUM_RANKS: usize = 8;
/// Pixels that one thread takes at a time: a multiple of the block.
const CHUNK: usize = 256 * LANES;

/// The hypotheses of all pixels, best first.
#[derive(Debug, Clone, PartialEq)]
pub struct Hypotheses {
    /// One for each rank.
    pub ranks: Vec<RankedHypotheses>,
}

/// The hypotheses of one rank.
#[derive(Debug, Clone, PartialEq)]
pub struct RankedHypotheses {
    /// Inverse-variance mean of the ranges in metres; NaN where there is no such hypothesis.
    pub range: Raster<f32>,
    /// Sum of squared residuals over their variances, one degree of freedom less than frequencies; infinite where there
    /// is no such hypothesis.
    pub misfit: Raster<f32>,
    /// Probability among the pixel's eight best hypotheses, each as likely beforehand.
    pub probability: Raster<f32>,
}

/// One hypothesis of one pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hypothesis {
    /// Range in metres.
    pub range_m: f32,
    /// Sum of squared residuals over their variances.
    pub misfit: f32,
    /// Probability from 0 to 1.
    pub probability: f32,
}

impl Hypotheses {
    /// The hypotheses of a pixel, best first; none outside the image and where fewer than two phases are usable.
    pub fn pixel(&self, col: usize, row: usize) -> impl Iterator<Item = Hypothesis> + '_ {
        self.ranks.iter().map_while(move |rank| {
            let range_m = *rank.range.get(col, row)?;
            let found = Hypothesis {
                range_m,
                misfit: *rank.misfit.get(col, row)?,
                probability: *rank.probability.get(col, row)?,
            };
            range_m.is_finite().then_some(found)
        })
    }
}

/// The `count` best hypotheses of each pixel, up to eight; arguments as for
/// [`unwrap_multi_frequency`](crate::unwrap_multi_frequency). Neighbours take no part.
///
/// They are sorted by their misfits; those whose misfits agree to a part in a thousand, by range.
pub fn hypotheses(
    phases: &[Raster<f32>],
    modulations: &[Modulation],
    sigma_phase: Option<&[Raster<f32>]>,
    mask: Option<&Raster<bool>>,
    count: usize,
    options: &MultiFrequencyOptions,
) -> Result<Hypotheses> {
    if !(1..=MAXIMUM_RANKS).contains(&count) {
        let expected = "1 to 8 hypotheses a pixel";
        return Err(Error::OutOfDomain { name: "count", value: count as f64, expected });
    }
    let lattice = Lattice::new(modulations, options)?;
    let phases = all_into_cycle(phases);
    let planes = Planes::new(&phases, modulations.len(), sigma_phase, mask)?;
    let (width, height) = planes.size;
    let blocks: Vec<_> = (0..(width * height).div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| search_chunk(&lattice, &planes, chunk * CHUNK, CHUNK.min(width * height - chunk * CHUNK), count))
        .collect();
    let plane = |rank: usize, quantity: usize| {
        let values = blocks.iter().flat_map(|block| block[3 * rank + quantity].iter().copied()).collect();
        Raster::from_vec(width, height, values)
    };
    let ranks = (0..count).map(|rank| {
        Ok(RankedHypotheses { range: plane(rank, 0)?, misfit: plane(rank, 1)?, probability: plane(rank, 2)? })
    });
    Ok(Hypotheses { ranks: ranks.collect::<Result<_>>()? })
}

/// Range, misfit and probability of each rank in turn, for a run of pixels.
fn search_chunk(lattice: &Lattice, planes: &Planes<'_>, first: usize, length: usize, count: usize) -> Vec<Vec<f32>> {
    let mut lines = vec![Vec::with_capacity(length); 3 * count];
    with_wide_registers(
        #[inline(always)]
        || {
            for start in (0..length).step_by(LANES) {
                let size = LANES.min(length - start);
                let found = lattice.search::<MAXIMUM_RANKS>(planes, first + start, size, true);
                for (rank, lines) in lines.chunks_exact_mut(3).enumerate() {
                    let quantities = [&found.range_m[rank], &found.misfit[rank], &found.probability[rank]];
                    for (line, lanes) in lines.iter_mut().zip(quantities) {
                        line.extend_from_slice(&lanes[..size]);
                    }
                }
            }
        },
    );
    lines
}
