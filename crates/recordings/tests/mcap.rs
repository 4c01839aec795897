//! MCAP in and out.

use recordings::{Ending, Error, Format, Kind, McapWriter, Payload, Recording};

use crate::common::mcap::{channel, chunk, file, message, record, recording, schema, text, zstd};
use crate::common::{START_NS, camera, check, cut_everywhere, depth, imu, messages, name, open, read};

#[test]
fn what_is_written_comes_back() {
    let bytes = recording();
    let count = messages().len();
    let found = check(&bytes, count);
    assert_eq!(found.format(), Format::Mcap);
    assert_eq!(found.ending(), Some(&Ending::Complete));
    assert!(found.faults().is_empty());
    assert_eq!(found.properties()[0], ("profile".to_owned(), "ros2".to_owned()));
}

#[test]
fn the_index_tells_streams_before_the_first_message() {
    let recording = open(&recording());
    let streams: Vec<_> =
        recording.streams().iter().map(|stream| (stream.name.as_str(), stream.kind, stream.count)).collect();
    // What images show is known once one was seen.
    let expected = [
        ("/camera/depth/camera_info", Kind::CameraInfo, Some(1)),
        ("/camera/depth/image_raw", Kind::Image, Some(6)),
        ("/camera/ir/image_raw", Kind::Image, Some(6)),
        ("/imu", Kind::Imu, Some(18)),
    ];
    assert_eq!(streams, expected);
    let (_, recording) = read(&self::recording());
    assert_eq!(recording.streams()[1].kind, Kind::Depth);
    assert_eq!(recording.streams()[2].kind, Kind::Intensity);
}

#[test]
fn every_cut_leaves_the_messages_before_it() {
    cut_everywhere(&recording(), 1);
}

/// Many chunks: images of 64 KiB without a pattern.
#[test]
fn of_a_chunk_that_is_cut_off_the_first_messages_are_read() {
    let mut writer = McapWriter::new(Vec::new()).unwrap();
    let stream = writer.stream("/depth").unwrap();
    let mut state = 1_u32;
    for number in 0..40 {
        let values: Vec<u16> = (0..128 * 256)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 16) as u16
            })
            .collect();
        let image = recordings::Image::from_u16("", [256, 128], recordings::Encoding::Unsigned16, &values).unwrap();
        writer.message(stream, START_NS + number, &Payload::Image(image)).unwrap();
    }
    let bytes = writer.finish().unwrap();
    let (whole, _) = read(&bytes);
    assert_eq!(whole.len(), 40);
    // Chunks hold 16 images; 60 % of the file are one chunk and half of the second.
    let (found, cut) = read(&bytes[..bytes.len() * 6 / 10]);
    assert!(found.len() >= 22 && found.len() <= 24, "{}", found.len());
    assert_eq!(found, whole[..found.len()]);
    let Some(Ending::CutOff { missing_bytes: Some(missing), reason, .. }) = cut.ending() else { panic!() };
    assert!(*missing > 0 && reason.starts_with("a chunk promises"), "{reason}");
}

/// The same message in records of the file itself, in stored chunks and in Zstandard.
#[test]
fn chunks_of_each_compression_are_read() {
    let image = open_image();
    let records = [schema(1, "sensor_msgs/msg/Image"), channel(3, 1, "/depth", "cdr"), message(3, 5, &image)].concat();
    let lz4 = lz4(&records);
    let files = [
        file(std::slice::from_ref(&records)),
        file(&[chunk("", &records, &records, 0)]),
        file(&[chunk("", &records, &records, crc32(&records))]),
        file(&[chunk("zstd", &records, &zstd(&records), 0)]),
        file(&[chunk("lz4", &records, &lz4, 0)]),
    ];
    for bytes in files {
        let (found, recording) = read(&bytes);
        assert_eq!(recording.ending(), Some(&Ending::Complete));
        assert!(recording.faults().is_empty(), "{:?}", recording.faults());
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].payload, depth(4));
        assert_eq!((found[0].logged_ns, found[0].stamp_ns), (5, Some(START_NS)));
    }
}

