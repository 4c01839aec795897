//! Real captures beside the repository, for discs, dots and spheres; skipped with a word where they are missing.

use std::path::PathBuf;

use range_image::{RangeFrame, Raster};
use targets::camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion, RayTable};
use targets::nalgebra::Vector2;
use targets::{CircleGrid, CircleGridOptions, SphereOptions, find_circle_grid, find_spheres};

use crate::real_boards::{files, folder, name};

#[test]
fn grids_of_dots_are_found_with_their_origin() {
    let Some(folder) = folder("circle_grid_robot") else { return };
    let grid = CircleGrid::symmetric(10, 10, 0.0254).unwrap().with_origin_dot(2.0).unwrap();
    let pictures = files(&folder.join("images"), ".png");
    assert_eq!(pictures.len(), 8);
    // One of them, for time; the example `dot_grid` finds all eight.
    for path in pictures.into_iter().take(1) {
        let image = range_io::grey::read(&path).unwrap();
        let seen = find_circle_grid(&image, &grid, &CircleGridOptions::default()).unwrap();
        assert!(seen.nodes.len() >= 95 && seen.ambiguity == 1, "{}: {}", name(&path), seen.nodes.len());
        let at = |node| Vector2::from(seen.nodes.iter().find(|seen| seen.node == node).unwrap().point.pixel);
        // The board hangs turned: x goes up in all pictures, rows to the right, and the larger dot is darker at its rim.
        assert!(at([9, 0]).y < at([0, 0]).y && at([0, 9]).x > at([0, 0]).x, "{}", name(&path));
        let step = (at([1, 0]) - at([0, 0])).norm();
        let rim = |node| {
            let centre = at(node);
            let value = |k: f64| {
                let place = centre + Vector2::new(k.cos(), k.sin()) * 0.36 * step;
                image[(place.x.round() as usize, place.y.round() as usize)]
            };
            (0..8).map(|k| value(f64::from(k) * 0.785)).sum::<f32>() / 8.0
        };
        assert!(rim([0, 0]) < 0.6 * rim([9, 0]) && rim([0, 0]) < 0.6 * rim([0, 9]), "{}", name(&path));
    }
}

/// Pictures and depths of scenes without targets.
fn scenes() -> Vec<(String, Raster<f32>)> {
    let mut paths: Vec<PathBuf> = Vec::new();
    if let Some(folder) = folder("redwood_rgbd5") {
        // One of each, for time, here and below.
        paths.extend(files(&folder.join("color"), ".jpg").into_iter().take(1));
        paths.extend(files(&folder.join("depth"), ".png").into_iter().take(1));
    }
    if let Some(folder) = folder("sevenscenes_redkitchen") {
        paths.extend(files(&folder, ".png").into_iter().take(1));
    }
    let read = |path: &PathBuf| (name(path), range_io::grey::read(path).unwrap());
    let mut images: Vec<_> = paths.iter().map(read).collect();
    if let Some(folder) = folder("azure_kinect_mug") {
        let frame = range_io::mkv::read_frame(folder.join("recording.mkv"), 0).unwrap();
        images.push(("mug depth".to_owned(), frame.depth.map(|value| f32::from(*value))));
        images.extend(
            frame.infrared.map(|infrared| ("mug infrared".to_owned(), infrared.map(|value| f32::from(*value)))),
        );
    }
    images
}

#[test]
fn scenes_without_dots_hold_no_grid() {
    let grid = CircleGrid::symmetric(4, 3, 0.02).unwrap();
    for (name, image) in scenes().into_iter().filter(|(name, _)| !name.contains("depth")) {
        let found = find_circle_grid(&image, &grid, &CircleGridOptions::default());
        assert!(found.is_err(), "{name}: {found:?}");
    }
}

#[test]
fn rooms_without_a_sphere_hold_none() {
    let (mut frames, mut spheres) = (0, 0);
    for (name, depth) in scenes().into_iter().filter(|(name, image)| !name.contains(".jpg") && image.width() == 640) {
        let camera = Camera::new(
            ImageFormat::new(640, 480, [0.01, 0.01]).unwrap(),
            InteriorOrientation { principal_point_mm: [0.0, 0.0], principal_distance_mm: 5.25 },
            LensDistortion::default(),
        )
        .unwrap();
        if depth.height() != 480 || name.contains("infrared") {
            continue;
        }
        // Millimetre; 65535 stands for no value.
        let depth = depth.map(|value| if *value > 0.0 && *value < 6e4 { *value * 1e-3 } else { f32::NAN });
        let frame = RangeFrame::from_range(RayTable::new(&camera).unwrap().depth_to_range(&depth).unwrap());
        let options = SphereOptions { radius_m: Some(0.1), ..SphereOptions::default() };
        let found = find_spheres(&frame, &camera, &options).unwrap();
        println!("{name}: {found:?}");
        frames += 1;
        spheres += found.len();
    }
    println!("{spheres} spheres in {frames} frames");
    assert_eq!(spheres, 0);
}
