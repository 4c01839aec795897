//! Folders of frames.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion};

use crate::common::Pinhole;
use crate::{Failure, Outcome};

/// A camera without distortion.
#[derive(Debug, Clone, Copy)]
pub struct Camera {
    pub width: usize,
    pub height: usize,
    pub focal_px: [f64; 2],
    pub centre_px: [f64; 2],
}

impl From<&Pinhole> for Camera {
    fn from(camera: &Pinhole) -> Self {
        let centre = |size: usize| (size as f64 - 1.0) / 2.0;
        Self {
            width: camera.width,
            height: camera.height,
            focal_px: [camera.focal_px; 2],
            centre_px: [centre(camera.width), centre(camera.height)],
        }
    }
}

/// Frames of one camera with their true poses; points are read when they are asked for.
pub struct Frames {
    folder: PathBuf,
    pub camera: Camera,
    /// World from camera.
    pub poses: Vec<Isometry3<f64>>,
}

impl Frames {
    pub fn open(folder: &Path) -> Result<Self, Failure> {
        let camera = numbers(&fs::read_to_string(folder.join("camera.txt"))?)?;
        let &[width, height, fx, fy, cx, cy] = camera.as_slice() else {
            return Err("camera.txt: six numbers are expected".into());
        };
        let camera = Camera { width: width as usize, height: height as usize, focal_px: [fx, fy], centre_px: [cx, cy] };
        Ok(Self { folder: folder.to_owned(), camera, poses: poses(&folder.join("poses.txt"))? })
    }

    /// Points of a frame.
    pub fn points(&self, frame: usize) -> Result<Vec<[f64; 3]>, Failure> {
        self.triples(&format!("{frame:03}.f32"))
    }

    /// Directions of the pixels of a camera with a lens.
    pub fn directions(&self) -> Result<Vec<[f64; 3]>, Failure> {
        self.triples("directions.f32")
    }

    fn triples(&self, name: &str) -> Result<Vec<[f64; 3]>, Failure> {
        let bytes = fs::read(self.folder.join(name))?;
        let values: Vec<f64> = bytes.as_chunks().0.iter().map(|&four| f64::from(f32::from_ne_bytes(four))).collect();
        Ok(values.as_chunks().0.to_vec())
    }

    /// Poses of another file, line by line as `poses.txt`.
    pub fn other_poses(&self, name: &str) -> Result<Vec<Isometry3<f64>>, Failure> {
        poses(&self.folder.join(name))
    }

    /// Target and source of the pairs: frames `k stride` and the one after it.
    pub fn pairs(&self, stride: usize) -> impl Iterator<Item = [usize; 2]> + use<> {
        (0..self.poses.len().saturating_sub(1)).step_by(stride.max(1)).map(|first| [first, first + 1])
    }

    /// The true pose of one frame in another.
    pub fn truth(&self, [target, source]: [usize; 2]) -> Isometry3<f64> {
        self.poses[target].inverse() * self.poses[source]
    }
}

/// Writes frames one by one.
pub struct Writer {
    folder: PathBuf,
    poses: Vec<Isometry3<f64>>,
}

impl Writer {
    pub fn new(folder: &Path, camera: &Camera) -> Result<Self, Failure> {
        fs::create_dir_all(folder)?;
        let Camera { width, height, focal_px: [fx, fy], centre_px: [cx, cy] } = camera;
        fs::write(folder.join("camera.txt"), format!("{width} {height} {fx} {fy} {cx} {cy}\n"))?;
        Ok(Self { folder: folder.to_owned(), poses: Vec::new() })
    }

    pub fn frame(&mut self, points: &[[f64; 3]], world_from_camera: &Isometry3<f64>) -> Outcome {
        self.triples(&format!("{:03}.f32", self.poses.len()), points)?;
        self.poses.push(*world_from_camera);
        Ok(())
    }

    /// Directions of the pixels of a camera with a lens.
    pub fn directions(&self, directions: &[[f64; 3]]) -> Outcome {
        self.triples("directions.f32", directions)
    }

    fn triples(&self, name: &str, triples: &[[f64; 3]]) -> Outcome {
        let bytes: Vec<u8> = triples.as_flattened().iter().flat_map(|&value| (value as f32).to_ne_bytes()).collect();
        Ok(fs::write(self.folder.join(name), bytes)?)
    }

    /// Writes the poses, and others where a method needs some to start from.
    pub fn finish(self, others: &[(&str, Vec<Isometry3<f64>>)]) -> Outcome {
        fs::write(self.folder.join("poses.txt"), text(&self.poses)?)?;
        for (name, poses) in others {
            fs::write(self.folder.join(name), text(poses)?)?;
        }
        Ok(())
    }
}

fn text(poses: &[Isometry3<f64>]) -> Result<String, std::fmt::Error> {
    let mut text = String::new();
    for pose in poses {
        let matrix = pose.to_homogeneous();
        for row in 0..3 {
            write!(text, "{} {} {} {} ", matrix[(row, 0)], matrix[(row, 1)], matrix[(row, 2)], matrix[(row, 3)])?;
        }
        writeln!(text)?;
    }
    Ok(text)
}

fn poses(path: &Path) -> Result<Vec<Isometry3<f64>>, Failure> {
    let text = fs::read_to_string(path)?;
    text.lines()
        .map(|line| {
            let rows = numbers(line)?;
            let &[a, b, c, x, d, e, f, y, g, h, i, z] = rows.as_slice() else {
                return Err(format!("{}: three rows of four numbers are expected", path.display()).into());
            };
            let rotation = Rotation3::from_matrix_unchecked(Matrix3::new(a, b, c, d, e, f, g, h, i));
            let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
            Ok(Isometry3::from_parts(Translation3::new(x, y, z), rotation))
        })
        .collect()
}

fn numbers(text: &str) -> Result<Vec<f64>, std::num::ParseFloatError> {
    text.split_whitespace().map(str::parse).collect()
}
