//! Observed networks with known truth.

use nalgebra::{Isometry3, Point3, SMatrix, Vector3};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::functional_model::equations::world_from_passive;
use crate::functional_model::terms::{camera_from, camera_values};
use crate::{DistanceEnd, Error, Network, PassiveCamera, PassiveImagePoint, Result, Sighting};

/// What happens to the start values of poses and coordinates that are no control.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SimulatedStart {
    /// The truth.
    Truth,
    /// Disturbed at random.
    Disturbed {
        /// Standard deviation of each coordinate, metre.
        position_m: f64,
        /// Standard deviation of each turn, radian.
        attitude_rad: f64,
    },
    /// Left out: they have to be found.
    Absent,
}

/// How sightings are simulated.
#[derive(Debug, Clone, PartialEq)]
pub struct SightingOptions {
    /// Standard deviation of an image coordinate, pixel. Default: 0.05 pixel.
    pub sigma_pixel: f64,
    /// Standard deviation of a range, metre. Default: 0.01 m.
    pub sigma_range_m: f64,
    /// Standard deviation of an image coordinate of the passive camera, pixel. Default: 0.2 pixel.
    pub sigma_passive_pixel: f64,
    /// Seed of the random numbers. Default: 1.
    pub seed: u64,
    /// Share of image points and ranges, 0 to 1, that get a gross error of 20 to 50 standard deviations. Default: 0.
    pub gross_error_share: f64,
    /// Start values of poses and coordinates. Default: disturbed by 0.02 m and 0.01 rad.
    pub start: SimulatedStart,
    /// Amplitude of a target at 1 m, falling with the square of the distance; `None`, the default: no amplitudes.
    pub amplitude_at_1_m: Option<f64>,
    /// Darkest and brightest target relative to that amplitude; the others lie between, evenly in their logarithm and
    /// in no order. Without a spread, amplitude and range are one, and a hyperbola can't be told from range terms.
    /// Default: 1 for all.
    pub reflectance_span: [f64; 2],
}

impl Default for SightingOptions {
    /// 0.05 pixel, 10 mm, a passive camera of 0.2 pixel, seed 1, no gross errors, start values 2 cm and 0.6 degrees off.
    fn default() -> Self {
        Self {
            sigma_pixel: 0.05,
            sigma_range_m: 0.010,
            sigma_passive_pixel: 0.2,
            seed: 1,
            gross_error_share: 0.0,
            start: SimulatedStart::Disturbed { position_m: 0.02, attitude_rad: 0.01 },
            amplitude_at_1_m: None,
            reflectance_span: [1.0; 2],
        }
    }
}

/// Observes a network whose values are the truth: camera, range terms, poses and coordinates.
///
/// Sightings of the network say which target is seen from where and whether with a range, their observed values are
/// replaced; without any sighting each station sees all targets that fall into its image, with a range. The same goes for
/// the passive camera. Known distances, control and the calibration of a passive camera are observed as
/// well, with their own deviations. In the answer the
/// observations carry noise, the camera and the range terms are still the truth, and start values are as the options say.
///
/// # Errors
/// A station or target without truth ([`Error::NotReachable`]), a target that cannot be seen by the station that should,
/// options outside their domain.
pub fn simulate_sightings(network: &Network, options: &SightingOptions) -> Result<Network> {
    options.check()?;
    network.validate()?;
    simulated(network, options, 1.0)
}

/// What a network would observe without any errors. Standard deviations of image points and ranges are those of the
/// options.
pub fn exact_sightings(network: &Network, options: &SightingOptions) -> Result<Network> {
    options.check()?;
    let quiet = SightingOptions { gross_error_share: 0.0, start: SimulatedStart::Truth, ..options.clone() };
    simulated(network, &quiet, 0.0)
}

