// An operation is a few instructions; calling one would cost more than it does.
#![allow(clippy::inline_always)]

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number that a [`crate::ResidualFunction`] computes with: `f64`, or a [`crate::Dual`] from which its derivatives follow.
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
    /// Where operations are noted for the derivatives; nothing for `f64`.
    type Tape: Copy + std::fmt::Debug;

    /// The number itself.
    fn value(self) -> f64;
    /// The variable of this index: its derivative with respect to itself is one, to all others zero.
    fn variable(value: f64, index: usize, tape: Self::Tape) -> Self;
    /// `f` at this number, given the value and the slope of `f` there: for functions that are not among these.
    #[must_use]
    fn apply(self, value: f64, slope: f64) -> Self;
    /// The same for a function of several numbers.
    #[must_use]
    fn function_of<const K: usize>(numbers: [Self; K], value: f64, slopes: [f64; K]) -> Self;
    /// Angle of the direction (`x`, self), radian.
    #[must_use]
    fn atan2(self, x: Self) -> Self;

    /// Square root; not differentiable at zero.
    #[must_use]
    #[inline(always)]
    fn sqrt(self) -> Self {
        let root = self.value().sqrt();
        self.apply(root, 0.5 / root)
    }
    /// Absolute value; at zero the derivative is taken from the side of the sign.
    #[must_use]
    #[inline(always)]
    fn abs(self) -> Self {
        self.apply(self.value().abs(), 1.0_f64.copysign(self.value()))
    }
    /// Exponential function.
    #[must_use]
    #[inline(always)]
    fn exp(self) -> Self {
        let value = self.value().exp();
        self.apply(value, value)
    }
    /// Natural logarithm.
    #[must_use]
    #[inline(always)]
    fn ln(self) -> Self {
        self.apply(self.value().ln(), 1.0 / self.value())
    }
    /// Whole power.
    #[must_use]
    #[inline(always)]
    fn powi(self, power: i32) -> Self {
        let slope = if power == 0 { 0.0 } else { f64::from(power) * self.value().powi(power - 1) };
        self.apply(self.value().powi(power), slope)
    }
    /// Power with a constant exponent; one that is itself estimated is `(x.ln() * p).exp()`.
    #[must_use]
    #[inline(always)]
    fn powf(self, power: f64) -> Self {
        let slope = if power == 0.0 { 0.0 } else { power * self.value().powf(power - 1.0) };
        self.apply(self.value().powf(power), slope)
    }
    /// Sine of an angle, radian.
    #[must_use]
    #[inline(always)]
    fn sin(self) -> Self {
        let (sine, cosine) = self.value().sin_cos();
        self.apply(sine, cosine)
    }
    /// Cosine of an angle, radian.
    #[must_use]
    #[inline(always)]
    fn cos(self) -> Self {
        let (sine, cosine) = self.value().sin_cos();
        self.apply(cosine, -sine)
    }
    /// Tangent of an angle, radian.
    #[must_use]
    #[inline(always)]
    fn tan(self) -> Self {
        let value = self.value().tan();
        self.apply(value, 1.0 + value * value)
    }
    /// Arc sine, radian.
    #[must_use]
    #[inline(always)]
    fn asin(self) -> Self {
        self.apply(self.value().asin(), 1.0 / ((1.0 - self.value()) * (1.0 + self.value())).sqrt())
    }
    /// Arc cosine, radian.
    #[must_use]
    #[inline(always)]
    fn acos(self) -> Self {
        self.apply(self.value().acos(), -1.0 / ((1.0 - self.value()) * (1.0 + self.value())).sqrt())
    }
    /// Arc tangent, radian.
    #[must_use]
    #[inline(always)]
    fn atan(self) -> Self {
        self.apply(self.value().atan(), 1.0 / (1.0 + self.value() * self.value()))
    }
    /// Hyperbolic tangent.
    #[must_use]
    #[inline(always)]
    fn tanh(self) -> Self {
        let value = self.value().tanh();
        self.apply(value, (1.0 - value) * (1.0 + value))
    }
}

impl Real for f64 {
    type Tape = ();

    #[inline(always)]
    fn value(self) -> f64 {
        self
    }
    #[inline(always)]
    fn variable(value: f64, _index: usize, (): ()) -> Self {
        value
    }
    #[inline(always)]
    fn apply(self, value: f64, _slope: f64) -> Self {
        value
    }
    #[inline(always)]
    fn function_of<const K: usize>(_numbers: [Self; K], value: f64, _slopes: [f64; K]) -> Self {
        value
    }
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        f64::atan2(self, x)
    }
}
