//! The large network of `hall`, solved with its points eliminated, held against one dense bordered system of all
//! unknowns: `dense_reference [small]`. Takes about a gigabyte and a minute.
#![allow(clippy::print_stdout, clippy::unwrap_used, missing_docs)]

use adjust::{BlockId, Solution, SolveOptions};
use faer::Mat;
use faer::prelude::Solve;
use nalgebra::Vector3;
use range_camera::{HALL, LABORATORY, RangeCameraNetwork, SIGMAS, range_camera_network};

#[allow(dead_code)]
#[path = "../tests/common/range_camera.rs"]
mod range_camera;

/// Inner constraints of a network with ranges.
const DEFECT: usize = 6;

fn main() {
    let plan = if std::env::args().nth(1).is_some_and(|word| word == "small") { LABORATORY } else { HALL };
    let network = range_camera_network(&plan).free();
    let solution = network.adjustment.solve(&SolveOptions::default()).unwrap();
    let System { normal, gradient, vtpv } = system(&network, &solution);
    let scale: Vec<f64> = (0..solution.unknowns()).map(|i| 1.0 / normal[(i, i)].sqrt()).collect();
    let (matrix, right) = bordered(&normal, &gradient, &datum(&network, &solution), &scale);
    let step = matrix.partial_piv_lu().solve(&right);
    // At the optimum of the dense system v'Pv is smaller by gᵀdx, to second order exactly.
    let reduction: f64 = (0..scale.len()).map(|i| gradient[i] * scale[i] * step[(i, 0)]).sum();
    println!("{} observed values, {} unknowns", solution.observations(), solution.unknowns());
    println!("v'Pv: eliminated {:.15e}, dense bordered {:.15e}", solution.vtpv(), vtpv - reduction);
    println!("relative difference {:.1e}", ((vtpv - reduction) / solution.vtpv() - 1.0).abs());
}

/// Normal equations of all unknowns at the solution.
struct System {
    normal: Mat<f64>,
    gradient: Vec<f64>,
    vtpv: f64,
}

fn system(network: &RangeCameraNetwork, solution: &Solution) -> System {
    let n = solution.unknowns();
    let (mut normal, mut gradient, mut vtpv) = (Mat::zeros(n, n), vec![0.0; n], 0.0);
    let column = |block: BlockId| solution.unknown_index(block, 0).unwrap().unwrap();
    let parameters = solution.values(network.parameters).unwrap();
    for (s, t, sighting) in &network.sightings {
        let (station, target) = (network.stations[*s], network.targets[*t]);
        let point = Vector3::from_column_slice(solution.values(target).unwrap());
        let (v, a) = sighting.linearise(&solution.pose(station).unwrap(), &point, parameters);
        let starts = [(column(station), 6), (column(target), 3), (column(network.parameters), 17)];
        let places: Vec<usize> = starts.iter().flat_map(|(start, width)| *start..start + width).collect();
        for i in 0..sighting.dimension {
            let residual = v[i] / SIGMAS[i];
            vtpv += residual * residual;
            for (j, &row) in places.iter().enumerate() {
                let entry = a[(i, j)] / SIGMAS[i];
                gradient[row] += entry * residual;
                for (k, &other) in places.iter().enumerate() {
                    normal[(row, other)] += entry * a[(i, k)] / SIGMAS[i];
                }
            }
        }
    }
    System { normal, gradient, vtpv }
}

/// Inner constraints on all targets: three shifts, three rotations.
fn datum(network: &RangeCameraNetwork, solution: &Solution) -> Mat<f64> {
    let mut g = Mat::zeros(solution.unknowns(), DEFECT);
    for &target in &network.targets {
        let row = solution.unknown_index(target, 0).unwrap().unwrap();
        let point = Vector3::from_column_slice(solution.values(target).unwrap());
        let turn = -point.cross_matrix();
        for axis in 0..3 {
            g[(row + axis, axis)] = 1.0;
            for about in 0..3 {
                g[(row + axis, 3 + about)] = turn[(axis, about)];
            }
        }
    }
    g
}

/// `[SNS G; Gᵀ 0]` and its right-hand side, in unknowns that make the diagonal one: v'Pv does not depend on which six
/// constraints remove the defect.
fn bordered(normal: &Mat<f64>, gradient: &[f64], g: &Mat<f64>, scale: &[f64]) -> (Mat<f64>, Mat<f64>) {
    let n = scale.len();
    let matrix = Mat::from_fn(n + DEFECT, n + DEFECT, |row, column| match (row < n, column < n) {
        (true, true) => normal[(row, column)] * scale[row] * scale[column],
        (true, false) => g[(row, column - n)],
        (false, true) => g[(column, row - n)],
        (false, false) => 0.0,
    });
    let right = Mat::from_fn(n + DEFECT, 1, |row, _| if row < n { gradient[row] * scale[row] } else { 0.0 });
    (matrix, right)
}
