//! Pairs of frames and of clouds, from the identity.

use std::path::Path;
use std::sync::Arc;

use icp_registration::{IcpOptions, IcpResult, VoxelAlignmentOptions, VoxelCloud, align};
use nalgebra::Isometry3;
use point_cloud::{Cloud, OrganisedNormalOptions, organised_normals};
use projective_registration::{FrameAligner, FrameAlignmentOptions, OrganisedFrame, Projection};

use crate::files::Frames;
use crate::pairs::{Points, cloud, compare};
use crate::{Failure, Outcome};

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
    compare("voxels", &frames, &pairs, LIMITS, |target, source| Ok(by_voxels(target, source)?.target_from_source))?;
    match (methods, images) {
        (["all"], true) => compare("align", &frames, &pairs, LIMITS, |target, source| {
            let size = [frames.camera.width, frames.camera.height];
            let [target, source] = [target, source].map(|points| with_normals(size, points));
            Ok(align(&source?, &target?, &Isometry3::identity(), &IcpOptions::default())?.target_from_source)
        }),
        (["all"], false) => compare("align_unorganised", &frames, &pairs, LIMITS, |target, source| {
            let [target, source] = [target, source].map(cloud);
            Ok(align(&source, &target, &Isometry3::identity(), &IcpOptions::default())?.target_from_source)
        }),
        _ => Ok(()),
    }
}

/// From lists of points to the pose, from the identity.
pub fn by_voxels(target: &Points, source: &Points) -> Result<IcpResult, multiview_registration::Error> {
    let [target, source] = [target, source].map(|points| VoxelCloud::new(&cloud(points), None));
    Ok(target?.align(&source?, &Isometry3::identity(), &VoxelAlignmentOptions::default())?)
}

/// A cloud of an image's points with normals.
pub fn with_normals([width, height]: [usize; 2], points: &[[f64; 3]]) -> Result<Cloud, multiview_registration::Error> {
    let normals = organised_normals(points, width, height, &OrganisedNormalOptions::default())?;
    Ok(Cloud::from_frame(points, Some(&normals), None)?)
}

pub fn projection(frames: &Frames) -> Result<Arc<Projection>, Failure> {
    let camera = &frames.camera;
    let projection = if camera.focal_px[0] > 0.0 {
        Projection::pinhole(camera.width, camera.height, camera.focal_px, camera.centre_px)
    } else {
        Projection::from_directions(camera.width, camera.height, &frames.directions()?)
    };
    Ok(Arc::new(projection?))
}

/// As streams do it: memory of the pair before is used again.
pub struct Stream {
    target: OrganisedFrame,
    source: OrganisedFrame,
    aligner: FrameAligner,
}

impl Stream {
    /// `points`: any frame of the camera.
    pub fn new(frames: &Frames, points: &Points) -> Result<Self, Failure> {
        let target = OrganisedFrame::new(&projection(frames)?, points, None)?;
        let mut aligner = FrameAligner::new(FrameAlignmentOptions::default())?;
        aligner.align(&target, &target, &Isometry3::identity())?;
        Ok(Self { source: target.clone(), target, aligner })
    }

    /// From raw points to the pose, from the identity.
    pub fn align(&mut self, target: &Points, source: &Points) -> Result<IcpResult, multiview_registration::Error> {
        self.target.update(target, None)?;
        self.source.update(source, None)?;
        Ok(self.aligner.align(&self.source, &self.target, &Isometry3::identity())?)
    }
}

fn organised(frames: &Frames, pairs: &[[usize; 2]]) -> Outcome {
    let Some(&[first, _]) = pairs.first() else { return Ok(()) };
    let mut stream = Stream::new(frames, &frames.points(first)?)?;
    compare("organised", frames, pairs, LIMITS, |target, source| Ok(stream.align(target, source)?.target_from_source))
}
