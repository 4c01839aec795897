//! Depth images in PNG and Matroska, and the factory calibration that comes with them.
#![cfg(all(feature = "png16", feature = "mkv", feature = "azure", feature = "survey"))]
// What goes through a file comes back to the last bit.

use crate::common;
use std::io::Cursor;
use std::path::Path;

use proptest::prelude::*;
use range_image::Raster;
use range_io::azure::{self, DepthMode};
use range_io::mkv::{DEPTH, INFRARED, Recording};
use range_io::png16;
use range_io::survey::{InputFrame, Survey, read_frame};

fn survey(width: usize, height: usize, file: &str) -> Survey {
    let text = format!(
        "(camera: (width: {width}, height: {height}, pixel_pitch_mm: (0.0035, 0.0035), principal_distance_mm: 1.8,
        principal_point_mm: (0, 0)), level: depth, depth: (scale_m: 0.001, invalid: [0, 65535]),
        frames: [(file: \"{file}\", station: \"S0\")])"
    );
    Survey::parse(Path::new("survey.ron"), &text).unwrap()
}

fn depth_of(frame: InputFrame) -> (Raster<f32>, Option<Raster<f32>>) {
    let InputFrame::Depth { depth, amplitude, .. } = frame else { panic!("level") };
    (depth, amplitude)
}

proptest! {
    #![proptest_config(common::cases(24))]

    #[test]
    fn images_come_back(width in 1_usize..20, height in 1_usize..20, seed in any::<u16>()) {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("depth.png");
        let image = Raster::from_fn(width, height, |col, row| (col * 7919 + row * 104_729) as u16 ^ seed);
        png16::write(&file, &image).unwrap();
        prop_assert_eq!(&png16::read(&file).unwrap(), &image);
    }
}

#[test]
fn stored_depths_become_metres_and_invalid_ones_nan() {
    let folder = tempfile::tempdir().unwrap();
    let image = Raster::from_vec(2, 2, vec![0, 1500, 65535, 3]).unwrap();
    png16::write(folder.path().join("depth.png"), &image).unwrap();
    let survey = survey(2, 2, "depth.png");
    let (depth, amplitude) = depth_of(read_frame(&survey, folder.path(), 0).unwrap());
    assert!(depth[(0, 0)].is_nan() && depth[(0, 1)].is_nan() && amplitude.is_none());
    assert_eq!((depth[(1, 0)], depth[(1, 1)]), (1.5, 0.003));
    let message = |survey: &Survey| read_frame(survey, folder.path(), 0).unwrap_err().to_string();
    assert!(message(&self::survey(3, 2, "depth.png")).ends_with("depth.png: has 2 x 2 pixels, expected 3 x 2"));
    let without = Survey { depth: None, ..survey.clone() };
    assert!(message(&without).contains("survey.ron must say `depth: (scale_m: .., invalid: ..)`"));
    let range = Survey { level: range_io::survey::Level::Range, depth: None, ..survey.clone() };
    assert!(message(&range).contains("holds depths, but the survey's level is `range`"));
    png16::write(folder.path().join("depth.png"), &Raster::filled(2, 2, 0)).unwrap();
    assert!(message(&survey).contains("holds only values that mean no depth"));
    // The same integers in an array.
    let mut writer = range_io::npz::NpzWriter::create(folder.path().join("depth.npz")).unwrap();
    writer.add("depth", &[2, 2], image.as_slice()).unwrap();
    writer.commit().unwrap();
    let (same, _) = depth_of(read_frame(&self::survey(2, 2, "depth.npz"), folder.path(), 0).unwrap());
    assert_eq!((same[(1, 0)], same[(0, 1)].is_nan()), (1.5, true));
}

#[test]
fn a_folder_of_images_with_other_names_says_what_it_lacks() {
    let folder = tempfile::tempdir().unwrap();
    png16::write(folder.path().join("00000.png"), &Raster::filled(2, 2, 1)).unwrap();
    let refused = Survey::read(folder.path()).unwrap_err().to_string();
    assert!(refused.contains("survey.ron") && refused.contains("depth.txt"), "{refused}");
}

#[test]
fn other_and_cut_images_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("depth.png");
    png16::write(&file, &Raster::from_fn(5, 4, |col, row| (col * 1000 + row) as u16)).unwrap();
    let bytes = std::fs::read(&file).unwrap();
    for length in 0..bytes.len() {
        std::fs::write(&file, &bytes[..length]).unwrap();
        // The pixels are all there once the last byte of the image data has come; the closing chunk adds nothing.
        assert!(png16::read(&file).is_err() || length >= bytes.len() - 16, "cut at {length}");
    }
    let mut eight = Vec::new();
    let mut writer = png::Encoder::new(&mut eight, 2, 2).write_header().unwrap();
    writer.write_image_data(&[0; 4]).unwrap();
    writer.finish().unwrap();
    std::fs::write(&file, &eight).unwrap();
    let message = png16::read(&file).unwrap_err().to_string();
    assert!(message.contains("Grayscale with Eight bits, expected one channel with sixteen"), "{message}");
    assert!(png16::write(&file, &Raster::<u16>::filled(0, 0, 0)).is_err());
}

