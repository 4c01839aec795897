//! What every search for targets asks of an image: its noise, its contrast, values between pixels, smoothing, derivatives.

pub(crate) mod derivatives;
pub(crate) mod levels;
pub(crate) mod noise;
pub(crate) mod normal_table;
pub(crate) mod sampling;
pub(crate) mod smoothing;
