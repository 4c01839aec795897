//! The derivatives of an observation equation that was written without any.

use observation_equations::{
    BlockId, Differentiated, EvaluationFailure, ParameterBlock, Parameters, Real, ResidualFunction, check_jacobian,
};

/// A range between a station and a target, with an offset.
struct Range {
    observed_m: f64,
}

impl ResidualFunction<1> for Range {
    fn residual<T: Real>(&self, parameters: &Parameters<'_, T>) -> Result<[T; 1], EvaluationFailure> {
        let ([x, y, z], [u, v, w]) = (parameters.values::<3>(0)?, parameters.values::<3>(1)?);
        let [offset] = parameters.values(2)?;
        let (dx, dy, dz) = (x - u, y - v, z - w);
        Ok([-((dx * dx + dy * dy + dz * dz).sqrt() + offset) + self.observed_m])
    }
}

#[allow(clippy::print_stdout)]
fn main() -> Result<(), observation_equations::Error> {
    let blocks = [
        ParameterBlock::euclidean([0.0, 0.0, 0.0]).named("station"),
        ParameterBlock::euclidean([1.0, 2.0, 2.0]).named("target"),
        ParameterBlock::euclidean([0.02]).named("offset"),
    ];
    let observation = Differentiated::new(&blocks, [0, 1, 2].map(BlockId::new), Range { observed_m: 3.0 })?;
    println!("{:?}", check_jacobian(&observation, &blocks)?);
    Ok(())
}
