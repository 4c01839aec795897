//! What the calibrated drift says.

use live_tasks::live_frames::DriftStage;
use live_tasks::{DriftVerdict, LiveRequest, LiveSource, live};

use crate::common::{FRAMES, World};

#[test]
fn a_camera_is_warming_up_warm_or_not_calibrated() {
    let world = World::new();
    let summary = live(&world.request(LiveSource::Path(world.survey())), &mut ()).unwrap();
    assert_eq!(summary.drift.verdict, DriftVerdict::NotCalibrated);

    let world = World::with("warm_up: (transients: [(amplitude_m: -0.03, time_constant_s: 600.0)]),");
    let request = world.request(LiveSource::Path(world.survey()));
    let summary = live(&request, &mut ()).unwrap();
    assert_eq!((summary.frames, summary.drift.verdict), (FRAMES as u64, DriftVerdict::WarmingUp), "{summary}");
    // A minute after power-on: 30 mm times exp(-0.1), or what is left of it to the end.
    assert!((0.002..0.03).contains(&summary.drift.drift_m.unwrap().abs()), "{summary}");

    let summary = live(&LiveRequest { power_on_s: Some(-7200.0), ..request.clone() }, &mut ()).unwrap();
    assert_eq!(summary.drift.verdict, DriftVerdict::Warm, "{summary}");
    assert!(summary.doubts.is_empty(), "{summary}");

    // Outside of the fit frames are refused, unless the drift is to stay.
    let file = world.survey().join("calibration.ron");
    let text = std::fs::read_to_string(&file).unwrap();
    let at = text.find("warm_up").unwrap() + text[text.find("warm_up").unwrap()..].find("transients").unwrap();
    let text = format!("{}time_span_s: (100.0, 5000.0), {}", &text[..at], &text[at..]);
    std::fs::write(&file, &text).unwrap();
    let error = live(&request, &mut ()).unwrap_err();
    assert!(error.to_string().contains("no frame"), "{error}");
    let summary = live(&LiveRequest { drift: DriftStage::Ignore, ..request }, &mut ()).unwrap();
    assert_eq!((summary.frames, summary.drift.verdict), (FRAMES as u64, DriftVerdict::Outside), "{summary}");
    assert_eq!(summary.doubts.len(), 1);
}
