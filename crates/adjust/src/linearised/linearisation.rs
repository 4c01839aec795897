use rayon::prelude::*;

use crate::linearised::evaluation::{Scratch, Want};
use crate::linearised::layout::{Layout, Place};
use crate::{Adjustment, Result};

/// Observations in one piece of work. Sums are formed piece by piece and added in order, so that they do not depend on
/// the number of threads.
const PIECE: usize = 256;

/// Residuals and Jacobians at one set of values, in flat memory that is reused from iteration to iteration.
#[derive(Debug, Clone)]
pub(crate) struct Linearisation {
    /// v = observed − model, as given by the observations.
    pub(crate) residual: Vec<f64>,
    /// `W v` with `WᵀW = C⁻¹`.
    pub(crate) whitened: Vec<f64>,
    /// Compact `W A` of all observations, then the compact Jacobians of the constraints.
    pub(crate) jacobian: Vec<f64>,
    /// Residuals of the constraints.
    pub(crate) constraint: Vec<f64>,
    /// Robust weight of each row, 1 for least squares. Not contained in `whitened` and `jacobian`.
    pub(crate) weights: Vec<f64>,
    /// vᵀPv with robust weights.
    pub(crate) vtpv: f64,
    /// What is minimised: the sum of ρ(s²); vᵀPv for least squares.
    pub(crate) objective: f64,
}

/// Consecutive rows of alike observations with one weight.
pub(crate) struct Run<'s> {
    /// Compact Jacobian of the rows.
    pub(crate) jacobian: &'s [f64],
    pub(crate) whitened: &'s [f64],
    pub(crate) weight: f64,
    /// Length of a row of the Jacobian.
    pub(crate) width: usize,
}

/// Some observations and their share of the memory.
struct Piece<'s> {
    /// Number of the first one.
    first: usize,
    places: &'s [Place],
    residual: &'s mut [f64],
    whitened: &'s mut [f64],
    weights: &'s mut [f64],
    jacobian: &'s mut [f64],
}

impl Linearisation {
    pub(crate) fn new(layout: &Layout) -> Self {
        Self {
            residual: vec![0.0; layout.rows],
            whitened: vec![0.0; layout.rows],
            jacobian: vec![0.0; layout.jacobian],
            constraint: vec![0.0; layout.constraint_rows],
            weights: vec![1.0; layout.rows],
            vtpv: 0.0,
            objective: 0.0,
        }
    }

    /// Evaluates all observations and constraints at `values`.
    pub(crate) fn evaluate(
        &mut self,
        adjustment: &Adjustment<'_>,
        layout: &Layout,
        values: &[f64],
        want: Want,
    ) -> Result<()> {
        let pieces = self.pieces(layout);
        let sums: Vec<Result<(f64, f64)>> = if pieces.len() > 1 {
            pieces.into_par_iter().map(|piece| piece.evaluate(adjustment, layout, values, want)).collect()
        } else {
            pieces.into_iter().map(|piece| piece.evaluate(adjustment, layout, values, want)).collect()
        };
        (self.vtpv, self.objective) = (0.0, 0.0);
        for sum in sums {
            let (vtpv, objective) = sum?;
            self.vtpv += vtpv;
            self.objective += objective;
        }
        let mut scratch = Scratch::new(layout, values, want);
        for (index, (constraint, place)) in adjustment.constraints.iter().zip(&layout.constraints).enumerate() {
            let (residual, jacobian) = (&mut self.constraint[place.rows()], &mut self.jacobian[place.jacobian_range()]);
            let done = scratch.evaluate(constraint.as_ref(), place, residual, jacobian);
            done.map_err(|failure| failure.name("constraint", index))?;
        }
        Ok(())
    }

    fn pieces<'s>(&'s mut self, layout: &'s Layout) -> Vec<Piece<'s>> {
        let (mut residual, mut whitened) = (self.residual.as_mut_slice(), self.whitened.as_mut_slice());
        let (mut weights, mut jacobian) = (self.weights.as_mut_slice(), self.jacobian.as_mut_slice());
        let chunks = layout.observations.chunks(PIECE).enumerate();
        let piece = |(index, places): (usize, &'s [Place])| {
            let rows = places.iter().map(|place| place.dimension).sum();
            let entries = places.iter().map(|place| place.dimension * place.width).sum();
            Piece {
                first: index * PIECE,
                places,
                residual: take(&mut residual, rows),
                whitened: take(&mut whitened, rows),
                weights: take(&mut weights, rows),
                jacobian: take(&mut jacobian, entries),
            }
        };
        chunks.map(piece).collect()
    }

    /// `A·dx`, whitened but without robust weights, in `out` (one value a row).
    pub(crate) fn apply(&self, layout: &Layout, step: &[f64], out: &mut [f64]) {
        let mut rest = out;
        let pieces: Vec<_> = layout
            .observations
            .chunks(PIECE)
            .map(|places| (places, take(&mut rest, places.iter().map(|place| place.dimension).sum())))
            .collect();
        pieces.into_par_iter().with_min_len(4).for_each(|(places, out)| {
            let first = places[0].row;
            for place in places {
                let out = &mut out[place.row - first..place.row - first + place.dimension];
                self.apply_one(layout, place, step, out);
            }
        });
    }

    fn apply_one(&self, layout: &Layout, place: &Place, step: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        let jacobian = &self.jacobian[place.jacobian_range()];
        for part in layout.parts(place) {
            let step = &step[part.columns()];
            for (out, row) in out.iter_mut().zip(jacobian.chunks_exact(place.width)) {
                *out += row[part.entries()].iter().zip(step).map(|(a, dx)| a * dx).sum::<f64>();
            }
        }
    }

