//! `survey.ron` and the frames it names.
#![cfg(feature = "survey")]
// What goes through a file comes back to the last bit.

use crate::common;
use std::path::Path;

use proptest::prelude::*;
use range_image::{Flags, Modulation, PhaseSense, Raster, RawFrame, Samples};
use range_io::npz::NpzWriter;
use range_io::survey::{
    FrameRate, InputFrame, Level, ReferencePath, StoredDepth, Survey, TruthFrame, read_frame, read_truth, write_frame,
    write_truth,
};
use range_io::{Error, ron_text};

const TEXT: &str = r#"#![enable(implicit_some)]
(
    camera: (
        width: 3, height: 2, pixel_pitch_mm: (0.04, 0.05),
        principal_distance_mm: 8.0, principal_point_mm: (0.1, -0.2),   // nominal
        modulation_hz: [20e6], phase_steps: 4,
    ),
    level: samples,
    frames: [
        (file: "frames/000_0.npz", station: "S00", timestamp_s: 0.0, integration_time_s: 0.002, temperature_c: 31.5),
        (file: "../other/1.npz", station: "S01"),
    ],
)
"#;

fn survey() -> Survey {
    Survey::parse(Path::new("survey.ron"), TEXT).unwrap()
}

fn at_level(level: Level) -> Survey {
    Survey { level, frames: survey().frames[..1].to_vec(), ..survey() }
}

/// The message about a text, which must carry the place that is given.
fn fault(from: &str, to: &str) -> String {
    assert!(TEXT.contains(from));
    Survey::parse(Path::new("a/survey.ron"), &TEXT.replacen(from, to, 1)).unwrap_err().to_string()
}

#[test]
fn the_example_of_the_format_is_read() {
    let survey = survey();
    assert_eq!((survey.camera.width, survey.camera.height, survey.camera.phase_steps), (3, 2, Some(4)));
    assert_eq!((survey.level, survey.frames.len()), (Level::Samples, 2));
    assert_eq!(survey.frames[0].temperature_c, Some(31.5));
    assert_eq!((survey.frames[1].timestamp_s, survey.frames[1].integration_time_s), (None, None));
    assert_eq!((survey.camera.phase_sense, survey.camera.raw_scale), (PhaseSense::Positive, 1.0));
    let camera = survey.camera.nominal_camera().unwrap();
    assert_eq!(camera.interior.principal_point_mm, [0.1, -0.2]);
    assert_eq!(survey.camera.modulations().unwrap(), [Modulation::new(20e6).unwrap()]);
}

#[test]
fn optional_fields_are_read_with_and_without_implicit_some() {
    let extended = TEXT
        .replace("phase_steps: 4,", "phase_steps: 4, phase_sense: Negative, phase_offset_rad: 2.78, saturation: 4000,")
        .replace("level: samples,", "level: samples, extras: {\"mesh\": \"mesh.ply\"}, truth: (stations: \"t.csv\"),");
    let implicit = Survey::parse(Path::new("survey.ron"), &extended).unwrap();
    assert_eq!(implicit.camera.phase_sense, PhaseSense::Negative);
    assert_eq!(implicit.camera.saturation, Some(4000.0));
    assert_eq!(implicit.extras["mesh"], Path::new("mesh.ply"));
    assert_eq!(implicit.truth.as_ref().unwrap().stations.as_deref(), Some(Path::new("t.csv")));
    let explicit = extended
        .replace("#![enable(implicit_some)]\n", "")
        .replace("phase_steps: 4", "phase_steps: Some(4)")
        .replace("saturation: 4000", "saturation: Some(4000)")
        .replace("timestamp_s: 0.0", "timestamp_s: Some(0.0)")
        .replace("truth: (stations: \"t.csv\")", "truth: Some((stations: Some(\"t.csv\")))")
        .replace("Negative", "negative");
    assert_eq!(Survey::parse(Path::new("survey.ron"), &explicit).unwrap(), implicit);
}

