//! Calibrates a camera from the corners of a checkerboard, with the quality of every number.
//!
//! `checkerboard CORNERS.csv [WIDTH HEIGHT]`: columns `image,x,y,col,row`, the board in any unit of length.
#![allow(clippy::print_stdout)]

mod plumb_bob;
mod start;

use std::error::Error;
use std::time::Instant;

use adjust::{Adjustment, BlockId, Covariance, ParameterBlock, Scale, Solution, SolveOptions};
use nalgebra::Point3;

type Corner = ([f64; 2], [f64; 2]);

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or("usage: checkerboard CORNERS.csv [WIDTH HEIGHT]")?;
    let size = [arguments.next().map_or(Ok(640.0), |w| w.parse())?, arguments.next().map_or(Ok(480.0), |h| h.parse())?];
    let images = read(&path)?;
    let seconds = Instant::now();
    let (camera, solution) = calibrate(&images, size)?;
    let seconds = seconds.elapsed().as_secs_f64();
    report(camera, &solution, &images)?;
    println!("seconds {seconds:.6}");
    Ok(())
}

/// Corners of each image.
fn read(path: &str) -> Result<Vec<Vec<Corner>>, Box<dyn Error>> {
    let mut images: Vec<Vec<Corner>> = Vec::new();
    for (number, line) in std::fs::read_to_string(path)?.lines().enumerate().skip(1) {
        let fields: Result<Vec<f64>, _> = line.split(',').map(|field| field.trim().parse::<f64>()).collect();
        let &[image, x, y, col, row] = fields.map_err(|e| format!("{path}:{}: {e}", number + 1))?.as_slice() else {
            return Err(format!("{path}:{}: five numbers are needed", number + 1).into());
        };
        images.resize(images.len().max(image as usize + 1), Vec::new());
        images[image as usize].push(([x, y], [col, row]));
    }
    Ok(images)
}

fn calibrate(images: &[Vec<Corner>], [width, height]: [f64; 2]) -> Result<(BlockId, Solution), Box<dyn Error>> {
    let mut a = Adjustment::new();
    let (f, centre) = (width, [(width - 1.0) / 2.0, (height - 1.0) / 2.0]);
    let values = [f, f, centre[0], centre[1], 0.0, 0.0, 0.0, 0.0, 0.0];
    let camera = a.add_block(ParameterBlock::euclidean(values).with_parameter_names(plumb_bob::NAMES));
    let group = a.add_group("corners");
    // A pixel: the deviations of the report are scaled with sigma0, which tells how well the corners really were found.
    let covariance = Covariance::from_sigmas(&[1.0; 2]);
    for (index, corners) in images.iter().enumerate() {
        let pose = start::pose(corners, f, centre).ok_or("no start values for the pose of a board")?;
        let pose = a.add_block(ParameterBlock::pose(&pose).named(format!("camera_from_board {index}")));
        for ([x, y], observed) in corners {
            let board = Point3::new(*x, *y, 0.0);
            let point = plumb_bob::ImagePoint { blocks: [pose, camera], board, observed: *observed };
            a.add_observation(group, point, &covariance)?;
        }
    }
    Ok((camera, a.solve(&SolveOptions::default())?))
}

fn report(camera: BlockId, solution: &Solution, images: &[Vec<Corner>]) -> Result<(), Box<dyn Error>> {
    let deviations = solution.standard_deviations(camera, Scale::Posterior)?;
    for ((name, value), deviation) in plumb_bob::NAMES.iter().zip(solution.values(camera)?).zip(&deviations) {
        println!("{name} {value:.12e} {deviation:.12e}");
    }
    let points: usize = images.iter().map(Vec::len).sum();
    println!("rms {:.9}", (solution.vtpv() / points as f64).sqrt());
    println!("sigma0 {:.9}", solution.sigma0().unwrap_or(f64::NAN));
    println!("redundancy {}", solution.redundancy());
    println!("iterations {}", solution.iterations());
    let standardised = solution.standardised_residuals(Scale::Posterior)?;
    let mut row = 0;
    for (image, corners) in images.iter().enumerate() {
        for corner in 0..corners.len() {
            for component in ["col", "row"] {
                if standardised[row].abs() > 3.29 {
                    println!("outlying {image} {corner} {component} {:.4}", standardised[row]);
                }
                row += 1;
            }
        }
    }
    Ok(())
}
