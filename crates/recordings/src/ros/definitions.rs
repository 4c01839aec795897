//! Definitions of the message types in ROS 2's own form (`ros2msg`), which make an MCAP file readable without ROS.

use super::MessageType;

const IMAGE: &str = "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\nuint8[] data\n";

const COMPRESSED_IMAGE: &str = "std_msgs/Header header\nstring format\nuint8[] data\n";

const CAMERA_INFO: &str = "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\nfloat64[9] k\nfloat64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi\n";

const IMU: &str = "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\ngeometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\ngeometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n";

const TEMPERATURE: &str = "std_msgs/Header header\nfloat64 temperature\nfloat64 variance\n";

const TRANSFORMS: &str = "geometry_msgs/TransformStamped[] transforms\n";

const HEADER: [(&str, &str); 2] = [
    ("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"),
    ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"),
];

const WINDOW: (&str, &str) = (
    "sensor_msgs/RegionOfInterest",
    "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n",
);

const GEOMETRY: [(&str, &str); 2] = [
    ("geometry_msgs/Quaternion", "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n"),
    ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"),
];

const PLACES: [(&str, &str); 4] = [
    (
        "geometry_msgs/TransformStamped",
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
    ),
    ("geometry_msgs/Transform", "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"),
    GEOMETRY[0],
    GEOMETRY[1],
];

/// The definition of a type and of all types in it.
pub(crate) fn definition(message: MessageType) -> String {
    let (own, further): (&str, &[(&str, &str)]) = match message {
        MessageType::Image => (IMAGE, &[]),
        MessageType::CompressedImage => (COMPRESSED_IMAGE, &[]),
        MessageType::CameraInfo => (CAMERA_INFO, &[WINDOW]),
        MessageType::Imu => (IMU, &GEOMETRY),
        MessageType::Temperature => (TEMPERATURE, &[]),
        MessageType::Transforms => (TRANSFORMS, &PLACES),
    };
    let rule = "=".repeat(80);
    let parts = HEADER.iter().chain(further).map(|(name, text)| format!("{rule}\nMSG: {name}\n{text}"));
    std::iter::once(own.to_owned()).chain(parts).collect()
}
