//! From the scene to the noise-free image of one station, row by row.

use std::f64::consts::TAU;

use camera_model::Camera;
use error_models::{FixedPattern, InterpolatedModel};
use nalgebra::{Isometry3, Point3, Vector3};
use range_image::{ImageFormat, Raster};
use rayon::prelude::*;

use crate::light::{Lighting, Path, PixelLight, Source};
use crate::scene::{Hit, Scene};
use crate::spec::camera::ReferencePathSpec;
use crate::spec::errors::MixedPixelsSpec;
use crate::{FrameTruth, Result};

/// One frequency as the renderer sees it.
#[derive(Clone)]
pub(crate) struct Channel {
    pub ambiguity_interval_m: f64,
    pub model: Option<InterpolatedModel>,
}

/// The image of one station without scattering and noise.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Image {
    /// Real and imaginary part for each frequency.
    pub channels: Vec<[Vec<f32>; 2]>,
    /// Mean sample.
    pub offset: Vec<f32>,
}

/// All that a row needs, the same for all rows.
pub(crate) struct Renderer<'a> {
    pub scene: &'a Scene,
    pub camera: &'a Camera,
    pub lighting: &'a Lighting,
    pub channels: &'a [Channel],
    pub pattern: Option<&'a FixedPattern>,
    pub mixed_pixels: Option<MixedPixelsSpec>,
    pub reference: Option<Reference>,
    pub world_from_camera: Isometry3<f64>,
}

/// Pixels that see a path inside the camera.
#[derive(Clone, Copy)]
pub(crate) struct Reference {
    pub spec: ReferencePathSpec,
    pub amplitude: f64,
}

/// One pixel of the result.
struct Pixel {
    range: f32,
    mixed: bool,
    object: Option<u32>,
    offset: f32,
    signals: Vec<Signal>,
}

/// One pixel at one frequency.
#[derive(Clone, Copy, Default)]
struct Signal {
    real: f32,
    imaginary: f32,
    amplitude: f32,
    wraps: i32,
}

