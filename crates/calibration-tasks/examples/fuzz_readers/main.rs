//! Damaged files of every format, read under limits of time and memory.
//!
//! `fuzz_readers [SECONDS] [SEED] [TARGET]` (60 s, a seed of the time, all targets) writes the files that a reader did not
//! stand into `out/fuzz` and fails if there are any. Each batch of cases runs in a process of its own, whose address space
//! the shell's `ulimit -v` bounds. `fuzz_readers --file TARGET FILE...` reads files that are there.
#![allow(clippy::print_stdout, clippy::print_stderr)]

mod chance;
mod mutate;
// The recordings that the crate `recordings` tests itself by.
#[path = "../../../recordings/tests/common/mod.rs"]
mod recorded;
mod seeds;
mod targets;
mod worker;

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Cases of one process.
const BATCH: u64 = 4000;
/// Address space of a process, KiB: 256 MiB for the files, the rest for the program, its stack and its libraries.
const SPACE_KIB: u64 = (256 + 64) * 1024;
/// A process that reads one small file for so long hangs.
const HANGS: Duration = Duration::from_secs(30);

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    match words.first().map(String::as_str) {
        Some("--worker") => work(&words[1..]),
        Some("--file") => read_files(&words[1..]),
        _ => drive(&words),
    }
}

/// Batches until the time is over.
fn drive(words: &[String]) -> Result<ExitCode, Box<dyn Error>> {
    let seconds: u64 = words.first().map_or(Ok(60), |word| word.parse())?;
    let of_the_time = SystemTime::now().duration_since(UNIX_EPOCH)?.as_nanos() as u64;
    let seed: u64 = words.get(1).map_or(Ok(of_the_time), |word| word.parse())?;
    let out = Path::new("out/fuzz");
    fs::create_dir_all(out)?;
    println!("seed {seed}");
    let folder = std::env::temp_dir().join(format!("fuzz-readers-{}", std::process::id()));
    let clock = Instant::now();
    let (mut next, mut failures) = (0_u64, 0_usize);
    while clock.elapsed().as_secs() < seconds {
        let mut worker = vec![seed.to_string(), next.to_string(), folder.display().to_string()];
        worker.extend(words.get(2).cloned());
        let end = end_of(&mut spawn(&worker)?, &folder)?;
        if matches!(end, End::Found) {
            failures += 1;
        }
        if let End::Badly(how) = end {
            failures += 1;
            let case = fs::read_to_string(folder.join("case")).unwrap_or_default();
            println!("{case}: {how}");
            keep(&folder, out, &case)?;
            // Behind the case that ended it.
            next = case
                .rsplit_once(' ')
                .and_then(|(_, case)| case.parse::<u64>().ok())
                .map_or(next + BATCH, |case| case + 1);
        } else {
            next += BATCH;
        }
    }
    let kept = fs::read_dir(out)?.count();
    println!("{next} cases with seed {seed}, {failures} processes with findings, {kept} files in {}", out.display());
    let _ = fs::remove_dir_all(&folder);
    Ok(if failures == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn spawn(words: &[String]) -> std::io::Result<Child> {
    let program = std::env::current_exe()?;
    let limited = format!("ulimit -v {SPACE_KIB}; exec \"$0\" --worker \"$@\"");
    Command::new("sh").arg("-c").arg(limited).arg(program).args(words).spawn()
}

/// How a process ended.
enum End {
    Well,
    /// All cases are read, and some are findings.
    Found,
    /// Within a case.
    Badly(String),
}

/// Exit code of a process with findings.
const FOUND: u8 = 2;

fn end_of(process: &mut Child, folder: &Path) -> std::io::Result<End> {
    loop {
        if let Some(status) = process.try_wait()? {
            return Ok(match status.code() {
                Some(0) => End::Well,
                Some(code) if code == i32::from(FOUND) => End::Found,
                _ => End::Badly(status.to_string()),
            });
        }
        let case = fs::metadata(folder.join("case")).and_then(|found| found.modified());
        if case.is_ok_and(|time| time.elapsed().unwrap_or_default() > HANGS) {
            process.kill()?;
            process.wait()?;
            return Ok(End::Badly(format!("reads for more than {} s", HANGS.as_secs())));
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Keeps the file at hand.
fn keep(folder: &Path, out: &Path, case: &str) -> std::io::Result<()> {
    let Some((target, number)) = case.split_once(' ') else { return Ok(()) };
    let Some(target) = targets::TARGETS.iter().find(|known| known.name == target) else { return Ok(()) };
    let file = folder.join(target.file);
    if file.is_file() {
        fs::copy(file, out.join(format!("{}-{number}", target.name)))?;
    }
    Ok(())
}

/// One batch; a process that finds something ends with a failure after all its cases.
fn work(words: &[String]) -> Result<ExitCode, Box<dyn Error>> {
    let [seed, first, folder, only @ ..] = words else { return Err("expected seed, first case and folder".into()) };
    let first: u64 = first.parse()?;
    std::panic::set_hook(Box::new(|_| {}));
    let run = worker::Run {
        seed: seed.parse()?,
        cases: first..first + BATCH,
        folder: PathBuf::from(folder),
        only: only.first().cloned(),
    };
    let findings = worker::run(&run)?;
    for finding in &findings {
        println!("{} {}: {}", finding.target, finding.case, finding.what);
        fs::write(Path::new("out/fuzz").join(format!("{}-{}", finding.target, finding.case)), &finding.bytes)?;
    }
    Ok(if findings.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(FOUND) })
}

fn read_files(words: &[String]) -> Result<ExitCode, Box<dyn Error>> {
    let [target, files @ ..] = words else { return Err("expected a target and files".into()) };
    let target = targets::TARGETS.iter().find(|known| known.name == target);
    let target = target.ok_or("there is no such target")?;
    for file in files {
        println!("{file}: {:?}", worker::judge(target, Path::new(file)));
    }
    Ok(ExitCode::SUCCESS)
}
