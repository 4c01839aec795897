use crate::derivatives::dual::TapeMemory;
use crate::observation::Named;
use crate::{Error, EvaluationFailure, Jacobians, Observation, ParameterBlock, Result};

/// Comparison of a Jacobian with differences of its model.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct JacobianCheck {
    /// Largest difference between the two, relative to the largest derivative with respect to the same parameter; for a
    /// parameter that hardly acts, relative to 1e-4 of the strongest parameter's action (both times their values).
    pub worst: f64,
    /// Where it is: component of the observation, place of the block, component of its tangent step.
    pub place: (usize, usize, usize),
    /// The derivative given by the observation there.
    pub analytic: f64,
    /// The derivative by differences there.
    pub numeric: f64,
}

/// Compares the Jacobian of an observation with central differences at the values of `blocks`, which stand for
/// `observation.blocks()` in the same order. A right Jacobian of a smooth model agrees to 1e-7 or better.
///
/// For each parameter several step sizes are tried, and of them the one whose extrapolation is most certain by itself is
/// compared, so that metres and inverse powers of millimetres can be checked alike.
///
/// # Errors
/// The blocks do not fit the observation, or the model has no value at or beside them.
pub fn check_jacobian(observation: &dyn Observation, blocks: &[ParameterBlock]) -> Result<JacobianCheck> {
    let expected = observation.blocks().len();
    if blocks.len() != expected {
        return Err(Error::Length { what: "list of blocks".to_owned(), expected, found: blocks.len() });
    }
    for (index, block) in blocks.iter().enumerate() {
        block.check(index, &block.values)?;
    }
    let analytic = analytic(observation, blocks)?;
    let width = analytic.len() / observation.dimension().max(1);
    let numeric = numeric(observation, blocks)?;
    let strongest = numeric.iter().map(|column| column.size * column.largest()).fold(0.0, f64::max);
    let mut check = JacobianCheck { worst: 0.0, place: (0, 0, 0), analytic: f64::NAN, numeric: f64::NAN };
    for (index, column) in numeric.iter().enumerate() {
        for (row, &numeric) in column.derivative.iter().enumerate() {
            let analytic = analytic[row * width + index];
            let reference = column.largest().max(analytic.abs()).max(1e-4 * strongest / column.size);
            let off = if reference > 0.0 { (analytic - numeric).abs() / reference } else { 0.0 };
            // NaN is the worst of all.
            if check.analytic.is_nan() || off.is_nan() || off > check.worst {
                let (block, component) = column.parameter;
                check = JacobianCheck { worst: off, place: (row, block, component), analytic, numeric };
            }
        }
    }
    Ok(check)
}

/// Derivatives with respect to one parameter.
struct Column {
    parameter: (usize, usize),
    derivative: Vec<f64>,
    /// Size of the block's values.
    size: f64,
}

impl Column {
    fn largest(&self) -> f64 {
        self.derivative.iter().fold(0.0, |a: f64, d| a.max(d.abs()))
    }
}

fn numeric(observation: &dyn Observation, blocks: &[ParameterBlock]) -> Result<Vec<Column>> {
    let mut columns = Vec::new();
    for (place, block) in blocks.iter().enumerate() {
        let size = block.values.iter().fold(0.0, |a: f64, v| a.max(v.abs()));
        let size = if size > 0.0 { size } else { 1.0 };
        for component in 0..block.tangent_dimension() {
            let derivative = differentiate(observation, blocks, place, component, size)?;
            columns.push(Column { parameter: (place, component), derivative, size });
        }
    }
    Ok(columns)
}

fn fail(failure: &EvaluationFailure) -> Error {
    Error::Evaluation { group: "Jacobian check".to_owned(), observation: 0, reason: failure.to_string() }
}

fn analytic(observation: &dyn Observation, blocks: &[ParameterBlock]) -> Result<Vec<f64>> {
    let parameters: Vec<&[f64]> = blocks.iter().map(|block| block.values.as_slice()).collect();
    let mut width = 0;
    let mut named = Vec::with_capacity(blocks.len());
    for (place, block) in blocks.iter().enumerate() {
        let own = block.tangent_dimension();
        named.push(Named { block: place as u32, start: width as u32, width: own as u32 });
        width += own;
    }
    let dimension = observation.dimension();
    let mut data = vec![0.0; dimension * width];
    let (mut tape, named) = (TapeMemory::default(), &named);
    let mut jacobians = Jacobians::new(&mut data, named, [dimension, width], &mut tape);
    let mut residual = vec![0.0; dimension];
    observation.evaluate(&parameters, &mut residual, Some(&mut jacobians)).map_err(|failure| fail(&failure))?;
    if jacobians.written().is_none() {
        return Err(fail(&EvaluationFailure::new("a Jacobian of the wrong shape was written")));
    }
    Ok(data)
}

/// Derivative of the model (minus that of the residual) by extrapolated central differences, `dimension` values.
fn differentiate(
    observation: &dyn Observation,
    blocks: &[ParameterBlock],
    place: usize,
    component: usize,
    size: f64,
) -> Result<Vec<f64>> {
    let mut best: Option<(f64, Vec<f64>)> = None;
    // From a tenth of the parameter, or of its unit, down by factors of eight to 1e-10.
    for power in 0..11 {
        let step = 0.1 * size.max(1.0) * 0.125_f64.powi(power);
        let (Ok(wide), Ok(narrow)) = (
            difference(observation, blocks, place, component, step),
            difference(observation, blocks, place, component, 0.5 * step),
        ) else {
            continue;
        };
        let extrapolated: Vec<f64> = wide.iter().zip(&narrow).map(|(w, n)| (4.0 * n - w) / 3.0).collect();
        let doubt = extrapolated.iter().zip(&narrow).map(|(e, n)| (e - n).abs()).fold(0.0, f64::max);
        if doubt.is_finite() && best.as_ref().is_none_or(|(least, _)| doubt < *least) {
            best = Some((doubt, extrapolated));
        }
    }
    best.map(|(_, derivative)| derivative)
        .ok_or_else(|| fail(&EvaluationFailure::new("the model has no finite value beside these parameters")))
}

fn difference(
    observation: &dyn Observation,
    blocks: &[ParameterBlock],
    place: usize,
    component: usize,
    step: f64,
) -> std::result::Result<Vec<f64>, EvaluationFailure> {
    let at = |step: f64| {
        let block = &blocks[place];
        let mut tangent = vec![0.0; block.tangent_dimension()];
        tangent[component] = step;
        let mut moved = block.values.clone();
        block.manifold.plus(&block.values, &tangent, &mut moved);
        let mut parameters: Vec<&[f64]> = blocks.iter().map(|block| block.values.as_slice()).collect();
        parameters[place] = &moved;
        let mut residual = vec![0.0; observation.dimension()];
        observation.evaluate(&parameters, &mut residual, None).map(|()| residual)
    };
    let (ahead, behind) = (at(step)?, at(-step)?);
    Ok(ahead.iter().zip(behind).map(|(a, b)| (b - a) / (2.0 * step)).collect())
}
