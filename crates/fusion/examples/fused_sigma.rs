//! Whether fused points err as they say: surveys of a room with every error drawn from what is stated of it.
//!
//! `cargo run --release -p fusion --example fused_sigma [SURVEYS [FIRST]]`

#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[path = "../tests/common/mod.rs"]
mod common;

use common::judge::Judgement;
use common::survey::{Plan, Survey};
use fusion::{CommonErrorUse, Fused, FusionOptions, Reason, fuse};

/// Counts over surveys.
#[derive(Default)]
struct Counts {
    points: usize,
    contradictions: usize,
    outvoted: usize,
    apart: usize,
    /// Surfels of which frames are said to disagree.
    disagree: usize,
    unfused: [usize; 4],
    seconds: f64,
}

impl Counts {
    fn add(&mut self, fused: &Fused, seconds: f64) {
        self.points += fused.surfel_of_point.len();
        self.contradictions += fused.contradictions.len();
        self.outvoted += fused.outvoted;
        self.apart += fused.apart.len();
        self.disagree += fused.surfels.iter().filter(|surfel| surfel.variance_factor > 1.0).count();
        self.seconds += seconds;
        for left in &fused.unfused {
            let at = match left.reason {
                reason if reason.is_contradiction() => 0,
                Reason::Between { .. } => 1,
                Reason::AtEdge | Reason::Uneven => 2,
                _ => 3,
            };
            self.unfused[at] += 1;
        }
    }
}

fn main() {
    let mut arguments = std::env::args().skip(1).filter_map(|text| text.parse::<u64>().ok());
    let surveys = arguments.next().unwrap_or(50);
    let first = arguments.next().unwrap_or(0);
    let fine = Plan { size: (160, 120), ..Plan::default() };
    for (plan, common_errors) in [
        (Plan::default(), CommonErrorUse::Estimate),
        (Plan::default(), CommonErrorUse::AsStated),
        (fine, CommonErrorUse::Estimate),
    ] {
        let options = FusionOptions { common_errors, ..FusionOptions::default() };
        let (mut judged, mut counts) = (Judgement::default(), Counts::default());
        for seed in first..first + surveys {
            let survey = Survey::new(&plan, seed);
            let start = std::time::Instant::now();
            let fused = fuse(&survey.registered(), &survey, &survey.common, &options).unwrap();
            counts.add(&fused, start.elapsed().as_secs_f64());
            judged.add(&survey, &fused);
        }
        println!("{:?} pixels, common errors {common_errors:?}: {surveys} surveys", plan.size);
        print(&judged, &counts);
    }
}

fn print(judged: &Judgement, counts: &Counts) {
    let [contradict, between, edge, alone] = counts.unfused.map(|count| 100.0 * count as f64 / counts.points as f64);
    println!(
        "{} points, {} surfels, {} of them nowhere; {:.1} s",
        counts.points, judged.surfels, judged.ghosts, counts.seconds
    );
    println!(
        "contradictions of surfels {}, surfels given up for them {}, stations apart {}, surfels of which frames disagree {}",
        counts.contradictions, counts.outvoted, counts.apart, counts.disagree
    );
    println!("points contradict {contradict:.3} %, between {between:.2} %, at edges {edge:.2} %, alone {alone:.2} %");
    println!("{:<14} {:>9} {:>16}", "class", "surfels", "error²/variance");
    for (class, (sum, count)) in &judged.classes {
        println!("{class:<14} {count:>9} {:>16.3}", sum / count);
    }
    let corrections = judged.corrections.iter().sum::<f64>() / judged.corrections.len() as f64;
    println!("{:<14} {:>9} {corrections:>16.3}", "common errors", judged.corrections.len());
    let of = |share| statistics::quantile(&mut judged.thickness.clone(), share);
    println!("thickness of walls over noise: {:.3}; 10 % {:.3}, 90 % {:.3}\n", of(0.5), of(0.1), of(0.9));
}
