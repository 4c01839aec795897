//! Poses, the path and the map of a camera that moves.

use live_frames::camera_model::with_computer_vision_axes;
use live_tasks::commands::{DoubtKind, Judged, Verdict};
use live_tasks::{
    Ended, LiveRequest, LiveSource, LiveStatus, LiveSummary, LiveTracking, LiveWatch, PathVerdict, StreamTarget, live,
};
use range_io::clouds::read_any_cloud;
use range_io::nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use range_io::tables::read_stations;
use range_io::trajectory::{StampedPose, read_tum, write_tum};
use recordings::{Payload, Recording, Transform};

use crate::common::{MOVING, World};

const JUMP: &str = r#"
    (name: "J0", position_m: (0.4, 2.9, 1.9), attitude: LookAt(target_m: (0.3, 0.2, 2.2))),
    (name: "J1", position_m: (0.4, 2.9, 1.9), attitude: LookAt(target_m: (0.3, 0.2, 2.2))),
"#;
/// A hand's breadth before the middle of a wall.
const WALL: &str = r#"
    (name: "W0", position_m: (0.6, 1.2, 1.2), attitude: LookAt(target_m: (0, 1.2, 1.2))),
    (name: "W1", position_m: (0.6, 1.2, 1.2), attitude: LookAt(target_m: (0, 1.2, 1.2))),
"#;

/// All results of a recording into files of these names.
fn everything(world: &World) -> LiveRequest {
    let file = |name: &str| Some(StreamTarget::File(world.path(name)));
    LiveRequest {
        ply: file("clouds.ply"),
        mcap: file("images.mcap"),
        tracking: Some(LiveTracking {
            trajectory: file("trajectory.txt"),
            map: Some(world.path("map.ply")),
            ..LiveTracking::default()
        }),
        ..world.request(LiveSource::Path(world.survey()))
    }
}

/// The poses of a file, digit by digit: those that are read from it have quaternions that are normalised anew.
fn as_written(file: &std::path::Path) -> Vec<StampedPose> {
    let text = std::fs::read_to_string(file).unwrap();
    let pose = |line: &str| {
        let numbers: Vec<f64> = line.split(' ').map(|number| number.parse().unwrap()).collect();
        let [timestamp_s, x, y, z, i, j, k, w] = numbers[..] else { panic!("{line}") };
        let rotation = UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k));
        let written = Isometry3::from_parts(Translation3::new(x, y, z), rotation);
        StampedPose { timestamp_s, world_from_camera: with_computer_vision_axes(&written) }
    };
    text.lines().map(pose).collect()
}

fn transforms(world: &World) -> Vec<Transform> {
    let mut recording = Recording::open(world.path("images.mcap")).unwrap();
    let mut found = Vec::new();
    while let Some(message) = recording.next_message().unwrap() {
        if let Payload::Transforms(transforms) = message.payload {
            assert_eq!(recording.streams()[message.stream].name, "/tf");
            found.extend(transforms);
        }
    }
    found
}

#[test]
fn the_path_the_map_and_all_streams_are_in_one_world() {
    let world = World::moving("");
    let summary = live(&everything(&world), &mut ()).unwrap();
    let path = summary.path.as_ref().unwrap();
    assert_eq!((path.verdict, path.lost, summary.verdict()), (PathVerdict::Tracked, 0, Verdict::Done), "{summary}");
    assert!(path.datum.contains("S0") && path.datum.contains("stations.csv"), "{summary}");

    // The trajectory is that of a file written at once, and follows the true stations.
    let file = world.path("trajectory.txt");
    let poses = read_tum(&file).unwrap();
    let again = world.path("again.txt");
    write_tum(&again, &as_written(&file)).unwrap();
    // But for the sign of quaternions, which turn the same.
    let lines = |file: &std::path::Path| std::fs::read_to_string(file).unwrap().replace('-', "");
    assert_eq!(lines(&file), lines(&again));
    let truth = read_stations(world.survey().join("stations.csv")).unwrap();
    assert_eq!((poses.len(), truth.len()), (MOVING, MOVING));
    for (pose, truth) in poses.iter().zip(&truth) {
        let error = (truth.world_from_camera.inverse() * pose.world_from_camera).translation.vector.norm();
        assert!(error < 0.03, "{}: {error}", truth.station);
    }
    assert!((path.start_to_end_m - 0.02 * 7.0 * 1.25_f64.sqrt()).abs() < 0.03, "{summary}");

    let transforms = transforms(&world);
    assert_eq!(transforms.len(), MOVING);
    let text = std::fs::read_to_string(&file).unwrap();
    for (transform, line) in transforms.iter().zip(text.lines()) {
        assert_eq!((transform.parent.as_str(), transform.child.as_str()), ("world", "camera"));
        let numbers: Vec<f64> = line.split(' ').map(|number| number.parse().unwrap()).collect();
        assert_eq!([transform.translation_m.as_slice(), &transform.rotation].concat(), numbers[1..]);
    }

    // Points of clouds and map lie in the room.
    let clouds = std::fs::read(world.path("clouds.ply")).unwrap();
    assert_eq!(count(&clouds, "comment coordinates world"), MOVING);
    for name in ["clouds.ply", "map.ply"] {
        let cloud = read_any_cloud(world.path(name)).unwrap();
        let outside = cloud.points.iter().filter(|point| {
            point.iter().zip([4.0, 3.2, 2.4]).any(|(value, most)| *value < -0.1 || *value > most + 0.1)
        });
        assert!(outside.count() * 100 < cloud.points.len(), "{name}");
        assert!(cloud.points.len() > 500, "{name}: {}", cloud.points.len());
    }
    let map = read_any_cloud(world.path("map.ply")).unwrap();
    let report = path.map.as_ref().unwrap();
    assert_eq!((report.points, report.voxel_m, report.doubled), (map.points.len(), 0.05, 0), "{summary}");
    assert!(map.sigma.unwrap().iter().all(|sigma| (1e-4..0.1).contains(sigma)));
    assert!(map.normals.is_some());
}

