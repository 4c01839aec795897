//! Filter, unwrap, and back to the measured phases in one call.

use std::f32::consts::{PI, TAU};

use range_image::Raster;

use crate::exact::{ExactOptions, ExactUnwrapped, LeastCuts};
use crate::filter::congruent::congruent_into;
use crate::filter::noise::{LARGEST_SIGMA_RAD, PhaseNoise};
use crate::filter::prefilter::{FilterVerdict, Filtered, Prefilter, PrefilterOptions};
use crate::image::bends::bends;
use crate::tree::cycle::{count_from_given, into_cycle};
use crate::{Error, KnownWraps, Result, SpatialOptions, Unwrapped, Unwrapper};

/// How noisy phases are unwrapped.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct NoisyOptions {
    /// The filter. Default: that of [`PrefilterOptions`].
    pub prefilter: PrefilterOptions,
    /// The spanning tree, which is always grown: it tells islands and confidence. Default: that of [`SpatialOptions`].
    pub spatial: SpatialOptions,
    /// The cheapest cuts, where they are asked for. Default: that of [`ExactOptions`].
    pub cuts: ExactOptions,
    /// What the counts come from. Default: [`NoisyMethod::Filter`].
    pub method: NoisyMethod,
}

/// What the counts of a noisy image come from.
///
/// Where there are more residues than [`ExactOptions::maximum_residues`] the tree stands in for the cuts, and
/// [`NoisyUnwrapped::method`] says so.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum NoisyMethod {
    /// The spanning tree over the phase as it was measured: for noise below 0.5 rad.
    Tree,
    /// The spanning tree over the filtered phase.
    #[default]
    Filter,
    /// The cheapest cuts of the phase as it was measured: for noise on surfaces that bend too much for a filter.
    Cuts,
    /// The cheapest cuts of the filtered phase, weighted by its inverse variance where that is known: a little better
    /// than the tree over it, at half as much time again.
    FilteredCuts,
    /// One of the others, chosen by the image. Where the filtered phase has no residues, all paths over it give the same
    /// counts: the filter's (the tree's, where nothing was filtered). Otherwise the cheapest cuts are tried too, and where
    /// the filter says that it cannot follow the image, both without it. The counts whose surface bends least are
    /// taken: second differences between means of 2 by 2 pixels, squared, at most half a cycle each.
    Auto,
}

/// Wrap counts of a noisy image.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NoisyUnwrapped {
    /// Counts of the measured phase, relative: the lowest of each island is 0. The confidence is that of the filtered
    /// phase's place in the tree, times `2p - 1` for the odds of the count against the next one by the noise.
    pub unwrapped: Unwrapped,
    /// The filtered phase that was unwrapped, and whether the filter could follow it; the measured phase where the
    /// method does without.
    pub filtered: Filtered,
    /// What the counts came from; never [`NoisyMethod::Auto`].
    pub method: NoisyMethod,
}

/// Unwraps one noisy image; see [`NoisyUnwrapper::unwrap_into`]. Allocates its buffers anew.
pub fn unwrap_noisy(
    phase: &Raster<f32>,
    noise: PhaseNoise<'_>,
    mask: Option<&Raster<bool>>,
    options: &NoisyOptions,
) -> Result<NoisyUnwrapped> {
    let mut out = NoisyUnwrapped::default();
    NoisyUnwrapper::new(*options)?.unwrap_into(phase, noise, mask, &mut out)?;
    Ok(out)
}

/// Unwraps noisy images one after the other and keeps its buffers.
#[derive(Debug, Default)]
pub struct NoisyUnwrapper {
    options: NoisyOptions,
    filter: Prefilter,
    no_filter: Prefilter,
    tree: Unwrapper,
    cuts: LeastCuts,
    exact: ExactUnwrapped,
    weights: Raster<f32>,
    lowest: Vec<i32>,
    /// The candidate that is compared with the best so far.
    candidate: NoisyUnwrapped,
}

