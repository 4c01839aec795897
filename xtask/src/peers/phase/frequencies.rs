//! Several frequencies: the remainder search in NumPy beside ours.

use super::{Image, Stage};
use crate::peers::table::{Bars, Folder, Least, head, row};
use crate::shell::Outcome;

const SPEED_OF_LIGHT: f64 = 299_792_458.0;
const SIGMAS: [&str; 3] = ["0.1", "0.3", "0.6"];
/// The highest first; 120, 80 and 16 MHz are the Kinect's.
const SETS: [&[&str]; 3] = [&["80e6", "60e6"], &["100e6", "80e6"], &["120e6", "80e6", "16e6"]];
const NAMES: [(&str, &str); 2] = [("crt", "NumPy, pixel by pixel"), ("ours_pixels", "`phase-unwrap`")];

pub(super) fn run(stage: &Stage, bars: &mut Bars) -> Outcome {
    println!("── several frequencies");
    let mut least = Least::default();
    for hz in SETS {
        for sigma in SIGMAS {
            compare(stage, hz, sigma, &mut least)?;
        }
    }
    head(&["counts right, 640x480, far sigma, rad", "0.1", "0.3", "0.6", "CPU ms at 0.3"]);
    for hz in SETS {
        for (who, name) in NAMES {
            let mut figures: Vec<f64> =
                SIGMAS.iter().map(|sigma| least.get(&case(hz, sigma), who, "absolute")).collect();
            figures.push(least.get(&case(hz, "0.3"), who, "ms"));
            row(&format!("{}: {name}", hz.join(", ").replace("e6", " MHz")), &figures);
        }
    }
    println!(
        "\nFor comparison, as published: libfreenect2's decoder takes 19 to 22 ms without filters, 54 to 67 ms with, for \
         512x424 pixels and three frequencies, demodulation of three samples each included."
    );
    for (sigma, bar) in SIGMAS.iter().zip([0.998, 0.987, 0.967]) {
        let right = SETS.iter().map(|hz| least.get(&case(hz, sigma), "ours_pixels", "absolute"));
        let worst = right.fold(f64::INFINITY, f64::min);
        bars.at_least(&format!("several frequencies, right, far sigma {sigma}, least of three sets"), bar, worst);
    }
    Ok(())
}

fn case(hz: &[&str], sigma: &str) -> String {
    format!("{} {sigma}", hz.join(" "))
}

fn compare(stage: &Stage, hz: &[&str], sigma: &str, least: &mut Least) -> Outcome {
    let folder = Folder::new("frequencies")?;
    let image = Image { case: case(hz, sigma), size: ["640", "480"].map(str::to_owned), folder: &folder.text() };
    let own = |command: &'static str, rest: &[&str]| {
        let mut arguments = vec![command, "640", "480", image.folder];
        arguments.extend(rest);
        arguments.extend(hz);
        stage.ours.call(&arguments)
    };
    own("phases", &[sigma])?;
    let metres = |hz: &&str| (SPEED_OF_LIGHT / 2.0 / hz.parse::<f64>().unwrap_or(f64::NAN)).to_string();
    let intervals: Vec<String> = hz.iter().map(metres).collect();
    let intervals: Vec<&str> = intervals.iter().map(String::as_str).collect();
    for _ in 0..stage.runs {
        least.note_all(&image.case, &stage.script("frequencies", &image, &intervals)?);
        least.note_own(&image.case, "ours_pixels", "pixels", &own("frequencies", &[])?);
    }
    least.note_all(&image.case, &stage.script("judge", &image, &[])?);
    folder.remove()
}
