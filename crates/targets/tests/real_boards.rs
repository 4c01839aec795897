//! Real captures beside the repository; skipped with a word where they are missing.

use std::path::{Path, PathBuf};

use crate::judged::left_by_one_camera;
use range_image::Raster;
use targets::nalgebra::Vector2;
use targets::{BoardSighting, Checkerboard, CheckerboardOptions, Error, NotFound, find_checkerboard};

pub fn folder(name: &str) -> Option<PathBuf> {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/real")).join(name);
    if path.exists() {
        return Some(path);
    }
    println!("{} is not here, skipped", path.display());
    None
}

fn find(image: &Raster<f32>, [columns, rows]: [usize; 2]) -> Result<BoardSighting, Error> {
    find_checkerboard(image, &Checkerboard::new(columns, rows, 0.025)?, &CheckerboardOptions::default())
}

/// Files of a folder by name.
pub fn files(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let all = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> = all.filter(|path| path.to_string_lossy().ends_with(ending)).collect();
    files.sort();
    files
}

pub fn name(path: &Path) -> String {
    path.file_name().unwrap().to_string_lossy().into_owned()
}

/// Positions of an image: the last two columns of the lines that begin with its name.
fn positions(text: &str, image: &str) -> Vec<Vector2<f64>> {
    let lines = text.lines().filter(|line| line.split(',').next() == Some(image));
    let last_two = lines.map(|line| {
        let mut fields = line.rsplit(',').map(|field| field.parse().unwrap());
        let (y, x) = (fields.next().unwrap(), fields.next().unwrap());
        Vector2::new(x, y)
    });
    last_two.collect()
}

/// Distance of each node from the nearest of these positions.
fn distances(seen: &BoardSighting, positions: &[Vector2<f64>]) -> Vec<f64> {
    let nearest = |at: Vector2<f64>| positions.iter().map(|other| (other - at).norm()).fold(f64::INFINITY, f64::min);
    seen.nodes.iter().map(|node| nearest(Vector2::from(node.point.pixel))).collect()
}

fn rms(distances: &[f64]) -> f64 {
    (distances.iter().map(|distance| distance * distance).sum::<f64>() / distances.len() as f64).sqrt()
}

#[test]
fn all_boards_of_a_camera_are_found_where_opencv_has_them() {
    let Some(folder) = folder("opencv_left_chess") else { return };
    let opencv = include_str!("data/opencv_left_corners.csv");
    let (mut all, mut ours, mut theirs) = (Vec::new(), Vec::new(), Vec::new());
    for path in files(&folder, ".jpg") {
        let seen = find(&range_io::grey::read(&path).unwrap(), [9, 6]).unwrap();
        assert!(seen.complete && seen.ambiguity == 1, "{path:?}");
        let positions = positions(opencv, &name(&path));
        all.extend(distances(&seen, &positions));
        let own: Vec<Vector2<f64>> = seen.nodes.iter().map(|node| Vector2::from(node.point.pixel)).collect();
        let nearest = |at: &Vector2<f64>| *positions.iter().min_by(|a, b| by_distance(at, a, b)).unwrap();
        theirs.push(own.iter().map(nearest).collect::<Vec<_>>());
        ours.push(own);
    }
    assert_eq!(all.len(), 13 * 54);
    // OpenCV's are those of its best window: what one camera and one rigid board of any shape leave of them is least, and of ours less.
    let [(ours, by_image), (theirs, _)] = [ours, theirs].map(|corners| left_by_one_camera(&corners));
    println!("{:.4} pixel from OpenCV's; left by one camera and board: ours {ours:.4}, OpenCV {theirs:.4}", rms(&all));
    println!("ours by image {by_image:.3?}");
    assert!(rms(&all) < 0.1, "{}", rms(&all));
    assert!(ours < 0.8 * theirs && theirs < 0.11, "{ours}, {theirs}");
}

fn by_distance(at: &Vector2<f64>, a: &Vector2<f64>, b: &Vector2<f64>) -> std::cmp::Ordering {
    (a - at).norm().total_cmp(&(b - at).norm())
}

#[test]
fn boards_in_infrared_images_are_found() {
    let Some(folder) = folder("tof_ir_chess_328x252") else { return };
    let opencv = std::fs::read_to_string(folder.join("derived_opencv_corners.csv")).unwrap();
    let mut all = Vec::new();
    for path in files(&folder, ".png") {
        let seen = find(&range_io::grey::read(&path).unwrap(), [6, 4]).unwrap();
        assert!(seen.complete && seen.ambiguity == 2, "{path:?}");
        let distances = distances(&seen, &positions(&opencv, &name(&path)));
        all.extend(distances);
    }
    println!("rms {}", rms(&all));
    assert_eq!(all.len(), 15 * 24);
    // Theirs are of an image three times as large; calibrated, they leave 0.210 pixel and ours 0.142.
    assert!(rms(&all) < 0.16);
}

#[test]
fn scenes_without_a_board_hold_none() {
    let mut images = Vec::new();
    let mut read = |path: PathBuf| images.push((name(&path), range_io::grey::read(&path).unwrap()));
    if let Some(folder) = folder("redwood_rgbd5") {
        files(&folder.join("color"), ".jpg").into_iter().for_each(&mut read);
        files(&folder.join("depth"), ".png").into_iter().for_each(&mut read);
    }
    if let Some(folder) = folder("sevenscenes_redkitchen") {
        // Every fifth, for time.
        files(&folder, ".png").into_iter().step_by(5).for_each(&mut read);
    }
    if let Some(folder) = folder("azure_kinect_mug") {
        let frame = range_io::mkv::read_frame(folder.join("recording.mkv"), 0).unwrap();
        images.push(("depth".to_owned(), frame.depth.map(|value| f32::from(*value))));
        images.extend(frame.infrared.map(|infrared| ("infrared".to_owned(), infrared.map(|value| f32::from(*value)))));
    }
    for (name, image) in &images {
        for size in [[9, 6], [6, 4], [4, 3]] {
            let found = find(image, size);
            let is_none = matches!(
                found,
                Err(Error::NotFound(
                    NotFound::NoGrid { .. } | NotFound::TooFewPoints { .. } | NotFound::WrongSize { .. }
                ))
            );
            assert!(is_none, "{name} {size:?} {found:?}");
        }
    }
}
