//! Relative counts from continuity alone, careful enough for values that nobody can check: only steps conduct that are
//! gentle, or that go on as the slope beside them does.

use std::collections::VecDeque;
use std::f32::consts::{PI, TAU};

use range_image::Raster;

use crate::image::cuts::PHASE_JUMP_RAD;
use crate::{Error, Island, Result, SpatialOptions, Unwrapped};

/// Share of a surface's steps that may contradict its counts: more than that is a jump that looked gentle somewhere. A
/// choice on which the repair without amplitudes rests; a larger share continues surfaces over hidden jumps.
const CONTRADICTIONS: f64 = 2e-3;
/// The steepest step in radians that may conduct as part of a slope. A choice, a sixth of the step at which direction
/// is lost; a larger one runs over the flanks of edges.
const STEEPEST: f32 = 0.5;
/// Surfaces smaller than this are specks. They stay unsure.
const SMALLEST_PIXELS: usize = 64;

/// Counts of surfaces that hang together by steps below `PHASE_JUMP_RAD`; the lowest count of each is 0. Sure are those
/// that run through the fold and whose steps agree with each other; all others get confidence 0 and count 0.
pub(crate) fn relative_counts(
    phase: &Raster<f32>,
    mask: Option<&Raster<bool>>,
    options: &SpatialOptions,
) -> Result<Unwrapped> {
    let (width, height) = (phase.width(), phase.height());
    let pixels = width * height;
    if u32::try_from(pixels).is_err() {
        return Err(Error::TooLarge { pixels });
    }
    let usable = |index: usize| phase.as_slice()[index].is_finite() && mask.is_none_or(|mask| mask.as_slice()[index]);
    let mut out = Unwrapped {
        wraps: Raster::filled(width, height, 0),
        confidence: Raster::filled(width, height, 0.0),
        island: Raster::filled(width, height, 0),
        segment: Raster::filled(width, height, 0),
        ..Unwrapped::default()
    };
    let mut surface = Surface { phase, jump: PHASE_JUMP_RAD, members: Vec::new(), queue: VecDeque::new() };
    for start in (0..pixels).filter(|&index| usable(index)) {
        if out.island.as_slice()[start] != 0 {
            continue;
        }
        let label = out.islands.len() as u32 + 1;
        surface.grow(start, label, &usable, &mut out);
        let known = surface.settle(label, &mut out, options.maximum_wraps);
        let pixels = surface.members.len();
        let sure_pixels = if known { pixels } else { 0 };
        out.islands.push(Island { pixels, sure_pixels, offset_known: false, segments: 1 });
    }
    out.segment.clone_from(&out.island);
    Ok(out)
}

struct Surface<'a> {
    phase: &'a Raster<f32>,
    jump: f32,
    members: Vec<usize>,
    queue: VecDeque<usize>,
}

impl Surface<'_> {
    /// Joins what gentle steps reach, in order of distance.
    fn grow(&mut self, start: usize, label: u32, usable: &impl Fn(usize) -> bool, out: &mut Unwrapped) {
        self.members.clear();
        self.queue.push_back(start);
        out.island.as_mut_slice()[start] = label;
        while let Some(pixel) = self.queue.pop_front() {
            self.members.push(pixel);
            for next in self.neighbours(pixel) {
                if let Some(carry) = self.carry(pixel, next)
                    && usable(next)
                    && out.island.as_slice()[next] == 0
                {
                    out.island.as_mut_slice()[next] = label;
                    out.wraps.as_mut_slice()[next] = out.wraps.as_slice()[pixel] + carry;
                    self.queue.push_back(next);
                }
            }
        }
    }

    fn neighbours(&self, pixel: usize) -> impl Iterator<Item = usize> + use<> {
        let (width, height) = (self.phase.width(), self.phase.height());
        let (col, row) = (pixel % width, pixel / width);
        let sides = [
            (row > 0).then(|| pixel - width),
            (col > 0).then(|| pixel - 1),
            (col + 1 < width).then(|| pixel + 1),
            (row + 1 < height).then(|| pixel + width),
        ];
        sides.into_iter().flatten()
    }

    /// Change of the count from one pixel to the next; `None` where the step may be a jump.
    fn carry(&self, from: usize, to: usize) -> Option<i32> {
        let (step, carry) = self.step(from, to);
        let continues = |slope: f32| (step - slope).abs() <= self.jump;
        let before = || self.beyond(to, from).is_some_and(|before| continues(self.step(before, from).0));
        let after = || self.beyond(from, to).is_some_and(|after| continues(self.step(to, after).0));
        let conducts = step.abs() <= self.jump || (step.abs() <= STEEPEST && (before() || after()));
        conducts.then_some(carry)
    }

    /// The smaller step between two pixels, and the cycle that it takes.
    fn step(&self, from: usize, to: usize) -> (f32, i32) {
        let step = self.phase.as_slice()[to] - self.phase.as_slice()[from];
        let carry = i32::from(step < -PI) - i32::from(step > PI);
        (step + TAU * carry as f32, carry)
    }

    /// The pixel one step further in the same direction.
    fn beyond(&self, from: usize, to: usize) -> Option<usize> {
        let (width, height) = (self.phase.width(), self.phase.height());
        let col = (2 * (to % width)).checked_sub(from % width)?;
        let row = (2 * (to / width)).checked_sub(from / width)?;
        (col < width && row < height).then_some(row * width + col)
    }

    /// Shifts the lowest count to 0 and says whether the surface is sure; takes its counts back if not.
    fn settle(&self, label: u32, out: &mut Unwrapped, maximum_wraps: u16) -> bool {
        let counts = self.members.iter().map(|&pixel| out.wraps.as_slice()[pixel]);
        let (lowest, highest) = counts.fold((i32::MAX, i32::MIN), |(low, high), n| (low.min(n), high.max(n)));
        let (mut steps, mut contradictions) = (0_usize, 0_usize);
        for &pixel in &self.members {
            for next in self.neighbours(pixel).filter(|&next| out.island.as_slice()[next] == label) {
                let agreed = self
                    .carry(pixel, next)
                    .is_none_or(|carry| out.wraps.as_slice()[next] == out.wraps.as_slice()[pixel] + carry);
                steps += 1;
                contradictions += usize::from(!agreed);
            }
        }
        let span = highest - lowest;
        let sure = (1..=i32::from(maximum_wraps)).contains(&span)
            && self.members.len() >= SMALLEST_PIXELS
            && contradictions as f64 <= CONTRADICTIONS * steps as f64;
        for &pixel in &self.members {
            let wraps = &mut out.wraps.as_mut_slice()[pixel];
            *wraps = if sure { *wraps - lowest } else { 0 };
            out.confidence.as_mut_slice()[pixel] = if sure { 1.0 } else { 0.0 };
        }
        sure
    }
}
