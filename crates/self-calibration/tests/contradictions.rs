//! Broken networks say what is broken; single gross errors stop nothing.

#[path = "../examples/calibrations/faults.rs"]
pub(crate) mod faults;
#[path = "../examples/calibrations/networks.rs"]
pub(crate) mod networks;
#[path = "../examples/calibrations/suite.rs"]
pub(crate) mod suite;

use self_calibration::{CalibrationOptions, calibrate};
use suite::Answer;

/// Faults that take seconds: the first of the list.
const QUICK: usize = 9;

/// Faults of single values and of one station, each on one of the networks, with seeds that the longer run of the example
/// does not use; `cargo xtask verify calibrations` runs all of them on all networks.
#[test]
fn every_fault_is_named_and_no_number_is_silently_wrong() {
    let sound = networks::sound();
    let (mut right, mut all) = (0, 0);
    for (index, fault) in faults::all().iter().take(QUICK).enumerate() {
        let (answer, words) = suite::judge(&sound[index % 3], fault, 7 + index as u64);
        all += 1;
        right += usize::from(answer == Answer::Right);
        assert!(answer != Answer::Silent, "{} of {}: {words}", fault.name, sound[index % 3].name);
        if answer != Answer::Right {
            println!("{} of {}: {answer:?}: {words}", fault.name, sound[index % 3].name);
        }
    }
    assert!(right == all, "{right} of {all}");
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
