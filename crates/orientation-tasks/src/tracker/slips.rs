//! What is wrong with a file of poses as a whole, told by what makes it fit.

use std::path::Path;

use nalgebra::{Quaternion, UnitQuaternion};
use orientation::{Error as Cause, MountingOptions, TimedPose, estimate_mounting};
use pipeline::Error;

use crate::known::Known;
use crate::request::TrackerOptions;

/// Units of time that files have for seconds.
const UNITS_OF_TIME: [(f64, &str); 3] = [(1e-3, "milliseconds"), (1e-6, "microseconds"), (1e-9, "nanoseconds")];

/// Part of the known stations' time that a tracker's must last in a unit that is thought of.
const ALIKE: f64 = 0.1;

/// A slip: what it is in words, and what undoes it.
type Slip = (&'static str, fn(&TimedPose) -> TimedPose);

const SLIPS: [Slip; 4] = [
    ("the positions are in millimetres, expected metres", |timed| {
        let mut changed = *timed;
        changed.pose.pose.translation.vector *= 1e-3;
        changed
    }),
    ("the quaternions stand with w first, expected x y z w", |timed| {
        let mut changed = *timed;
        let q = timed.pose.pose.rotation.coords;
        changed.pose.pose.rotation = UnitQuaternion::new_normalize(Quaternion::new(q.x, q.y, q.z, q.w));
        changed
    }),
    ("the poses lead from the world to what was tracked, expected the other way round", |timed| {
        let mut changed = *timed;
        changed.pose.pose = timed.pose.pose.inverse();
        changed
    }),
    ("the rotations lead from the world to what was tracked, expected the other way round", |timed| {
        let mut changed = *timed;
        changed.pose.pose.rotation = timed.pose.pose.rotation.inverse();
        changed
    }),
];

fn wrong(path: &Path, message: &str) -> Error {
    Error::Request { command: "orient", message: format!("{}: {message}", path.display()) }
}

/// Refuses clocks that have nothing in common.
///
/// # Errors
/// [`Error::Request`] with both spans, and the unit that would make them overlap.
pub(crate) fn require_common_time(
    path: &Path,
    carrier: &[TimedPose],
    known: &Known,
    options: &TrackerOptions,
) -> Result<(), Error> {
    let span = |poses: &[TimedPose]| poses.first().zip(poses.last()).map(|(first, last)| [first.time_s, last.time_s]);
    let (Some([first, last]), Some([from, to])) = (span(carrier), span(&known.poses)) else {
        return Err(wrong(path, "has no poses"));
    };
    let slack = options.time_offset_within_s.unwrap_or(0.0);
    let overlap = |unit: f64| first * unit <= to + slack && last * unit >= from - slack;
    if overlap(1.0) {
        return Ok(());
    }
    // Another epoch may shrink into the span as well, but to a moment.
    let lasts = |unit: f64| (last - first) * unit >= ALIKE * (to - from);
    let unit = UNITS_OF_TIME.iter().find(|(unit, _)| overlap(*unit) && lasts(*unit));
    let words = format!(
        "the clocks do not overlap: the tracker's poses are of {first} to {last} s, the known stations of {from} to {to} s; {}",
        match unit {
            Some((_, name)) => format!("its times are {name}, expected seconds"),
            None =>
                "bring both to one clock; a difference that is not known exactly is found with --time-offset-within"
                    .to_owned(),
        }
    );
    Err(wrong(path, &words))
}

/// Why there is no mounting: the slip that would explain it, or what the estimation says.
pub(crate) fn explained(
    path: &Path,
    carrier: &[TimedPose],
    known: &Known,
    options: &MountingOptions,
    error: Cause,
) -> Error {
    match &error {
        Cause::InvalidOption { .. } => return Error::Request { command: "orient", message: error.to_string() },
        Cause::InvalidPose { what, index, reason } => {
            let words = format!("{what} pose {index}: {reason}");
            return Error::Request { command: "orient", message: words };
        }
        Cause::TooFewPoses { .. } => {
            let fits = |(unit, _): &&(f64, &str)| {
                let scaled = |timed: &TimedPose| TimedPose { time_s: timed.time_s * unit, ..*timed };
                estimate_mounting(&carrier.iter().map(scaled).collect::<Vec<_>>(), &known.poses, options).is_ok()
            };
            if let Some((_, name)) = UNITS_OF_TIME.iter().find(fits) {
                return wrong(path, &format!("its times are {name}, expected seconds ({error})"));
            }
        }
        _ => {
            let fits = |(_, undo): &&Slip| {
                let changed: Vec<TimedPose> = carrier.iter().map(undo).collect();
                estimate_mounting(&changed, &known.poses, options).is_ok()
            };
            if let Some((words, _)) = SLIPS.iter().find(fits) {
                return wrong(path, &format!("{words} ({error})"));
            }
        }
    }
    Error::estimation("orientation by a tracker", path)(error)
}
