//! Recordings that become surveys.

use std::path::{Path, PathBuf};

use commands::{Judged, Silent};
use range_io::calibration::Calibration;
use range_io::survey::{InputFrame, Level, Survey, read_frame};
use range_io::tables::read_imu;
use recording_tasks::{ConvertRequest, ConvertSummary, convert};
use recordings::{Encoding, Image, Payload};

use crate::common::{SIZE, camera, depth, light, messages, write};

fn to_survey(file: &Path) -> (tempfile::TempDir, ConvertRequest) {
    let folder = tempfile::tempdir().unwrap();
    let request = ConvertRequest::new(file, folder.path().join("survey"));
    (folder, request)
}

fn done(request: &ConvertRequest) -> ConvertSummary {
    let summary = convert(request, &Silent).unwrap();
    println!("{summary}");
    summary
}

fn refusal(request: &ConvertRequest) -> String {
    convert(request, &Silent).unwrap_err().to_string()
}

fn info(model: &str, lens: &[f64]) -> Payload {
    Payload::CameraInfo(Box::new(camera(model, lens)))
}

#[test]
fn frames_keep_values_times_light_and_temperatures() {
    let source = tempfile::tempdir().unwrap();
    let (folder, request) = to_survey(&write(source.path(), "a.mcap", &messages()));
    let summary = done(&request);
    assert_eq!((summary.frames, summary.with_amplitude, summary.with_temperature), (9, 9, 9));
    assert_eq!(summary.level, "depth");
    assert!(summary.doubts().is_empty() && summary.skipped.is_empty() && summary.left_out.is_empty());
    let root = folder.path().join("survey");
    let survey = Survey::read(&root).unwrap();
    assert_eq!((survey.level, survey.frames.len()), (Level::Depth, 9));
    for (index, frame) in (0..9).zip([0, 1, 2, 3, 4, 6, 7, 8, 9_u16]) {
        let entry = &survey.frames[index];
        let time = 1_700_000_000.0 + f64::from(frame) * 0.033_333_333;
        assert!((entry.timestamp_s.unwrap() - time).abs() < 3e-7, "{entry:?}");
        // That of the last even frame.
        assert_eq!(entry.temperature_c, Some(30.0 + f64::from(if frame == 6 { 6 } else { frame / 2 * 2 })));
        let InputFrame::Depth { depth, amplitude, .. } = read_frame(&survey, &root, index).unwrap() else { panic!() };
        assert!(depth[(3, 0)].is_nan());
        assert_eq!(depth[(0, 1)], (1.08 + f64::from(frame) * 0.001) as f32);
        assert_eq!(amplitude.unwrap()[(7, 5)], f32::from(frame));
    }
    // Pixels of 0.01 mm: 10 and 10.5 of them, and a principal point with y up.
    let camera = survey.camera;
    assert!((camera.principal_distance_mm - 0.1).abs() < 1e-12);
    assert!((camera.pixel_pitch_mm[1] - 0.01 * 10.0 / 10.5).abs() < 1e-12);
    assert!((camera.principal_point_mm[0] + 0.0025).abs() < 1e-12 && camera.principal_point_mm[1].abs() < 1e-12);
    assert!(!root.join("calibration.ron").exists());
    let samples = read_imu(root.join("recorded_imu.csv")).unwrap();
    assert_eq!((samples.len(), samples[1].angular_rate[0], samples[1].acceleration), (20, 0.5, [0.0, 9.81, 0.5]));
    assert!(summary.findings[0].contains("camera_from_imu"));
    assert!(root.join("summary.json").is_file());
}

#[test]
fn lenses_become_a_calibration_that_states_its_residual() {
    let source = tempfile::tempdir().unwrap();
    for (model, lens) in [
        ("plumb_bob", vec![-0.05, 0.01, 1e-3, -1e-3, 0.0]),
        ("rational_polynomial", vec![0.3, 0.02, 1e-3, -1e-3, 0.0, 0.35, 0.0, 0.0]),
    ] {
        let recorded = [("/depth/camera_info", 0, info(model, &lens)), ("/depth/image_raw", 0, depth(|_| 1500))];
        let (folder, request) = to_survey(&write(source.path(), "a.mcap", &recorded));
        let summary = done(&request);
        let used = summary.camera.unwrap();
        assert_eq!((used.source.as_str(), used.model.as_str()), ("/depth/camera_info", model));
        assert!(used.residual_px < 0.05, "{}", used.residual_px);
        let calibration = Calibration::read(folder.path().join("survey")).unwrap();
        assert!(calibration.parameter("k1").unwrap().value.abs() > 0.0);
        assert!(calibration.provenance.method.contains(model));
    }
}

