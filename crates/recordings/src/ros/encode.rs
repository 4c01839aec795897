//! Messages of ROS 2 to their bytes, little-endian.

use super::MessageType;
use crate::payload::{CameraInfo, Image, Imu, Measured, Payload, Transform};

/// The type and the bytes of a message; `None` for what has no message type of its own.
pub(crate) fn encode(stamp_ns: i64, payload: &Payload) -> Option<(MessageType, Vec<u8>)> {
    let mut out = Bytes::default();
    let message = match payload {
        Payload::Image(image) => {
            out.header(stamp_ns, image.frame_id());
            out.image(image);
            MessageType::Image
        }
        Payload::Compressed(image) => {
            out.header(stamp_ns, &image.frame_id);
            out.text(&image.format);
            out.bytes(&image.data);
            MessageType::CompressedImage
        }
        Payload::CameraInfo(info) => {
            out.header(stamp_ns, &info.frame_id);
            out.camera_info(info);
            MessageType::CameraInfo
        }
        Payload::Imu(imu) => {
            out.header(stamp_ns, &imu.frame_id);
            out.imu(imu);
            MessageType::Imu
        }
        Payload::Temperature(celsius) => {
            out.header(stamp_ns, "");
            // The variance is not known: zero.
            out.f64s(&[*celsius, 0.0]);
            MessageType::Temperature
        }
        Payload::Transforms(transforms) => {
            out.u32(transforms.len() as u32);
            for transform in transforms {
                out.transform(stamp_ns, transform);
            }
            MessageType::Transforms
        }
        Payload::Bytes(_) | Payload::Unreadable(_) => return None,
    };
    // The head that says "CDR, little-endian".
    Some((message, [&[0, 1, 0, 0], out.0.as_slice()].concat()))
}

#[derive(Default)]
struct Bytes(Vec<u8>);

impl Bytes {
    fn align(&mut self, to: usize) {
        self.0.resize(self.0.len().next_multiple_of(to), 0);
    }

    fn u32(&mut self, value: u32) {
        self.align(4);
        self.0.extend(value.to_le_bytes());
    }

    fn f64s(&mut self, values: &[f64]) {
        for value in values {
            self.align(8);
            self.0.extend(value.to_le_bytes());
        }
    }

    fn bytes(&mut self, bytes: &[u8]) {
        self.u32(bytes.len() as u32);
        self.0.extend(bytes);
    }

    fn text(&mut self, text: &str) {
        self.u32(text.len() as u32 + 1);
        self.0.extend(text.as_bytes());
        self.0.push(0);
    }

    fn header(&mut self, stamp_ns: i64, frame_id: &str) {
        // What lies before 1901 or behind 2038 has no stamp in ROS.
        let seconds = i32::try_from(stamp_ns.div_euclid(1_000_000_000)).ok();
        let nanoseconds = seconds.map_or(0, |_| stamp_ns.rem_euclid(1_000_000_000) as u32);
        self.u32(seconds.unwrap_or(0) as u32);
        self.u32(nanoseconds);
        self.text(frame_id);
    }

    fn image(&mut self, image: &Image) {
        self.u32(image.height() as u32);
        self.u32(image.width() as u32);
        self.text(image.encoding().name());
        self.0.push(u8::from(image.is_big_endian()));
        self.u32(image.step() as u32);
        self.bytes(image.data());
    }

    fn camera_info(&mut self, info: &CameraInfo) {
        self.u32(info.height);
        self.u32(info.width);
        self.text(&info.distortion_model);
        self.u32(info.distortion.len() as u32);
        self.f64s(&info.distortion);
        self.f64s(&info.matrix);
        self.f64s(&info.rectification);
        self.f64s(&info.projection);
        for value in info.binning.iter().chain(&info.window) {
            self.u32(*value);
        }
        self.0.push(u8::from(info.rectify));
    }

    fn imu(&mut self, imu: &Imu) {
        self.measured(imu.orientation.as_ref());
        self.measured(imu.angular_velocity.as_ref());
        self.measured(imu.linear_acceleration.as_ref());
    }

    fn transform(&mut self, stamp_ns: i64, transform: &Transform) {
        self.header(stamp_ns, &transform.parent);
        self.text(&transform.child);
        self.f64s(&transform.translation_m);
        self.f64s(&transform.rotation);
    }

    fn measured<const N: usize>(&mut self, measured: Option<&Measured<N>>) {
        // A first element of -1 says that it is not measured.
        let unknown = Measured { value: [0.0; N], covariance: [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0] };
        let Measured { value, covariance } = measured.unwrap_or(&unknown);
        self.f64s(value);
        self.f64s(covariance);
    }
}
