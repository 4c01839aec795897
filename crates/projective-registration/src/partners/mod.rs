//! Which plane of the one frame each node of the other meets.

#[cfg(test)]
pub(crate) mod drawn;
pub(crate) mod locate;
pub(crate) mod map;
pub(crate) mod pairs;
pub(crate) mod shared_planes;
pub(crate) mod sums;
pub(crate) mod track;
