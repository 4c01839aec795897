/// Names an observation group of one [`crate::Adjustment`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct GroupId(pub(crate) usize);

/// Names an observation of one [`crate::Adjustment`]: its number in the order of adding, priors included.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ObservationId(pub(crate) usize);

impl GroupId {
    /// Number of the group, in the order of adding, from 0.
    pub fn index(self) -> usize {
        self.0
    }
}

impl ObservationId {
    /// Number of the observation, in the order of adding, from 0.
    pub fn index(self) -> usize {
        self.0
    }
}
