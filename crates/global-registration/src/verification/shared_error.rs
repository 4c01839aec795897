//! The error that neighbouring points share, told by the residuals of a pose, and what it does to the pose and to counts.
//!
//! Distances between two surfaces have a random part and one whose correlation falls as `exp(-d / length)` with the distance d
//! of the points. Both variances follow from two quadratic forms of the residuals that are unbiased with the pose taken off
//! `[Rao1971]`; of the lengths, halved from the radius down to a voxel, that counts whose form exceeds chance most.

use nalgebra::{Matrix6, Vector3, Vector6};
use rigid_pose::symmetrised;
use statistics::{Distribution, bonferroni};

use crate::options::SharedError;

/// A distance between the surfaces.
pub(crate) struct Residual {
    /// Target frame about its middle, metre.
    pub(crate) place: Vector3<f64>,
    /// By motions of the pose.
    pub(crate) derivative: Vector6<f64>,
    /// Metre.
    pub(crate) distance: f64,
}

/// What residuals say.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Errors {
    pub(crate) shared: SharedError,
    /// Residuals that err like one.
    pub(crate) together: f64,
    /// Covariance of the motion, metre², without those that are not determined.
    pub(crate) covariance: Matrix6<f64>,
}

/// Sums over pairs of residuals with the correlations of one length.
struct Forms {
    length_m: f64,
    /// Of the correlations, the diagonal included.
    sum: f64,
    /// Of motions: `J' R J`.
    motions: Matrix6<f64>,
    /// Expectations of `e' R e` for random and for shared errors of variance 1, and its value.
    of_random: f64,
    of_shared: f64,
    value: f64,
}

/// `inverse`: of the residuals' normal equations, zero along motions that are not determined, `freedom` of them less than the
/// residuals; each residual stands for `stands_for` that were measured. `level`: at which chance alone tells a shared error.
/// `None` where there are too few.
pub(crate) fn errors(
    residuals: &[Residual],
    inverse: &Matrix6<f64>,
    lengths: std::ops::Range<f64>,
    given: Option<SharedError>,
    stands_for: f64,
    level: f64,
) -> Option<Errors> {
    let count = residuals.len() as f64;
    let freedom = count - 6.0;
    if freedom < 1.0 {
        return None;
    }
    let gradient: Vector6<f64> = residuals.iter().map(|r| r.derivative * r.distance).sum();
    let step = inverse * gradient;
    let left: Vec<f64> = residuals.iter().map(|r| r.distance - r.derivative.dot(&step)).collect();
    let squares: f64 = left.iter().map(|e| e * e).sum();
    let (random, shared, forms) = if let Some(shared) = given {
        let forms = Forms::new(residuals, &left, inverse, shared.length_m);
        ((squares - shared.sigma_m.powi(2) * forms.of_random) / freedom, shared.sigma_m.powi(2), forms)
    } else {
        let halved = std::iter::successors(Some(lengths.end), |length| Some(0.5 * length));
        let tried: Vec<f64> = halved.take_while(|length| *length >= lengths.start).collect();
        let limit = Distribution::Normal.upper_quantile(bonferroni(level, tried.len().max(1)));
        let all = tried.iter().map(|length| Forms::new(residuals, &left, inverse, *length));
        let scored = all.map(|forms| (forms.excess(squares, freedom), forms));
        let (excess, forms) = scored.max_by(|a, b| a.0.total_cmp(&b.0))?;
        let determinant = freedom * forms.of_shared - forms.of_random.powi(2);
        let shared = (freedom * forms.value - forms.of_random * squares) / determinant;
        // What is no number stands out of nothing.
        let shared = if excess > limit && shared > 0.0 { shared } else { 0.0 };
        ((squares - shared * forms.of_random) / freedom, shared, forms)
    };
    let random = random.max(0.0);
    let share = shared / (random + shared).max(f64::MIN_POSITIVE);
    let of_shared = inverse * forms.motions * inverse;
    Some(Errors {
        shared: SharedError { sigma_m: shared.sqrt(), length_m: forms.length_m },
        together: 1.0 + share * stands_for * (forms.sum / count - 1.0),
        covariance: symmetrised(&(inverse * (random / stands_for) + of_shared * shared)),
    })
}

