//! Grids of dots: labels and places against rendered truth, and pictures that must be refused.

use targets::camera_model::Camera;
use targets::nalgebra::{Isometry3, Point3, Vector2, Vector3};
use targets::range_image::Raster;
use targets::{BoardSighting, CircleGrid, CircleGridOptions, Error, NotFound, find_circle_grid};

use crate::support::dots::PrintedDots;
use crate::support::render::{Optics, Plane, render};
use crate::support::sensor::Sensor;
use crate::support::views::small_camera;

/// `camera_from_board` with the middle of the board before the camera, tilted about a direction of the image.
fn view(grid: &CircleGrid, distance: f64, tilt_deg: f64, about: f64, turn: f64) -> Isometry3<f64> {
    let last = grid.node_m([grid.columns() - 1, grid.rows() - 1]);
    let tilt = Vector3::new(about.cos(), about.sin(), 0.0) * tilt_deg.to_radians();
    let turned = Isometry3::rotation(tilt) * Isometry3::rotation(Vector3::z() * turn);
    Isometry3::translation(0.0, 0.0, -distance) * turned * Isometry3::translation(-0.5 * last.x, -0.5 * last.y, 0.0)
}

fn picture(camera: &Camera, boards: &[(&PrintedDots<'_>, Isometry3<f64>)], seed: u64) -> Raster<f32> {
    let planes: Vec<Plane<'_>> =
        boards.iter().map(|(dots, pose)| Plane { world_from_plane: *pose, pattern: *dots }).collect();
    Sensor::amplitude(1000.0, 8.0).expose(&render(camera, &Isometry3::identity(), &planes, &Optics::default()), seed)
}

/// Largest distance of the nodes from where the camera sees them, turned by one of the board's symmetries.
fn worst(camera: &Camera, seen: &BoardSighting, grid: &CircleGrid, pose: &Isometry3<f64>) -> f64 {
    let last = [grid.columns() - 1, grid.rows() - 1];
    let off = |turned: bool| {
        let off = |node: &targets::NodePoint| {
            let [i, j] = node.node;
            let truth = if turned { [last[0] - i, last[1] - j] } else { [i, j] };
            let pixel = camera.project(&Point3::from(pose * grid.node_m(truth))).unwrap();
            (Vector2::from(pixel) - Vector2::from(node.point.pixel)).norm()
        };
        seen.nodes.iter().map(off).fold(0.0, f64::max)
    };
    if seen.ambiguity > 1 { off(false).min(off(true)) } else { off(false) }
}

#[test]
fn grids_are_found_whole_from_all_sides() {
    let camera = small_camera();
    let grids = [
        (CircleGrid::symmetric(7, 5, 0.04).unwrap().with_origin_dot(1.6).unwrap(), 1),
        (CircleGrid::symmetric(7, 5, 0.04).unwrap(), 2),
        (CircleGrid::asymmetric(4, 7, 0.03).unwrap(), 1),
    ];
    for (grid, ambiguity) in grids {
        let radius = if grid.is_staggered() { 0.013 } else { 0.011 };
        for k in 0..5 {
            let angle = f64::from(k);
            let pose = view(&grid, 0.62, 11.0 * angle, 1.3 * angle, 0.2 + 1.1 * angle);
            let dots = PrintedDots::new(grid, radius);
            let image = picture(&camera, &[(&dots, pose)], 5 + k as u64);
            let seen = find_circle_grid(&image, &grid, &CircleGridOptions::default())
                .unwrap_or_else(|error| panic!("{grid:?} view {k}: {error}"));
            assert!(seen.complete && seen.ambiguity == ambiguity, "{grid:?} view {k}: {} seen", seen.nodes.len());
            // Centres of ellipses lie beside those of dots, and by the lens, by up to a tenth of a pixel.
            let off = worst(&camera, &seen, &grid, &pose);
            assert!(off < 0.25, "{grid:?} view {k}: {off}");
        }
    }
}

#[test]
fn a_part_is_labelled_where_its_place_is_settled() {
    let camera = small_camera();
    let marked = CircleGrid::symmetric(7, 5, 0.04).unwrap().with_origin_dot(1.6).unwrap();
    let pose = view(&marked, 0.62, 30.0, 0.4, 0.3);
    let half = PrintedDots { hidden: &|[i, _]| i > 4, ..PrintedDots::new(marked, 0.011) };
    let image = picture(&camera, &[(&half, pose)], 1);
    let seen = find_circle_grid(&image, &marked, &CircleGridOptions::default()).unwrap();
    assert!(!seen.complete && seen.nodes.len() == 25 && seen.ambiguity == 1);
    assert!(worst(&camera, &seen, &marked, &pose) < 0.25);
    // Without the larger dot the same part, a square, fits in three places and four turns.
    let plain = CircleGrid::symmetric(7, 5, 0.04).unwrap();
    let half = PrintedDots { hidden: &|[i, _]| i > 4, ..PrintedDots::new(plain, 0.011) };
    let image = picture(&camera, &[(&half, pose)], 1);
    let refused = find_circle_grid(&image, &plain, &CircleGridOptions::default());
    assert!(
        matches!(refused, Err(Error::NotFound(NotFound::PartAmbiguous { board: [7, 5], places: 12, .. }))),
        "{refused:?}"
    );
    // A hole does no harm.
    let holed = PrintedDots { hidden: &|node| node == [3, 2] || node == [0, 4], ..PrintedDots::new(plain, 0.011) };
    let image = picture(&camera, &[(&holed, pose)], 1);
    let seen = find_circle_grid(&image, &plain, &CircleGridOptions::default()).unwrap();
    assert!(seen.nodes.len() == 33 && seen.ambiguity == 2);
}

#[test]
fn what_is_another_grid_is_refused() {
    let camera = small_camera();
    let grid = CircleGrid::symmetric(7, 5, 0.03).unwrap().with_origin_dot(1.6).unwrap();
    let refusal = |dots: &[(&PrintedDots<'_>, Isometry3<f64>)], grid: &CircleGrid| match find_circle_grid(
        &picture(&camera, dots, 2),
        grid,
        &CircleGridOptions::default(),
    ) {
        Err(Error::NotFound(why)) => why,
        other => panic!("{other:?}"),
    };
    let small = CircleGrid::symmetric(5, 4, 0.03).unwrap();
    let dots = PrintedDots::new(grid, 0.009);
    let pose = view(&grid, 0.55, 10.0, 0.4, 0.3);
    let why = refusal(&[(&dots, pose)], &small);
    assert!(matches!(why, NotFound::WrongSize { board: [5, 4], .. }), "{why:?}");
    let mirrored = PrintedDots { mirrored: true, ..PrintedDots::new(grid, 0.009) };
    let flipped = Isometry3::translation(0.09, 0.06, -0.55);
    let why = refusal(&[(&mirrored, flipped)], &grid);
    assert!(matches!(why, NotFound::Mirrored), "{why:?}");
    // Staggered, with an even number of rows.
    let staggered = CircleGrid::asymmetric(4, 6, 0.03).unwrap();
    let mirrored = PrintedDots { mirrored: true, ..PrintedDots::new(staggered, 0.011) };
    let why = refusal(&[(&mirrored, Isometry3::translation(0.105, 0.075, -0.62))], &staggered);
    assert!(matches!(why, NotFound::Mirrored), "{why:?}");
    let little = PrintedDots::new(CircleGrid::symmetric(4, 4, 0.03).unwrap(), 0.009);
    let left = Isometry3::translation(-0.19, 0.05, -0.6);
    let right = Isometry3::translation(0.1, 0.05, -0.6);
    let why = refusal(&[(&little, left), (&little, right)], &little.grid);
    assert!(matches!(why, NotFound::SeveralBoards { found: 2 }), "{why:?}");
    let nothing = find_circle_grid(&Raster::filled(100, 100, 1.0), &grid, &CircleGridOptions::default());
    assert!(matches!(nothing, Err(Error::NotFound(NotFound::NoContrast { .. }))), "{nothing:?}");
}

#[test]
fn a_mark_elsewhere_a_covered_one_and_saturation_are_named() {
    let camera = small_camera();
    let grid = CircleGrid::symmetric(7, 5, 0.04).unwrap().with_origin_dot(1.6).unwrap();
    let pose = view(&grid, 0.62, 20.0, 0.4, 0.3);
    let look = |image: &Raster<f32>| match find_circle_grid(image, &grid, &CircleGridOptions::default()) {
        Err(Error::NotFound(why)) => why,
        other => panic!("{other:?}"),
    };
    let index_in_the_middle = PrintedDots { mark: [3, 2], ..PrintedDots::new(grid, 0.011) };
    let why = look(&picture(&camera, &[(&index_in_the_middle, pose)], 4));
    assert!(matches!(why, NotFound::WrongMark { found: [7, 5] | [5, 7], larger: 1 }), "{why:?}");
    let plain = CircleGrid::symmetric(7, 5, 0.04).unwrap();
    let why = look(&picture(&camera, &[(&PrintedDots::new(plain, 0.011), pose)], 4));
    assert!(matches!(why, NotFound::WrongMark { larger: 0, .. }), "{why:?}");
    // Half of it, with the index in the middle: no place on the board has a larger dot there.
    let half = PrintedDots { hidden: &|[i, _]| i > 3, mark: [3, 2], ..PrintedDots::new(grid, 0.011) };
    let why = look(&picture(&camera, &[(&half, pose)], 4));
    assert!(matches!(why, NotFound::WrongMark { larger: 1, .. }), "{why:?}");
    // So much light that dots and paper are one.
    let image = picture(&camera, &[(&PrintedDots::new(grid, 0.011), pose)], 4);
    let why = look(&image.map(|value| (value * 100.0).min(1000.0)));
    assert!(matches!(why, NotFound::Saturated { .. } | NotFound::NoContrast { .. }), "{why:?}");
    // Paper that saturates leaves dark dots where they are.
    let clipped = image.map(|value| value.min(600.0));
    let seen = find_circle_grid(&clipped, &grid, &CircleGridOptions::default()).unwrap();
    assert!(seen.complete && worst(&camera, &seen, &grid, &pose) < 0.25);
}

#[test]
fn grids_and_options_that_cannot_be_are_refused() {
    assert!(CircleGrid::symmetric(1, 9, 0.1).is_err() && CircleGrid::symmetric(2, 4, 0.1).is_err());
    assert!(CircleGrid::asymmetric(4, 11, f64::NAN).is_err() && CircleGrid::asymmetric(4, 2000, 0.1).is_err());
    let grid = CircleGrid::symmetric(5, 5, 0.1).unwrap();
    assert!(grid.with_origin_dot(1.0).is_err() && grid.with_origin_dot(f64::NAN).is_err());
    let options = CircleGridOptions { least_share: f64::NAN, ..CircleGridOptions::default() };
    assert!(find_circle_grid(&Raster::filled(9, 9, 1.0), &grid, &options).is_err());
}