/// An element with a size of one to four bytes.
fn element(id: u32, data: &[u8]) -> Vec<u8> {
    let bytes = id.to_be_bytes();
    let mut element = bytes[(id.leading_zeros() / 8) as usize..].to_vec();
    element.extend((data.len() as u32 | 0x1000_0000).to_be_bytes());
    element.extend(data);
    element
}

/// A master whose size is left open.
fn open_element(id: u32, data: &[u8]) -> Vec<u8> {
    let mut element = id.to_be_bytes().to_vec();
    element.push(0xFF);
    element.extend(data);
    element
}

fn track(number: u8, name: &str) -> Vec<u8> {
    let mut private = vec![0_u8; 40];
    private[16..20].copy_from_slice(b"b16g");
    let video = [element(0xB0, &[3]), element(0xBA, &[2])].concat();
    let parts = [
        element(0xD7, &[number]),
        element(0x86, b"V_MS/VFW/FOURCC"),
        element(0x536E, name.as_bytes()),
        element(0x63A2, &private),
        element(0xE0, &video),
    ];
    element(0xAE, &parts.concat())
}

fn block(number: u8, time: i16, image: &[u16]) -> Vec<u8> {
    let mut data = vec![0x80 | number];
    data.extend(time.to_be_bytes());
    data.push(0x80);
    data.extend(image.iter().flat_map(|value| value.to_be_bytes()));
    data
}

const FIRST: [u16; 6] = [1, 2, 3, 4, 5, 0x0102];
const SECOND: [u16; 6] = [10, 20, 30, 40, 50, 60];

/// Two depth frames, one with an infrared image: the first in a block group, the rest in simple blocks.
fn recording() -> Vec<u8> {
    let group = element(0xA0, &element(0xA1, &block(1, 5, &FIRST)));
    let first = [element(0xE7, &[0x03, 0xE8]), group, element(0xA3, &block(2, 5, &SECOND))].concat();
    let second = [element(0xE7, &[0x07, 0xD0]), element(0xA3, &block(1, -1, &SECOND))].concat();
    let attached = [element(0x466E, b"calibration.json"), element(0x465C, b"{}")].concat();
    let segment = [
        element(0xEC, &[0; 9]),
        element(0x1549_A966, &element(0x2A_D7B1, &[0x0F, 0x42, 0x40])),
        element(0x1654_AE6B, &[track(1, "DEPTH"), track(2, "IR")].concat()),
        element(0x1941_A469, &element(0x61A7, &attached)),
        open_element(0x1F43_B675, &first),
        element(0x1F43_B675, &second),
    ];
    [element(0x1A45_DFA3, &[0; 4]), open_element(0x1853_8067, &segment.concat())].concat()
}

fn open(bytes: &[u8]) -> Result<Recording<Cursor<&[u8]>>, range_io::Error> {
    Recording::new("memory.mkv", Cursor::new(bytes))
}

