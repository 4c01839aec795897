//! How the estimating equations respond to the pose, pairs found anew.
//!
//! The normal matrix takes the pairs as fixed. In truth they change with the pose, and the nearest of several noisy
//! points is one whose error resembles that of the source point: the residual follows a displacement only in part
//! (three quarters where the noise is a third of the spacing). The covariance needs the true response, so the score is
//! evaluated at displaced poses.

use nalgebra::{Matrix6, Vector6};

use crate::error::Result;
use crate::icp::engine::matching::Points;
use crate::icp::engine::registration::Engine;
use crate::parts::{Moment, Rows};
use crate::system::System;

/// Response `d(Σ w J r)/d[dt, rho w]` of a sample of the pairs, scaled up to all of them.
///
/// `sample`: source points; `step_m`: displacement, of the order of the residuals.
pub(crate) fn sensitivity(
    engine: &Engine<'_>,
    system: &System<'_>,
    sample: &[usize],
    step_m: f64,
) -> Result<Matrix6<f64>> {
    let moment = system.scene().moment;
    let mut points = Points::new(sample.to_vec());
    points.remember();
    let mut score = |motion: &Vector6<f64>| -> Result<(Vector6<f64>, usize)> {
        let scene = engine.scene.at(Moment { pose: system.moved(motion), ..moment });
        let pairs = engine.judged(&scene, engine.gated_pairs(&scene, &mut points)?);
        let displaced = system.with_pairs(&scene, &pairs);
        let mut rows = Rows::default();
        Ok(((0..pairs.len()).fold(Vector6::zeros(), |sum, i| sum + displaced.score(i, &mut rows)), pairs.len()))
    };
    // The answers at the pose itself serve the small displacements.
    score(&Vector6::zeros())?;
    let mut response = Matrix6::zeros();
    let mut count = 0;
    for k in 0..6 {
        let mut motion = Vector6::zeros();
        motion[k] = step_m;
        let ((plus, a), (minus, b)) = (score(&motion)?, score(&-motion)?);
        response.set_column(k, &((plus - minus) / (2.0 * step_m)));
        count += a + b;
    }
    let average = (count as f64 / 12.0).max(1.0);
    Ok(response * (system.pairs().len() as f64 / average))
}
