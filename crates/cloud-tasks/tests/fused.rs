//! Results as one cloud in which each surface stands once.

use cloud_tasks::commands::{DoubtKind, Error, Failure, Judged, Silent, Verdict};
use cloud_tasks::measurement::nalgebra::Vector3;
use cloud_tasks::range_io::clouds::{CloudFile, CloudFormat, read_any_cloud};
use cloud_tasks::range_io::ply::read_cloud;
use cloud_tasks::{FrameErrors, FuseRequest, FuseSummary, fuse};

use crate::results::Folder;

/// Pixels of the scene are 3 cm apart: cells that hold some of each frame.
const VOXEL_M: f64 = 0.1;

fn request(folder: &Folder) -> FuseRequest {
    FuseRequest {
        result: folder.path("result"),
        voxel_m: Some(VOXEL_M),
        as_stated: false,
        format: CloudFormat::Ply,
        out: folder.path("out"),
    }
}

fn fused(folder: &Folder) -> Result<FuseSummary, Error> {
    fuse(&request(folder), &Silent)
}

fn is_finite(cloud: &CloudFile) -> bool {
    let places = cloud.points.iter().flatten().all(|value| value.is_finite());
    let others = [&cloud.sigma, &cloud.intensity].into_iter().flatten().flatten().all(|value| value.is_finite());
    places && others && cloud.normals.iter().flatten().flatten().all(|value| value.is_finite())
}

/// Mean squared error over variance of the fused points of the wall z = 0.
fn squared_error_of_wall(cloud: &CloudFile) -> f64 {
    let (normals, sigma) = (cloud.normals.as_ref().unwrap(), cloud.sigma.as_ref().unwrap());
    let on_wall = |at: &usize| {
        let [x, y, z] = cloud.points[*at];
        (-0.3..0.9).contains(&x) && (-0.2..0.35).contains(&y) && z.abs() < 0.1 && normals[*at][2] > 0.99
    };
    let wall: Vec<usize> = (0..cloud.points.len()).filter(on_wall).collect();
    assert!(wall.len() > 30, "{}", wall.len());
    let squares = wall.iter().map(|at| (cloud.points[*at][2] / f64::from(sigma[*at])).powi(2));
    squares.sum::<f64>() / wall.len() as f64
}

#[test]
fn each_surface_stands_once_and_its_sigma_holds() {
    let mut squares = Vec::new();
    for seed in 20..32 {
        let folder = Folder::new(seed);
        folder.write_cloud(&[5, 700]);
        let summary = fused(&folder).unwrap();
        let cloud = read_cloud(folder.path("out/cloud.ply")).unwrap();
        let rest = read_cloud(folder.path("out/unfused.ply")).unwrap();
        assert_eq!(cloud.len(), summary.fused_points);
        assert!(3 * cloud.len() < folder.survey.points.len(), "{} points", cloud.len());
        // Each point is in one of the two, or was used.
        let named: usize = summary.unfused.values().sum();
        assert_eq!(rest.len(), named + 2);
        assert_eq!(summary.points.fused + rest.len(), folder.survey.points.len());
        assert_eq!(rest.flags.as_ref().unwrap().iter().filter(|flags| **flags != 0).count(), 2);
        assert!(rest.frame.is_some() && is_finite(&cloud) && is_finite(&rest));
        squares.push(squared_error_of_wall(&cloud));
    }
    // Points of one survey share its common errors, so that a survey is worth one square at least: the mean of twelve is within these
    // limits of chi-squared with twelve degrees of freedom in 998 of 1000 cases.
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    assert!((0.18..2.75).contains(&mean), "{mean} of {squares:?}");
}

#[test]
fn figures_and_files_say_the_same() {
    let folder = Folder::new(3);
    let summary = fused(&folder).unwrap();
    let sigma = summary.sigma.as_ref().unwrap();
    assert!((sigma.shares.values().sum::<f64>() - 1.0).abs() < 1e-9, "{sigma:?}");
    assert!((0.0005..0.006).contains(&sigma.median_m), "{sigma:?}");
    let thickness = summary.thickness.unwrap();
    assert!(
        thickness.after_m <= thickness.before_m && thickness.noise_m < thickness.noise_and_sensor_m,
        "{thickness:?}"
    );
    // Neighbours share more than a cell: the mean takes a part of what they have in common.
    assert!((0.7..1.2).contains(&(thickness.after_m / thickness.noise_and_sensor_m)), "{thickness:?}");
    assert!(summary.apart.is_empty(), "{:?}", summary.apart);
    assert_eq!(summary.verdict(), if summary.doubts.is_empty() { Verdict::Done } else { Verdict::Doubtful });
    let (page, json) = (folder.read("report.html"), folder.read("summary.json"));
    for title in ["Standard deviation along the normal", "wall: before", "wall: after", "mean share of the variance"] {
        assert!(page.contains(title), "{title}");
    }
    // No number that is none; `null` would be one in `summary.json`.
    assert!(!page.contains("NaN") && !json.contains("null"), "{json}");
    assert!(json.contains("\"voxel_m\": 0.1") && summary.to_string().contains("fused points"));
    let again = fused(&folder).unwrap();
    assert_eq!(again.sigma.unwrap().median_m.to_bits(), sigma.median_m.to_bits());
}

