//! Recordings of an Azure Kinect.

use std::path::PathBuf;

use recordings::{Ending, Format, Kind, Message, Payload, Recording};

use crate::common::mkv::{FIRST, OFFSET_NS, SECOND, block, element, open_element, recording, sample, segment};
use crate::common::{cut_everywhere, name, open, read};

fn values(message: &Message) -> Vec<u16> {
    let Payload::Image(image) = &message.payload else { panic!("{message:?}") };
    image.values_u16().unwrap()
}

#[test]
fn all_tracks_are_read() {
    let recording = open(&recording());
    assert_eq!(recording.format(), Format::Matroska);
    let streams: Vec<_> = recording.streams().iter().map(|stream| (stream.name.as_str(), stream.kind)).collect();
    let expected = [("COLOR", Kind::Colour), ("DEPTH", Kind::Depth), ("IR", Kind::Intensity), ("IMU", Kind::Imu)];
    assert_eq!(streams, expected);
    assert_eq!(recording.attachment("calibration.json"), Some(&b"{}"[..]));
    let property =
        |name: &str| recording.properties().iter().find(|(found, _)| found == name).map(|(_, value)| value.as_str());
    assert_eq!((property("recorder"), property("IR: K4A_IR_MODE")), (Some("k4arecord-1.4"), Some("ACTIVE")));

    let (found, recording) = read(&self::recording());
    let names: Vec<_> = found.iter().map(|message| name(&recording, message)).collect();
    assert_eq!(names, ["COLOR", "DEPTH", "IR", "IMU", "IMU", "IMU", "DEPTH"]);
    assert_eq!(
        (values(&found[1]), values(&found[2]), values(&found[6])),
        (FIRST.to_vec(), SECOND.to_vec(), SECOND.to_vec())
    );
    assert!(
        matches!(&found[0].payload, Payload::Compressed(image) if image.format == "jpeg" && image.data.len() == 10)
    );
    // Times are the device's: 33333 ticks of a microsecond less one for the last frame.
    let offset = OFFSET_NS as i64;
    assert_eq!((found[1].time_ns(), found[6].time_ns()), (offset, offset + 33_332_000));
    let Payload::Imu(imu) = &found[4].payload else { panic!() };
    assert_eq!((found[4].time_ns(), imu.angular_velocity_ns), (offset + 1_000_000, Some(offset + 1_007_000)));
    assert_eq!(imu.linear_acceleration.unwrap().value, [1.5, 9.75, 0.25]);
    assert_eq!(imu.angular_velocity.unwrap().value, [1.0, 0.125, -0.125]);
    assert_eq!(recording.ending(), Some(&Ending::Complete));
}

#[test]
fn without_the_tag_all_times_count_from_the_first_frame() {
    let bytes = [element(0x1A45_DFA3, &[]), open_element(0x1853_8067, &segment(false))].concat();
    let (found, recording) = read(&bytes);
    assert_eq!((found[1].time_ns(), found[6].time_ns()), (0, 33_332_000));
    assert_eq!((found[3].time_ns(), found[4].time_ns(), found[5].time_ns()), (0, 1_000_000, 2_000_000));
    // Nothing states its size or its length: the recorder was killed.
    assert!(matches!(recording.ending(), Some(Ending::CutOff { missing_bytes: None, .. })));
}

#[test]
fn every_cut_leaves_the_frames_before_it_and_tells_how_much_is_missing() {
    let bytes = recording();
    cut_everywhere(&bytes, 1);
    let (_, cut) = read(&bytes[..bytes.len() - 10]);
    assert!(matches!(cut.ending(), Some(Ending::CutOff { missing_bytes: Some(10), .. })));
}

