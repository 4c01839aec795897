//! Names of topics for streams that have none.

use recordings::{Kind, Stream};

/// The topic of a stream: its own name, or one that tells what its images show. Those of an Azure Kinect are the ones that its
/// driver for ROS gives.
pub(super) fn topic(stream: &Stream) -> String {
    if stream.name.starts_with('/') {
        return stream.name.clone();
    }
    let name = match stream.name.as_str() {
        "COLOR" => "rgb".to_owned(),
        "camera" | "depth" if matches!(stream.kind, Kind::Range | Kind::CameraInfo) => "range".to_owned(),
        name => name.to_lowercase(),
    };
    let name: String = name.chars().map(|letter| if letter.is_alphanumeric() { letter } else { '_' }).collect();
    match stream.kind {
        Kind::CameraInfo => format!("/{name}/camera_info"),
        Kind::Imu | Kind::Temperature | Kind::Transforms | Kind::Other => format!("/{name}"),
        _ => format!("/{name}/image_raw"),
    }
}