impl NoisyUnwrapper {
    /// Fails where an option lies outside its domain.
    pub fn new(options: NoisyOptions) -> Result<Self> {
        let filter = Prefilter::new(options.prefilter)?;
        let no_filter = Prefilter::new(PrefilterOptions { largest_radius_px: 0, ..options.prefilter })?;
        let (tree, cuts) = (Unwrapper::new(options.spatial)?, LeastCuts::new(options.cuts));
        Ok(Self { options, filter, no_filter, tree, cuts, ..Self::default() })
    }

    /// Wrap counts of `phase`, in radians of any cycle as in [`Unwrapper::unwrap`]; what is not finite is masked. In `mask`,
    /// true means use.
    ///
    /// The phase is filtered as [`Prefilter::filter_into`] does, unwrapped by the method of the options, and its counts are
    /// carried back to the measured phase as [`congruent`](crate::congruent) does. After an error `out` holds nothing
    /// of use.
    pub fn unwrap_into(
        &mut self,
        phase: &Raster<f32>,
        noise: PhaseNoise<'_>,
        mask: Option<&Raster<bool>>,
        out: &mut NoisyUnwrapped,
    ) -> Result<()> {
        let given = phase;
        let phase = into_cycle(given);
        let phase = phase.as_ref();
        match self.options.method {
            NoisyMethod::Tree => self.grow(NoisyMethod::Tree, phase, noise, mask, out)?,
            NoisyMethod::Filter => self.grow(NoisyMethod::Filter, phase, noise, mask, out)?,
            NoisyMethod::Cuts => {
                self.grow(NoisyMethod::Tree, phase, noise, mask, out)?;
                self.cut(phase, out)?;
            }
            NoisyMethod::FilteredCuts => {
                self.grow(NoisyMethod::Filter, phase, noise, mask, out)?;
                self.cut(phase, out)?;
            }
            NoisyMethod::Auto => self.choose(phase, noise, mask, out)?,
        }
        let NoisyUnwrapped { unwrapped, filtered, .. } = out;
        self.start_islands_at_zero(unwrapped);
        doubt(phase, filtered, noise, unwrapped);
        for island in &mut unwrapped.islands {
            (island.pixels, island.sure_pixels) = (0, 0);
        }
        unwrapped.count_pixels(self.options.spatial.minimum_confidence);
        let island = unwrapped.island.as_slice();
        count_from_given(given, |index| island[index] > 0, &mut unwrapped.wraps);
        Ok(())
    }

    /// Counts of the measured phase by the tree, over the filtered phase or over the phase as it is.
    fn grow(
        &mut self,
        method: NoisyMethod,
        phase: &Raster<f32>,
        noise: PhaseNoise<'_>,
        mask: Option<&Raster<bool>>,
        out: &mut NoisyUnwrapped,
    ) -> Result<()> {
        let filter = if method == NoisyMethod::Filter { &mut self.filter } else { &mut self.no_filter };
        filter.filter_into(phase, noise, mask, &mut out.filtered)?;
        self.tree.unwrap_into(&out.filtered.phase, None, None, KnownWraps::Nothing, &mut out.unwrapped)?;
        out.method = method;
        congruent_into(phase, &out.filtered.phase, &mut out.unwrapped.wraps)
    }

    /// Replaces the tree's counts by those of the cheapest cuts, where these are allowed.
    fn cut(&mut self, phase: &Raster<f32>, out: &mut NoisyUnwrapped) -> Result<()> {
        let NoisyUnwrapped { unwrapped, filtered, method } = out;
        self.weights.clone_from(&filtered.sigma);
        let mut known = false;
        for weight in self.weights.as_mut_slice() {
            known |= *weight > 0.0;
            *weight = 1.0 / (*weight * *weight);
        }
        let weights = if known { Some(&self.weights) } else { None };
        match self.cuts.unwrap_into(&filtered.phase, weights, None, &mut self.exact) {
            Ok(()) => {
                unwrapped.wraps.clone_from(&self.exact.wraps);
                *method = if *method == NoisyMethod::Filter { NoisyMethod::FilteredCuts } else { NoisyMethod::Cuts };
                congruent_into(phase, &filtered.phase, &mut unwrapped.wraps)
            }
            Err(Error::TooManyResidues { .. }) => Ok(()),
            Err(error) => Err(error),
        }
    }

