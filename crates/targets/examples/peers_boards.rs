//! Simulated boards for `cargo xtask peers targets`: images, truth, and what is found here.
//!
//! `peers_boards FOLDER CASE COUNT SEED` writes `<k>.pgm` and `<k>.csv` (column, row, x, y) and prints a line
//! `board <k> <found> <nodes> <visible> <wrong> <rms px> <squared error> <ms>` an image.
#![allow(clippy::print_stdout, clippy::print_stderr, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../tests/support/mod.rs"]
mod support;

#[path = "../../../xtask/peers/cpu_clock.rs"]
mod cpu_clock;

use cpu_clock::cpu_seconds;
use support::cases::{Judged, case};
use targets::{Checkerboard, CheckerboardOptions, find_checkerboard};

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, name, count, seed] = &arguments[..] else {
        panic!("peers_boards FOLDER CASE COUNT SEED");
    };
    let (count, seed): (u64, u64) = (count.parse().unwrap(), seed.parse().unwrap());
    let verbose = std::env::var_os("REASONS").is_some();
    for k in 0..count {
        let case = case(name, seed + k);
        if folder != "-" {
            case.write(folder, k);
        }
        let board = Checkerboard::new(case.wanted.columns, case.wanted.rows, case.wanted.square_m).unwrap();
        let start = cpu_seconds();
        let found = find_checkerboard(&case.image, &board, &CheckerboardOptions::default());
        let ms = 1e3 * (cpu_seconds() - start);
        if let (Err(error), true) = (&found, verbose) {
            println!("reason {k} {error}");
        }
        let judged = Judged::of(&case, found.as_ref().ok());
        let Judged { found, nodes, visible, wrong, rms_px, squared } = judged;
        println!("board {k} {found} {nodes} {visible} {wrong} {rms_px:.6} {squared:.4} {ms:.4}");
    }
}
