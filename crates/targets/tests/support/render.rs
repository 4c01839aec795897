//! What an ideal sensor sees of planes with patterns: lens, pose, blur and light, without noise.

use range_image::Raster;
use targets::camera_model::Camera;
use targets::nalgebra::{Isometry3, Point3};

/// Samples of a pixel along each axis.
const SAMPLES: usize = 4;

/// A pattern on the plane z = 0 of its frame.
pub trait Pattern {
    /// Mean reflectance over the footprint of a sample at (x, y), metre; `footprint` is how x and y change from sample to
    /// sample along columns and along rows. `None` where the plane ends.
    fn reflectance(&self, at: [f64; 2], footprint: [[f64; 2]; 2]) -> Option<f64>;
}

/// A pattern somewhere in the world.
pub struct Plane<'a> {
    pub world_from_plane: Isometry3<f64>,
    pub pattern: &'a dyn Pattern,
}

/// What the light does on its way.
pub struct Optics<'a> {
    /// Deviation of the Gaussian blur, pixel.
    pub blur_px: f64,
    /// Share of the light that is lost in the corners against the centre; it falls with the square of the distance.
    pub vignetting: f64,
    /// Reflectance where no plane is.
    pub background: f64,
    /// Reflectance of what is before the planes, by pixel position.
    pub before: &'a dyn Fn([f64; 2]) -> Option<f64>,
}

impl Default for Optics<'_> {
    fn default() -> Self {
        Self { blur_px: 0.7, vignetting: 0.0, background: 0.3, before: &|_| None }
    }
}

/// Light of each pixel: reflectance times illumination, the mean over the pixel. Planes in front come first.
pub fn render(
    camera: &Camera,
    world_from_camera: &Isometry3<f64>,
    planes: &[Plane<'_>],
    optics: &Optics<'_>,
) -> Raster<f32> {
    let margin = (3.0 * optics.blur_px).ceil() as usize + 1;
    let (width, height) = (camera.format.width, camera.format.height);
    let fine = [width, height].map(|size| (size + 2 * margin) * SAMPLES);
    let position = |index: usize| (index as f64 + 0.5) / SAMPLES as f64 - margin as f64 - 0.5;
    let plane_from_camera: Vec<_> =
        planes.iter().map(|plane| plane.world_from_plane.inv_mul(world_from_camera)).collect();
    // Where the ray of each sample of a row meets each plane.
    let hits = |row: f64| -> Vec<Vec<Option<[f64; 2]>>> {
        let on_plane =
            |pose: &Isometry3<f64>| (0..=fine[0]).map(|col| hit(camera, pose, [position(col), row])).collect();
        plane_from_camera.iter().map(on_plane).collect()
    };
    // Square of the distance of a corner from the centre.
    let corner = 0.25 * ((width * width + height * height) as f64);
    let centre = [0.5 * (width as f64 - 1.0), 0.5 * (height as f64 - 1.0)];
    let mut samples = Vec::with_capacity(fine[0] * fine[1]);
    let mut above = hits(position(0));
    for row in 0..fine[1] {
        let below = hits(position(row + 1));
        for col in 0..fine[0] {
            let pixel = [position(col), position(row)];
            let off_centre = [pixel[0] - centre[0], pixel[1] - centre[1]];
            let lost = optics.vignetting * (off_centre[0] * off_centre[0] + off_centre[1] * off_centre[1]) / corner;
            let seen = (0..planes.len()).find_map(|plane| {
                let (here, right, down) = (above[plane][col]?, above[plane][col + 1]?, below[plane][col]?);
                let footprint = [[right[0] - here[0], right[1] - here[1]], [down[0] - here[0], down[1] - here[1]]];
                planes[plane].pattern.reflectance(here, footprint)
            });
            let reflectance = (optics.before)(pixel).or(seen).unwrap_or(optics.background);
            samples.push((reflectance * (1.0 - lost)) as f32);
        }
        above = below;
    }
    let blurred = blur(samples, fine, optics.blur_px * SAMPLES as f64);
    Raster::from_fn(width, height, |col, row| {
        let start = [(col + margin) * SAMPLES, (row + margin) * SAMPLES];
        let row_sum = |row: usize| blurred[(start[1] + row) * fine[0] + start[0]..][..SAMPLES].iter().sum::<f32>();
        (0..SAMPLES).map(row_sum).sum::<f32>() / (SAMPLES * SAMPLES) as f32
    })
}

/// Where the ray of a pixel position meets the plane z = 0, in front of the camera.
fn hit(camera: &Camera, plane_from_camera: &Isometry3<f64>, pixel: [f64; 2]) -> Option<[f64; 2]> {
    let [x, y] = camera.corrected_image_point(camera.format.image_from_pixel(pixel));
    let [xp, yp] = camera.interior.principal_point_mm;
    let direction = targets::nalgebra::Vector3::new(x - xp, y - yp, -camera.interior.principal_distance_mm);
    let direction = plane_from_camera.rotation * direction;
    let from: Point3<f64> = plane_from_camera.translation.vector.into();
    let distance = -from.z / direction.z;
    (distance > 0.0).then(|| [from.x + distance * direction.x, from.y + distance * direction.y])
}

/// Convolves with a Gaussian, samples beyond the rim as those at it.
fn blur(samples: Vec<f32>, [width, height]: [usize; 2], sigma: f64) -> Vec<f32> {
    if sigma <= 0.0 {
        return samples;
    }
    let reach = (4.0 * sigma).ceil() as isize;
    let raw: Vec<f64> = (-reach..=reach).map(|k| (-0.5 * (k as f64 / sigma).powi(2)).exp()).collect();
    let sum: f64 = raw.iter().sum();
    let weights: Vec<f32> = raw.iter().map(|weight| (weight / sum) as f32).collect();
    let at = |index: isize, size: usize| index.clamp(0, size as isize - 1) as usize;
    let mut rows = vec![0.0_f32; samples.len()];
    for (from, to) in samples.chunks_exact(width).zip(rows.chunks_exact_mut(width)) {
        let padded: Vec<f32> = (-reach..width as isize + reach).map(|k| from[at(k, width)]).collect();
        for (k, weight) in weights.iter().enumerate() {
            to.iter_mut().zip(&padded[k..]).for_each(|(to, from)| *to += weight * from);
        }
    }
    let mut out = vec![0.0_f32; samples.len()];
    for (row, to) in out.chunks_exact_mut(width).enumerate() {
        for (k, weight) in weights.iter().enumerate() {
            let from = at(row as isize + k as isize - reach, height) * width;
            to.iter_mut().zip(&rows[from..from + width]).for_each(|(to, from)| *to += weight * from);
        }
    }
    out
}
