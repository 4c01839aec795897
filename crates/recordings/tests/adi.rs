//! Frames of ADI's cameras.

use recordings::{Ending, Format, Kind, Payload};

use crate::common::adi::{adcam, bin, frame};
use crate::common::{cut_everywhere, name, open, read};

#[test]
fn frames_and_temperatures_are_read() {
    let (found, recording) = read(&bin());
    assert_eq!(recording.format(), Format::Adi);
    let names: Vec<_> = found.iter().take(6).map(|message| name(&recording, message)).collect();
    assert_eq!(names, ["sensor temperature", "laser temperature", "depth", "ab", "conf", "xyz"]);
    assert_eq!(found.len(), 18);
    assert_eq!((&found[0].payload, &found[1].payload), (&Payload::Temperature(30.0), &Payload::Temperature(-5.0)));
    assert_eq!((found[0].time_ns(), found[6].time_ns()), (500_000_000, 1_500_000_000));
    let Payload::Image(image) = &found[8].payload else { panic!() };
    assert_eq!(image.values_u16().unwrap()[..2], [501, 502]);
    assert_eq!(recording.streams()[2].kind, Kind::Range);
    let counts: Vec<_> = recording.streams().iter().map(|stream| stream.count).collect();
    assert_eq!(counts, [3, 3, 3, 3, 3, 3, 0].map(Some));
}

#[test]
fn planes_that_are_off_are_not_there() {
    let (found, recording) = read(&frame(2, [true, false, false, false]));
    assert_eq!(found.len(), 3);
    assert_eq!(recording.streams()[3].count, Some(0));
}

#[test]
fn a_cut_leaves_whole_frames() {
    let bytes = bin();
    let one = bytes.len() / 3;
    for length in 128..bytes.len() {
        let (found, recording) = read(&bytes[..length]);
        assert_eq!(found.len(), 6 * (length / one));
        match recording.ending() {
            Some(Ending::Complete) => assert_eq!(length % one, 0),
            Some(Ending::CutOff { missing_bytes: Some(missing), .. }) => {
                assert!(*missing <= (one - length % one) as u64);
            }
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn recordings_with_a_head_have_the_lens_too() {
    let bytes = adcam(2, 2);
    let (found, recording) = read(&bytes);
    let Payload::CameraInfo(info) = &found[0].payload else { panic!() };
    // Focal length and principal point in binned pixels of the window: 24 / 2 - 4, 20 / 2 - 3.
    assert_eq!(info.matrix, [50.0, 0.0, 8.0, 0.0, 50.0, 7.0, 0.0, 0.0, 1.0]);
    assert_eq!((info.distortion_model.as_str(), info.distortion[0]), ("rational_polynomial", 0.5));
    assert_eq!(found.len(), 1 + 2 * 4);
    assert_eq!(found[1].payload, Payload::Temperature(30.0));
    let Payload::Image(depth) = &found[3].payload else { panic!() };
    assert_eq!(((depth.width(), depth.height()), depth.values_u16().unwrap()[127]), ((16, 8), 127));
    let Payload::Image(light) = &found[4].payload else { panic!() };
    // The head of the frame is no light.
    let light = light.values_u16().unwrap();
    assert_eq!((light[0], light[64]), (0, 0x0303));
    assert_eq!(recording.ending(), Some(&Ending::Complete));
    assert_eq!(recording.streams()[2].count, Some(2));
    cut_everywhere(&bytes, 7);
}

#[test]
fn a_recording_that_was_not_closed_says_so() {
    let (found, recording) = read(&adcam(0, 2));
    assert_eq!(found.len(), 9);
    assert!(matches!(recording.ending(), Some(Ending::CutOff { missing_bytes: None, .. })));
    assert_eq!(open(&adcam(0, 2)).streams()[2].count, None);
    let (_, recording) = read(&adcam(5, 2));
    let Some(Ending::CutOff { reason, .. }) = recording.ending() else { panic!() };
    assert_eq!(reason, "3 of 5 frames are missing");
}
