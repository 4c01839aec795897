//! Run-time dispatch to the widest registers that the machine has, for the hot loops of all crates that work on rasters.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

/// Called through `FnMut`: the shim by which a closure that could be called again serves as `FnOnce` is not inlined, and
/// its body would be compiled for the narrow registers.
struct Wide<F>(F);

impl<R, F: FnMut() -> R> pulp::NullaryFnOnce for Wide<F> {
    type Output = R;

    #[inline(always)]
    fn call(mut self) -> R {
        (self.0)()
    }
}

/// Runs a piece of work, with everything in it that is marked `#[inline(always)]` (the closure itself included), compiled
/// for the widest registers that the machine has, found out when the program runs.
///
/// Products and sums stay separate operations, so that all machines give the same bits.
#[inline(always)]
pub fn with_wide_registers<R>(work: impl FnMut() -> R) -> R {
    pulp::Arch::new().dispatch(Wide(work))
}
