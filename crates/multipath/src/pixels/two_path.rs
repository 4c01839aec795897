//! The direct range where a second path brings light as well.

use range_image::{ComplexFrame, Modulation, Raster};
use rayon::prelude::*;

use crate::error::{require_not_negative, require_positive, require_probability};
use crate::pixels::pixel::{System, USELESS};
use crate::pixels::search::Grid;
use crate::pixels::solver::{PixelSolver, Worker};
use crate::{FrequencyResponse, Result, SearchSpan, Systematics};

/// A frequency whose amplitude is smaller, in standard deviations of the complex value, does not take part. Its two parts are
/// normal at any amplitude; below this it tells hardly more than that it is dark. A larger one leaves dark pixels with fewer
/// frequencies than two paths need.
const LEAST_SNR: f64 = 3.0;

/// How the paths of a pixel are looked for and judged.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
pub struct TwoPathOptions {
    /// Where the paths are looked for. Default: that of [`SearchSpan`].
    pub span: SearchSpan,
    /// Probability that the right model is refused, for one path and for two. Default: 1e-3.
    pub false_alarm: f64,
    /// Direct ranges with a larger standard deviation are not resolved either, metre. Default: 0.1 m.
    pub largest_sigma_m: f64,
    /// Standard deviation that the model of two paths adds to the direct range, as a share of `ratio` times detour. A
    /// diffuse wall is no single second path but one of every length, the shortest of which pass for direct light: in a
    /// simulated corner a quarter makes sigma cover the errors. Zero for mirrors, glass and other second paths that are
    /// one. Default: 0.25.
    pub diffuse_share: f64,
    /// What calibration leaves over. Default: that of [`Systematics`].
    pub systematics: Systematics,
}

impl Default for TwoPathOptions {
    /// A room; refusals of one in a thousand; at most 10 cm.
    fn default() -> Self {
        Self {
            span: SearchSpan::default(),
            false_alarm: 1e-3,
            largest_sigma_m: 0.1,
            diffuse_share: 0.25,
            systematics: Systematics::default(),
        }
    }
}

impl TwoPathOptions {
    fn validate(&self) -> Result<()> {
        require_probability("false_alarm", self.false_alarm)?;
        require_not_negative("diffuse_share", self.diffuse_share)?;
        require_positive("largest_sigma_m", self.largest_sigma_m)
    }
}

/// What the frequencies say of the paths of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum Verdict {
    /// Fewer than two frequencies with a value, a sigma and enough amplitude, or the pixel is saturated or moved.
    #[default]
    NoData,
    /// One path explains all frequencies; the range is that of all of them together.
    Single,
    /// Two paths explain them, and no other two nor one do; the ranges have standard deviations.
    Two,
    /// Several solutions explain them as well. With two frequencies this is the rule. They are in
    /// [`TwoPathImage::hypotheses`].
    Ambiguous,
    /// Two paths are needed, but they are too close, too weak or too noisy to be told apart.
    Unresolved,
    /// Neither one nor two paths explain the frequencies: light by more ways, as in a corner, or errors of another kind.
    Inconsistent,
}

/// The paths of one pixel. Ranges in metre; NaN where the verdict does not bear a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PixelPaths {
    /// What the frequencies say.
    pub verdict: Verdict,
    /// Direct range (`Single` and `Two`), metre.
    pub direct_m: f32,
    /// Its standard deviation, metre.
    pub sigma_direct_m: f32,
    /// Half the length of the longer path (`Two`), metre.
    pub indirect_m: f32,
    /// Its standard deviation, metre.
    pub sigma_indirect_m: f32,
    /// Amplitude of the direct path with the frequency response taken off (`Single` and `Two`), unit of the samples.
    pub amplitude: f32,
    /// Amplitude of the longer path over that of the direct one (`Two`).
    pub ratio: f32,
    /// Its standard deviation.
    pub sigma_ratio: f32,
    /// Sum of weighted squares of the model that the verdict speaks of: of two paths unless `Single`.
    pub chi_squared: f32,
}