#[test]
fn rectified_images_have_the_projection_and_no_lens() {
    let source = tempfile::tempdir().unwrap();
    let recorded = [
        ("/depth/camera_info", 0, info("plumb_bob", &[-0.2, 0.0, 0.0, 0.0, 0.0])),
        ("/depth/image_rect", 0, depth(|_| 1500)),
    ];
    let (folder, request) = to_survey(&write(source.path(), "a.mcap", &recorded));
    assert_eq!(done(&request).camera.unwrap().model, "rectified");
    let survey = Survey::read(folder.path().join("survey")).unwrap();
    assert!((survey.camera.principal_distance_mm - 0.09).abs() < 1e-12);
    assert!(!folder.path().join("survey/calibration.ron").exists());
}

#[test]
fn what_cannot_be_decided_is_refused_with_names() {
    let source = tempfile::tempdir().unwrap();
    let with = |further: &[(&'static str, Payload)]| {
        let mut recorded = vec![("/depth/image_raw", 0, depth(|_| 1500))];
        recorded.extend(further.iter().map(|(topic, payload)| (*topic, 0, payload.clone())));
        to_survey(&write(source.path(), "a.mcap", &recorded))
    };
    let (_folder, request) = with(&[("/second/depth", depth(|_| 1))]);
    assert!(
        refusal(&request).contains(
            "several depth images: name one with --stream: `/depth/image_raw` (depth), `/second/depth` (depth)"
        )
    );
    let named = |stream: &str| ConvertRequest { stream: Some(stream.to_owned()), ..request.clone() };
    assert!(refusal(&named("/none")).contains("there is no stream `/none`"));
    let (_folder, request) = with(&[]);
    assert!(
        refusal(&request)
            .contains("tells no camera of stream `/depth/image_raw` with 8 x 6 pixels: name a calibration.ron")
    );
    let (_folder, request) = with(&[("/depth/camera_info", info("equidistant", &[0.1; 4]))]);
    assert!(refusal(&request).contains("has the lens model `equidistant` with 4 coefficients, which is not read"));
    let mut blank = camera("", &[]);
    blank.matrix = [0.0; 9];
    let (_folder, request) = with(&[("/depth/camera_info", Payload::CameraInfo(Box::new(blank)))]);
    assert!(refusal(&request).contains("has focal lengths of 0 and 0 px: it is not calibrated"));
    let light_alone = [("/ir/image_raw", 0, light(5)), ("/ir/camera_info", 0, info("plumb_bob", &[]))];
    let (folder, request) = to_survey(&write(source.path(), "b.mcap", &light_alone));
    assert!(refusal(&request).contains("has no depth or range images; there are `/ir/image_raw` (intensity)"));
    let request = ConvertRequest { stream: Some("/ir/image_raw".to_owned()), ..request };
    assert_eq!(done(&request).level, "intensity");
    assert_eq!(Survey::read(folder.path().join("survey")).unwrap().level, Level::Intensity);
    let neither = ConvertRequest::new(folder.path().join("none"), folder.path().join("out"));
    assert!(refusal(&neither).contains("is neither a recording"));
}

#[test]
fn a_calibration_that_is_named_is_taken() {
    let source = tempfile::tempdir().unwrap();
    let recorded = [
        ("/depth/camera_info", 0, info("plumb_bob", &[-0.05, 0.0, 0.0, 0.0, 0.0])),
        ("/depth/image_raw", 0, depth(|_| 1500)),
    ];
    let (folder, request) = to_survey(&write(source.path(), "a.mcap", &recorded));
    done(&request);
    let calibration = folder.path().join("survey/calibration.ron");
    let bare = write(source.path(), "bare.mcap", &[("/depth", 0, depth(|_| 1500)), ("/depth", 5, depth(|_| 0))]);
    let (second, request) = to_survey(&bare);
    let request = ConvertRequest { calibration: Some(calibration.clone()), station: Some("S1".to_owned()), ..request };
    let summary = done(&request);
    assert_eq!(summary.skipped[0].reason, "without any value");
    let written = second.path().join("survey");
    assert_eq!(Calibration::read(&written).unwrap(), Calibration::read(&calibration).unwrap());
    assert_eq!(Survey::read(&written).unwrap().frames[0].station, "S1");
    let image = Image::from_u16("", [2, 2], Encoding::Unsigned16, &[5; 4]).unwrap();
    let small = write(source.path(), "small.mcap", &[("/depth", 0, Payload::Image(image))]);
    let request = ConvertRequest { input: small, ..request };
    assert!(refusal(&request).contains("is of 8 x 6 pixels, the images have 2 x 2"));
}

#[test]
fn a_recording_that_is_cut_off_becomes_the_survey_of_what_is_there() {
    let source = tempfile::tempdir().unwrap();
    // Several chunks of images without a pattern.
    let mut state = 7_u32;
    let mut noise = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        1000 + (state >> 20) as u16
    };
    let mut recorded = vec![("/d/camera_info", 0, Payload::CameraInfo(Box::new(camera_of([256, 128]))))];
    for frame in 0..40 {
        let values: Vec<u16> = (0..256 * 128).map(|_| noise()).collect();
        let image = Image::from_u16("d", [256, 128], Encoding::Unsigned16, &values).unwrap();
        recorded.push(("/d/image_raw", frame * 10_000_000, Payload::Image(image)));
    }
    let file = write(source.path(), "a.mcap", &recorded);
    let bytes = std::fs::read(&file).unwrap();
    std::fs::write(&file, &bytes[..bytes.len() * 6 / 10]).unwrap();
    let (_folder, request) = to_survey(&file);
    let summary = done(&request);
    assert!(summary.frames > 15 && summary.frames < 40, "{}", summary.frames);
    assert!(summary.doubts()[0].words.contains("is cut off at byte"), "{:?}", summary.doubts());
}

