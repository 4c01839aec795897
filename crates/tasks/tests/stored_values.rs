//! Ranges or depths, told by the frames of real cameras and of a simulated room, whatever the survey states.

use std::path::{Path, PathBuf};

use pipeline::{DoubtKind, Judged, Silent};
use range_image::Raster;
use range_io::npz::NpzReader;
use range_io::survey::{FrameEntry, InputFrame, Level, Survey, SurveyCamera, read_frame, read_truth, write_frame};
use tasks::inspect;

use crate::common::{fixtures, has_capture, simulated};

/// What a capture stores, its camera, and some of its frames in metre.
struct Capture {
    name: &'static str,
    kind: Level,
    camera: SurveyCamera,
    frames: Vec<Raster<f32>>,
}

/// At most eight frames, evenly over a survey.
fn capture(name: &'static str, kind: Level, folder: &Path) -> Capture {
    let survey = Survey::read(folder).unwrap();
    let every = survey.frames.len().div_ceil(8);
    let frames =
        (0..survey.frames.len()).step_by(every).map(|index| match read_frame(&survey, folder, index).unwrap() {
            InputFrame::Range { range, .. } => range,
            InputFrame::Depth { depth, .. } => depth,
            other => panic!("{name}: {:?}", other.level()),
        });
    Capture { name, kind, camera: survey.camera.clone(), frames: frames.collect() }
}

fn real() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/real")
}

/// The capture as a survey at a level, right or wrong.
fn survey(capture: &Capture, level: Level, folder: &Path) {
    std::fs::create_dir_all(folder).unwrap();
    let mut entries = Vec::new();
    for (index, frame) in capture.frames.iter().enumerate() {
        let file = PathBuf::from(format!("{index}.npz"));
        let (values, amplitude, confidence) = (frame.clone(), None, None);
        let frame = match level {
            Level::Range => InputFrame::Range { range: values, amplitude, confidence },
            _ => InputFrame::Depth { depth: values, amplitude, confidence },
        };
        write_frame(folder.join(&file), &frame).unwrap();
        entries.push(FrameEntry {
            file,
            station: format!("S{index}"),
            timestamp_s: Some(index as f64),
            integration_time_s: None,
            temperature_c: None,
        });
    }
    Survey::new(capture.camera.clone(), level, entries).write(folder.join(Survey::FILE_NAME)).unwrap();
}

/// What `inspect` makes of a capture as it is and with the other level stated: 1 right, -1 wrong, 0 not told.
fn verdict(capture: &Capture) -> i32 {
    let folder = tempfile::tempdir().unwrap();
    let doubted = [Level::Range, Level::Depth].map(|level| {
        let folder = folder.path().join(level.name());
        survey(capture, level, &folder);
        let found = inspect(&folder).unwrap();
        for line in found
            .to_string()
            .lines()
            .filter(|line| ["values", "unit", "no dist"].iter().any(|name| line.trim_start().starts_with(name)))
        {
            println!("{} stated as {}: {}", capture.name, level.name(), line.trim());
        }
        found.doubts().iter().any(|doubt| doubt.kind == DoubtKind::RangeOrDepth)
    });
    let (right, wrong) = if capture.kind == Level::Range { (doubted[0], doubted[1]) } else { (doubted[1], doubted[0]) };
    match (right, wrong) {
        (true, _) => -1,
        (false, true) => 1,
        (false, false) => 0,
    }
}

/// A guess of the ranges that the MLX75027 gives out, by its makers.
fn mlx75027() -> Capture {
    let camera = Survey::read(fixtures().join("surveys/mlx75027_scene")).unwrap().camera;
    let mut arrays = NpzReader::open(real().join("mlx75027_scene/camera_output.npz")).unwrap();
    let array = arrays.read("range_mm", |_| Ok(())).unwrap();
    let values: Vec<f32> = array.values.into_f32().into_iter().map(|value| value * 1e-3).collect();
    let frames = vec![Raster::from_vec(camera.width, camera.height, values).unwrap()];
    Capture { name: "mlx75027_scene", kind: Level::Range, camera, frames }
}

#[test]
fn real_captures_are_not_mistaken() {
    let mut counts = [0; 3];
    let mut judge = |capture: Capture| {
        let verdict = verdict(&capture);
        println!("{}: {verdict}", capture.name);
        counts[(verdict + 1) as usize] += 1;
    };
    let surveys = fixtures().join("surveys");
    if has_capture("sr4000_steps") {
        judge(capture("sr4000_steps", Level::Range, &surveys.join("sr4000_steps")));
    }
    if has_capture("azure_kinect_mug") {
        judge(capture("azure_kinect_mug", Level::Depth, &surveys.join("azure_kinect_mug")));
    }
    if has_capture("mlx75027_scene") {
        judge(mlx75027());
    }
    for name in ["sevenscenes_redkitchen", "sevenscenes_redkitchen_dense"] {
        if has_capture(name) {
            judge(capture(name, Level::Depth, &real().join(name)));
        }
    }
    let [wrong, open, right] = counts;
    println!("right {right}, wrong {wrong}, not told {open}");
    assert_eq!(wrong, 0);
}

#[test]
fn a_simulated_room_is_told_either_way() {
    let folder = tempfile::tempdir().unwrap();
    let room = simulated("room_small", 1, folder.path());
    let survey = Survey::read(&room).unwrap();
    let camera = survey.camera.clone();
    let rays = camera_model::RayTable::new(&camera.nominal_camera().unwrap()).unwrap();
    let ranges: Vec<Raster<f32>> =
        (0..8).map(|index| read_truth(&survey, &room, 2 * index).unwrap().unwrap().range).collect();
    let depths = ranges.iter().map(|range| rays.range_to_depth(range).unwrap()).collect();
    for (kind, frames) in [(Level::Range, ranges), (Level::Depth, depths)] {
        assert_eq!(verdict(&Capture { name: "room_small", kind, camera: camera.clone(), frames }), 1);
    }
}

#[test]
fn a_run_doubts_a_level_that_is_wrong_and_a_code_that_is_read_as_a_distance() {
    let folder = tempfile::tempdir().unwrap();
    let room = simulated("room_small", 1, folder.path());
    let simulated = Survey::read(&room).unwrap();
    let mut frame = read_truth(&simulated, &room, 0).unwrap().unwrap().range;
    for value in frame.as_mut_slice().iter_mut().step_by(97) {
        *value = 65.535;
    }
    let capture = Capture { name: "room", kind: Level::Range, camera: simulated.camera.clone(), frames: vec![frame] };
    let stated = folder.path().join("stated");
    survey(&capture, Level::Depth, &stated);
    let plan = pipeline::Plan::from_ron("(name: \"x\", stages: [PointCloud()])", "x.ron".as_ref()).unwrap();
    let outcome = pipeline::process(&plan, &stated, None, &Silent).unwrap();
    for kind in [DoubtKind::RangeOrDepth, DoubtKind::InvalidValues] {
        assert!(outcome.doubts.iter().any(|doubt| doubt.kind == kind), "{kind:?}: {:?}", outcome.doubts);
    }
}
