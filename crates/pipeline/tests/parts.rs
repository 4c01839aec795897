//! A run in parts, and its parts made whole, against one run.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use pipeline::commands::made::{Call, called};
use pipeline::{Error, Failure, Part, Plan, RunRequest, Silent, merge, run, run_part};

use crate::common;

/// Every file by its name, without the list of them.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut pending = vec![folder.to_owned()];
    while let Some(path) = pending.pop() {
        for path in fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path()) {
            if path.is_dir() {
                pending.push(path);
            } else {
                found.insert(path.strip_prefix(folder).unwrap().to_owned(), fs::read(&path).unwrap());
            }
        }
    }
    found
}

fn without_times<T>(work: impl FnOnce() -> T) -> T {
    called(Call { options: vec!["run".to_owned()], no_times: true, ..Call::default() }, work)
}

struct Setup {
    root: tempfile::TempDir,
    request: RunRequest,
}

impl Setup {
    fn new(stages: &str, survey: &Path) -> Self {
        let root = tempfile::tempdir().unwrap();
        let plan_path = root.path().join("plan.ron");
        fs::write(&plan_path, format!("(name: \"p\", stages: [{stages}])")).unwrap();
        let plan = Plan::read(&plan_path).unwrap();
        let (survey, out) = (Some(survey.to_owned()), root.path().join("out"));
        Self { root, request: RunRequest { plan, plan_path, survey, calibration: None, out } }
    }

    fn part(&self, number: usize, of: usize) -> pipeline::Result<PathBuf> {
        let out = self.root.path().join(format!("part{number}"));
        run_part(&RunRequest { out: out.clone(), ..self.request.clone() }, Part { number, of }, &Silent).map(|_| out)
    }

    /// One run, and `of` parts made whole into the same folder, named last first.
    fn whole_and_merged(&self, of: usize) -> [BTreeMap<PathBuf, Vec<u8>>; 2] {
        without_times(|| {
            run(&self.request, &Silent).unwrap();
            let whole = files(&self.request.out);
            let parts: Vec<PathBuf> = (1..=of).rev().map(|number| self.part(number, of).unwrap()).collect();
            merge(&parts, &self.request.out, &Silent).unwrap();
            [whole, files(&self.request.out)]
        })
    }
}

const STAGES: &str = "Demodulate(low_amplitude: 20), Average(), Deconvolve(), Unwrap(maximum_range_m: 12), CorrectRange(), \
                      CorrectImagePoint(), Multipath(), PointCloud(), Flag(mixed_pixels: (treatment: split))";

/// A room of eight stations on a quarter of the pixels, two frames each.
fn room(folder: &Path) -> PathBuf {
    room_with("frames_per_station: 2", folder)
}

/// The same with other frames.
fn room_with(frames: &str, folder: &Path) -> PathBuf {
    let text = fs::read_to_string(common::fixtures().join("scenes/room_small.ron")).unwrap();
    let text = text
        .replace("width: 132, height: 108", "width: 66, height: 54")
        .replace("0.05333333333333334", "0.10666666666666667")
        .replace("frames_per_station: 4", frames);
    let scene = folder.join("room.ron");
    fs::write(&scene, text).unwrap();
    common::simulated_from(&scene, 1, folder)
}

fn assert_same([whole, merged]: [BTreeMap<PathBuf, Vec<u8>>; 2]) {
    assert_eq!(whole.keys().collect::<Vec<_>>(), merged.keys().collect::<Vec<_>>());
    for (name, bytes) in &whole {
        assert!(*bytes == merged[name], "{} differs", name.display());
    }
    assert!(whole.keys().any(|name| name.ends_with("report.html")) && whole.len() > 5);
}

/// Summary with its quantiles, report with its pictures, cloud, tables: all of one run, bit for bit.
#[test]
fn parts_made_whole_are_one_run() {
    let folder = tempfile::tempdir().unwrap();
    let survey = room(folder.path());
    // Means of frames; then every frame a view of its own, which is cut within stations, and more parts than views.
    assert_same(Setup::new(STAGES, &survey).whole_and_merged(3));
    assert_same(Setup::new(&STAGES.replace("Average(), ", ""), &survey).whole_and_merged(5));
    // Without poses each cloud is in the frame of its own camera.
    fs::remove_file(survey.join("stations.csv")).unwrap();
    let [whole, merged] = Setup::new("Demodulate(), Average(), Unwrap(), PointCloud()", &survey).whole_and_merged(9);
    assert!(whole.keys().any(|name| name.starts_with("clouds")));
    assert_same([whole, merged]);
}

/// Exposures fused, ranges that came as such, and a survey without a truth.
#[test]
fn parts_of_other_levels_are_whole_too() {
    let folder = tempfile::tempdir().unwrap();
    let survey = room_with("frames_per_station: 1, further_integration_times_s: [0.001]", folder.path());
    let text = fs::read_to_string(survey.join("survey.ron")).unwrap();
    let truth = text.find("truth:").unwrap();
    // The last field but for those after it, up to the end of its brackets.
    let mut depth = 0;
    let end = text[truth..].find(|c| {
        depth += match c {
            '(' | '[' => 1,
            ')' | ']' => -1,
            _ => 0,
        };
        depth == 0 && c == ')'
    });
    let mut without = text.clone();
    without.replace_range(truth..=truth + end.unwrap(), "truth: None");
    fs::write(survey.join("survey.ron"), without).unwrap();
    let stages = "Demodulate(), Average(), Unwrap(), CorrectRange(), FuseExposures(), PointCloud(), Flag()";
    assert_same(Setup::new(stages, &survey).whole_and_merged(3));
}

#[test]
fn what_can_be_no_part_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let survey = room(folder.path());
    let refused = |result: pipeline::Result<PathBuf>| match result {
        Err(error @ Error::Request { .. }) if error.failure() == Failure::Usage => error.to_string(),
        other => format!("{other:?}"),
    };
    let joins = Setup::new(&format!("{STAGES}, Register()"), &survey);
    assert!(refused(joins.part(1, 2)).contains("stage Register brings all stations together"));
    let setup = Setup::new("Demodulate(), Average(), Unwrap()", &survey);
    assert!(refused(setup.part(0, 2)).contains("--shard 0/2") && refused(setup.part(3, 2)).contains("--shard 3/2"));

    let parts: Vec<PathBuf> = (1..=2).map(|number| setup.part(number, 2).unwrap()).collect();
    let merged = |parts: &[PathBuf]| refused(merge(parts, &setup.request.out, &Silent).map(|_| PathBuf::new()));
    assert!(merged(&parts[..1]).contains("expected 2 parts, found 1"));
    assert!(merged(&[parts[0].clone(), parts[0].clone()]).contains("part 2 is missing or there twice"));
    assert!(merged(std::slice::from_ref(&survey)).contains("summary.json"));
    let bytes = fs::read(parts[1].join("part.bin")).unwrap();
    fs::write(parts[1].join("part.bin"), &bytes[..bytes.len() / 2]).unwrap();
    assert!(merged(&parts).contains("is not what its part wrote"));
    fs::write(parts[1].join("part.bin"), &bytes).unwrap();
    fs::write(survey.join("stations.csv"), "station,x,y,z,omega,phi,kappa\n").unwrap();
    assert!(merged(&parts).contains("has changed since the parts ran"));
    // The output may not lie over a part.
    assert!(merge(&parts, &parts[0], &Silent).is_err());
}