impl PixelPaths {
    /// A verdict without numbers.
    pub(crate) fn without_numbers(verdict: Verdict) -> Self {
        Self {
            verdict,
            direct_m: f32::NAN,
            sigma_direct_m: f32::NAN,
            indirect_m: f32::NAN,
            sigma_indirect_m: f32::NAN,
            amplitude: f32::NAN,
            ratio: f32::NAN,
            sigma_ratio: f32::NAN,
            chi_squared: f32::NAN,
        }
    }
}

impl Default for PixelPaths {
    /// No data.
    fn default() -> Self {
        Self::without_numbers(Verdict::NoData)
    }
}

/// One solution of a pixel that has several, or none that can be relied on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hypothesis {
    /// Direct range, metre.
    pub direct_m: f64,
    /// Its standard deviation, metre.
    pub sigma_direct_m: f64,
    /// Half the length of the longer path, metre; NaN if this solution has one path.
    pub indirect_m: f64,
    /// Its standard deviation, metre.
    pub sigma_indirect_m: f64,
    /// Amplitude of the longer path over that of the direct one; 0 if this solution has one path.
    pub ratio: f64,
    /// Sum of weighted squares.
    pub chi_squared: f64,
}

/// All solutions of one pixel, best first.
#[derive(Debug, Clone, PartialEq)]
pub struct PixelHypotheses {
    /// Column.
    pub col: usize,
    /// Row.
    pub row: usize,
    /// The solutions.
    pub solutions: Vec<Hypothesis>,
}

/// The paths of all pixels.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TwoPathImage {
    /// Verdict and numbers of each pixel.
    pub paths: Raster<PixelPaths>,
    /// The solutions of the pixels that are `Ambiguous` or `Unresolved`, row by row.
    pub hypotheses: Vec<PixelHypotheses>,
}

impl TwoPathImage {
    /// Direct range in metre; NaN where the verdict bears no number.
    pub fn direct_m(&self) -> Raster<f32> {
        self.paths.map(|paths| paths.direct_m)
    }

    /// Standard deviation of the direct range in metre.
    pub fn sigma_direct_m(&self) -> Raster<f32> {
        self.paths.map(|paths| paths.sigma_direct_m)
    }

    /// Number of pixels of a verdict.
    pub fn count(&self, verdict: Verdict) -> usize {
        self.paths.as_slice().iter().filter(|paths| paths.verdict == verdict).count()
    }
}

/// The solver for given frequencies, made once for many frames.
#[derive(Debug, Clone)]
pub struct TwoPathSolver {
    system: System,
    solver: PixelSolver,
}

impl TwoPathSolver {
    /// Needs two to [`MAXIMUM_FREQUENCIES`](crate::MAXIMUM_FREQUENCIES) different frequencies; see [`solve_two_paths`].
    pub fn new(modulations: &[Modulation], response: &FrequencyResponse, options: &TwoPathOptions) -> Result<Self> {
        options.validate()?;
        let system = System::new(modulations, response, &options.systematics, 2)?;
        let grid = Grid::new(&options.span, system.wavenumbers())?;
        Ok(Self { system, solver: PixelSolver::new(grid, options) })
    }

    /// Solves a frame; see [`solve_two_paths`]. A plane of the right size is used again.
    pub fn solve_into(&self, frame: &ComplexFrame, out: &mut TwoPathImage) -> Result<()> {
        self.system.require_frame(frame)?;
        System::require_sigma(frame)?;
        if frame.flags.require_same_size(&out.paths, "").is_err() {
            out.paths = Raster::filled(frame.width(), frame.height(), PixelPaths::default());
        }
        let width = frame.width();
        let rows = out.paths.as_mut_slice().par_chunks_mut(width).enumerate();
        let hypotheses: Vec<Vec<PixelHypotheses>> = rows
            .map_init(Worker::default, |worker, (row, paths)| {
                let mut found = Vec::new();
                for (col, paths) in paths.iter_mut().enumerate() {
                    *paths = self.solve_pixel(frame, row * width + col, worker);
                    if matches!(paths.verdict, Verdict::Ambiguous | Verdict::Unresolved) {
                        found.push(PixelHypotheses { col, row, solutions: worker.hypotheses().to_vec() });
                    }
                }
                found
            })
            .collect();
        out.hypotheses.clear();
        out.hypotheses.extend(hypotheses.into_iter().flatten());
        Ok(())
    }

