//! What derivatives by dual numbers cost, in a self-calibration and in a small fit, beside Jacobians derived by hand.
#![allow(missing_docs, clippy::unwrap_used)]

#[path = "../tests/common/differentiated_camera.rs"]
mod differentiated_camera;
#[path = "../tests/common/range_camera.rs"]
#[allow(dead_code)]
mod range_camera;

use adjust::{
    Adjustment, Covariance, Differentiated, EvaluationFailure, FunctionObservation, ParameterBlock, Parameters, Real,
    ResidualFunction, SolveOptions,
};
use criterion::{Criterion, criterion_group, criterion_main};
use range_camera::{LABORATORY, range_camera_network};

/// Two decaying sums: `v = y − b0 e^(−b1 t) − b2 e^(−b3 t)`.
struct Decay {
    t: f64,
    y: f64,
}

impl ResidualFunction<1> for Decay {
    fn residual<T: Real>(&self, parameters: &Parameters<'_, T>) -> Result<[T; 1], EvaluationFailure> {
        let b: [T; 4] = parameters.values(0)?;
        Ok([-(b[0] * (-b[1] * self.t).exp() + b[2] * (-b[3] * self.t).exp()) + self.y])
    }
}

fn decay(by_hand: bool) -> Adjustment<'static> {
    let mut a = Adjustment::new();
    let block = a.add_block(ParameterBlock::euclidean([1.0, 0.3, 1.0, 2.0]));
    let group = a.add_group("activities");
    for i in 0..200 {
        let t = 0.02 * f64::from(i);
        let y = 2.0 * (-0.5 * t).exp() + 3.0 * (-3.0 * t).exp() + 0.01 * (50.0 * t).sin();
        let covariance = Covariance::from_sigma(0.01);
        if by_hand {
            let function =
                move |parameters: &[&[f64]], residual: &mut [f64], jacobians: Option<&mut adjust::Jacobians<'_>>| {
                    let b = parameters[0];
                    let (first, second) = ((-b[1] * t).exp(), (-b[3] * t).exp());
                    residual[0] = y - b[0] * first - b[2] * second;
                    if let Some(jacobians) = jacobians {
                        let row = [first, -b[0] * t * first, second, -b[2] * t * second];
                        jacobians.row(0, 0).copy_from_slice(&row);
                    }
                    Ok(())
                };
            a.add_observation(group, FunctionObservation::new([block], 1, function), &covariance).unwrap();
        } else {
            let observation = Differentiated::<4, 1, _>::new(&a, [block], Decay { t, y }).unwrap();
            a.add_observation(group, observation, &covariance).unwrap();
        }
    }
    a
}

fn derivatives(criterion: &mut Criterion) {
    // One thread: wall time is CPU time.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let options = SolveOptions::default();
    let network = range_camera_network(&LABORATORY).free();
    let dual = differentiated_camera::differentiated(&network);
    let mut compare = |name: &str, hand: &Adjustment<'_>, dual: &Adjustment<'_>| {
        let mut group = criterion.benchmark_group(name);
        group.bench_function("by hand", |b| b.iter(|| pool.install(|| hand.solve(&options).unwrap())));
        group.bench_function("dual numbers", |b| b.iter(|| pool.install(|| dual.solve(&options).unwrap())));
        group.finish();
    };
    compare("network of 470 unknowns, 3078 values", &network.adjustment, &dual);
    compare("two decaying sums, 200 values", &decay(true), &decay(false));
}

criterion_group!(benches, derivatives);
criterion_main!(benches);