fn simulated(network: &Network, options: &SightingOptions, noise: f64) -> Result<Network> {
    let random = Pcg64::seed_from_u64(options.seed);
    let mut simulator = Simulator { truth: network, options, random, noise };
    let mut observed = network.clone();
    observed.sightings = simulator.sightings()?;
    if let Some(passive) = observed.passive.as_mut() {
        passive.image_points = simulator.passive_points()?;
        simulator.passive_calibration(passive);
    }
    for known in &mut observed.distances {
        known.distance_m = simulator.distance(known.from, known.to)? + known.sigma_m * simulator.normal();
    }
    simulator.control(&mut observed)?;
    simulator.start(&mut observed);
    Ok(observed)
}

impl SightingOptions {
    fn check(&self) -> Result<()> {
        let sigmas = [
            ("sigma_pixel", self.sigma_pixel),
            ("sigma_range_m", self.sigma_range_m),
            ("sigma_passive_pixel", self.sigma_passive_pixel),
        ];
        for (name, value) in sigmas {
            if !(value > 0.0 && value.is_finite()) {
                return Err(Error::OutOfDomain { name, value, expected: "a standard deviation is positive" });
            }
        }
        if let Some(&value) = self.reflectance_span.iter().find(|value| !(**value > 0.0 && value.is_finite())) {
            return Err(Error::OutOfDomain { name: "reflectance_span", value, expected: "a reflectance is positive" });
        }
        let value = self.gross_error_share;
        if (0.0..=1.0).contains(&value) {
            return Ok(());
        }
        Err(Error::OutOfDomain { name: "gross_error_share", value, expected: "a share is between 0 and 1" })
    }
}

impl SightingOptions {
    /// Relative reflectance of a target.
    fn reflectance(&self, target: usize) -> f64 {
        let [darkest, brightest] = self.reflectance_span;
        // Multiples of the golden section fill the unit interval evenly however many there are.
        let share = (target as f64 * 0.618_033_988_749_895).fract();
        darkest * (brightest / darkest).powf(share)
    }
}

struct Simulator<'n> {
    truth: &'n Network,
    options: &'n SightingOptions,
    random: Pcg64,
    /// Factor of all noise: 1, or 0 for exact observations.
    noise: f64,
}