    /// Tries what the image asks for, and takes what bends least; see [`NoisyMethod::Auto`].
    fn choose(
        &mut self,
        phase: &Raster<f32>,
        noise: PhaseNoise<'_>,
        mask: Option<&Raster<bool>>,
        out: &mut NoisyUnwrapped,
    ) -> Result<()> {
        self.grow(NoisyMethod::Filter, phase, noise, mask, out)?;
        let verdict = out.filtered.verdict;
        if verdict == FilterVerdict::NotNeeded {
            out.method = NoisyMethod::Tree;
        }
        if self.cuts.residues(&out.filtered.phase)? == 0 {
            return Ok(());
        }
        let mut least = bends(phase, &out.unwrapped.wraps);
        let mut candidate = std::mem::take(&mut self.candidate);
        candidate.clone_from(out);
        self.cut(phase, &mut candidate)?;
        take_better(phase, &mut candidate, &mut least, out);
        if let FilterVerdict::NotFollowed { .. } = verdict {
            self.grow(NoisyMethod::Tree, phase, noise, mask, &mut candidate)?;
            let tree = candidate.clone();
            take_better(phase, &mut candidate, &mut least, out);
            candidate = tree;
            self.cut(phase, &mut candidate)?;
            take_better(phase, &mut candidate, &mut least, out);
            out.filtered.verdict = verdict;
        }
        self.candidate = candidate;
        Ok(())
    }

    /// Counts of noise may lie below those of the filtered surface.
    fn start_islands_at_zero(&mut self, unwrapped: &mut Unwrapped) {
        self.lowest.clear();
        self.lowest.resize(unwrapped.islands.len() + 1, i32::MAX);
        let islands = unwrapped.island.as_slice();
        for (&island, wraps) in islands.iter().zip(unwrapped.wraps.as_slice()) {
            let lowest = &mut self.lowest[island as usize];
            *lowest = wraps.min(lowest).to_owned();
        }
        self.lowest[0] = 0;
        for (&island, wraps) in islands.iter().zip(unwrapped.wraps.as_mut_slice()) {
            *wraps -= self.lowest[island as usize];
        }
    }
}

/// Exchanges the candidate and the best so far where the candidate's surface bends less.
fn take_better(phase: &Raster<f32>, candidate: &mut NoisyUnwrapped, least: &mut f64, best: &mut NoisyUnwrapped) {
    let bent = bends(phase, &candidate.unwrapped.wraps);
    if bent < *least {
        *least = bent;
        std::mem::swap(candidate, best);
    }
}

/// Lowers the confidence of pixels that lie far from the filtered surface: with a distance d and a normal
/// distribution, the odds against the next count give `2p - 1 = tanh(pi (pi - |d|) / sigma^2)`.
fn doubt(phase: &Raster<f32>, filtered: &Filtered, noise: PhaseNoise<'_>, unwrapped: &mut Unwrapped) {
    let sigma = |index: usize| match noise {
        PhaseNoise::Sigma(sigma) => sigma.as_slice()[index],
        PhaseNoise::Amplitude(amplitude) => {
            filtered.noise_rad.unwrap_or(0.0) / amplitude.as_slice()[index].max(f32::MIN_POSITIVE)
        }
        PhaseNoise::Uniform(_) | PhaseNoise::Unknown => filtered.noise_rad.unwrap_or(0.0),
    };
    let planes = phase.as_slice().iter().zip(filtered.phase.as_slice());
    for (index, (confidence, (phase, filtered))) in
        unwrapped.confidence.as_mut_slice().iter_mut().zip(planes).enumerate()
    {
        let distance = (phase - filtered).abs();
        // Most pixels, and all that the filter left alone, are sure: spare them the function.
        if distance > 0.0 {
            let distance = distance.min(TAU - distance);
            let sigma = sigma(index).min(LARGEST_SIGMA_RAD);
            let odds = PI * (PI - distance) / (sigma * sigma);
            *confidence *= if odds < 4.0 { odds.tanh() } else { 1.0 };
        }
    }
}
