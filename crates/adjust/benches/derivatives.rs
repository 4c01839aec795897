//! What derivatives by dual numbers cost beside Jacobians derived by hand: alone, in a self-calibration and in a small fit.
#![allow(missing_docs, clippy::unwrap_used)]

#[path = "../tests/common/differentiated_camera.rs"]
mod differentiated_camera;
#[path = "../tests/common/range_camera.rs"]
#[allow(dead_code)]
mod range_camera;

use std::hint::black_box;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use adjust::{
    Adjustment, BlockId, Covariance, Differentiated, EvaluationFailure, FunctionObservation, Jacobians, Observation,
    ParameterBlock, Parameters, Real, ResidualFunction, SolveOptions,
};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use differentiated_camera::Seen;
use range_camera::{LABORATORY, RangeCameraNetwork, SIGMAS, range_camera_network};

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
            let observation = Differentiated::new(&a, [block], Decay { t, y }).unwrap();
            a.add_observation(group, observation, &covariance).unwrap();
        }
    }
    a
}

/// How often each Jacobian is computed: the clock takes as long as some of them.
const REPEATED: u32 = 100;

/// An observation that measures how long its Jacobian takes.
struct Timed<'s, O> {
    inner: O,
    spent: &'s Mutex<(Duration, u32)>,
}

impl<O: Observation> Observation for Timed<'_, O> {
    fn dimension(&self) -> usize {
        self.inner.dimension()
    }

    fn blocks(&self) -> &[BlockId] {
        self.inner.blocks()
    }

    fn evaluate(
        &self,
        parameters: &[&[f64]],
        residual: &mut [f64],
        jacobians: Option<&mut Jacobians<'_>>,
    ) -> Result<(), EvaluationFailure> {
        let Some(jacobians) = jacobians else { return self.inner.evaluate(parameters, residual, None) };
        let start = Instant::now();
        for _ in 0..REPEATED {
            self.inner.evaluate(black_box(parameters), residual, Some(jacobians))?;
        }
        let mut spent = self.spent.lock().unwrap();
        *spent = (spent.0 + start.elapsed(), spent.1 + REPEATED);
        Ok(())
    }
}

/// The residual and the Jacobian of one sighting, as the adjustment asks for them: 3 values, 26 parameters.
fn alone(criterion: &mut Criterion, pool: &rayon::ThreadPool, network: &RangeCameraNetwork) {
    let mut group = criterion.benchmark_group("evaluate");
    group.sample_size(20).throughput(Throughput::Elements(3));
    for (name, by_hand) in [("by hand", true), ("dual numbers", false)] {
        let spent = Mutex::new((Duration::ZERO, 0));
        let mut a = differentiated_camera::differentiated_blocks(network);
        let sightings = a.add_group("sightings");
        for (_, _, sighting) in &network.sightings {
            let (observed, at, blocks) = (sighting.observed, sighting.at, sighting.blocks);
            let covariance = Covariance::from_sigmas(&SIGMAS);
            if by_hand {
                let inner = range_camera::Sighting { blocks, observed, at, dimension: 3 };
                a.add_observation(sightings, Timed { inner, spent: &spent }, &covariance).unwrap();
            } else {
                let inner = Differentiated::new(&a, blocks, Seen { observed, at }).unwrap();
                a.add_observation(sightings, Timed { inner, spent: &spent }, &covariance).unwrap();
            }
        }
        group.bench_function(format!("sighting of 26 parameters, {name}"), |b| {
            b.iter_custom(|iterations| {
                *spent.lock().unwrap() = (Duration::ZERO, 0);
                pool.install(|| a.solve(&SolveOptions::default()).unwrap());
                let (time, evaluations) = *spent.lock().unwrap();
                time.mul_f64(iterations as f64 / f64::from(evaluations))
            });
        });
    }
    group.finish();
}

fn derivatives(criterion: &mut Criterion) {
    // One thread: wall time is CPU time.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let options = SolveOptions::default();
    let network = range_camera_network(&LABORATORY).free();
    alone(criterion, &pool, &network);
    let dual = differentiated_camera::differentiated(&network);
    let mut compare = |name: &str, hand: &Adjustment<'_>, dual: &Adjustment<'_>| {
        let mut group = criterion.benchmark_group("solve");
        group.throughput(Throughput::Elements(hand.solve(&options).unwrap().observations() as u64));
        for (derivatives, adjustment) in [("by hand", hand), ("dual numbers", dual)] {
            group.bench_function(format!("{name}, derivatives {derivatives}"), |b| {
                b.iter(|| pool.install(|| adjustment.solve(&options).unwrap()));
            });
        }
        group.finish();
    };
    compare("470 unknowns", &network.adjustment, &dual);
    compare("two decaying sums", &decay(true), &decay(false));
}

criterion_group!(benches, derivatives);
criterion_main!(benches);
