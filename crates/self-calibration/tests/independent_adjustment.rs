//! The adjustment of a network beside one of its own equations, written out here as `docs/conventions.md` states them, with
//! derivatives by differences: corrections are taken at the modelled image point and range.

use nalgebra::{DMatrix, DVector, Rotation3, Vector3};
use self_calibration::{
    CalibrationOptions, CalibrationOutcome, Network, SightingOptions, TermSelection, calibrate, simulate_sightings,
};

use crate::support::INTERVAL;
use crate::support::networks::{all_but_long_wave, nominal, small};

/// All unknowns of an outcome: calibration parameters, stations, targets.
struct Point {
    names: Vec<String>,
    terms: Vec<f64>,
    /// Perspective centre, and the rotation from the camera to the world.
    stations: Vec<(Vector3<f64>, Rotation3<f64>)>,
    targets: Vec<Vector3<f64>>,
}

impl Point {
    fn of(outcome: &CalibrationOutcome) -> Self {
        let pose = |station: &self_calibration::AdjustedStation| {
            let pose = station.world_from_camera;
            (pose.translation.vector, pose.rotation.to_rotation_matrix())
        };
        let names = outcome.estimated.clone();
        Self {
            terms: names.iter().map(|name| outcome.parameter(name).unwrap().value).collect(),
            names,
            stations: outcome.stations.iter().map(pose).collect(),
            targets: outcome.targets.iter().map(|target| target.point.coords).collect(),
        }
    }

    fn unknowns(&self) -> usize {
        self.terms.len() + 6 * self.stations.len() + 3 * self.targets.len()
    }

    fn first_of_station(&self, station: usize) -> usize {
        self.terms.len() + 6 * station
    }

    fn first_of_target(&self, target: usize) -> usize {
        self.first_of_station(self.stations.len()) + 3 * target
    }

    /// Column, row and range that station and target should show, in their deviations; `step` is added to one unknown.
    fn residuals(&self, seen: &self_calibration::Sighting, network: &Network, step: (usize, f64)) -> [f64; 3] {
        let moved = |first: usize, index: usize| if step.0 == first + index { step.1 } else { 0.0 };
        let term = |name: &str| match self.names.iter().position(|known| known == name) {
            Some(index) => self.terms[index] + moved(0, index),
            None => 0.0,
        };
        let first = self.first_of_station(seen.station);
        let (centre, rotation) = self.stations[seen.station];
        let centre = centre + Vector3::from_fn(|axis, _| moved(first, axis));
        let rotation = rotation * Rotation3::new(Vector3::from_fn(|axis, _| moved(first, 3 + axis)));
        let first = self.first_of_target(seen.target);
        let target = self.targets[seen.target] + Vector3::from_fn(|axis, _| moved(first, axis));
        let local = rotation.inverse() * (target - centre);

        // Eqs. 8 to 13, at the fixed point.
        let [xp, yp, c] = ["xp", "yp", "c"].map(term);
        let [k1, k2, k3, p1, p2] = ["k1", "k2", "k3", "p1", "p2"].map(term);
        let corrected = [xp - c * local.x / local.z, yp - c * local.y / local.z];
        let [mut x, mut y] = corrected;
        for _ in 0..200 {
            let (u, v) = (x - xp, y - yp);
            let square = u * u + v * v;
            let radial = square * (k1 + square * (k2 + square * k3));
            x = corrected[0] + u * radial + p1 * (square + 2.0 * u * u) + 2.0 * p2 * u * v;
            y = corrected[1] + v * radial + p2 * (square + 2.0 * v * v) + 2.0 * p1 * u * v;
        }
        // Eq. 14, at the fixed point.
        let distance = local.norm();
        let mut range = distance;
        for _ in 0..200 {
            let turn = 2.0 * std::f64::consts::PI * range / INTERVAL;
            let waves = [("d2", "d3", 1.0), ("d4", "d5", 2.0), ("d6", "d7", 4.0)];
            let periodic: f64 =
                waves.map(|(s, c, m)| term(s) * (m * turn).sin() + term(c) * (m * turn).cos()).iter().sum();
            range = distance + term("d0") + periodic + term("e1") * (x - xp) + term("e2") * (y - yp);
        }
        let format = network.camera.format;
        let col = x / format.pixel_pitch_mm[0] + (format.width as f64 - 1.0) / 2.0;
        let row = (format.height as f64 - 1.0) / 2.0 - y / format.pixel_pitch_mm[1];
        let [observed_col, observed_row] = seen.pixel.unwrap();
        [
            (observed_col - col) / seen.sigma_pixel[0],
            (observed_row - row) / seen.sigma_pixel[1],
            seen.range_m.map_or(0.0, |observed| (observed - range) / seen.sigma_range_m),
        ]
    }
}

