//! Legendre polynomials along the sides of a frame.

/// Largest degree of the polynomials. Higher ones reach poses less (a tenth of the second degree on frames of a Kinect).
pub(crate) const DEGREE: usize = 4;

/// Polynomials up to the largest degree at so many places side by side.
pub(crate) fn legendre_along(size: usize) -> Vec<[f64; DEGREE + 1]> {
    (0..size).map(|index| legendre((2 * index + 1) as f64 / size as f64 - 1.0)).collect()
}

/// Legendre polynomials of mean square 1 over -1 to 1.
fn legendre(x: f64) -> [f64; DEGREE + 1] {
    let mut values = [1.0; DEGREE + 1];
    values[1] = x;
    for n in 1..DEGREE {
        let k = n as f64;
        values[n + 1] = ((2.0 * k + 1.0) * x * values[n] - k * values[n - 1]) / (k + 1.0);
    }
    for (n, value) in values.iter_mut().enumerate() {
        *value *= (2.0 * n as f64 + 1.0).sqrt();
    }
    values
}
