use crate::evaluation::Want;
use crate::iteration::{Ending, Iteration};
use crate::normal::Singular;
use crate::system::SystemFactor;
use crate::{Result, StepKind};

/// Radius below which no step is left, relative to the Gauss-Newton step.
const SMALLEST_RADIUS: f64 = 1e-20;

/// The two ends of the dog-leg, and their lengths in units of the metric.
struct Legs {
    /// The lowest point along the steepest descent; with the user's constraints along what they leave of it, from the step
    /// that fulfils them at the least cost.
    first: Vec<f64>,
    /// The Gauss-Newton step.
    last: Vec<f64>,
}

impl Iteration<'_, '_> {
    /// Steps within a region of trust until the ending. False where no step reduces the objective any more.
    pub(crate) fn follow_dog_leg(&mut self, ending: &Ending) -> Result<bool> {
        loop {
            let legs = self.legs()?;
            let whole = self.metric_length(&legs.last);
            if !self.radius.is_finite() {
                self.radius = whole;
            }
            let merit = self.merit(&self.current);
            loop {
                self.check_budget()?;
                let step = self.on_dog_leg(&legs);
                let (expected, length) = self.expect(&step);
                if expected <= 1e-15 * merit {
                    return Ok(true);
                }
                let own = self.metric_length(&step);
                let trial = self.try_step(&step, 1.0, Want::Jacobians);
                let gain = trial.map_or(f64::NEG_INFINITY, |trial| (merit - trial) / expected);
                if gain.is_nan() || gain <= 1e-4 {
                    self.record(StepKind::Rejected, length, 0.0, 1.0);
                    self.radius = 0.25 * own;
                    if self.radius.is_nan() || self.radius <= SMALLEST_RADIUS * whole.max(1.0) {
                        self.radius = f64::INFINITY;
                        return Ok(false);
                    }
                    continue;
                }
                self.accept(false)?;
                self.record(StepKind::Trusted, length, 0.0, 1.0);
                self.radius = match gain {
                    gain if gain < 0.25 => 0.5 * own,
                    gain if gain > 0.75 => self.radius.max(3.0 * own),
                    _ => self.radius,
                };
                if ending.is_reached(merit, expected, gain, self.layout.rows) {
                    return Ok(true);
                }
                break;
            }
        }
    }

    fn legs(&mut self) -> Result<Legs> {
        // Where the unknowns are not determined at these values, a trace of damping stands in.
        let mut lambda = 0.0;
        loop {
            let damping = (lambda > 0.0).then_some((lambda, self.metric.as_slice()));
            match self.system.factor(&self.constraints, damping) {
                Err(Singular::Constraints(error)) => return Err(error),
                Ok(factor) => {
                    let last = factor.solve(&self.gradient, 1.0);
                    if last.iter().all(|dx| dx.is_finite()) || lambda > 1.0 {
                        return Ok(Legs { first: self.first_leg(&factor), last });
                    }
                }
                Err(Singular::Normal) if lambda > 1.0 => {
                    let zero = vec![0.0; self.gradient.len()];
                    return Ok(Legs { first: zero.clone(), last: zero });
                }
                Err(Singular::Normal) => {}
            }
            lambda = (10.0 * lambda).max(1e-12);
        }
    }

    fn first_leg(&mut self, factor: &SystemFactor) -> Vec<f64> {
        let mut leg = vec![0.0; self.gradient.len()];
        let mut down = self.gradient.clone();
        if self.constraints.first_inner > 0 {
            leg = factor.solve(&leg, 1.0);
            self.current.apply(self.layout, &leg, &mut self.moved);
            let followed = self.current.transpose_apply(self.layout, &self.moved);
            down.iter_mut().zip(followed).for_each(|(g, followed)| *g -= followed);
        }
        // Steepest descent in units of the metric, without what constraints and datum hold.
        down.iter_mut().zip(&self.metric).for_each(|(g, m)| *g *= m);
        for row in orthonormal(&self.constraints.scaled(&self.metric).rows, self.metric.len()) {
            subtract_shared(&mut down, &row);
        }
        let slope = dot(&down, &down);
        down.iter_mut().zip(&self.metric).for_each(|(y, m)| *y *= m);
        self.current.apply(self.layout, &down, &mut self.moved);
        let curvature: f64 = self.moved.iter().zip(&self.current.weights).map(|(m, w)| w * m * m).sum();
        let share = if curvature > 0.0 { slope / curvature } else { 0.0 };
        leg.iter_mut().zip(&down).for_each(|(dx, y)| *dx += share * y);
        leg
    }

    /// The last point of the path within the radius.
    fn on_dog_leg(&self, legs: &Legs) -> Vec<f64> {
        let (first, last) = (self.metric_length(&legs.first), self.metric_length(&legs.last));
        if last <= self.radius {
            return legs.last.clone();
        }
        if first >= self.radius {
            return legs.first.iter().map(|dx| dx * self.radius / first).collect();
        }
        let leg: Vec<f64> = legs.last.iter().zip(&legs.first).map(|(b, a)| b - a).collect();
        let square = self.metric_length(&leg).powi(2);
        let mixed: f64 = leg.iter().zip(&legs.first).zip(&self.metric).map(|((l, a), m)| l * a / (m * m)).sum();
        // |a + τ l| = radius; the form without cancellation for either sign of the mixed term.
        let rest = (self.radius - first) * (self.radius + first);
        let root = (mixed * mixed + square * rest).max(0.0).sqrt();
        let share = if mixed > 0.0 { rest / (mixed + root) } else { (root - mixed) / square };
        legs.first.iter().zip(&leg).map(|(a, l)| a + share.clamp(0.0, 1.0) * l).collect()
    }

    fn metric_length(&self, step: &[f64]) -> f64 {
        step.iter().zip(&self.metric).map(|(dx, m)| (dx / m).powi(2)).sum::<f64>().sqrt()
    }
}

/// Orthonormal directions that span the rows. A row that depends on those before it gives none.
fn orthonormal(rows: &[f64], length: usize) -> Vec<Vec<f64>> {
    let mut out: Vec<Vec<f64>> = Vec::new();
    for row in rows.chunks_exact(length.max(1)) {
        let mut row = row.to_vec();
        // Twice is enough (Kahan, Parlett).
        for other in out.iter().chain(&out) {
            subtract_shared(&mut row, other);
        }
        let norm = dot(&row, &row).sqrt();
        // Rows are of unit length: below this angle to the rows before, nothing new is held (as for the normal equations).
        if norm > 1e-5 {
            for b in &mut row {
                *b /= norm;
            }
            out.push(row);
        }
    }
    out
}

/// Takes away what a vector shares with one of unit length.
fn subtract_shared(vector: &mut [f64], unit: &[f64]) {
    let shared = dot(vector, unit);
    vector.iter_mut().zip(unit).for_each(|(x, u)| *x -= shared * u);
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
