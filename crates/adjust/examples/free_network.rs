//! Eight marks on a wall and a ceiling, all distances between them measured with a tape: a free network with its datum
//! on all marks. Prints coordinates, standard deviations and how well each distance is controlled; then what happens when
//! the datum is forgotten.
#![allow(clippy::print_stdout)]

use adjust::{
    Adjustment, Covariance, DatumDefect, EvaluationFailure, FunctionObservation, Jacobians, ParameterBlock, Scale,
    SolveOptions,
};
use nalgebra::Vector3;

/// `v = observed − |p₂ − p₁|`.
fn distance(
    observed: f64,
    parameters: &[&[f64]],
    residual: &mut [f64],
    jacobians: Option<&mut Jacobians<'_>>,
) -> Result<(), EvaluationFailure> {
    let between = Vector3::from_column_slice(parameters[1]) - Vector3::from_column_slice(parameters[0]);
    let length = between.norm();
    if length == 0.0 {
        return Err(EvaluationFailure::new("two marks coincide"));
    }
    residual[0] = observed - length;
    if let Some(jacobians) = jacobians {
        jacobians.set(0, &(-between.transpose() / length));
        jacobians.set(1, &(between.transpose() / length));
    }
    Ok(())
}

fn main() -> Result<(), adjust::Error> {
    // Rough coordinates in metre, and tape readings that are up to 3 mm off the true distances.
    let rough: Vec<Vector3<f64>> =
        (0..8).map(|i| Vector3::new(f64::from(i & 1), f64::from(i >> 1 & 1) * 1.4, f64::from(i >> 2) * 0.8)).collect();
    let mut adjustment = Adjustment::new();
    let marks: Vec<_> = rough
        .iter()
        .enumerate()
        .map(|(i, p)| adjustment.add_block(ParameterBlock::euclidean(p.as_slice()).named(format!("mark {i}"))))
        .collect();
    let tape = adjustment.add_group("tape");
    for i in 0..8 {
        for j in 0..i {
            let observed = (rough[i] - rough[j]).norm() + 0.003 * ((7 * i + 3 * j) as f64).sin();
            let reading = FunctionObservation::new([marks[i], marks[j]], 1, move |parameters, residual, jacobians| {
                distance(observed, parameters, residual, jacobians)
            });
            adjustment.add_observation(tape, reading, &Covariance::from_sigma(0.002))?;
        }
    }

    if let Err(error) = adjustment.solve(&SolveOptions::default()) {
        println!("without a datum: {error}\n");
    }

    adjustment.add_inner_constraints(&marks, DatumDefect::Six)?;
    let solution = adjustment.solve(&SolveOptions::default())?;
    for (i, &mark) in marks.iter().enumerate() {
        let (p, s) = (solution.values(mark)?, solution.standard_deviations(mark, Scale::Prior)?);
        let text: Vec<String> = p.iter().zip(s).map(|(p, s)| format!("{p:8.4} ± {:.1} mm", 1000.0 * s)).collect();
        println!("mark {i}: {}", text.join("  "));
    }
    let controlled = solution.redundancy_numbers();
    let least = controlled.iter().fold(1.0_f64, |a, &b| a.min(b));
    println!(
        "sigma0 {:.2}, redundancy {}, least redundancy number {least:.2}, {} iterations",
        solution.sigma0().unwrap_or(f64::NAN),
        solution.redundancy(),
        solution.iterations()
    );
    Ok(())
}
