//! What `cargo xtask peers scattering` measures of this crate: restoration of one complex image.
//!
//! `peers_restore WIDTH HEIGHT FOLDER WEIGHT SIGMA [WEIGHT SIGMA ...]` reads real.f32 and imaginary.f32 (numbers in the
//! machine's own order), takes off what the Gaussians scatter: at every pixel, on the wide grid, and there with a
//! tolerance of 1e-3 instead of 1e-5. Writes the results as `ours_every_pixel_*.f32`, `ours_automatic_*.f32` and
//! `ours_coarse_*.f32`, and prints the least CPU time of this thread in milliseconds
//! (Linux).
#![allow(clippy::print_stdout)]

#[path = "../../../xtask/peers/cpu_clock.rs"]
mod cpu_clock;

use std::error::Error;
use std::path::Path;

use cpu_clock::cpu_seconds;
use scattering_deconvolution::{GaussianTerm, GridSpacing, Psf, RestorationOptions, Restorer};

type Outcome = Result<(), Box<dyn Error + Send + Sync>>;
type Plane = Vec<f32>;

fn main() -> Outcome {
    // One thread, so that its CPU time is all there is.
    rayon::ThreadPoolBuilder::new().num_threads(1).build()?.install(run)
}

fn run() -> Outcome {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [width, height, folder, terms @ ..] = words.as_slice() else {
        return Err("usage: peers_restore WIDTH HEIGHT FOLDER WEIGHT SIGMA [WEIGHT SIGMA ...]".into());
    };
    let (width, height, folder) = (width.parse()?, height.parse()?, Path::new(folder));
    let mut gaussians = Vec::new();
    for term in terms.as_chunks::<2>().0 {
        let sigma = term[1].parse()?;
        gaussians.push(GaussianTerm { weight: term[0].parse()?, sigma_px: [sigma, sigma] });
    }
    let psf = Psf::Gaussians(gaussians);
    let observed = [read(&folder.join("real.f32"))?, read(&folder.join("imaginary.f32"))?];
    let default = RestorationOptions::default();
    for (name, options) in [
        ("ours_every_pixel", RestorationOptions { grid_spacing: GridSpacing::EveryPixel, ..default }),
        ("ours_automatic", default),
        ("ours_coarse", RestorationOptions { tolerance: 1e-3, ..default }),
    ] {
        let mut restorer = Restorer::new(&psf, width, height, &options)?;
        let [real, imaginary] = measure(name, &mut restorer, &observed)?;
        write(&folder.join(format!("{name}_real.f32")), &real)?;
        write(&folder.join(format!("{name}_imaginary.f32")), &imaginary)?;
    }
    Ok(())
}

/// Restores fresh copies again and again, until half a second is over.
fn measure(
    name: &str,
    restorer: &mut Restorer,
    observed: &[Plane; 2],
) -> Result<[Plane; 2], Box<dyn Error + Send + Sync>> {
    let [mut real, mut imaginary] = observed.clone();
    let (mut least, mut spent) = (f64::NAN, 0.0);
    while spent < 0.5 {
        real.copy_from_slice(&observed[0]);
        imaginary.copy_from_slice(&observed[1]);
        let start = cpu_seconds();
        restorer.restore_planes(&mut real, &mut imaginary)?;
        let seconds = cpu_seconds() - start;
        least = f64::min(least, seconds);
        spent += seconds.max(1e-3);
    }
    println!("{name} {}", 1e3 * least);
    Ok([real, imaginary])
}

fn read(path: &Path) -> Result<Plane, String> {
    let bytes = std::fs::read(path).map_err(|error| format!("{}: {error}", path.display()))?;
    Ok(bytes.as_chunks().0.iter().map(|&bytes| f32::from_ne_bytes(bytes)).collect())
}

fn write(path: &Path, plane: &[f32]) -> std::io::Result<()> {
    std::fs::write(path, plane.iter().flat_map(|value| value.to_ne_bytes()).collect::<Vec<u8>>())
}
