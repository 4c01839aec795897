use crate::{Error, Result};

/// How the descent goes. Whatever the method, the end is undamped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// Full steps, halved where the objective would grow. For good approximate values.
    GaussNewton,
    /// Damped steps (Levenberg, Marquardt; damping after Nielsen) until they become small, then as Gauss-Newton.
    #[default]
    LevenbergMarquardt,
}

/// How to solve. The defaults solve what has an answer; change the method where good approximate values are known, and
/// the largest number of steps where time matters more than the last digit.
///
/// ```
/// use adjust::{Adjustment, Covariance, Error, LinearObservation, Method, ParameterBlock, SolveOptions};
///
/// # fn main() -> Result<(), Error> {
/// let options = SolveOptions::default();
/// assert_eq!(options.method, Method::LevenbergMarquardt);
/// assert_eq!((options.max_iterations, options.step_tolerance, options.initial_damping), (1000, 1e-8, 1e-4));
///
/// let mut a = Adjustment::new();
/// let mean = a.add_block(ParameterBlock::euclidean([0.0]));
/// let group = a.add_group("readings");
/// for reading in [4.1, 3.9, 4.3] {
///     a.add_observation(group, LinearObservation::new(reading, [(mean, [1.0])]), &Covariance::from_sigma(0.2))?;
/// }
/// // A linear problem needs no damping.
/// let solution = a.solve(&SolveOptions { method: Method::GaussNewton, ..SolveOptions::default() })?;
/// assert!((solution.values(mean)?[0] - 4.1).abs() < 1e-12 && solution.iterations() <= 2);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct SolveOptions {
    /// Way of descent; [`Method::LevenbergMarquardt`] by default.
    pub method: Method,
    /// Steps tried, damped and undamped, accepted or not; 1000 by default. Then comes [`Error::NotConverged`].
    pub max_iterations: usize,
    /// The iteration ends when the undamped step is shorter than this, in standard deviations (the smaller of prior-
    /// and posterior-scaled); 1e-8 by default. Positive.
    pub step_tolerance: f64,
    /// First damping factor, relative to the diagonal of the normal equations; 1e-4 by default. Positive; for
    /// [`Method::LevenbergMarquardt`].
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
