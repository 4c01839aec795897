//! A hand before a wall: what scattering does to the wall's range, and what remains after restoration.
#![allow(clippy::print_stdout)]

use range_image::{ComplexChannel, ComplexFrame, Modulation, PhaseConvention, Raster};
use scattering_deconvolution::{GaussianTerm, Psf, RestorationOptions, Scatterer, restore};

const WIDTH: usize = 176;
const HEIGHT: usize = 144;
const WALL_M: f64 = 3.5;
const HAND_M: f64 = 0.6;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let modulation = Modulation::new(20e6)?;
    for weight in [0.01, 0.06, 0.15] {
        let psf = Psf::Gaussians(vec![
            GaussianTerm { weight: 0.3 * weight, sigma_px: [10.0, 10.0] },
            GaussianTerm { weight: 0.7 * weight, sigma_px: [45.0, 35.0] },
        ]);
        let mut frame = hand_before_wall(modulation)?;
        let channel = &mut frame.channels[0];
        let mut scatterer = Scatterer::new(&psf, WIDTH, HEIGHT)?;
        scatterer.apply(channel.real.as_mut_slice(), channel.imaginary.as_mut_slice())?;
        let before = mean_wall_error(channel);
        let summaries = restore(&mut frame, &psf, &RestorationOptions::default())?;
        let after = mean_wall_error(&frame.channels[0]);
        println!(
            "{:2.0} % scattered: wall wrong by {:6.1} mm, after restoration by {:.2} mm ({} iterations, nodes every {:?} px)",
            100.0 * weight,
            1e3 * before,
            1e3 * after,
            summaries[0].iterations,
            summaries[0].grid_spacing
        );
    }
    Ok(())
}

fn is_hand(col: usize, row: usize) -> bool {
    (60..100).contains(&col) && row > 70
}

fn hand_before_wall(modulation: Modulation) -> Result<ComplexFrame, range_image::Error> {
    let range = |col, row| if is_hand(col, row) { HAND_M } else { WALL_M };
    let phase = Raster::from_fn(WIDTH, HEIGHT, |col, row| modulation.phase_from_range(range(col, row)) as f32);
    let amplitude = Raster::from_fn(WIDTH, HEIGHT, |col, row| if is_hand(col, row) { 2500.0 } else { 80.0 });
    ComplexFrame::from_phase(vec![modulation], vec![phase], vec![amplitude], &PhaseConvention::default())
}

fn mean_wall_error(channel: &ComplexChannel) -> f64 {
    let phase = channel.phase();
    let wall =
        (0..HEIGHT).flat_map(|row| (0..WIDTH).map(move |col| (col, row))).filter(|&(col, row)| !is_hand(col, row));
    let errors = wall.map(|pixel| (channel.modulation.range_from_phase(f64::from(phase[pixel])) - WALL_M).abs());
    let (count, sum) = errors.fold((0.0, 0.0), |(count, sum), error| (count + 1.0, sum + error));
    sum / count
}