#[test]
fn with_common_errors_as_stated_nothing_moves() {
    let folder = Folder::new(4);
    let summary = fuse(&FuseRequest { as_stated: true, ..request(&folder) }, &Silent).unwrap();
    let thickness = summary.thickness.unwrap();
    assert_eq!(thickness.before_m, thickness.after_m);
    assert!(summary.corrections.iter().all(|correction| correction.value == 0.0));
    assert_eq!(summary.common_error_use, "as_stated");
    assert!(folder.read("summary.json").contains("as_stated"));
    assert!(fused(&folder).unwrap().sigma.unwrap().median_m < summary.sigma.unwrap().median_m);
}

#[test]
fn a_station_far_from_its_pose_is_named() {
    let mut folder = Folder::new(5);
    // Ten standard deviations of its place.
    let shift = Vector3::new(0.0, 0.0, 0.02);
    let of_points = folder.survey.errors.of_points.clone();
    for (point, _) in folder.survey.points.iter_mut().zip(of_points).filter(|(_, of)| of.station == 1) {
        *point += shift;
    }
    folder.write_cloud(&[]);
    let summary = fused(&folder).unwrap();
    assert_eq!(summary.apart.len(), 1, "{:?}", summary.apart);
    assert_eq!(summary.apart[0].frames, ["S1"]);
    assert!(summary.apart[0].p_value < 1e-3);
    let doubt = &summary.doubts[0];
    assert!(doubt.kind == DoubtKind::Contradiction && doubt.subject.as_deref() == Some("S1"), "{doubt:?}");
    assert_eq!(summary.verdict(), Verdict::Doubtful);
    assert!(folder.read("report.html").contains("Stations that do not fit"));
}

#[test]
fn frames_of_a_station_that_were_not_averaged_are_a_doubt() {
    let folder = Folder::new(9);
    let said_of = |frames: u32| {
        let station = |point: usize| folder.survey.errors.of_points[point].station as u32;
        folder.write_cloud_of_frames(&[], |point| station(point) * frames + point as u32 % frames);
        let mut errors = folder.common_errors();
        let copies = |frame: FrameErrors| {
            let copy = move |number| FrameErrors { view: format!("{}, frame {number}", frame.view), ..frame.clone() };
            (0..frames).map(copy)
        };
        errors.frames = errors.frames.into_iter().flat_map(copies).collect();
        folder.write_errors(&errors);
        let summary = fused(&folder).unwrap();
        summary.doubts.into_iter().find(|doubt| doubt.words.contains("Average()"))
    };
    assert_eq!(said_of(16), None);
    let doubt = said_of(17).unwrap();
    assert!(doubt.kind == DoubtKind::Noise && doubt.subject.as_deref() == Some("S2"), "{doubt:?}");
    assert!(doubt.words.starts_with("17 frames") && doubt.words.contains("than 16: 3)"), "{doubt:?}");
}

#[test]
fn many_surfaces_that_cannot_both_be_there_are_a_doubt() {
    let mut folder = Folder::new(7);
    let of_points = folder.survey.errors.of_points.clone();
    for (point, _) in folder.survey.points.iter_mut().zip(of_points).filter(|(_, of)| of.station == 1) {
        // Further than any partner is looked for.
        point.z += 0.2;
    }
    folder.write_cloud(&[]);
    let mut errors = folder.common_errors();
    errors.frames[1].position_m[2] += 0.2;
    folder.write_errors(&errors);
    let summary = fused(&folder).unwrap();
    assert!(summary.contradicted_points * 20 > summary.fused_points, "{}", summary.contradicted_points);
    // Three others saw through what one saw.
    assert!(summary.outvoted_points > 0 && summary.unfused["outvoted"] > 0, "{:?}", summary.unfused);
    assert!(summary.findings.iter().any(|finding| finding.contains("were given up")), "{:?}", summary.findings);
    let most = summary.contradictions.iter().max_by_key(|found| found.pairs).unwrap();
    assert!(most.front == "S1" && (most.median_distance_m - 0.2).abs() < 0.01, "{most:?}");
    let doubt = summary.doubts.iter().find(|doubt| doubt.words.contains("saw through")).unwrap();
    assert!(doubt.kind == DoubtKind::Contradiction && doubt.words.contains("what S1 saw, "), "{doubt:?}");
}

