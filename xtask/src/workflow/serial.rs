//! The same steps, one process after the other, each recording whole.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::shell::Outcome;
use crate::workflow::archive::{CAMERAS, DAYS, RECORDINGS};
use crate::workflow::contents;

/// Runs all steps in the folder `serial` and gives what they wrote.
pub(crate) fn run(program: &Path, folder: &Path) -> Result<BTreeMap<PathBuf, Vec<u8>>, String> {
    let place = folder.join("serial");
    let (archive, pipeline) =
        (folder.join("archive").display().to_string(), folder.join("flow/pipeline.ron").display().to_string());
    let steps = Steps { program, place: &place };
    for camera in CAMERAS {
        let calibrate = format!(
            "--quiet calibrate {archive}/{camera}/calibration --method one-step --out results/{camera}/calibration"
        );
        steps.step(&format!("{camera}/calibration"), &calibrate, None)?;
        let calibration = format!("--calibration results/{camera}/calibration/calibration.ron");
        for day in DAYS {
            let check = format!("--json check {archive}/{camera}/{day}/check {calibration}");
            steps.step(&format!("{camera}/{day}/check"), &check, Some(&format!("checks/{camera}/{day}.json")))?;
            for recording in RECORDINGS {
                let name = format!("{camera}/{day}/recordings/{recording}");
                let run = format!(
                    "--quiet run {archive}/{camera}/{day}/{recording} --pipeline {pipeline} {calibration} --out results/{name}"
                );
                steps.step(&name, &run, None)?;
            }
        }
    }
    steps.step("fleet", "--quiet fleet . --out fleet", None)?;
    contents(&place)
}

struct Steps<'a> {
    program: &'a Path,
    place: &'a Path,
}

impl Steps<'_> {
    /// One step: its code and its log are where the workflow puts them.
    fn step(&self, name: &str, line: &str, answer: Option<&str>) -> Outcome {
        let file = |relative: &str| {
            let path = self.place.join(relative);
            path.parent().map_or(Ok(()), fs::create_dir_all)?;
            File::create(path)
        };
        let fail = |error: std::io::Error| format!("{name}: {error}");
        let log = file(&format!("logs/{name}.log")).map_err(fail)?;
        let answer = answer.map_or_else(|| Ok(Stdio::null()), |path| file(path).map(Stdio::from)).map_err(fail)?;
        let words = ["--threads", "2", "--no-times"].into_iter().chain(line.split_whitespace());
        let status = Command::new(self.program).args(words).current_dir(self.place).stdout(answer).stderr(log).status();
        let code = status.map_err(fail)?.code().filter(|code| [0, 1, 2, 3, 5].contains(code));
        let code = code.ok_or_else(|| format!("{name}: failed: see {}/logs", self.place.display()))?;
        file(&format!("codes/{name}.code")).map_err(fail)?;
        fs::write(self.place.join(format!("codes/{name}.code")), format!("{code}\n")).map_err(fail)
    }
}
