//! Which poses are right, which of them are trusted, and how long they took.

use std::collections::BTreeMap;

use super::super::environment::Figures;
use super::super::table::{head, number};

/// A pose is right within this of the reference, or within a share of the motion.
const RIGHT_DEG: f64 = 2.0;
const RIGHT_MM: f64 = 40.0;
const RIGHT_SHARE: f64 = 0.25;
const OURS: [(&str, &str); 2] = [("organised", "`align_frames`"), ("voxels", "`VoxelCloud`")];

/// What a method made of a pair: `ms deg mm sure deg mm`, the last two of the motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Answer {
    pub(super) ms: f64,
    off: [f64; 2],
    sure: bool,
    moved: [f64; 2],
}

impl Answer {
    /// Where something is no number, the pose is infinitely far off.
    fn read(figures: &[f64]) -> Option<Self> {
        let &[ms, degrees, millimetres, sure, turned, moved] = figures else { return None };
        let far = |value: f64| if value.is_nan() { f64::INFINITY } else { value };
        Some(Self { ms, off: [far(degrees), far(millimetres)], sure: sure > 0.0, moved: [turned, moved] })
    }

    pub(super) fn is_right(&self) -> bool {
        [RIGHT_DEG, RIGHT_MM]
            .iter()
            .zip(self.off)
            .zip(self.moved)
            .all(|((&most, off), moved)| off < f64::max(most, RIGHT_SHARE * moved))
    }
}

/// Answers by method, in the pairs' order.
#[derive(Default)]
pub(super) struct Runs(BTreeMap<String, Vec<Answer>>);

impl Runs {
    pub(super) fn add_own(&mut self, printed: &Figures) {
        for (who, _) in OURS {
            self.0.insert(who.to_owned(), printed.lines(who).iter().filter_map(|row| Answer::read(row)).collect());
        }
    }

    /// An object of lists of lists of numbers; `null` where a peer has none.
    pub(super) fn add_peers(&mut self, told: &serde_json::Value) {
        let numbers = |row: &serde_json::Value| -> Vec<f64> {
            row.as_array().into_iter().flatten().map(|value| value.as_f64().unwrap_or(f64::NAN)).collect()
        };
        for (who, rows) in told.as_object().into_iter().flatten() {
            let rows = rows.as_array().into_iter().flatten();
            self.0.insert(who.clone(), rows.filter_map(|row| Answer::read(&numbers(row))).collect());
        }
    }

    /// Of the same pairs once more: the less time counts.
    pub(super) fn merge(&mut self, again: Self) {
        for (who, answers) in again.0 {
            let known = self.0.entry(who).or_insert_with(|| answers.clone());
            known.iter_mut().zip(answers).for_each(|(known, answer)| known.ms = known.ms.min(answer.ms));
        }
    }

    pub(super) fn of(&self, who: &str) -> &[Answer] {
        self.0.get(who).map_or(&[], Vec::as_slice)
    }

    pub(super) fn right(&self, who: &str) -> usize {
        self.of(who).iter().filter(|answer| answer.is_right()).count()
    }

    pub(super) fn mean_ms(&self, who: &str) -> f64 {
        times(self.of(who).iter().map(|answer| answer.ms).collect())[0]
    }
}

/// Mean, median, and what 95 % do not exceed.
pub(super) fn times(mut values: Vec<f64>) -> [f64; 3] {
    values.sort_by(f64::total_cmp);
    let at = |share: f64| values.get(((values.len() as f64 * share).ceil() as usize).saturating_sub(1));
    let quantile = |share: f64| at(share).copied().unwrap_or(f64::NAN);
    [values.iter().sum::<f64>() / values.len() as f64, quantile(0.5), quantile(0.95)]
}

/// The table as docs/benchmarks.md has it.
pub(super) fn print(title: &str, pairs: usize, methods: &[(String, String)], runs: &Runs) {
    head(&[
        &format!("{title}: {pairs} pairs"),
        "right",
        "trusted and wrong",
        "right, not trusted",
        "CPU ms: mean",
        "median",
        "95 %",
    ]);
    let own = OURS.map(|(who, name)| (who.to_owned(), name.to_owned()));
    for (who, name) in own.iter().chain(methods) {
        println!("{}", line(name, runs.of(who)));
    }
}

fn line(name: &str, answers: &[Answer]) -> String {
    let count = |wanted: &dyn Fn(&&Answer) -> bool| answers.iter().filter(wanted).count();
    let right = count(&|answer| answer.is_right());
    let trusted_wrong = count(&|answer| answer.sure && !answer.is_right());
    let doubted = count(&|answer| !answer.sure && answer.is_right());
    let times = times(answers.iter().map(|answer| answer.ms).collect()).map(number).join(" | ");
    format!("| {name} | {right} | {trusted_wrong} | {doubted} | {times} |")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_is_right_within_the_limits_or_a_share_of_the_motion() {
        let answer = |degrees, millimetres, turned, moved| {
            Answer::read(&[1.0, degrees, millimetres, 1.0, turned, moved]).is_some_and(|answer| answer.is_right())
        };
        assert!(answer(1.9, 39.0, 0.0, 0.0));
        assert!(!answer(1.9, 41.0, 0.0, 0.0));
        assert!(answer(1.9, 41.0, 0.0, 200.0));
        assert!(!answer(2.1, 1.0, 0.0, 200.0));
        assert!(answer(2.1, 1.0, 10.0, 200.0));
        assert!(!answer(f64::NAN, f64::NAN, 10.0, 200.0));
    }

    #[test]
    fn lines_count_who_is_right_and_who_says_so() {
        let mut runs = Runs::default();
        runs.add_own(&Figures::read(
            "organised 4 0.1 5 1 3 100\norganised 6 0.1 500 1 3 100\nvoxels 9 0.1 5 0 3 100\nvoxels 9 inf inf 0 3 100\n",
        ));
        let told = serde_json::json!({"gicp:0.08:0.3": [[30.0, 0.1, 5.0, 1.0, 3.0, 100.0], [50.0, null, null, 0.0, 3.0, 100.0]]});
        runs.add_peers(&told);
        assert_eq!(line("frames", runs.of("organised")), "| frames | 1 | 1 | 0 | 5.00 | 4.00 | 6.00 |");
        assert_eq!(line("clouds", runs.of("voxels")), "| clouds | 1 | 0 | 1 | 9.00 | 9.00 | 9.00 |");
        assert_eq!(line("GICP", runs.of("gicp:0.08:0.3")), "| GICP | 1 | 0 | 0 | 40.0 | 30.0 | 50.0 |");
        assert_eq!(line("nobody", runs.of("nobody")), "| nobody | 0 | 0 | 0 | - | - | - |");
    }

    #[test]
    fn of_several_runs_the_least_time_counts() {
        let run = |ms: f64| {
            let mut runs = Runs::default();
            runs.add_own(&Figures::read(&format!("organised {ms} 0.1 5 1 3 100")));
            runs
        };
        let mut runs = run(4.0);
        runs.merge(run(3.0));
        runs.merge(run(5.0));
        assert!((runs.mean_ms("organised") - 3.0).abs() < 1e-12);
    }
}
