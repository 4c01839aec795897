//! Images and their rows.

use recordings::{Encoding, Image, ImageParts};

fn parts(width: u32, height: u32, step: u32, encoding: Encoding, data: Vec<u8>) -> ImageParts {
    ImageParts { frame_id: String::new(), width, height, step, encoding, big_endian: false, data }
}

#[test]
fn rows_are_read_without_what_lies_between_them() {
    let data = vec![1, 0, 2, 0, 99, 99, 3, 0, 4, 1];
    let image = Image::new(parts(2, 2, 6, Encoding::Unsigned16, data)).unwrap();
    assert_eq!(image.values_u16().unwrap(), [1, 2, 3, 260]);
    let depths = image.depths_m().unwrap();
    assert_eq!(depths, [0.001, 0.002, 0.003, 0.26]);
}

#[test]
fn depths_of_both_kinds_say_where_there_is_none() {
    let image = Image::from_u16("", [3, 1], Encoding::Unsigned16, &[0, 1500, 65535]).unwrap();
    let depths = image.depths_m().unwrap();
    assert!(depths[0].is_nan() && depths[1] == 1.5 && depths[2].is_nan());
    let image = Image::from_f32("", [4, 1], &[f32::NAN, 1.5, 0.0, f32::INFINITY]).unwrap();
    let depths = image.depths_m().unwrap();
    assert!(depths[0].is_nan() && depths[1] == 1.5 && depths[2].is_nan() && depths[3].is_nan());
    let colour = Image::new(parts(1, 1, 3, Encoding::Bgr8, vec![1, 2, 3])).unwrap();
    assert!(colour.depths_m().is_none() && colour.values_f32().is_none() && colour.values_u16().is_none());
}

#[test]
fn images_whose_size_does_not_fit_are_refused() {
    let message = |parts| Image::new(parts).unwrap_err().to_string();
    let short = message(parts(2, 2, 4, Encoding::Unsigned16, vec![0; 7]));
    assert_eq!(short, "image: has 7 bytes, expected 8 for 2 x 2 pixels");
    let rows = message(parts(2, 2, 3, Encoding::Unsigned16, vec![0; 8]));
    assert_eq!(rows, "image: has rows of 3 bytes, expected 4 for 2 pixels of 16UC1");
    let none = message(parts(0, 2, 0, Encoding::Unsigned16, Vec::new()));
    assert_eq!(none, "image: has 0 x 2 pixels, expected 1 to 67108864 in all");
    assert!(
        message(parts(u32::MAX, u32::MAX, u32::MAX, Encoding::Mono8, Vec::new())).contains("pixels, expected 1 to")
    );
    assert!(message(parts(2, 2, 2, Encoding::Nv12, vec![0; 5])).contains("expected 6"));
}

#[test]
fn names_of_encodings_come_back() {
    for name in [
        "mono8",
        "mono16",
        "8UC1",
        "16UC1",
        "32FC1",
        "rgb8",
        "bgr8",
        "rgba8",
        "bgra8",
        "nv12",
        "yuv422_yuy2",
        "bayer_rggb8",
    ] {
        assert_eq!(Encoding::of(name).name(), name);
    }
    assert_eq!(Encoding::of("bayer_rggb8").bytes_per_pixel(), None);
}

/// The kind of a stream by its name and its first image.
#[cfg(feature = "mcap")]
#[test]
fn names_and_encodings_tell_what_an_image_shows() {
    use recordings::{Kind, McapWriter, Payload};
    let streams = [
        ("/camera/image_raw", Encoding::Unsigned16, Kind::Depth),
        ("/camera/depth/image_rect_raw", Encoding::Unsigned16, Kind::Depth),
        ("/camera/infra1/image_rect_raw", Encoding::Unsigned16, Kind::Intensity),
        ("/ir/image_raw", Encoding::Mono16, Kind::Intensity),
        ("/direct/image", Encoding::Unsigned16, Kind::Depth),
        ("/tof/range", Encoding::Unsigned16, Kind::Range),
        ("/depth_to_ir/image_raw", Encoding::Unsigned16, Kind::Depth),
        ("/confidence", Encoding::Unsigned16, Kind::Raw),
    ];
    let mut writer = McapWriter::new(Vec::new()).unwrap();
    for (topic, encoding, _) in &streams {
        let stream = writer.stream(topic).unwrap();
        let image = Image::from_u16("", [2, 1], encoding.clone(), &[1, 2]).unwrap();
        writer.message(stream, 1, &Payload::Image(image)).unwrap();
    }
    let (_, recording) = crate::common::read(&writer.finish().unwrap());
    for (stream, (topic, _, kind)) in recording.streams().iter().zip(streams) {
        assert_eq!((stream.name.as_str(), stream.kind), (topic, kind));
    }
}
