//! Targets in images: OpenCV's checkerboards beside `targets`, on the same simulated images.

use super::environment::{Environment, Example, Figures};
use super::table::{Bars, Folder, head, number};
use crate::shell::Outcome;

/// Kinds of images, each at both sizes.
const KINDS: [(&str, &str); 8] = [
    ("plain", "tilt to 30°, noise 1 %"),
    ("tilted", "tilt 35° to 60°"),
    ("noisy", "noise 6 %"),
    ("blurred", "blur 1.3 to 1.5 pixel"),
    ("fields", "small fields"),
    ("dark", "corners of the image at a tenth of the light"),
    ("hidden", "an arm over the board"),
    ("outside", "up to 30 pixels outside"),
];
const SIZES: [(&str, &str, usize); 2] = [("small", "176x144", 50), ("large", "640x480", 14)];
/// Seeds that nothing was tuned on.
const FIRST_SEED: &str = "900000";
const FINDERS: [&str; 3] = ["sb", "sb_exhaustive", "classic"];
/// `cornerSubPix` with half windows; 0 is a third of the least distance of neighbours.
const REFINED: [&str; 6] = ["subpix_2", "subpix_3", "subpix_5", "subpix_8", "subpix_11", "subpix_0"];

/// Nodes of the board.
const NODES: f64 = 54.0;

/// What was reached over the images of a kind.
struct Reached {
    found: f64,
    rms_px: f64,
    wrong: f64,
    /// Mean, median, 95 %.
    ms: [f64; 3],
}

pub(crate) fn run() -> Outcome {
    let Some(environment) = Environment::if_possible("targets") else { return Ok(()) };
    let ours = Example::build("targets", "peers_boards")?;
    head(&[
        "9 x 6, size, kind",
        "found, ours",
        "SB",
        "SB exhaustive",
        "classic",
        "rms px, ours",
        "SB",
        "best cornerSubPix",
        "its half window",
        "squared errors over covariance",
        "wrong nodes, ours",
        "OpenCV",
        "CPU ms, ours: mean, median, 95 %",
        "SB",
        "classic with cornerSubPix",
    ]);
    let mut bars = Bars::default();
    for (size, shown, count) in SIZES {
        for (kind, words) in KINDS {
            compare(&environment, &ours, (&format!("{size}_{kind}"), &format!("{shown}, {words}"), count), &mut bars)?;
        }
    }
    bars.print();
    Ok(())
}

fn compare(
    environment: &Environment,
    example: &Example,
    (case, shown, count): (&str, &str, usize),
    bars: &mut Bars,
) -> Outcome {
    let folder = Folder::new("targets")?;
    let (path, images, count) = (folder.text(), count as f64, count.to_string());
    let (ours, squared) = own(&example.call(&[&path, case, &count, FIRST_SEED])?);
    let answer = environment.call("targets_peers.py", &[&path, &count])?;
    folder.remove()?;
    let peer = |name: &str| theirs(&answer[name]);
    let [sb, exhaustive, classic] = FINDERS.map(peer);
    let refined = REFINED.map(|name| (name, peer(name)));
    // A window that loses corners to their neighbours is no better for the rest; one in a hundred is let pass.
    let few = |reached: &Reached| reached.wrong <= 0.01 * reached.found * NODES * images;
    let usable = refined.iter().filter(|(_, reached)| reached.found > 0.0 && few(reached));
    let best = usable.min_by(|a, b| a.1.rms_px.total_cmp(&b.1.rms_px));
    let least = FINDERS.map(peer).into_iter().filter(few).map(|reached| reached.rms_px);
    let best_rms = least.chain(best.map(|(_, reached)| reached.rms_px)).fold(f64::INFINITY, f64::min);
    let most_found = [&sb, &exhaustive, &classic].iter().map(|reached| reached.found).fold(0.0, f64::max);
    let three = |ms: [f64; 3]| ms.map(number).join(", ");
    let cells = [
        number(ours.found),
        number(sb.found),
        number(exhaustive.found),
        number(classic.found),
        number(ours.rms_px),
        number(sb.rms_px),
        best.map_or("-".to_owned(), |(_, reached)| number(reached.rms_px)),
        best.map_or("-", |(name, _)| name.trim_start_matches("subpix_")).to_owned(),
        number(squared),
        number(ours.wrong),
        number(sb.wrong + exhaustive.wrong),
        three(ours.ms),
        three(sb.ms),
        best.map_or("-".to_owned(), |(_, reached)| three(reached.ms)),
    ];
    println!("| {shown} | {} |", cells.join(" | "));
    bars.at_least(&format!("found, less what OpenCV finds, {shown}"), 0.0, ours.found - most_found);
    if best_rms.is_finite() {
        bars.at_most(&format!("error over OpenCV's best, {shown}"), 0.8, ours.rms_px / best_rms);
    }
    bars.at_most(&format!("wrong nodes, {shown}"), 0.0, ours.wrong);
    Ok(())
}

/// Ours, and the mean of squared errors over their covariance.
fn own(printed: &Figures) -> (Reached, f64) {
    // found, nodes, visible, wrong, rms, squared, ms behind the number of the board.
    let boards = printed.lines("board");
    let found = || boards.iter().filter(|board| board[1] > 0.0);
    let nodes: f64 = found().map(|board| board[2]).sum();
    let weighted = |place: fn(&[f64]) -> f64| found().map(|board| board[2] * place(board)).sum::<f64>() / nodes;
    let mut ms: Vec<f64> = boards.iter().map(|board| board[7]).collect();
    ms.sort_by(f64::total_cmp);
    let count = boards.len();
    let reached = Reached {
        found: found().count() as f64 / count as f64,
        rms_px: weighted(|board| board[5] * board[5]).sqrt(),
        wrong: found().map(|board| board[4]).sum(),
        ms: [ms.iter().sum::<f64>() / count as f64, ms[count / 2], ms[(count - 1) * 95 / 100]],
    };
    (reached, weighted(|board| board[6]))
}

fn theirs(figures: &serde_json::Value) -> Reached {
    let figure = |name: &str| figures[name].as_f64().unwrap_or(f64::NAN);
    let ms = ["ms", "ms_median", "ms_95"].map(figure);
    Reached { found: figure("found"), rms_px: figure("rms_px"), wrong: figure("wrong"), ms }
}