impl Renderer<'_> {
    /// Renders all rows; which thread takes which makes no difference.
    pub fn render(&self) -> Result<(Image, FrameTruth)> {
        let ImageFormat { width, height, .. } = self.camera.format;
        let rows: Vec<Result<Vec<Pixel>>> = (0..height).into_par_iter().map(|row| self.row(row, width)).collect();
        let mut pixels = Vec::with_capacity(width * height);
        for row in rows {
            pixels.extend(row?);
        }
        Ok((self.image(&pixels), self.truth(&pixels)?))
    }

    fn row(&self, row: usize, width: usize) -> Result<Vec<Pixel>> {
        let mut light = PixelLight::default();
        (0..width).map(|col| self.pixel(col, row, &mut light)).collect()
    }

    fn pixel(&self, col: usize, row: usize, light: &mut PixelLight) -> Result<Pixel> {
        if let Some(Reference { spec, amplitude }) = self.reference.filter(|there| there.spec.contains([col, row])) {
            self.lighting.only(Path { range_m: spec.length_m, amplitude }, light);
            let signals = self.signals([col, row], Some(spec.length_m), light)?;
            return Ok(Pixel { range: f32::NAN, mixed: false, object: None, offset: light.offset as f32, signals });
        }
        let center = [col as f64, row as f64];
        let axis = self.cast(center);
        let (_, seen) = axis;
        let mixed = self.gather(center, &axis, light);
        let signals = self.signals([col, row], seen.map(|hit| hit.distance_m), light)?;
        Ok(Pixel {
            range: seen.map_or(f32::NAN, |hit| hit.distance_m as f32),
            mixed,
            object: seen.map(|hit| hit.object),
            offset: light.offset as f32,
            signals,
        })
    }

    fn signals(&self, pixel: [usize; 2], range_m: Option<f64>, light: &PixelLight) -> Result<Vec<Signal>> {
        self.channels.iter().map(|channel| self.signal(channel, pixel, range_m, light)).collect()
    }

    fn origin(&self) -> Point3<f64> {
        Point3::from(self.world_from_camera.translation.vector)
    }

    fn cast(&self, pixel: [f64; 2]) -> (Vector3<f64>, Option<Hit>) {
        let direction = self.world_from_camera * self.camera.ray(pixel);
        (direction, self.scene.cast(&self.origin(), &direction))
    }

    /// Collects the light of all rays of a pixel; answers whether they leave the surface seen at its centre.
    fn gather(&self, center: [f64; 2], axis: &(Vector3<f64>, Option<Hit>), light: &mut PixelLight) -> bool {
        light.clear();
        let source = Source { position: self.origin(), axis: self.world_from_camera * -Vector3::z() };
        let (side, threshold_m) =
            self.mixed_pixels.map_or((1, f64::INFINITY), |m| (m.rays_per_pixel_side, m.threshold_m));
        let share = self.lighting.vignetting(self.camera, center) / (side * side) as f64;
        let step = |index: usize| (index as f64 + 0.5) / side as f64 - 0.5;
        let mut mixed = false;
        for index in 0..side * side {
            let place = [center[0] + step(index % side), center[1] + step(index / side)];
            let (direction, hit) = if side == 1 { *axis } else { self.cast(place) };
            if let Some(hit) = &hit {
                self.lighting.gather(self.scene, &source, (&direction, hit), share, light);
            }
            mixed |= side > 1 && leaves_surface(&self.origin(), &direction, axis.1.as_ref(), hit.as_ref(), threshold_m);
        }
        mixed
    }

    /// Adds the paths up as complex numbers, each with the phase of the range that the camera shows for it.
    fn signal(
        &self,
        channel: &Channel,
        [col, row]: [usize; 2],
        range_m: Option<f64>,
        light: &PixelLight,
    ) -> Result<Signal> {
        let per_metre = TAU / channel.ambiguity_interval_m;
        let sum = |observed: &dyn Fn(f64) -> Result<f64>| -> Result<[f64; 2]> {
            light.paths.iter().try_fold([0.0, 0.0], |[re, im], path| {
                let (sin, cos) = (per_metre * observed(path.range_m)?).sin_cos();
                Ok([re + path.amplitude * cos, im + path.amplitude * sin])
            })
        };
        // The range errors depend on the pixel's amplitude, which is that of its light without them.
        let [re, im] = sum(&|range_m| Ok(range_m))?;
        let amplitude = re.hypot(im);
        let observed = |range_m: f64| self.observed_range(channel, [col, row], range_m, amplitude);
        let [re, im] = if channel.model.is_some() || self.pattern.is_some() { sum(&observed)? } else { [re, im] };
        let wraps = range_m.map_or(Ok(0.0), observed)? / channel.ambiguity_interval_m;
        Ok(Signal { real: re as f32, imaginary: im as f32, amplitude: amplitude as f32, wraps: wraps.floor() as i32 })
    }

    fn observed_range(&self, channel: &Channel, [col, row]: [usize; 2], range_m: f64, amplitude: f64) -> Result<f64> {
        let pattern_m = self.pattern.and_then(|p| p.offset_m.get(row * p.width + col)).map_or(0.0, |v| f64::from(*v));
        let true_m = range_m + pattern_m;
        let Some(model) = &channel.model else { return Ok(true_m) };
        let [xp, yp] = self.camera.interior.principal_point_mm;
        let [x, y] = self.camera.format.image_from_pixel([col as f64, row as f64]);
        Ok(model.observed_range(true_m, x - xp, y - yp, amplitude)?)
    }

    fn image(&self, pixels: &[Pixel]) -> Image {
        let plane = |value: &dyn Fn(&Pixel) -> f32| pixels.iter().map(value).collect::<Vec<f32>>();
        let parts = |i: usize| [plane(&|p| p.signals[i].real), plane(&|p| p.signals[i].imaginary)];
        Image { channels: (0..self.channels.len()).map(parts).collect(), offset: plane(&|p| p.offset) }
    }

    fn truth(&self, pixels: &[Pixel]) -> Result<FrameTruth> {
        let ImageFormat { width, height, .. } = self.camera.format;
        let channels = 0..self.channels.len();
        let wraps = |i: usize| raster(width, height, pixels, |p| p.signals[i].wraps);
        let amplitude = |i: usize| raster(width, height, pixels, |p| p.signals[i].amplitude);
        Ok(FrameTruth {
            range: raster(width, height, pixels, |p| p.range)?,
            wraps: channels.clone().map(wraps).collect::<Result<_>>()?,
            amplitude: channels.map(amplitude).collect::<Result<_>>()?,
            mixed: raster(width, height, pixels, |p| p.mixed)?,
            object: raster(width, height, pixels, |p| p.object)?,
            world_from_camera: self.world_from_camera,
        })
    }
}

fn raster<T>(width: usize, height: usize, pixels: &[Pixel], value: impl Fn(&Pixel) -> T) -> Result<Raster<T>> {
    Ok(Raster::from_vec(width, height, pixels.iter().map(value).collect())?)
}

/// Whether a ray ends further than a threshold from the plane that touches the surface seen at the pixel's centre.
///
/// A wall seen at a grazing angle spreads its ranges over a pixel too; that is no mixture, since they all follow from
/// one plane.
fn leaves_surface(
    origin: &Point3<f64>,
    direction: &Vector3<f64>,
    seen: Option<&Hit>,
    hit: Option<&Hit>,
    threshold_m: f64,
) -> bool {
    match (seen, hit) {
        (None, None) => false,
        (Some(seen), Some(hit)) => {
            let falling = seen.normal.dot(direction);
            let on_plane_m = seen.normal.dot(&(seen.point - origin)) / falling;
            falling >= 0.0 || (hit.distance_m - on_plane_m).abs() > threshold_m
        }
        _ => true,
    }
}
