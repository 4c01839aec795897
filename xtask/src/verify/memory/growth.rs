//! What grows with the number of frames: the same commands on a survey of small frames and on one of three times as many.

use super::process::Taken;
use super::surveys::Surveys;
use super::{MOST_MB, measured, words};

/// Frames of the recording that must stay below [`MOST_MB`] as small frames tell it.
const MANY: f64 = 100_000.0;
/// The longer survey has so many times the frames of the shorter one.
const TIMES: usize = 3;
/// Processor time may grow by this beyond the frames: what is done once, and other work on the machine, change it by a tenth.
const SLOWER: f64 = 1.5;
/// Below this time (second) nothing is told of its growth.
const LEAST_S: f64 = 2.0;

/// Surveys by their begin, and commands.
const CASES: &[(&str, &[&str])] = &[
    ("one station", &["run", "--pipeline", "cloud.ron"]),
    ("stations of 10", &["run", "--pipeline", "cloud.ron"]),
    ("stations of one", &["run", "--pipeline", "cloud.ron"]),
    ("a warming camera", &["noise"]),
    ("stations of 10", &["noise"]),
    ("one station", &["fpn"]),
    ("stations of 10", &["fpn"]),
    ("a warming camera", &["warmup"]),
    ("a room", &["register", "--track"]),
];

/// What takes more than is allowed, in words.
pub(super) fn run(surveys: &Surveys<'_>, frames: usize) -> Result<Vec<String>, String> {
    let counts = [frames / TIMES, frames];
    surveys.write_small(&counts)?;
    println!(
        "{:<18} {:<20} {:>9} {:>12} {:>9} {:>12} {:>12}",
        "survey of 66x54", "command", "most, MB", "processor, s", "most, MB", "processor, s", "kB a frame"
    );
    println!("{:<39} {:>22} {:>22}", "", format!("{} frames", counts[0]), format!("{} frames", counts[1]));
    let mut beyond = Vec::new();
    for (survey, command) in CASES {
        let taken =
            |count: usize| measured(surveys.program, surveys.folder, command, &Surveys::small_name(survey, count));
        let [few, many] = [taken(counts[0])?, taken(counts[1])?];
        let a_frame_mb = many.most_mb.saturating_sub(few.most_mb) as f64 / (counts[1] - counts[0]) as f64;
        let words = words(command);
        println!(
            "{survey:<18} {words:<20} {:>9} {:>12.1} {:>9} {:>12.1} {:>12.1}",
            few.most_mb,
            few.seconds,
            many.most_mb,
            many.seconds,
            1e3 * a_frame_mb
        );
        let expected_mb = many.most_mb as f64 + a_frame_mb * (MANY - counts[1] as f64).max(0.0);
        if expected_mb > MOST_MB as f64 {
            beyond.push(format!("{words} on {survey}: {expected_mb:.0} MB for {MANY} frames"));
        }
        if is_slower(few, many) {
            beyond.push(format!(
                "{words} on {survey}: {:.1} s, and {:.1} s for {TIMES} times as many frames",
                few.seconds, many.seconds
            ));
        }
    }
    Ok(beyond)
}

/// Whether time grew by more than the frames.
fn is_slower(few: Taken, many: Taken) -> bool {
    few.seconds > LEAST_S && many.seconds > SLOWER * TIMES as f64 * few.seconds
}
