//! What cameras show of a term before anything is observed: the automatic choice leaves none at exactly zero.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use crate::Network;
use crate::functional_model::setup::{BlockPrior, Setup};

// The sizes are chosen, after what range cameras and their lenses are said to have.

/// Waves of the range error, metre.
pub const WAVE_M: f64 = 0.02;
/// Change of the range error from the image's middle to its corner, metre.
pub const TILT_M: f64 = 0.02;
/// Radial distortion in the corner by the terms of third, fifth and seventh order, as shares of the corner's radius.
const RADIAL: [f64; 3] = [0.2, 0.1, 0.05];
/// Decentring distortion in the corner, as a share of its radius.
const DECENTRING: f64 = 0.01;
/// Affinity and shear of the sensor's axes.
const AFFINITY: f64 = 1e-3;

/// Standard deviations of terms about zero by name, in the unit of each. The others - perspective centre and principal
/// distance, offset, hyperbola - are unknown, or no terms that may be zero.
pub fn usual_sigmas(network: &Network) -> BTreeMap<&'static str, f64> {
    let format = &network.camera.format;
    let [x, y] = format.pixel_pitch_mm;
    let corner = 0.5 * (x * format.width as f64).hypot(y * format.height as f64);
    let waves = ["d2", "d3", "d4", "d5", "d6", "d7"].map(|name| (name, WAVE_M));
    let radial = ["k1", "k2", "k3"].into_iter().zip(RADIAL).zip([2, 4, 6]);
    let radial = radial.map(|((name, share), power)| (name, share / corner.powi(power)));
    let others = [
        ("e1", TILT_M / corner),
        ("e2", TILT_M / corner),
        ("p1", DECENTRING / (3.0 * corner)),
        ("p2", DECENTRING / (3.0 * corner)),
        ("b1", AFFINITY),
        ("b2", AFFINITY),
    ];
    waves.into_iter().chain(radial).chain(others).collect()
}

impl Setup<'_> {
    /// What is known of a block of terms with these names; `None` where it is nothing.
    pub fn term_prior(&self, names: &[String]) -> Option<BlockPrior> {
        let estimated = names.iter().enumerate().filter(|(_, name)| self.estimated.contains(*name));
        let known = estimated.filter_map(|(component, name)| Some((component, self.term_sigmas.get(name.as_str())?)));
        let (components, variances): (Vec<_>, Vec<_>) =
            known.map(|(component, sigma)| ((component, 0.0), sigma * sigma)).unzip();
        let covariance = DMatrix::from_diagonal(&DVector::from_vec(variances));
        (!components.is_empty()).then_some(BlockPrior { known: components, covariance })
    }
}
