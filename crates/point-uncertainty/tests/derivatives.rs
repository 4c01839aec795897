//! Derivatives of a station's points against differences of the forward model.

use point_uncertainty::camera_model::nalgebra::{Isometry3, Point3, Vector3, Vector6};
use point_uncertainty::camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion, step_pose};
use point_uncertainty::error_models::{AmplitudeHyperbola, RangeErrorModel};
use point_uncertainty::{Columns, Error, SharedBySensor, SharedErrorGrid, StationErrors};

fn camera(by: &[f64; 10]) -> Camera {
    let format = ImageFormat::new(176, 144, [0.04, 0.04]).unwrap();
    let interior =
        InteriorOrientation { principal_point_mm: [0.06 + by[0], -0.03 + by[1]], principal_distance_mm: 8.0 + by[2] };
    let lens =
        LensDistortion::from_coefficients([-1.5e-3 + by[3], 2e-5 + by[4], by[5], 1e-4 + by[6], by[7], by[8], by[9]]);
    Camera::new(format, interior, lens).unwrap()
}

fn model(terms: &[f64]) -> RangeErrorModel {
    let mut model = RangeErrorModel::error_free(7.5);
    model.set_parameter_values(terms).unwrap();
    model
}

/// The world point that a pixel makes of an observed range.
fn point(
    camera: &Camera,
    model: &RangeErrorModel,
    pose: &Isometry3<f64>,
    pixel: [f64; 2],
    drift_m: f64,
) -> Point3<f64> {
    let [x, y] = camera.format.image_from_pixel(pixel);
    // The errors are counted from the nominal principal point: what lens and range terms change together is another matter.
    let observed = 3.2;
    let correction: f64 =
        model.design_row(observed, x - 0.06, y + 0.03).iter().zip(model.parameter_values()).map(|(d, v)| d * v).sum();
    pose * camera.point(pixel, observed - correction - drift_m)
}

#[test]
fn a_point_moves_as_its_derivatives_say() {
    let pose = Isometry3::new(Vector3::new(1.0, -2.0, 0.4), Vector3::new(0.3, -0.6, 1.2));
    let pixel = [31.0, 117.0];
    let zero = [0.0; 10];
    let count = RangeErrorModel::error_free(7.5).parameter_count();
    let terms = vec![0.0; count];
    let columns = Columns {
        camera: (0..10).map(|at| (at, at)).collect(),
        range: (0..count).map(|at| (at, 10 + at)).collect(),
        hyperbola: Vec::new(),
        drift: Some(10 + count),
        pose: Some(11 + count),
    };
    let at = point(&camera(&zero), &model(&terms), &pose, pixel, 0.0);
    let station = StationErrors::new(4, &camera(&zero), Some(&model(&terms)), &pose, columns, count + 17).unwrap();
    let mut found = Vec::new();
    station.common(&at, f64::NAN, &mut found);
    assert_eq!(found.len(), count + 17);
    for (column, derivative) in found {
        let step =
            if column < 10 { [1e-3, 1e-3, 1e-3, 1e-5, 1e-6, 1e-8, 1e-5, 1e-5, 1e-4, 1e-4][column] } else { 1e-4 };
        let moved = |by: f64| {
            let (mut lens, mut terms, mut drift, mut turned) = (zero, terms.clone(), 0.0, Vector6::zeros());
            match column {
                at if at < 10 => lens[at] = by,
                at if at < 10 + count => terms[at - 10] = by,
                at if at == 10 + count => drift = by,
                at => turned[at - 11 - count] = by,
            }
            let pose = step_pose(&pose, turned.as_slice().try_into().unwrap());
            point(&camera(&lens), &model(&terms), &pose, pixel, drift)
        };
        let difference = (moved(step) - moved(-step)) / (2.0 * step);
        let scale = difference.norm().max(1e-3);
        assert!((difference - derivative).norm() < 1e-4 * scale, "column {column}: {difference} {derivative}");
    }
}

#[test]
fn columns_that_do_not_exist_and_neighbourhoods_of_nothing_are_refused() {
    let columns = Columns { pose: Some(0), ..Columns::default() };
    let station =
        |errors| StationErrors::new(0, &camera(&[0.0; 10]), None, &Isometry3::identity(), columns.clone(), errors);
    assert_eq!(station(5).unwrap_err(), Error::Column { column: 5, errors: 5 });
    let station = station(6).unwrap();
    let shared = |sigma_m, share, width_px| SharedBySensor { sigma_m, share, width_px };
    for wrong in [shared(0.01, 0.0, 0.0), shared(f64::NAN, 0.0, 5.0), shared(0.01, 1.5, 5.0), shared(0.01, -0.1, 5.0)] {
        assert!(station.clone().with_sensor(wrong).is_err(), "{wrong:?}");
    }
    let at = Point3::new(0.0, 0.0, -3.0);
    assert_eq!(station.with_sensor(shared(0.0, 0.0, 8.0)).unwrap().sensor(&at, 0.01), None);
}

