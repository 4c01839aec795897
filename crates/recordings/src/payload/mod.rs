//! What messages hold.

mod image;
#[cfg(feature = "jpeg")]
mod jpeg;

pub use image::{CompressedImage, Encoding, Image, ImageParts};

/// What a message holds.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Payload {
    /// An image, pixel by pixel.
    Image(Image),
    /// An image as a compressed file.
    Compressed(CompressedImage),
    /// A camera's matrix and distortion.
    CameraInfo(Box<CameraInfo>),
    /// One sample of an inertial unit.
    Imu(Box<Imu>),
    /// A temperature in degree Celsius.
    Temperature(f64),
    /// Where coordinate systems lie in others.
    Transforms(Vec<Transform>),
    /// Anything else, as it stands in the file.
    Bytes(Vec<u8>),
    /// A message that is not what its type says; the reason in words.
    Unreadable(String),
}

/// A camera's matrix and distortion, as `sensor_msgs/CameraInfo` states them: pixels, computer-vision axes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CameraInfo {
    /// Name of the camera's coordinate system.
    pub frame_id: String,
    /// Columns of the full image.
    pub width: u32,
    /// Rows of the full image.
    pub height: u32,
    /// Name of the distortion model: `plumb_bob`, `rational_polynomial`, `equidistant`.
    pub distortion_model: String,
    /// Its coefficients; for `plumb_bob` k1, k2, p1, p2, k3.
    pub distortion: Vec<f64>,
    /// Camera matrix K, row by row: `fx 0 cx, 0 fy cy, 0 0 1`, zero where the camera is not calibrated.
    pub matrix: [f64; 9],
    /// Rectification R, row by row.
    pub rectification: [f64; 9],
    /// Projection P of the rectified image, row by row.
    pub projection: [f64; 12],
    /// Pixels binned along a row and along a column; 0 means 1.
    pub binning: [u32; 2],
    /// Window of the full image that is recorded: first column, first row, rows, columns; all 0 for all of it.
    pub window: [u32; 4],
    /// Whether the window is to be rectified.
    pub rectify: bool,
}

/// One sample of an inertial unit in its own axes, as `sensor_msgs/Imu` states it. What is not measured is `None`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Imu {
    /// Name of the unit's coordinate system.
    pub frame_id: String,
    /// Quaternion x, y, z, w of the unit's axes in a world whose vertical is known.
    pub orientation: Option<Measured<4>>,
    /// Angular velocity, radian per second.
    pub angular_velocity: Option<Measured<3>>,
    /// Specific force, metre per second squared.
    pub linear_acceleration: Option<Measured<3>>,
    /// When the angular velocity was measured, nanosecond, where that is not the time of the message.
    pub angular_velocity_ns: Option<i64>,
}

/// Where one coordinate system lies in another, as `geometry_msgs/TransformStamped` states it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Transform {
    /// Name of the coordinate system in which the other lies.
    pub parent: String,
    /// Name of that other one.
    pub child: String,
    /// Its origin, metre.
    pub translation_m: [f64; 3],
    /// Quaternion x, y, z, w that turns its axes into the parent's.
    pub rotation: [f64; 4],
}

/// Values with their covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured<const N: usize> {
    /// The values.
    pub value: [f64; N],
    /// Covariance of the three axes, row by row; all zero where it is not known.
    pub covariance: [f64; 9],
}
