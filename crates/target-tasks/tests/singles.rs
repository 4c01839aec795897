//! Coded rings, discs, spheres and lights: named rightly, or said why not.

use std::fmt::Write;
use std::path::Path;

use calibration_tasks::{CalibrateRequest, CalibrationOptions, NetworkDatum, calibrate};
use pipeline::{Error, Judged, Silent, SimulateSource, Verdict, simulate};
use range_image::Raster;
use range_io::tables::{read_observations, read_stations, read_targets};
use target_tasks::{TargetKind, TargetsRequest, TargetsSummary, find_targets};
use targets::camera_model::Camera;
use targets::nalgebra::{Isometry3, Point3, Vector3};
use targets::{CodedOptions, codes};

use crate::boards::{calibration, request, write_png};
use crate::support::coded::PrintedCodes;
use crate::support::render::{Optics, Plane, render};
use crate::support::sensor::Sensor;
use crate::support::views::large_camera;

fn looking(words: &str, survey: &Path, out: &Path) -> TargetsRequest {
    let kind = TargetKind::parse(&words.split(' ').collect::<Vec<_>>()).unwrap();
    TargetsRequest { kind, ..request(survey, out) }
}

/// In a folder of images, with the principal distance of the camera.
fn in_images(words: &str, images: &Path, out: &Path) -> TargetsRequest {
    TargetsRequest { principal_distance_px: Some(540.0), ..looking(words, images, out) }
}

fn write_coordinates(path: &Path, targets: &[(String, [f64; 3])]) {
    let mut text = "target,x,y,z,sigma_x,sigma_y,sigma_z\n".to_owned();
    for (name, [x, y, z]) in targets {
        writeln!(text, "{name},{x},{y},{z},0.0002,0.0002,0.0002").unwrap();
    }
    std::fs::write(path.join("targets.csv"), text).unwrap();
}

/// 24 codes 0.1 m apart, and where they are.
fn wall() -> (PrintedCodes, Vec<(String, [f64; 3])>) {
    let all = codes(CodedOptions::default().bits).unwrap();
    let place = |k: usize| [(k % 6) as f64 * 0.1 - 0.25, 0.15 - (k / 6) as f64 * 0.1];
    let targets: Vec<_> = (0..24).map(|k| (all[3 * k], place(k))).collect();
    let known = targets.iter().map(|(code, [x, y])| (code.to_string(), [*x, *y, 0.0])).collect();
    (PrintedCodes { targets, radius_m: 0.012, dark: 0.1, bright: 0.9 }, known)
}

/// `world_from_camera` of some stations before the wall.
fn stations(count: usize) -> Vec<Isometry3<f64>> {
    let station = |k: usize| {
        let k = k as f64;
        let tilt = Vector3::new((1.7 * k).cos(), (1.7 * k).sin(), 0.0) * 35_f64.to_radians();
        let camera_from_wall =
            Isometry3::translation(0.0, 0.0, -0.95) * Isometry3::rotation(tilt) * Isometry3::rotation(Vector3::z() * k);
        camera_from_wall.inverse()
    };
    (0..count).map(station).collect()
}

fn picture_of_rings(camera: &Camera, wall: &PrintedCodes, pose: &Isometry3<f64>, seed: u64) -> Raster<f32> {
    let plane = Plane { world_from_plane: Isometry3::identity(), pattern: wall };
    let light = render(camera, pose, &[plane], &Optics::default());
    Sensor::grey(2.0).expose(&light, seed)
}

