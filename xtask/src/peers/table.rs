//! Figures of several runs, and the tables that they make.

use std::collections::BTreeMap;
use std::path::PathBuf;

use super::environment::Figures;
use crate::shell::{Outcome, root};

/// The least of each figure over the runs: by case, by who, by name.
#[derive(Default)]
pub(crate) struct Least(BTreeMap<[String; 3], f64>);

impl Least {
    pub(crate) fn note(&mut self, case: &str, who: &str, figure: &str, value: f64) {
        let least = self.0.entry([case, who, figure].map(str::to_owned)).or_insert(f64::NAN);
        // `min` takes the number where the other is none.
        *least = least.min(value);
    }

    /// Notes what a script told: an object of objects of numbers.
    pub(crate) fn note_all(&mut self, case: &str, answer: &serde_json::Value) {
        for (who, figures) in answer.as_object().into_iter().flatten() {
            for (figure, value) in figures.as_object().into_iter().flatten() {
                self.note(case, who, figure, value.as_f64().unwrap_or(f64::NAN));
            }
        }
    }

    /// Notes figures that an example printed in one line.
    pub(crate) fn note_line(&mut self, case: &str, name: &str, figures: &[&str], printed: &Figures) {
        for (place, figure) in figures.iter().enumerate() {
            self.note(case, name, figure, printed.get(name, place));
        }
    }

    /// Notes figures that an example printed as `<name>_<figure>`.
    pub(crate) fn note_own(&mut self, case: &str, who: &str, name: &str, printed: &Figures) {
        for figure in ["ms", "bytes", "buffers"] {
            self.note(case, who, figure, printed.get(&format!("{name}_{figure}"), 0));
        }
    }

    /// NaN where nobody told.
    pub(crate) fn get(&self, case: &str, who: &str, figure: &str) -> f64 {
        self.0.get(&[case, who, figure].map(str::to_owned)).copied().unwrap_or(f64::NAN)
    }
}

/// What is asked for, and what was reached.
#[derive(Default)]
pub(crate) struct Bars(Vec<String>);

impl Bars {
    /// At least this much.
    pub(crate) fn at_least(&mut self, what: &str, bar: f64, reached: f64) {
        self.row(what, &format!("at least {}", number(bar)), reached, reached >= bar);
    }

    /// At most this much.
    pub(crate) fn at_most(&mut self, what: &str, bar: f64, reached: f64) {
        self.row(what, &format!("at most {}", number(bar)), reached, reached <= bar);
    }

    fn row(&mut self, what: &str, bar: &str, reached: f64, met: bool) {
        let met = if met && reached.is_finite() { "yes" } else { "**no**" };
        self.0.push(format!("| {what} | {bar} | {} | {met} |", number(reached)));
    }

    pub(crate) fn print(&self) {
        println!("\n| bar | asked | reached | met |\n|---|---|---|---|\n{}", self.0.join("\n"));
    }
}

/// Prints the head of a table.
pub(crate) fn head(cells: &[&str]) {
    println!("\n| {} |\n|{}", cells.join(" | "), "---|".repeat(cells.len()));
}

/// Prints a row of a table: a name and figures.
pub(crate) fn row(name: &str, figures: &[f64]) {
    let figures: Vec<String> = figures.iter().map(|&figure| number(figure)).collect();
    println!("| {name} | {} |", figures.join(" | "));
}

/// A figure with three digits or so; shares keep five.
pub(crate) fn number(value: f64) -> String {
    match value.abs() {
        size if size.is_nan() => "-".to_owned(),
        0.0 => "0".to_owned(),
        size if size < 1e-3 => format!("{value:.1e}"),
        size if size < 1.0 => format!("{value:.4}"),
        size if size < 10.0 => format!("{value:.2}"),
        size if size < 100.0 => format!("{value:.1}"),
        _ => format!("{value:.0}"),
    }
}

/// A folder below `target/peers` for images, gone when the comparison is.
pub(crate) struct Folder(PathBuf);

impl Folder {
    pub(crate) fn new(name: &str) -> Result<Self, String> {
        let path = root().join("target/peers/images").join(name);
        std::fs::create_dir_all(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        Ok(Self(path))
    }

    pub(crate) fn text(&self) -> String {
        super::environment::text(&self.0)
    }

    pub(crate) fn remove(self) -> Outcome {
        std::fs::remove_dir_all(&self.0).map_err(|error| format!("{}: {error}", self.0.display()))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::float_cmp)]
    use super::*;

    #[test]
    fn the_least_number_of_all_runs_counts() {
        let mut least = Least::default();
        for value in [3.0, f64::NAN, 2.0, 5.0] {
            least.note("room", "ours", "ms", value);
        }
        assert_eq!(least.get("room", "ours", "ms"), 2.0);
        assert!(least.get("room", "theirs", "ms").is_nan());
    }

    #[test]
    fn a_bar_that_nobody_reached_is_not_met() {
        let mut bars = Bars::default();
        bars.at_least("ratio", 7.0, f64::NAN);
        bars.at_most("bytes", 40.0, 38.5);
        assert_eq!(bars.0, ["| ratio | at least 7.00 | - | **no** |", "| bytes | at most 40.0 | 38.5 | yes |"]);
    }
}
