//! Noise-adaptive mean of phasors: windows grow with the noise, and stop where what they cover does not hang together.

use range_image::Raster;

use crate::filter::fringes::{TILE, Tile};
use crate::filter::noise::{PhaseNoise, estimate, weight};
use crate::filter::phasor::unit;
use crate::filter::window::{Limits, Planes, RowOut, Windows};
use crate::tree::cycle::into_cycle;
use crate::{Error, Result};

/// How phases are filtered before they are unwrapped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrefilterOptions {
    /// Pixels of at most this phase noise are left as they are, in radians: the tree needs no help there. On a fringe
    /// of s radians a pixel this and the next shrink by `1 - s / pi`, the share of half a cycle that is left for the
    /// noise. Default: 0.3 rad.
    pub quiet_sigma_rad: f32,
    /// Windows grow until the mean's standard deviation falls to this, in radians. Default: 0.16 rad.
    pub target_sigma_rad: f32,
    /// Largest half width of a window in pixels: it has `2 r + 1` pixels a side. At most 15. Default: 5 pixels.
    pub largest_radius_px: u8,
    /// Share of the expected length of the mean phasor that must be left after the slope of the surface took its part;
    /// below it (and beyond the scatter of the length) the window covers a jump and is refused. Default: 0.8.
    pub least_coherence: f32,
    /// Number of standard deviations by which lengths and angles may deviate from what the noise explains. Default: 4.
    pub deviations: f32,
}

impl Default for PrefilterOptions {
    fn default() -> Self {
        Self {
            quiet_sigma_rad: 0.3,
            target_sigma_rad: 0.16,
            largest_radius_px: 5,
            least_coherence: 0.8,
            deviations: 4.0,
        }
    }
}

/// Share of the pixels that counts as few: so many may stay noisy, beside jumps and at borders, before the filter says that
/// it does not follow. Surfaces that it loses leave an eighth and more; 0.03 and 0.1 choose alike but for bumps.
pub(crate) const FEW: f32 = 0.05;
/// The largest half width that may be asked for.
const RADIUS_LIMIT: u8 = 15;

impl PrefilterOptions {
    /// Fails where an option lies outside its domain.
    pub fn validate(&self) -> Result<()> {
        let positive = [
            ("quiet_sigma_rad", self.quiet_sigma_rad),
            ("target_sigma_rad", self.target_sigma_rad),
            ("deviations", self.deviations),
        ];
        for (name, value) in positive {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::OutOfDomain { name, value: value.into(), expected: "positive and finite" });
            }
        }
        if !(0.0..=1.0).contains(&self.least_coherence) {
            let value = self.least_coherence.into();
            return Err(Error::OutOfDomain { name: "least_coherence", value, expected: "in [0, 1]" });
        }
        if self.largest_radius_px > RADIUS_LIMIT {
            let value = self.largest_radius_px.into();
            return Err(Error::OutOfDomain { name: "largest_radius_px", value, expected: "at most 15" });
        }
        Ok(())
    }
}

/// A filtered phase image.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Filtered {
    /// Filtered phase in radians in `[0, 2 pi]`, NaN where masked; where the window is one pixel, the measured phase
    /// bit for bit.
    pub phase: Raster<f32>,
    /// Standard deviation of the filtered phase in radians, by the noise alone; that of the measured phase where the
    /// fringe is not told; NaN where masked or unknown.
    pub sigma: Raster<f32>,
    /// Half width of the window that each pixel got, in pixels; 0 where it was left as it is.
    pub radius: Raster<u8>,
    /// The noise of the image, in radians, where it was given as one figure or estimated as such; with amplitudes, the
    /// noise at amplitude one. `None` where a sigma for each pixel was given, or where the image has too few
    /// neighbours to estimate it, and then no pixel is changed.
    pub noise_rad: Option<f32>,
    /// Whether the windows could follow the surface.
    pub verdict: FilterVerdict,
}

/// Whether the filter did what it was asked to.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum FilterVerdict {
    /// No pixel is noisy enough to need the filter, nothing is known of the noise, or no window was allowed.
    #[default]
    NotNeeded,
    /// The windows followed the surface: of the pixels that needed the filter, fewer than one in twenty stayed noisier
    /// than [`PrefilterOptions::quiet_sigma_rad`].
    Followed,
    /// The filter could not follow: this share of the pixels that needed it stayed noisier than
    /// [`PrefilterOptions::quiet_sigma_rad`]. Their fringe is not told from noise, comes within its uncertainty of half a
    /// cycle a pixel, or the surface bends or jumps too much for any window. Remedy:
    /// [`NoisyMethod::Auto`](crate::NoisyMethod::Auto), an average over frames, or a lower frequency.
    NotFollowed {
        /// From 0 to 1.
        share: f32,
    },
}

