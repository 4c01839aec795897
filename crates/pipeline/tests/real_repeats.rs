//! Four frames of a floor by a real camera: what averaging takes off, and what it leaves.

use camera_model::Camera;
use error_models::{AmplitudeScale, ModelSet, RangeNoise};
use pipeline::{Plan, Silent, ViewData, process};
use primitives::{PrimitiveFit, PrimitiveKind, PrimitiveOptions, fit_primitive};
use range_image::{RangeFrame, average_ranges};
use range_io::calibration::Calibration;
use range_io::survey::Survey;

use crate::common::{fixtures, has_capture};

/// Columns and rows of the floor before the camera, all of it within the first ambiguity interval.
const FLOOR: [[usize; 2]; 2] = [[72, 104], [114, 140]];

/// The plane of the floor; what is not random is what the figures are about, so that it is not refused.
fn plane(frame: &RangeFrame, camera: &Camera) -> PrimitiveFit {
    let mut options = PrimitiveOptions { largest_systematic_sigmas: 100.0, ..PrimitiveOptions::default() };
    options.pixels.window = Some(FLOOR);
    fit_primitive(frame, camera, PrimitiveKind::Plane, &options).unwrap()
}

fn residual_rms_mm(fit: &PrimitiveFit) -> f64 {
    let used: Vec<f64> =
        fit.pixels.iter().filter(|pixel| pixel.used).map(|pixel| pixel.observed_m - pixel.modelled_m).collect();
    1e3 * (used.iter().map(|v| v * v).sum::<f64>() / used.len() as f64).sqrt()
}

/// Root mean square over the floor of half the difference of two means, millimetre: the random part of the mean of both.
fn random_mm(first: &[&RangeFrame], second: &[&RangeFrame]) -> f64 {
    let mean = |frames: &[&RangeFrame], place: (usize, usize)| {
        frames.iter().map(|frame| f64::from(frame.range[place])).sum::<f64>() / frames.len() as f64
    };
    let [[left, right], [top, bottom]] = FLOOR;
    let places = (top..=bottom).flat_map(|row| (left..=right).map(move |col| (col, row)));
    let squares: Vec<f64> = places.map(|place| (mean(first, place) - mean(second, place)).powi(2) / 4.0).collect();
    1e3 * (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[test]
fn averaging_halves_the_random_part_and_leaves_the_rest() {
    if !has_capture("sr4000_steps") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let survey = fixtures().join("surveys/sr4000_steps");
    let out = folder.path().join(Calibration::FILE_NAME);
    let camera = Survey::read(&survey).unwrap().camera.nominal_camera().unwrap();
    let mut calibration = Calibration::from_models(&camera, &ModelSet::default(), None).unwrap();
    // About what differences of the frames show in classes of amplitude.
    calibration.range_noise = Some(RangeNoise {
        sigma_times_amplitude_m: 3.2,
        floor_m: 0.013,
        amplitude_scale: AmplitudeScale::TimesSquaredRange,
        shared: None,
    });
    calibration.write(&out).unwrap();
    let plan = Plan::from_ron("(name: \"frames\", stages: [])", "frames.ron".as_ref()).unwrap();
    let outcome = process(&plan, &survey, Some(&out), &Silent).unwrap();
    let mut distances = Vec::new();
    for views in outcome.views.chunks(4) {
        let frames: Vec<RangeFrame> = views
            .iter()
            .filter_map(|view| if let ViewData::Range(frame) = &view.data { Some(frame.clone()) } else { None })
            .collect();
        let single: Vec<PrimitiveFit> = frames.iter().map(|frame| plane(frame, &camera)).collect();
        let mean = plane(&average_ranges(&frames).unwrap(), &camera);
        let before = single.iter().map(|fit| residual_rms_mm(fit).powi(2)).sum::<f64>() / 4.0;
        let (before, after) = (before.sqrt(), residual_rms_mm(&mean));
        let [a, b, c, d] = [&frames[0], &frames[1], &frames[2], &frames[3]];
        // Half a difference of two frames is the random part of their mean: times √2 that of one frame.
        let pairs = [random_mm(&[a], &[b]), random_mm(&[c], &[d])];
        let of_one = f64::midpoint(pairs[0].powi(2), pairs[1].powi(2)).sqrt() * std::f64::consts::SQRT_2;
        let of_four = random_mm(&[a, b], &[c, d]);
        println!(
            "{}: residuals {before:.2} mm a frame, {after:.2} mm averaged; random part {of_one:.2} and {of_four:.2} mm; \
             sigma0 {:.2} and {:.2}; shared by neighbours {:.2} and {:.2} sigmas; gain of the plane {:.1}",
            views[0].station,
            single[0].sigma0,
            mean.sigma0,
            single[0].systematic_sigmas,
            mean.systematic_sigmas,
            single[0].gain
        );
        // Over a thousand pixels know a deviation to 3 %, their ratio to 4 %; four times that.
        assert!((of_one / of_four / 2.0 - 1.0).abs() < 0.16, "{}", of_one / of_four);
        // What the planes leave is the random part and what is the same in all frames.
        let expected = (before.powi(2) - 0.75 * of_one.powi(2)).sqrt();
        assert!((after / expected - 1.0).abs() < 0.15, "{after} mm, {expected} mm expected");
        assert!(after > of_four, "averaging leaves what is not random");
        if let primitives::Primitive::Plane { distance_m, .. } = mean.primitive {
            distances.push(distance_m);
        }
    }
    println!("heights {distances:.4?} m");
    // The camera was moved along the floor: planes of nine hundred pixels of 16 mm, and what their residuals share.
    assert!((distances[0] - distances[1]).abs() < 0.02, "{distances:?}");
}
