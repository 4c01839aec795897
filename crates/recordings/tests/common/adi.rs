//! Frames of ADI's cameras.

/// The head of a frame of 4 x 3 pixels.
pub fn head(number: u32, planes: [bool; 4]) -> Vec<u8> {
    let mut head = vec![0; 128];
    head[..4].copy_from_slice(&[4, 0, 3, 0]);
    head[4] = 7;
    for (at, bits, is_there) in [(5, 12, planes[0]), (6, 16, planes[1]), (7, 8, planes[2]), (19, 1, planes[3])] {
        head[at] = if is_there { bits } else { 0 };
    }
    head[12..16].copy_from_slice(&number.to_le_bytes());
    head[16..19].copy_from_slice(&[5, 3, 2]);
    // Half a second.
    head[20..24].copy_from_slice(&(1_u32 << 31).to_le_bytes());
    head[24..28].copy_from_slice(&number.to_le_bytes());
    head[28..32].copy_from_slice(&(30 + number as i32).to_le_bytes());
    head[32..36].copy_from_slice(&(-5_i32).to_le_bytes());
    head
}

pub fn values(start: u16) -> Vec<u8> {
    (0..12).flat_map(|index| (start + index).to_le_bytes()).collect()
}

pub fn frame(number: u32, planes: [bool; 4]) -> Vec<u8> {
    let mut frame = head(number, planes);
    let data = [values(500 + number as u16), values(90), vec![0; 48], vec![1; 72]];
    for (data, is_there) in data.into_iter().zip(planes) {
        if is_there {
            frame.extend(data);
        }
    }
    frame
}

/// Three frames with all planes.
pub fn bin() -> Vec<u8> {
    (0..3).flat_map(|number| frame(number, [true; 4])).collect()
}

/// Records of a head and of frames of 16 x 8 pixels, with heads in the brightness.
pub fn adcam(stated: u32, frames: u32) -> Vec<u8> {
    let record = |data: &[u8]| [&[0xFF; 4][..], &(data.len() as u32).to_le_bytes(), data].concat();
    let mut head = vec![0_u8; 664];
    let mut put = |at: usize, bytes: &[u8]| head[at..at + bytes.len()].copy_from_slice(bytes);
    put(0, &stated.to_le_bytes());
    put(4, &1_u32.to_le_bytes());
    put(8, &10_u16.to_le_bytes());
    put(10, &1_u16.to_le_bytes());
    put(12 + 9, &[2, 2]);
    put(12 + 12, &3_u16.to_le_bytes());
    put(12 + 14, &4_u16.to_le_bytes());
    for (index, value) in [100.0_f32, 100.0, 24.0, 20.0, 0.0, 0.0, 0.5].iter().enumerate() {
        put(44 + 4 * index, &value.to_le_bytes());
    }
    put(104, &16_u32.to_le_bytes());
    put(108, &8_u32.to_le_bytes());
    put(244, &3_u32.to_le_bytes());
    for (index, name) in ["depth", "ab", "metadata"].iter().enumerate() {
        put(248 + 52 * index, name.as_bytes());
    }
    let mut file = record(&head);
    for number in 0..frames {
        let depth: Vec<u8> = (0..128_u16).flat_map(|index| (index + number as u16).to_le_bytes()).collect();
        let mut brightness = vec![3; 256];
        brightness[..128].copy_from_slice(&self::head(number, [true, true, false, false]));
        file.extend(record(&[depth, brightness].concat()));
    }
    file
}
