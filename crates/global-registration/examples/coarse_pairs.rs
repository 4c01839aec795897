//! Pairs of simulated frames aligned from nothing: how many are found, how many answers are wrong, and the CPU time of
//! one thread from raw points to the pose.
//!
//! `coarse_pairs [pairs] [large|most|half|none] [from=SEED] [sensitivity] [--each]`; `sensitivity` refuses
//! nothing and tells what each threshold would decide.
#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs)]

#[path = "../tests/scenes/mod.rs"]
mod coarse_scenes;
mod coarse_sensitivity;
#[path = "../../point-cloud/tests/common/mod.rs"]
mod common;

use std::ops::Range;

use coarse_scenes::{Outcome, Pair, align_points, outcome, pair, random_room};
use common::{Pinhole, Scene};
use global_registration::{CoarseAlignment, CoarseOptions};

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let each = words.iter().any(|w| w == "--each");
    let asked: Option<u64> = words.iter().find_map(|w| w.parse().ok());
    let count = asked.unwrap_or(200);
    let mut options = CoarseOptions::default();
    let sensitivity = words.iter().any(|w| w == "sensitivity");
    if sensitivity {
        options = coarse_sensitivity::loose(&options);
    }
    let chosen = |class: &str| {
        words.iter().any(|w| w == class)
            || !words.iter().any(|w| ["large", "most", "half", "none"].contains(&w.as_str()))
    };
    let from = words.iter().find_map(|w| w.strip_prefix("from=")?.parse().ok()).unwrap_or(0_u64);
    println!("set                            pairs  right  wrong  none  median mm  median deg  CPU time (median)");
    let set = |name: &str, size: u64, camera: &Pinhole, wanted: Range<f64>, rooms: bool| {
        let mut table = Table::default();
        for k in from..from + size {
            let scene = if rooms { random_room(k) } else { Scene::furnished() };
            let pair = pair(&scene, camera, wanted.clone(), k);
            table.add(&scene, camera, &pair, &options, each);
        }
        table.print(name);
        if sensitivity {
            coarse_sensitivity::print(name, &table.found);
        }
    };
    if chosen("large") {
        set("640x480, overlap 0.5 to 0.9", asked.unwrap_or(14), &Pinhole::large(), 0.5..0.9, false);
    }
    if chosen("most") {
        set("224x172, overlap 0.5 to 0.9", count, &Pinhole::medium(), 0.5..0.9, false);
        set("224x172, 0.5 to 0.9, any room", count, &Pinhole::medium(), 0.5..0.9, true);
    }
    if chosen("half") {
        set("224x172, overlap 0.4 to 0.6", count, &Pinhole::medium(), 0.4..0.6, false);
        set("224x172, 0.4 to 0.6, any room", count, &Pinhole::medium(), 0.4..0.6, true);
    }
    if chosen("none") {
        set("224x172, overlap below 0.02", count, &Pinhole::medium(), 0.0..0.02, false);
        set("224x172, < 0.02, any room", count, &Pinhole::medium(), 0.0..0.02, true);
    }
}

#[derive(Default)]
struct Table {
    right: Vec<(f64, f64)>,
    wrong: usize,
    none: usize,
    milliseconds: Vec<f64>,
    /// Answers, and whether each is right.
    found: Vec<(CoarseAlignment, bool)>,
}

impl Table {
    fn add(&mut self, scene: &Scene, camera: &Pinhole, pair: &Pair, options: &CoarseOptions, each: bool) {
        let [target, source] = pair.points(scene, camera);
        let start = cpu_milliseconds();
        let found = align_points(&target, &source, options);
        let taken = cpu_milliseconds() - start;
        self.milliseconds.push(taken);
        let outcome = outcome(&pair.target_from_source(), found);
        if each {
            println!("{:4} overlap {:.2} {taken:6.1} ms {}", pair.seed, pair.overlap, in_words(&outcome));
        }
        match outcome {
            Outcome::Right(millimetre, degree, found) => {
                self.right.push((millimetre, degree));
                self.found.push((found, true));
            }
            Outcome::Wrong(_, _, found) => {
                self.wrong += 1;
                self.found.push((found, false));
            }
            Outcome::None(_) => self.none += 1,
        }
    }

    fn print(&self, name: &str) {
        let total = self.right.len() + self.wrong + self.none;
        let median = |mut values: Vec<f64>| {
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
        };
        println!(
            "{name:30} {total:5} {:6} {:6} {:5} {:10.1} {:11.3} {:10.1} ms",
            self.right.len(),
            self.wrong,
            self.none,
            median(self.right.iter().map(|r| r.0).collect()),
            median(self.right.iter().map(|r| r.1).collect()),
            median(self.milliseconds.clone()),
        );
    }
}

fn in_words(outcome: &Outcome) -> String {
    let (word, millimetre, degree, found) = match outcome {
        Outcome::None(error) => return error.to_string(),
        Outcome::Right(millimetre, degree, found) => ("right", millimetre, degree, found),
        Outcome::Wrong(millimetre, degree, found) => ("WRONG", millimetre, degree, found),
    };
    format!(
        "{word} {millimetre:.1} mm {degree:.3} deg, inliers {} of {}, overlap {:.2} agreement {:.3} consistency {:.3} inside {:.3} \
         rival {:.2} determined {:.2}",
        found.inliers,
        found.correspondences,
        found.overlap,
        found.agreement,
        found.consistency,
        found.inside,
        found.rival,
        found.determined
    )
}

/// CPU time of all threads, milliseconds; 0 where the system does not tell.
fn cpu_milliseconds() -> f64 {
    let Ok(tasks) = std::fs::read_dir("/proc/self/task") else { return 0.0 };
    let nanoseconds = tasks.flatten().filter_map(|task| {
        let text = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<f64>().ok()
    });
    1e-6 * nanoseconds.sum::<f64>()
}
