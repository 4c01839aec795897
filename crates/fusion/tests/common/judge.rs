//! Fused points against the truth.

use std::collections::BTreeMap;

use fusion::nalgebra::{DVector, Matrix3, Vector3};
use fusion::{Fused, Surfel};

use super::scene::SPHERE;
use super::survey::{Survey, is_dark};

/// Sums of squared errors over their variances, by class.
#[derive(Debug, Clone, Default)]
pub struct Judgement {
    pub classes: BTreeMap<&'static str, (f64, f64)>,
    /// Robust scatter of heights across walls over the deviation of noise and sensor, one a wall.
    pub thickness: Vec<f64>,
    /// Surfels without a surface.
    pub ghosts: usize,
    /// Errors of the corrections in their metric, each over the number of common errors.
    pub corrections: Vec<f64>,
    pub surfels: usize,
}

impl Judgement {
    pub fn add(&mut self, survey: &Survey, fused: &Fused) {
        let mut walls: BTreeMap<usize, Vec<(Vector3<f64>, f64, f64)>> = BTreeMap::new();
        self.surfels += fused.surfels.len();
        let size = survey.drawn.len();
        let off = DVector::from_fn(size, |at, _| survey.drawn[at] - fused.corrections[at]);
        let solved = fused.common.covariance().clone().cholesky().unwrap().solve(&off);
        self.corrections.push(off.dot(&solved) / size as f64);
        for surfel in &fused.surfels {
            let Some((height, surface)) = survey.scene.above(&surfel.position, &surfel.normal) else {
                self.ghosts += 1;
                continue;
            };
            let square = (height / surfel.sigma_m()).powi(2);
            for class in classes(survey, surfel, surface) {
                let sums = self.classes.entry(class).or_default();
                *sums = (sums.0 + square, sums.1 + 1.0);
            }
            if let Some(face) = survey.scene.faces.get(surface) {
                let aside = [(face.axis + 1) % 3, (face.axis + 2) % 3].map(|k| surfel.position[k]);
                let row = Vector3::new(1.0, aside[0], aside[1]);
                walls.entry(surface).or_default().push((row, height, surfel.own_sigma_m()));
            }
        }
        self.thickness.extend(walls.values().filter(|wall| wall.len() >= 100).map(|wall| thickness(wall)));
    }

    pub fn mean(&self, class: &str) -> f64 {
        self.classes.get(class).map_or(f64::NAN, |(sum, count)| sum / count)
    }
}

/// Scatter about the wall's own plane, in deviations.
fn thickness(wall: &[(Vector3<f64>, f64, f64)]) -> f64 {
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (row, height, sigma) in wall {
        normal += row * row.transpose() / (sigma * sigma);
        right += row * (height / (sigma * sigma));
    }
    let plane = normal.cholesky().unwrap().solve(&right);
    let residuals: Vec<f64> = wall.iter().map(|(row, height, sigma)| (height - row.dot(&plane)) / sigma).collect();
    statistics::robust_standard_deviation(&residuals)
}

fn classes(survey: &Survey, surfel: &Surfel, surface: usize) -> Vec<&'static str> {
    let mut found = vec!["all"];
    let sights = surfel.frames.iter().map(|frame| surfel.position - survey.centres[*frame as usize]);
    let (mut nearest, mut facing) = (f64::INFINITY, 0.0_f64);
    for sight in sights {
        nearest = nearest.min(sight.norm());
        facing = facing.max(-surfel.normal.dot(&sight.normalize()));
    }
    if nearest < 1.2 {
        found.push("near");
    }
    if nearest > 2.2 {
        found.push("far");
    }
    if is_dark(&surfel.position) {
        found.push("dark");
    }
    if facing < 0.4 {
        found.push("grazing");
    }
    if surface == SPHERE {
        found.push("sphere");
    } else if is_at_edge(survey, surfel, surface) {
        found.push("edge");
    }
    if super::scene::THIN.contains(&surface) {
        found.push("thin wall");
    }
    found
}

/// Whether a surfel lies within 6 cm of the end of its face or of another one.
fn is_at_edge(survey: &Survey, surfel: &Surfel, surface: usize) -> bool {
    let own = survey.scene.faces[surface];
    let ends = (0..3)
        .filter(|k| *k != own.axis)
        .any(|k| (surfel.position[k] - own.low[k]).abs() < 0.06 || (surfel.position[k] - own.high[k]).abs() < 0.06);
    let others = survey.scene.faces.iter().filter(|face| face.axis != own.axis);
    ends || others
        .into_iter()
        .any(|face| (surfel.position[face.axis] - face.at).abs() < 0.06 && face.holds(&surfel.position, 0.06))
}