    fn solve_pixel(&self, frame: &ComplexFrame, index: usize, worker: &mut Worker) -> PixelPaths {
        if frame.flags.as_slice()[index].intersects(USELESS) {
            return PixelPaths::without_numbers(Verdict::NoData);
        }
        self.solver.solve(&self.system.load(frame, index, LEAST_SNR), worker)
    }
}

/// Finds for each pixel the direct range `r1`, the range `r2` of one longer path and their amplitudes `a`, `b` from
/// `z = m (a exp(i k r1) + b exp(i k r2))` at all frequencies, `m` being the `response` and `k = 2 pi / U`.
///
/// One path is tried first; two are looked for only where one does not explain the pixel (chi-squared with `2 F - 2`
/// degrees of freedom; with two paths `2 F - 4`). All pairs of ranges within the span, with amplitudes that are
/// positive, compete: the best ones on a grid are followed to their minimum by Gauss-Newton, and where more than one of
/// these minima is as likely the verdict is `Ambiguous`. With two frequencies there is nothing left to tell
/// solutions apart by; all are returned as hypotheses.
///
/// The standard deviations hold for noise of the channels' sigma with the systematics of the options added, and for
/// exactly two paths. Light from a whole wall is no single second path: where it is spread over more than the noise
/// allows, the verdict is `Inconsistent`.
///
/// Phases must be free of each frequency's own range errors. Flags stay as they are.
///
/// Fails with [`Error::SigmaUnknown`](crate::Error::SigmaUnknown) where nothing is known of the noise of a channel; with
/// another error where there are not two to [`MAXIMUM_FREQUENCIES`](crate::MAXIMUM_FREQUENCIES) different frequencies, or
/// response or options do not fit.
///
/// ```
/// use multipath::range_image::{ComplexFrame, Modulation, PhaseConvention, Raster};
/// use multipath::{FrequencyResponse, TwoPathOptions, Verdict, solve_two_paths};
///
/// // One pixel that sees a wall at 2 m; sigma is one in two hundred of the amplitude.
/// let modulations = [20e6, 50e6, 80e6].map(|hz| Modulation::new(hz).unwrap());
/// let phases = modulations.map(|modulation| Raster::filled(1, 1, modulation.phase_from_range(2.0) as f32));
/// let frame = ComplexFrame::from_phase(
///     modulations.to_vec(),
///     phases.to_vec(),
///     vec![Raster::filled(1, 1, 400.0); 3],
///     &PhaseConvention::default(),
/// )?;
/// let response = FrequencyResponse::flat(3);
/// let answer = solve_two_paths(&frame, &response, &TwoPathOptions::default());
/// assert!(answer.is_err(), "sigma is not known yet");
///
/// let frame = frame.with_sigma(vec![Raster::filled(1, 1, 2.0); 3])?;
/// let image = solve_two_paths(&frame, &response, &TwoPathOptions::default())?;
/// assert_eq!(image.paths[(0, 0)].verdict, Verdict::Single);
/// assert!((image.direct_m()[(0, 0)] - 2.0).abs() < 1e-3);
/// # Ok::<(), multipath::Error>(())
/// ```
pub fn solve_two_paths(
    frame: &ComplexFrame,
    response: &FrequencyResponse,
    options: &TwoPathOptions,
) -> Result<TwoPathImage> {
    let modulations: Vec<Modulation> = frame.channels.iter().map(|channel| channel.modulation).collect();
    let mut out = TwoPathImage::default();
    TwoPathSolver::new(&modulations, response, options)?.solve_into(frame, &mut out)?;
    Ok(out)
}
