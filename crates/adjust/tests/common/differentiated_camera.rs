//! The range camera's sighting without a Jacobian, for the same networks.

use adjust::{
    Adjustment, Covariance, DatumDefect, Differentiated, EvaluationFailure, ParameterBlock, Parameters, Real,
    ResidualFunction, RigidPose,
};

use crate::range_camera::{NAMES, RangeCameraNetwork, SIGMAS};

/// Longest wave of the periodic errors, metre.
const WAVE: f64 = 7.5;

/// Observed image coordinates (mm) and range (m), and where their corrections are taken.
pub struct Seen {
    pub observed: [f64; 3],
    pub at: [f64; 3],
}

impl ResidualFunction<3> for Seen {
    fn residual<T: Real>(&self, parameters: &Parameters<'_, T>) -> Result<[T; 3], EvaluationFailure> {
        let point = parameters.pose(0)?.inverse_transform(parameters.values(1)?);
        let [xp, yp, c, k1, k2, k3, p1, p2, d0, d2, d3, d4, d5, d6, d7, e1, e2] = parameters.values(2)?;
        if point[2].value() >= 0.0 {
            return Err(EvaluationFailure::new("the target lies behind the camera"));
        }
        let [x, y, rho] = self.at;
        let r2 = x * x + y * y;
        let radial = ((k3 * r2 + k2) * r2 + k1) * r2;
        let dx = xp + radial * x + p1 * (r2 + 2.0 * x * x) + p2 * (2.0 * x * y);
        let dy = yp + radial * y + p2 * (r2 + 2.0 * y * y) + p1 * (2.0 * x * y);
        let phase = std::f64::consts::TAU * rho / WAVE;
        let wave = |sine: T, cosine: T, phase: f64| sine * phase.sin() + cosine * phase.cos();
        let waves = wave(d2, d3, phase) + wave(d4, d5, 2.0 * phase) + wave(d6, d7, 4.0 * phase);
        let drho = d0 + waves + e1 * x + e2 * y;
        let scale = -c / point[2];
        let range = (point[0] * point[0] + point[1] * point[1] + point[2] * point[2]).sqrt();
        let model = [point[0] * scale + dx, point[1] * scale + dy, range + drho];
        Ok(std::array::from_fn(|i| -model[i] + self.observed[i]))
    }
}

/// The blocks of the network at the same start values, free on the targets, without observations.
pub fn differentiated_blocks<'a>(network: &RangeCameraNetwork) -> Adjustment<'a> {
    let mut a = Adjustment::new();
    let start = |id| network.adjustment.values(id).unwrap().to_vec();
    a.add_block(ParameterBlock::euclidean(start(network.parameters)).with_parameter_names(NAMES));
    for &station in &network.stations {
        a.add_block(ParameterBlock::manifold(start(station), RigidPose));
    }
    for &target in &network.targets {
        a.add_block(ParameterBlock::euclidean(start(target)));
    }
    a.add_inner_constraints(&network.targets, DatumDefect::Six).unwrap();
    a
}

/// The same network with derivatives by dual numbers.
pub fn differentiated(network: &RangeCameraNetwork) -> Adjustment<'static> {
    let mut a = differentiated_blocks(network);
    let group = a.add_group("sightings");
    for (_, _, sighting) in &network.sightings {
        let seen = Seen { observed: sighting.observed, at: sighting.at };
        let observation = Differentiated::new(&a, sighting.blocks, seen).unwrap();
        a.add_observation(group, observation, &Covariance::from_sigmas(&SIGMAS)).unwrap();
    }
    a
}
