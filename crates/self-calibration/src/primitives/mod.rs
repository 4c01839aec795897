//! Averaging in space (Sect. 4): planes, spheres and cylinders fitted to the ranges of a region along their rays.

mod fit;
mod judge;
mod linear_start;
mod observation;
mod options;
mod outcome;
mod shape;
mod surface;

pub use fit::fit_primitive;
pub(crate) use fit::fit_whatever_shape;
pub use options::PrimitiveOptions;
pub use outcome::{FittedPixel, PrimitiveFit};
pub use shape::{Primitive, PrimitiveKind};
