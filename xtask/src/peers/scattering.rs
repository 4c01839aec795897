//! Restoration: `scipy`, FFTW and OpenCV beside `scattering-deconvolution`, on the same image.

use super::environment::{Environment, Example};
use super::table::{Bars, Folder, Least, head, row};
use crate::shell::Outcome;

const SIZES: [(usize, usize); 3] = [(176, 144), (640, 480), (1024, 1024)];
const NAMES: [(&str, &str); 10] = [
    ("uncorrected", "uncorrected"),
    ("circular", "SciPy, circular"),
    ("scipy", "SciPy, padded"),
    ("scipy_short", "SciPy, padded by 2 sigma only"),
    ("scipy_real", "SciPy, padded, two real images"),
    ("fftw", "FFTW, padded"),
    ("fftw_short", "FFTW, padded by 2 sigma only"),
    ("opencv", "OpenCV, scattered twice"),
    ("ours_every_pixel", "`scattering-deconvolution`, every pixel"),
    ("ours_automatic", "`scattering-deconvolution`, wide grid"),
];
/// Those that pad as far as the Gaussians reach.
const PADDED: [&str; 3] = ["scipy", "scipy_real", "fftw"];
/// Mean range error that may be left, cm.
const ALLOWED_CM: f64 = 0.05;

pub(crate) fn run(runs: usize) -> Outcome {
    let Some(environment) = Environment::if_possible("scattering") else { return Ok(()) };
    let ours = Example::build("scattering-deconvolution", "peers_restore")?;
    let mut least = Least::default();
    for size in SIZES {
        compare(&environment, &ours, size, runs, &mut least)?;
    }
    print(&least);
    add_bars(&least).print();
    Ok(())
}

fn compare(
    environment: &Environment,
    ours: &Example,
    (width, height): (usize, usize),
    runs: usize,
    least: &mut Least,
) -> Outcome {
    let folder = Folder::new("scattered")?;
    let path = folder.text();
    let case = format!("{width}x{height}");
    println!("── {case}");
    // Six percent of the light, the wider Gaussian a fifth of the image.
    let wide = (width as f64 / 5.0).to_string();
    let sizes = [width.to_string(), height.to_string()];
    let [width, height] = sizes.each_ref().map(String::as_str);
    let psf = ["0.02", "12", "0.04", &wide];
    let script = |command: &'static str| {
        let arguments = [&[command, &path, width, height], psf.as_slice()].concat();
        environment.call("scattering_peers.py", &arguments)
    };
    least.note_all(&case, &script("scene")?);
    for _ in 0..runs {
        let printed = ours.call(&[&[width, height, path.as_str()], psf.as_slice()].concat())?;
        for who in ["ours_every_pixel", "ours_automatic"] {
            least.note(&case, who, "ms", printed.get(who, 0));
        }
        least.note_all(&case, &script("restore")?);
    }
    folder.remove()
}

fn print(least: &Least) {
    let cases: Vec<String> = SIZES.iter().map(|(width, height)| format!("{width}x{height}")).collect();
    let mut cells = vec!["6 % scattered, CPU ms".to_owned()];
    cells.extend(cases.iter().cloned());
    cells.extend(cases.iter().map(|case| format!("cm left, {case}")));
    head(&cells.iter().map(String::as_str).collect::<Vec<_>>());
    for (who, name) in NAMES {
        let figures = ["ms", "cm"].map(|figure| cases.iter().map(move |case| least.get(case, who, figure)));
        row(name, &figures.into_iter().flatten().collect::<Vec<_>>());
    }
}

fn add_bars(least: &Least) -> Bars {
    let mut bars = Bars::default();
    for (width, height) in &SIZES[1..] {
        let case = format!("{width}x{height}");
        let ours = least.get(&case, "ours_automatic", "ms");
        let best = PADDED.iter().map(|who| least.get(&case, who, "ms")).fold(f64::INFINITY, f64::min);
        bars.at_least(&format!("wide grid, times faster than the best padded peer, {case}"), 15.0, best / ours);
        let close =
            NAMES.iter().filter(|(who, _)| !who.starts_with("ours") && least.get(&case, who, "cm") <= ALLOWED_CM);
        let best = close.map(|(who, _)| least.get(&case, who, "ms")).fold(f64::INFINITY, f64::min);
        bars.at_least(&format!("the same, any peer within {ALLOWED_CM} cm, {case}"), 15.0, best / ours);
    }
    for (width, height) in SIZES {
        let case = format!("{width}x{height}");
        let left = least.get(&case, "ours_automatic", "cm");
        bars.at_most(&format!("wide grid, cm left, {case}"), ALLOWED_CM, left);
    }
    bars
}
