//! Tracks: what their blocks hold.

use super::elements::{children, id, text, unsigned};
use crate::contents::Kind;
use crate::payload::{CompressedImage, Encoding, Image, ImageParts, Payload};

/// One track of a recording.
#[derive(Debug, Clone)]
pub(super) struct Track {
    pub number: u64,
    pub uid: u64,
    pub name: String,
    pub coding: Coding,
    /// In the words of the file.
    pub codec: String,
    width: u32,
    height: u32,
}

/// How the frames of a track are coded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Coding {
    /// 16 bits, big-endian.
    Grey16,
    Nv12,
    Yuy2,
    Jpeg,
    /// Samples of the inertial unit.
    Imu,
    Other,
}

impl Track {
    /// From the data of a track's entry.
    pub fn read(entry: &[u8]) -> Self {
        let mut track = Self {
            number: 0,
            uid: 0,
            name: String::new(),
            coding: Coding::Other,
            codec: String::new(),
            width: 0,
            height: 0,
        };
        let (mut private, mut encoded) = (&[][..], false);
        for (id, data) in children(entry) {
            match id {
                id::TRACK_NUMBER => track.number = unsigned(data),
                id::TRACK_UID => track.uid = unsigned(data),
                id::NAME => track.name = text(data),
                id::CODEC_ID => track.codec = text(data),
                id::CODEC_PRIVATE => private = data,
                id::CONTENT_ENCODINGS => encoded = true,
                id::VIDEO => {
                    for (id, data) in children(data) {
                        match id {
                            id::PIXEL_WIDTH => track.width = u32::try_from(unsigned(data)).unwrap_or(0),
                            id::PIXEL_HEIGHT => track.height = u32::try_from(unsigned(data)).unwrap_or(0),
                            _ => {}
                        }
                    }
                }
                _ => {}
            }
        }
        if track.codec == "V_MS/VFW/FOURCC" {
            // A BITMAPINFOHEADER carries the coding in its bytes 16 to 19.
            let coding = private.get(16..20).unwrap_or_default();
            track.codec = String::from_utf8_lossy(coding).into_owned();
        }
        track.coding = match track.codec.as_str() {
            // Frames that are compressed or encrypted once more are no images.
            _ if encoded => Coding::Other,
            "b16g" => Coding::Grey16,
            "NV12" => Coding::Nv12,
            "YUY2" => Coding::Yuy2,
            "MJPG" | "V_MJPEG" => Coding::Jpeg,
            "S_K4A/IMU" => Coding::Imu,
            _ => Coding::Other,
        };
        track
    }

    /// What its frames show.
    pub fn kind(&self) -> Kind {
        match self.coding {
            Coding::Grey16 => Kind::of_image(&self.name, &Encoding::Unsigned16),
            Coding::Nv12 | Coding::Yuy2 | Coding::Jpeg => Kind::Colour,
            Coding::Imu => Kind::Imu,
            Coding::Other => Kind::Other,
        }
    }

    /// An image from a frame; of the inertial unit and of codings that are not known the bytes.
    pub fn payload(&self, frame: &[u8]) -> Payload {
        let encoding = match self.coding {
            Coding::Grey16 if self.kind() == Kind::Depth => Encoding::Unsigned16,
            Coding::Grey16 => Encoding::Mono16,
            Coding::Nv12 => Encoding::Nv12,
            Coding::Yuy2 => Encoding::Yuy2,
            Coding::Jpeg => {
                let (frame_id, format) = (self.name.clone(), "jpeg".to_owned());
                return Payload::Compressed(CompressedImage { frame_id, format, data: frame.to_vec() });
            }
            Coding::Imu | Coding::Other => return Payload::Bytes(frame.to_vec()),
        };
        let step = self.width.saturating_mul(encoding.bytes_per_pixel().unwrap_or(1) as u32);
        let (frame_id, data) = (self.name.clone(), frame.to_vec());
        let (width, height, big_endian) = (self.width, self.height, self.coding == Coding::Grey16);
        Image::new(ImageParts { frame_id, width, height, step, encoding, big_endian, data })
            .map_or_else(|error| Payload::Unreadable(error.to_string()), Payload::Image)
    }
}
