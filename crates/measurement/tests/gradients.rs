//! Gradients against differences of everything that is measured.

use measurement::nalgebra::Vector3;
use measurement::point_uncertainty::Gradient;
use measurement::{FitOptions, fit_plane, flatness};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::scene::{self, Setting, Survey};
use crate::statistics::measured;

fn shifts(count: usize, seed: u64) -> Vec<Vector3<f64>> {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    // A part that all points share, so that sums do not average out.
    let mut own = || Vector3::new(normal(), normal(), normal());
    let (all, turn) = (own(), own());
    (0..count).map(|_| own() + all).map(|shift| shift + turn * 0.3).collect()
}

fn moved(survey: &Survey, shifts: &[Vector3<f64>], factor: f64) -> Survey {
    let mut moved = scene::survey(&Setting { common: 0.0, ..Setting::default() }, 0);
    moved.points = survey.points.iter().zip(shifts).map(|(point, shift)| point + shift * factor).collect();
    moved.errors.points.clone_from(&survey.errors.points);
    moved.errors.of_points.clone_from(&survey.errors.of_points);
    moved
}

fn predicted(gradient: &Gradient, shifts: &[Vector3<f64>]) -> f64 {
    gradient.iter().map(|(point, by)| by.dot(&shifts[*point])).sum()
}

/// Largest difference between gradient and differences in parts of what random shifts do to the quantity.
fn largest_difference(setting: &Setting) -> Vec<(&'static str, f64)> {
    let survey = scene::survey(setting, 5);
    let step = 1e-7;
    let mut found: Vec<(&str, f64)> = Vec::new();
    for seed in 0..3 {
        let shifts = shifts(survey.points.len(), seed);
        let [forth, back] = [step, -step].map(|step| measured(&moved(&survey, &shifts, step)));
        for (at, (name, quantity, _)) in measured(&moved(&survey, &shifts, 0.0)).into_iter().enumerate() {
            let difference = (forth[at].1.value - back[at].1.value) / (2.0 * step);
            let typical = quantity.gradient.iter().map(|(_, by)| by.norm_squared()).sum::<f64>().sqrt();
            let off = (predicted(&quantity.gradient, &shifts) - difference).abs() / (typical + difference.abs());
            if found.len() <= at {
                found.push((name, 0.0));
            }
            found[at].1 = found[at].1.max(off);
        }
    }
    found
}

#[test]
fn gradients_are_those_of_differences_where_points_lie_on_their_shapes() {
    let exact = Setting { understated: 0.0, sensor_m: 0.0, common: 0.0, ..Setting::default() };
    for (name, off) in largest_difference(&exact) {
        // Rounding of coordinates of a metre over the step.
        // A volume does not follow the slopes of its cells, which act where points are not even in a cell.
        let limit = if name == "volume" { 0.05 } else { 1e-4 };
        assert!(off < limit, "{name}: {off}");
    }
}

#[test]
fn residuals_change_gradients_by_little() {
    let noisy = Setting { sensor_m: 0.0, common: 0.0, ..Setting::default() };
    for (name, off) in largest_difference(&noisy) {
        // Residuals of five millimetres over bodies of a decimetre, seventy points each; what is left out has no part that points share.
        assert!(off < 0.2, "{name}: {off}");
    }
}

#[test]
fn the_gradient_of_form_is_that_of_differences() {
    let survey = scene::survey(&Setting { waves_m: 0.004, sensor_m: 0.0, common: 0.0, ..Setting::default() }, 5);
    let shifts = shifts(survey.points.len(), 9);
    let form = |factor: f64| {
        let survey = moved(&survey, &shifts, factor);
        let cloud = survey.cloud();
        let points = scene::wall_region().select(cloud.points).unwrap();
        flatness(&fit_plane(&cloud, &points, &FitOptions::default()).unwrap())
    };
    let step = 1e-7;
    let difference = (form(step).form_m - form(-step).form_m) / (2.0 * step);
    let off = (predicted(&form(0.0).gradient, &shifts) - difference).abs();
    assert!(off < 1e-3 * difference.abs(), "{off} of {difference}");
}