#[test]
fn recordings_are_read_with_open_and_closed_sizes() {
    let bytes = recording();
    let mut recording = open(&bytes).unwrap();
    assert_eq!((recording.frames(DEPTH), recording.frames(INFRARED), recording.frames("COLOR")), (2, 1, 0));
    assert_eq!(recording.attachment("calibration.json"), Some(b"{}".as_slice()));
    let first = recording.depth_frame(0).unwrap();
    assert_eq!((first.depth.width(), first.depth.height(), first.depth.as_slice()), (3, 2, FIRST.as_slice()));
    assert_eq!(first.infrared.unwrap().as_slice(), SECOND);
    // 1000 + 5 ticks of a millisecond.
    assert!((first.timestamp_s - 1.005).abs() < 1e-12);
    let second = recording.depth_frame(1).unwrap();
    assert_eq!((second.depth.as_slice(), second.infrared), (SECOND.as_slice(), None));
    let message = recording.depth_frame(2).unwrap_err().to_string();
    assert_eq!(message, "memory.mkv: has 2 depth frames; number 2 (from 0) is asked for");
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("r.mkv"), &bytes).unwrap();
    let (depth, _) = depth_of(read_frame(&survey(3, 2, "r.mkv#1"), folder.path(), 0).unwrap());
    assert_eq!(depth.as_slice(), [0.01, 0.02, 0.03, 0.04, 0.05, 0.06]);
}

#[test]
fn other_codings_and_sizes_are_refused() {
    let fault = |from: &[u8], to: &[u8]| {
        let mut bytes = recording();
        let at = bytes.windows(from.len()).position(|window| window == from).unwrap();
        bytes[at..at + to.len()].copy_from_slice(to);
        open(&bytes).and_then(|mut recording| recording.depth_frame(0)).unwrap_err().to_string()
    };
    assert!(fault(b"b16g", b"YUY2").contains("track `DEPTH` is coded as V_MS/VFW/FOURCC `YUY2`"));
    assert!(fault(b"DEPTH", b"DEEPS").contains("has no track `DEPTH`, only `DEEPS`, `IR`"));
    // The last byte of the first track's height.
    let height = element(0xBA, &[2]);
    assert!(fault(&height, &element(0xBA, &[3])).contains("image of 12 bytes, expected 18 for 3 x 3"));
    assert!(fault(&height, &element(0xBA, &[0])).contains("has 3 x 0 pixels"));
    assert!(fault(&[0x81, 0, 5, 0x80], &[0x81, 0, 5, 0x86]).contains("lacing"));
}

#[test]
fn recordings_cut_or_damaged_anywhere_do_not_panic() {
    let bytes = recording();
    let whole = open(&bytes).unwrap().depth_frame(1).unwrap();
    for length in 0..bytes.len() {
        let cut = open(&bytes[..length]).and_then(|mut recording| recording.depth_frame(1));
        assert!(cut.is_err(), "cut at {length}");
    }
    for at in 0..bytes.len() {
        for value in [0x00, 0x01, 0x7F, 0x80, 0xFF] {
            let mut damaged = bytes.clone();
            damaged[at] = value;
            // A damaged recording is refused or read; where it is read, images have their size.
            if let Ok(frame) = open(&damaged).and_then(|mut recording| recording.depth_frame(1)) {
                assert_eq!(frame.depth.len(), whole.depth.len(), "damaged at {at}");
            }
        }
    }
}

