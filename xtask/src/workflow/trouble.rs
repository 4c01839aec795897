//! What kills jobs, the engine and the cluster's controller while a workflow runs.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::time::{Duration, Instant};

use crate::shell::Outcome;
use crate::workflow::slurm::Slurm;

/// Kills one job after the other, and twice, long after the start, what steers them.
pub(crate) struct Trouble<'a> {
    /// Jobs are processes of this program that work in this folder.
    place: PathBuf,
    program: PathBuf,
    every: Duration,
    slurm: Option<&'a Slurm>,
    last: Instant,
    jobs: usize,
    engines: usize,
    controllers: usize,
    chance: u64,
}

/// Jobs that are killed: without an end of it a step that takes longer than the time between two of them never comes to its own.
const MOST_JOBS_KILLED: usize = 15;

/// Results that are there when the engine is killed for the first and the second time.
const ENGINE_KILLED_AT: [usize; 2] = [5, 20];

impl<'a> Trouble<'a> {
    pub(crate) fn new(place: &Path, program: &Path, every_s: u64, slurm: Option<&'a Slurm>) -> Self {
        let (place, every) = (place.to_owned(), Duration::from_secs(every_s));
        let program = fs::canonicalize(program).unwrap_or_else(|_| program.to_owned());
        Self { place, program, every, slurm, last: Instant::now(), jobs: 0, engines: 0, controllers: 0, chance: 1 }
    }

    /// Makes some, if its time has come.
    pub(crate) fn make(&mut self, engine: &mut Child) -> Outcome {
        if ENGINE_KILLED_AT.get(self.engines).is_some_and(|results| self.results() >= *results) {
            self.engines += 1;
            if let Some(slurm) = self.slurm {
                slurm.restart_controller()?;
                self.controllers += 1;
            }
            return engine.kill().map_err(|error| format!("snakemake: {error}"));
        }
        if self.jobs < MOST_JOBS_KILLED && self.last.elapsed() >= self.every {
            let jobs = self.jobs_at_work();
            // Numerical Recipes' generator: which of them it is does not matter, only that it is not always the first.
            self.chance = self.chance.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let chosen = (self.chance >> 8) as usize % jobs.len().max(1);
            if let Some(job) = jobs.get(chosen) {
                let killed = Command::new("kill").args(["-9", &job.to_string()]).output();
                self.jobs += usize::from(killed.is_ok_and(|killed| killed.status.success()));
                self.last = Instant::now();
            }
        }
        Ok(())
    }

    pub(crate) fn in_words(&self) -> String {
        let Self { jobs, engines, controllers, .. } = self;
        format!("{jobs} jobs, {engines} times Snakemake and {controllers} times Slurm's controller were killed")
    }

    /// Processes of the program that work for this workflow.
    fn jobs_at_work(&self) -> Vec<u32> {
        let processes = fs::read_dir("/proc").into_iter().flatten().flatten();
        let numbers = processes.filter_map(|entry| entry.file_name().to_str()?.parse::<u32>().ok());
        let leads_to = |process: u32, link: &str, path: &Path| {
            fs::read_link(format!("/proc/{process}/{link}")).is_ok_and(|target| target == path)
        };
        numbers.filter(|job| leads_to(*job, "exe", &self.program) && leads_to(*job, "cwd", &self.place)).collect()
    }

    /// Recordings that have a result.
    fn results(&self) -> usize {
        let folders = |path: PathBuf| fs::read_dir(path).into_iter().flatten().flatten().map(|entry| entry.path());
        let cameras = folders(self.place.join("results"));
        cameras.flat_map(folders).map(|day| folders(day.join("recordings")).count()).sum()
    }
}