#[test]
fn chunks_that_are_not_what_they_say_are_passed_over() {
    let records =
        [schema(1, "sensor_msgs/msg/Image"), channel(3, 1, "/depth", "cdr"), message(3, 5, &open_image())].concat();
    let good = chunk("", &records, &records, 0);
    let bad = [
        (chunk("", &records, &records, 17), "does not have the checksum"),
        (chunk("zstd", &records, &zstd(&records[9..]), 0), "were stated"),
        (chunk("lz4", &records, b"nothing of that", 0), "a chunk"),
        (chunk("snappy", &records, &records, 0), "is compressed as `snappy`, which is not read"),
        (record(6, &[1, 2, 3]), "shorter than its head"),
    ];
    for (chunk, words) in bad {
        let (found, recording) = read(&file(&[chunk, good.clone()]));
        assert_eq!(found.len(), 1);
        assert_eq!(recording.faults().len(), 1);
        assert!(recording.faults()[0].reason.contains(words), "{:?}", recording.faults());
        assert_eq!(recording.ending(), Some(&Ending::Complete));
    }
}

#[test]
fn messages_without_a_channel_and_damaged_messages_are_told() {
    let bytes = file(&[
        schema(1, "sensor_msgs/msg/Image"),
        channel(3, 1, "/depth", "cdr"),
        channel(4, 0, "/words", "json"),
        message(9, 5, b""),
        message(3, 6, &[0, 1, 0, 0, 1]),
        message(3, 7, &[0, 7, 0, 0, 1]),
        message(4, 8, b"{}"),
        record(
            0x0C,
            &[text("camera"), (text("serial").len() as u32 + 7).to_le_bytes().to_vec(), text("serial"), text("123")]
                .concat(),
        ),
        record(
            9,
            &[&[0; 16][..], &text("notes.txt"), &text("text/plain"), &2_u64.to_le_bytes(), b"hi", &[0; 4]].concat(),
        ),
    ]);
    let (found, recording) = read(&bytes);
    let payloads: Vec<_> = found.iter().map(|message| message.payload.clone()).collect();
    assert!(matches!(&payloads[0], Payload::Unreadable(reason) if reason == "ends before its field `header.stamp`"));
    assert!(
        matches!(&payloads[1], Payload::Unreadable(reason) if reason.contains("encoded as 0007, expected plain CDR"))
    );
    assert_eq!(payloads[2], Payload::Bytes(b"{}".to_vec()));
    assert_eq!(name(&recording, &found[2]), "/words");
    assert!(recording.faults()[0].reason.contains("channel 9, which is not defined"));
    assert_eq!(recording.properties().last().unwrap(), &("camera: serial".to_owned(), "123".to_owned()));
    assert_eq!(recording.attachment("notes.txt"), Some(&b"hi"[..]));
}

#[test]
fn damage_in_a_file_that_was_closed_is_no_cut() {
    let mut bytes = recording();
    // The length of the first chunk, behind the magic and the header.
    let header = 8 + 9 + u64::from_le_bytes(bytes[9..17].try_into().unwrap()) as usize;
    bytes[header + 8] = 0x7F;
    let (found, recording) = read(&bytes);
    assert!(found.is_empty());
    let Some(Ending::Damaged { at_byte, unread_bytes, .. }) = recording.ending() else { panic!() };
    assert_eq!((*at_byte as usize, *unread_bytes as usize), (header, bytes.len() - header));
}

#[test]
fn what_has_no_place_in_a_recording_is_refused() {
    let mut writer = McapWriter::new(Vec::new()).unwrap();
    let stream = writer.stream("/depth").unwrap();
    let message = |error: Error| error.to_string();
    assert!(message(writer.message(stream, -1, &depth(0)).unwrap_err()).contains("expected 0 to 2147483647 s"));
    assert!(
        message(writer.message(stream, i64::MAX, &depth(0)).unwrap_err()).contains("is of 9223372036 s since 1970")
    );
    assert!(
        message(writer.message(stream, 0, &Payload::Bytes(Vec::new())).unwrap_err()).contains("has no type in ROS")
    );
    writer.message(stream, 0, &depth(0)).unwrap();
    let other = message(writer.message(stream, 0, &imu(0.0)).unwrap_err());
    assert_eq!(other, "message: is sensor_msgs/msg/Imu, but its stream `/depth` has sensor_msgs/msg/Image");
    assert_eq!(writer.stream("/depth").unwrap(), stream);
    writer.message(stream, 1, &depth(1)).unwrap();
    let (found, _) = read(&writer.finish().unwrap());
    assert_eq!(found.len(), 2);
}