#[test]
fn frames_laced_in_each_way_are_told_apart() {
    let samples = [sample(1, 0.0), sample(2, 1.0), sample(3, 2.0)];
    let data = samples.concat();
    // As a number of one byte, 40 is 0xA8; a difference of none is 0xBF.
    let ways: [(u8, Vec<u8>); 3] = [(0b100, vec![2]), (0b010, vec![2, 40, 40]), (0b110, vec![2, 0xA8, 0xBF])];
    for (flags, head) in ways {
        let laced = element(0xA3, &block(1, 0, flags, &[head, data.clone()].concat()));
        let track = [element(0xD7, &[1]), element(0x86, b"S_K4A/IMU"), element(0x536E, b"IMU")].concat();
        let segment = [element(0x1654_AE6B, &element(0xAE, &track)), element(0x1F43_B675, &laced)].concat();
        let (found, recording) = read(&[element(0x1A45_DFA3, &[]), element(0x1853_8067, &segment)].concat());
        assert_eq!(found.len(), 3, "{:?}", recording.faults());
        assert_eq!(found.iter().map(Message::time_ns).collect::<Vec<_>>(), [0, 1, 2]);
    }
}

#[test]
fn blocks_and_frames_that_do_not_fit_are_told() {
    let track = |number: u8, coding: &[u8]| {
        let mut private = vec![0; 40];
        private[16..20].copy_from_slice(coding);
        let size = element(0xE0, &[element(0xB0, &[3]), element(0xBA, &[2])].concat());
        let codec = [element(0x86, b"V_MS/VFW/FOURCC"), element(0x63A2, &private)].concat();
        element(0xAE, &[element(0xD7, &[number]), codec, element(0x536E, b"DEPTH"), size].concat())
    };
    let cluster = [
        element(0xA3, &block(1, 0, 0, &[0; 11])),
        element(0xA3, &block(9, 0, 0, &[0; 12])),
        element(0xA3, &block(1, 0, 0b100, &[4, 1, 2])),
        element(0xA3, &[0x81]),
        element(0xA3, &block(2, 0, 0, b"what it is")),
        element(0xA3, &block(3, 0, 0, &[0; 9])),
    ];
    let tracks = [track(1, b"b16g"), track(2, b"H264"), track(3, b"NV12")].concat();
    let segment = [element(0x1654_AE6B, &tracks), element(0x1F43_B675, &cluster.concat())].concat();
    let (found, recording) = read(&[element(0x1A45_DFA3, &[]), element(0x1853_8067, &segment)].concat());
    assert!(matches!(&found[0].payload, Payload::Unreadable(reason) if reason.contains("has 11 bytes, expected 12")));
    assert_eq!(found[1].payload, Payload::Bytes(b"what it is".to_vec()));
    assert!(matches!(&found[2].payload, Payload::Image(image) if image.data().len() == 9));
    let reasons: Vec<_> = recording.faults().iter().map(|fault| fault.reason.as_str()).collect();
    assert_eq!(reasons[0], "a block is of track 9, which is not listed");
    assert_eq!(reasons[1], "a block's frames do not fit into it");
    assert_eq!(reasons[2], "a block is shorter than its head");
}

/// A recording of a real camera, where it lies beside the project.
#[test]
fn a_real_recording_is_read_whole() {
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/real/azure_kinect_mug/recording.mkv");
    if !file.is_file() {
        println!("no real recording beside the project: skipped");
        return;
    }
    let mut recording = Recording::open(&file).unwrap();
    let mut names = Vec::new();
    while let Some(message) = recording.next_message().unwrap() {
        names.push(name(&recording, &message));
        match &message.payload {
            Payload::Image(image) => assert_eq!((image.width(), image.height()), (640, 576)),
            #[cfg(feature = "jpeg")]
            Payload::Compressed(image) => {
                let colour = image.decode_jpeg().unwrap();
                assert_eq!((colour.width(), colour.height()), (1280, 720));
            }
            // At rest: gravity, and next to no turn.
            Payload::Imu(imu) => {
                let norm = imu.linear_acceleration.unwrap().value.iter().map(|value| value * value).sum::<f64>().sqrt();
                assert!((norm - 9.81).abs() < 0.2, "{norm}");
            }
            other => panic!("{other:?}"),
        }
    }
    names.sort();
    assert_eq!(names, ["COLOR", "DEPTH", "IMU", "IR"]);
    assert!(recording.attachment("calibration.json").unwrap().starts_with(b"{"));
    assert_eq!(recording.ending(), Some(&Ending::Complete));
    assert!(recording.faults().is_empty());
}
