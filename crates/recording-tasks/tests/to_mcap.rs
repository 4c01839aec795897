//! Surveys and recordings that become MCAP.

use std::fs;
use std::path::Path;

use commands::Silent;
use range_io::survey::{InputFrame, Survey, read_frame};
use recording_tasks::{ConvertRequest, ConvertSummary, convert};
use recordings::{Ending, Payload};

use crate::common::{START_NS, messages, read, write};

fn done(input: &Path, out: &Path) -> ConvertSummary {
    let summary = convert(&ConvertRequest::new(input, out), &Silent).unwrap();
    println!("{summary}");
    summary
}

fn refusal(input: &Path, out: &Path) -> String {
    convert(&ConvertRequest::new(input, out), &Silent).unwrap_err().to_string()
}

#[test]
fn a_survey_goes_out_and_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let survey = at("survey");
    done(&write(folder.path(), "a.mcap", &messages()), &survey);
    // The samples are named, as who knows the mounting would do.
    let text = fs::read_to_string(survey.join("survey.ron")).unwrap();
    let end = text.rfind(')').unwrap();
    let extras = "extras: {\"imu\": \"recorded_imu.csv\"},";
    fs::write(survey.join("survey.ron"), format!("{}{extras}{}", &text[..end], &text[end..])).unwrap();
    let summary = done(&survey, &at("b.mcap"));
    assert_eq!((summary.frames, summary.with_amplitude, summary.with_temperature), (9, 9, 9));
    assert_eq!(summary.imu.unwrap().samples, 20);
    let (found, recording) = read(&at("b.mcap"));
    assert_eq!(recording.ending(), Some(&Ending::Complete));
    let names: Vec<_> = found.iter().take(4).map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["/depth/camera_info", "/depth/image_raw", "/amplitude/image_raw", "/temperature"]);
    let Payload::CameraInfo(info) = &found[0].1.payload else { panic!() };
    assert!(
        (info.matrix[0] - 10.0).abs() < 1e-9
            && (info.matrix[2] - 3.25).abs() < 1e-9
            && (info.matrix[5] - 2.5).abs() < 1e-9
    );
    let Payload::Image(image) = &found[1].1.payload else { panic!() };
    let depths = image.depths_m().unwrap();
    assert!(depths[3].is_nan() && depths[8] == 1.08);
    // Seconds in double precision since 1970: a quarter of a microsecond.
    assert!(found[4].1.time_ns().abs_diff(START_NS + 33_333_333) < 300);
    // And once more: the same frames.
    done(&at("b.mcap"), &at("again"));
    let [first, second] = [survey, at("again")].map(|folder| (Survey::read(&folder).unwrap(), folder));
    for frame in 0..9 {
        let [first, second] = [&first, &second].map(|(survey, root)| read_frame(survey, root, frame).unwrap());
        let values = |frame: &InputFrame| {
            let InputFrame::Depth { depth, amplitude: Some(amplitude), .. } = frame else { panic!() };
            [depth, amplitude].map(|plane| plane.as_slice().iter().map(|value| value.to_bits()).collect::<Vec<_>>())
        };
        assert_eq!(values(&first), values(&second));
    }
}

#[test]
fn ranges_become_depths() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let request = ConvertRequest {
        level: Some(range_io::survey::Level::Range),
        ..ConvertRequest::new(write(folder.path(), "a.mcap", &messages()), at("survey"))
    };
    assert_eq!(convert(&request, &Silent).unwrap().level, "range");
    let summary = done(&at("survey"), &at("b.mcap"));
    assert!(summary.findings[0].starts_with("ranges became depths"));
    let (found, _) = read(&at("b.mcap"));
    let Payload::Image(image) = &found[1].1.payload else { panic!() };
    // Column 0, row 1: the ray (-0.325, 1.5 / 10.5, -1) of a range of 1.08 m.
    let expected = 1.08 / (1.0 + 0.325_f64.powi(2) + (1.5_f64 / 10.5).powi(2)).sqrt();
    assert!((f64::from(image.depths_m().unwrap()[8]) - expected).abs() < 1e-6);
}

#[test]
fn a_recording_becomes_mcap_whole() {
    let folder = tempfile::tempdir().unwrap();
    let file = write(folder.path(), "a.mcap", &messages());
    let summary = done(&file, &folder.path().join("b.mcap"));
    assert_eq!(summary.frames, messages().len());
    let ([first, _], [second, _]) = ([read(&file).0, Vec::new()], [read(&folder.path().join("b.mcap")).0, Vec::new()]);
    assert!(
        first.iter().zip(&second).all(|(first, second)| first.0 == second.0 && first.1.payload == second.1.payload)
    );
}

#[test]
fn a_real_azure_kinect_becomes_mcap() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/real/azure_kinect_mug/recording.mkv");
    if !file.is_file() {
        println!("no real recording beside the project: skipped");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("mug.mcap");
    done(&file, &out);
    let (found, recording) = read(&out);
    let mut names: Vec<_> = found.iter().map(|(name, _)| name.as_str()).collect();
    names.sort_unstable();
    assert_eq!(names, ["/depth/camera_info", "/depth/image_raw", "/imu", "/ir/image_raw", "/rgb/image_raw"]);
    assert_eq!(recording.ending(), Some(&Ending::Complete));
}

#[test]
fn what_is_read_is_not_written_over() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let file = write(folder.path(), "a.mcap", &messages());
    done(&file, &at("survey"));
    let before = fs::read(&file).unwrap();
    assert!(refusal(&file, &file).contains("cannot be the output file"));
    assert!(refusal(&at("survey"), &at("survey/x.mcap")).contains("cannot be the output f"));
    assert!(refusal(&at("survey"), &at("survey/frames/x.mcap")).contains("cannot be the output f"));
    assert!(refusal(&at("survey"), &at("elsewhere")).contains("does not end in .mcap"));
    assert_eq!(fs::read(&file).unwrap(), before);
    // What is there already is replaced as a whole.
    fs::write(at("old.mcap"), "something else").unwrap();
    done(&at("survey"), &at("old.mcap"));
    assert_eq!(read(&at("old.mcap")).1.ending(), Some(&Ending::Complete));
}

#[test]
fn surveys_without_a_type_in_ros_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let survey = folder.path().join("survey");
    fs::create_dir(&survey).unwrap();
    let text = |level: &str, frame: &str| {
        format!(
            "#![enable(implicit_some)]\n(camera: (width: 4, height: 3, pixel_pitch_mm: (0.04, 0.04), principal_distance_mm: 8.0,
            principal_point_mm: (0.0, 0.0), modulation_hz: [20e6], phase_steps: 4), level: {level}, frames: [{frame}])"
        )
    };
    fs::write(survey.join("survey.ron"), text("samples", "")).unwrap();
    let out = folder.path().join("x.mcap");
    assert!(refusal(&survey, &out).contains("frames at level `samples` have no type in ROS"));
    fs::write(survey.join("survey.ron"), text("depth", "(file: \"a.npz\", station: \"S\")")).unwrap();
    assert!(refusal(&survey, &out).contains("frames[0] of the survey has no timestamp_s"));
    assert!(!out.exists());
}
