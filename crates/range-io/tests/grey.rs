//! Images of light alone: PNG of every kind, JPEG, and files that are neither.
#![cfg(all(feature = "grey", feature = "survey"))]
// Whole numbers are exact.
#![allow(clippy::float_cmp)]

use std::path::Path;

use png::{BitDepth, ColorType, Encoder};
use range_image::Raster;
use range_io::grey;
use range_io::survey::{InputFrame, Survey, read_frame};

/// 8 x 8 pixels, the left half 40, the right one 200.
const GREY_JPEG: &str = "ffd8ffe000104a46494600010100000100010000ffdb004300100b0c0e0c0a100e0d0e1211101318281a181616183123251d\
    283a333d3c3933383740485c4e404457453738506d51575f626768673e4d71797064785c656763ffc0000b080008000801011100ffc400140001000000\
    00000000000000000000000003ffc40018100002030000000000000000000000000000064482c2ffda0008010100003f0034a9b4d1ffd9";

/// 8 x 8 pixels, the left half (40, 20, 0), the right one (200, 100, 0).
const COLOUR_JPEG: &str = "ffd8ffe000104a46494600010100000100010000ffdb004300100b0c0e0c0a100e0d0e1211101318281a181616183123251d\
    283a333d3c3933383740485c4e404457453738506d51575f626768673e4d71797064785c656763ffdb0043011112121815182f1a1a2f63423842636363\
    6363636363636363636363636363636363636363636363636363636363636363636363636363636363636363636363ffc0001108000800080301110002\
    1101031101ffc40014000100000000000000000000000000000005ffc40018100002030000000000000000000000000000054382c1ffc4001401010000\
    0000000000000000000000000005ffc400161100030000000000000000000000000000000441ffda000c03010002110311003f000904f5d0c6e082d4ff\
    d9";

fn bytes(hex: &str) -> Vec<u8> {
    (0..hex.len() / 2).map(|i| u8::from_str_radix(&hex[2 * i..2 * i + 2], 16).unwrap()).collect()
}

fn png(color: ColorType, depth: BitDepth, size: [u32; 2], data: &[u8], palette: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, size[0], size[1]);
    encoder.set_color(color);
    encoder.set_depth(depth);
    if !palette.is_empty() {
        encoder.set_palette(palette.to_vec());
    }
    encoder.write_header().unwrap().write_image_data(data).unwrap();
    bytes
}

fn read(content: &[u8]) -> Result<Raster<f32>, range_io::Error> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("image");
    std::fs::write(&file, content).unwrap();
    grey::read(&file)
}

#[test]
fn every_kind_of_png_becomes_grey() {
    use BitDepth::{Eight, One, Sixteen};
    use ColorType::{Grayscale, Indexed, Rgb, Rgba};
    let cases: [(Vec<u8>, [f32; 2]); 6] = [
        (png(Grayscale, Eight, [2, 1], &[7, 250], &[]), [7.0, 250.0]),
        (png(Grayscale, Sixteen, [2, 1], &[1, 2, 255, 255], &[]), [258.0, 65535.0]),
        (png(Grayscale, One, [2, 1], &[0b0100_0000], &[]), [0.0, 255.0]),
        (png(Rgb, Eight, [2, 1], &[100, 0, 0, 10, 10, 10], &[]), [29.9, 10.0]),
        (png(Rgba, Eight, [2, 1], &[0, 100, 0, 9, 0, 0, 100, 200], &[]), [58.7, 11.4]),
        (png(Indexed, Eight, [2, 1], &[1, 0], &[9, 9, 9, 80, 80, 80]), [80.0, 9.0]),
    ];
    for (content, expected) in cases {
        let image = read(&content).unwrap();
        assert_eq!((image.width(), image.height()), (2, 1));
        for (value, expected) in image.as_slice().iter().zip(expected) {
            assert!((value - expected).abs() < 1e-3, "{value} {expected}");
        }
    }
}

#[test]
fn jpegs_are_read_grey_and_in_colour() {
    let image = read(&bytes(GREY_JPEG)).unwrap();
    assert_eq!((image.width(), image.height()), (8, 8));
    // Quality 50 keeps the two halves to a few grey values.
    for (index, value) in image.as_slice().iter().enumerate() {
        let expected = if index % 8 < 4 { 40.0 } else { 200.0 };
        assert!((value - expected).abs() < 12.0, "{value} {expected}");
    }
    let light = |red: f32, green: f32| 0.299 * red + 0.587 * green;
    for (index, value) in read(&bytes(COLOUR_JPEG)).unwrap().as_slice().iter().enumerate() {
        let expected = if index % 8 < 4 { light(40.0, 20.0) } else { light(200.0, 100.0) };
        assert!((value - expected).abs() < 12.0, "{value} {expected}");
    }
}

#[test]
fn files_that_are_no_images_are_refused_with_their_name() {
    let whole = bytes(GREY_JPEG);
    let png = png(ColorType::Grayscale, BitDepth::Eight, [40, 40], &[3; 1600], &[]);
    let scan_cut = &whole[..whole.len() - 6];
    let wrong: [&[u8]; 6] = [b"", b"no image", &whole[..40], scan_cut, &png[..60], &[0xff, 0xd8, 0xff]];
    for content in wrong {
        let message = read(content).unwrap_err().to_string();
        assert!(message.contains("image: is no complete"), "{message}");
    }
}

#[test]
fn a_survey_of_light_alone_reads_images_and_arrays_of_its_size() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("0.jpg"), bytes(GREY_JPEG)).unwrap();
    let survey = |width: usize| {
        let text = format!(
            "(camera: (width: {width}, height: 8, pixel_pitch_mm: (0.01, 0.01), principal_distance_mm: 5,
            principal_point_mm: (0, 0)), level: intensity, frames: [(file: \"0.jpg\", station: \"S0\")])"
        );
        Survey::parse(Path::new("survey.ron"), &text).unwrap()
    };
    let InputFrame::Intensity(image) = read_frame(&survey(8), folder.path(), 0).unwrap() else { panic!("level") };
    assert_eq!(image.width(), 8);
    let message = read_frame(&survey(9), folder.path(), 0).unwrap_err().to_string();
    assert!(message.ends_with("0.jpg: has 8 x 8 pixels, expected 9 x 8"), "{message}");
}