#[test]
fn pixels_of_one_neighbourhood_share_an_error_and_others_do_not() {
    let camera = camera(&[0.0; 10]);
    let station = |number| {
        StationErrors::new(number, &camera, None, &Isometry3::identity(), Columns::default(), 0)
            .unwrap()
            .with_sensor(SharedBySensor { sigma_m: 0.003, share: 0.0, width_px: 8.0 })
            .unwrap()
    };
    let of = |number, pixel| station(number).sensor(&camera.point(pixel, 2.0), 0.01).unwrap();
    assert_eq!(of(0, [17.0, 33.0]).0, of(0, [22.0, 38.0]).0);
    assert_ne!(of(0, [17.0, 33.0]).0, of(0, [25.0, 33.0]).0);
    assert_ne!(of(0, [17.0, 33.0]).0, of(1, [17.0, 33.0]).0);
    assert!((of(0, [17.0, 33.0]).1.norm() - 0.003).abs() < 1e-12);
    // A share of the noise goes from the pixel to its neighbourhood, and the whole stays.
    let parted = station(0).with_sensor(SharedBySensor { sigma_m: 0.0, share: 0.6, width_px: 8.0 }).unwrap();
    let at = camera.point([17.0, 33.0], 2.0);
    let (own, (_, shift)) = (parted.noise(&at, 0.01).trace(), parted.sensor(&at, 0.01).unwrap());
    assert!((own - 0.4e-4).abs() < 1e-12 && (shift.norm_squared() - 0.6e-4).abs() < 1e-12);
}

#[test]
fn a_point_moves_with_the_hyperbola_as_differences_say() {
    let hyperbola = |by: [f64; 3]| AmplitudeHyperbola {
        h1: 1.1e-4 + by[0],
        h2: 0.0286 + by[1],
        h3: 156.0 + by[2],
        amplitude_span: [15.0, 9000.0],
    };
    let with = |by| RangeErrorModel { hyperbola: Some(hyperbola(by)), ..RangeErrorModel::error_free(7.5) };
    let columns = Columns { hyperbola: vec![(0, 0), (1, 1), (2, 2)], ..Columns::default() };
    let (camera, pose) = (camera(&[0.0; 10]), Isometry3::identity());
    let station = StationErrors::new(0, &camera, Some(&with([0.0; 3])), &pose, columns, 3).unwrap();
    let (pixel, amplitude) = ([31.0, 117.0], 400.0);
    let mut found = Vec::new();
    station.common(&camera.point(pixel, 2.0), amplitude, &mut found);
    assert_eq!(found.len(), 3);
    for (column, derivative) in found {
        let step = [1e-8, 1e-6, 1e-2][column];
        let moved = |by: f64| {
            let mut steps = [0.0; 3];
            steps[column] = by;
            camera.point(pixel, 2.0 - hyperbola(steps).correction(amplitude).unwrap())
        };
        let difference = (moved(step) - moved(-step)) / (2.0 * step);
        assert!((difference - derivative).norm() < 1e-5 * difference.norm(), "column {column}");
    }
    // Without an amplitude nothing is said of it.
    let mut found = Vec::new();
    station.common(&camera.point(pixel, 2.0), f64::NAN, &mut found);
    assert!(found.is_empty());
}

#[test]
fn what_all_frames_share_moves_a_point_as_its_inverse_depth_does() {
    let pose = Isometry3::new(Vector3::new(1.0, -2.0, 0.4), Vector3::new(0.3, -0.6, 1.2));
    let camera = camera(&[0.0; 10]);
    let grid = SharedErrorGrid::new(6, &camera.format);
    let [across, down] = grid.nodes();
    assert_eq!((grid.columns(), across, down), (6..6 + 21 * 18, 21, 18));
    let columns = Columns { pose: Some(0), ..Columns::default() };
    let station = StationErrors::new(0, &camera, None, &pose, columns, grid.columns().end).unwrap();
    let station = station.with_shared_error(grid, grid.columns().end).unwrap();
    // In the middle of a cell, beside the edges of the image, and at its last pixels.
    for pixel in [[31.0, 117.0], [-0.5, 60.3], [175.5, 143.5]] {
        let local = camera.point(pixel, 3.2);
        let (depth, step) = (-local.z, 1e-6);
        let mut found = Vec::new();
        station.common(&(pose * local), f64::NAN, &mut found);
        let nodes = found.iter().filter(|(column, _)| *column >= 6);
        let mut whole = 0.0;
        for (column, derivative) in nodes {
            let place =
                [(column - 6) % across, (column - 6) / across].map(|node| node as f64 * grid.spacing_px() - 0.5);
            let weight = |axis: usize| (1.0 - (pixel[axis] - place[axis]).abs() / grid.spacing_px()).max(0.0);
            let moved = 1.0 / (1.0 / depth + step * weight(0) * weight(1));
            let by_difference = pose.rotation * (local.coords * (moved / depth - 1.0)) / step;
            assert!(
                (derivative - by_difference).norm() < 1e-4 * depth * 3.2,
                "{pixel:?} {column} {derivative} {by_difference}"
            );
            whole += derivative.norm();
        }
        assert!((whole - depth * 3.2).abs() < 1e-9, "{whole}");
    }
    let station = StationErrors::new(0, &camera, None, &pose, Columns::default(), 0).unwrap();
    assert!(matches!(station.with_shared_error(grid, 100), Err(Error::Column { errors: 100, .. })));
}
