//! Frames with something wrong: as good as without it, or refused by name.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use range_calibration::{
    Error, SurfaceCalibration, SurfaceCalibrationOptions, SurfaceCapture, SurfaceTerm, calibrate_surfaces,
};
use range_image::RangeFrame;

use crate::round;
use multiview_registration::Datum;

const OFFSET_M: f64 = 0.024;

/// What is done to the frame of a station.
type Harm<'a> = &'a dyn Fn(&mut RangeFrame, usize);

/// d0 from these frames and poses.
fn calibrated(frames: &[RangeFrame], poses: &[Isometry3<f64>]) -> Result<SurfaceCalibration, Error> {
    let names: Vec<String> = (0..frames.len()).map(|k| format!("S{k}")).collect();
    let captures: Vec<SurfaceCapture<'_>> = names
        .iter()
        .zip(frames)
        .zip(poses)
        .map(|((name, frame), pose)| SurfaceCapture { name, frame, world_from_camera: Some(*pose) })
        .collect();
    let options =
        SurfaceCalibrationOptions { terms: vec![SurfaceTerm::free("d0")], ..SurfaceCalibrationOptions::default() };
    let known = round::model(&[]);
    calibrate_surfaces(&captures, &round::camera(), &known, Datum::Station(0), &options, &|_, _| {})
}

fn frames(poses: &[Isometry3<f64>]) -> Vec<RangeFrame> {
    round::frames(poses, &round::model(&[("d0", OFFSET_M)]), 5)
}

/// Offset and its standard deviation.
fn offset(result: &SurfaceCalibration) -> [f64; 2] {
    let parameters = result.parameters().unwrap();
    let d0 = parameters.iter().find(|parameter| parameter.name == "d0").unwrap();
    [d0.value, d0.sigma]
}

#[test]
fn wild_values_and_holes_cost_nothing_but_their_pixels() {
    let poses = round::poses(6);
    let sound = frames(&poses);
    let [clean, sigma] = offset(&calibrated(&sound, &poses).unwrap());
    assert!((clean - OFFSET_M).abs() < 4.0 * sigma, "{clean} {sigma}");
    let pixels = sound[0].range.as_slice().len();
    let width = sound[0].width();
    // A number that is a fifth of the time below 0.2, the same each time.
    let part = |index: usize, frame: usize| (index * 7919 + frame * 104_729 + (index * index) % 613) % 1000;
    let (middle, corner) = (pixels / 2 + width / 2, 5 * width + 5);
    let harms: [(&str, f64, Harm<'_>); 3] = [
        ("single values", 1.02, &|frame, k| match k {
            1 => frame.sigma.as_mut_slice()[middle] = f32::INFINITY,
            2 => frame.range.as_mut_slice()[middle] = 1e9,
            3 => frame.range.as_mut_slice()[corner] = 1e30,
            4 => frame.sigma.as_mut_slice()[middle] = -1.0,
            _ => frame.amplitude.as_mut_slice()[middle] = -50.0,
        }),
        ("a fifth scattered", 1.25, &|frame, k| {
            for (index, range) in frame.range.as_mut_slice().iter_mut().enumerate() {
                if part(index, k) < 200 {
                    *range = f32::NAN;
                }
            }
        }),
        ("a fifth in clumps", 1.35, &|frame, k| {
            for (index, range) in frame.range.as_mut_slice().iter_mut().enumerate() {
                let block = (index / width / 8) * 64 + (index % width) / 8;
                if part(block, k) < 200 {
                    *range = f32::NAN;
                }
            }
        }),
    ];
    for (what, wider, harm) in harms {
        let mut frames = sound.clone();
        frames.iter_mut().enumerate().for_each(|(k, frame)| harm(frame, k));
        let [value, own] = offset(&calibrated(&frames, &poses).unwrap());
        println!("{what}: {value:.6} +- {own:.6}, without {clean:.6} +- {sigma:.6}");
        assert!(
            (value - OFFSET_M).abs() < 4.0 * own && own < wider * sigma,
            "{what}: {value} +- {own}, {clean} +- {sigma}"
        );
    }
}

#[test]
fn what_tells_nothing_is_refused_by_name() {
    let poses = round::poses(6);
    let sound = frames(&poses);
    let one = calibrated(&sound[..1], &poses[..1]).unwrap_err();
    println!("one station: {one}");
    assert!(one.to_string().contains("one station") || one.to_string().contains("two stations"), "{one}");
    // All from one place, turned on by a sixth: nothing tells an offset from a larger room.
    let place = Translation3::from(Vector3::new(0.1, 0.0, 1.4));
    let turned: Vec<Isometry3<f64>> = (0..6)
        .map(|k| {
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.45 * f64::from(k));
            Isometry3::from_parts(place, turn * poses[0].rotation)
        })
        .collect();
    match calibrated(&frames(&turned), &turned) {
        Ok(found) => {
            let [value, sigma] = offset(&found);
            println!("one place: {value} +- {sigma}, {:?}", found.held);
            assert!((value - OFFSET_M).abs() < 4.0 * sigma);
        }
        Err(error) => println!("one place: {error}"),
    }
    let mut large = sound.clone();
    for frame in &mut large {
        frame.range.as_mut_slice().iter_mut().for_each(|range| *range *= 1000.0);
        frame.sigma.as_mut_slice().iter_mut().for_each(|sigma| *sigma *= 1000.0);
    }
    let millimetres = calibrated(&large, &poses).unwrap_err();
    println!("millimetres: {millimetres}");
    assert!(millimetres.to_string().contains("millimetre"), "{millimetres}");
    let mut empty = sound.clone();
    empty[3].range.as_mut_slice().fill(f32::NAN);
    let nothing = calibrated(&empty, &poses).unwrap_err();
    println!("an empty frame: {nothing}");
    assert!(nothing.to_string().contains("S3"), "{nothing}");
}
