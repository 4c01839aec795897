//! Trusted poses that are wrong, sought among thousands of real pairs from the identity.
//!
//! The reference has errors of its own. A pair that is registered again from the reference's pose tells a second minimum;
//! where it ends in the same one, two witnesses tell whose pose is wrong. Pixels that lie clearly in front of what the other
//! image saw contradict a pose; one that is fitted to these pixels always suits them better than one that is not, and how
//! much better is told by the right pairs. The frames between the two lead from one to the other by other pixels.

use nalgebra::{Isometry3, Matrix6, Point3, Vector6};
use projective_registration::{FrameAligner, FrameAlignmentOptions, OrganisedFrame};
use rigid_pose::pose_difference;

use super::depth_frames::{CENTRES, DepthFrame, FOCAL, dense_kitchen};

/// Frames between the two of a pair.
const GAPS: [usize; 10] = [5, 10, 15, 20, 30, 40, 50, 60, 80, 100];
/// What counts as wrong: farther off than this share of the motion and more, and than so many standard deviations.
const WRONG_M: f64 = 0.04;
const WRONG_SHARE: f64 = 0.25;
const WRONG_SIGMA: f64 = 4.0;
/// Of the reference, a pair: 8 mm and 0.3 degrees.
const REFERENCE: [f64; 2] = [8e-3, 5.2e-3];
/// In front of all neighbours by this at 1 m is a contradiction: a Kinect's steps of depth are 3 mm there and grow with
/// the square of the depth.
const IN_FRONT_M: f64 = 0.01;
/// Of so many right pairs one tells how much better than the reference a fitted pose suits the pixels, and the share of
/// them that a reference must exceed to be called wrong.
const EVERY: usize = 5;
const SHARE: f64 = 0.95;
/// The reference jumps behind this frame; pairs across it say nothing of the usual.
const JUMP: usize = 121;
/// Steps on the way by the frames between the two of a pair: all gaps are multiples.
const WAY: usize = 5;
/// The way speaks for a pose where it ends so many times nearer to it than to the other; it has errors of its own.
const NEARER: f64 = 2.0;

pub fn print() {
    let Some(sequence) = dense_kitchen(0..500) else {
        println!("dense kitchen: the frames are not there");
        return;
    };
    let prepare = |points: &[[f64; 3]]| OrganisedFrame::new(&sequence.projection, points, None).unwrap();
    let frames: Vec<OrganisedFrame> = sequence.frames.iter().map(|f| prepare(&f.points)).collect();
    let mut aligner = FrameAligner::new(FrameAlignmentOptions::default()).unwrap();
    let (mut asked, mut trusted, mut right, mut wrong, mut over) = (0, 0, 0, 0, 0);
    for gap in GAPS {
        let (mut judged, mut usual) = (Vec::new(), Vec::new());
        for a in 0..frames.len() - gap {
            let pair = [&sequence.frames[a], &sequence.frames[a + gap]];
            let truth = pair[0].world_from_camera.inverse() * pair[1].world_from_camera;
            asked += 1;
            let Ok(result) = aligner.align(&frames[a + gap], &frames[a], &Isometry3::identity()) else { continue };
            let error = pose_difference(&result.target_from_source, &truth);
            let off = error.fixed_rows::<3>(0).norm();
            let moved = truth.translation.vector.norm();
            let is_right = off < WRONG_M.max(WRONG_SHARE * moved);
            right += usize::from(is_right);
            if !result.is_trustworthy() {
                continue;
            }
            trusted += 1;
            let [metre, radian] = REFERENCE.map(|r| r * r / 3.0);
            let reference = Matrix6::from_diagonal(&Vector6::new(metre, metre, metre, radian, radian, radian));
            let variance = (result.covariance + reference).diagonal();
            let sigmas = (0..6).map(|k| error[k].abs() / variance[k].sqrt()).fold(0.0, f64::max);
            over += usize::from(sigmas > WRONG_SIGMA);
            let found = &result.target_from_source;
            if is_right {
                if trusted % EVERY == 0 && !(a <= JUMP && JUMP < a + gap) {
                    usual.push(excess(pair, found, &truth));
                }
                continue;
            }
            wrong += 1;
            let end = end_from(&truth, &mut aligner, [&frames[a], &frames[a + gap]], found);
            let way = by_way(&mut aligner, &frames[a..=a + gap], found, &truth);
            let line = format!(
                "{a} {}: {:.0} mm off of {:.0} ({:.2} of the motion found), {sigmas:.1} standard deviations, overlap {:.2}, rms {:.1} mm, {end}",
                a + gap,
                1e3 * off,
                1e3 * moved,
                found.translation.vector.dot(&truth.translation.vector) / moved.powi(2),
                result.overlap,
                1e3 * result.rms_m,
            );
            judged.push((line, way, excess(pair, found, &truth)));
        }
        print_judged(&judged, usual);
    }
    println!(
        "{asked} pairs: {right} right, {trusted} trusted, of these {wrong} wrong and {over} beyond {WRONG_SIGMA} standard deviations"
    );
}

