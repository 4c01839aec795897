//! Planes that stations share: who sees what of them, summed up and eliminated.

pub(crate) mod contacts;
pub(crate) mod elimination;
pub(crate) mod reduction;
pub(crate) mod scatter;
pub(crate) mod shared_planes;
pub(crate) mod sightings;
pub(crate) mod sums;
pub(crate) mod tiles;
