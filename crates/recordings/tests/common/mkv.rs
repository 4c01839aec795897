//! Recordings of an Azure Kinect.

/// An element with a size of four bytes.
pub fn element(id: u32, data: &[u8]) -> Vec<u8> {
    let bytes = id.to_be_bytes();
    let mut element = bytes[(id.leading_zeros() / 8) as usize..].to_vec();
    element.extend((data.len() as u32 | 0x1000_0000).to_be_bytes());
    element.extend(data);
    element
}

/// A master whose size is left open.
pub fn open_element(id: u32, data: &[u8]) -> Vec<u8> {
    let mut element = id.to_be_bytes().to_vec();
    element.push(0xFF);
    element.extend(data);
    element
}

fn video(number: u8, name: &str, coding: [u8; 4]) -> Vec<u8> {
    let mut private = vec![0_u8; 40];
    private[16..20].copy_from_slice(&coding);
    let size = [element(0xB0, &[3]), element(0xBA, &[2])].concat();
    let parts = [
        element(0xD7, &[number]),
        element(0x73C5, &[number]),
        element(0x86, b"V_MS/VFW/FOURCC"),
        element(0x536E, name.as_bytes()),
        element(0x63A2, &private),
        element(0xE0, &size),
    ];
    element(0xAE, &parts.concat())
}

fn inertial(number: u8) -> Vec<u8> {
    let parts = [element(0xD7, &[number]), element(0x86, b"S_K4A/IMU"), element(0x536E, b"IMU")];
    element(0xAE, &parts.concat())
}

/// A block of one frame, or of several behind their lacing.
pub fn block(number: u8, ticks: i16, flags: u8, data: &[u8]) -> Vec<u8> {
    let mut block = vec![0x80 | number];
    block.extend(ticks.to_be_bytes());
    block.push(flags);
    block.extend(data);
    block
}

pub fn image(values: [u16; 6]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_be_bytes()).collect()
}

/// A sample of the inertial unit at a device's time in nanoseconds.
pub fn sample(time: u64, value: f32) -> Vec<u8> {
    let mut bytes = time.to_le_bytes().to_vec();
    bytes.extend([0.5 + value, 9.75, 0.25].iter().flat_map(|value| value.to_le_bytes()));
    bytes.extend((time + 7000).to_le_bytes());
    bytes.extend([value, 0.125, -0.125].iter().flat_map(|value| value.to_le_bytes()));
    bytes
}

/// Device's time of the first frame, nanosecond.
pub const OFFSET_NS: u64 = 5_000_000_000;

pub const FIRST: [u16; 6] = [1, 2, 3, 4, 5, 0x0102];
pub const SECOND: [u16; 6] = [10, 20, 30, 40, 0, 60];

fn tag(name: &str, value: &str, track: Option<u8>) -> Vec<u8> {
    let target = track.map_or_else(Vec::new, |uid| element(0x63C5, &[uid]));
    let simple = [element(0x45A3, name.as_bytes()), element(0x4487, value.as_bytes())].concat();
    element(0x7373, &[element(0x63C0, &target), element(0x67C8, &simple)].concat())
}

/// Two clusters; the first with colour, depth, infrared and three samples laced together, the second with depth alone.
/// `offset` says whether the tag with the device's time of zero is there.
pub fn segment(offset: bool) -> Vec<u8> {
    let samples: Vec<u8> = (0..3).flat_map(|index| sample(OFFSET_NS + 1_000_000 * index, index as f32)).collect();
    let laced = [vec![2], samples].concat();
    let group = element(0xA0, &[element(0xA1, &block(4, 0, 0b100, &laced)), element(0x9B, &[9])].concat());
    let first = [
        element(0xE7, &[0]),
        element(0xA3, &block(1, 0, 0x80, b"\xFF\xD8colour\xFF\xD9")),
        element(0xA3, &block(2, 0, 0x80, &image(FIRST))),
        element(0xA3, &block(3, 0, 0x80, &image(SECOND))),
        group,
    ];
    let second = [element(0xE7, &[0x82, 0x35]), element(0xA3, &block(2, -1, 0x80, &image(SECOND)))];
    let attached = [element(0x466E, b"calibration.json"), element(0x465C, b"{}")].concat();
    let tracks = [video(1, "COLOR", *b"MJPG"), video(2, "DEPTH", *b"b16g"), video(3, "IR", *b"b16g"), inertial(4)];
    let mut tags = tag("K4A_IR_MODE", "ACTIVE", Some(3));
    if offset {
        tags.extend(tag("K4A_START_OFFSET_NS", &OFFSET_NS.to_string(), None));
    }
    [
        element(0xEC, &[0; 9]),
        element(0x1549_A966, &[element(0x2A_D7B1, &[0x03, 0xE8]), element(0x5741, b"k4arecord-1.4")].concat()),
        element(0x1654_AE6B, &tracks.concat()),
        element(0x1941_A469, &element(0x61A7, &attached)),
        element(0x1254_C367, &tags),
        open_element(0x1F43_B675, &first.concat()),
        element(0x1F43_B675, &second.concat()),
    ]
    .concat()
}

/// A recording that was closed: its size is stated.
pub fn recording() -> Vec<u8> {
    [element(0x1A45_DFA3, &element(0x4282, b"matroska")), element(0x1853_8067, &segment(true))].concat()
}
