//! A station: a cloud in its own frame with what is known of it.

use std::sync::Arc;

use camera_model::{Camera, RayTable};
use nalgebra::{Isometry3, Vector3};
use point_cloud::{Cloud, OrganisedNormalOptions, organised_normals};
use projective_registration::Projection;
use range_io::clouds::CloudFile;

use crate::survey::open::StatedPoses;
use crate::survey::plausibility::{self, PlacedStation};
use crate::survey::records::StationPose;
use crate::survey::view::View;
use crate::{Error, Result};
use statistics::quantile;

/// Below this number of points there is no surface to speak of.
const FEWEST_POINTS: usize = 50;

/// Windows that the normals of a frame come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Windows {
    /// All of one size.
    Alike,
    /// Wider where noise hides the surface. Only with start poses: what these add is too dim to tell poses that are sought
    /// from the clouds alone (a small room with 1 % gross errors is not found from the order of its stations then).
    AsNoiseAsks,
}

impl Windows {
    /// How much wider windows become: four times as wide, 30 times as much noise.
    const WIDENED: usize = 4;

    /// Those that serve with start poses or without.
    pub fn of_start(has_poses: bool) -> Self {
        if has_poses { Self::AsNoiseAsks } else { Self::Alike }
    }

    fn widest(self, half_width_px: usize) -> Option<usize> {
        (self == Self::AsNoiseAsks).then(|| (Self::WIDENED * half_width_px).min(100))
    }
}

/// One cloud to register, in its own frame.
pub struct Station {
    /// Its name.
    pub name: String,
    /// Time of its first frame, or its place in the order of clouds, second.
    pub timestamp_s: f64,
    /// All points with what the input says of them; what is written in the end.
    pub file: CloudFile,
    /// How points fall on its pixels, where it is the frame of a camera; the same for all stations.
    pub projection: Option<Arc<Projection>>,
    /// Where the input says it stands.
    pub approximate: Option<Isometry3<f64>>,
    /// Standard deviations of that position, metre, and attitude, radian, in space, where they are stated.
    pub approximate_sigma: [Option<f64>; 2],
    /// Where it truly stands, of simulated surveys.
    pub truth: Option<Isometry3<f64>>,
}

/// The pixels of the camera; `None` for one too small to be registered by pixels.
pub fn projection(camera: &Camera) -> Option<Arc<Projection>> {
    let rays = RayTable::new(camera).ok()?;
    let format = &camera.format;
    Projection::from_directions(format.width, format.height, rays.directions()).ok().map(Arc::new)
}

impl Station {
    /// A view of a survey whose stations stand as `stated`, seen by `projection`; `None` where it has no cloud.
    pub fn of_view(view: &View, stated: &StatedPoses, projection: Option<&Arc<Projection>>) -> Option<Self> {
        let cloud = view.cloud.as_ref()?;
        Some(Self {
            name: view.station.clone(),
            timestamp_s: view.timestamp_s,
            file: CloudFile {
                points: cloud.points.clone(),
                intensity: Some(cloud.amplitude.clone()),
                sigma: Some(cloud.sigma.clone()),
                flags: Some(cloud.flags.iter().map(range_image::Flags::bits).collect()),
                size: Some([cloud.width, cloud.height]),
                ..CloudFile::default()
            },
            projection: projection.cloned(),
            approximate: view.approximate_world_from_camera,
            approximate_sigma: plausibility::stated_sigma(stated, &view.station),
            truth: view.truth.as_ref().and_then(|truth| truth.world_from_camera),
        })
    }

    /// Whether the station is a frame without amplitudes, as structured light and stereo give them: neighbours share their errors,
    /// which pairs of frames know, and whose surfaces the stations would be held against in vain (12 frames of a Kinect: 140 s
    /// instead of 5).
    pub fn is_depth_alone(&self) -> bool {
        let is_known = |values: &Vec<f32>| values.iter().any(|value| value.is_finite());
        self.projection.is_some() && !self.file.intensity.as_ref().is_some_and(is_known)
    }

    /// All points of the file; NaN where a flag excludes one.
    pub fn usable_points(&self) -> Vec<[f64; 3]> {
        let usable = |index: usize| self.file.flags.as_ref().is_none_or(|flags| flags[index] == 0);
        let points = self.file.points.iter().enumerate();
        points.map(|(index, point)| if usable(index) { *point } else { [f64::NAN; 3] }).collect()
    }

    /// Median distance of the usable points from the origin of their frame, metre.
    fn distance_m(&self) -> f64 {
        let points = self.usable_points();
        let mut distances: Vec<f64> = points.iter().map(|[x, y, z]| x.hypot(*y).hypot(*z)).collect();
        quantile(&mut distances, 0.5)
    }

    /// The station with the pose that was found.
    pub fn placed<'a>(&'a self, pose: &'a StationPose) -> PlacedStation<'a> {
        PlacedStation {
            name: &self.name,
            pose,
            stated: self.approximate,
            stated_sigma: self.approximate_sigma,
            distance_m: if self.is_seen_from_origin() { self.distance_m() } else { f64::NAN },
        }
    }

    /// Whether the points were seen from the origin of their frame, as those of cameras and scanners are.
    pub fn is_seen_from_origin(&self) -> bool {
        self.projection.is_some() || self.file.size.is_some()
    }

    /// The usable points with normals, sigma and intensity. `normal_half_width_px`: of the windows that normals of a frame
    /// come from.
    pub fn cloud(&self, normal_half_width_px: usize, windows: Windows) -> Result<Cloud> {
        let points = self.usable_points();
        let fail = |error: point_cloud::Error| Error::registration(&self.name, &error);
        let normals = match (&self.file.normals, self.file.size) {
            (Some(normals), _) => Some(normals.iter().map(|n| Vector3::from(n.map(f64::from))).collect()),
            (None, Some([width, height])) => {
                let options = OrganisedNormalOptions {
                    half_width_px: normal_half_width_px,
                    widest_half_width_px: windows.widest(normal_half_width_px),
                    ..OrganisedNormalOptions::default()
                };
                Some(organised_normals(&points, width, height, &options).map_err(fail)?)
            }
            (None, None) => None,
        };
        // Zero means unknown to many a program that writes a column of sigmas.
        let sigma = self.file.sigma.as_ref().map(|sigma| {
            let known = |value: &f32| if *value > 0.0 && value.is_finite() { *value } else { f32::NAN };
            sigma.iter().map(known).collect::<Vec<_>>()
        });
        let mut cloud = Cloud::from_frame(&points, normals.as_deref(), sigma.as_deref()).map_err(fail)?;
        if let Some(intensity) = &self.file.intensity {
            let finite = points.iter().zip(intensity).filter(|(point, _)| point.iter().all(|x| x.is_finite()));
            let values: Vec<f64> = finite.map(|(_, value)| f64::from(*value)).collect();
            cloud.intensity = (values.len() == cloud.len()).then_some(values);
        }
        if cloud.len() < FEWEST_POINTS {
            let (found, of) = (cloud.len(), points.len());
            return Err(Error::Register(format!(
                "{}: {found} usable points of {of}, at least {FEWEST_POINTS} are needed",
                self.name
            )));
        }
        Ok(cloud)
    }
}
