//! The head of a frame: its planes, time and temperatures.

/// Bytes of a head.
pub(super) const HEAD: u64 = 128;

/// What a head says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Head {
    pub width: u16,
    pub height: u16,
    /// Which of [`Plane::ALL`] there are.
    has: [bool; 4],
    pub number: u32,
    pub mode: u8,
    pub frequencies: u8,
    /// Since the camera was started.
    pub time_ns: i64,
    pub sensor_c: i32,
    pub laser_c: i32,
}

impl Head {
    /// A head that makes sense; `None` where its values are no camera's.
    pub fn read(bytes: &[u8]) -> Option<Self> {
        let bytes = bytes.first_chunk::<{ HEAD as usize }>()?;
        let u16_at = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
        let u32_at = |at: usize| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
        let head = Self {
            width: u16_at(0),
            height: u16_at(2),
            has: [5, 6, 7, 19].map(|at| bytes[at] > 0),
            number: u32_at(12),
            mode: bytes[16],
            frequencies: bytes[18],
            // Seconds, and the 32-bit fraction of one.
            time_ns: i64::from(u32_at(24)) * 1_000_000_000 + ((u64::from(u32_at(20)) * 1_000_000_000) >> 32) as i64,
            sensor_c: u32_at(28) as i32,
            laser_c: u32_at(32) as i32,
        };
        let (configuration, bits) = (bytes[4], &bytes[5..8]);
        // Sensors have up to 1024 x 1024 pixels, three frequencies, and 16 bits a value.
        let sensible = (1..=4096).contains(&head.width)
            && (1..=4096).contains(&head.height)
            && configuration <= 7
            && bits.iter().all(|&bits| bits <= 16)
            && (head.has[0] || head.has[1])
            && head.frequencies <= 16
            && bytes[19] <= 1
            && [head.sensor_c, head.laser_c].iter().all(|celsius| (-100..=250).contains(celsius));
        sensible.then_some(head)
    }

    /// Bytes of all planes.
    pub fn planes_length(&self) -> u64 {
        let pixels = u64::from(self.width) * u64::from(self.height);
        self.planes().iter().map(|plane| pixels * plane.bytes()).sum()
    }

    /// The planes in the order of the file.
    pub fn planes(&self) -> Vec<Plane> {
        Plane::ALL.into_iter().zip(self.has).filter(|(_, is_there)| *is_there).map(|(plane, _)| plane).collect()
    }
}

/// A plane of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Plane {
    /// Ranges in millimetres, which the SDK calls depth.
    Depth,
    /// Active brightness.
    Brightness,
    Confidence,
    /// Points of three 16-bit millimetres.
    Points,
}

impl Plane {
    /// In the order of the file.
    const ALL: [Self; 4] = [Self::Depth, Self::Brightness, Self::Confidence, Self::Points];

    /// Bytes of a pixel.
    pub fn bytes(self) -> u64 {
        match self {
            Self::Depth | Self::Brightness => 2,
            Self::Confidence => 4,
            Self::Points => 6,
        }
    }
}

/// Whether a file begins with the head of a frame.
pub(crate) fn is_frame(beginning: &[u8]) -> bool {
    Head::read(beginning).is_some()
}
