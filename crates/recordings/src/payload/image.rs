use crate::Error;
use crate::error::Result;
use crate::limits::MOST_PIXELS;

/// How the pixels of an image are stored.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Encoding {
    /// Light, 8 bits (`mono8`).
    Mono8,
    /// Light, 16 bits (`mono16`).
    Mono16,
    /// 8 bits without a meaning of their own (`8UC1`).
    Unsigned8,
    /// 16 bits without a meaning of their own (`16UC1`); depths are millimetres.
    Unsigned16,
    /// Single precision (`32FC1`); depths are metres.
    Float32,
    /// Red, green, blue, 8 bits each (`rgb8`).
    Rgb8,
    /// Blue, green, red, 8 bits each (`bgr8`).
    Bgr8,
    /// As `rgb8` with opacity (`rgba8`).
    Rgba8,
    /// As `bgr8` with opacity (`bgra8`).
    Bgra8,
    /// A plane of brightness, then one of colour differences at half the resolution (`nv12`).
    Nv12,
    /// Brightness and colour differences of two pixels in four bytes, brightness first (`yuv422_yuy2`).
    Yuy2,
    /// Another, by its name in the file.
    Other(String),
}

/// Names as ROS writes them.
const NAMES: [(&str, Encoding); 11] = [
    ("mono8", Encoding::Mono8),
    ("mono16", Encoding::Mono16),
    ("8UC1", Encoding::Unsigned8),
    ("16UC1", Encoding::Unsigned16),
    ("32FC1", Encoding::Float32),
    ("rgb8", Encoding::Rgb8),
    ("bgr8", Encoding::Bgr8),
    ("rgba8", Encoding::Rgba8),
    ("bgra8", Encoding::Bgra8),
    ("nv12", Encoding::Nv12),
    ("yuv422_yuy2", Encoding::Yuy2),
];

impl Encoding {
    /// The encoding of this name.
    pub fn of(name: &str) -> Self {
        let known = NAMES.iter().find(|(known, _)| *known == name);
        known.map_or_else(|| Self::Other(name.to_owned()), |(_, encoding)| encoding.clone())
    }

    /// Its name in files.
    pub fn name(&self) -> &str {
        match self {
            Self::Other(name) => name,
            known => NAMES.iter().find(|(_, encoding)| encoding == known).map_or("", |(name, _)| name),
        }
    }

    /// Bytes of a pixel; `None` where they are shared among pixels or not known.
    pub fn bytes_per_pixel(&self) -> Option<u64> {
        Some(match self {
            Self::Mono8 | Self::Unsigned8 => 1,
            Self::Mono16 | Self::Unsigned16 | Self::Yuy2 => 2,
            Self::Rgb8 | Self::Bgr8 => 3,
            Self::Float32 | Self::Rgba8 | Self::Bgra8 => 4,
            Self::Nv12 | Self::Other(_) => return None,
        })
    }
}

/// An image, pixel by pixel. Its rows were checked: there are as many bytes as size and encoding ask for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    frame_id: String,
    width: u32,
    height: u32,
    step: u32,
    encoding: Encoding,
    big_endian: bool,
    data: Vec<u8>,
}

/// What an image is made of, before it is checked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ImageParts {
    /// Name of the camera's coordinate system.
    pub frame_id: String,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Bytes from one row to the next.
    pub step: u32,
    /// How pixels are stored.
    pub encoding: Encoding,
    /// Whether values of several bytes begin with the highest.
    pub big_endian: bool,
    /// All rows.
    pub data: Vec<u8>,
}

impl Image {
    /// An image of checked size.
    ///
    /// # Errors
    /// [`Error::Value`] where the image has no pixel or too many, a row is shorter than its pixels, or data are missing.
    pub fn new(parts: ImageParts) -> Result<Self> {
        let ImageParts { frame_id, width, height, step, encoding, big_endian, mut data } = parts;
        let (columns, rows) = (u64::from(width), u64::from(height));
        if columns * rows == 0 || columns * rows > MOST_PIXELS {
            let reason = format!("has {width} x {height} pixels, expected 1 to {MOST_PIXELS} in all");
            return Err(Error::value("image", reason));
        }
        let row = encoding.bytes_per_pixel().map_or(0, |bytes| bytes * columns);
        if u64::from(step) < row {
            let name = encoding.name();
            let reason = format!("has rows of {step} bytes, expected {row} for {width} pixels of {name}");
            return Err(Error::value("image", reason));
        }
        let whole = match encoding {
            // Half as many rows of colour differences behind those of brightness.
            Encoding::Nv12 => columns * rows + columns * rows.div_ceil(2),
            Encoding::Other(_) => 0,
            // The last row may end with its last pixel.
            _ => u64::from(step) * (rows - 1) + row,
        };
        if (data.len() as u64) < whole {
            let reason = format!("has {} bytes, expected {whole} for {width} x {height} pixels", data.len());
            return Err(Error::value("image", reason));
        }
        if encoding.bytes_per_pixel().is_some() {
            data.truncate((u64::from(step) * rows) as usize);
        }
        Ok(Self { frame_id, width, height, step, encoding, big_endian, data })
    }

