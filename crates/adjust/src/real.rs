use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number that a [`crate::ResidualFunction`] computes with: `f64`, or a [`Dual`] that carries its derivatives along.
pub trait Real:
    Copy
    + From<f64>
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
{
    /// The number itself.
    fn value(self) -> f64;
    /// The variable of this index: its derivative with respect to itself is one, to all others zero.
    fn variable(value: f64, index: usize) -> Self;
    /// `f` at this number, given the value and the slope of `f` there: for functions that are not among these.
    #[must_use]
    fn apply(self, value: f64, slope: f64) -> Self;
    /// Angle of the direction (`x`, self), radian.
    #[must_use]
    fn atan2(self, x: Self) -> Self;

    /// Square root; not differentiable at zero.
    #[must_use]
    fn sqrt(self) -> Self {
        let root = self.value().sqrt();
        self.apply(root, 0.5 / root)
    }
    /// Absolute value; at zero the derivative is taken from the side of the sign.
    #[must_use]
    fn abs(self) -> Self {
        self.apply(self.value().abs(), 1.0_f64.copysign(self.value()))
    }
    /// Exponential function.
    #[must_use]
    fn exp(self) -> Self {
        let value = self.value().exp();
        self.apply(value, value)
    }
    /// Natural logarithm.
    #[must_use]
    fn ln(self) -> Self {
        self.apply(self.value().ln(), 1.0 / self.value())
    }
    /// Whole power.
    #[must_use]
    fn powi(self, power: i32) -> Self {
        let slope = if power == 0 { 0.0 } else { f64::from(power) * self.value().powi(power - 1) };
        self.apply(self.value().powi(power), slope)
    }
    /// Power with a constant exponent; one that is itself estimated is `(x.ln() * p).exp()`.
    #[must_use]
    fn powf(self, power: f64) -> Self {
        let slope = if power == 0.0 { 0.0 } else { power * self.value().powf(power - 1.0) };
        self.apply(self.value().powf(power), slope)
    }
    /// Sine of an angle, radian.
    #[must_use]
    fn sin(self) -> Self {
        let (sine, cosine) = self.value().sin_cos();
        self.apply(sine, cosine)
    }
    /// Cosine of an angle, radian.
    #[must_use]
    fn cos(self) -> Self {
        let (sine, cosine) = self.value().sin_cos();
        self.apply(cosine, -sine)
    }
    /// Tangent of an angle, radian.
    #[must_use]
    fn tan(self) -> Self {
        let value = self.value().tan();
        self.apply(value, 1.0 + value * value)
    }
    /// Arc sine, radian.
    #[must_use]
    fn asin(self) -> Self {
        self.apply(self.value().asin(), 1.0 / ((1.0 - self.value()) * (1.0 + self.value())).sqrt())
    }
    /// Arc cosine, radian.
    #[must_use]
    fn acos(self) -> Self {
        self.apply(self.value().acos(), -1.0 / ((1.0 - self.value()) * (1.0 + self.value())).sqrt())
    }
    /// Arc tangent, radian.
    #[must_use]
    fn atan(self) -> Self {
        self.apply(self.value().atan(), 1.0 / (1.0 + self.value() * self.value()))
    }
    /// Hyperbolic tangent.
    #[must_use]
    fn tanh(self) -> Self {
        let value = self.value().tanh();
        self.apply(value, (1.0 - value) * (1.0 + value))
    }
}

impl Real for f64 {
    fn value(self) -> f64 {
        self
    }
    fn variable(value: f64, _index: usize) -> Self {
        value
    }
    fn apply(self, value: f64, _slope: f64) -> Self {
        value
    }
    fn atan2(self, x: Self) -> Self {
        f64::atan2(self, x)
    }
}

/// A dual number: a value and its derivatives with respect to `N` variables, exact to rounding.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dual<const N: usize> {
    /// The value.
    pub value: f64,
    /// Its derivatives.
    pub derivatives: [f64; N],
}

impl<const N: usize> Dual<N> {
    #[inline]
    fn combine(self, other: Self, value: f64, own: f64, others: f64) -> Self {
        let derivative = |i: usize| own * self.derivatives[i] + others * other.derivatives[i];
        Self { value, derivatives: std::array::from_fn(derivative) }
    }
}

impl<const N: usize> From<f64> for Dual<N> {
    fn from(value: f64) -> Self {
        Self { value, derivatives: [0.0; N] }
    }
}

impl<const N: usize> Real for Dual<N> {
    #[inline]
    fn value(self) -> f64 {
        self.value
    }
    #[inline]
    fn variable(value: f64, index: usize) -> Self {
        let mut out = Self::from(value);
        if let Some(own) = out.derivatives.get_mut(index) {
            *own = 1.0;
        }
        out
    }
    #[inline]
    fn apply(self, value: f64, slope: f64) -> Self {
        Self { value, derivatives: self.derivatives.map(|d| slope * d) }
    }
    #[inline]
    fn atan2(self, x: Self) -> Self {
        let square = x.value * x.value + self.value * self.value;
        self.combine(x, self.value.atan2(x.value), x.value / square, -self.value / square)
    }
}

/// Sums, differences, products and quotients of two dual numbers, and of one with a constant.
macro_rules! operator {
    ($trait:ident, $method:ident, |$a:ident, $b:ident| $value:expr, $own:expr, $others:expr) => {
        impl<const N: usize> $trait for Dual<N> {
            type Output = Self;
            #[inline]
            fn $method(self, other: Self) -> Self {
                let ($a, $b) = (self.value, other.value);
                self.combine(other, $value, $own, $others)
            }
        }
        impl<const N: usize> $trait<f64> for Dual<N> {
            type Output = Self;
            #[inline]
            fn $method(self, $b: f64) -> Self {
                let $a = self.value;
                self.apply($value, $own)
            }
        }
    };
}
operator!(Add, add, |a, b| a + b, 1.0, 1.0);
operator!(Sub, sub, |a, b| a - b, 1.0, -1.0);
operator!(Mul, mul, |a, b| a * b, b, a);
operator!(Div, div, |a, b| a / b, 1.0 / b, -a / b / b);

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        self.apply(-self.value, -1.0)
    }
}