fn count(bytes: &[u8], words: &str) -> usize {
    bytes.windows(words.len()).filter(|window| *window == words.as_bytes()).count()
}

/// Keeps every status.
#[derive(Default)]
struct Told {
    statuses: Vec<LiveStatus>,
    /// Frames after which it is to end.
    most: Option<usize>,
    asked: usize,
}

impl LiveWatch for Told {
    fn should_end(&mut self) -> bool {
        self.asked += 1;
        Some(self.asked) == self.most
    }

    fn status(&mut self, status: &LiveStatus) {
        self.statuses.push(status.clone());
    }
}

fn is_lost_at_the_end(world: &World, summary: &LiveSummary, told: &Told) {
    let path = summary.path.as_ref().unwrap();
    assert_eq!((path.verdict, path.lost, path.losses), (PathVerdict::Lost, 2, 1), "{summary}");
    assert_eq!(summary.verdict(), Verdict::Partial);
    assert_eq!(summary.doubts().iter().map(|doubt| doubt.kind).collect::<Vec<_>>(), [DoubtKind::LostFrames]);
    assert!(summary.to_string().contains("not found again"), "{summary}");
    // Frames go on, without a pose and never with an old one.
    assert_eq!(summary.frames, MOVING as u64 + 2);
    let last = told.statuses.last().unwrap();
    let status = last.path.as_ref().unwrap();
    assert_eq!((status.state, status.pose, status.position_sigma_m, status.lost_now), ("lost", None, None, 2));
    assert!(last.to_string().contains("lost for 2 frames"), "{last}");
    assert_eq!(read_tum(world.path("trajectory.txt")).unwrap().len(), MOVING);
    assert_eq!(transforms(world).len(), MOVING);
    let clouds = std::fs::read(world.path("clouds.ply")).unwrap();
    assert_eq!(count(&clouds, "comment coordinates world\ncomment world_from_camera"), MOVING);
    assert_eq!(count(&clouds, "comment coordinates camera\ncomment no pose: "), 2);
    assert!(!read_any_cloud(world.path("map.ply")).unwrap().points.is_empty());
}

#[test]
fn a_camera_that_is_lost_has_no_pose() {
    for further in [JUMP, WALL] {
        let world = World::moving(further);
        let mut told = Told::default();
        let summary = live(&everything(&world), &mut told).unwrap();
        is_lost_at_the_end(&world, &summary, &told);
    }
}

#[test]
fn who_watches_may_end_a_stream_and_has_all_results() {
    let world = World::moving("");
    let mut told = Told { most: Some(3), ..Told::default() };
    let summary = live(&everything(&world), &mut told).unwrap();
    assert_eq!((summary.frames, summary.ended, summary.verdict()), (3, Ended::Asked, Verdict::Done), "{summary}");
    assert_eq!(read_tum(world.path("trajectory.txt")).unwrap().len(), 3);
    assert_eq!(transforms(&world).len(), 3);
    assert!(read_any_cloud(world.path("map.ply")).unwrap().points.len() > 100);
}

#[test]
fn a_camera_that_sees_nothing_has_no_path() {
    let world = World::moving("");
    // What nothing was seen in.
    let blank = |frame: &mut live_tasks::LiveFrame| {
        let live_tasks::range_image::Samples::U16(samples) = &mut frame.samples else { panic!() };
        samples.fill(900);
    };
    let mut frames = world.frames();
    frames.iter_mut().for_each(blank);
    let bytes: Vec<u8> = frames.iter().flat_map(crate::common::bytes).collect();
    std::fs::write(world.path("blank"), bytes).unwrap();
    let request = LiveRequest { source: LiveSource::Path(world.path("blank")), ..everything(&world) };
    let summary = live(&request, &mut ()).unwrap();
    let path = summary.path.as_ref().unwrap();
    assert_eq!((path.verdict, path.lost, summary.verdict()), (PathVerdict::Lost, MOVING as u64, Verdict::Partial));
    assert_eq!(path.map.as_ref().unwrap().points, 0, "{summary}");
    assert_eq!(std::fs::read(world.path("trajectory.txt")).unwrap().len(), 0);
}

#[test]
fn a_clock_that_begins_anew_does_not_end_the_path() {
    let world = World::moving("");
    let mut frames = world.frames();
    for frame in &mut frames[4..] {
        frame.header.timestamp_s -= 50.0;
    }
    let bytes: Vec<u8> = frames.iter().flat_map(crate::common::bytes).collect();
    std::fs::write(world.path("stepped"), bytes).unwrap();
    let request = LiveRequest { source: LiveSource::Path(world.path("stepped")), ..everything(&world) };
    let summary = live(&request, &mut ()).unwrap();
    assert_eq!((summary.frames, summary.restarts), (MOVING as u64, 1), "{summary}");
    assert_eq!(summary.path.as_ref().unwrap().lost, 0, "{summary}");
}