#[test]
fn rings_are_named_by_their_codes_and_calibrate_the_lens() {
    let folder = tempfile::tempdir().unwrap();
    let (images, found, out) = (folder.path().join("images"), folder.path().join("found"), folder.path().join("out"));
    std::fs::create_dir(&images).unwrap();
    let (camera, (wall, known)) = (large_camera(), wall());
    for (k, pose) in stations(8).iter().enumerate() {
        write_png(&images.join(format!("{k}.png")), &picture_of_rings(&camera, &wall, pose, k as u64));
    }
    // Two targets under each other's names: seen by the others.
    let mut mistaken = known.clone();
    (mistaken[4].1, mistaken[20].1) = (known[20].1, known[4].1);
    write_coordinates(&images, &mistaken);
    let told = find_targets(&in_images("rings 0.024", &images, &found), &Silent).unwrap();
    assert_eq!(told.verdict(), Verdict::Doubtful);
    for station in &told.stations {
        let names: Vec<&str> = station.left_out.iter().map(|left| left.target.as_str()).collect();
        assert!(names.iter().all(|name| [&*known[4].0, &*known[20].0].contains(name)), "{names:?}");
        assert!(
            !names.is_empty() && station.left_out[0].reason.contains("pixels from where"),
            "{:?}",
            station.left_out
        );
    }
    let page = std::fs::read_to_string(found.join("report.html")).unwrap();
    assert!(page.contains(&format!(">{}</text>", known[0].0)), "names stand beside the marks");

    write_coordinates(&images, &known);
    let summary = find_targets(&in_images("rings 0.024", &images, &found), &Silent).unwrap();
    assert_eq!((summary.stations.len(), summary.verdict()), (8, Verdict::Done), "{summary}");
    assert!(summary.points >= 8 * 22, "{summary}");
    assert!(summary.stations.iter().all(|station| station.unchecked == 0));
    let mut squares = Vec::new();
    for row in read_observations(found.join("observations.csv")).unwrap() {
        let (_, place) = known.iter().find(|(name, _)| *name == row.target).unwrap();
        let pose = stations(8)[row.station.parse::<usize>().unwrap()];
        let truth = camera.project(&pose.inverse_transform_point(&Point3::from(*place))).unwrap();
        let (pixel, sigma) = (row.pixel.unwrap(), row.sigma_pixel.unwrap());
        squares.extend([0, 1].map(|axis| ((pixel[axis] - truth[axis]) / sigma[axis]).powi(2)));
    }
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    // One is expected; the centre of a circle is within what its two planes leave, which is stated too cautiously.
    assert!((0.5..1.5).contains(&mean), "{mean}");

    let standard = calibration(&found, &out);
    let options = CalibrationOptions { datum: NetworkDatum::Control, ..standard.options.clone() };
    let calibrated = calibrate(&CalibrateRequest { options, ..standard }, &Silent).unwrap();
    let c = calibrated.parameters.get("c").unwrap();
    let error = c.value - camera.interior.principal_distance_mm;
    assert!(error.abs() < 4.0 * c.sigma_posterior && c.sigma_posterior < 0.02, "{error} {}", c.sigma_posterior);
}

#[test]
fn rings_in_a_mirror_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let (images, found) = (folder.path().join("images"), folder.path().join("found"));
    std::fs::create_dir(&images).unwrap();
    let (camera, (wall, _)) = (large_camera(), wall());
    let image = picture_of_rings(&camera, &wall, &stations(1)[0], 1);
    let flipped = Raster::from_fn(image.width(), image.height(), |col, row| image[(image.width() - 1 - col, row)]);
    write_png(&images.join("0.png"), &flipped);
    let refused = find_targets(&in_images("rings 0.024", &images, &found), &Silent).unwrap_err().to_string();
    assert!(refused.contains("mirrored"), "{refused}");
}

#[test]
fn rings_that_cannot_be_told_apart_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let (images, found) = (folder.path().join("images"), folder.path().join("found"));
    std::fs::create_dir(&images).unwrap();
    let (camera, (mut wall, known)) = (large_camera(), wall());
    wall.targets[7].0 = wall.targets[2].0;
    write_png(&images.join("0.png"), &picture_of_rings(&camera, &wall, &stations(1)[0], 1));
    let without = find_targets(&looking("rings 0.024", &images, &found), &Silent).unwrap_err().to_string();
    assert!(without.contains("--principal-distance"), "{without}");
    let summary = find_targets(&in_images("rings 0.024", &images, &found), &Silent).unwrap();
    assert_eq!(summary.stations[0].unchecked, summary.points);
    assert!(summary.to_string().contains("nothing checks these names"), "{summary}");
    let twice: Vec<_> = summary.stations[0].left_out.iter().map(|left| (&left.target, &left.reason)).collect();
    assert!(twice.len() == 2 && twice.iter().all(|(name, why)| **name == known[2].0 && why.contains("twice")));
    let foreign: Vec<_> = known.iter().map(|(name, place)| (name.replace('R', "T"), *place)).collect();
    write_coordinates(&images, &foreign);
    let refused = find_targets(&in_images("rings 0.024", &images, &found), &Silent).unwrap_err();
    assert!(
        matches!(refused, Error::Refused { .. }) && refused.to_string().contains("among the targets of targets.csv")
    );
}

