//! Legendre polynomials on a span: bounded by 1, and with mean zero over the span from order 1 on, so that they leave
//! the offset d0 alone.

/// Highest order used anywhere.
pub(crate) const MOST_ORDER: usize = 8;

/// Values and derivatives of all orders at one place.
pub(crate) struct Legendre {
    pub(crate) value: [f64; MOST_ORDER + 1],
    pub(crate) derivative: [f64; MOST_ORDER + 1],
}

impl Legendre {
    /// The polynomials at a position in a span. Beyond its ends they stay as they are there; derivatives vanish.
    pub(crate) fn on_span([low, high]: [f64; 2], position: f64) -> Self {
        let t = reduced([low, high], position);
        let mut polynomials = Self::at(t.clamp(-1.0, 1.0));
        let slope = if t.abs() > 1.0 { 0.0 } else { 2.0 / (high - low) };
        polynomials.derivative = polynomials.derivative.map(|derivative| derivative * slope);
        polynomials
    }

    /// Bonnet's recursion.
    fn at(t: f64) -> Self {
        let mut value = [1.0; MOST_ORDER + 1];
        let mut derivative = [0.0; MOST_ORDER + 1];
        (value[1], derivative[1]) = (t, 1.0);
        for order in 2..=MOST_ORDER {
            let k = order as f64;
            value[order] = ((2.0 * k - 1.0) * t * value[order - 1] - (k - 1.0) * value[order - 2]) / k;
            derivative[order] = derivative[order - 2] + (2.0 * k - 1.0) * value[order - 1];
        }
        Self { value, derivative }
    }
}

/// A position in a span as a number from -1 to 1.
pub(crate) fn reduced([low, high]: [f64; 2], position: f64) -> f64 {
    (2.0 * position - low - high) / (high - low)
}

/// The coefficients of `t^0, t^1, ..` of a series `sum c_k P_k(t)`.
pub(crate) fn powers(series: &[f64; MOST_ORDER + 1]) -> [f64; MOST_ORDER + 1] {
    let mut polynomials = [[0.0; MOST_ORDER + 1]; MOST_ORDER + 1];
    (polynomials[0][0], polynomials[1][1]) = (1.0, 1.0);
    for order in 2..=MOST_ORDER {
        let k = order as f64;
        for power in 0..=order {
            let raised = if power > 0 { polynomials[order - 1][power - 1] } else { 0.0 };
            polynomials[order][power] = ((2.0 * k - 1.0) * raised - (k - 1.0) * polynomials[order - 2][power]) / k;
        }
    }
    std::array::from_fn(|power| series.iter().zip(&polynomials).map(|(c, polynomial)| c * polynomial[power]).sum())
}
