//! What grows with the number of frames: the same commands on surveys of small frames, of three lengths and, where asked for, of one
//! more.
//!
//! What is kept of pixels fills up with the frames and then stays: of more, one of every so many is taken, an odd number. The
//! lengths are odd multiples of the one at which that is full for the first time, so that it is as full in all of them, and what
//! still grows is what is kept of each frame. A straight line through the last two then tells what more frames take.

use super::process::Taken;
use super::surveys::Surveys;
use super::{MOST_MB, measured, words};

/// Frames of the recording that must stay below [`MOST_MB`] as small frames tell it.
const MANY: f64 = 100_000.0;
/// What so many frames may keep beside what a command takes for frames of 640x480 themselves, megabyte: 7 kB of each.
const MOST_GROWTH_MB: f64 = 700.0;
/// Processor time of a frame may grow by this: what is done once, and other work on the machine, change it by a tenth.
const SLOWER: f64 = 1.5;
/// Below this time (second) nothing is told of its growth.
const LEAST_S: f64 = 2.0;

/// A command on surveys of a kind, and their lengths.
struct Case {
    survey: &'static str,
    command: &'static [&'static str],
    frames: [usize; 3],
}

/// 2^21 values of `run` are 588 frames of 66x54 (1764 as means of three), 2^22 of `noise` 294 stations with four samples a pixel; 256
/// walls are 256 frames of one station, or as many stations.
const CASES: &[Case] = &[
    Case { survey: "one station", command: &["run", "--pipeline", "cloud.ron"], frames: [588, 1764, 5292] },
    Case { survey: "stations of 3", command: &["run", "--pipeline", "cloud.ron"], frames: [1764, 5292, 8820] },
    Case { survey: "stations of one", command: &["run", "--pipeline", "cloud.ron"], frames: [588, 1764, 5292] },
    Case { survey: "a warming camera", command: &["noise"], frames: [1000, 3000, 9000] },
    Case { survey: "stations of 10", command: &["noise"], frames: [2940, 8820, 26460] },
    Case { survey: "one station", command: &["fpn"], frames: [768, 2304, 6912] },
    Case { survey: "stations of 3", command: &["fpn"], frames: [768, 2304, 3840] },
    Case { survey: "a warming camera", command: &["warmup"], frames: [1000, 3000, 9000] },
    Case { survey: "a path", command: &["register", "--track"], frames: [1000, 3000, 9000] },
];

/// What a command took of so many frames.
#[derive(Debug, Clone, Copy)]
struct Length {
    frames: usize,
    taken: Taken,
}

/// What takes more than is allowed, in words; of cases that are called `only` so, with a survey of so many `frames` more.
pub(super) fn run(surveys: &Surveys<'_>, frames: Option<usize>, only: &str) -> Result<Vec<String>, String> {
    surveys.write_small()?;
    println!(
        "{:<17} {:<20} {:>7} {:>9} {:>13} {:>13} {:>12}",
        "frames of 66x54", "command", "frames", "most, MB", "processor, s", "ms a frame", "kB a frame"
    );
    let name = |case: &Case| format!("{} on {}", words(case.command), case.survey);
    if !CASES.iter().any(|case| name(case).contains(only)) {
        let names: Vec<String> = CASES.iter().map(name).collect();
        return Err(format!("no case is called `{only}`: {}", names.join(", ")));
    }
    let mut beyond = Vec::new();
    for case in CASES {
        let name = name(case);
        if !name.contains(only) {
            continue;
        }
        let mut lengths: Vec<Length> = Vec::new();
        for frames in case.frames.into_iter().chain(frames) {
            let survey = surveys.small(case.survey, frames)?;
            let taken = measured(surveys.program, surveys.folder, case.command, &survey)?;
            let length = Length { frames, taken };
            let a_frame = lengths.last().map(|before| format!("{:.2}", 1e3 * a_frame_mb(*before, length)));
            println!(
                "{:<17} {:<20} {frames:>7} {:>9} {:>13.1} {:>13.2} {:>12}  {}",
                case.survey,
                words(case.command),
                taken.most_mb,
                taken.seconds,
                1e3 * taken.seconds / frames as f64,
                a_frame.unwrap_or_default(),
                taken.code
            );
            lengths.push(length);
        }
        beyond.extend(judged(&lengths).into_iter().map(|words| format!("{name}: {words}")));
    }
    Ok(beyond)
}

/// What more frames take each, as two lengths show it, megabyte.
fn a_frame_mb(few: Length, many: Length) -> f64 {
    (many.taken.most_mb as f64 - few.taken.most_mb as f64) / (many.frames as f64 - few.frames as f64)
}