#[test]
fn codes_without_coordinates_are_checked_by_other_stations() {
    let folder = tempfile::tempdir().unwrap();
    let (images, found) = (folder.path().join("images"), folder.path().join("found"));
    std::fs::create_dir(&images).unwrap();
    let (camera, (wall, known)) = (large_camera(), wall());
    // The second picture shows ring 8 with the code of ring 15, which is not in it.
    let mut mistaken = wall.clone();
    mistaken.targets[8].0 = wall.targets[15].0;
    mistaken.targets.remove(15);
    for (k, pose) in stations(3).iter().enumerate() {
        let wall = if k == 1 { &mistaken } else { &wall };
        write_png(&images.join(format!("{k}.png")), &picture_of_rings(&camera, wall, pose, k as u64));
    }
    let summary = find_targets(&in_images("rings 0.024", &images, &found), &Silent).unwrap();
    assert_eq!(summary.verdict(), Verdict::Doubtful, "{summary}");
    assert!(summary.stations.iter().map(|station| station.unchecked).sum::<usize>() <= 2, "{summary}");
    let left_out = summary.stations.iter().map(|station| station.left_out.iter().map(|left| left.target.as_str()));
    let left_out: Vec<Vec<&str>> = left_out.map(Iterator::collect).collect();
    assert_eq!(left_out, [vec![], vec![known[15].0.as_str()], vec![]], "{summary}");
    assert!(summary.stations[1].left_out[0].reason.contains("read wrongly here"), "{summary}");
    let rows = read_observations(found.join("observations.csv")).unwrap();
    assert!(!rows.iter().any(|row| row.station == "1" && row.target == known[15].0));
    assert_eq!(rows.len(), summary.points);
}

/// Lights at places, seen by a camera.
fn picture_of_lights(camera: &Camera, pose: &Isometry3<f64>, places: &[[f64; 3]]) -> Raster<f32> {
    let seen = |place: &[f64; 3]| camera.project(&pose.inverse_transform_point(&Point3::from(*place))).unwrap();
    let pixels: Vec<[f64; 2]> = places.iter().map(seen).collect();
    let light = Raster::from_fn(camera.format.width, camera.format.height, |col, row| {
        let of = |[x, y]: &[f64; 2]| 0.8 * (-((col as f64 - x).powi(2) + (row as f64 - y).powi(2)) / 1.8).exp();
        (0.05 + pixels.iter().map(of).sum::<f64>()) as f32
    });
    Sensor::grey(1.0).expose(&light, 5)
}

#[test]
fn lights_are_named_by_where_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let (images, found) = (folder.path().join("images"), folder.path().join("found"));
    std::fs::create_dir(&images).unwrap();
    let camera = large_camera();
    let place = |k: i32| f64::from(k);
    let places: Vec<[f64; 3]> =
        (0..11).map(place).map(|k| [0.25 * (1.7 * k).sin(), 0.2 * (2.9 * k).cos(), 0.1 * (1.3 * k).sin()]).collect();
    let known: Vec<(String, [f64; 3])> = places.iter().enumerate().map(|(k, at)| (format!("L{k:02}"), *at)).collect();
    for (k, pose) in stations(3).iter().enumerate() {
        write_png(&images.join(format!("{k}.png")), &picture_of_lights(&camera, pose, &places[k..]));
    }
    let refused = find_targets(&in_images("lights", &images, &found), &Silent).unwrap_err().to_string();
    assert!(refused.contains("nothing tells which is which"), "{refused}");
    write_coordinates(&images, &known);
    let summary = find_targets(&in_images("lights", &images, &found), &Silent).unwrap();
    assert_eq!((summary.points, summary.verdict()), (11 + 10 + 9, Verdict::Done), "{summary}");
    assert_eq!(summary.stations[2].not_seen, ["L00", "L01"]);
    for row in read_observations(found.join("observations.csv")).unwrap() {
        let (_, place) = known.iter().find(|(name, _)| *name == row.target).unwrap();
        let pose = stations(3)[row.station.parse::<usize>().unwrap()];
        let truth = camera.project(&pose.inverse_transform_point(&Point3::from(*place))).unwrap();
        let pixel = row.pixel.unwrap();
        assert!((pixel[0] - truth[0]).hypot(pixel[1] - truth[1]) < 0.1, "{row:?}");
    }

    // One light in the world needs no coordinates.
    let lone = folder.path().join("lone");
    std::fs::create_dir(&lone).unwrap();
    write_png(&lone.join("0.png"), &picture_of_lights(&camera, &stations(1)[0], &places[..1]));
    let summary = find_targets(&in_images("lights", &lone, &found), &Silent).unwrap();
    assert_eq!(summary.points, 1, "{summary}");
    assert_eq!(read_observations(found.join("observations.csv")).unwrap()[0].target, "L1");
    let spheres = find_targets(&in_images("spheres", &lone, &found), &Silent).unwrap_err().to_string();
    assert!(spheres.contains("found in ranges"), "{spheres}");
}

