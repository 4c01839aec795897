//! Single targets of a station: measured, named, and held against their coordinates.

mod check;
mod names;
mod points;

use camera_model::Camera;
use nalgebra::Isometry3;
use pipeline::Result;
use pipeline::survey::read_calibration;
use range_io::tables::{Station, Target, TargetObservation, read_stations, read_targets};
use report::Mark;

use crate::find::pictures::{Picture, Pictures};
use crate::find::request::TargetsRequest;
use crate::find::station::{LeftOut, Seen, StationPicture};
use crate::kind::SingleKind;
use names::{Named, Names};
use points::{Point, points};

/// What single targets are named by.
pub(crate) struct Singles {
    kind: SingleKind,
    camera: Camera,
    /// `targets.csv` of the survey; empty where there is none.
    pub(crate) known: Vec<Target>,
    /// `stations.csv` of the survey; empty where there is none.
    pub(crate) poses: Vec<Station>,
}

impl Singles {
    pub(crate) fn new(kind: SingleKind, request: &TargetsRequest, pictures: &Pictures) -> Result<Self> {
        let refuse = |message: String| Err(pipeline::Error::Request { command: "targets", message });
        if pictures.is_folder && request.principal_distance_px.is_none() {
            let message = format!(
                "{} do not tell the principal distance of a folder of images: give it with --principal-distance PIXELS",
                kind.noun()
            );
            return refuse(message);
        }
        if matches!(kind, SingleKind::Spheres { .. }) && !pictures.has_ranges() {
            return refuse("spheres are found in ranges, and the survey has images alone".to_owned());
        }
        let calibrated = match read_calibration(&pictures.root, request.calibration.as_deref())?.0 {
            Some(calibration) => Some(calibration.camera()?),
            None => None,
        };
        let camera = match calibrated {
            Some(camera) => camera,
            None => pictures.camera(request, &[])?.nominal_camera()?,
        };
        let path = |name: &str| Some(pictures.root.join(name)).filter(|path| path.is_file());
        let known = path("targets.csv").map(read_targets).transpose()?.unwrap_or_default();
        let poses = path("stations.csv").map(read_stations).transpose()?.unwrap_or_default();
        Ok(Self { kind, camera, known, poses })
    }

    /// What one station shows.
    pub(crate) fn station(&self, picture: Picture) -> Result<StationPicture> {
        let camera = picture.ranges.as_ref().map_or(self.camera, |(_, camera)| *camera);
        let (points, named) = match points(self.kind, &picture, &camera) {
            Ok(points) => {
                let names = Names { kind: self.kind, camera: &camera, known: &self.known };
                let named = names.of(&points, self.approximate(&picture.station));
                (points, named)
            }
            Err(targets::Error::NotFound(reason)) => (Vec::new(), Err(reason.to_string())),
            Err(error) => return Err(pipeline::Error::Estimate { what: "targets", source: error.into() }),
        };
        let Picture { station, light, integration_time_s, .. } = picture;
        let (seen, observations) = match named {
            Err(reason) => (Err(reason), Vec::new()),
            Ok(named) => {
                let row = |(name, point): (&Option<String>, &Point)| {
                    Some(observation(&station, name.clone()?, point, integration_time_s))
                };
                let observations = named.names.iter().zip(&points).filter_map(row).collect();
                (Ok(self.seen(&points, named)), observations)
            }
        };
        Ok(StationPicture { station, light, seen, observations })
    }

    fn approximate(&self, station: &str) -> Option<Isometry3<f64>> {
        self.poses.iter().find(|pose| pose.station == station).map(|pose| pose.world_from_camera)
    }

    fn seen(&self, points: &[Point], named: Named) -> Seen {
        let mark = |(name, point): (&Option<String>, &Point)| Mark {
            at: point.pixel,
            is_filled: false,
            label: name.clone().or_else(|| point.code.clone()).unwrap_or_default(),
        };
        let fault = |(point, fault): (&Point, &Option<String>)| {
            Some(LeftOut { target: point.code.clone().unwrap_or_default(), pixel: point.pixel, reason: fault.clone()? })
        };
        let named_count = named.names.iter().flatten().count();
        let left_out: Vec<LeftOut> = points.iter().zip(&named.faults).filter_map(fault).collect();
        Seen {
            of: if self.known.is_empty() { points.len() } else { self.known.len().max(named_count) },
            ambiguity: 1,
            residual_px: named.residual_px,
            unnamed: points.len() - named_count - left_out.len(),
            unchecked: if named.is_checked { 0 } else { named_count },
            left_out,
            hidden: named.not_seen,
            marks: named.names.iter().zip(points).map(mark).collect(),
            line: Vec::new(),
            pairs: Vec::new(),
        }
    }
}

fn observation(station: &str, target: String, point: &Point, integration_time_s: Option<f64>) -> TargetObservation {
    TargetObservation {
        station: station.to_owned(),
        target,
        pixel: Some(point.pixel),
        range_m: point.range.map(|[range, _]| range),
        sigma_pixel: Some(point.sigma_px),
        sigma_range_m: point.range.map(|[_, sigma]| sigma),
        amplitude: point.amplitude,
        integration_time_s,
    }
}