/// What is wrong with what a command took of surveys of ever more frames, in words.
fn judged(lengths: &[Length]) -> Vec<String> {
    let [first, .., few, many] = lengths else { return vec!["too few lengths".to_owned()] };
    let mut wrong = Vec::new();
    let a_frame_mb = a_frame_mb(*few, *many).max(0.0);
    let expected_mb = many.taken.most_mb as f64 + a_frame_mb * (MANY - many.frames as f64).max(0.0);
    if expected_mb > MOST_MB as f64 {
        wrong.push(format!("{expected_mb:.0} MB for {MANY} frames"));
    }
    if a_frame_mb * MANY > MOST_GROWTH_MB {
        wrong.push(format!("keeps {:.1} kB of each frame", 1e3 * a_frame_mb));
    }
    let a_frame_s = |length: &Length| length.taken.seconds / length.frames as f64;
    if first.taken.seconds > LEAST_S && a_frame_s(many) > SLOWER * a_frame_s(first) {
        wrong.push(format!(
            "{:.2} ms a frame of {}, and {:.2} of {}",
            1e3 * a_frame_s(first),
            first.frames,
            1e3 * a_frame_s(many),
            many.frames
        ));
    }
    wrong
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::process::{Command, Stdio};
    use std::time::Duration;

    use super::*;
    use crate::verify::memory::process::watched;

    fn lengths(of: impl Fn(usize) -> (u64, f64)) -> Vec<Length> {
        let length = |frames: usize| {
            let (most_mb, seconds) = of(frames);
            Length { frames, taken: Taken { most_mb, seconds, code: 0 } }
        };
        [1000, 3000, 9000].map(length).to_vec()
    }

    #[test]
    fn what_fills_up_passes_and_what_grows_does_not() {
        let millis = |frames: usize| 5e-3 * frames as f64;
        // Half a gigabyte of values from 2,000 frames on, and 1 kB of each frame.
        let full = |frames: usize| (50 + frames.min(2000) as u64 / 4 + frames as u64 / 1000, millis(frames));
        assert_eq!(judged(&lengths(full)), Vec::<String>::new());
        let leaks = |frames: usize| (50 + frames as u64 / 100, millis(frames));
        assert_eq!(judged(&lengths(leaks)), ["keeps 10.0 kB of each frame"]);
        let leaks = |frames: usize| (50 + frames as u64 / 20, millis(frames));
        assert_eq!(judged(&lengths(leaks)), ["5050 MB for 100000 frames", "keeps 50.0 kB of each frame"]);
        let slows = |frames: usize| (50, millis(frames) * (1.0 + 1e-4 * frames as f64));
        assert_eq!(judged(&lengths(slows)), ["5.50 ms a frame of 1000, and 9.50 of 9000"]);
    }

    /// Name of a variable: how many kilobytes of how many frames this test, run as a program of its own, keeps.
    const KEEPS: &str = "VERIFY_MEMORY_KEEPS";

    /// The program that the next test watches; by itself it does nothing.
    #[test]
    fn keeps_what_it_is_told_to() {
        let Ok(told) = std::env::var(KEEPS) else { return };
        let (frames, most) = told.split_once(' ').unwrap();
        let (frames, most): (usize, usize) = (frames.parse().unwrap(), most.parse().unwrap());
        let mut kept: Vec<Vec<u8>> = Vec::new();
        for frame in 0..frames {
            if kept.len() == most {
                kept.remove(0);
            }
            kept.push(vec![frame as u8 | 1; 30_000]);
        }
        // Looked at every 20 ms.
        std::thread::sleep(Duration::from_millis(100));
        assert!(kept.iter().all(|frame| frame[0] > 0));
    }

    #[test]
    fn a_program_that_leaks_is_found() {
        let taken = |frames: usize, most: usize| {
            let mut command = Command::new(std::env::current_exe().unwrap());
            command.args(["--exact", "verify::memory::growth::tests::keeps_what_it_is_told_to"]);
            command.env(KEEPS, format!("{frames} {most}")).stdout(Stdio::null()).stderr(Stdio::null());
            let (taken, output) = watched(command.spawn().unwrap()).unwrap();
            assert!(output.status.success());
            Length { frames, taken }
        };
        let of = |most: usize| judged(&[500, 1500, 2500].map(|frames| taken(frames, most)));
        assert_eq!(of(100), Vec::<String>::new());
        let leaks = of(usize::MAX);
        assert!(leaks.len() == 2 && leaks[1].ends_with("kB of each frame"), "{leaks:?}");
    }
}