    /// The rows of consecutive observations of one width in runs of equal weight: one, unless kernels are robust or some
    /// components are excluded.
    pub(crate) fn runs<'s>(&'s self, places: &[Place]) -> impl Iterator<Item = Run<'s>> + use<'s> {
        let bounds = places.first().zip(places.last());
        let (rows, entries, width) = bounds.map_or((0..0, 0..0, 0), |(first, last)| {
            (first.row..last.rows().end, first.jacobian..last.jacobian_range().end, first.width)
        });
        let (mut jacobian, mut whitened) = (&self.jacobian[entries], &self.whitened[rows.clone()]);
        self.weights[rows].chunk_by(|a, b| a.to_bits() == b.to_bits()).map(move |weights| {
            let (residuals, rest) = whitened.split_at(weights.len());
            let (entries, below) = jacobian.split_at(weights.len() * width);
            (whitened, jacobian) = (rest, below);
            Run { jacobian: entries, whitened: residuals, weight: weights[0], width }
        })
    }

    /// Squared lengths of the columns of the whitened Jacobian, without robust weights.
    pub(crate) fn column_squares(&self, layout: &Layout) -> Vec<f64> {
        let mut out = vec![0.0; layout.unknowns];
        for place in &layout.observations {
            for row in self.jacobian[place.jacobian_range()].chunks_exact(place.width.max(1)) {
                for part in layout.parts(place) {
                    let squares = out[part.columns()].iter_mut().zip(&row[part.entries()]);
                    squares.for_each(|(out, a)| *out += a * a);
                }
            }
        }
        out
    }

    /// `Aᵀ P rows` for whitened rows.
    pub(crate) fn transpose_apply(&self, layout: &Layout, rows: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; layout.unknowns];
        for place in &layout.observations {
            let jacobian = &self.jacobian[place.jacobian_range()];
            for part in layout.parts(place) {
                let out = &mut out[part.columns()];
                for (row, entries) in place.rows().zip(jacobian.chunks_exact(place.width)) {
                    let weighted = self.weights[row] * rows[row];
                    out.iter_mut().zip(&entries[part.entries()]).for_each(|(out, a)| *out += a * weighted);
                }
            }
        }
        out
    }
}

impl Piece<'_> {
    /// Contributions to vᵀPv and to the objective.
    fn evaluate(self, adjustment: &Adjustment<'_>, layout: &Layout, values: &[f64], want: Want) -> Result<(f64, f64)> {
        let mut scratch = Scratch::new(layout, values, want);
        let (mut vtpv, mut objective) = (0.0, 0.0);
        let Some((row, entry)) = self.places.first().map(|place| (place.row, place.jacobian)) else {
            return Ok((vtpv, objective));
        };
        for (index, place) in self.places.iter().enumerate() {
            let stored = &adjustment.observations[self.first + index];
            let group = &adjustment.groups[stored.group.0];
            let rows = place.row - row..place.row - row + place.dimension;
            let residual = &mut self.residual[rows.clone()];
            let start = place.jacobian - entry;
            let jacobian = &mut self.jacobian[start..start + place.dimension * place.width];
            let done = scratch.evaluate(stored.observation.as_ref(), place, residual, jacobian);
            done.map_err(|failure| failure.name(&group.name, self.first + index))?;
            let whitening = &adjustment.whitening[stored.whitening..];
            let whitened = &mut self.whitened[rows.clone()];
            whitened.copy_from_slice(residual);
            whiten(whitening, whitened, 1);
            let excluded = adjustment.exclusions.get(&(self.first + index));
            let is_used = |component: usize| excluded.is_none_or(|excluded| !excluded.mask[component]);
            let used = whitened.iter().enumerate().filter(|&(component, _)| is_used(component));
            let square: f64 = used.map(|(_, v)| v * v).sum();
            let (rho, weight) = group.kernel.evaluate(square);
            for (component, row) in rows.enumerate() {
                self.weights[row] = if is_used(component) { weight } else { 0.0 };
            }
            vtpv += weight * square;
            objective += rho;
            if want == Want::Jacobians {
                whiten(whitening, jacobian, place.width);
            }
        }
        Ok((vtpv, objective))
    }
}

/// Cuts the first `count` elements off a slice.
#[allow(clippy::mut_mut)] // the slice itself becomes shorter
pub(crate) fn take<'s>(rest: &mut &'s mut [f64], count: usize) -> &'s mut [f64] {
    let (head, tail) = std::mem::take(rest).split_at_mut(count);
    *rest = tail;
    head
}

/// `W · matrix` in place for a lower triangular W stored row by row; the matrix is row-major with `width` columns.
fn whiten(whitening: &[f64], matrix: &mut [f64], width: usize) {
    if width == 0 {
        return;
    }
    let dimension = matrix.len() / width;
    for row in (0..dimension).rev() {
        let weights = &whitening[row * (row + 1) / 2..(row + 1) * (row + 2) / 2];
        let (above, below) = matrix.split_at_mut(row * width);
        let below = &mut below[..width];
        for out in &mut *below {
            *out *= weights[row];
        }
        for (above, &weight) in above.chunks_exact(width).zip(weights) {
            // Components are uncorrelated more often than not.
            if weight != 0.0 {
                below.iter_mut().zip(above).for_each(|(out, a)| *out += weight * a);
            }
        }
    }
}
