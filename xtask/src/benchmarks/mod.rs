//! `cargo xtask benchmarks [NAME ...]`: runs statistics, keeps the tables that they print as docs/benchmarks/NAME.md, and
//! renders these into docs/benchmarks.md, whose prose is written by hand.

mod page;

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use crate::shell::{Outcome, captured, root};
use crate::tidy::read;

/// Name of each statistic, and the command that prints its tables.
const STATISTICS: &[(&str, &str)] = &[
    ("calibrations", "cargo xtask verify calibrations"),
    ("noisy", "cargo run -p phase-unwrap --example noisy_methods"),
    ("peers-frame", "cargo xtask peers frame"),
    ("peers-registration-real", "cargo xtask peers registration-real"),
    ("peers-scattering", "cargo xtask peers scattering"),
    ("peers-targets", "cargo xtask peers targets"),
];

/// Which statistics to run.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Statistics by name; all where none is named.
    names: Vec<String>,
    /// Run nothing, render what was kept.
    #[arg(long, conflicts_with = "names")]
    render: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Outcome {
    let known = |name: &str| STATISTICS.iter().any(|(known, _)| *known == name);
    if let Some(unknown) = arguments.names.iter().find(|name| !known(name)) {
        let names: Vec<&str> = STATISTICS.iter().map(|(name, _)| *name).collect();
        return Err(format!("there is no statistic `{unknown}`; there are: {}", names.join(", ")));
    }
    let asked = |name: &str| arguments.names.is_empty() || arguments.names.iter().any(|asked| asked == name);
    let chosen = STATISTICS.iter().filter(|(name, _)| !arguments.render && asked(name));
    let failures: Vec<String> = chosen.filter_map(|(name, line)| keep(name, line).err()).collect();
    let path = root().join("docs/benchmarks.md");
    let rendered = page::render(&read(&path)?, &stored(&root())?)?;
    std::fs::write(&path, rendered).map_err(|error| format!("{}: {error}", path.display()))?;
    if failures.is_empty() { Ok(()) } else { Err(failures.join("\n")) }
}

/// Whether the page holds what was kept.
pub(crate) fn complaints(root: &Path) -> Result<Vec<String>, String> {
    let page = read(&root.join("docs/benchmarks.md"))?;
    Ok(match page::render(&page, &stored(root)?) {
        Ok(rendered) if rendered == page => Vec::new(),
        Ok(_) => {
            vec!["docs/benchmarks.md is not what docs/benchmarks holds: `cargo xtask benchmarks --render`".to_owned()]
        }
        Err(complaint) => vec![complaint],
    })
}

/// Runs a statistic and keeps its tables; one whose figures leave their bounds fails and is kept as well.
fn keep(name: &str, line: &str) -> Outcome {
    println!("── {line}");
    let (output, outcome) = captured(line)?;
    print!("{output}");
    let tables = page::tables(&output);
    if tables.is_empty() {
        return outcome.and(Err(format!("{line}: no table was printed")));
    }
    let head = format!("`{line}`, {}, {}, {}", told("date", &["-u", "+%F"])?, machine(), commit()?);
    let folder = root().join("docs/benchmarks");
    let path = folder.join(name).with_extension("md");
    std::fs::create_dir_all(&folder)
        .and_then(|()| std::fs::write(&path, format!("{head}\n\n{tables}\n")))
        .map_err(|error| format!("{}: {error}", path.display()))?;
    outcome
}

/// What was kept, by name.
fn stored(root: &Path) -> Result<BTreeMap<String, String>, String> {
    let folder = root.join("docs/benchmarks");
    let entries = std::fs::read_dir(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let files = entries.flatten().map(|entry| entry.path());
    files.map(|path| Ok((path.file_stem().unwrap_or_default().to_string_lossy().into_owned(), read(&path)?))).collect()
}

/// Cores and processor.
fn machine() -> String {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = text.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": ")).map(|(_, name)| name);
    format!("{cores} cores of {}", model.unwrap_or(std::env::consts::ARCH))
}

fn commit() -> Result<String, String> {
    told("git", &["describe", "--always", "--dirty"])
}

/// What a command prints.
fn told(program: &str, arguments: &[&str]) -> Result<String, String> {
    let output = Command::new(program).args(arguments).current_dir(root()).output();
    let output = output.map_err(|error| format!("{program}: {error}"))?;
    Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned())
}
