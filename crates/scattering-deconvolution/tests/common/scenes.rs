//! Scenes with high contrast in amplitude and depth, and point spread functions for them.

use std::f64::consts::{PI, TAU};

use range_image::{ComplexChannel, ComplexFrame, Modulation, PhaseConvention, Raster};
use scattering_deconvolution::{
    CompositePsf, Error, FieldPolynomial, FieldTerm, GaussianTerm, Ghost, GhostDelay, GhostPlace, Psf, Scatterer,
};

/// Names of the scenes.
pub const SCENES: [&str; 5] = ["corner_cut", "hand", "half", "retro_spots", "post_and_floor"];
/// Names of the point spread functions.
pub const PSFS: [&str; 3] = ["round", "elliptic", "field_and_ghosts"];

/// Range in metres and amplitude of a scene at relative image coordinates, 0 to 1.
fn seen(name: &str, x: f64, y: f64) -> (f64, f64) {
    let wall = (4.0 + 0.5 * x, 60.0);
    let spot = |a: f64, b: f64, radius: f64| (x - a).hypot(y - b) < radius;
    match name {
        // Cut by the left and the lower border.
        "corner_cut" if x < 0.33 && y > 0.5 => (0.8, 2000.0),
        // Reaches in from below.
        "hand" if (x - 0.5).abs() < 0.12 && y > 0.45 => (0.6, 2500.0),
        // Covers the left half, as in the experiments that found errors as large as the distance of the two objects.
        "half" if x < 0.5 => (0.8, 1500.0),
        // Retro-reflecting foil, one piece cut by the right border.
        "retro_spots" if spot(0.3, 0.3, 0.05) || spot(0.6, 0.7, 0.04) || spot(1.0, 0.4, 0.06) => (1.5, 8000.0),
        "post_and_floor" if (x - 0.7).abs() < 0.05 => (1.0, 1800.0),
        "post_and_floor" if y > 0.4 => (1.2 / (y - 0.1), 40.0 * (y - 0.1)),
        _ => wall,
    }
}

/// A frame of one frequency at 20 MHz without scattering, and its ranges.
pub fn scene(name: &str, width: usize, height: usize) -> Result<(ComplexFrame, Raster<f64>), range_image::Error> {
    let modulation = Modulation::new(20e6)?;
    let at = |col: usize, row: usize| seen(name, (col as f64 + 0.5) / width as f64, (row as f64 + 0.5) / height as f64);
    let texture = |col: usize, row: usize| 1.0 + 0.3 * ((col / 5 + row / 7) % 2) as f64;
    let range = Raster::from_fn(width, height, |col, row| at(col, row).0);
    let phase = range.map(|&range| modulation.phase_from_range(range).rem_euclid(TAU) as f32);
    let amplitude = Raster::from_fn(width, height, |col, row| (at(col, row).1 * texture(col, row)) as f32);
    let convention = PhaseConvention::default();
    Ok((ComplexFrame::from_phase(vec![modulation], vec![phase], vec![amplitude], &convention)?, range))
}

/// A point spread function that scatters `weight` over an image of such a width.
pub fn psf(name: &str, weight: f64, width: usize) -> Psf {
    let width = width as f64;
    let term = |share: f64, across: f64, down: f64| GaussianTerm {
        weight: share * weight,
        sigma_px: [across * width, down * width],
    };
    let slope = |linear| FieldPolynomial { linear, ..FieldPolynomial::default() };
    match name {
        "elliptic" => Psf::Gaussians(vec![term(0.5, 0.2, 0.08), term(0.5, 0.05, 0.1)]),
        "field_and_ghosts" => Psf::Composite(CompositePsf {
            stationary: vec![term(0.4, 0.2, 0.2)],
            field_terms: vec![
                FieldTerm { gaussian: term(0.2, 0.07, 0.07), received: slope([0.5, 0.0]), sent: slope([0.0, 0.3]) },
                FieldTerm { gaussian: term(0.2, 0.1, 0.06), received: slope([0.0, -0.4]), sent: slope([-0.3, 0.0]) },
            ],
            ghosts: vec![Ghost {
                weight: 0.2 * weight,
                place: GhostPlace::Mirrored([0.5 * width, 0.4 * width]),
                sigma_px: [0.05 * width, 0.05 * width],
                delay: GhostDelay::ExtraPath(0.06),
            }],
        }),
        _ => Psf::Gaussians(vec![term(0.33, 0.04, 0.04), term(0.67, 0.2, 0.2)]),
    }
}

/// Scatters all frequencies of a frame.
pub fn scatter(frame: &mut ComplexFrame, psf: &Psf) -> Result<(), Error> {
    let (width, height) = (frame.width(), frame.height());
    for channel in &mut frame.channels {
        let mut scatterer = Scatterer::new(&psf.at_modulation(&channel.modulation), width, height)?;
        scatterer.apply(channel.real.as_mut_slice(), channel.imaginary.as_mut_slice())?;
    }
    Ok(())
}

/// Mean absolute range error over all pixels, millimetres.
pub fn mean_error_mm(channel: &ComplexChannel, range: &Raster<f64>) -> f64 {
    let turn = |(phase, range): (&f32, &f64)| {
        let turn = f64::from(*phase) - channel.modulation.phase_from_range(*range);
        ((turn + PI).rem_euclid(TAU) - PI).abs()
    };
    let sum: f64 = channel.phase().as_slice().iter().zip(range.as_slice()).map(turn).sum();
    1e3 * channel.modulation.range_from_phase(sum / range.len() as f64)
}
