//! Pairs of frames and of clouds, from the identity.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use icp_registration::{
    Cloud, FrameAligner, FrameAlignmentOptions, IcpOptions, OrganisedFrame, OrganisedNormalOptions, Projection,
    VoxelAlignmentOptions, VoxelCloud, VoxelOptions, align, align_frames, organised_normals,
};
use nalgebra::Isometry3;

use crate::Outcome;
use crate::files::Frames;
use crate::pairs::{Points, cloud, compare};

/// What counts as a good pair: degrees and millimetres.
const LIMITS: [f64; 2] = [1.0, 30.0];

/// `rest` holds the distance between targets, the first pair, their number, and `all` for `align` as well.
pub fn run(folder: &Path, rest: &[&str]) -> Outcome {
    let [stride, first, count, methods @ ..] = rest else { return Err("stride, first pair and count".into()) };
    let frames = Frames::open(folder)?;
    let (first, count) = (first.parse()?, count.parse()?);
    let pairs: Vec<[usize; 2]> = frames.pairs(stride.parse()?).skip(first).take(count).collect();
    let images = frames.camera.height > 1;
    if images {
        organised(&frames, &pairs)?;
    }
    compare("voxels", &frames, &pairs, LIMITS, |target, source| {
        let options = VoxelOptions::default();
        let [target, source] = [target, source].map(|points| VoxelCloud::new(&cloud(points), &options));
        let result = target?.align(&source?, &Isometry3::identity(), &VoxelAlignmentOptions::default())?;
        Ok(result.target_from_source)
    })?;
    match (methods, images) {
        (["all"], true) => compare("align", &frames, &pairs, LIMITS, |target, source| {
            let [target, source] = [target, source].map(|points| with_normals(&frames, points));
            Ok(align(&source?, &target?, &Isometry3::identity(), &IcpOptions::default())?.target_from_source)
        }),
        (["all"], false) => compare("align_unorganised", &frames, &pairs, LIMITS, |target, source| {
            let [target, source] = [target, source].map(cloud);
            Ok(align(&source, &target, &Isometry3::identity(), &IcpOptions::default())?.target_from_source)
        }),
        _ => Ok(()),
    }
}

fn with_normals(frames: &Frames, points: &Points) -> Result<Cloud, icp_registration::Error> {
    let normals =
        organised_normals(points, frames.camera.width, frames.camera.height, &OrganisedNormalOptions::default())?;
    Cloud::from_frame(points, Some(&normals), None)
}

pub fn projection(frames: &Frames) -> Result<Arc<Projection>, icp_registration::Error> {
    let camera = &frames.camera;
    Projection::pinhole(camera.width, camera.height, camera.focal_px, camera.centre_px).map(Arc::new)
}

/// As streams do it: memory of the pair before is used again.
fn organised(frames: &Frames, pairs: &[[usize; 2]]) -> Outcome {
    let Some(&[first, _]) = pairs.first() else { return Ok(()) };
    let projection = projection(frames)?;
    let points = frames.points(first)?;
    let mut target = OrganisedFrame::new(&projection, &points, None)?;
    let mut source = OrganisedFrame::new(&projection, &points, None)?;
    let mut aligner = FrameAligner::new(FrameAlignmentOptions::default())?;
    aligner.align(&source, &target, &Isometry3::identity())?;
    compare("organised", frames, pairs, LIMITS, |new_target, new_source| {
        target.update(new_target, None)?;
        source.update(new_source, None)?;
        Ok(aligner.align(&source, &target, &Isometry3::identity())?.target_from_source)
    })
}

/// Prints how much faster two threads are (elapsed time, both alternating, least of some runs), and how many pairs get
/// the same bits.
pub fn threads(folder: &Path) -> Outcome {
    const RUNS: usize = 7;
    let frames = Frames::open(folder)?;
    let projection = projection(&frames)?;
    let pools = [1, 2].map(|threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build());
    let [one, two] = pools;
    let pools = [one?, two?];
    let (mut same_bits, mut least) = (0, [0.0; 2]);
    for [target, source] in frames.pairs(2) {
        let points = [frames.points(target)?, frames.points(source)?];
        let work = || -> Result<Isometry3<f64>, icp_registration::Error> {
            let [target, source] = points.each_ref().map(|points| OrganisedFrame::new(&projection, points, None));
            let options = FrameAlignmentOptions::default();
            Ok(align_frames(&source?, &target?, &Isometry3::identity(), &options)?.target_from_source)
        };
        let (mut found, mut times) = ([Isometry3::identity(); 2], [f64::INFINITY; 2]);
        for _ in 0..RUNS {
            for ((pool, found), least) in pools.iter().zip(&mut found).zip(&mut times) {
                let start = Instant::now();
                *found = pool.install(work)?;
                *least = least.min(start.elapsed().as_secs_f64());
            }
        }
        same_bits += usize::from(found[0] == found[1]);
        for (sum, time) in least.iter_mut().zip(times) {
            *sum += time;
        }
    }
    println!("faster {}\nsame_bits {same_bits}", least[0] / least[1]);
    Ok(())
}
