//! Two white walls meet in a corner: what multipath does to the ranges there, and what is found of it.
#![allow(clippy::print_stdout)]

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use multipath::{
    AlbedoScale, DetectionOptions, FrequencyResponse, RiskOptions, TwoPathOptions, Verdict, assess_risk, detect,
    solve_two_paths,
};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::{ComplexChannel, ComplexFrame, Flags, Modulation, RangeFrame, Raster};

const WIDTH: usize = 88;
const HEIGHT: usize = 64;
const FOCAL_PX: f64 = 80.0;
const ALBEDO: f64 = 0.6;
const WHITE: f64 = 20_000.0;
const SIGMA: f64 = 3.0;
const FREQUENCIES: [f64; 3] = [20e6, 50e6, 80e6];

type Vec3 = [f64; 3];

fn dot(a: &Vec3, b: &Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// A point on one of the walls, with all that light needs to know of it.
struct Point {
    at: Vec3,
    direction: Vec3,
    normal: Vec3,
    range: f64,
    irradiance: f64,
    /// Area that its pixel sees.
    area: f64,
}

/// The walls `z = |x| - 3`, seen from the origin along -z.
fn points() -> Vec<Point> {
    let point = |index: usize| {
        let x = ((index % WIDTH) as f64 - (WIDTH as f64 - 1.0) / 2.0) / FOCAL_PX;
        let y = ((HEIGHT as f64 - 1.0) / 2.0 - (index / WIDTH) as f64) / FOCAL_PX;
        let length = (x * x + y * y + 1.0).sqrt();
        let direction = [x / length, y / length, -1.0 / length];
        let normal = [-x.signum() * FRAC_1_SQRT_2, 0.0, FRAC_1_SQRT_2];
        let cosine = -dot(&normal, &direction);
        let range = 3.0 * FRAC_1_SQRT_2 / cosine;
        let solid_angle = 1.0 / (FOCAL_PX * FOCAL_PX * length.powi(3));
        Point {
            at: direction.map(|component| component * range),
            direction,
            normal,
            range,
            irradiance: cosine / (range * range),
            area: solid_angle * range * range / cosine,
        }
    };
    (0..WIDTH * HEIGHT).map(point).collect()
}

/// Complex values of direct and bounced light at all frequencies, without noise.
fn light(points: &[Point], receiver: &Point, wavenumbers: [f64; 3]) -> [[f64; 2]; 3] {
    let polar = |amplitude: f64, phase: f64| [amplitude * phase.cos(), amplitude * phase.sin()];
    let mut z = wavenumbers.map(|k| polar(receiver.irradiance, k * receiver.range));
    for emitter in points {
        let way: Vec3 = std::array::from_fn(|axis| emitter.at[axis] - receiver.at[axis]);
        let (leaving, arriving) = (-dot(&emitter.normal, &way), dot(&receiver.normal, &way));
        if leaving <= 1e-9 || arriving <= 1e-9 {
            continue;
        }
        let square = dot(&way, &way);
        let form = leaving * arriving / square * emitter.area / (PI * square + emitter.area);
        let range = (emitter.range + square.sqrt() + receiver.range) / 2.0;
        for (z, k) in z.iter_mut().zip(wavenumbers) {
            let bounced = polar(ALBEDO * emitter.irradiance * form, k * range);
            *z = [z[0] + bounced[0], z[1] + bounced[1]];
        }
    }
    z.map(|z| z.map(|part| WHITE * ALBEDO * part))
}

fn capture(points: &[Point]) -> Result<ComplexFrame, range_image::Error> {
    let modulations = FREQUENCIES.map(Modulation::new);
    let mut random = Pcg64::seed_from_u64(1);
    let mut wavenumbers = [0.0; 3];
    for (k, modulation) in wavenumbers.iter_mut().zip(&modulations) {
        *k = modulation.clone()?.phase_from_range(1.0);
    }
    let z: Vec<_> = points.iter().map(|receiver| light(points, receiver, wavenumbers)).collect();
    let channels = modulations.into_iter().enumerate().map(|(f, modulation)| {
        let mut plane = |part: usize| {
            let noisy = |z: &[[f64; 2]; 3]| {
                let noise: f64 = StandardNormal.sample(&mut random);
                (z[f][part] + SIGMA * noise) as f32
            };
            Raster::from_vec(WIDTH, HEIGHT, z.iter().map(noisy).collect())
        };
        let (real, imaginary) = (plane(0)?, plane(1)?);
        let sigma = Raster::filled(WIDTH, HEIGHT, SIGMA as f32);
        Ok(ComplexChannel { modulation: modulation?, real, imaginary, offset: None, sigma })
    });
    Ok(ComplexFrame {
        channels: channels.collect::<Result<_, _>>()?,
        flags: Raster::filled(WIDTH, HEIGHT, Flags::empty()),
    })
}

fn main() -> Result<(), multipath::Error> {
    let points = points();
    let mut complex = capture(&points)?;
    // All ranges are below the 7.5 m of 20 MHz, whose range stands for the unwrapped one.
    let coarse = &complex.channels[0];
    let range = coarse.phase().map(|phase| coarse.modulation.range_from_phase(f64::from(*phase)) as f32);
    let highest = &complex.channels[2];
    let shown: Vec<f64> = (range.as_slice().iter().zip(highest.phase().as_slice()))
        .map(|(range, phase)| {
            let fraction = highest.modulation.range_from_phase(f64::from(*phase));
            let interval = highest.modulation.ambiguity_interval_m();
            fraction + interval * ((f64::from(*range) - fraction) / interval).round()
        })
        .collect();
    let mut frame = RangeFrame {
        range: Raster::from_vec(WIDTH, HEIGHT, shown.iter().map(|range| *range as f32).collect())?,
        sigma: highest.sigma_range(),
        amplitude: highest.amplitude(),
        flags: complex.flags.clone(),
    };
    let response = FrequencyResponse::flat(3);
    let detection = detect(&mut complex, &range, &response, &DetectionOptions::default())?;
    let solved = solve_two_paths(&complex, &response, &TwoPathOptions::default())?;
    let directions: Vec<Vec3> = points.iter().map(|point| point.direction).collect();
    let options = RiskOptions {
        modulation_hz: Some(FREQUENCIES[2]),
        albedo: AlbedoScale::WhiteAtOneMetre(WHITE),
        ..RiskOptions::default()
    };
    let risk = assess_risk(&mut frame, &directions, &options)?;

    println!(
        "{} of {} pixels contradict themselves; {} are at risk",
        detection.flagged, detection.tested, risk.flagged
    );
    for verdict in [Verdict::Single, Verdict::Two, Verdict::Ambiguous, Verdict::Unresolved, Verdict::Inconsistent] {
        println!("{verdict:?}: {}", solved.count(verdict));
    }
    println!("\nfrom the edge m   error at 80 MHz mm   risk mm   statistic   verdict        error of r1 mm");
    for col in (WIDTH / 2..WIDTH).step_by(4) {
        let index = HEIGHT / 2 * WIDTH + col;
        let (point, paths) = (&points[index], solved.paths.as_slice()[index]);
        println!(
            "{:15.2}   {:18.1}   {:7.1}   {:9.0}   {:12}   {:14.1}",
            point.at[0] / FRAC_1_SQRT_2,
            1e3 * (shown[index] - point.range),
            1e3 * risk.risk_m.as_slice()[index],
            detection.statistic.as_slice()[index],
            format!("{:?}", paths.verdict),
            1e3 * (f64::from(paths.direct_m) - point.range),
        );
    }
    Ok(())
}