/// Shifts and turns of all targets, which no observation shows.
fn motions(at: &Point) -> DMatrix<f64> {
    let middle = at.targets.iter().sum::<Vector3<f64>>() / at.targets.len() as f64;
    let mut motions = DMatrix::zeros(at.unknowns(), 6);
    for (index, target) in at.targets.iter().enumerate() {
        let arm = target - middle;
        for axis in 0..3 {
            motions[(at.first_of_target(index) + axis, axis)] = 1.0;
            let turned = Vector3::ith(axis, 1.0).cross(&arm);
            (0..3).for_each(|i| motions[(at.first_of_target(index) + i, 3 + axis)] = turned[i]);
        }
    }
    motions
}

#[test]
fn values_and_deviations_are_those_of_the_documented_equations() {
    let mut truth = small();
    // Larger than any camera has: what stands at the measured image point in place of the modelled one shows all the more.
    (truth.range_model.terms.e1, truth.range_model.terms.e2) = (0.02, -0.015);
    let sightings = SightingOptions { sigma_pixel: 0.3, sigma_range_m: 0.004, seed: 5, ..SightingOptions::default() };
    let mut observed = simulate_sightings(&truth, &sightings).unwrap();
    nominal(&mut observed);
    let terms = TermSelection::List(all_but_long_wave());
    let options = CalibrationOptions { terms, rejection_level: None, ..CalibrationOptions::default() };
    let outcome = calibrate(&observed, &options).unwrap();
    let at = Point::of(&outcome);

    let unknowns = at.unknowns();
    let (mut normal, mut right) = (DMatrix::zeros(unknowns, unknowns), DVector::zeros(unknowns));
    let mut vtpv = 0.0;
    for seen in &observed.sightings {
        let (station, target) = (at.first_of_station(seen.station), at.first_of_target(seen.target));
        let own: Vec<usize> = (0..at.terms.len()).chain(station..station + 6).chain(target..target + 3).collect();
        let residuals = at.residuals(seen, &observed, (usize::MAX, 0.0));
        vtpv += residuals.iter().map(|v| v * v).sum::<f64>();
        let step = |unknown: usize| match at.names.get(unknown).map(String::as_str) {
            Some("k1") => 1e-6,
            Some("k2") => 1e-8,
            Some("k3") => 1e-10,
            _ => 1e-5,
        };
        let derivative = |&unknown: &usize| {
            let at_step = |step: f64| at.residuals(seen, &observed, (unknown, step));
            let (ahead, behind) = (at_step(step(unknown)), at_step(-step(unknown)));
            [0, 1, 2].map(|i| (behind[i] - ahead[i]) / (2.0 * step(unknown)))
        };
        let derivatives: Vec<[f64; 3]> = own.iter().map(derivative).collect();
        for (i, a) in own.iter().zip(&derivatives) {
            right[*i] += (0..3).map(|row| a[row] * residuals[row]).sum::<f64>();
            for (j, b) in own.iter().zip(&derivatives) {
                normal[(*i, *j)] += (0..3).map(|row| a[row] * b[row]).sum::<f64>();
            }
        }
    }
    assert!((vtpv / outcome.vtpv - 1.0).abs() < 1e-7, "{vtpv} {}", outcome.vtpv);

    // Scaled to a unit diagonal. Which datum is chosen does not touch the calibration.
    let scale = DVector::from_fn(unknowns, |i, _| 1.0 / f64::sqrt(normal[(i, i)]));
    let scaled = DMatrix::from_fn(unknowns, unknowns, |i, j| normal[(i, j)] * scale[i] * scale[j]);
    let open = motions(&at);
    let open = DMatrix::from_fn(unknowns, 6, |i, j| open[(i, j)] / scale[i]).qr().q();
    let inverse = (scaled + &open * open.transpose()).cholesky().unwrap().inverse();
    let moved = &inverse * right.component_mul(&scale);
    for (index, name) in at.names.iter().enumerate() {
        let sigma = outcome.parameter(name).unwrap().sigma_prior;
        let step = moved[index] * scale[index];
        assert!((step / sigma).abs() < 1e-4, "{name} is off by {:e} of its deviation", step / sigma);
        let known = inverse[(index, index)].sqrt() * scale[index];
        assert!((known / sigma - 1.0).abs() < 1e-4, "the deviation of {name} is {sigma:e}, here {known:e}");
    }
}
