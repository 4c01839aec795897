//! Pairs of real frames one by one, and how many of them are right.

use std::path::Path;

use icp_registration::{IcpOptions, IcpResult, Metric, align};
use multiview_registration::Error;
use nalgebra::Isometry3;
use point_cloud::Cloud;

use crate::Outcome;
use crate::common::pose_error;
use crate::cpu_clock::cpu_seconds;
use crate::files::Frames;
use crate::frames::{Stream, by_voxels, with_normals};
use crate::pairs::{Points, median};

/// A pose is right within this of the reference, or within a share of the motion.
const RIGHT: [f64; 2] = [40.0, 2.0];
const RIGHT_SHARE: f64 = 0.25;
/// From one pixel to the next of the images that are aligned point by point, and from one pair to the next.
const THINNED: usize = 4;
const EACH: usize = 4;

/// Prints for each pair of a list (target and source a line) and both ways `NAME ms deg mm sure deg mm`: CPU time, how
/// far off the reference, whether the pose is trusted, and the motion. A pair without an answer is infinitely far off.
pub fn pairs(folder: &Path, list: &Path) -> Outcome {
    each_pair(folder, list, |_, _, stream, points, truth| {
        print("organised", truth, || stream.align(&points[0], &points[1]));
        print("voxels", truth, || by_voxels(&points[0], &points[1]));
        Ok(())
    })
}

/// Hands on each pair of a list: its number, all frames, their aligner, the points of target and source, and the reference.
fn each_pair(
    folder: &Path,
    list: &Path,
    mut hand_on: impl FnMut(usize, &Frames, &mut Stream, &[Points; 2], &Isometry3<f64>) -> Outcome,
) -> Outcome {
    let frames = Frames::open(folder)?;
    let mut stream = None;
    for (k, line) in std::fs::read_to_string(list)?.lines().enumerate() {
        let numbers = line.split_whitespace().map(str::parse).collect::<Result<Vec<usize>, _>>()?;
        let &[target, source] = numbers.as_slice() else { return Err(format!("{line}: two frames").into()) };
        let points = [frames.points(target)?, frames.points(source)?];
        let stream = match &mut stream {
            Some(stream) => stream,
            none => none.insert(Stream::new(&frames, &points[0])?),
        };
        hand_on(k, &frames, stream, &points, &frames.truth([target, source]))?;
    }
    Ok(())
}

fn print(name: &str, truth: &Isometry3<f64>, align: impl FnOnce() -> Result<IcpResult, Error>) {
    let start = cpu_seconds();
    let found = align();
    let milliseconds = 1e3 * (cpu_seconds() - start);
    let sure = found.as_ref().is_ok_and(IcpResult::is_trustworthy);
    let off = found.map_or((f64::INFINITY, f64::INFINITY), |result| pose_error(&result.target_from_source, truth));
    let moved = pose_error(&Isometry3::identity(), truth);
    println!("{name} {milliseconds} {} {} {} {} {}", off.1, off.0, u8::from(sure), moved.1, moved.0);
}

/// Prints for frames, for clouds and, for every fourth pair and pixel, for each metric of points how many pairs of a list are
/// right, and of these how far off and known to how much in the median.
pub fn tally(folder: &Path, list: &Path) -> Outcome {
    let metrics = [Metric::PointToPlane, Metric::SymmetricPlanes, Metric::PlaneToPlane, Metric::PointToPoint];
    let mut tallies: [Tally; 6] = Default::default();
    each_pair(folder, list, |k, frames, stream, points, truth| {
        let [organised, voxels, by_points @ ..] = &mut tallies;
        organised.add(stream.align(&points[0], &points[1]).ok(), truth);
        voxels.add(by_voxels(&points[0], &points[1]).ok(), truth);
        if k % EACH == 0 {
            let [target, source] = [thinned(frames, &points[0])?, thinned(frames, &points[1])?];
            for (metric, tally) in metrics.into_iter().zip(by_points) {
                let options = IcpOptions { metric, ..IcpOptions::default() };
                tally.add(align(&source, &target, &Isometry3::identity(), &options).ok(), truth);
            }
        }
        Ok(())
    })?;
    let names = ["organised", "voxels"].map(str::to_owned).into_iter().chain(metrics.map(|m| format!("{m:?}")));
    for (name, tally) in names.zip(tallies) {
        tally.print(&name);
    }
    Ok(())
}

/// Every fourth pixel of a frame both ways, with normals.
fn thinned(frames: &Frames, points: &[[f64; 3]]) -> Result<Cloud, Error> {
    let [width, height] = [frames.camera.width / THINNED, frames.camera.height / THINNED];
    let pixel = |k: usize| THINNED * (k / width * frames.camera.width + k % width);
    let points: Vec<[f64; 3]> = (0..width * height).map(|k| points[pixel(k)]).collect();
    with_normals([width, height], &points)
}

#[derive(Default)]
struct Tally {
    asked: usize,
    right: usize,
    doubted: usize,
    wrong_and_trusted: usize,
    millimetres: Vec<f64>,
    degrees: Vec<f64>,
    stated: Vec<f64>,
}

impl Tally {
    fn add(&mut self, found: Option<IcpResult>, truth: &Isometry3<f64>) {
        self.asked += 1;
        let Some(found) = found else { return };
        let (mm, degrees) = pose_error(&found.target_from_source, truth);
        let moved = pose_error(&Isometry3::identity(), truth);
        let limits = [RIGHT[0].max(RIGHT_SHARE * moved.0), RIGHT[1].max(RIGHT_SHARE * moved.1)];
        let right = mm < limits[0] && degrees < limits[1];
        self.right += usize::from(right);
        self.doubted += usize::from(right && !found.is_trustworthy());
        self.wrong_and_trusted += usize::from(!right && found.is_trustworthy());
        if right {
            self.millimetres.push(mm);
            self.degrees.push(degrees);
            self.stated.push(1e3 * found.covariance.fixed_view::<3, 3>(0, 0).trace().sqrt());
        }
    }

    fn print(self, name: &str) {
        let [mm, degrees, stated] = [self.millimetres, self.degrees, self.stated].map(median);
        println!(
            "{name}: {} of {} right, {} of them doubted, {} wrong and trusted; {mm:.2} mm, {degrees:.3} deg, stated {stated:.3} mm",
            self.right, self.asked, self.doubted, self.wrong_and_trusted
        );
    }
}
