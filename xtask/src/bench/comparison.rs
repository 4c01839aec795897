//! The times of a run beside those of one that was kept, from the files that criterion writes: below the folder of each
//! benchmark `new/` (this run), a folder by the name of the kept run, and `change/` (one over the other, less one).

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use crate::tidy::{folders, read as read_text};

/// A change of less than this is none: criterion's own threshold.
const NOISE: f64 = 0.01;

/// One benchmark in both runs.
#[derive(Debug, PartialEq)]
pub(super) struct Compared {
    /// Group, function and parameter.
    pub(super) name: String,
    /// Mean time of an iteration in the kept run, nanosecond.
    old_ns: f64,
    /// The same in this run.
    new_ns: f64,
    /// Change of the mean as a share of the old one: lower end of its 95 % interval, estimate, upper end.
    change: [f64; 3],
}

impl Compared {
    /// Whether all of the interval lies above what counts as noise.
    pub(super) fn is_slower(&self) -> bool {
        self.change[0] > NOISE
    }

    fn verdict(&self) -> &'static str {
        match self.change {
            [lower, ..] if lower > NOISE => "**slower**",
            [_, _, upper] if upper < -NOISE => "faster",
            _ => "no change",
        }
    }
}

/// All benchmarks that were measured since `start` and are kept as `baseline`, by their names.
pub(super) fn read(criterion: &Path, baseline: &str, start: SystemTime) -> Result<Vec<Compared>, String> {
    let mut found = Vec::new();
    for folder in benchmarks(criterion)? {
        let [new, old, change] = ["new", baseline, "change"].map(|run| folder.join(run).join("estimates.json"));
        let measured = |path: &Path| path.metadata().and_then(|data| data.modified()).is_ok_and(|time| time >= start);
        if !old.exists() || !measured(&new) || !measured(&change) {
            continue;
        }
        let name = json(&folder.join("new/benchmark.json"))?;
        let name = name["full_id"].as_str().unwrap_or("a benchmark without a name").to_owned();
        let change = &json(&change)?["mean"];
        let interval = &change["confidence_interval"];
        let change = [&interval["lower_bound"], &change["point_estimate"], &interval["upper_bound"]].map(number);
        let mean = |path: &Path| Ok::<_, String>(number(&json(path)?["mean"]["point_estimate"]));
        found.push(Compared { name, old_ns: mean(&old)?, new_ns: mean(&new)?, change });
    }
    found.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(found)
}

/// Old and new time, change and verdict.
pub(super) fn table(compared: &[Compared]) -> String {
    let mut out = "| benchmark | old | new | change (95 %) | verdict |\n|---|---|---|---|---|".to_owned();
    for one in compared {
        let [lower, change, upper] = one.change.map(|share| 100.0 * share);
        let (old, new, verdict) = (time(one.old_ns), time(one.new_ns), one.verdict());
        let name = &one.name;
        // Writing to a string cannot fail.
        let _ = write!(out, "\n| {name} | {old} | {new} | {change:+.1} % ({lower:+.1} to {upper:+.1}) | {verdict} |");
    }
    out
}

/// Folders with the figures of a benchmark: groups and functions are folders of their own.
fn benchmarks(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let mut found = Vec::new();
    for inner in folders(folder)? {
        if inner.join("new/benchmark.json").exists() {
            found.push(inner.clone());
        }
        found.extend(benchmarks(&inner)?);
    }
    Ok(found)
}

fn json(path: &Path) -> Result<serde_json::Value, String> {
    serde_json::from_str(&read_text(path)?).map_err(|error| format!("{}: {error}", path.display()))
}

fn number(value: &serde_json::Value) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}

/// With four digits in a unit that suits.
fn time(ns: f64) -> String {
    let (value, unit) = match ns {
        ns if ns < 1e3 => (ns, "ns"),
        ns if ns < 1e6 => (ns / 1e3, "µs"),
        ns if ns < 1e9 => (ns / 1e6, "ms"),
        ns => (ns / 1e9, "s"),
    };
    let digits = if value < 10.0 {
        3
    } else if value < 100.0 {
        2
    } else {
        1
    };
    format!("{value:.digits$} {unit}")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A benchmark's folder as criterion leaves it.
    fn store(criterion: &Path, name: &str, [old, new]: [f64; 2], change: Option<[f64; 3]>) -> std::io::Result<()> {
        let write = |run: &str, file: &str, text: String| {
            let folder = criterion.join(name).join(run);
            std::fs::create_dir_all(&folder)?;
            std::fs::write(folder.join(file), text)
        };
        let mean = |ns: f64| format!(r#"{{"mean":{{"point_estimate":{ns}}},"median":{{"point_estimate":1.0}}}}"#);
        write("new", "benchmark.json", format!(r#"{{"group_id":"g","full_id":"{name}"}}"#))?;
        write("new", "estimates.json", mean(new))?;
        write("kept", "estimates.json", mean(old))?;
        let Some([lower, estimate, upper]) = change else { return Ok(()) };
        let interval = format!(r#"{{"confidence_level":0.95,"lower_bound":{lower},"upper_bound":{upper}}}"#);
        let text = format!(r#"{{"mean":{{"confidence_interval":{interval},"point_estimate":{estimate}}}}}"#);
        write("change", "estimates.json", text)
    }

    #[test]
    fn what_is_slower_beyond_its_noise_is_named() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let criterion = folder.path();
        store(criterion, "solve/470 unknowns", [10e6, 12e6], Some([0.15, 0.2, 0.25]))?;
        store(criterion, "demodulate", [1500.0, 1200.0], Some([-0.21, -0.2, -0.19]))?;
        store(criterion, "normals", [2e9, 2.04e9], Some([0.005, 0.02, 0.035]))?;
        store(criterion, "not compared", [1.0, 1.0], None)?;
        let compared = read(criterion, "kept", SystemTime::UNIX_EPOCH)?;
        let slower: Vec<&str> = compared.iter().filter(|one| one.is_slower()).map(|one| one.name.as_str()).collect();
        assert_eq!(slower, ["solve/470 unknowns"]);
        let expected = "\
| benchmark | old | new | change (95 %) | verdict |
|---|---|---|---|---|
| demodulate | 1.500 µs | 1.200 µs | -20.0 % (-21.0 to -19.0) | faster |
| normals | 2.000 s | 2.040 s | +2.0 % (+0.5 to +3.5) | no change |
| solve/470 unknowns | 10.00 ms | 12.00 ms | +20.0 % (+15.0 to +25.0) | **slower** |";
        assert_eq!(table(&compared), expected);
        // What was measured before this run is not part of it.
        let later = SystemTime::now() + std::time::Duration::from_secs(90);
        assert_eq!(read(criterion, "kept", later)?, []);
        assert_eq!(read(criterion, "another", SystemTime::UNIX_EPOCH)?, []);
        Ok(())
    }
}