impl Forms {
    fn new(residuals: &[Residual], left: &[f64], inverse: &Matrix6<f64>, length_m: f64) -> Self {
        let count = residuals.len();
        let mut correlated: Vec<Vector6<f64>> = residuals.iter().map(|r| r.derivative).collect();
        let (mut sum, mut squares, mut value) = (count as f64, count as f64, left.iter().map(|e| e * e).sum());
        for i in 1..count {
            for j in 0..i {
                let correlation = (-(residuals[i].place - residuals[j].place).norm() / length_m).exp();
                correlated[i] += residuals[j].derivative * correlation;
                correlated[j] += residuals[i].derivative * correlation;
                sum += 2.0 * correlation;
                squares += 2.0 * correlation * correlation;
                value += 2.0 * correlation * left[i] * left[j];
            }
        }
        let (mut motions, mut twice) = (Matrix6::zeros(), Matrix6::zeros());
        for (residual, correlated) in residuals.iter().zip(&correlated) {
            motions.ger(1.0, &residual.derivative, correlated, 1.0);
            twice.ger(1.0, correlated, correlated, 1.0);
        }
        let taken = inverse * motions;
        let of_shared = squares - 2.0 * (inverse * twice).trace() + (taken * taken).trace();
        Self { length_m, sum, motions, of_random: count as f64 - taken.trace(), of_shared, value }
    }

    /// By how many standard deviations the form exceeds what random errors alone let expect.
    fn excess(&self, squares: f64, freedom: f64) -> f64 {
        let variance = squares / freedom;
        let scatter = 2.0 * (self.of_shared - self.of_random.powi(2) / freedom).max(0.0);
        (self.value - variance * self.of_random) / (variance * scatter.sqrt()).max(f64::MIN_POSITIVE)
    }
}

/// How many of the points that should have a partner have none at a right pose.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Misses {
    /// Share.
    share: f64,
    /// Points that hit or miss like one.
    together: f64,
}

impl Misses {
    /// Where `together` points err like one, fewer exceed a limit like one: by the correlation of what is beyond the quantile
    /// of `share`, to first order.
    pub(crate) fn new(share: f64, together: f64) -> Self {
        let limit = Distribution::Normal.upper_quantile(share);
        let density = (-0.5 * limit * limit).exp() / std::f64::consts::TAU.sqrt();
        Self { share, together: 1.0 + (together - 1.0) * density * density / (share * (1.0 - share)) }
    }

    /// Standard deviation of the number that misses, of so many.
    pub(crate) fn scatter(&self, points: f64) -> f64 {
        (self.share * (1.0 - self.share) * self.together * points).sqrt()
    }

    /// Probability that at least so many of the points miss at a right pose.
    pub(crate) fn probability(&self, missed: f64, points: f64) -> f64 {
        let scatter = self.scatter(points).max(f64::MIN_POSITIVE);
        Distribution::Normal.survival((missed - self.share * points) / scatter)
    }

