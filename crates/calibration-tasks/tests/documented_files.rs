//! Every pipeline, survey and network that the documentation shows is read, and the pipelines are run; so is every
//! pipeline of the repository.

use std::path::{Path, PathBuf};

use calibration_tasks::NetworkScene;
use pipeline::{Plan, RunRequest, Silent, Source, Stage, Summary};
use range_io::survey::Survey;

use crate::common::{fixtures, has_capture, request, simulated};
use crate::room::require_the_bars_of_the_room;

/// Pipelines of the repository that are run elsewhere or not at all, each with the reason.
const NOT_RUN_HERE: [(&str, &str); 1] = [("room_small", "run against its bars in room.rs")];

/// A block of RON in a page, with the place it stands at.
struct Block {
    place: String,
    text: String,
}

/// All pages of the documentation.
fn pages() -> Vec<PathBuf> {
    let root = fixtures().join("..");
    let markdown = |folder: PathBuf| {
        let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        files.filter(|path| path.extension().is_some_and(|ending| ending == "md")).collect::<Vec<_>>()
    };
    let crates = std::fs::read_dir(root.join("crates")).unwrap().map(|entry| entry.unwrap().path().join("README.md"));
    let mut pages = [markdown(root.clone()), markdown(root.join("docs")), crates.collect()].concat();
    pages.sort();
    pages
}

fn blocks() -> Vec<Block> {
    let of_page = |page: PathBuf| {
        let text = std::fs::read_to_string(&page).unwrap();
        let mut found = Vec::new();
        let mut open: Option<Block> = None;
        for (index, line) in text.lines().enumerate() {
            match &mut open {
                None if line.trim() == "```ron" => {
                    let place = format!("{}:{}", page.display(), index + 1);
                    open = Some(Block { place, text: String::new() });
                }
                None => {}
                Some(_) if line.trim() == "```" => found.extend(open.take()),
                Some(block) => block.text.extend([line, "\n"]),
            }
        }
        found
    };
    pages().into_iter().flat_map(of_page).collect()
}

#[test]
fn every_file_in_the_documentation_does_what_it_is_shown_for() {
    let folder = tempfile::tempdir().unwrap();
    let room = folder.path().join("room");
    let mut kinds = [0; 3];
    for (index, Block { place, text }) in blocks().into_iter().enumerate() {
        println!("{place}");
        let file = folder.path().join(format!("{index}.ron"));
        if text.contains("stages:") {
            let plan = Plan::from_ron(&text, &file).unwrap_or_else(|error| panic!("{place}: {error}"));
            let summary = run_on_the_small_room(plan, &room, &folder.path().join(index.to_string()));
            require_a_good_room(&summary.unwrap_or_else(|error| panic!("{place}: {error}")), &place);
            kinds[0] += 1;
        } else if text.contains("sightings:") {
            NetworkScene::from_ron(&text, &file).unwrap_or_else(|error| panic!("{place}: {error}"));
            kinds[1] += 1;
        } else if text.contains("cameras:") || text.contains("lengths:") {
            // A rig, which `rig-tasks` reads in a test of its own, and lengths, which `cloud-tasks` does.
        } else {
            Survey::parse(&file, &text).unwrap_or_else(|error| panic!("{place}: {error}"));
            kinds[2] += 1;
        }
    }
    // That of the crate's README and that of the page on files, and one of each other kind at least.
    assert!(kinds[0] >= 2 && kinds[1] >= 1 && kinds[2] >= 1, "{kinds:?}");
}

/// What is shown runs on the small room whatever source it names.
fn run_on_the_small_room(plan: Plan, room: &Path, out: &Path) -> pipeline::Result<Summary> {
    if !room.exists() {
        std::fs::rename(simulated_with_poses(room.parent().unwrap()), room).unwrap();
    }
    let request = RunRequest {
        plan: Plan { source: None, ..plan },
        plan_path: room.join("shown.ron"),
        survey: Some(room.to_owned()),
        calibration: None,
        out: out.to_owned(),
    };
    calibration_tasks::run(&request, &Silent)
}

fn simulated_with_poses(folder: &Path) -> PathBuf {
    simulated("room_small", 3, folder)
}

/// The small room's bars, see `room.rs`; a registered survey also has its poses.
fn require_a_good_room(summary: &Summary, place: &str) {
    println!("{summary}");
    let truth = summary.truth.as_ref().unwrap();
    assert!(truth.ranges.range_error_median_m < 0.006, "{place}: {}", truth.ranges.range_error_median_m);
    assert!(truth.ranges.wrap_count_right_fraction > 0.995, "{place}: {}", truth.ranges.wrap_count_right_fraction);
    assert!(truth.ranges.flagged_fraction < 0.25, "{place}: {} are flagged", truth.ranges.flagged_fraction);
    let registered = summary.stages.iter().any(|stage| stage.name == "Adjust");
    if registered {
        // Without a half width of the normals that fits half the pixels, a half more than the bar of room.rs.
        assert!(truth.position_error_max_m.unwrap() < 0.003, "{place}: {:?}", truth.position_error_max_m);
        assert!(truth.attitude_error_max_deg.unwrap() < 0.05, "{place}: {:?}", truth.attitude_error_max_deg);
    }
}

#[test]
fn every_pipeline_of_the_repository_runs() {
    let folder = tempfile::tempdir().unwrap();
    let mut names: Vec<String> = std::fs::read_dir(fixtures().join("pipelines"))
        .unwrap()
        .map(|entry| entry.unwrap().path().file_stem().unwrap().to_str().unwrap().to_owned())
        .collect();
    names.sort();
    for (listed, reason) in NOT_RUN_HERE {
        assert!(names.iter().any(|name| name == listed), "{listed} ({reason}) is not there any more");
    }
    let mut rooms = 0;
    for name in names.iter().filter(|name| !NOT_RUN_HERE.iter().any(|(listed, _)| listed == name)) {
        let plan = Plan::read(&fixtures().join("pipelines").join(name).with_extension("ron")).unwrap();
        if matches!(&plan.source, Some(Source::Survey { .. })) && !has_capture(name) {
            continue;
        }
        let summary = calibration_tasks::run(&request(name, &folder.path().join(name)), &Silent)
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(summary.points > 0, "{name} has no points");
        assert_eq!(summary.stages.len(), plan.stages.len(), "{name}");
        if plan.stages.iter().any(|stage| matches!(stage, Stage::Adjust(_))) {
            let truth = summary.truth.as_ref().unwrap();
            // The offset of an estimated calibration is known to 8 mm where a hyperbola is estimated beside it.
            let bar = if plan.calibrate.is_some() { 0.02 } else { 0.002 };
            assert!(truth.position_error_max_m.unwrap() < bar, "{name}: {:?}", truth.position_error_max_m);
            require_the_bars_of_the_room(&summary, name);
            rooms += 1;
        }
    }
    assert_eq!(rooms, 3, "the room and its variants with an estimated calibration and with gross errors");
}
