//! `cargo xtask bench [CRATE ...] [--save NAME] [--baseline NAME] [-- criterion's arguments]`: criterion benchmarks, and
//! what became slower than a run that was kept.

mod comparison;

use std::path::PathBuf;
use std::time::SystemTime;

use crate::shell::{Outcome, cargo, root};

/// Which crates to measure, and what to compare with.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Crates; all where none is named.
    crates: Vec<String>,
    /// Keep this run under a name.
    #[arg(long, value_name = "NAME", conflicts_with = "baseline")]
    save: Option<String>,
    /// Compare with the run kept under a name; fails where something became slower beyond its noise.
    #[arg(long, value_name = "NAME")]
    baseline: Option<String>,
    /// Arguments of criterion: `-- --sample-size 10`.
    #[arg(last = true)]
    criterion: Vec<String>,
}

pub(crate) fn run(arguments: &Arguments) -> Outcome {
    let start = SystemTime::now();
    let folder = criterion_folder();
    cargo(&line(arguments), &[("CRITERION_HOME", &folder.to_string_lossy())])?;
    let Some(baseline) = &arguments.baseline else { return Ok(()) };
    let compared = comparison::read(&folder, baseline, start)?;
    if compared.is_empty() {
        return Err(format!(
            "nothing was compared: no benchmark of this run was kept as `{baseline}` (--save {baseline})"
        ));
    }
    println!("\n{}", comparison::table(&compared));
    let slower: Vec<&str> = compared.iter().filter(|one| one.is_slower()).map(|one| one.name.as_str()).collect();
    if slower.is_empty() { Ok(()) } else { Err(format!("slower than `{baseline}`: {}", slower.join("; "))) }
}

fn line(arguments: &Arguments) -> Vec<&str> {
    let mut line = vec!["bench", "--benches"];
    if arguments.crates.is_empty() {
        line.push("--workspace");
    }
    for name in &arguments.crates {
        line.extend(["--package", name]);
    }
    line.push("--");
    // A benchmark that was not kept is measured and not compared.
    let names = [("--save-baseline", &arguments.save), ("--baseline-lenient", &arguments.baseline)];
    line.extend(names.into_iter().filter_map(|(option, name)| Some([option, name.as_deref()?])).flatten());
    line.extend(arguments.criterion.iter().map(String::as_str));
    line
}

/// Where criterion keeps its figures: below cargo's target folder, whatever the package.
fn criterion_folder() -> PathBuf {
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| "target".into(), PathBuf::from);
    root().join(target).join("criterion")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_names_crates_and_the_run_that_is_kept_or_compared_with() {
        let criterion = vec!["--quick".to_owned()];
        let mut arguments = Arguments { crates: Vec::new(), save: Some("a".to_owned()), baseline: None, criterion };
        assert_eq!(line(&arguments).join(" "), "bench --benches --workspace -- --save-baseline a --quick");
        (arguments.save, arguments.baseline) = (None, Some("a".to_owned()));
        arguments.crates = vec!["adjust".to_owned(), "statistics".to_owned()];
        let expected = "bench --benches --package adjust --package statistics -- --baseline-lenient a --quick";
        assert_eq!(line(&arguments).join(" "), expected);
    }
}
