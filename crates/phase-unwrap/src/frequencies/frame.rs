//! Planes of a frame, and blocks of their pixels with phases in cycles.
// Only what is inlined is compiled for wide registers; loops over lanes read as their formulas, without branches.
#![allow(clippy::inline_always, clippy::needless_range_loop, clippy::needless_bitwise_bool)]

use std::f64::consts::TAU;

use range_image::Raster;

use crate::frequencies::lanes::{LANES, Lanes, gather, select};
use crate::frequencies::lattice::{Lattice, MAXIMUM_FREQUENCIES};
use crate::frequencies::rows::PhaseRow;
use crate::{Error, Result};

/// Standard deviations below this, radians, are not believed: they are of the size of a phase's last bit.
const SMALLEST_SIGMA_RAD: f32 = 1e-5;

/// Planes of one frame, or a row of each, checked.
#[derive(Clone, Copy)]
pub(crate) struct Planes<'a> {
    phases: [&'a [f32]; MAXIMUM_FREQUENCIES],
    sigmas: Option<[&'a [f32]; MAXIMUM_FREQUENCIES]>,
    mask: Option<&'a [bool]>,
    pub(crate) size: (usize, usize),
}

/// Phases of a block of pixels, frequencies from the highest.
pub(crate) struct Block<const F: usize> {
    pub(crate) cycles: [Lanes; F],
    /// Inverse variance of the range, 1/m²; 0 where the phase is missing.
    pub(crate) weight: [Lanes; F],
    pub(crate) total_weight: Lanes,
    pub(crate) members: Lanes,
    /// 1 where the sigmas of all phases are given.
    pub(crate) sigma_known: Lanes,
}

impl<const F: usize> Block<F> {
    /// Phases in cycles and their weights.
    #[inline(always)]
    pub(crate) fn load(lattice: &Lattice, planes: &Planes<'_>, start: usize, count: usize) -> Self {
        let zero = [0.0; LANES];
        let mut block =
            Self { cycles: [zero; F], weight: [zero; F], total_weight: zero, members: zero, sigma_known: [1.0; LANES] };
        let used = planes.used(start, count);
        // A copy: where a place is chosen instead of a value, lanes are gathered one by one.
        let assumed = lattice.assumed_sigma;
        for (position, (&frequency, interval_m)) in lattice.order.iter().zip(&lattice.intervals_m).enumerate() {
            let phase = gather(planes.phases[frequency], start, count);
            let sigma = match &planes.sigmas {
                Some(sigmas) => gather(sigmas[frequency], start, count),
                None => [f32::NAN; LANES],
            };
            let per_metre = (TAU / interval_m) as f32;
            for lane in 0..LANES {
                let usable = if phase[lane].abs() <= f32::MAX { used[lane] } else { 0.0 };
                let known = select((sigma[lane] > 0.0) & (sigma[lane] <= f32::MAX), 1.0, 0.0);
                let sigma = select(known > 0.0, sigma[lane], assumed);
                let root = per_metre / sigma.max(SMALLEST_SIGMA_RAD);
                let weight = usable * (root * root);
                block.cycles[position][lane] = select(usable > 0.0, phase[lane] * (1.0 / TAU as f32), 0.0);
                block.weight[position][lane] = weight;
                block.total_weight[lane] += weight;
                block.members[lane] += usable;
                block.sigma_known[lane] *= known.max(1.0 - usable);
            }
        }
        block
    }

    /// The pixels whose highest known frequency is the one at `position`, and that know another.
    #[inline(always)]
    pub(crate) fn led_by(&self, position: usize) -> [bool; LANES] {
        let mut led = [false; LANES];
        let mut higher = [0.0; LANES];
        for weight in &self.weight[..position] {
            for lane in 0..LANES {
                higher[lane] += weight[lane];
            }
        }
        for lane in 0..LANES {
            led[lane] = (higher[lane] <= 0.0) & (self.weight[position][lane] > 0.0) & (self.members[lane] > 1.5);
        }
        led
    }
}

impl<'a> Planes<'a> {
    /// Checks numbers and sizes of the planes, whose phases lie inside a cycle.
    pub(crate) fn new(
        phases: &'a [Raster<f32>],
        frequencies: usize,
        sigmas: Option<&'a [Raster<f32>]>,
        mask: Option<&'a Raster<bool>>,
    ) -> Result<Self> {
        require_count("phase", phases, frequencies)?;
        let Some(first) = phases.first().filter(|first| !first.is_empty()) else {
            return Err(Error::Empty { width: 0, height: 0 });
        };
        for plane in phases {
            first.require_same_size(plane, "phase")?;
        }
        if let Some(sigmas) = sigmas {
            require_count("sigma of the phase", sigmas, frequencies)?;
            for plane in sigmas {
                first.require_same_size(plane, "sigma of the phase")?;
            }
        }
        if let Some(mask) = mask {
            first.require_same_size(mask, "mask")?;
        }
        let size = (first.width(), first.height());
        let (phases, sigmas) =
            (slices(phases, Raster::as_slice), sigmas.map(|sigmas| slices(sigmas, Raster::as_slice)));
        Ok(Self { phases, sigmas, mask: mask.map(Raster::as_slice), size })
    }

    /// Checks numbers and lengths of a row of each plane.
    pub(crate) fn of_row(row: &PhaseRow<'a>, frequencies: usize, width: usize) -> Result<Self> {
        require_count("phase", row.phases, frequencies)?;
        require_count("sigma of the phase", row.sigmas, frequencies)?;
        let lengths = row.phases.iter().chain(row.sigmas).map(|row| row.len());
        if let Some(found) = lengths.chain([row.mask.len()]).find(|found| *found != width) {
            return Err(range_image::Error::RasterLength { width, height: 1, expected: width, found }.into());
        }
        let (phases, sigmas) = (slices(row.phases, |row| *row), Some(slices(row.sigmas, |row| *row)));
        Ok(Self { phases, sigmas, mask: Some(row.mask), size: (width, 1) })
    }

    /// 1 where a pixel of a block is to be used.
    #[inline(always)]
    fn used(&self, start: usize, count: usize) -> Lanes {
        let mut used = [0.0; LANES];
        let Some(mask) = self.mask else {
            used[..count].fill(1.0);
            return used;
        };
        for (used, &mask) in used.iter_mut().zip(&mask[start..][..count]) {
            *used = f32::from(u8::from(mask));
        }
        used
    }
}

fn require_count<T>(what: &'static str, planes: &[T], expected: usize) -> Result<()> {
    let found = planes.len();
    if found == expected { Ok(()) } else { Err(Error::PlaneCount { what, expected, found }) }
}

/// Values of each frequency; there are no more than the largest number.
fn slices<'a, T>(planes: &'a [T], values: impl Fn(&'a T) -> &'a [f32]) -> [&'a [f32]; MAXIMUM_FREQUENCIES] {
    let mut slices: [&[f32]; MAXIMUM_FREQUENCIES] = [&[]; MAXIMUM_FREQUENCIES];
    slices.iter_mut().zip(planes).for_each(|(to, plane)| *to = values(plane));
    slices
}
