//! Start values: all pairs of ranges on a grid, each with the best amplitudes.
//!
//! With `P(r) = Re sum w z exp(-i k r)`, `W = sum w` and `C(d) = sum w cos(k d)` over the frequencies, the best
//! amplitudes for ranges `r` and `r + d` follow from `[W C; C W] [a b]' = [P(r) P(r + d)]'`, and the weighted squares
//! fall by `a P(r) + b P(r + d)`. Both functions come from tables.

use std::f64::consts::TAU;

use crate::error::{require_not_negative, require_positive};
use crate::pixels::model::Parameters;
use crate::pixels::pixel::{Pixel, Term};
use crate::{Error, Result};

/// Where the paths of a pixel are looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
pub struct SearchSpan {
    /// Least direct range, metre.
    pub nearest_m: f64,
    /// Largest direct range, metre; beyond the interval of all frequencies together, ranges repeat and are ambiguous.
    pub farthest_m: f64,
    /// Largest difference of the two ranges, metre.
    pub longest_detour_m: f64,
}

impl Default for SearchSpan {
    /// A room: 0 to 7 m, with detours of up to 3 m.
    fn default() -> Self {
        Self { nearest_m: 0.0, farthest_m: 7.0, longest_detour_m: 3.0 }
    }
}

/// Most pairs of ranges a pixel may have.
const MOST_PAIRS: usize = 1_000_000;
/// Grid points a cycle of the highest frequency: the squares have two maxima in a cycle. Eight for each; time goes with
/// their square.
const POINTS_PER_CYCLE: f64 = 16.0;
/// Best starts that are followed. A choice; more cost time, fewer miss the minimum where two frequencies leave many.
const MOST_STARTS: usize = 8;

/// Tables of the grid.
#[derive(Debug, Clone)]
pub(crate) struct Grid {
    pub span: SearchSpan,
    step_m: f64,
    /// Grid points of the direct range; behind them follow those that only the indirect range has.
    direct: usize,
    detours: usize,
    wavenumbers: Vec<f64>,
    /// Cosine and sine of `k r`, by grid point, by frequency.
    waves: Vec<[f64; 2]>,
}

/// Working memory of one thread.
#[derive(Debug, Default, Clone)]
pub(crate) struct Scratch {
    projections: Vec<f64>,
    /// Coupling and reciprocal determinant for each detour.
    couplings: Vec<[f64; 2]>,
    gains: Vec<f64>,
    starts: Vec<(f64, Parameters)>,
}

impl Grid {
    pub fn new(span: &SearchSpan, wavenumbers: &[f64]) -> Result<Self> {
        require_not_negative("nearest_m", span.nearest_m)?;
        require_positive("longest_detour_m", span.longest_detour_m)?;
        require_positive("farthest_m - nearest_m", span.farthest_m - span.nearest_m)?;
        let highest = wavenumbers.iter().copied().fold(0.0, f64::max);
        let step_m = TAU / highest / POINTS_PER_CYCLE;
        let direct = ((span.farthest_m - span.nearest_m) / step_m).ceil() + 1.0;
        let detours = (span.longest_detour_m / step_m).ceil();
        if direct * detours > MOST_PAIRS as f64 {
            return Err(Error::SearchTooLarge { grid_points: direct * detours, limit: MOST_PAIRS });
        }
        let (direct, detours) = (direct as usize, detours as usize);
        let range = |point: usize| span.nearest_m + point as f64 * step_m;
        let waves = (0..direct + detours)
            .flat_map(|point| {
                wavenumbers.iter().map(move |wavenumber| {
                    let (sin, cos) = (wavenumber * range(point)).sin_cos();
                    [cos, sin]
                })
            })
            .collect();
        Ok(Self { span: *span, step_m, direct, detours, wavenumbers: wavenumbers.to_vec(), waves })
    }

    fn range(&self, point: usize) -> f64 {
        self.span.nearest_m + point as f64 * self.step_m
    }

    /// `P(r)` on all grid points.
    fn project(&self, pixel: &Pixel, scratch: &mut Scratch) {
        let place = |term: &Term| self.wavenumbers.iter().position(|w| w.to_bits() == term.wavenumber.to_bits());
        let frequencies = self.wavenumbers.len();
        let mut weighted = [[0.0; 2]; crate::MAXIMUM_FREQUENCIES];
        for term in pixel.terms() {
            if let Some(weighted) = place(term).and_then(|place| weighted.get_mut(place)) {
                *weighted = [term.weight * term.re, term.weight * term.im];
            }
        }
        let project = |waves: &[[f64; 2]]| {
            waves.iter().zip(&weighted).map(|(wave, z)| wave[0] * z[0] + wave[1] * z[1]).sum::<f64>()
        };
        scratch.projections.clear();
        scratch.projections.extend(self.waves.chunks_exact(frequencies).map(project));
    }

