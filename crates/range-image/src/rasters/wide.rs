//! Loops that are compiled for the widest registers that the machine has, and their split over threads.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

/// Pixels that the loops take at a time: enough for the compiler to see a loop that it can vectorise, few enough for their
/// sums to stay in the first-level cache.
pub(crate) const LANES: usize = 64;

/// Pixels that one task takes; smaller tasks cost more to hand out than to do.
const PIXELS_PER_TASK: usize = 1 << 15;

/// How products are added: with one rounding where the machine does that in hardware, with two where it would have to
/// call a library.
pub(crate) trait Arithmetic {
    /// `a b + c`.
    fn multiply_add(a: f32, b: f32, c: f32) -> f32;
}

/// Fused multiplication and addition.
struct Fused;

/// Multiplication, rounding, addition.
pub(crate) struct Separate;

impl Arithmetic for Fused {
    #[inline(always)]
    fn multiply_add(a: f32, b: f32, c: f32) -> f32 {
        a.mul_add(b, c)
    }
}

impl Arithmetic for Separate {
    #[inline(always)]
    fn multiply_add(a: f32, b: f32, c: f32) -> f32 {
        a * b + c
    }
}

/// Work on pixels that do not depend on each other. Whatever it calls has to be inlined.
pub(crate) trait PixelLoop {
    /// Does `L` pixels from `start` on.
    fn pixels<A: Arithmetic, const L: usize>(&mut self, start: usize);
}

/// Runs a loop over `length` pixels, [`LANES`] at a time and the rest one by one, and gives it back. A pixel's bits do
/// not depend on which.
pub(crate) fn run_wide<W: PixelLoop>(length: usize, work: W) -> W {
    pulp::Arch::new().dispatch(Wide { length, work })
}

struct Wide<W> {
    length: usize,
    work: W,
}

impl<W: PixelLoop> Wide<W> {
    #[inline(always)]
    fn run<A: Arithmetic>(mut self) -> W {
        let whole = self.length / LANES * LANES;
        for start in (0..whole).step_by(LANES) {
            self.work.pixels::<A, LANES>(start);
        }
        for start in whole..self.length {
            self.work.pixels::<A, 1>(start);
        }
        self.work
    }
}

impl<W: PixelLoop> pulp::WithSimd for Wide<W> {
    type Output = W;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> W {
        // Of the processors with registers of their own for this, these have the fused operation.
        if !S::IS_SCALAR && cfg!(any(target_arch = "x86", target_arch = "x86_64", target_arch = "aarch64")) {
            self.run::<Fused>()
        } else {
            self.run::<Separate>()
        }
    }
}

/// Pixels of a task of a frame of `pixels`: all of them where there is one thread, which then is not troubled with tasks.
pub(crate) fn task_length(pixels: usize) -> usize {
    if rayon::current_num_threads() == 1 { pixels.max(1) } else { PIXELS_PER_TASK }
}
