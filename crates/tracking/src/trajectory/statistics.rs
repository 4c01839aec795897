/// Statistics of errors, which are lengths or angles and so not negative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorStatistics {
    /// Number of errors.
    pub count: usize,
    /// Root mean square.
    pub rms: f64,
    /// Arithmetic mean.
    pub mean: f64,
    /// Median; of an even number the mean of the middle two.
    pub median: f64,
    /// Standard deviation about the mean, divided by the number.
    pub standard_deviation: f64,
    /// Smallest.
    pub min: f64,
    /// Largest.
    pub max: f64,
}

impl ErrorStatistics {
    /// Statistics of errors that are finite; `None` without any.
    pub(super) fn of(errors: impl Iterator<Item = f64>) -> Option<Self> {
        let mut errors: Vec<f64> = errors.collect();
        errors.sort_by(f64::total_cmp);
        let (&min, &max) = (errors.first()?, errors.last()?);
        let count = errors.len();
        let n = count as f64;
        let mean = errors.iter().sum::<f64>() / n;
        let square = |about: f64| errors.iter().map(|error| (error - about).powi(2)).sum::<f64>() / n;
        Some(Self {
            count,
            rms: square(0.0).sqrt(),
            mean,
            median: f64::midpoint(errors[(count - 1) / 2], errors[count / 2]),
            standard_deviation: square(mean).sqrt(),
            min,
            max,
        })
    }
}