impl Simulator<'_> {
    fn normal(&mut self) -> f64 {
        let drawn: f64 = StandardNormal.sample(&mut self.random);
        self.noise * drawn
    }

    fn vector(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.normal())
    }

    /// A gross error in standard deviations, or none.
    fn gross(&mut self) -> f64 {
        let [chance, size, side] = [0; 3].map(|_| self.random.random::<f64>());
        let size = (20.0 + 30.0 * size).copysign(side - 0.5);
        if chance < self.options.gross_error_share { size } else { 0.0 }
    }

    fn pose(&self, station: usize) -> Result<Isometry3<f64>> {
        let truth = &self.truth.stations[station];
        truth.world_from_camera.ok_or_else(|| missing("station", &truth.name))
    }

    fn point(&self, target: usize) -> Result<Point3<f64>> {
        let truth = &self.truth.targets[target];
        truth.point.ok_or_else(|| missing("target", &truth.name))
    }

    fn distance(&self, from: DistanceEnd, to: DistanceEnd) -> Result<f64> {
        let end = |end| -> Result<Vector3<f64>> {
            match end {
                DistanceEnd::Station(station) => Ok(self.pose(station)?.translation.vector),
                DistanceEnd::Target(target) => Ok(self.point(target)?.coords),
            }
        };
        Ok((end(to)? - end(from)?).norm())
    }

    fn sightings(&mut self) -> Result<Vec<Sighting>> {
        let mut out = Vec::new();
        for planned in planned_sightings(self.truth)? {
            out.push(self.observe(planned)?);
        }
        Ok(out)
    }

    /// Observes what a planned sighting asks for: without an image point or a range it stays without.
    fn observe(&mut self, planned: Sighting) -> Result<Sighting> {
        let (truth, options) = (self.truth, self.options);
        let (pose, point) = (self.pose(planned.station)?, self.point(planned.target)?);
        let seen = truth.camera.observe(&pose, &point)?;
        let reflectance = options.reflectance(planned.target);
        let amplitude = options.amplitude_at_1_m.map(|at_1_m| at_1_m * reflectance / (seen.range_m * seen.range_m));
        let amplitude = amplitude.or(planned.amplitude);
        let [xp, yp] = truth.camera.interior.principal_point_mm;
        let [x, y] = seen.image_mm;
        let with_drift = seen.range_m + truth.stations[planned.station].drift_m;
        let range_m = truth.range_model.observed_range(with_drift, x - xp, y - yp, amplitude.unwrap_or(f64::NAN))?;
        let exact = truth.camera.format.pixel_from_image(seen.image_mm);
        // The same random numbers are drawn whatever is kept, so that networks stay comparable.
        let gross = [self.gross(), self.gross()];
        let direction = std::f64::consts::TAU * self.random.random::<f64>();
        let noise = [self.normal(), self.normal()];
        let pixel_off_by = |gross: f64| {
            let gross = [gross * direction.cos(), gross * direction.sin()];
            [0, 1].map(|axis| exact[axis] + options.sigma_pixel * (noise[axis] + gross[axis]))
        };
        // A gross error that leads out of the image would have been noticed: it leads the other way.
        let pixel = Some(pixel_off_by(gross[0])).filter(|pixel| truth.camera.contains(*pixel));
        let pixel = pixel.unwrap_or_else(|| pixel_off_by(if gross[0] == 0.0 { 0.0 } else { -gross[0] }));
        let range_m = range_m + options.sigma_range_m * (self.normal() + gross[1]);
        Ok(Sighting {
            pixel: planned.pixel.map(|_| pixel),
            sigma_pixel: [options.sigma_pixel; 2],
            range_m: planned.range_m.map(|_| range_m),
            sigma_range_m: options.sigma_range_m,
            amplitude,
            ..planned
        })
    }

    fn passive_points(&mut self) -> Result<Vec<PassiveImagePoint>> {
        let Some(passive) = &self.truth.passive else { return Ok(Vec::new()) };
        let relative = passive.range_camera_from_passive.ok_or_else(|| missing("camera", "passive"))?;
        let mut out = Vec::new();
        for (station, target) in planned_passive(self.truth)? {
            let pose = world_from_passive(&self.pose(station)?, &relative);
            let seen = passive.camera.observe(&pose, &self.point(target)?)?;
            let exact = passive.camera.format.pixel_from_image(seen.image_mm);
            let sigma = self.options.sigma_passive_pixel;
            let gross = self.gross();
            let pixel = [exact[0] + sigma * (self.normal() + gross), exact[1] + sigma * self.normal()];
            out.push(PassiveImagePoint { station, target, pixel, sigma_pixel: [sigma; 2] });
        }
        Ok(out)
    }

    /// The calibration of the passive camera is drawn from its covariance around the truth. Parameters of zero variance
    /// stay as they are.
    fn passive_calibration(&mut self, passive: &mut PassiveCamera) {
        let Some(covariance) = passive.covariance else { return };
        // The root by eigenvalues allows for parameters without variance.
        let scale = covariance.diagonal().map(|variance| if variance > 0.0 { variance.sqrt() } else { 1.0 });
        let scaled =
            SMatrix::<f64, 10, 10>::from_fn(|row, column| covariance[(row, column)] / (scale[row] * scale[column]));
        let eigen = scaled.symmetric_eigen();
        let drawn = eigen.eigenvalues.map(|value| value.max(0.0).sqrt() * self.normal());
        let error = (eigen.eigenvectors * drawn).component_mul(&scale);
        let moved: Vec<f64> = camera_values(&passive.camera)
            .into_iter()
            .enumerate()
            .map(|(i, v)| v + error.get(i).unwrap_or(&0.0))
            .collect();
        passive.camera = camera_from(&passive.camera, &moved).unwrap_or(passive.camera);
    }

    /// Control is observed: its values are drawn from their covariance around the truth.
    fn control(&mut self, observed: &mut Network) -> Result<()> {
        for target in &mut observed.targets {
            if let (Some(covariance), Some(point)) = (target.covariance, target.point) {
                let factor = covariance.cholesky().ok_or_else(|| missing("target", &target.name))?.l();
                target.point = Some(point + factor * self.vector());
            }
        }
        for station in &mut observed.stations {
            if let (Some(covariance), Some(pose)) = (station.covariance, station.world_from_camera) {
                let factor = covariance.cholesky().ok_or_else(|| missing("station", &station.name))?.l();
                let step = factor * nalgebra::Vector6::from_fn(|_, _| self.normal());
                station.world_from_camera = Some(camera_model::step_pose(&pose, &step.into()));
            }
        }
        Ok(())
    }

    fn start(&mut self, observed: &mut Network) {
        let SimulatedStart::Disturbed { position_m, attitude_rad } = self.options.start else {
            if self.options.start == SimulatedStart::Absent {
                let free_stations = observed.stations.iter_mut().filter(|station| station.covariance.is_none());
                free_stations.for_each(|station| station.world_from_camera = None);
                let free_targets = observed.targets.iter_mut().filter(|target| target.covariance.is_none());
                free_targets.for_each(|target| target.point = None);
            }
            return;
        };
        for station in observed.stations.iter_mut().filter(|station| station.covariance.is_none()) {
            let (shift, turn) = (self.vector() * position_m, self.vector() * attitude_rad);
            let step = [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z];
            station.world_from_camera = station.world_from_camera.map(|pose| camera_model::step_pose(&pose, &step));
        }
        for target in observed.targets.iter_mut().filter(|target| target.covariance.is_none()) {
            let shift = self.vector() * position_m;
            target.point = target.point.map(|point| point + shift);
        }
    }
}

