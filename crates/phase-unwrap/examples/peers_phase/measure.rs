//! CPU time and memory, as Linux tells them.

use std::fs;

use crate::cpu_clock::cpu_seconds;

/// The result of `work`, its CPU time in milliseconds, and by how many bytes it raised the peak of this process'
/// memory (its result included; NaN where the system does not tell).
pub fn measured<T>(work: impl FnOnce() -> T) -> (T, f64, f64) {
    // Sets the peak back to what is in use now.
    let reset = fs::write("/proc/self/clear_refs", "5").is_ok();
    let (before, start) = (status("VmRSS:"), cpu_seconds());
    let result = work();
    let milliseconds = 1e3 * (cpu_seconds() - start);
    let grown = if reset { status("VmHWM:") - before } else { f64::NAN };
    (result, milliseconds, grown)
}

/// A figure of the process' status, bytes.
fn status(name: &str) -> f64 {
    let text = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix(name));
    let kibibytes = line.and_then(|rest| rest.trim().trim_end_matches(" kB").parse::<f64>().ok());
    kibibytes.map_or(f64::NAN, |kibibytes| 1024.0 * kibibytes)
}

/// Prints the least time of some runs and the memory of the first, and hands the last result back. The first run
/// allocates everything; the others find the allocator warm.
pub fn report<T, E>(name: &str, pixels: usize, mut work: impl FnMut() -> Result<T, E>) -> Result<T, E> {
    let (result, mut least, grown) = measured(&mut work);
    let mut result = result?;
    // Small images are repeated more often, as their times scatter more.
    for _ in 1..(4_000_000 / pixels).clamp(2, 20) {
        let (again, milliseconds, _) = measured(&mut work);
        result = again?;
        least = least.min(milliseconds);
    }
    println!("{name}_ms {least}");
    println!("{name}_bytes {}", grown / pixels as f64);
    Ok(result)
}
