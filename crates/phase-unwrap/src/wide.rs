//! Run-time dispatch to the widest registers that the machine has.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

/// Called through `FnMut`: the shim by which a closure that could be called again serves as `FnOnce` is not inlined, and
/// its body would be compiled for the narrow registers.
struct Wide<F>(F);

impl<F: FnMut()> pulp::NullaryFnOnce for Wide<F> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        (self.0)();
    }
}

/// Runs a piece of work, with everything in it that is marked to be always inlined, compiled for wide registers.
/// Products and sums stay separate operations, so that all machines give the same bits.
#[inline(always)]
pub(crate) fn with_wide_registers(work: impl FnMut()) {
    pulp::Arch::new().dispatch(Wide(work));
}
