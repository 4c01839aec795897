//! What scattering does to the ranges of scenes, and what remains after restoration with the known point spread
//! function: prints `name before_mm after_mm share`, the last being the share of the mean range error that is gone.
//!
//! Names are scene, point spread function, percent of scattered light and size. The last lines restore images that were
//! not scattered at all: with no point spread function nothing changes; with one, what it believes in is taken off.
#![allow(clippy::print_stdout)]

#[path = "../tests/common/scenes.rs"]
mod scenes;

use scattering_deconvolution::{RestorationOptions, restore};
use scenes::{PSFS, SCENES, mean_error_mm, psf, scatter, scene};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for size in [[176, 144], [640, 480]] {
        for weight in [0.01, 0.03, 0.06, 0.1, 0.15] {
            for name in SCENES {
                for psf_name in PSFS {
                    run(name, psf_name, size, weight, weight)?;
                }
            }
        }
        for weight in [0.0, 0.01, 0.06] {
            for name in SCENES {
                run(name, "round", size, 0.0, weight)?;
            }
        }
    }
    Ok(())
}

/// Scatters with one weight and restores with another.
fn run(
    name: &str,
    psf_name: &str,
    [width, height]: [usize; 2],
    weight: f64,
    assumed: f64,
) -> Result<(), Box<dyn std::error::Error>> {
    let (mut frame, range) = scene(name, width, height)?;
    scatter(&mut frame, &psf(psf_name, weight, width))?;
    let before = mean_error_mm(&frame.channels[0], &range);
    restore(&mut frame, &psf(psf_name, assumed, width), &RestorationOptions::default())?;
    let after = mean_error_mm(&frame.channels[0], &range);
    let text = format!("{name}/{psf_name}/{:.0}%/{width}x{height}", 1e2 * weight);
    if weight > 0.0 {
        println!("{text} {before:.3} {after:.4} {:.5}", 1.0 - after / before);
    } else {
        println!("{text}/restored_with_{:.0}% {before:.3} {after:.4} nan", 1e2 * assumed);
    }
    Ok(())
}
