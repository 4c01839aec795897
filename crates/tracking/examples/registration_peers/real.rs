//! Pairs of real frames one by one.

use std::path::Path;

use icp_registration::IcpResult;
use multiview_registration::Error;
use nalgebra::Isometry3;

use crate::Outcome;
use crate::common::pose_error;
use crate::cpu_clock::cpu_seconds;
use crate::files::Frames;
use crate::frames::{Stream, by_voxels};

/// Prints for each pair of a list (target and source a line) and both ways `NAME ms deg mm sure deg mm`: CPU time, how
/// far off the reference, whether the pose is trusted, and the motion. A pair without an answer is infinitely far off.
pub fn pairs(folder: &Path, list: &Path) -> Outcome {
    let frames = Frames::open(folder)?;
    let mut stream = None;
    for line in std::fs::read_to_string(list)?.lines() {
        let numbers = line.split_whitespace().map(str::parse).collect::<Result<Vec<usize>, _>>()?;
        let &[target, source] = numbers.as_slice() else { return Err(format!("{line}: two frames").into()) };
        let points = [frames.points(target)?, frames.points(source)?];
        let stream = match &mut stream {
            Some(stream) => stream,
            none => none.insert(Stream::new(&frames, &points[0])?),
        };
        let truth = frames.truth([target, source]);
        print("organised", &truth, || stream.align(&points[0], &points[1]));
        print("voxels", &truth, || by_voxels(&points[0], &points[1]));
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
