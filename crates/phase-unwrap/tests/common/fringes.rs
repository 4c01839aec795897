//! Noisy fringes of known counts: ramps in all directions, hills, jumps and holes.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::Raster;

/// Wrapped phase of a surface with noise, NaN where there is a hole, and the counts of truth plus noise.
pub struct Fringes {
    /// Radians in `[0, 2 pi]`.
    pub phase: Raster<f32>,
    /// What a user would get by measuring without wrapping.
    pub wraps: Raster<i32>,
}

/// Unwrapped phase in radians at a column and a row; NaN is a hole.
pub type Surface = dyn Fn(f64, f64) -> f64;

impl Fringes {
    /// A surface under normal noise of `sigma_rad`.
    pub fn new(size: [usize; 2], surface: &Surface, sigma_rad: f64, seed: u64) -> Self {
        let mut rng = Pcg64::seed_from_u64(seed);
        let noisy = Raster::from_fn(size[0], size[1], |col, row| {
            let noise: f64 = StandardNormal.sample(&mut rng);
            surface(col as f64, row as f64) + sigma_rad * noise
        });
        // The smaller of NaN and a number is the number: `clamp` keeps NaN.
        let phase = noisy.map(|value| (value.rem_euclid(TAU) as f32).clamp(0.0, std::f32::consts::TAU));
        Self { phase, wraps: noisy.map(|value| value.div_euclid(TAU) as i32) }
    }

    /// Share of the pixels outside holes whose count is right, up to the whole offset of most of them.
    pub fn right(&self, found: &Raster<i32>) -> f64 {
        let mut offsets = BTreeMap::new();
        let pixels = found.as_slice().iter().zip(self.wraps.as_slice()).zip(self.phase.as_slice());
        for ((found, truth), _) in pixels.filter(|(_, phase)| phase.is_finite()) {
            *offsets.entry(found - truth).or_insert(0_usize) += 1;
        }
        let used: usize = offsets.values().sum();
        offsets.values().copied().max().unwrap_or(0) as f64 / used.max(1) as f64
    }
}

/// A plane that rises by `slope` radians a pixel in the direction of `direction_deg`.
pub fn ramp(slope: f64, direction_deg: f64) -> impl Fn(f64, f64) -> f64 {
    let (sine, cosine) = direction_deg.to_radians().sin_cos();
    move |col, row| 7.3 + slope * (cosine * col + sine * row)
}

/// A hill whose slopes grow from nothing in the middle to `slope` radians a pixel at `radius` pixels.
pub fn hill(slope: f64, centre: [f64; 2], radius: f64) -> impl Fn(f64, f64) -> f64 {
    move |col, row| 5.1 - 0.5 * slope / radius * ((col - centre[0]).powi(2) + (row - centre[1]).powi(2))
}

/// A surface with boxes that stand off by less than half a cycle, so that every method may be right.
fn with_boxes(surface: impl Fn(f64, f64) -> f64, boxes: [[f64; 3]; 4]) -> impl Fn(f64, f64) -> f64 {
    move |col, row| {
        let inside = |at: &[f64; 3]| (at[0]..at[0] + 29.0).contains(&col) && (at[1]..at[1] + 21.0).contains(&row);
        surface(col, row) - boxes.iter().filter(|at| inside(at)).map(|at| at[2]).sum::<f64>()
    }
}

/// Scenes of 320 x 240 pixels by name: surfaces that a filter can follow, and the last two that bend within a window.
pub fn scenes(which: Which) -> Vec<(&'static str, Box<Surface>)> {
    let tuned = which == Which::Tuned;
    let of = |tuned_on: f64, held_out: f64| if tuned { tuned_on } else { held_out };
    let boxes =
        [[of(10.0, 22.0), 12.0, 1.5], [60.0, of(9.0, 31.0), 2.6], [131.0, 60.0, of(2.0, 1.2)], [270.0, 155.0, 2.9]];
    let gap = of(20.0, 13.0);
    let holes =
        move |col: f64, row: f64| if col % 46.0 < gap && row % 34.0 < 15.0 { f64::NAN } else { 2.0 * col + 0.3 * row };
    let kink = of(1.9, 2.3);
    let roof = move |col: f64, _: f64| if col > 160.0 { kink * (col - 160.0) } else { 0.1 * (col - 160.0) };
    let [across, along] = [of(5.0, 5.7), of(6.0, 5.3)];
    let waves = move |col: f64, row: f64| 9.0 + 6.0 * (col / across).sin() * (row / along).cos();
    let width = of(100.0, 130.0);
    let bumps = move |col: f64, row: f64| {
        3.0 + 0.1 * col + 9.0 * (-((col % 40.0 - 20.0).powi(2) + (row % 40.0 - 20.0).powi(2)) / width).exp()
    };
    vec![
        ("flat", Box::new(|_, _| 3.0)),
        ("ramp, 1 rad/px", Box::new(ramp(of(1.0, 1.3), of(30.0, 115.0)))),
        ("ramp, 2 rad/px along rows", Box::new(ramp(of(2.0, 1.8), 0.0))),
        ("ramp, 2 rad/px along columns", Box::new(ramp(of(2.0, 2.2), 90.0))),
        ("ramp, 2 rad/px across", Box::new(ramp(of(2.0, 2.1), of(45.0, 325.0)))),
        ("ramp, 2.7 rad/px", Box::new(ramp(of(2.8, 2.6), of(200.0, 172.0)))),
        ("hill up to 2.5 rad/px", Box::new(hill(of(2.5, 2.2), [of(150.0, 90.0), 110.0], of(200.0, 230.0)))),
        ("roof with a steep side", Box::new(roof)),
        ("flat with boxes", Box::new(with_boxes(|_, row| 0.03 * row, boxes))),
        ("steep with boxes", Box::new(with_boxes(ramp(of(1.75, 2.0), of(-24.0, 130.0)), boxes))),
        ("steep with holes", Box::new(holes)),
        ("bumps of 20 px", Box::new(bumps)),
        ("waves of 33 px", Box::new(waves)),
    ]
}

/// The scenes that the method was chosen on, or others of their kind.
#[derive(Clone, Copy, PartialEq)]
pub enum Which {
    Tuned,
    HeldOut,
}
