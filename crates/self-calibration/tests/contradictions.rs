//! Broken networks say what is broken; single gross errors stop nothing.

#[allow(dead_code, reason = "the example runs all of them")]
#[path = "../examples/calibrations/faults/mod.rs"]
pub(crate) mod faults;
#[allow(dead_code, reason = "the example runs all of them")]
#[path = "../examples/calibrations/networks.rs"]
pub(crate) mod networks;
#[path = "../examples/calibrations/suite.rs"]
pub(crate) mod suite;

use faults::On;
use self_calibration::{CalibrationOptions, calibrate};
use suite::Answer;

/// Faults that take seconds, of every kind.
const QUICK: [&str; 16] = [
    "image point off by 100 pixels",
    "image point outside the image",
    "image point off by 6 pixels",
    "range one interval too long",
    "range in millimetres",
    "two names exchanged",
    "half the ranges of a station an interval too long",
    "ranges of a station by another frequency",
    "a copy of a station",
    "a station with the frame of another",
    "ranges by another frequency, 20 for 30 MHz",
    "pixel pitch of another camera",
    "station 10 cm off",
    "no radial lens terms",
    "no waves of the ranges",
    "a lens with affinity",
];

/// Each on one of the networks, with seeds that the longer run of the example does not use; `cargo xtask verify calibrations`
/// runs all of them on all networks.
#[test]
fn every_fault_is_named_and_no_number_is_silently_wrong() {
    let networks = [networks::sound(), networks::with_control(), networks::with_stations()];
    let faults = faults::all();
    let mut wrong = Vec::new();
    for (index, name) in QUICK.iter().enumerate() {
        let fault = faults.iter().find(|fault| fault.name == *name).unwrap();
        let suited = &networks[[On::Any, On::Control, On::Stations].iter().position(|on| *on == fault.on).unwrap()];
        let (answer, words) = suite::judge(&suited[index % 3], fault, 7 + index as u64);
        if answer != Answer::Right {
            wrong.push(format!("{name} of {}: {answer:?}: {words}", suited[index % 3].name));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn sound_networks_keep_their_verdict() {
    for sound in networks::sound() {
        for seed in 40..44 {
            suite::is_kept(&sound, seed).unwrap();
        }
    }
}

/// Looking for contradictions leaves a sound network where the plain adjustment brings it.
#[test]
fn sound_networks_keep_the_result_of_the_plain_adjustment() {
    for sound in networks::sound() {
        for seed in 60..63 {
            let network = sound.observed(seed);
            // At this level no sound value is rejected.
            let looking = CalibrationOptions { rejection_level: Some(1e-12), ..suite::options(&sound) };
            let plain = CalibrationOptions { rejection_level: None, ..suite::options(&sound) };
            let [looking, plain] = [looking, plain].map(|options| calibrate(&network, &options).unwrap());
            assert_eq!(looking.rejected(), 0);
            for name in &plain.estimated {
                let [found, known] = [&looking, &plain].map(|outcome| outcome.parameter(name).unwrap());
                let off = (found.value - known.value).abs() / known.sigma_prior;
                assert!(off < 1e-6, "{} {seed}: {name} moved by {off:e} of its deviation", sound.name);
            }
            for (found, known) in looking.stations.iter().zip(&plain.stations) {
                let [found, known] = [found, known].map(|station| station.world_from_camera.translation.vector);
                // A millionth of a tenth of a millimetre.
                assert!((found - known).norm() < 1e-10, "{} {seed}", sound.name);
            }
        }
    }
}
