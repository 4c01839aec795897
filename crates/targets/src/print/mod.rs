//! Targets to be printed: one page of SVG in millimetre.
//!
//! Print at 100 % and measure the scale bar. Near infrared cameras see black laser toner, which is carbon, as black; the dyes of
//! many ink-jet printers reflect there as paper does, and the target is not to be seen.

mod page;
mod targets;

pub use page::{INFRARED_NOTE, PaperSize};
pub use targets::{print_checkerboard, print_circle_grid, print_coded};
