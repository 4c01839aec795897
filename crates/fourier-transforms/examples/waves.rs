//! Which waves a line of numbers consists of.

#![allow(clippy::print_stdout)]

use fourier_transforms::num_complex::Complex;
use fourier_transforms::{DoublePlanner, FftDirection};

fn main() {
    let length = 60_u32;
    let at = |k: u32, waves: f64| (std::f64::consts::TAU * waves * f64::from(k) / f64::from(length)).cos();
    let mut line: Vec<_> = (0..length).map(|k| Complex::new(2.0 * at(k, 3.0) + 0.5 * at(k, 10.0), 0.0)).collect();
    DoublePlanner::new().plan(line.len(), FftDirection::Forward).process(&mut line);
    for (waves, value) in line.iter().take(line.len() / 2).enumerate().filter(|(_, value)| value.norm() > 1e-9) {
        println!("{waves:2} waves: amplitude {:.3}", 2.0 * value.norm() / line.len() as f64);
    }
}
