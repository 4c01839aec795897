//! Organised frames as stations, by pairs of them.
use crate::common::{Pinhole, pose_error};
use crate::depth_frames::dense_kitchen;
use crate::sequence::{around, frame_at, projection};
use multiview_registration::{FrameRegistration, Start, register_frames};
use nalgebra::{Isometry3, Vector3};
use projective_registration::{FrameAlignmentOptions, OrganisedFrame};

fn camera() -> Pinhole {
    Pinhole { width: 160, height: 120, focal_px: 138.0 }
}

/// Six frames of a way through the furnished room, and where the first has them.
fn room(changed: impl Fn(&mut Vec<[f64; 3]>)) -> (Vec<OrganisedFrame>, Vec<Isometry3<f64>>) {
    let camera = camera();
    let numbers = [0, 6, 12, 18, 24, 30];
    let frame = |(k, number): (usize, &usize)| {
        let (mut points, sigma) = frame_at(&camera, &around(*number), 40 + k as u64);
        if k == 3 {
            changed(&mut points);
        }
        OrganisedFrame::new(&projection(&camera), &points, Some(&sigma)).unwrap()
    };
    let poses = numbers.map(|number| around(0).inverse() * around(number)).to_vec();
    (numbers.iter().enumerate().map(frame).collect(), poses)
}

fn registered(frames: &[OrganisedFrame]) -> FrameRegistration {
    register_frames(frames, Start::Order, &FrameAlignmentOptions::default(), &|_, _| {}).unwrap()
}

/// All frames but one are in place, and that one is named.
fn check(found: &FrameRegistration, truth: &[Isometry3<f64>], named: Option<usize>) {
    println!("{:?}", found.unplaced);
    for (k, (placed, truth)) in found.frames.iter().zip(truth).enumerate() {
        assert_eq!(placed.is_none(), named == Some(k), "frame {k}");
        if let Some(placed) = placed {
            let (mm, degrees) = pose_error(&placed.world_from_frame, truth);
            // Noise of 160 x 120 pixels and mixed pixels.
            assert!(mm < 8.0 && degrees < 0.2, "frame {k}: {mm} mm, {degrees} degrees");
        }
    }
    assert_eq!(found.unplaced.iter().map(|out| out.frame).collect::<Vec<_>>(), named.into_iter().collect::<Vec<_>>());
}

#[test]
fn frames_come_together_from_their_order() {
    let (frames, truth) = room(|_| ());
    let found = registered(&frames);
    check(&found, &truth, None);
    // The first frame shares enough with the second one only.
    assert!(found.unchecked.iter().all(|pair| pair.frames == [0]), "{:?}", found.unchecked);
}

#[test]
fn frames_come_together_from_start_poses_that_err_by_more_than_they_show() {
    // Every second frame: neighbours share half of what they see, and start poses hide most of that.
    let (frames, truth) = room(|_| ());
    let few: Vec<OrganisedFrame> = frames[1..].iter().step_by(2).cloned().collect();
    let truth: Vec<Isometry3<f64>> = truth[1..].iter().step_by(2).map(|pose| truth[1].inverse() * pose).collect();
    let sides = [[0.0; 3], [0.1, -0.06, 0.05], [-0.09, 0.08, -0.05]];
    let start: Vec<Isometry3<f64>> = truth
        .iter()
        .zip(sides)
        .map(|(pose, [x, y, z])| pose * Isometry3::new(Vector3::new(x, y, z), Vector3::new(y, z, x) * 0.5))
        .collect();
    let found = register_frames(&few, Start::Poses(&start), &FrameAlignmentOptions::default(), &|_, _| {}).unwrap();
    check(&found, &truth, None);
}

#[test]
fn a_pair_that_nothing_checks_is_named() {
    let (frames, _) = room(|_| ());
    let found = registered(&frames[..2]);
    let [pair] = &found.unchecked[..] else { panic!("{:?}", found.unchecked) };
    assert_eq!((pair.target, pair.source, &pair.frames[..]), (0, 1, &[1][..]));
}

#[test]
fn a_scaled_frame_is_named() {
    let scale = |points: &mut Vec<[f64; 3]>| points.iter_mut().for_each(|point| *point = point.map(|v| 1.05 * v));
    let (frames, truth) = room(scale);
    check(&registered(&frames), &truth, Some(3));
}

#[test]
fn frames_of_another_place_do_not_hold_together() {
    let (frames, _) = room(|_| ());
    let camera = camera();
    let (points, sigma) = frame_at(&camera, &around(150), 60);
    let far = OrganisedFrame::new(&projection(&camera), &points, Some(&sigma)).unwrap();
    let pair = [frames[0].clone(), far];
    assert!(register_frames(&pair, Start::Order, &FrameAlignmentOptions::default(), &|_, _| {}).is_err());
    assert!(register_frames(&[], Start::Order, &FrameAlignmentOptions::default(), &|_, _| {}).is_err());
    let nowhere = [Isometry3::translation(f64::NAN, 0.0, 0.0), Isometry3::identity()];
    assert!(register_frames(&pair, Start::Poses(&nowhere), &FrameAlignmentOptions::default(), &|_, _| {}).is_err());
}

#[test]
fn real_frames_come_together_from_their_order_without_the_one_that_is_mirrored() {
    let Some(sequence) = dense_kitchen((0..7).map(|k| 10 * k)) else {
        println!("skipped: the kitchen is not there");
        return;
    };
    let first = sequence.frames[0].world_from_camera;
    let frame = |(k, frame): (usize, &crate::depth_frames::DepthFrame)| {
        let mut points = frame.points.clone();
        if k == 3 {
            // The axis of the camera is on a pixel: the first column has no counterpart.
            for row in points.chunks_exact_mut(640) {
                row[1..].reverse();
                row[0] = [f64::NAN; 3];
                for point in row.iter_mut() {
                    point[0] = -point[0];
                }
            }
        }
        OrganisedFrame::new(&sequence.projection, &points, None).unwrap()
    };
    let frames: Vec<OrganisedFrame> = sequence.frames.iter().enumerate().map(frame).collect();
    let found = registered(&frames);
    for (k, (placed, frame)) in found.frames.iter().zip(&sequence.frames).enumerate() {
        assert_eq!(placed.is_none(), k == 3, "frame {k}: {:?}", found.unplaced);
        let Some(placed) = placed else { continue };
        let (mm, degrees) = pose_error(&placed.world_from_frame, &(first.inverse() * frame.world_from_camera));
        println!("{k}: {mm:.1} mm {degrees:.2} deg");
        // The poses that come with the frames are good to 8 mm and 0.3 degrees a pair.
        assert!(mm < 30.0 && degrees < 1.0, "frame {k}: {mm} mm, {degrees} degrees");
    }
}
