//! The format of frames.

use std::io::Cursor;
use std::time::Instant;

use live_tasks::range_image::Samples;
use live_tasks::{FrameError, FrameHeader, FrameStream, LiveFrame, SampleType, write_live_frame};
use proptest::prelude::*;

use crate::common::bytes;

fn frame(samples: Samples, timestamp_s: f64) -> LiveFrame {
    let header = FrameHeader {
        sample_type: SampleType::of(&samples),
        width: 3,
        height: 2,
        frequencies: 1,
        phase_steps: 4,
        timestamp_s,
        integration_time_s: Some(0.002),
        temperature_c: None,
    };
    LiveFrame { header, samples, arrived: Instant::now() }
}

fn three() -> Vec<LiveFrame> {
    let samples = [
        Samples::U16((0..24).map(|k| 1000 + 77 * k).collect()),
        Samples::I16((0..24).map(|k| 500 - 77 * k).collect()),
        Samples::F32((0..24).map(|k| 0.25 * k as f32 - 3.0).collect()),
    ];
    samples.into_iter().zip([1.0, 1.5, 2.0]).map(|(samples, time_s)| frame(samples, time_s)).collect()
}

fn stream(bytes: &[u8]) -> FrameStream<Cursor<Vec<u8>>> {
    FrameStream::new(Cursor::new(bytes.to_vec()))
}

/// All frames up to the end or the first error.
fn read(bytes: &[u8]) -> (Vec<LiveFrame>, Option<FrameError>) {
    let mut stream = stream(bytes);
    let mut found = Vec::new();
    loop {
        match stream.next_frame(None) {
            Ok(Some(frame)) => found.push(frame),
            Ok(None) => return (found, None),
            Err(error) => return (found, Some(error)),
        }
    }
}

#[test]
fn frames_come_back_as_they_were_written() {
    let frames = three();
    let sent: Vec<u8> = frames.iter().flat_map(bytes).collect();
    let (found, error) = read(&sent);
    assert!(error.is_none() && found.len() == 3);
    for (found, frame) in found.iter().zip(&frames) {
        assert_eq!((&found.header, &found.samples), (&frame.header, &frame.samples));
    }
}

#[test]
fn a_header_has_the_bytes_that_the_documentation_says() {
    let sent = bytes(&three()[0]);
    assert_eq!(sent.len(), 64 + 48);
    assert_eq!(&sent[..24], b"RCLF\x01\0\x01\0\x03\0\0\0\x02\0\0\0\x01\0\x04\0\0\0\0\0");
    assert_eq!(sent[24..32], 1.0_f64.to_le_bytes());
    assert_eq!(sent[32..40], 0.002_f64.to_le_bytes());
    assert!(f64::from_le_bytes(sent[40..48].try_into().unwrap()).is_nan());
    assert_eq!(sent[48..56], 48_u64.to_le_bytes());
    assert_eq!(sent[56..64], [0; 8]);
    assert_eq!(sent[64..66], 1000_u16.to_le_bytes());
}

#[test]
fn each_field_that_means_nothing_is_named_with_its_place() {
    let good: Vec<u8> = three().iter().flat_map(bytes).collect();
    for (at, value, field) in [
        (0, b"RCLX".to_vec(), "head"),
        (4, vec![2, 0], "version"),
        (6, vec![4, 0], "sample type"),
        (8, vec![0; 4], "columns"),
        (8, vec![1, 0x10, 0, 0], "columns"),
        (12, vec![0xff; 4], "rows"),
        (16, vec![0, 0], "frequencies"),
        (16, vec![17, 0], "phase steps"),
        (18, vec![0, 0], "phase steps"),
        (20, vec![1, 0, 0, 0], "reserved"),
        (24, f64::NAN.to_le_bytes().to_vec(), "time stamp"),
        (32, (-1.0_f64).to_le_bytes().to_vec(), "integration time"),
        (40, f64::INFINITY.to_le_bytes().to_vec(), "temperature"),
        (48, 49_u64.to_le_bytes().to_vec(), "bytes of samples"),
        (48, u64::MAX.to_le_bytes().to_vec(), "bytes of samples"),
        (63, vec![1], "reserved"),
    ] {
        // In the second frame, which begins at byte 112.
        let mut bad = good.clone();
        bad[112 + at..112 + at + value.len()].copy_from_slice(&value);
        let (found, error) = read(&bad);
        let error = error.unwrap();
        assert!(found.len() == 1 && matches!(error, FrameError::Field { .. }), "{field}: {error}");
        let words = error.to_string();
        assert!(words.contains(field), "{field}: {words}");
        let place: usize = words.trim_start_matches("byte ").split(':').next().unwrap().parse().unwrap();
        assert!((112..176).contains(&place), "{words}");
    }
}

#[test]
fn a_stream_that_is_cut_off_keeps_what_came() {
    let sent: Vec<u8> = three().iter().flat_map(bytes).collect();
    let ends = [0, 112, 224, 384];
    for length in 0..=sent.len() {
        let (found, error) = read(&sent[..length]);
        let whole = ends.iter().filter(|end| **end <= length).count() - 1;
        assert_eq!(found.len(), whole, "{length}");
        match error {
            None => assert!(ends.contains(&length)),
            Some(FrameError::CutOff { position, missing, .. }) => {
                assert_eq!(position as usize, length);
                let in_frame = length - ends[whole];
                let expected = if in_frame < 64 { 64 - in_frame } else { ends[whole + 1] - length };
                assert_eq!(missing as usize, expected, "{length}");
            }
            Some(other) => panic!("{length}: {other}"),
        }
    }
}

#[test]
fn memory_is_used_again() {
    let (one, other) = (three().remove(0), three().remove(0));
    let sent = [bytes(&one), bytes(&other)].concat();
    let mut stream = stream(&sent);
    let first = stream.next_frame(None).unwrap().unwrap();
    let address = |frame: &LiveFrame| match &frame.samples {
        Samples::U16(values) => values.as_ptr() as usize,
        _ => 0,
    };
    let before = address(&first);
    let second = stream.next_frame(Some(first)).unwrap().unwrap();
    assert_eq!(address(&second), before);
}

#[test]
fn what_the_format_has_no_room_for_is_not_written() {
    let frame = &three()[0];
    let mut out = Vec::new();
    for header in [
        FrameHeader { width: 4, ..frame.header },
        FrameHeader { sample_type: SampleType::I16, ..frame.header },
        FrameHeader { timestamp_s: f64::NAN, ..frame.header },
        FrameHeader { integration_time_s: Some(0.0), ..frame.header },
    ] {
        assert!(write_live_frame(&mut out, &header, &frame.samples).is_err() && out.is_empty(), "{header:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_bytes_end_in_frames_or_an_error(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        let (frames, error) = read(&bytes);
        prop_assert!(error.is_some() || (bytes.is_empty() && frames.is_empty()));
    }

    #[test]
    fn damage_in_one_place_leaves_the_frames_before(at in 0_usize..384, value in any::<u8>()) {
        let frames = three();
        let mut sent: Vec<u8> = frames.iter().flat_map(bytes).collect();
        sent[at] = value;
        let (found, _) = read(&sent);
        let before = [112, 224].iter().filter(|end| **end <= at).count();
        prop_assert!(found.len() >= before);
        for (found, frame) in found.iter().zip(&frames).take(before) {
            prop_assert_eq!(&found.samples, &frame.samples);
        }
    }
}
