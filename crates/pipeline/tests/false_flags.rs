//! Flags on pixels that are right, in both rooms of the example `false_flags`, of which this is the short version.

#[path = "../examples/false_flags/caster.rs"]
mod caster;
#[path = "../examples/false_flags/judge.rs"]
#[allow(dead_code)]
mod judge;
#[path = "../examples/false_flags/rooms.rs"]
mod rooms;

use judge::count;
use range_image::Flags;
use rooms::Amount;

type Failure = Box<dyn std::error::Error>;

/// Stations and seeds that no constant was chosen on.
const AMOUNT: Amount = Amount { stations: 1, frames: 64, seed: 2001, amplitude: 27.0 };

/// More frames may raise the share of false flags by so much: chance of 6336 pixels.
const RISE: f64 = 0.002;

#[test]
fn more_frames_bring_no_false_flags() {
    for room in ["simulated", "attic"] {
        let folder = tempfile::tempdir().unwrap();
        let capture = match room {
            "simulated" => rooms::simulated(folder.path(), 5, AMOUNT),
            _ => rooms::cast(folder.path(), 5, &[30e6], AMOUNT),
        };
        let capture = capture.unwrap();
        let mut least = f64::INFINITY;
        for frames in [1, 4, 16, 64] {
            let counts = count(&capture, frames).unwrap();
            let share = counts.share(counts.false_of_pixels);
            println!("{room}, {frames} frames: {share:.4} false, {:.4} allowed", counts.bar());
            assert!(share < counts.bar(), "{room}, {frames} frames: {share}");
            let by_chance = counts.share(counts.false_by_chance);
            assert!(by_chance < least + RISE, "{room}, {frames} frames: {by_chance}, {least} with fewer");
            least = least.min(by_chance);
            let motion = Flags::NAMED.iter().position(|(flag, _)| *flag == Flags::MOTION).unwrap();
            // One in ten thousand, of 6336.
            assert!(counts.of_flag[motion] < 6, "{room}, {frames} frames: {} moved", counts.of_flag[motion]);
        }
    }
}
