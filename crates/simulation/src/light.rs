//! The light that a ray brings back: directly, and by way of one other surface.

use std::f64::consts::TAU;

use camera_model::Camera;
use nalgebra::{Point3, UnitVector3, Vector3};

use crate::scene::{Hit, Scene};
use crate::spec::camera::IlluminationSpec;
use crate::spec::errors::MultipathSpec;

/// Distance by which a secondary ray starts above its surface, far below any range's noise.
const LIFT_M: f64 = 1e-6;

/// Modulated light of one path: half the way from the source to the sensor, and its amplitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Path {
    pub range_m: f64,
    pub amplitude: f64,
}

/// All light of one pixel.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct PixelLight {
    pub paths: Vec<Path>,
    /// Mean of the samples.
    pub offset: f64,
}

impl PixelLight {
    pub fn clear(&mut self) {
        self.paths.clear();
        self.offset = 0.0;
    }

    fn add(&mut self, path: Path, contrast: f64) {
        self.paths.push(path);
        self.offset += path.amplitude / contrast;
    }
}

/// The source at the perspective centre, the light of the room, and what surfaces do with them.
pub(crate) struct Lighting {
    /// Amplitude of a white surface facing the camera at one metre, and mean of one in the room's light.
    source: f64,
    ambient: f64,
    contrast: f64,
    vignetting_exponent: f64,
    /// Unit directions about +z with the density of a cosine; empty without multipath.
    directions: Vec<Vector3<f64>>,
}

/// Where the camera stands, for the light that starts there.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Source {
    pub position: Point3<f64>,
    pub axis: Vector3<f64>,
}

impl Lighting {
    pub fn new(illumination: &IlluminationSpec, integration_time_s: f64, multipath: Option<&MultipathSpec>) -> Self {
        Self {
            source: illumination.source_power * integration_time_s,
            ambient: illumination.ambient_power * integration_time_s,
            contrast: illumination.modulation_contrast,
            vignetting_exponent: illumination.vignetting_exponent,
            directions: multipath.map_or_else(Vec::new, cosine_directions),
        }
    }

    /// Share of the light that reaches a pixel, falling off from the axis.
    pub fn vignetting(&self, camera: &Camera, pixel: [f64; 2]) -> f64 {
        if self.vignetting_exponent == 0.0 { 1.0 } else { (-camera.ray(pixel).z).powf(self.vignetting_exponent) }
    }

    /// The light of a path inside the camera and nothing else.
    pub fn only(&self, path: Path, light: &mut PixelLight) {
        light.clear();
        light.add(path, self.contrast);
    }

    /// Adds the light of one ray and where it ends; it counts for `share` of its pixel.
    pub fn gather(
        &self,
        scene: &Scene,
        source: &Source,
        ray: (&Vector3<f64>, &Hit),
        share: f64,
        light: &mut PixelLight,
    ) {
        let (direction, hit) = ray;
        light.offset += self.ambient * diffuse(hit.albedo) * share;
        let amplitude = self.source * hit.albedo * irradiance(hit, direction) * share;
        light.add(Path { range_m: hit.distance_m, amplitude }, self.contrast);
        if !self.directions.is_empty() {
            self.gather_bounced(scene, source, hit, share, light);
        }
    }

    /// Adds the light that surfaces around a point send on to it: with directions of cosine density, each brings the
    /// radiosity `albedo * irradiance` of the surface it meets, in equal shares.
    fn gather_bounced(&self, scene: &Scene, source: &Source, seen: &Hit, share: f64, light: &mut PixelLight) {
        let origin = seen.point + seen.normal * LIFT_M;
        let weight = self.source * diffuse(seen.albedo) * share / self.directions.len() as f64;
        let frame = tangent_frame(&seen.normal);
        for local in &self.directions {
            let direction = frame[0] * local.x + frame[1] * local.y + seen.normal * local.z;
            let Some(bounce) = scene.cast(&origin, &direction) else { continue };
            let Some((distance_m, lit)) = lighting_of(scene, source, &bounce) else { continue };
            let range_m = (distance_m + bounce.distance_m + seen.distance_m) / 2.0;
            light.add(Path { range_m, amplitude: weight * diffuse(bounce.albedo) * lit }, self.contrast);
        }
    }
}

/// Retro-reflective foil sends the source's light back to the source only; to all else it is a white surface at most.
fn diffuse(albedo: f64) -> f64 {
    albedo.min(1.0)
}

