//! Variances against samples, and descriptions that mean nothing.

use point_uncertainty::nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use point_uncertainty::{
    CommonError, CommonErrors, Error, Gradient, PointErrors, Source, covariance, point_covariance, shares,
};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

fn error(name: &str, source: Source) -> CommonError {
    CommonError { name: name.to_owned(), source }
}

/// Six points in two neighbourhoods, two common errors.
struct Few;

impl Few {
    fn direction(point: usize) -> Vector3<f64> {
        Vector3::new(1.0, 0.3 * point as f64, -0.5).normalize()
    }

    fn derivative(point: usize, column: usize) -> Vector3<f64> {
        Vector3::new(0.2 * column as f64, 0.1 * point as f64, 1.0)
    }
}

impl PointErrors for Few {
    fn noise(&self, point: usize) -> Matrix3<f64> {
        let shift = Self::direction(point) * 0.02;
        shift * shift.transpose()
    }

    fn sensor(&self, point: usize) -> Option<(u64, Vector3<f64>)> {
        (point != 5).then(|| (point as u64 / 3, Self::direction(point) * 0.01))
    }

    fn common(&self, point: usize, derivatives: &mut Vec<(usize, Vector3<f64>)>) {
        derivatives.extend((0..2).map(|column| (column, Self::derivative(point, column))));
    }
}

fn common() -> CommonErrors {
    let errors = vec![error("d0", Source::Calibration), error("S01 dx", Source::Pose)];
    CommonErrors::new(errors, DMatrix::from_row_slice(2, 2, &[4e-6, -3e-6, -3e-6, 9e-6])).unwrap()
}

#[test]
fn variances_and_covariances_are_those_of_samples() {
    let gradients: [Gradient; 2] = [
        (0..6).map(|point| (point, Vector3::new(0.1, 0.3, -0.2 * point as f64))).collect(),
        vec![(1, Vector3::x()), (1, Vector3::y()), (4, Vector3::new(0.0, -1.0, 2.0))],
    ];
    let common = common();
    let stated = covariance(&gradients, &Few, &common);
    let found = shares(&gradients[0], &Few, &common);
    assert!((found.variance() - stated[(0, 0)]).abs() < 1e-15);
    let mut random = Pcg64::new(7, 1);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let root = common.covariance().clone().cholesky().unwrap().l();
    let runs = 40_000;
    let mut sums = DMatrix::<f64>::zeros(2, 2);
    for _ in 0..runs {
        let shared = &root * DVector::from_fn(2, |_, _| normal());
        let cells = [normal(), normal()];
        let moved: Vec<Vector3<f64>> = (0..6)
            .map(|point| {
                let cell = Few.sensor(point).map_or_else(Vector3::zeros, |(at, shift)| shift * cells[at as usize]);
                let together = Few::derivative(point, 0) * shared[0] + Few::derivative(point, 1) * shared[1];
                Few::direction(point) * (0.02 * normal()) + cell + together
            })
            .collect();
        let of = |gradient: &Gradient| -> f64 { gradient.iter().map(|(point, by)| by.dot(&moved[*point])).sum() };
        let values = DVector::from_vec(gradients.iter().map(of).collect());
        sums += &values * values.transpose();
    }
    sums /= f64::from(runs);
    for (sampled, stated) in sums.iter().zip(stated.iter()) {
        // Four deviations of 40,000 samples.
        assert!((sampled - stated).abs() < 0.03 * (stated.abs() + 1e-6), "{sampled} {stated}");
    }
}

#[test]
fn what_is_correlated_is_shared_by_halves_and_can_be_left_out() {
    let gradient: Gradient = vec![(2, Vector3::z())];
    let found = shares(&gradient, &Few, &common());
    // The point's z moves by one of each error.
    assert!((found.of(Source::Calibration) - (4e-6 - 3e-6)).abs() < 1e-12);
    assert!((found.of(Source::Pose) - (9e-6 - 3e-6)).abs() < 1e-12);
    let without = shares(&gradient, &Few, &common().without(Source::Pose));
    assert!((without.of(Source::Calibration) - 4e-6).abs() < 1e-12);
    assert_eq!(without.of(Source::Pose), 0.0);
    let point = point_covariance(2, &Few, &common());
    assert!((point[(2, 2)] - found.variance()).abs() < 1e-15);
}

#[test]
fn matrices_that_are_no_covariance_are_refused_by_name() {
    let two = || vec![error("d0", Source::Calibration), error("d2", Source::Calibration)];
    let refused = |values: [f64; 4]| CommonErrors::new(two(), DMatrix::from_row_slice(2, 2, &values)).unwrap_err();
    assert!(matches!(refused([1.0, 2.0, 2.0, 1.0]), Error::Covariance { .. }));
    assert!(matches!(refused([1.0, 0.5, 0.1, 1.0]), Error::Covariance { .. }));
    assert!(matches!(refused([1.0, 0.0, 0.0, -1.0]), Error::Covariance { .. }));
    assert!(refused([1.0, f64::NAN, f64::NAN, 1.0]).to_string().contains("`d2` and `d0`"));
    let size = CommonErrors::new(two(), DMatrix::zeros(2, 3)).unwrap_err();
    assert_eq!(size, Error::Size { errors: 2, rows: 2, columns: 3 });
    let twice = vec![error("d0", Source::Calibration), error("d0", Source::Drift)];
    let twice = CommonErrors::new(twice, DMatrix::identity(2, 2)).unwrap_err();
    assert_eq!(twice, Error::DuplicateName("d0".to_owned()));
}
