//! `cargo xtask verify [NAME ...]`: long statistics, each an example of its crate that prints its figures and fails where
//! they leave their bounds; `memory`, which runs the command on long surveys; and `tests`, the tests that are too long for every change.
//! What `docs/benchmarks.md` states of them comes from here.

pub(crate) mod fuzz;
pub(crate) mod memory;
pub(crate) mod nightly;
pub(crate) mod sensitivity;

use crate::shell::{Outcome, cargo};

/// Name, package and example of each statistic.
const STATISTICS: &[(&str, &str, &str)] = &[
    ("buildings", "multiview-registration", "building"),
    ("calibrations", "self-calibration", "calibrations"),
    ("flags", "pipeline", "false_flags"),
    ("networks", "calibration-tasks", "network_seeds"),
    ("outside", "scattering-deconvolution", "outside_light"),
    ("rigs", "rig-calibration", "rigs"),
];

/// Those that are no examples.
const MEMORY: &str = "memory";
const TESTS: &str = "tests";

/// Which statistics to run.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Statistics by name; all where none is named.
    names: Vec<String>,
    #[command(flatten)]
    memory: memory::Options,
}

impl Arguments {
    /// All statistics.
    pub(crate) fn all() -> Self {
        Self { names: Vec::new(), memory: memory::Options::default() }
    }
}

pub(crate) fn run(arguments: &Arguments) -> Outcome {
    let known = || STATISTICS.iter().map(|(name, ..)| *name).chain([MEMORY, TESTS]);
    if let Some(unknown) = arguments.names.iter().find(|name| !known().any(|known| known == name.as_str())) {
        return Err(format!(
            "there is no statistic `{unknown}`; there are: {}",
            known().collect::<Vec<_>>().join(", ")
        ));
    }
    let asked = |name: &str| arguments.names.is_empty() || arguments.names.iter().any(|asked| asked == name);
    for (_, package, example) in STATISTICS.iter().filter(|(name, ..)| asked(name)) {
        cargo(&["run", "--release", "--package", package, "--all-features", "--example", example], &[])?;
    }
    if asked(TESTS) {
        // What `cargo xtask test` does with an eighth of the cases, and the tests say which, is marked as ignored there.
        cargo(&["test", "--workspace", "--all-features", "--lib", "--bins", "--tests", "--", "--ignored"], &[])?;
    }
    if asked(MEMORY) { memory::run(&arguments.memory) } else { Ok(()) }
}