/// Light of the source on a surface that the source's ray met, relative to a facing surface at one metre.
fn irradiance(hit: &Hit, direction: &Vector3<f64>) -> f64 {
    -hit.normal.dot(direction) / (hit.distance_m * hit.distance_m)
}

/// Distance of a secondary surface from the source and its irradiance; `None` where the source does not light it:
/// it lies behind the camera, turns its other side, or something stands between.
fn lighting_of(scene: &Scene, source: &Source, bounce: &Hit) -> Option<(f64, f64)> {
    let above = bounce.point + bounce.normal * LIFT_M;
    let (direction, distance_m) = UnitVector3::try_new_and_get(source.position - above, 0.0)?;
    let cosine = bounce.normal.dot(&direction);
    let in_front = source.axis.dot(&direction) < 0.0;
    let lit = cosine > 0.0 && in_front && scene.is_clear(&above, &direction, distance_m);
    lit.then(|| (distance_m, cosine / (distance_m * distance_m)))
}

/// Two unit vectors that make a right-handed frame with the normal.
fn tangent_frame(normal: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let least = Vector3::ith(normal.iamin(), 1.0);
    let u = least.cross(normal).normalize();
    [u, normal.cross(&u)]
}

/// Evenly spread directions about +z with the density of a cosine: an additive recurrence of the plastic number over
/// the unit square, shifted by the seed and projected from the disc onto the hemisphere (Malley).
fn cosine_directions(spec: &MultipathSpec) -> Vec<Vector3<f64>> {
    const STEP: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
    let fraction = |key: u64| (key >> 11) as f64 / (1_u64 << 53) as f64;
    let shift = [0, 1].map(|axis| fraction(crate::random::mix(spec.seed, axis)));
    let direction = |index: usize| {
        let [s, t] = [0, 1].map(|axis| (shift[axis] + STEP[axis] * index as f64).fract());
        let (sin, cos) = (TAU * t).sin_cos();
        Vector3::new(s.sqrt() * cos, s.sqrt() * sin, (1.0 - s).sqrt())
    };
    (0..spec.directions).map(direction).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::spec::scene::{ObjectSpec, SceneSpec, ShapeSpec};

    fn rectangle(corner_m: [f64; 3], edge_u_m: [f64; 3], edge_v_m: [f64; 3], albedo: f64) -> ObjectSpec {
        let shape = ShapeSpec::Rectangle { corner_m, edge_u_m, edge_v_m };
        ObjectSpec { name: String::new(), shape, albedo, texture: None }
    }

    fn lighting(directions: usize) -> Lighting {
        let illumination = IlluminationSpec {
            source_power: 3.0,
            modulation_contrast: 0.5,
            ambient_power: 0.0,
            vignetting_exponent: 0.0,
        };
        Lighting::new(&illumination, 2.0, Some(&MultipathSpec { directions, seed: 3 }))
    }

    /// A floor at z = 0 and a wall at x = 0; the source looks down into the corner.
    fn corner(wall_albedo: f64) -> (Scene, Source) {
        let floor = rectangle([0.0, -2.0, 0.0], [3.0, 0.0, 0.0], [0.0, 4.0, 0.0], 0.5);
        let wall = rectangle([0.0, -2.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 2.0], wall_albedo);
        let source = Source { position: Point3::new(2.0, 0.0, 2.5), axis: Vector3::new(-1.0, 0.0, -1.0).normalize() };
        (Scene::new(&SceneSpec { objects: vec![floor, wall] }).unwrap(), source)
    }

    fn light_at(scene: &Scene, source: &Source, target: Point3<f64>, directions: usize) -> PixelLight {
        let direction = (target - source.position).normalize();
        let hit = scene.cast(&source.position, &direction).unwrap();
        let mut light = PixelLight::default();
        lighting(directions).gather(scene, source, (&direction, &hit), 1.0, &mut light);
        light
    }

    #[test]
    fn bounced_light_is_the_integral_over_the_wall() {
        let (scene, source) = corner(0.8);
        let target = Point3::new(0.6, 0.3, 0.0);
        let light = light_at(&scene, &source, target, 20_000);
        let sum = |f: &dyn Fn(&Path) -> f64| light.paths[1..].iter().map(f).sum::<f64>();
        let (amplitude, moment) = (sum(&|p| p.amplitude), sum(&|p| p.amplitude * p.range_m));
        // The same by patches of the wall: radiosity times the form factor cos cos / (pi d^2).
        let (steps, mut by_patches, mut by_patches_moment) = (400, 0.0, 0.0);
        for i in 0..steps {
            for j in 0..steps {
                let step = |k: usize, length: f64| (k as f64 + 0.5) / f64::from(steps as u32) * length;
                let patch = Point3::new(0.0, step(i, 4.0) - 2.0, step(j, 2.0));
                let (to_source, to_target) = (source.position - patch, target - patch);
                let (r, d) = (to_source.norm(), to_target.norm());
                let radiosity = 6.0 * 0.8 * to_source.x / r / (r * r);
                let form = (to_target.x / d) * (patch.z / d) / (std::f64::consts::PI * d * d);
                let share = 0.5 * radiosity * form * (4.0 * 2.0) / (steps * steps) as f64;
                by_patches += share;
                by_patches_moment += share * (r + d + (target - source.position).norm()) / 2.0;
            }
        }
        // 20 000 evenly spread directions: well below a percent, even at the wall's edges.
        assert!((amplitude / by_patches - 1.0).abs() < 0.005, "{amplitude} against {by_patches}");
        assert!((moment / by_patches_moment - 1.0).abs() < 0.005, "{moment} against {by_patches_moment}");
        assert!(amplitude > 0.02 * light.paths[0].amplitude, "the wall must matter");
    }

    #[test]
    fn direct_light_falls_with_the_square_of_range_and_the_cosine() {
        let (scene, source) = corner(0.8);
        let light = light_at(&scene, &source, Point3::new(1.0, 0.0, 0.0), 1);
        let range = (1.0_f64 + 2.5 * 2.5).sqrt();
        let expected = 6.0 * 0.5 * (2.5 / range) / (range * range);
        assert!((light.paths[0].amplitude - expected).abs() < 1e-12);
        assert!((light.paths[0].range_m - range).abs() < 1e-12);
        let total: f64 = light.paths.iter().map(|path| path.amplitude).sum();
        assert!((light.offset - 2.0 * total).abs() < 1e-12);
    }

    #[test]
    fn foil_lights_nothing_but_the_camera() {
        let amount = |albedo: f64| {
            let (scene, source) = corner(albedo);
            let light = light_at(&scene, &source, Point3::new(0.6, 0.0, 0.0), 500);
            light.paths[1..].iter().map(|path| path.amplitude).sum::<f64>()
        };
        assert!((amount(10.0) - amount(1.0)).abs() < 1e-12);
        assert!(amount(0.5) < 0.51 * amount(1.0));
    }

    #[test]
    fn a_wall_that_the_source_does_not_light_lights_nothing() {
        let (_, source) = corner(0.8);
        let floor = rectangle([0.0, -2.0, 0.0], [3.0, 0.0, 0.0], [0.0, 4.0, 0.0], 0.5);
        let wall = rectangle([0.0, -2.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 2.0], 0.8);
        // Black, and between the source and all of the wall.
        let screen = rectangle([0.5, -3.0, 0.4], [0.0, 6.0, 0.0], [0.0, 0.0, 3.0], 0.0);
        let bounced = |objects: Vec<ObjectSpec>| {
            let scene = Scene::new(&SceneSpec { objects }).unwrap();
            let light = light_at(&scene, &source, Point3::new(1.5, 0.0, 0.0), 2_000);
            light.paths[1..].iter().map(|path| path.amplitude).sum::<f64>()
        };
        assert!(bounced(vec![floor.clone(), wall.clone()]) > 1e-3);
        assert!(bounced(vec![floor, wall, screen]) < 1e-15);
    }

    #[test]
    fn directions_have_the_density_of_a_cosine() {
        let directions = cosine_directions(&MultipathSpec { directions: 10_000, seed: 11 });
        let mean = directions.iter().sum::<Vector3<f64>>() / 10_000.0;
        // The mean of cos under density cos / pi is 2/3. The sequence is far more even than random directions, whose
        // mean would be off by 0.002.
        assert!((mean - Vector3::z() * 2.0 / 3.0).norm() < 1e-3, "{mean}");
        assert!(directions.iter().all(|d| (d.norm() - 1.0).abs() < 1e-12 && d.z > 0.0));
    }
}