#[test]
fn faults_name_file_place_and_field() {
    let cases = [
        ("width: 3", "width: \"3\"", "a/survey.ron:4:16: `camera.width`: Expected integer"),
        ("width: 3", "width: 0", "a/survey.ron:4:16: `camera.width`: is 0, expected at least one column"),
        ("width: 3", "width: 3000000000", "a/survey.ron:4:16: `camera.width`: "),
        ("(0.04, 0.05)", "(0.04, -0.05)", "a/survey.ron:4:53: `camera.pixel_pitch_mm[1]`: is -0.05"),
        ("principal_distance_mm: 8.0", "principal_distance_mm: NaN", "`camera.principal_distance_mm`: is NaN"),
        ("[20e6]", "[20e6, 0]", "a/survey.ron:6:31: `camera.modulation_hz[1]`: is 0"),
        ("modulation_hz: [20e6], ", "", "a/survey.ron:3:13: `camera.modulation_hz`: is missing"),
        ("phase_steps: 4", "phase_steps: 2", "a/survey.ron:6:45: `camera.phase_steps`: is 2, expected 3"),
        (" phase_steps: 4,", "", "`camera.phase_steps`: is missing, level `samples` needs it"),
        ("\"../other/1.npz\"", "\"/other/1.npz\"", "a/survey.ron:11:16: `frames[1].file`: is `/other/1.npz`"),
        ("station: \"S01\"", "station: \" \"", "a/survey.ron:11:43: `frames[1].station`: is empty"),
        ("integration_time_s: 0.002", "integration_time_s: 0", "`frames[0].integration_time_s`: is 0"),
        ("temperature_c", "temperature", "a/survey.ron:10:97: `frames[0].temperature`: "),
        ("level: samples", "level: raw", "a/survey.ron:8:12: `level`: "),
        ("    level: samples,\n", "", "a/survey.ron:12:1: `level`: "),
    ];
    for (from, to, expected) in cases {
        let message = fault(from, to);
        assert!(message.contains(expected), "{message}\nexpected: {expected}");
    }
    let unknown = fault("temperature_c", "temperature");
    assert!(unknown.contains("temperature`") && unknown.contains("temperature_c"), "{unknown}");
    assert!(fault("    level: samples,\n", "").contains("level"));
    for cut in 0..TEXT.trim_end().len() {
        assert!(Survey::parse(Path::new("survey.ron"), &TEXT[..cut]).is_err(), "cut at {cut}");
    }
}

#[test]
fn power_on_and_the_optical_reference_are_read_and_checked() {
    let with = |fields: &str| TEXT.replace("level: samples,", &format!("level: samples, {fields},"));
    let read = |fields: &str| Survey::parse(Path::new("survey.ron"), &with(fields));
    let survey = read("power_on_s: -90.5, reference_path: (columns: (1, 2), rows: (0, 0), length_m: 0.75)").unwrap();
    assert_eq!(survey.power_on_s, Some(-90.5));
    assert_eq!(survey.reference_path, Some(ReferencePath { columns: [1, 2], rows: [0, 0], length_m: 0.75 }));
    let again = Survey::parse(Path::new("survey.ron"), &ron_text::to_text(&survey).unwrap()).unwrap();
    assert_eq!(again, survey);
    let cases = [
        ("power_on_s: 1.0", "`frames[0].timestamp_s`: is before the camera was switched on (`power_on_s: 1`)"),
        ("power_on_s: NaN", "`power_on_s`: is NaN"),
        (
            "reference_path: (columns: (1, 3), rows: (0, 0), length_m: 1)",
            "`reference_path.columns`: is (1, 3), expected the first and the last of 3 columns",
        ),
        ("reference_path: (columns: (1, 2), rows: (1, 0), length_m: 1)", "`reference_path.rows`: is (1, 0)"),
        ("reference_path: (columns: (1, 2), rows: (0, 0), length_m: 0)", "`reference_path.length_m`: is 0"),
    ];
    for (fields, expected) in cases {
        let message = read(fields).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}\nexpected: {expected}");
    }
}

#[test]
fn frame_rates_are_read_and_checked() {
    let with = |fields: &str| TEXT.replace("level: samples,", &format!("level: samples, frame_rates: [{fields}],"));
    let read = |fields: &str| Survey::parse(Path::new("survey.ron"), &with(fields));
    let survey = read("(since_s: -30, rate_hz: 0), (since_s: 12.5, rate_hz: 10)").unwrap();
    let rate = |since_s, rate_hz| FrameRate { since_s, rate_hz };
    assert_eq!(survey.frame_rates, [rate(-30.0, 0.0), rate(12.5, 10.0)]);
    let again = Survey::parse(Path::new("survey.ron"), &ron_text::to_text(&survey).unwrap()).unwrap();
    assert_eq!(again, survey);
    for (fields, expected) in [
        ("(since_s: NaN, rate_hz: 1)", "`frame_rates[0].since_s`: is NaN"),
        ("(since_s: 0, rate_hz: -1)", "`frame_rates[0].rate_hz`: is -1"),
        ("(since_s: 5, rate_hz: 1), (since_s: 5, rate_hz: 2)", "`frame_rates[1].since_s`: is 5, expected a time after"),
    ] {
        let message = read(fields).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}\nexpected: {expected}");
    }
}