fn missing(kind: &'static str, name: &str) -> Error {
    Error::NotReachable { kind, name: name.to_owned(), reason: "a simulation needs its true place".to_owned() }
}

/// The sightings of a network, or, where it has none, all targets in the image of each station, with ranges.
pub fn planned_sightings(network: &Network) -> Result<Vec<Sighting>> {
    if !network.sightings.is_empty() {
        return Ok(network.sightings.clone());
    }
    let mut out = Vec::new();
    for station in 0..network.stations.len() {
        for target in 0..network.targets.len() {
            if let Some(pixel) = visible(network, station, target)? {
                out.push(Sighting {
                    station,
                    target,
                    pixel: Some(pixel),
                    sigma_pixel: [1.0; 2],
                    range_m: Some(1.0),
                    sigma_range_m: 1.0,
                    amplitude: None,
                });
            }
        }
    }
    Ok(out)
}

/// Where a target falls into the image of a station.
fn visible(network: &Network, station: usize, target: usize) -> Result<Option<[f64; 2]>> {
    let (station, target) = (&network.stations[station], &network.targets[target]);
    let pose = station.world_from_camera.ok_or_else(|| missing("station", &station.name))?;
    let point = target.point.ok_or_else(|| missing("target", &target.name))?;
    let pixel = network.camera.project(&pose.inverse_transform_point(&point));
    // What the lens model cannot project is not in the image.
    Ok(pixel.ok().filter(|pixel| network.camera.contains(*pixel)))
}

/// Stations and targets of the passive image points; all that fall into its image where none is planned.
fn planned_passive(network: &Network) -> Result<Vec<(usize, usize)>> {
    let Some(passive) = &network.passive else { return Ok(Vec::new()) };
    if !passive.image_points.is_empty() {
        return Ok(passive.image_points.iter().map(|seen| (seen.station, seen.target)).collect());
    }
    let relative = passive.range_camera_from_passive.ok_or_else(|| missing("camera", "passive"))?;
    let mut out = Vec::new();
    for (index, station) in network.stations.iter().enumerate() {
        let pose = station.world_from_camera.ok_or_else(|| missing("station", &station.name))?;
        let pose = world_from_passive(&pose, &relative);
        for (number, target) in network.targets.iter().enumerate() {
            let point = target.point.ok_or_else(|| missing("target", &target.name))?;
            let pixel = passive.camera.project(&pose.inverse_transform_point(&point));
            if pixel.is_ok_and(|pixel| passive.camera.contains(pixel)) {
                out.push((index, number));
            }
        }
    }
    Ok(out)
}