    /// An image of 16-bit values without gaps between its rows, little-endian.
    ///
    /// # Errors
    /// As [`Image::new`].
    pub fn from_u16(frame_id: &str, [width, height]: [u32; 2], encoding: Encoding, values: &[u16]) -> Result<Self> {
        let data = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        Self::packed(frame_id, [width, height], encoding, 2, data)
    }

    /// An image of single-precision values (`32FC1`) without gaps between its rows, little-endian.
    ///
    /// # Errors
    /// As [`Image::new`].
    pub fn from_f32(frame_id: &str, [width, height]: [u32; 2], values: &[f32]) -> Result<Self> {
        let data = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        Self::packed(frame_id, [width, height], Encoding::Float32, 4, data)
    }

    fn packed(frame_id: &str, size: [u32; 2], encoding: Encoding, bytes: u32, data: Vec<u8>) -> Result<Self> {
        let [width, height] = size;
        let step = width.saturating_mul(bytes);
        Self::new(ImageParts { frame_id: frame_id.to_owned(), width, height, step, encoding, big_endian: false, data })
    }

    /// Name of the camera's coordinate system.
    pub fn frame_id(&self) -> &str {
        &self.frame_id
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width as usize
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height as usize
    }

    /// Bytes from one row to the next.
    pub fn step(&self) -> usize {
        self.step as usize
    }

    /// How pixels are stored.
    pub fn encoding(&self) -> &Encoding {
        &self.encoding
    }

    /// Whether values of several bytes begin with the highest.
    pub fn is_big_endian(&self) -> bool {
        self.big_endian
    }

    /// All rows as they are stored.
    pub fn data(&self) -> &[u8] {
        &self.data
    }

    /// The values of an image of 16 bits, row by row.
    pub fn values_u16(&self) -> Option<Vec<u16>> {
        if !matches!(self.encoding, Encoding::Mono16 | Encoding::Unsigned16) {
            return None;
        }
        let read = if self.big_endian { u16::from_be_bytes } else { u16::from_le_bytes };
        Some(self.rows(2).flat_map(|row| row.as_chunks().0.iter().map(|&pair| read(pair))).collect())
    }

    /// The values of an image of one channel, row by row, as they stand.
    pub fn values_f32(&self) -> Option<Vec<f32>> {
        match self.encoding {
            Encoding::Mono8 | Encoding::Unsigned8 => {
                Some(self.rows(1).flatten().map(|&value| f32::from(value)).collect())
            }
            Encoding::Mono16 | Encoding::Unsigned16 => Some(self.values_u16()?.into_iter().map(f32::from).collect()),
            Encoding::Float32 => {
                let read = if self.big_endian { f32::from_be_bytes } else { f32::from_le_bytes };
                Some(self.rows(4).flat_map(|row| row.as_chunks().0.iter().map(|&four| read(four))).collect())
            }
            _ => None,
        }
    }

    /// Depths in metres, row by row, NaN where there is none: 16-bit values are millimetres with 0 for none (REP 118), and
    /// 65535, the end of the scale, is none either; single precision is metres with NaN, an infinity or nothing above zero for none.
    pub fn depths_m(&self) -> Option<Vec<f32>> {
        let scale = match self.encoding {
            Encoding::Unsigned16 | Encoding::Mono16 => 0.001,
            Encoding::Float32 => 1.0,
            _ => return None,
        };
        let end_of_scale = if scale < 1.0 { f32::from(u16::MAX) } else { f32::INFINITY };
        let metres = |value: f32| {
            if value >= end_of_scale {
                return f32::NAN;
            }
            let metres = (f64::from(value) * scale) as f32;
            if metres.is_finite() && metres > 0.0 { metres } else { f32::NAN }
        };
        Some(self.values_f32()?.into_iter().map(metres).collect())
    }

    /// The rows without what lies between them; of an image whose pixels have `bytes` bytes.
    fn rows(&self, bytes: usize) -> impl Iterator<Item = &[u8]> {
        let row = self.width as usize * bytes;
        self.data
            .chunks(self.step.max(1) as usize)
            .take(self.height as usize)
            .map(move |chunk| &chunk[..row.min(chunk.len())])
    }
}

/// An image as a compressed file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CompressedImage {
    /// Name of the camera's coordinate system.
    pub frame_id: String,
    /// What it is in the words of the file: `jpeg`, `png`, `16UC1; compressedDepth png`.
    pub format: String,
    /// The compressed file.
    pub data: Vec<u8>,
}
