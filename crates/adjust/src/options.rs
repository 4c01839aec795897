use crate::{Error, Result};

/// How the descent goes. Whatever the method, the end is undamped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// Full steps, halved where the objective would grow. For good approximate values.
    GaussNewton,
    /// Damped steps (Levenberg, Marquardt; damping after Nielsen) until they become small, then as Gauss-Newton.
    #[default]
    LevenbergMarquardt,
    /// Steps within a region of trust, on the way from the steepest descent to the Gauss-Newton step (Powell's dog-leg
    /// \[Powell1970\]). A step that is not taken costs one evaluation of the model and no factorisation.
    DogLeg,
}

/// How to solve.
#[derive(Debug, Clone, PartialEq)]
pub struct SolveOptions {
    /// Way of descent.
    pub method: Method,
    /// Steps tried, damped and undamped, accepted or not.
    pub max_iterations: usize,
    /// The iteration ends when the undamped step is shorter than this, in standard deviations (the smaller of prior-
    /// and posterior-scaled).
    pub step_tolerance: f64,
    /// First damping factor, relative to the diagonal of the normal equations.
    pub initial_damping: f64,
}

impl Default for SolveOptions {
    fn default() -> Self {
        Self { method: Method::default(), max_iterations: 1000, step_tolerance: 1e-8, initial_damping: 1e-4 }
    }
}

impl SolveOptions {
    pub(crate) fn check(&self) -> Result<()> {
        for (name, value) in [("step_tolerance", self.step_tolerance), ("initial_damping", self.initial_damping)] {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::Option { name, value, expected: "a positive number" });
            }
        }
        Ok(())
    }
}