#[test]
fn what_cannot_be_fused_is_refused_by_name() {
    let mut folder = Folder::new(6);
    let said = |folder: &Folder, request: &FuseRequest, failure: Failure| {
        let error = fuse(request, &Silent).unwrap_err();
        assert_eq!(error.failure(), failure, "{error}");
        // A refusal may leave its summary; no other file.
        assert!(!folder.path("out").join("cloud.ply").exists());
        error.to_string()
    };
    let asked = request(&folder);
    let found = said(&folder, &FuseRequest { voxel_m: Some(-0.1), ..asked.clone() }, Failure::Usage);
    assert!(found.contains("fuse: option voxel_m is -0.1"), "{found}");
    let found = said(&folder, &FuseRequest { voxel_m: Some(0.002), ..asked.clone() }, Failure::Refused);
    assert!(found.contains("take cells of"), "{found}");
    assert!(folder.read("summary.json").contains("take cells of"));
    let found = said(&folder, &FuseRequest { result: folder.path("nowhere/at all"), ..asked.clone() }, Failure::Usage);
    assert!(found.contains("nowhere"), "{found}");
    let metre = folder.survey.points.clone();
    for point in &mut folder.survey.points {
        point.coords *= 1000.0;
    }
    folder.write_cloud(&[]);
    let found = said(&folder, &asked, Failure::Usage);
    assert!(found.contains("millimetres") && found.contains("common_errors.ron"), "{found}");
    for (point, metre) in folder.survey.points.iter_mut().zip(&metre) {
        point.coords = metre.coords.yxz();
    }
    folder.write_cloud(&[]);
    let found = said(&folder, &asked, Failure::Usage);
    assert!(found.contains("its camera cannot see them") && found.contains("columns exchanged"), "{found}");
    folder.survey.points = metre;
    let all: Vec<usize> = (0..folder.survey.points.len()).collect();
    folder.write_cloud(&all);
    let found = said(&folder, &asked, Failure::Refused);
    assert!(found.contains("no points to fuse"), "{found}");
    folder.write_cloud(&[]);
    std::fs::remove_file(folder.path("result/common_errors.ron")).unwrap();
    let found = said(&folder, &asked, Failure::Usage);
    assert!(found.contains("common_errors.ron") && found.contains("run the pipeline again"), "{found}");
    let summary = r#"{"result": "rooms/north", "fused_points": 12}"#;
    std::fs::write(folder.path("result/summary.json"), summary).unwrap();
    let found = said(&folder, &asked, Failure::Usage);
    assert!(found.contains("made of, rooms/north"), "{found}");
}

#[test]
fn other_formats_hold_the_same_points() {
    let folder = Folder::new(3);
    folder.write_cloud(&[]);
    fused(&folder).unwrap();
    let ply = read_cloud(folder.path("out/cloud.ply")).unwrap();
    for (format, name) in [(CloudFormat::Pcd, "cloud.pcd"), (CloudFormat::E57, "cloud.e57")] {
        let out = folder.path(name.rsplit_once('.').unwrap().1);
        let summary = fuse(&FuseRequest { format, out: out.clone(), ..request(&folder) }, &Silent).unwrap();
        assert!(summary.to_string().contains(name), "{summary}");
        let other = read_any_cloud(out.join(name)).unwrap();
        assert_eq!(other.points, ply.points);
        assert_eq!((other.normals, other.sigma), (ply.normals.clone(), ply.sigma.clone()));
    }
    let answer = fuse(&FuseRequest { format: CloudFormat::Vtk, out: folder.path("vtk"), ..request(&folder) }, &Silent);
    assert!(matches!(answer, Err(Error::Request { .. })), "{answer:?}");
    assert!(!folder.path("vtk").exists());
}

#[test]
fn a_depth_camera_is_asked_for_what_all_its_frames_share() {
    let folder = Folder::new(3);
    folder.write_cloud(&[]);
    let path = folder.path("result/calibration.ron");
    let calibration = std::fs::read_to_string(&path).unwrap();
    let noise = "range_noise: Some((sigma_times_amplitude_m: 0.002, floor_m: 0.0, amplitude_scale: InverseSquaredRange)),\n    provenance";
    std::fs::write(&path, calibration.replacen("provenance", noise, 1)).unwrap();
    let summary = fused(&folder).unwrap();
    // This one bends nothing, and its nodes are not listed among the corrections.
    assert!(summary.shared_error.is_none(), "{:?}", summary.shared_error);
    assert!(summary.findings.iter().any(|words| words.contains("No error that all frames")), "{:?}", summary.findings);
    assert_eq!(summary.corrections.len(), summary.common_errors);
}
