//! A process that is watched.

use std::fs::read_to_string;
use std::process::{Child, Output};
use std::time::Duration;

/// How often the memory of a command is looked at.
const LOOK_EVERY: Duration = Duration::from_millis(20);
/// Steps of the processor's time in a second, as Linux states it to programs.
const STEPS: f64 = 100.0;

/// What a process took.
#[derive(Debug, Clone, Copy)]
pub(super) struct Taken {
    /// Largest resident set, megabyte.
    pub(super) most_mb: u64,
    /// Processor time of all threads, second.
    pub(super) seconds: f64,
    /// The exit code.
    pub(super) code: i32,
}

/// Waits for a process; the kernel keeps its largest resident set and its processor time.
pub(super) fn watched(mut child: Child) -> Result<(Taken, Output), String> {
    let file = |name: &str| format!("/proc/{}/{name}", child.id());
    let (status, stat) = (file("status"), file("stat"));
    let (mut most_kb, mut steps) = (0, 0);
    while child.try_wait().map_err(|error| error.to_string())?.is_none() {
        let text = read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let known = line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok());
        most_kb = known.unwrap_or(0).max(most_kb);
        steps = processor_steps(&read_to_string(&stat).unwrap_or_default()).unwrap_or(0).max(steps);
        std::thread::sleep(LOOK_EVERY);
    }
    if most_kb == 0 {
        return Err(format!("{status} tells no VmHWM: this needs Linux"));
    }
    let output = child.wait_with_output().map_err(|error| error.to_string())?;
    let code = output.status.code().unwrap_or(-1);
    Ok((Taken { most_mb: most_kb.div_ceil(1000), seconds: steps as f64 / STEPS, code }, output))
}

/// Time in the program and in the system, behind the name, which may have blanks.
fn processor_steps(stat: &str) -> Option<u64> {
    let (_, fields) = stat.rsplit_once(')')?;
    let number = |at: usize| fields.split_whitespace().nth(at)?.parse::<u64>().ok();
    Some(number(11)? + number(12)?)
}