#[test]
fn a_real_recording_is_read() {
    let Some(folder) = common::real("azure_kinect_mug") else { return };
    let mut recording = Recording::open(folder.join("recording.mkv")).unwrap();
    let names: Vec<_> = recording.tracks().iter().map(|track| track.name.as_str()).collect();
    assert_eq!(names, ["COLOR", "DEPTH", "IR", "IMU"]);
    let frame = recording.depth_frame(0).unwrap();
    let infrared = frame.infrared.unwrap();
    // Sizes and meaning as SOURCE.txt has them, values as an independent reader of the same bytes gave them.
    assert_eq!((frame.depth.width(), frame.depth.height(), infrared.width(), infrared.height()), (640, 576, 640, 576));
    assert_eq!((frame.depth[(320, 100)], frame.depth[(100, 288)], frame.depth[(600, 500)]), (2135, 823, 0));
    let sum = |image: &Raster<u16>| image.as_slice().iter().map(|&value| u64::from(value)).sum::<u64>();
    assert_eq!((sum(&frame.depth), sum(&infrared)), (380_924_829, 1_041_828_584));
    assert_eq!(frame.depth.as_slice().iter().filter(|&&value| value == 0).count(), 86_695);
    assert_eq!(infrared.as_slice().iter().filter(|&&value| value == 65535).count(), 9809);
    let (depth, amplitude) = depth_of(read_frame(&survey(640, 576, "recording.mkv"), &folder, 0).unwrap());
    assert_eq!((depth[(320, 100)], amplitude.unwrap()[(320, 100)]), (2.135, f32::from(infrared[(320, 100)])));
    let attached = std::str::from_utf8(recording.attachment("calibration.json").unwrap()).unwrap().to_owned();
    assert!(azure::parse(Path::new("attached"), &attached, DepthMode::NarrowUnbinned).is_ok());
}

#[test]
fn a_real_depth_png_is_read() {
    let Some(folder) = common::real("redwood_rgbd5/depth") else { return };
    let image = png16::read(folder.join("00000.png")).unwrap();
    assert_eq!((image.width(), image.height()), (640, 480));
    let mut valid: Vec<_> = image.as_slice().iter().copied().filter(|&value| value > 0).collect();
    valid.sort_unstable();
    // A living room in millimetres.
    assert!((500..5000).contains(&valid[valid.len() / 2]), "{}", valid[valid.len() / 2]);
}

#[test]
fn a_factory_calibration_is_read() {
    let Some(folder) = common::real("azure_kinect_mug") else { return };
    let file = folder.join("calibration.json");
    let narrow = azure::read(&file, DepthMode::NarrowUnbinned).unwrap();
    assert_eq!((narrow.width, narrow.height), (640, 576));
    // By hand from the file: 0.51296979 * 1024 - 192 - 0.5 and so on.
    let expected = [504.607_635_5, 504.732_513_4, 332.781_066_9, 348.829_711_9];
    let [fx, fy] = narrow.focal_px;
    let [cx, cy] = narrow.principal_point_px;
    for (found, expected) in [fx, fy, cx, cy].into_iter().zip(expected) {
        assert!((found - expected).abs() < 1e-6, "{found} {expected}");
    }
    // The file's numbers are single precision written with the digits of a double.
    let single =
        [narrow.radial[0], narrow.radial[5], narrow.decentring[0], narrow.decentring[1]].map(|value| value as f32);
    assert_eq!(single, [0.547_939_8, -0.013_910_385, 2.055_753_4E-5, -7.210_416E-5]);
    // Two by two pixels in one: half the focal length, and centres half a binned pixel apart.
    let binned = azure::read(&file, DepthMode::NarrowBinned).unwrap();
    assert!((2.0 * binned.focal_px[0] - fx).abs() < 1e-9);
    assert!((2.0 * (binned.principal_point_px[0] + 0.5) - (cx + 0.5)).abs() < 1e-9);
    let text = std::fs::read_to_string(&file).unwrap();
    let fault = |from: &str, to: &str| {
        azure::parse(Path::new("c.json"), &text.replacen(from, to, 1), DepthMode::NarrowUnbinned)
            .unwrap_err()
            .to_string()
    };
    assert!(fault("CALIBRATION_CameraLocationD0", "D1").contains("no camera at CALIBRATION_CameraLocationD0"));
    assert!(fault("0.51296979188919067,", "").contains("has 13 parameters of the depth camera, expected 14"));
    assert!(fault("0.4927808940410614", "0").contains("are no camera's"));
    assert!(fault("BrownConrady", "Other").contains("expected CALIBRATION_LensDistortionModelBrownConrady"));
    assert!(fault("{", "{{").starts_with("c.json:1:2: "));
}