fn camera_of([width, height]: [u32; 2]) -> recordings::CameraInfo {
    recordings::CameraInfo {
        width,
        height,
        matrix: [200.0, 0.0, 127.5, 0.0, 200.0, 63.5, 0.0, 0.0, 1.0],
        ..camera("", &[])
    }
}

#[test]
fn images_of_another_size_and_encoding_are_left_out() {
    let source = tempfile::tempdir().unwrap();
    let colour = recordings::ImageParts {
        frame_id: String::new(),
        width: SIZE[0],
        height: SIZE[1],
        step: 3 * SIZE[0],
        encoding: Encoding::Rgb8,
        big_endian: false,
        data: vec![0; 144],
    };
    let small = Image::from_u16("", [2, 2], Encoding::Unsigned16, &[5; 4]).unwrap();
    let recorded = [
        ("/d/camera_info", 0, info("plumb_bob", &[])),
        ("/d/image_raw", 0, depth(|_| 1500)),
        ("/d/image_raw", 1, Payload::Image(small)),
        ("/d/image_raw", 2, Payload::Image(Image::new(colour).unwrap())),
    ];
    let (_folder, request) = to_survey(&write(source.path(), "a.mcap", &recorded));
    let summary = done(&request);
    let reasons: Vec<_> = summary.skipped.iter().map(|skipped| skipped.reason.as_str()).collect();
    assert_eq!(reasons, ["of another size than the first", "of an encoding that has no one value a pixel"]);
    assert_eq!(summary.frames, 1);
}

fn kinect() -> Option<PathBuf> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/real/azure_kinect_mug/recording.mkv");
    if !file.is_file() {
        println!("no real recording beside the project: skipped");
    }
    file.is_file().then_some(file)
}

/// A recording of a real camera: its depths are those that the survey's own reader takes from the file.
#[test]
fn a_real_azure_kinect_becomes_a_survey() {
    let Some(file) = kinect() else { return };
    let (folder, request) = to_survey(&file);
    let summary = done(&request);
    assert_eq!((summary.frames, summary.with_amplitude, summary.amplitudes.as_deref()), (1, 1, Some("IR")));
    let used = summary.camera.unwrap();
    // What three radial terms leave of the factory's six, in the corners.
    assert!(used.model == "rational_polynomial" && used.residual_px < 1.5, "{used:?}");
    let root = folder.path().join("survey");
    let survey = Survey::read(&root).unwrap();
    assert!(survey.camera_identity.as_deref().unwrap().starts_with("Azure Kinect DK, serial number 0"));
    let InputFrame::Depth { depth, .. } = read_frame(&survey, &root, 0).unwrap() else { panic!() };
    let stored = range_io::mkv::read_frame(&file, 0).unwrap();
    for (found, stored) in depth.as_slice().iter().zip(stored.depth.as_slice()) {
        assert!(if *stored == 0 { found.is_nan() } else { *found == (f64::from(*stored) * 0.001) as f32 });
    }
}
