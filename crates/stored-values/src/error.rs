/// What stands in the way of a judgement.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Values and rays of different images.
    #[error("the values are of {} x {} pixels, the rays of {} x {}: both must be of one camera", values[0], values[1], rays[0], rays[1])]
    Size {
        /// Width and height of the values.
        values: [usize; 2],
        /// Width and height of the table of rays.
        rays: [usize; 2],
    },
}

pub(crate) type Result<T> = std::result::Result<T, Error>;
