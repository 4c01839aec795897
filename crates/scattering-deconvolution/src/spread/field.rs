use crate::{Error, Result};

/// A polynomial of second degree over the image, not negative inside it:
/// `constant + linear[0] x + linear[1] y + quadratic[0] x² + quadratic[1] x y + quadratic[2] y²`.
///
/// The normalised coordinates have their origin at the middle of the image, x to the right, y up, and are -1 and 1 at
/// the outer edges of the first and last pixels: `x = (2 col + 1 - W) / W`, `y = (H - 1 - 2 row) / H`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct FieldPolynomial {
    /// Value in the middle of the image.
    pub constant: f64,
    /// Factors of x and y.
    #[cfg_attr(feature = "serde", serde(default))]
    pub linear: [f64; 2],
    /// Factors of x², x y and y².
    #[cfg_attr(feature = "serde", serde(default))]
    pub quadratic: [f64; 3],
}

impl Default for FieldPolynomial {
    /// One everywhere.
    fn default() -> Self {
        Self { constant: 1.0, linear: [0.0; 2], quadratic: [0.0; 3] }
    }
}

/// A rounding that a polynomial which touches zero may be below it, relative to the sum of its coefficients' moduli.
const ROUNDING: f64 = 1e-12;

impl FieldPolynomial {
    /// Value at normalised coordinates.
    pub fn value(&self, [x, y]: [f64; 2]) -> f64 {
        let ([lx, ly], [xx, xy, yy]) = (self.linear, self.quadratic);
        self.constant + lx * x + ly * y + xx * x * x + xy * x * y + yy * y * y
    }

    /// Smallest and largest value over the image: at a corner, at the summit along an edge, or at a flat place inside.
    pub fn extremes(&self) -> [f64; 2] {
        let ([lx, ly], [xx, xy, yy]) = (self.linear, self.quadratic);
        let mut places = Vec::with_capacity(9);
        for edge in [-1.0, 1.0] {
            places.extend([[edge, -1.0], [edge, 1.0]]);
            places.extend(summit(ly + xy * edge, yy).map(|y| [edge, y]));
            places.extend(summit(lx + xy * edge, xx).map(|x| [x, edge]));
        }
        let determinant = 4.0 * xx * yy - xy * xy;
        let inside = [(xy * ly - 2.0 * yy * lx) / determinant, (xy * lx - 2.0 * xx * ly) / determinant];
        places.extend(inside.iter().all(|value| value.abs() <= 1.0).then_some(inside));
        let values = places.into_iter().map(|place| self.value(place));
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)])
    }

    pub(crate) fn validate(&self, name: &'static str) -> Result<()> {
        let coefficients = [self.constant].into_iter().chain(self.linear).chain(self.quadratic);
        let size: f64 = coefficients.map(f64::abs).sum();
        if !size.is_finite() {
            let expected = "the coefficients of a polynomial over the field are finite";
            return Err(Error::OutOfDomain { name, value: size, expected });
        }
        let [lowest, _] = self.extremes();
        if lowest < -ROUNDING * size {
            let expected = "a polynomial over the field is nowhere negative inside the image";
            return Err(Error::OutOfDomain { name, value: lowest, expected });
        }
        Ok(())
    }
}

/// Where `linear t + quadratic t²` is flat inside [-1, 1].
fn summit(linear: f64, quadratic: f64) -> Option<f64> {
    let place = -linear / (2.0 * quadratic);
    (place.abs() <= 1.0).then_some(place)
}

/// Mean over the image, exact for products of four polynomials of second degree: five nodes of Gauss and Legendre a side.
pub(crate) fn mean(value: impl Fn([f64; 2]) -> f64) -> f64 {
    let (root, small) = ((10.0_f64 / 7.0).sqrt(), 13.0 * 70.0_f64.sqrt());
    let [inner, outer] = [5.0 - 2.0 * root, 5.0 + 2.0 * root].map(|square| square.sqrt() / 3.0);
    let [weight_inner, weight_outer] = [(322.0 + small) / 1800.0, (322.0 - small) / 1800.0];
    let nodes = [
        (-outer, weight_outer),
        (-inner, weight_inner),
        (0.0, 64.0 / 225.0),
        (inner, weight_inner),
        (outer, weight_outer),
    ];
    let row = |(y, weight): &(f64, f64)| weight * nodes.iter().map(|(x, share)| share * value([*x, *y])).sum::<f64>();
    nodes.iter().map(row).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extremes_are_those_of_a_dense_grid() {
        let cases = [
            ([1.0, 0.3, -0.2], [0.1, 0.5, -0.4]),
            ([0.0, 0.0, 0.0], [1.0, 0.2, 2.0]),
            ([2.0, 0.0, 0.0], [-1.0, 0.0, -1.0]),
            ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
            ([0.5, 0.4, 0.0], [0.0, 0.0, 0.0]),
            ([0.7, 0.1, 0.9], [0.5, 0.3, 0.6]),
        ];
        for ([constant, lx, ly], quadratic) in cases {
            let polynomial = FieldPolynomial { constant, linear: [lx, ly], quadratic };
            let at = |i: i32| f64::from(i) / 200.0;
            let values = (-200..=200).flat_map(|i| (-200..=200).map(move |j| polynomial.value([at(i), at(j)])));
            let (low, high) = values.fold((9.0_f64, -9.0_f64), |(a, b), value| (a.min(value), b.max(value)));
            let [lowest, highest] = polynomial.extremes();
            // The grid misses a summit by at most half its step: 2 · 0.0025² · 2.
            assert!(lowest <= low + 1e-12 && lowest > low - 3e-5, "{polynomial:?}: {lowest} {low}");
            assert!(highest >= high - 1e-12 && highest < high + 3e-5, "{polynomial:?}: {highest} {high}");
        }
    }

    #[test]
    fn means_of_products_are_exact() {
        // ∫ x² y² over the square is 4/9, divided by its area 1/9; x⁸ gives 1/9.
        assert!((mean(|[x, y]| x * x * y * y) - 1.0 / 9.0).abs() < 1e-15);
        assert!((mean(|[x, _]| x.powi(8)) - 1.0 / 9.0).abs() < 1e-15);
        assert!(mean(|[x, y]| x * y * y + x).abs() < 1e-15);
    }
}
