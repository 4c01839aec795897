//! Flags on pixels that are right, in both rooms of the example `false_flags`, of which this is the short version.

#[path = "../examples/false_flags/caster.rs"]
mod caster;
#[path = "../examples/false_flags/judge.rs"]
#[allow(dead_code)]
mod judge;
#[path = "../examples/false_flags/rooms.rs"]
mod rooms;

use judge::{count, count_of_sum};
use rooms::Amount;

type Failure = Box<dyn std::error::Error>;

/// Stations and seeds that no constant was chosen on.
const AMOUNT: Amount = Amount { stations: 1, frames: 64, seed: 2001, amplitude: 27.0 };

#[test]
fn more_frames_bring_no_false_flags() {
    for room in ["simulated", "attic"] {
        let folder = tempfile::tempdir().unwrap();
        let capture = match room {
            "simulated" => rooms::simulated(folder.path(), 5, AMOUNT),
            _ => rooms::cast(folder.path(), 5, &[30e6], AMOUNT),
        };
        let capture = capture.unwrap();
        for frames in [1, 4, 16, 64] {
            let counts = count(&capture, frames).unwrap();
            let of_sum = count_of_sum(&capture, frames).unwrap();
            let (above, bar) = (counts.is_above(&of_sum), counts.bar());
            let [share, of_sum] = [counts, of_sum].map(|counts| counts.share(counts.false_flags));
            println!("{room}, {frames} frames: {share:.4} false, as one {of_sum:.4}, allowed {bar:.4}");
            assert!(share < bar, "{room}, {frames} frames: {share}");
            assert!(!above, "{room}, {frames} frames: {share}, one of this noise {of_sum}");
        }
    }
}