/// Filters one image; see [`Prefilter::filter_into`]. Allocates its buffers anew.
pub fn prefilter(
    phase: &Raster<f32>,
    noise: PhaseNoise<'_>,
    mask: Option<&Raster<bool>>,
    options: &PrefilterOptions,
) -> Result<Filtered> {
    let mut out = Filtered::default();
    Prefilter::new(*options)?.filter_into(phase, noise, mask, &mut out)?;
    Ok(out)
}

/// Filters images one after the other and keeps its buffers.
#[derive(Debug, Default)]
pub struct Prefilter {
    options: PrefilterOptions,
    planes: Planes,
    blocks: Vec<f32>,
    windows: Windows,
    tile: Tile,
}

impl Prefilter {
    /// Fails where an option lies outside its domain.
    pub fn new(options: PrefilterOptions) -> Result<Self> {
        options.validate()?;
        Ok(Self { options, ..Self::default() })
    }

    /// Filters `phase`, in radians; what is not finite is masked. In `mask`, true means use. Phases outside `[0, 2 pi]` are
    /// taken there first.
    ///
    /// Each pixel's phase becomes the angle of the weighted mean of the unit phasors in a square window, after the fringe
    /// around was turned back: its slope is measured on tiles of 16 by 16 pixels `[Rife1974]`. The window grows from one pixel until the deviation of the mean reaches the target, and stops where the mean phasor is
    /// shorter than noise explains, or turned from that of the next smaller window by more than noise explains
    /// `[BioucasDias2008]`. Pixels quieter than `quiet_sigma_rad` are not touched.
    pub fn filter_into(
        &mut self,
        phase: &Raster<f32>,
        noise: PhaseNoise<'_>,
        mask: Option<&Raster<bool>>,
        out: &mut Filtered,
    ) -> Result<()> {
        noise.validate(phase)?;
        let phase = into_cycle(phase);
        let phase = phase.as_ref();
        let used = load_phasors(phase, mask, &mut self.planes)?;
        if used == 0 {
            return Err(Error::AllMasked { pixels: phase.len() });
        }
        out.noise_rad = self.weigh(phase.width(), noise);
        resize(&mut out.phase, phase);
        resize(&mut out.sigma, phase);
        resize(&mut out.radius, phase);
        let mut limits = Limits::new(&self.options);
        let noise_known = out.noise_rad.is_some() || matches!(noise, PhaseNoise::Sigma(_));
        if !noise_known {
            limits.largest_radius = 0;
        }
        self.run(phase, &limits, out);
        if !noise_known {
            out.sigma.as_mut_slice().fill(f32::NAN);
        }
        out.verdict = self.verdict(out);
        Ok(())
    }

    fn verdict(&self, out: &Filtered) -> FilterVerdict {
        let quiet = self.options.quiet_sigma_rad;
        let (mut needed, mut noisy) = (0_usize, 0_usize);
        for (sigma, radius) in out.sigma.as_slice().iter().zip(out.radius.as_slice()) {
            // What is masked or unknown is neither.
            noisy += usize::from(*sigma > quiet);
            needed += usize::from(*sigma > quiet || *radius > 0);
        }
        match noisy as f32 / needed as f32 {
            _ if needed == 0 || self.options.largest_radius_px == 0 => FilterVerdict::NotNeeded,
            share if share < FEW => FilterVerdict::Followed,
            share => FilterVerdict::NotFollowed { share },
        }
    }

