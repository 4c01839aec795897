//! Messages from their bytes.

use super::fields::Fields;
use super::{Layout, MessageType};
use crate::payload::{CameraInfo, CompressedImage, Encoding, Image, ImageParts, Imu, Measured, Payload, Transform};

/// What a message holds and when it was measured.
pub(crate) struct Decoded {
    pub stamp_ns: Option<i64>,
    pub payload: Payload,
}

/// Reads a message; one that is not what its type says comes out as such.
pub(crate) fn decode(bytes: &[u8], layout: Layout, message: MessageType) -> Decoded {
    decoded(bytes, layout, message)
        .unwrap_or_else(|reason| Decoded { stamp_ns: None, payload: Payload::Unreadable(reason) })
}

fn decoded(bytes: &[u8], layout: Layout, message: MessageType) -> Result<Decoded, String> {
    let mut fields = Fields::new(bytes, layout)?;
    // Each transform of a list has a header of its own.
    let is_list = message == MessageType::Transforms;
    let (stamp_ns, frame_id) = if is_list { (None, String::new()) } else { header(&mut fields)? };
    let payload = match message {
        MessageType::Image => Payload::Image(image(&mut fields, frame_id)?),
        MessageType::CompressedImage => {
            let format = fields.text("format")?;
            Payload::Compressed(CompressedImage { frame_id, format, data: fields.bytes("data")?.to_vec() })
        }
        MessageType::CameraInfo => Payload::CameraInfo(Box::new(camera_info(&mut fields, frame_id)?)),
        MessageType::Imu => Payload::Imu(Box::new(imu(&mut fields, frame_id)?)),
        MessageType::Temperature => Payload::Temperature(fields.f64("temperature")?),
        MessageType::Transforms => return transforms(&mut fields),
    };
    Ok(Decoded { stamp_ns, payload })
}

/// `tf2_msgs/TFMessage`, at the time of its first part.
fn transforms(fields: &mut Fields) -> Result<Decoded, String> {
    // A part takes more bytes than one, so a promise of many ends with the bytes.
    let count = fields.u32("transforms")?;
    let (mut stamp_ns, mut found) = (None, Vec::new());
    for _ in 0..count {
        let (stamp, parent) = header(fields)?;
        stamp_ns = stamp_ns.or(stamp);
        let child = fields.text("child_frame_id")?;
        let (translation_m, rotation) = (fields.f64s("translation")?, fields.f64s("rotation")?);
        found.push(Transform { parent, child, translation_m, rotation });
    }
    Ok(Decoded { stamp_ns, payload: Payload::Transforms(found) })
}

/// `std_msgs/Header`. A stamp of zero says that none was set.
fn header(fields: &mut Fields) -> Result<(Option<i64>, String), String> {
    if fields.is_ros1() {
        fields.u32("header.seq")?;
    }
    let seconds = fields.u32("header.stamp")?;
    let nanoseconds = fields.u32("header.stamp")?;
    // ROS 2 counts seconds with a sign, ROS 1 without.
    let seconds = if fields.is_ros1() { i64::from(seconds) } else { i64::from(seconds as i32) };
    let stamp = seconds * 1_000_000_000 + i64::from(nanoseconds);
    Ok(((stamp != 0).then_some(stamp), fields.text("header.frame_id")?))
}

fn image(fields: &mut Fields, frame_id: String) -> Result<Image, String> {
    let height = fields.u32("height")?;
    let width = fields.u32("width")?;
    let encoding = Encoding::of(&fields.text("encoding")?);
    let big_endian = fields.u8("is_bigendian")? != 0;
    let step = fields.u32("step")?;
    let data = fields.bytes("data")?.to_vec();
    Image::new(ImageParts { frame_id, width, height, step, encoding, big_endian, data })
        .map_err(|error| error.to_string())
}

fn camera_info(fields: &mut Fields, frame_id: String) -> Result<CameraInfo, String> {
    Ok(CameraInfo {
        frame_id,
        height: fields.u32("height")?,
        width: fields.u32("width")?,
        distortion_model: fields.text("distortion_model")?,
        distortion: fields.list_f64("D")?,
        matrix: fields.f64s("K")?,
        rectification: fields.f64s("R")?,
        projection: fields.f64s("P")?,
        binning: [fields.u32("binning_x")?, fields.u32("binning_y")?],
        window: [fields.u32("roi")?, fields.u32("roi")?, fields.u32("roi")?, fields.u32("roi")?],
        rectify: fields.u8("roi.do_rectify")? != 0,
    })
}

fn imu(fields: &mut Fields, frame_id: String) -> Result<Imu, String> {
    Ok(Imu {
        frame_id,
        orientation: measured(fields, "orientation")?,
        angular_velocity: measured(fields, "angular_velocity")?,
        linear_acceleration: measured(fields, "linear_acceleration")?,
        angular_velocity_ns: None,
    })
}

/// Values and their covariance, whose first element is -1 where they are not measured.
fn measured<const N: usize>(fields: &mut Fields, field: &str) -> Result<Option<Measured<N>>, String> {
    let value = fields.f64s(field)?;
    let covariance: [f64; 9] = fields.f64s(field)?;
    Ok((covariance[0] >= 0.0 || covariance[0].is_nan()).then_some(Measured { value, covariance }))
}
