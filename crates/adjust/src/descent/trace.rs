/// What a step was.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum StepKind {
    /// Levenberg-Marquardt step that was taken.
    Damped,
    /// Damped step that was not taken: the objective grew, or the model had no value there.
    Rejected,
    /// Gauss-Newton step, perhaps shortened.
    Undamped,
}

/// One iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct TraceEntry {
    /// What was done.
    pub kind: StepKind,
    /// Objective after the step (before it where it was rejected): vᵀPv, or the sum of ρ where kernels are robust.
    pub objective: f64,
    /// Length of the step in prior standard deviations, `√(dxᵀ AᵀPA dx)`: no parameter moved by more of its own
    /// standard deviations.
    pub step: f64,
    /// Damping factor relative to the diagonal of the normal equations; 0 for undamped steps.
    pub damping: f64,
    /// Share of the undamped step that was taken; 1 for damped steps.
    pub share: f64,
}
