//! Demodulation of four samples: NumPy and OpenCV beside `range-image`.

use super::{Image, Stage};
use crate::peers::environment::Example;
use crate::peers::table::{Bars, Folder, Least, head, row};
use crate::shell::Outcome;

pub(super) fn run(stage: &Stage, bars: &mut Bars) -> Outcome {
    println!("── demodulation");
    let ours = Example::build("range-image", "peers_demodulate")?;
    let folder = Folder::new("samples")?;
    let image = Image { case: "samples".to_owned(), size: ["640", "480"].map(str::to_owned), folder: &folder.text() };
    let mut least = Least::default();
    stage.script("samples", &image, &[])?;
    for _ in 0..stage.runs {
        let printed = ours.call(&["640", "480", image.folder])?;
        for figure in ["u16", "f32", "polar", "straight_u16", "straight_f32"] {
            least.note(&image.case, "ours", figure, printed.get(figure, 0));
        }
        least.note_all(&image.case, &stage.script("demodulate", &image, &[])?);
    }
    folder.remove()?;
    let get = |who: &str, figure: &str| least.get(&image.case, who, figure);
    let error = get("ours_u16", "error").max(get("ours_f32", "error"));
    head(&[
        "four samples, 640x480, CPU ms",
        "complex image, u16",
        "complex image, f32",
        "phase and amplitude of it",
        "both, u16",
        "both, f32",
        "greatest error of the phase, rad",
    ]);
    for (who, name, error) in [
        ("numpy", "NumPy `arctan2`, `hypot`", get("numpy", "error")),
        ("opencv", "OpenCV `cartToPolar`", get("opencv", "error")),
        ("ours", "`range-image`, with offset, sigma and flags", error),
    ] {
        let [u16, f32, polar] = ["u16", "f32", "polar"].map(|figure| get(who, figure));
        row(name, &[u16, f32, polar, u16 + polar, f32 + polar, error]);
    }
    let straight = ["straight_u16", "straight_f32"].map(|figure| get("ours", figure));
    row(
        "`range-image`, straight to phase and amplitude",
        &[f64::NAN, f64::NAN, f64::NAN, straight[0], straight[1], error],
    );
    for (kind, straight) in [("u16", straight[0]), ("f32", straight[1])] {
        let best = ["numpy", "opencv"].map(|who| get(who, kind) + get(who, "polar"));
        let ratio = straight / best[0].min(best[1]);
        bars.at_most(&format!("samples {kind} to phase and amplitude, time over the fastest peer's"), 1.0, ratio);
    }
    let best = get("numpy", "polar").min(get("opencv", "polar"));
    bars.at_most(
        "complex image to phase and amplitude, time over the fastest peer's",
        1.0,
        get("ours", "polar") / best,
    );
    bars.at_most("phase, greatest error, rad", 2e-6, error);
    Ok(())
}
