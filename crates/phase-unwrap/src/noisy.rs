//! Filter, unwrap, and back to the measured phases in one call.

use std::f32::consts::{PI, TAU};

use range_image::Raster;

use crate::congruent::congruent_into;
use crate::noise::{LARGEST_SIGMA_RAD, PhaseNoise};
use crate::prefilter::{Filtered, Prefilter, PrefilterOptions};
use crate::{KnownWraps, Result, SpatialOptions, Unwrapped, Unwrapper};

/// How noisy phases are unwrapped.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct NoisyOptions {
    /// The filter.
    pub prefilter: PrefilterOptions,
    /// The spanning tree.
    pub spatial: SpatialOptions,
}

/// Wrap counts of a noisy image.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NoisyUnwrapped {
    /// Counts of the measured phase, relative: the lowest of each island is 0. The confidence is that of the filtered
    /// phase's place in the tree, times `2p - 1` for the odds of the count against the next one by the noise.
    pub unwrapped: Unwrapped,
    /// The filtered phase that was unwrapped.
    pub filtered: Filtered,
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
    prefilter: Prefilter,
    tree: Unwrapper,
    lowest: Vec<i32>,
}

impl NoisyUnwrapper {
    /// Fails where an option lies outside its domain.
    pub fn new(options: NoisyOptions) -> Result<Self> {
        let prefilter = Prefilter::new(options.prefilter)?;
        let tree = Unwrapper::new(options.spatial)?;
        Ok(Self { options, prefilter, tree, ..Self::default() })
    }

    /// Wrap counts of `phase`, in radians in `[0, 2 pi]`; what is not finite is masked. In `mask`, true means use.
    ///
    /// The phase is filtered as [`Prefilter::filter_into`] does, unwrapped along the spanning tree, and its counts are
    /// carried back to the measured phase as [`congruent`](crate::congruent) does. After an error `out` holds nothing
    /// of use.
    pub fn unwrap_into(
        &mut self,
        phase: &Raster<f32>,
        noise: PhaseNoise<'_>,
        mask: Option<&Raster<bool>>,
        out: &mut NoisyUnwrapped,
    ) -> Result<()> {
        let NoisyUnwrapped { unwrapped, filtered } = out;
        self.prefilter.filter_into(phase, noise, mask, filtered)?;
        self.tree.unwrap_into(&filtered.phase, None, None, KnownWraps::Nothing, unwrapped)?;
        congruent_into(phase, &filtered.phase, &mut unwrapped.wraps)?;
        self.start_islands_at_zero(unwrapped);
        doubt(phase, filtered, noise, unwrapped);
        for island in &mut unwrapped.islands {
            (island.pixels, island.sure_pixels) = (0, 0);
        }
        unwrapped.count_pixels(self.options.spatial.minimum_confidence);
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