#[test]
fn tables_belong_to_their_level() {
    let depth = Survey { depth: Some(StoredDepth { scale_m: 0.001, invalid: vec![0] }), ..survey() };
    assert!(matches!(depth.validate(), Err(Error::Value { field, .. }) if field == "depth"));
    let text = TEXT.replace("level: samples", "level: depth, depth: (scale_m: 0.0002, invalid: [0, 65535])");
    let read = Survey::parse(Path::new("survey.ron"), &text).unwrap();
    assert_eq!(read.depth, Some(StoredDepth { scale_m: 0.0002, invalid: vec![0, 65535] }));
    let one = text.replace("[0, 65535]", "7");
    assert_eq!(Survey::parse(Path::new("survey.ron"), &one).unwrap().depth.unwrap().invalid, [7]);
    assert!(Survey::parse(Path::new("survey.ron"), &text.replace("65535", "65536")).is_err());
    let truth = TEXT.replace("level: samples,", "level: samples, truth: (frames: [\"a.npz\"]),");
    let message = Survey::parse(Path::new("survey.ron"), &truth).unwrap_err().to_string();
    assert!(message.contains("`truth.frames`: lists 1 files for 2 frames"), "{message}");
}

proptest! {
    #![proptest_config(common::cases(48))]

    #[test]
    fn a_written_survey_reads_back_equal(
        width in 1_usize..2000, height in 1_usize..2000, c in 1e-3..1e3_f64, offset in -10.0..10.0_f64,
        saturation in prop::option::of(1.0..1e5_f64), names in prop::collection::vec("[ -~é]{1,40}", 0..6),
        time in prop::option::of(-1e9..1e9_f64), scale in 1e-6..1.0_f64, invalid in prop::collection::vec(any::<u16>(), 1..3),
    ) {
        let mut survey = survey();
        survey.camera.width = width;
        survey.camera.height = height;
        survey.camera.principal_distance_mm = c;
        survey.camera.phase_offset_rad = offset;
        survey.camera.phase_sense = PhaseSense::Negative;
        survey.camera.saturation = saturation;
        survey.level = Level::Depth;
        survey.depth = Some(StoredDepth { scale_m: scale, invalid });
        survey.frames = names.iter().map(|name| {
            let mut frame = survey.frames[0].clone();
            frame.station = format!("x{name}");
            frame.file = format!("f{name}").into();
            frame.timestamp_s = time;
            frame
        }).collect();
        survey.extras = names.iter().map(|name| (name.clone(), format!("e{name}").into())).collect();
        let text = ron_text::to_text(&survey).unwrap();
        prop_assert_eq!(Survey::parse(Path::new("survey.ron"), &text).unwrap(), survey, "{}", text);
    }
}

fn folder_with_frame(frame: &InputFrame) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("frames")).unwrap();
    write_frame(folder.path().join("frames/000_0.npz"), frame).unwrap();
    folder
}

fn plane(start: f32) -> Raster<f32> {
    Raster::from_fn(3, 2, |col, row| start + col as f32 + 10.0 * row as f32)
}

#[test]
fn samples_of_each_type_come_back() {
    let survey = at_level(Level::Samples);
    let all = [
        Samples::F32((0..24).map(|i| if i == 5 { f32::NAN } else { i as f32 }).collect()),
        Samples::U16((0..24).collect()),
        Samples::I16((-12..12).collect()),
    ];
    for samples in all {
        let raw = RawFrame::new(3, 2, 4, survey.camera.modulations().unwrap(), samples).unwrap();
        let folder = folder_with_frame(&InputFrame::Samples(raw.clone()));
        let back = read_frame(&survey, folder.path(), 0).unwrap();
        assert_eq!(back.level(), Level::Samples);
        // Compared as text, in which NaN equals NaN.
        assert_eq!(format!("{back:?}"), format!("{:?}", InputFrame::Samples(raw)));
    }
}