    /// Ranges at which one path explains most, best first; several where they explain nearly the same.
    pub fn single_starts(&self, pixel: &Pixel, scratch: &mut Scratch, out: &mut Vec<f64>) {
        self.project(pixel, scratch);
        let p = &scratch.projections[..self.direct];
        scratch.starts.clear();
        for (point, value) in p.iter().enumerate() {
            let before = point.checked_sub(1).and_then(|before| p.get(before)).is_none_or(|other| other <= value);
            let after = p.get(point + 1).is_none_or(|other| other < value);
            if *value > 0.0 && before && after {
                scratch.starts.push((*value, [0.0, 0.0, self.range(point), 0.0]));
            }
        }
        keep_best(&mut scratch.starts);
        out.clear();
        out.extend(scratch.starts.iter().map(|(_, parameters)| parameters[2]));
    }

    /// Pairs of paths that explain more than their neighbours on the grid, best first. Uses the projections of
    /// [`Self::single_starts`], which goes before.
    pub fn pair_starts(&self, pixel: &Pixel, scratch: &mut Scratch, out: &mut Vec<Parameters>) {
        let total: f64 = pixel.terms().iter().map(|term| term.weight).sum();
        self.couple(pixel, total, scratch);
        self.evaluate(total, scratch);
        let gain = |point: usize, detour: usize| scratch.gains[point * self.detours + detour];
        scratch.starts.clear();
        for point in 0..self.direct {
            for detour in 0..self.detours {
                let value = gain(point, detour);
                if value > 0.0 && self.is_peak(point, detour, value, gain) {
                    let parameters = self.pair(total, point, detour, scratch);
                    scratch.starts.push((value, parameters));
                }
            }
        }
        keep_best(&mut scratch.starts);
        out.clear();
        out.extend(scratch.starts.iter().map(|(_, parameters)| *parameters));
    }

    /// `C(d)` and the reciprocal determinant of the amplitudes' equations.
    fn couple(&self, pixel: &Pixel, total: f64, scratch: &mut Scratch) {
        scratch.couplings.clear();
        scratch.couplings.extend((1..=self.detours).map(|detour| {
            let length = detour as f64 * self.step_m;
            let coupling: f64 = pixel.terms().iter().map(|term| term.weight * (term.wavenumber * length).cos()).sum();
            let determinant = total * total - coupling * coupling;
            // Detours that all frequencies take for none (or half a cycle) have no two amplitudes.
            [coupling, if determinant > 1e-9 * total * total { 1.0 / determinant } else { 0.0 }]
        }));
    }

    /// What each pair takes off the squares; 0 where an amplitude would not be positive.
    fn evaluate(&self, total: f64, scratch: &mut Scratch) {
        scratch.gains.clear();
        for point in 0..self.direct {
            let first = scratch.projections[point];
            let others = &scratch.projections[point + 1..];
            scratch.gains.extend(others.iter().zip(&scratch.couplings).map(|(second, [coupling, reciprocal])| {
                let a = (total * first - coupling * second) * reciprocal;
                let b = (total * second - coupling * first) * reciprocal;
                if a > 0.0 && b > 0.0 { a * first + b * second } else { 0.0 }
            }));
        }
    }

    fn is_peak(&self, point: usize, detour: usize, value: f64, gain: impl Fn(usize, usize) -> f64) -> bool {
        let rows = point.saturating_sub(1)..(point + 2).min(self.direct);
        rows.into_iter().all(|p| {
            let columns = detour.saturating_sub(1)..(detour + 2).min(self.detours);
            columns.into_iter().all(|d| gain(p, d) <= value)
        })
    }

    fn pair(&self, total: f64, point: usize, detour: usize, scratch: &Scratch) -> Parameters {
        let (first, second) = (scratch.projections[point], scratch.projections[point + detour + 1]);
        let [coupling, reciprocal] = scratch.couplings[detour];
        let a = (total * first - coupling * second) * reciprocal;
        let b = (total * second - coupling * first) * reciprocal;
        [a, b, self.range(point), self.range(point + detour + 1)]
    }
}

/// The best starts in falling order; equal ones stay in the order of the grid.
fn keep_best(starts: &mut Vec<(f64, Parameters)>) {
    starts.sort_by(|a, b| b.0.total_cmp(&a.0));
    starts.truncate(MOST_STARTS);
}
