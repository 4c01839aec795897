use crate::layout::{Layout, Place};
use crate::{Adjustment, Error, Jacobians, Observation, Result};

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

/// Whether derivatives are wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Want {
    Residuals,
    Jacobians,
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
        let mut scratch = Scratch::new(layout, values, want);
        (self.vtpv, self.objective) = (0.0, 0.0);
        for (index, (stored, place)) in adjustment.observations.iter().zip(&layout.observations).enumerate() {
            let group = &adjustment.groups[stored.group.0];
            let name = |failure: Failure| failure.name(&group.name, index);

            let (rows, entries) = (place.rows(), place.jacobian_range());
            let residual = &mut self.residual[rows.clone()];
            let jacobian = &mut self.jacobian[entries];
            scratch.evaluate(stored.observation.as_ref(), layout, place, residual, jacobian).map_err(name)?;
            let whitening = &adjustment.whitening[stored.whitening..];
            let whitened = &mut self.whitened[rows.clone()];
            whitened.copy_from_slice(residual);
            whiten(whitening, whitened, 1);
            let excluded = adjustment.exclusions.get(&index);
            let is_used = |component: usize| excluded.is_none_or(|excluded| !excluded.mask[component]);
            let used = whitened.iter().enumerate().filter(|&(component, _)| is_used(component));
            let square: f64 = used.map(|(_, v)| v * v).sum();
            let (objective, weight) = group.kernel.evaluate(square);
            for (component, row) in rows.enumerate() {
                self.weights[row] = if is_used(component) { weight } else { 0.0 };
            }
            self.vtpv += weight * square;
            self.objective += objective;
            if want == Want::Jacobians {
                whiten(whitening, jacobian, place.width());
            }
        }
        for (index, (constraint, place)) in adjustment.constraints.iter().zip(&layout.constraints).enumerate() {
            let (rows, entries) = (place.rows(), place.jacobian_range());
            let (residual, jacobian) = (&mut self.constraint[rows], &mut self.jacobian[entries]);
            let name = |failure: Failure| failure.name("constraint", index);
            scratch.evaluate(constraint.as_ref(), layout, place, residual, jacobian).map_err(name)?;
        }
        Ok(())
    }

    /// `A·dx`, whitened but without robust weights, in `out` (one value a row).
    pub(crate) fn apply(&self, layout: &Layout, step: &[f64], out: &mut [f64]) {
        for place in &layout.observations {
            let (active, jacobian) = (layout.active(place), &self.jacobian[place.jacobian_range()]);
            for (index, row) in place.rows().enumerate() {
                let entries = &jacobian[index * active.len()..(index + 1) * active.len()];
                out[row] = entries.iter().zip(active).map(|(a, &(_, column))| a * step[column]).sum();
            }
        }
    }

    /// `Aᵀ P rows` for whitened rows.
    pub(crate) fn transpose_apply(&self, layout: &Layout, rows: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; layout.unknowns];
        for place in &layout.observations {
            let (active, jacobian) = (layout.active(place), &self.jacobian[place.jacobian_range()]);
            for (row, entries) in place.rows().zip(jacobian.chunks_exact(active.len().max(1))) {
                let weighted = self.weights[row] * rows[row];
                entries.iter().zip(active).for_each(|(a, &(_, column))| out[column] += a * weighted);
            }
        }
        out
    }
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
        for (column, out) in below[..width].iter_mut().enumerate() {
            *out *= weights[row];
            for (index, weight) in weights[..row].iter().enumerate() {
                *out += weight * above[index * width + column];
            }
        }
    }
}

/// What went wrong in one observation, before its name is known.
struct Failure {
    component: usize,
    kind: FailureKind,
}

enum FailureKind {
    Model(String),
    NotFinite(&'static str, f64),
}

impl Failure {
    fn model(reason: String) -> Self {
        Self { component: 0, kind: FailureKind::Model(reason) }
    }

    fn name(self, group: &str, observation: usize) -> Error {
        let (group, component) = (group.to_owned(), self.component);
        match self.kind {
            FailureKind::Model(reason) => Error::Evaluation { group, observation, reason },
            FailureKind::NotFinite(what, value) => Error::NotFinite { group, observation, component, what, value },
        }
    }

    fn check(values: &[f64], width: usize, what: &'static str) -> std::result::Result<(), Self> {
        match values.iter().position(|value| !value.is_finite()) {
            None => Ok(()),
            Some(index) => Err(Self { component: index / width, kind: FailureKind::NotFinite(what, values[index]) }),
        }
    }
}

/// Memory for one observation at a time, allocated once a pass.
struct Scratch<'v> {
    values: &'v [f64],
    want: Want,
    parameters: Vec<&'v [f64]>,
    offsets: Vec<usize>,
    full: Vec<f64>,
}

impl<'v> Scratch<'v> {
    fn new(layout: &Layout, values: &'v [f64], want: Want) -> Self {
        Self { values, want, parameters: Vec::new(), offsets: Vec::new(), full: vec![0.0; layout.widest] }
    }

    fn evaluate(
        &mut self,
        observation: &dyn Observation,
        layout: &Layout,
        place: &Place,
        residual: &mut [f64],
        compact: &mut [f64],
    ) -> std::result::Result<(), Failure> {
        self.parameters.clear();
        self.offsets.clear();
        self.offsets.push(0);
        let mut width = 0;
        for block in observation.blocks() {
            self.parameters.push(&self.values[layout.block_values(block.0)]);
            width += layout.block_columns(block.0).len();
            self.offsets.push(width);
        }
        if self.want == Want::Residuals {
            let done = observation.evaluate(&self.parameters, residual, None);
            done.map_err(|failure| Failure::model(failure.to_string()))?;
            return Failure::check(residual, 1, "the residual");
        }
        let data = &mut self.full[..place.dimension * width];
        data.fill(0.0);
        let mut jacobians = Jacobians { data, offsets: &self.offsets, dimension: place.dimension, misused: false };
        let done = observation.evaluate(&self.parameters, residual, Some(&mut jacobians));
        done.map_err(|failure| Failure::model(failure.to_string()))?;
        if jacobians.misused {
            return Err(Failure::model("a Jacobian of the wrong shape was written".to_owned()));
        }
        Failure::check(residual, 1, "the residual")?;
        Failure::check(jacobians.data, width.max(1), "a derivative")?;
        self.compress(layout.active(place), width, compact);
        Ok(())
    }

    /// Keeps the free parameters' columns.
    fn compress(&self, active: &[(usize, usize)], width: usize, compact: &mut [f64]) {
        if active.is_empty() {
            return;
        }
        for (row, out) in compact.chunks_exact_mut(active.len()).enumerate() {
            for (out, &(place, _)) in out.iter_mut().zip(active) {
                *out = self.full[row * width + place];
            }
        }
    }
}