#[test]
fn ranges_and_depths_come_back() {
    let range = InputFrame::Range { range: plane(0.5), amplitude: Some(plane(100.0)), confidence: None };
    let folder = folder_with_frame(&range);
    assert_eq!(read_frame(&at_level(Level::Range), folder.path(), 0).unwrap(), range);
    let missing = read_frame(&at_level(Level::Depth), folder.path(), 0).unwrap_err().to_string();
    assert!(missing.ends_with("000_0.npz: there is no array `depth`, only `range`, `amplitude`"), "{missing}");
    let depth = InputFrame::Depth { depth: plane(0.5), amplitude: None, confidence: Some(plane(0.0)) };
    let folder = folder_with_frame(&depth);
    assert_eq!(read_frame(&at_level(Level::Depth), folder.path(), 0).unwrap(), depth);
}

#[test]
fn phases_come_back_in_the_sense_of_the_conventions() {
    let mut survey = at_level(Level::Phase);
    survey.camera.modulation_hz = vec![20e6, 30e6];
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("frames")).unwrap();
    let file = folder.path().join("frames/000_0.npz");
    let phase: Vec<f32> = (0..12).map(|i| if i == 4 { f32::NAN } else { i as f32 * 0.5 }).collect();
    let amplitude = vec![50.0_f32; 12];
    let mut writer = NpzWriter::create(&file).unwrap();
    writer.add("phase", &[2, 2, 3], &phase).unwrap();
    writer.add("amplitude", &[2, 2, 3], &amplitude).unwrap();
    writer.add("intensity", &[2, 3], &[7_u16; 6]).unwrap();
    writer.commit().unwrap();
    survey.camera.phase_sense = PhaseSense::Negative;
    survey.camera.phase_offset_rad = 2.78;
    let InputFrame::Phase(frame) = read_frame(&survey, folder.path(), 0).unwrap() else { panic!("level") };
    assert_eq!(frame.channels.len(), 2);
    assert_eq!(frame.channels[1].offset.as_ref().unwrap()[(2, 1)], 7.0);
    assert_eq!(frame.flags[(1, 1)], Flags::NO_DATA);
    let expected = (2.78_f64 - 3.0).rem_euclid(std::f64::consts::TAU);
    let found = f64::from(frame.channels[1].phase()[(0, 0)]);
    // Single precision of a phase below 2 pi.
    assert!((found - expected).abs() < 1e-6, "{found} {expected}");
    // Written again, the phase is in the sense of the conventions.
    write_frame(&file, &InputFrame::Phase(frame.clone())).unwrap();
    survey.camera.phase_sense = PhaseSense::Positive;
    survey.camera.phase_offset_rad = 0.0;
    let InputFrame::Phase(back) = read_frame(&survey, folder.path(), 0).unwrap() else { panic!("level") };
    assert_eq!(back.flags, frame.flags);
    for (a, b) in back.channels[0].real.as_slice().iter().zip(frame.channels[0].real.as_slice()) {
        // Amplitude 50 in single precision, through the polar form and back.
        assert!((a - b).abs() < 1e-4 || (a.is_nan() && b.is_nan()), "{a} {b}");
    }
    let mut writer = NpzWriter::create(&file).unwrap();
    writer.add("phase", &[2, 2, 3], &[-1.0_f32; 12]).unwrap();
    writer.add("amplitude", &[2, 2, 3], &amplitude).unwrap();
    writer.commit().unwrap();
    let message = read_frame(&survey, folder.path(), 0).unwrap_err().to_string();
    assert!(message.contains("array `phase` has the value -1, expected radian in [0, 2 pi)"), "{message}");
}

