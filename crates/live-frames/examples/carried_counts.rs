//! Whole ambiguity intervals carried from frame to frame beside those of the tree on every frame: shares of wrong counts.
//!
//! `cargo run --release -p live-frames --all-features --example carried_counts [frames columns rows]`, by default 150 frames of
//! 320 x 240 pixels at 30 Hz, 30 MHz: a hand-held camera in a room of 9 m in which a person walks, a ball swings and a board
//! slides. Pixels whose rays meet two surfaces are left out.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[path = "../tests/common/mod.rs"]
#[allow(dead_code)] // each user takes a part of it
mod common;

use common::Sequence;
use common::judge::{Wrong, wrong};

/// Frames from one whole tree to the next.
const REFRESHES: [u32; 4] = [1, 30, 150, 100_000];
/// Rows of the table over time.
const PARTS: usize = 10;

fn main() {
    let mut numbers = std::env::args().skip(1).filter_map(|argument| argument.parse::<usize>().ok());
    let mut next = |default: usize| numbers.next().unwrap_or(default);
    let (frames, width, height) = (next(150), next(320), next(240));
    for (name, dark_sigma) in [("little noise", 3.0), ("much noise", 15.0)] {
        let sequence = Sequence { width, height, dark_sigma, rays: 1, ..Sequence::default() };
        let shown: Vec<_> = (0..frames).map(|number| sequence.frame(number)).collect();
        let runs = REFRESHES.map(|refresh| wrong(&sequence, &shown, refresh));
        println!("\n{name}: {frames} frames of {width} x {height} pixels; per cent of pixels\n");
        println!("| whole tree every | wrong | wrong among the sure | not sure | failed their check | whole trees |");
        println!("|---|---|---|---|---|---|");
        for (refresh, run) in REFRESHES.iter().zip(&runs) {
            let mean = |of: fn(&Wrong) -> f64| 100.0 * run.iter().map(of).sum::<f64>() / run.len() as f64;
            println!(
                "| {refresh} frames | {:.3} | {:.4} | {:.2} | {:.1} | {} |",
                mean(|wrong| wrong.all),
                mean(|wrong| wrong.sure),
                mean(|wrong| wrong.unsure),
                mean(|wrong| wrong.failed),
                run.iter().filter(|wrong| wrong.whole).count()
            );
        }
        println!("\nwrong over time, per cent:\n");
        println!("| frames | tree on every frame | every {} | every {} | never again |", REFRESHES[1], REFRESHES[2]);
        println!("|---|---|---|---|---|");
        for part in 0..PARTS {
            let range = part * frames / PARTS..(part + 1) * frames / PARTS;
            let of_run = |run: &Vec<Wrong>| {
                let part = &run[range.clone()];
                format!("{:.3}", 100.0 * part.iter().map(|wrong| wrong.all).sum::<f64>() / part.len() as f64)
            };
            println!("| {range:?} | {} |", runs.each_ref().map(of_run).join(" | "));
        }
    }
}