#[test]
fn an_empty_recording_is_complete() {
    let (found, recording) = read(&McapWriter::new(Vec::new()).unwrap().finish().unwrap());
    assert!(found.is_empty() && recording.streams().is_empty());
    assert_eq!(recording.ending(), Some(&Ending::Complete));
}

#[test]
fn other_files_are_refused_by_what_they_begin_with() {
    let message =
        |bytes: &[u8]| Recording::from_reader("x.mcap", std::io::Cursor::new(bytes.to_vec())).unwrap_err().to_string();
    assert_eq!(message(b"\x89MCAP1\r\n"), "x.mcap: is MCAP of another version than 0, which is read");
    let expected = "x.mcap: is no recording that is known: expected MCAP, a ROS 1 bag, Matroska or frames of ADI";
    assert_eq!(message(b"ply\nformat"), expected);
    assert_eq!(message(b""), expected);
    let folder = tempfile::tempdir().unwrap();
    assert!(Recording::open(folder.path()).unwrap_err().to_string().ends_with("is no regular file"));
    assert!(Recording::open(folder.path().join("none")).unwrap_err().to_string().contains("cannot open"));
}

/// Temperatures and compressed images go the same way.
#[test]
fn further_types_come_back() {
    let image =
        recordings::CompressedImage { frame_id: "c".to_owned(), format: "jpeg".to_owned(), data: vec![1, 2, 3] };
    let place = |child: &str, x: f64| recordings::Transform {
        parent: "world".to_owned(),
        child: child.to_owned(),
        translation_m: [x, -2.0, 0.5],
        rotation: [0.0, 0.6, 0.0, 0.8],
    };
    let places = Payload::Transforms(vec![place("camera", 1.0), place("robot", -3.0)]);
    let payloads = [camera(), Payload::Temperature(36.5), Payload::Compressed(image), places];
    let mut writer = McapWriter::new(Vec::new()).unwrap();
    for (index, payload) in payloads.iter().enumerate() {
        let stream = writer.stream(&format!("/{index}")).unwrap();
        writer.message(stream, 1 + index as i64, payload).unwrap();
    }
    let (found, recording) = read(&writer.finish().unwrap());
    assert!(found.iter().zip(&payloads).all(|(found, written)| found.payload == *written));
    let kinds: Vec<_> = recording.streams().iter().map(|stream| stream.kind).collect();
    assert_eq!(kinds, [Kind::CameraInfo, Kind::Temperature, Kind::Colour, Kind::Transforms]);
    assert_eq!(found[3].stamp_ns, Some(4));
}

/// The bytes of a message, from a recording of its own.
fn open_image() -> Vec<u8> {
    let mut bytes = vec![0, 1, 0, 0];
    let mut put = |values: &[u8]| bytes.extend(values);
    put(&1_700_000_000_u32.to_le_bytes());
    put(&0_u32.to_le_bytes());
    put(&13_u32.to_le_bytes());
    put(b"camera_depth\0\0\0\0");
    put(&3_u32.to_le_bytes());
    put(&4_u32.to_le_bytes());
    put(&6_u32.to_le_bytes());
    // The encoding, its zero, the order of bytes, and one to fill up.
    put(b"16UC1\0\0\0");
    put(&8_u32.to_le_bytes());
    put(&24_u32.to_le_bytes());
    let Payload::Image(image) = depth(4) else { panic!() };
    put(image.data());
    bytes
}

/// The same message with the highest byte first.
#[test]
fn big_endian_messages_are_read() {
    let little = open_image();
    let mut big = little.clone();
    big[1] = 0;
    for at in [4, 8, 12, 32, 36, 40, 52, 56] {
        big[at..at + 4].reverse();
    }
    let parts =
        |bytes: &[u8]| file(&[schema(1, "sensor_msgs/msg/Image"), channel(3, 1, "/d", "cdr"), message(3, 5, bytes)]);
    assert_eq!(read(&parts(&little)).0, read(&parts(&big)).0);
}

fn lz4(bytes: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

/// CRC-32 bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0_u32, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 })
    })
}
