//! What the surfaces do not determine: combinations of terms, and which of them are held.

use nalgebra::DMatrix;

use multiview_registration::SharedParameters;

/// Terms with a smaller part in a combination are not named.
const SMALLEST_WEIGHT: f64 = 0.2;

/// A term that was held, since the surfaces do not determine it together with the others.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldTerm {
    /// The term; `h1, h2, h3` for a hyperbola.
    pub name: String,
    /// The combination that is not determined: terms with their weights, each counted by what it moves points.
    pub combination: String,
    /// How well the combination was determined while the term was estimated, metre.
    pub sigma_m: f64,
}

impl std::fmt::Display for HeldTerm {
    /// Which term is held, and why.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.sigma_m.is_finite() {
            let millimetres = 1e3 * self.sigma_m;
            write!(f, "{} is held: these surfaces leave {} open ({millimetres:.1} mm)", self.name, self.combination)
        } else {
            write!(f, "{} is held: {}", self.name, self.combination)
        }
    }
}

/// For each combination that is known to more than `limit_m`, the term with the largest part in it, a parameter once.
pub(super) fn undetermined(shared: &SharedParameters, effects: &[f64], limit_m: f64) -> Vec<(usize, HeldTerm)> {
    let count = effects.len();
    let scaled = |row: usize, column: usize| {
        0.5 * (shared.covariance[row][column] + shared.covariance[column][row]) * effects[row] * effects[column]
    };
    let eigen = DMatrix::from_fn(count, count, scaled).symmetric_eigen();
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let mut held: Vec<(usize, HeldTerm)> = Vec::new();
    for at in order {
        let sigma_m = eigen.eigenvalues[at].max(0.0).sqrt();
        let weights = eigen.eigenvectors.column(at);
        let free = (0..count).filter(|term| !held.iter().any(|(other, _)| other == term));
        let Some(term) = free.max_by(|a, b| weights[*a].abs().total_cmp(&weights[*b].abs())) else { break };
        // NaN is not determined either.
        if sigma_m <= limit_m {
            continue;
        }
        let sign = weights[term].signum();
        let parts = (0..count).filter(|part| weights[*part].abs() >= SMALLEST_WEIGHT);
        let words: Vec<String> =
            parts.map(|part| format!("{:+.2} {}", sign * weights[part], shared.names[part])).collect();
        held.push((term, HeldTerm { name: shared.names[term].clone(), combination: words.join(" "), sigma_m }));
    }
    held
}
