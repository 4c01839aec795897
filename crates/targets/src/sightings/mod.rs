//! What is known of a target that was seen: its image point, its range, and what its perspective tells of the camera.

pub(crate) mod measured_point;
pub(crate) mod principal_distance;
pub(crate) mod target_range;