    /// Probability that a pose with so much more evidence than another does not fit better, at so many partners of both.
    pub(crate) fn draw(&self, lead: f64, partners: f64) -> f64 {
        Distribution::Normal.survival(lead / (self.together * partners).sqrt().max(f64::MIN_POSITIVE))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use nalgebra::Vector3;
    use rand::{Rng, SeedableRng};
    use rand_distr::{Distribution as _, StandardNormal};
    use rand_pcg::Pcg64;
    use rigid_pose::Centred;

    use super::*;

    const LENGTH_M: f64 = 0.4;

    fn normal(random: &mut impl Rng) -> f64 {
        StandardNormal.sample(random)
    }

    /// Places on three walls of a corner 2 m wide, with what they see wrongly: `random` and `shared` metre.
    fn corner(random: f64, shared: f64, seed: u64) -> Vec<Residual> {
        let mut generator = Pcg64::seed_from_u64(seed);
        // Waves whose wave numbers are distributed as the spectrum of exp(-d / length).
        let waves: Vec<(Vector3<f64>, f64)> = (0..100)
            .map(|_| {
                let number = Vector3::from_fn(|_, _| normal(&mut generator)) / normal(&mut generator).abs();
                (number / LENGTH_M, 10.0 * normal(&mut generator))
            })
            .collect();
        let frame = Centred { centre: Vector3::repeat(0.4), radius_m: 0.8 };
        let residual = |k: usize| {
            let (axis, cell) = (k / 64, k % 64);
            let mut place = Vector3::zeros();
            (place[(axis + 1) % 3], place[(axis + 2) % 3]) = (0.25 * (cell % 8) as f64, 0.25 * (cell / 8) as f64);
            let field: f64 = waves.iter().map(|(number, phase)| (number.dot(&place) + phase).cos()).sum();
            let noise = normal(&mut generator);
            let derivative = frame.derivative(&place, &Vector3::ith(axis, 1.0));
            Residual { place, derivative, distance: shared * field / 50.0_f64.sqrt() + random * noise }
        };
        (0..192).map(residual).collect()
    }

    fn inverse(residuals: &[Residual]) -> Matrix6<f64> {
        let sum = residuals.iter().fold(Matrix6::zeros(), |sum, r| sum + r.derivative * r.derivative.transpose());
        sum.try_inverse().unwrap()
    }

    #[test]
    fn variances_are_unbiased_and_the_covariance_is_that_of_many_draws() {
        const RUNS: u64 = 200;
        let (mut shared, mut square) = (0.0, 0.0);
        let known = SharedError { sigma_m: 0.02, length_m: LENGTH_M };
        for seed in 0..RUNS {
            let residuals = corner(0.01, 0.02, seed);
            let inverse = inverse(&residuals);
            let told = errors(&residuals, &inverse, 0.2..1.6, None, 1.0, 0.05).unwrap();
            shared += told.shared.sigma_m.powi(2) / RUNS as f64;
            let given = errors(&residuals, &inverse, 0.2..1.6, Some(known), 1.0, 0.05).unwrap();
            let step: Vector6<f64> =
                inverse * residuals.iter().map(|r| r.derivative * r.distance).sum::<Vector6<f64>>();
            square += step.dot(&(given.covariance.try_inverse().unwrap() * step)) / RUNS as f64;
        }
        println!("shared {:.1} of 20 mm, squared error {square:.2} of 6", 1e3 * shared.sqrt());
        assert!((0.7..1.4).contains(&(shared.sqrt() / 0.02)), "{shared}");
        // Of 200 draws: standard deviation 0.25.
        assert!((5.0..7.0).contains(&square), "{square}");
    }

    #[test]
    fn noise_alone_is_not_taken_for_a_shared_error() {
        let found = (0..100).filter(|seed| {
            let residuals = corner(0.01, 0.0, 1000 + seed);
            let told = errors(&residuals, &inverse(&residuals), 0.2..1.6, None, 1.0, 0.05).unwrap();
            told.shared.sigma_m > 0.0
        });
        let count = found.count();
        assert!(count < 14, "{count} of 100 at a level of 0.05");
    }

    #[test]
    fn exact_distances_and_few_of_them_are_no_numbers_that_look_fine() {
        let residuals = corner(0.0, 0.0, 1);
        let told = errors(&residuals, &inverse(&residuals), 0.2..1.6, None, 1.0, 0.05).unwrap();
        assert!(told.shared.sigma_m.abs() < 1e-30 && told.covariance.norm() < 1e-30);
        assert!(errors(&residuals[..6], &Matrix6::identity(), 0.2..1.6, None, 1.0, 0.05).is_none());
        // A voxel wider than the radius leaves no length to try.
        assert!(errors(&residuals, &inverse(&residuals), 1.0..0.5, None, 1.0, 0.05).is_none());
    }

    #[test]
    fn fewer_miss_together_than_err_together() {
        let (alone, together) = (Misses::new(0.05, 1.0), Misses::new(0.05, 41.0));
        assert!((alone.scatter(2000.0).powi(2) - 95.0).abs() < 1e-9);
        let ratio = together.scatter(2000.0) / alone.scatter(2000.0);
        assert!((1.5..6.4).contains(&ratio), "{ratio}");
        assert!(alone.probability(150.0, 2000.0) < 1e-6 && together.probability(150.0, 2000.0) > 0.01);
        assert!(alone.draw(0.0, 2000.0) > 0.49 && alone.draw(500.0, 2000.0) < 1e-9);
    }
}
