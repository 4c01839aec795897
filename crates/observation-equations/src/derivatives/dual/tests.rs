#![allow(clippy::unwrap_used, clippy::float_cmp)]
use super::*;
use approx::assert_relative_eq;

/// Roundings of a few operations on numbers of order one.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Values of a function and, for each variable, its derivatives; from memory that was used before.
fn derivatives<const D: usize>(
    at: &[f64],
    function: impl for<'t> Fn(&[Dual<'t>]) -> [Dual<'t>; D],
) -> ([f64; D], Vec<[f64; D]>) {
    let (mut memory, mut out) = (TapeMemory::default(), Vec::new());
    let mut values = [0.0; D];
    for _ in 0..2 {
        let found: Result<_, ()> = memory.differentiate(
            at.len(),
            |tape| {
                let variables: Vec<Dual<'_>> =
                    at.iter().enumerate().map(|(index, &value)| Dual::variable(value, index, tape)).collect();
                Ok(function(&variables))
            },
            |found| out = found.to_vec(),
        );
        values = found.unwrap();
    }
    assert!(memory.derivatives.iter().all(|d| *d == 0.0));
    (values, out)
}

#[test]
fn functions_and_their_inverses_cancel() {
    type Function = for<'t> fn(Dual<'t>) -> Dual<'t>;
    let same: [Function; 11] = [
        |x| x.exp().ln(),
        |x| x.sin().asin(),
        |x| (x + 1.5).cos().acos() - 1.5,
        |x| x.tan().atan(),
        |x| (x.sin() * 3.0).atan2(x.cos() * 3.0),
        |x| (x + 2.0).powi(3).powf(1.0 / 3.0) - 2.0,
        |x| (x + 2.0).sqrt().powi(2) - 2.0,
        |x| x * x / x,
        |x| -((x / 4.0 - 1.0) * -4.0 - 4.0),
        |x| Dual::from(1.0) / (Dual::from(1.0) / x),
        |x| Dual::from(2.0) - (Dual::from(2.0) - x),
    ];
    for value in [-0.93, -0.4, 0.05, 0.3, 0.8] {
        for function in same {
            let (found, slopes) = derivatives(&[7.0, value], |x| [function(x[1])]);
            assert_relative_eq!(found[0], value, max_relative = ROUNDING);
            assert_relative_eq!(slopes[1][0], 1.0, max_relative = ROUNDING);
            assert_eq!(slopes[0][0], 0.0);
        }
        let (found, slopes) = derivatives(&[value], |x| {
            let e = (x[0] * 2.0).exp();
            [x[0].tanh(), (e - 1.0) / (e + 1.0), x[0].abs()]
        });
        assert_relative_eq!(found[0], found[1], max_relative = 1e-13);
        assert_relative_eq!(slopes[0][0], slopes[0][1], max_relative = 1e-13);
        assert_eq!(slopes[0][2], value.signum());
    }
}

#[test]
fn constants_have_no_derivative() {
    let (values, slopes) = derivatives(&[3.0], |x| [Dual::from(0.0).powi(0), Dual::from(4.0), x[0]]);
    assert_eq!((values, slopes), ([1.0, 4.0, 3.0], vec![[0.0, 0.0, 1.0]]));
}

#[test]
fn ways_that_part_and_meet_add_up() {
    // u = xy, f = u² + u x, g = u / x, h = atan2(u, x + y): each variable is reached along several ways.
    let (x, y) = (1.3, -0.7);
    let (values, slopes) = derivatives(&[x, y], |v| {
        let (x, y) = (v[0], v[1]);
        let u = x * y;
        [u * u + u * x, u / x, u.atan2(x + y)]
    });
    let square = (x * y).powi(2) + (x + y).powi(2);
    let expected = [
        [2.0 * x * y * y + 2.0 * x * y, 0.0, (y * (x + y) - x * y) / square],
        [2.0 * x * x * y + x * x, 1.0, (x * (x + y) - x * y) / square],
    ];
    assert_relative_eq!(values[1], y, max_relative = ROUNDING);
    for (found, expected) in slopes.iter().flatten().zip(expected.iter().flatten()) {
        assert_relative_eq!(found, expected, epsilon = ROUNDING);
    }
}

#[test]
fn a_function_of_several_numbers_has_the_slopes_given() {
    let (values, slopes) = derivatives(&[2.0, 3.0], |x| {
        let sum = x[0] + x[1] * 2.0;
        // 5 x y s with s = x + 2y, among them a constant.
        let numbers = [x[0], x[1] * 1.0, sum, Dual::from(5.0)];
        [Dual::function_of(numbers, 240.0, [120.0, 80.0, 30.0, 48.0]), Dual::function_of([Dual::from(1.0)], 1.0, [1.0])]
    });
    assert_eq!((values, slopes), ([240.0, 1.0], vec![[150.0, 0.0], [140.0, 0.0]]));
    let (_, slopes) = derivatives(&[2.0], |x| [Dual::function_of([x[0], Dual::from(0.0)], 2.0, [1.0, f64::INFINITY])]);
    assert_eq!(slopes, [[1.0]]);
}

#[test]
fn what_is_not_used_does_not_disturb() {
    // The root has no derivative at zero, and is left.
    let (values, slopes) = derivatives(&[0.0, 2.0], |x| {
        let _ = x[0].sqrt() + x[1];
        let _ = Dual::function_of([x[0]], 0.0, [f64::INFINITY]);
        [x[0] + x[1]]
    });
    assert_eq!((values, slopes), ([2.0], vec![[1.0], [1.0]]));
}