fn simulated(folder: &Path, scene: &str) -> std::path::PathBuf {
    std::fs::write(folder.join("scene.ron"), scene).unwrap();
    let source = SimulateSource {
        scene: "scene.ron".to_owned(),
        seed: 3,
        approximate_position_sigma_m: 0.03,
        approximate_attitude_sigma_deg: 0.5,
        gross_error_share: 0.0,
    };
    let survey = folder.join("survey");
    simulate(&source, folder, &survey, &Silent).unwrap();
    survey
}

/// Mean of squared range errors over their variances, and the largest error.
fn range_errors(survey: &Path, found: &Path) -> [f64; 2] {
    let poses = read_stations(survey.join("truth/stations.csv")).unwrap();
    let known = read_targets(found.join("targets.csv")).unwrap();
    let rows = read_observations(found.join("observations.csv")).unwrap();
    let (mut squares, mut largest) = (0.0, 0.0_f64);
    for row in &rows {
        let pose = poses.iter().find(|pose| pose.station == row.station).unwrap().world_from_camera;
        let place = known.iter().find(|target| target.target == row.target).unwrap().position_m;
        let off = row.range_m.unwrap() - (Vector3::from(place) - pose.translation.vector).norm();
        squares += (off / row.sigma_range_m.unwrap()).powi(2) / rows.len() as f64;
        largest = largest.max(off.abs());
    }
    [squares, largest]
}

#[test]
fn spheres_are_named_and_have_ranges_of_their_centres() {
    let folder = tempfile::tempdir().unwrap();
    let survey = simulated(folder.path(), include_str!("../../../fixtures/scenes/spheres.ron"));
    let places = [[-0.5, 0.35, 0.5], [0.45, 0.3, 0.3], [0.35, -0.4, 0.6], [-0.4, -0.35, 0.2], [0.0, 0.05, 0.4]];
    let known: Vec<_> = ["A", "B", "C", "D", "E"].into_iter().map(str::to_owned).zip(places).collect();
    write_coordinates(&survey, &known);
    let found = folder.path().join("found");
    let spheres = |words: &str| -> TargetsSummary { find_targets(&looking(words, &survey, &found), &Silent).unwrap() };
    for words in ["spheres", "spheres 0.1"] {
        let summary = spheres(words);
        assert_eq!((summary.points, summary.ranges), (10, 10), "{summary}");
        let [mean, largest] = range_errors(&survey, &found);
        assert!(mean < 4.0 && largest < 0.012, "{words}: {mean} {largest}");
    }
    // Without approximate poses too.
    std::fs::remove_file(survey.join("stations.csv")).unwrap();
    assert_eq!(spheres("spheres 0.1").points, 10);
}

#[test]
fn discs_of_a_grid_are_named_where_stations_are_known_about() {
    let folder = tempfile::tempdir().unwrap();
    let survey = simulated(folder.path(), crate::ranges::SCENE);
    let place = |k: usize| [-1.2 + 0.4 * (k % 7) as f64, -0.8 + 0.4 * (k / 7) as f64, 0.0];
    let known: Vec<_> = (0..35).map(|k| (format!("D{k:02}"), place(k))).collect();
    write_coordinates(&survey, &known);
    let found = folder.path().join("found");
    let summary = find_targets(&looking("discs", &survey, &found), &Silent).unwrap();
    assert!(summary.points >= 100, "{summary}");
    let [_, largest] = range_errors(&survey, &found);
    assert!(largest < 0.02, "{largest}");
    std::fs::remove_file(survey.join("stations.csv")).unwrap();
    let refused = find_targets(&looking("discs", &survey, &found), &Silent).unwrap_err().to_string();
    assert!(refused.contains("ways"), "{refused}");
}
