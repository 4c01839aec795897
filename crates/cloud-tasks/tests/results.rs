//! Folders of results, from simulated surveys.

use std::path::{Path, PathBuf};

use cloud_tasks::commands::Silent;
use cloud_tasks::commands::range_io::calibration::Calibration;
use cloud_tasks::commands::range_io::clouds::{CloudFile, Precision};
use cloud_tasks::commands::range_io::ply::write_cloud;
use cloud_tasks::commands::range_io::ron_text;
use cloud_tasks::point_uncertainty::Columns;
use cloud_tasks::point_uncertainty::error_models::{ModelSet, RangeErrorModel};
use cloud_tasks::{CommonErrorsFile, FrameErrors, MeasureRequest, MeasureSummary, SharedBySensor, measure};
use tempfile::TempDir;

use crate::scene::{self, Setting, Survey};

pub const WIDTH: usize = 96;

/// A result in a folder that goes with the test.
pub struct Folder {
    pub survey: Survey,
    folder: TempDir,
}

impl Folder {
    pub fn new(seed: u64) -> Self {
        let survey = scene::survey(&Setting { width: WIDTH, ..Setting::default() }, seed);
        let folder = Self { survey, folder: tempfile::tempdir().unwrap() };
        folder.write_cloud(&[]);
        folder.write_errors(&folder.common_errors());
        let camera = scene::camera(WIDTH, &[0.0; 4]);
        let models = ModelSet { entries: vec![(0.004, vec![RangeErrorModel::error_free(7.5)])] };
        let calibration = Calibration::from_models(&camera, &models, None).unwrap();
        calibration.write(folder.path("result/calibration.ron")).unwrap();
        folder
    }

    pub fn path(&self, name: &str) -> PathBuf {
        let path = self.folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        path
    }

    /// With these points flagged.
    pub fn write_cloud(&self, flagged: &[usize]) {
        self.write_cloud_of_frames(flagged, |point| self.survey.errors.of_points[point].station as u32);
    }

    /// The same with the frame of each point.
    pub fn write_cloud_of_frames(&self, flagged: &[usize], frame: impl Fn(usize) -> u32) {
        let survey = &self.survey;
        let of_points = &survey.errors.of_points;
        let flag = |point: usize| u16::from(flagged.contains(&point));
        let cloud = CloudFile {
            points: survey.points.iter().map(|point| point.coords.into()).collect(),
            intensity: Some(vec![100.0; survey.points.len()]),
            sigma: Some(of_points.iter().map(|of| of.sigma_m as f32).collect()),
            flags: Some((0..survey.points.len()).map(flag).collect()),
            frame: Some((0..survey.points.len()).map(frame).collect()),
            ..CloudFile::default()
        };
        write_cloud(self.path("result/cloud.ply"), &cloud, Precision::Single).unwrap();
    }

    pub fn write_errors(&self, errors: &CommonErrorsFile) {
        std::fs::write(self.path("result/common_errors.ron"), ron_text::to_text(errors).unwrap()).unwrap();
    }

    pub fn common_errors(&self) -> CommonErrorsFile {
        let common = &self.survey.common;
        let covariance = common.covariance();
        let frame = |(number, station): (usize, &cloud_tasks::point_uncertainty::StationErrors)| {
            let first = 4 + 7 * number;
            let pose = station.world_from_camera();
            FrameErrors {
                view: format!("S{number}"),
                station: format!("S{number}"),
                position_m: pose.translation.vector.into(),
                quaternion_xyzw: pose.rotation.coords.into(),
                range_model: Some(0),
                columns: Columns {
                    camera: vec![(0, 1), (2, 2), (3, 3)],
                    range: vec![(0, 0)],
                    hyperbola: Vec::new(),
                    drift: Some(first),
                    pose: Some(first + 1),
                },
                sensor: Some(SharedBySensor { sigma_m: 0.002, share: 0.0, width_px: 6.0 }),
            }
        };
        CommonErrorsFile {
            format_version: 1,
            calibration: Some("calibration.ron".to_owned()),
            frames: self.survey.errors.stations.iter().enumerate().map(frame).collect(),
            errors: common.errors().to_vec(),
            not_in_it: Vec::new(),
            covariance: (0..covariance.nrows())
                .map(|row| (0..=row).map(|at| covariance[(row, at)]).collect())
                .collect(),
        }
    }

    pub fn measure(&self, plan: &str) -> Result<MeasureSummary, cloud_tasks::commands::Error> {
        let lengths = self.path("lengths.ron");
        std::fs::write(&lengths, plan).unwrap();
        let request = MeasureRequest { result: self.path("result"), lengths, out: self.path("out") };
        measure(&request, &Silent)
    }

    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.folder.path().join("out").join(Path::new(name))).unwrap()
    }
}

/// All kinds of regions and lengths.
pub const PLAN: &str = r#"(
    regions: {
        "wall": plane(box(from_m: (-0.3, -0.2, -0.1), to_m: (0.9, 0.35, 0.1))),
        "board": plane(box(from_m: (-1.15, 0.15, 0.15), to_m: (-0.45, 0.85, 0.35))),
        "left ball": sphere(sphere(centre_m: (0.2, 0.6, 0.3), radius_m: 0.2)),
        "right ball": sphere(sphere(centre_m: (0.9, 0.6, 0.35), radius_m: 0.2)),
        "pipe": cylinder(cylinder(from_m: (0.1, -0.54, 0.28), to_m: (0.9, -0.46, 0.32), radius_m: 0.17)),
        "corner": mean(box(from_m: (-0.9, 0.4, 0.2), to_m: (-0.7, 0.6, 0.3))),
        "mark": nearest(at_m: (0.4, 0.1, 0.0)),
        "datum": fixed(at_m: (0.0, 0.0, 0.0)),
        "up": direction(along: (0.0, 0.0, 2.0)),
        "board's surface": surface(prism(corners_m: [(-1.1, 0.2, 0.25), (-0.5, 0.2, 0.25), (-0.5, 0.8, 0.25), (-1.1, 0.8, 0.25)],
                                         reach_m: (0.1, 0.1))),
        "z = 0": known_plane(point_m: (0.0, 0.0, 0.0), normal: (0.0, 0.0, 1.0)),
    },
    lengths: [
        (name: "board off the wall", quantity: distance(from: "wall", to: "board")),
        (name: "at a place", quantity: distance(from: "wall", to: "board", at_m: (-0.8, 0.5, 0.1))),
        (name: "balls", quantity: distance(from: "left ball", to: "right ball")),
        (name: "ball, wall", quantity: distance(from: "left ball", to: "wall")),
        (name: "ball, pipe", quantity: distance(from: "pipe", to: "left ball")),
        (name: "corner, mark", quantity: distance(from: "corner", to: "mark")),
        (name: "datum, corner", quantity: distance(from: "datum", to: "corner")),
        (name: "lean", quantity: angle(from: "wall", to: "up")),
        (name: "pipe's slope", quantity: angle(from: "pipe", to: "up")),
        (name: "pipe, radius", quantity: radius(of: "pipe")),
        (name: "ball, \"left\"", quantity: diameter(of: "left ball")),
        (name: "wall's form", quantity: flatness(of: "wall")),
        (name: "behind the board", quantity: volume(of: "board's surface", over: "wall", cell_m: 0.1)),
        (name: "over zero", quantity: volume(of: "board's surface", over: "z = 0", cell_m: 0.1)),
    ],
)"#;