    /// Scales the phasors by their weights; the noise as one figure, see [`Filtered::noise_rad`].
    fn weigh(&mut self, width: usize, noise: PhaseNoise<'_>) -> Option<f32> {
        let Planes { re, im, information } = &mut self.planes;
        let amplitude = if let PhaseNoise::Amplitude(amplitude) = noise { Some(amplitude.as_slice()) } else { None };
        let figure = match noise {
            PhaseNoise::Sigma(_) => None,
            PhaseNoise::Uniform(sigma) => Some(sigma),
            PhaseNoise::Unknown | PhaseNoise::Amplitude(_) => estimate(width, [re, im], amplitude, &mut self.blocks),
        };
        let scale = figure.unwrap_or(0.0);
        let each = match noise {
            PhaseNoise::Sigma(sigma) => Some((sigma.as_slice(), false)),
            PhaseNoise::Amplitude(amplitude) => Some((amplitude.as_slice(), true)),
            PhaseNoise::Unknown | PhaseNoise::Uniform(_) => None,
        };
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || {
                let pixels = re.iter_mut().zip(im).zip(information);
                let Some((plane, inverse)) = each else {
                    let weight = weight(scale);
                    for ((re, im), information) in pixels {
                        *re *= weight.weight;
                        *im *= weight.weight;
                        *information *= weight.information;
                    }
                    return;
                };
                for (((re, im), information), &value) in pixels.zip(plane) {
                    let dark = if value > 0.0 { scale / value } else { f32::INFINITY };
                    let weight = weight(if inverse { dark } else { value });
                    *re *= weight.weight;
                    *im *= weight.weight;
                    *information *= weight.information;
                }
            },
        );
        figure
    }

    fn run(&mut self, phase: &Raster<f32>, limits: &Limits, out: &mut Filtered) {
        let (planes, windows, tile) = (&self.planes, &mut self.windows, &mut self.tile);
        pulp::Arch::new().dispatch(FilterTiles { phase, planes, limits, windows, tile, out });
    }
}

/// The search for all tiles: a type of its own, because what closures hold is not always compiled for wide registers.
struct FilterTiles<'a> {
    phase: &'a Raster<f32>,
    planes: &'a Planes,
    limits: &'a Limits,
    windows: &'a mut Windows,
    tile: &'a mut Tile,
    out: &'a mut Filtered,
}

impl pulp::WithSimd for FilterTiles<'_> {
    type Output = ();

    // Only what is inlined is compiled for wide registers.
    #[allow(clippy::inline_always)]
    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self { phase, planes, limits, windows, tile, out } = self;
        let (width, height) = (phase.width(), phase.height());
        let Filtered { phase: filtered, sigma, radius, .. } = out;
        for row in (0..height).step_by(TILE) {
            for col in (0..width).step_by(TILE) {
                tile.load(planes, [width, height], [col, row], limits.largest_radius);
                let (first, [columns, rows]) = (row * width + col, tile.core.clone());
                let [gain, fall] = tile.slope;
                let limits = &limits.beside(tile.slope);
                for (line, row) in rows.enumerate() {
                    let at = first + line * width..first + line * width + columns.len();
                    let mut out = RowOut {
                        phase: &mut filtered.as_mut_slice()[at.clone()],
                        sigma: &mut sigma.as_mut_slice()[at.clone()],
                        radius: &mut radius.as_mut_slice()[at.clone()],
                        fringe: [gain * columns.start as f32 + fall * row as f32, gain],
                    };
                    windows.filter_row(tile, row, &phase.as_slice()[at.clone()], limits, &mut out);
                    if !tile.resolved {
                        for (s, i) in sigma.as_mut_slice()[at.clone()].iter_mut().zip(&planes.information[at]) {
                            *s = if *i > 0.0 { i.sqrt().recip() } else { f32::NAN };
                        }
                    }
                }
            }
        }
    }
}

fn resize<T: Clone + Default>(raster: &mut Raster<T>, like: &Raster<f32>) {
    if (raster.width(), raster.height()) != (like.width(), like.height()) {
        *raster = Raster::filled(like.width(), like.height(), T::default());
    }
}

/// Unit phasors of the used pixels, zero elsewhere, and the number of used pixels.
fn load_phasors(phase: &Raster<f32>, mask: Option<&Raster<bool>>, planes: &mut Planes) -> Result<usize> {
    let (width, height) = (phase.width(), phase.height());
    if phase.is_empty() {
        return Err(Error::Empty { width, height });
    }
    if let Some(mask) = mask {
        phase.require_same_size(mask, "mask")?;
    }
    planes.resize(phase.len());
    for (information, phase) in planes.information.iter_mut().zip(phase.as_slice()) {
        *information = if phase.is_finite() { 1.0 } else { 0.0 };
    }
    if let Some(mask) = mask {
        for (information, &mask) in planes.information.iter_mut().zip(mask.as_slice()) {
            *information = if mask { *information } else { 0.0 };
        }
    }
    let count = planes.information.iter().filter(|used| **used > 0.0).count();
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || {
            let parts = planes.re.iter_mut().zip(&mut planes.im).zip(&planes.information);
            for (((re, im), &used), &phase) in parts.zip(phase.as_slice()) {
                let [cosine, sine] = unit(if used > 0.0 { phase } else { 0.0 });
                *re = cosine * used;
                *im = sine * used;
            }
        },
    );
    Ok(count)
}
