use nalgebra::Isometry3;
use range_image::Raster;

/// What the camera would have measured without any error, and where it stood. The same for all frames of a station.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameTruth {
    /// Range along the ray of each pixel's centre, metre; NaN where it meets nothing.
    pub range: Raster<f32>,
    /// For each frequency: whole ambiguity intervals in the observed range, systematic range errors included and noise
    /// not, along the ray of the pixel's centre. Zero where that ray meets nothing.
    pub wraps: Vec<Raster<i32>>,
    /// For each frequency: amplitude of the pixel's light, mixed and by all paths, before scattering, noise and
    /// digitisation; in scaled sample units.
    pub amplitude: Vec<Raster<f32>>,
    /// Whether the pixel's rays leave the surface that its centre sees. All false with one ray a pixel.
    pub mixed: Raster<bool>,
    /// Index of the object that the pixel's centre sees.
    pub object: Raster<Option<u32>>,
    /// Pose of the camera.
    pub world_from_camera: Isometry3<f64>,
}