#[test]
fn arrays_that_do_not_fit_the_survey_are_refused_with_what_was_expected() {
    let survey = at_level(Level::Samples);
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("frames")).unwrap();
    let refusal = |write: &dyn Fn(&mut NpzWriter<range_io::atomic_output::FileWriter>)| {
        let mut writer = NpzWriter::create(folder.path().join("frames/000_0.npz")).unwrap();
        write(&mut writer);
        writer.commit().unwrap();
        let message = read_frame(&survey, folder.path(), 0).unwrap_err().to_string();
        message.replace(&format!("{}/", folder.path().display()), "")
    };
    assert_eq!(
        refusal(&|writer| writer.add("samples", &[1, 4, 6], &[0_u16; 24]).unwrap()),
        "frames/000_0.npz: array `samples` has shape [1, 4, 6], expected [F, N, H, W] with F = 1, N = 4, H = 2, W = 3"
    );
    assert_eq!(
        refusal(&|writer| writer.add("samples", &[1, 4, 2, 3], &[0_u8; 24]).unwrap()),
        "frames/000_0.npz: array `samples` holds `|u1`, expected <f4, <u2, <i2"
    );
    assert_eq!(
        refusal(&|writer| writer.add("samples", &[1, 4, 2, 3], &[f32::NAN; 24]).unwrap()),
        "frames/000_0.npz: array `samples` has no finite value"
    );
    assert_eq!(
        refusal(&|writer| writer.add("samples", &[0, 4, 2, 3], &[0.0_f32; 0]).unwrap()),
        "frames/000_0.npz: array `samples` has shape [0, 4, 2, 3], expected [F, N, H, W] with F = 1, N = 4, H = 2, W = 3"
    );
    let outside = read_frame(&survey, folder.path(), 1).unwrap_err().to_string();
    assert!(outside.contains("frames[1]") && outside.contains("1 frames"), "{outside}");
    std::fs::remove_file(folder.path().join("frames/000_0.npz")).unwrap();
    let absent = read_frame(&survey, folder.path(), 0).unwrap_err();
    assert!(matches!(&absent, Error::Io { file, .. } if file.ends_with("frames/000_0.npz")), "{absent}");
    let mut odd = survey.clone();
    odd.frames[0].file = "frames/0.tif".into();
    assert!(read_frame(&odd, folder.path(), 0).unwrap_err().to_string().contains(".npz, .npy, .png and .mkv"));
}

#[test]
fn truth_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let truth = TruthFrame {
        range: plane(1.0),
        wraps: vec![Raster::from_fn(3, 2, |col, row| (col + row) as i32)],
        mixed: Raster::from_fn(3, 2, |col, _| col == 1),
    };
    write_truth(folder.path().join("t.npz"), &truth).unwrap();
    let mut survey = at_level(Level::Samples);
    assert_eq!(read_truth(&survey, folder.path(), 0).unwrap(), None);
    survey.truth = Some(range_io::survey::TruthFiles { frames: vec!["t.npz".into()], ..Default::default() });
    assert_eq!(read_truth(&survey, folder.path(), 0).unwrap(), Some(truth));
    survey.camera.modulation_hz = vec![20e6, 30e6];
    assert!(matches!(read_truth(&survey, folder.path(), 0), Err(Error::ArrayShape { array, .. }) if array == "wraps"));
}

#[test]
fn real_samples_and_ranges_are_read() {
    let camera = |width: usize, height: usize, level: &str, file: &str| {
        let text = format!(
            "(camera: (width: {width}, height: {height}, pixel_pitch_mm: (0.04, 0.04), principal_distance_mm: 10.0,
            principal_point_mm: (0, 0), modulation_hz: [60e6], phase_steps: 4, phase_sense: Negative),
            level: {level}, frames: [(file: \"{file}\", station: \"S0\")])"
        );
        Survey::parse(Path::new("survey.ron"), &text).unwrap()
    };
    if let Some(folder) = common::real("mlx75027_scene") {
        let frame = read_frame(&camera(640, 385, "samples", "000_0.npz"), &folder, 0).unwrap();
        let InputFrame::Samples(raw) = frame else { panic!("level") };
        let Samples::F32(values) = raw.samples() else { panic!("type") };
        // First and last value as numpy reads them.
        assert_eq!((values[0], values[values.len() - 1]), (-4.075, 17.402));
        let wrong = read_frame(&camera(176, 144, "samples", "000_0.npz"), &folder, 0).unwrap_err().to_string();
        assert!(
            wrong.ends_with("has shape [1, 4, 385, 640], expected [F, N, H, W] with F = 1, N = 4, H = 144, W = 176")
        );
    }
    if let Some(folder) = common::real("sr4000_steps") {
        let frame = read_frame(&camera(176, 144, "range", "Y1_0.npz"), &folder, 0).unwrap();
        let InputFrame::Range { range, amplitude, confidence } = frame else { panic!("level") };
        let largest = range.as_slice().iter().copied().fold(0.0, f32::max);
        assert_eq!((range[(0, 0)], range[(175, 143)], largest), (2.213_755_4, 1.229_522_7, 4.988_174_4));
        assert_eq!(amplitude.unwrap()[(0, 0)], 828.0);
        assert_eq!(confidence.unwrap()[(175, 143)], 6.0);
    }
}
