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
        for figure in ["u16", "f32", "polar"] {
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
        "greatest error of the phase, rad",
    ]);
    for (who, name) in [("numpy", "NumPy `arctan2`, `hypot`"), ("opencv", "OpenCV `cartToPolar`")] {
        row(name, &["u16", "f32", "polar", "error"].map(|figure| get(who, figure)));
    }
    let name = "`range-image`, with offset, sigma and flags";
    row(name, &[get("ours", "u16"), get("ours", "f32"), get("ours", "polar"), error]);
    let best = get("numpy", "polar").min(get("opencv", "polar"));
    bars.at_most("phase and amplitude, time over the fastest peer's", 1.0, get("ours", "polar") / best);
    bars.at_most("phase, greatest error, rad", 2e-6, error);
    Ok(())
}
