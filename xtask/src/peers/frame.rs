//! Frames as they come: a chain of Python libraries beside `live-frames`, on the same simulated moving scene.

use super::environment::{Environment, Example};
use super::table::{Bars, Folder, Least, head, number};
use crate::shell::Outcome;

/// Frames of the scene: four seconds at 30 Hz would take longer to simulate than to compare.
const FRAMES: &str = "60";
const SIZE: [&str; 2] = ["640", "480"];
const STAGES: [(&str, &str); 7] = [
    ("demodulate", "demodulated (NumPy, OpenCV)"),
    ("scattering", "scattered light taken off (FFTW, padded by 2 sigma)"),
    ("phase", "phase and amplitude (OpenCV)"),
    ("unwrap", "unwrapped (scikit-image)"),
    ("correct", "corrected, sigma (NumPy)"),
    ("points", "points (NumPy)"),
    ("track", "path (KISS-ICP, 10 cm)"),
];
const TIMES: [&str; 3] = ["ms", "median", "most"];

/// The chain is to take at least this many times as long, without and with the path: as long as its unwrapping alone takes beside the spanning tree.
const FASTER: f64 = 9.0;

pub(crate) fn run(runs: usize) -> Outcome {
    let Some(environment) = Environment::if_possible("frame") else { return Ok(()) };
    let ours = Example::build_with("live-frames", "peers_frame", &["tracking"])?;
    let folder = Folder::new("frame")?;
    let path = folder.text();
    let rest = [path.as_str(), FRAMES, SIZE[0], SIZE[1]];
    let with = |command| [&[command], rest.as_slice()].concat();
    println!("── {FRAMES} frames of {} x {} pixels", SIZE[0], SIZE[1]);
    ours.call(&with("simulate"))?;
    let mut least = Least::default();
    for _ in 0..runs {
        let printed = ours.call(&with("run"))?;
        for (place, name) in ["frame", "tracked"].into_iter().enumerate() {
            let times: Vec<f64> = printed.lines("frame").iter().map(|frame| frame[place]).collect();
            for (figure, value) in TIMES.into_iter().zip(quantiles(times)) {
                least.note("ours", name, figure, value);
            }
        }
        least.note_line("ours", "range", &["median_mm", "wrong", "sure_median_mm", "sure_wrong"], &printed);
        least.note_line("ours", "lost", &["frames"], &printed);
        least.note_all("ours", &environment.call("frame_peers.py", &with("path"))?);
        least.note_all("peers", &environment.call("frame_peers.py", &with("run"))?);
    }
    folder.remove()?;
    print(&least);
    Ok(())
}

/// Mean, median and 95 %.
fn quantiles(mut values: Vec<f64>) -> [f64; 3] {
    values.sort_by(f64::total_cmp);
    let count = values.len();
    let at = |share: f64| values.get(((count.max(1) - 1) as f64 * share).round() as usize).copied().unwrap_or(f64::NAN);
    [values.iter().sum::<f64>() / count as f64, at(0.5), at(0.95)]
}

fn print(least: &Least) {
    head(&["CPU ms a frame, 640x480, four samples, one frequency", "mean", "median", "95 %"]);
    let row = |name: &str, case: &str, stage: &str| {
        let cells = TIMES.map(|figure| number(least.get(case, stage, figure)));
        println!("| {name} | {} |", cells.join(" | "));
    };
    for (stage, name) in STAGES {
        row(name, "peers", stage);
    }
    row("**the chain, to points with sigma**", "peers", "frame");
    row("**the same with the path**", "peers", "tracked");
    row("**`live-frames`, to points with sigma and flags**", "ours", "frame");
    row("**the same with the path**", "ours", "tracked");
    head(&["errors against the truth", "range, median mm", "wrong counts, %", "path, rms mm", "lost frames"]);
    let get = |case: &str, who: &str, figure: &str| number(least.get(case, who, figure));
    let error = |figure: &str| get("peers", "errors", figure);
    println!(
        "| the chain, counts anchored by the truth | {} | {} | {} | - |",
        error("median_mm"),
        error("wrong"),
        error("path_mm")
    );
    let [range, wrong, sure, sure_wrong] =
        ["median_mm", "wrong", "sure_median_mm", "sure_wrong"].map(|figure| get("ours", "range", figure));
    let (found, lost) = (get("ours", "errors", "path_mm"), get("ours", "lost", "frames"));
    println!("| `live-frames` | {range} | {wrong} | {found} | {lost} |");
    println!("| `live-frames`, counts that are sure | {sure} | {sure_wrong} | | |");
    let mut bars = Bars::default();
    for (name, words) in [("frame", "to points"), ("tracked", "with the path")] {
        let ratio = least.get("peers", name, "ms") / least.get("ours", name, "ms");
        bars.at_least(&format!("times faster than the chain, {words}"), FASTER, ratio);
    }
    let wrong = least.get("ours", "range", "wrong") / least.get("peers", "errors", "wrong");
    bars.at_most("wrong counts over the chain's", 1.0, wrong);
    let path = least.get("ours", "errors", "path_mm") / least.get("peers", "errors", "path_mm");
    bars.at_most("error of the path over the chain's", 1.0, path);
    bars.print();
}
