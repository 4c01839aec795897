//! Bags of ROS 1.

use recordings::{Ending, Format, Kind, Recording};

use crate::common::bag::recording;
use crate::common::{check, cut_everywhere, messages, open, read};

#[test]
fn bags_stored_and_in_lz4_are_read() {
    for compression in ["none", "lz4"] {
        let found = check(&recording(compression), messages().len());
        assert_eq!(found.format(), Format::Bag);
        assert_eq!(found.ending(), Some(&Ending::Complete));
        assert!(found.faults().is_empty());
    }
}

#[test]
fn the_index_tells_streams_and_counts() {
    let recording = open(&recording("lz4"));
    let streams: Vec<_> =
        recording.streams().iter().map(|stream| (stream.name.as_str(), stream.kind, stream.count)).collect();
    let expected = [
        ("/camera/depth/camera_info", Kind::CameraInfo, Some(1)),
        ("/camera/depth/image_raw", Kind::Image, Some(6)),
        ("/camera/ir/image_raw", Kind::Image, Some(6)),
        ("/imu", Kind::Imu, Some(18)),
    ];
    assert_eq!(streams, expected);
}

#[test]
fn every_cut_leaves_the_messages_before_it_and_tells_how_much_is_missing() {
    for compression in ["none", "lz4"] {
        let bytes = recording(compression);
        cut_everywhere(&bytes, 3);
        let (_, cut) = read(&bytes[..bytes.len() / 2]);
        let Some(Ending::CutOff { missing_bytes: Some(missing), .. }) = cut.ending() else { panic!() };
        // The header says where the index begins: all before it is missing.
        assert!(*missing > bytes.len() as u64 / 4, "{missing}");
    }
}

#[test]
fn a_bag_that_was_not_closed_is_read_to_its_end() {
    let mut bytes = recording("lz4");
    let place = bytes.windows(10).position(|window| window == b"index_pos=").unwrap() + 10;
    let index = u64::from_le_bytes(bytes[place..place + 8].try_into().unwrap()) as usize;
    bytes[place..place + 8].fill(0);
    bytes.truncate(index);
    let (found, recording) = read(&bytes);
    assert_eq!(found.len(), messages().len());
    let Some(Ending::CutOff { missing_bytes: None, reason, .. }) = recording.ending() else { panic!() };
    assert!(reason.starts_with("the bag was not closed"));
}

#[test]
fn what_is_not_read_is_said() {
    let bytes = recording("bz2");
    let (found, recording) = read(&bytes);
    assert!(found.is_empty());
    assert!(recording.faults()[0].reason.contains("is compressed as `bz2`, which is not read"));
    let old = Recording::from_reader("old.bag", std::io::Cursor::new(b"#ROSBAG V1.2\n".to_vec())).unwrap_err();
    assert_eq!(old.to_string(), "old.bag: is a bag of another version than 2.0, which is read");
}