/// Where the registration ends from the reference's pose.
fn end_from(
    reference: &Isometry3<f64>,
    aligner: &mut FrameAligner,
    [target, source]: [&OrganisedFrame; 2],
    found: &Isometry3<f64>,
) -> String {
    let Ok(again) = aligner.align(source, target, reference) else { return "refused from the reference".to_owned() };
    let apart = |pose| pose_difference(&again.target_from_source, pose).fixed_rows::<3>(0).norm();
    let minimum = if apart(found) < apart(reference) { "the same minimum" } else { "ANOTHER MINIMUM" };
    format!("from the reference {minimum} within {:.0} mm", 1e3 * apart(found))
}

/// How far from the pose and from the reference the way by frames between the two ends, metre.
fn by_way(
    aligner: &mut FrameAligner,
    frames: &[OrganisedFrame],
    found: &Isometry3<f64>,
    reference: &Isometry3<f64>,
) -> [f64; 2] {
    let mut pose = Isometry3::identity();
    for pair in frames.iter().step_by((frames.len() - 1) / WAY).collect::<Vec<_>>().windows(2) {
        let Ok(step) = aligner.align(pair[1], pair[0], &Isometry3::identity()) else { return [f64::NAN; 2] };
        pose *= step.target_from_source;
    }
    [found, reference].map(|other| pose_difference(&pose, other).fixed_rows::<3>(0).norm())
}

/// Says of each wrong pair what both witnesses tell, and whose pose is wrong if they do not contradict each other.
fn print_judged(judged: &[(String, [f64; 2], f64)], mut usual: Vec<f64>) {
    usual.sort_by(f64::total_cmp);
    let most = usual.get((SHARE * usual.len() as f64) as usize).copied().unwrap_or(f64::NAN);
    for (line, [here, there], excess) in judged {
        let (for_pose, against) = (*excess > most || NEARER * here < *there, *excess < 0.0 || NEARER * there < *here);
        let whose = match (for_pose, against) {
            (true, false) => "the reference is wrong",
            (false, true) => "THE POSE IS WRONG",
            _ => "UNDECIDED",
        };
        println!(
            "{line}; by the frames between {:.0} mm from the pose and {:.0} from the reference; this contradicted by {:.1} % \
             more (right pairs up to {:.1}): {whose}",
            1e3 * here,
            1e3 * there,
            100.0 * excess,
            100.0 * most
        );
    }
}

/// By how many of the pixels that both frames see the reference is contradicted more than the pose.
fn excess(pair: [&DepthFrame; 2], found: &Isometry3<f64>, reference: &Isometry3<f64>) -> f64 {
    contradicted(pair, reference) - contradicted(pair, found)
}

/// Share of the pixels of both frames, of those that the other one sees, that lie in front of it.
fn contradicted([target, source]: [&DepthFrame; 2], target_from_source: &Isometry3<f64>) -> f64 {
    let ways = [(target, source, *target_from_source), (source, target, target_from_source.inverse())];
    let (mut seen, mut against) = (0, 0);
    for (there, here, there_from_here) in ways {
        for &point in here.points.iter().filter(|point| point[2].is_finite()) {
            let point = there_from_here * Point3::from(point);
            let Some(depth) = nearest_depth(there, &point) else { continue };
            seen += 1;
            against += usize::from(-point.z < depth - IN_FRONT_M * depth * depth);
        }
    }
    f64::from(against as u32) / f64::from(seen as u32)
}

/// The least depth of the nine pixels that a point falls on; none where the middle one has none.
fn nearest_depth(frame: &DepthFrame, point: &Point3<f64>) -> Option<f64> {
    let at = |offset: f64, centre: f64| (centre + FOCAL[0] * offset / -point.z).round();
    let (col, row) = (at(point.x, CENTRES[0][0]), at(-point.y, CENTRES[0][1]));
    if point.z >= 0.0 || !(1.0..639.0).contains(&col) || !(1.0..479.0).contains(&row) {
        return None;
    }
    let depth = |col: usize, row: usize| -frame.points[row * 640 + col][2];
    let (col, row) = (col as usize, row as usize);
    let block = (row - 1..=row + 1).flat_map(|row| (col - 1..=col + 1).map(move |col| depth(col, row)));
    // `min` takes the number where the other is none.
    let nearest = block.fold(f64::INFINITY, f64::min);
    depth(col, row).is_finite().then_some(nearest)
}
