//! Broken networks say what is broken; single gross errors stop nothing.

#[path = "../examples/calibrations/faults.rs"]
mod faults;
#[path = "../examples/calibrations/networks.rs"]
mod networks;
#[path = "../examples/calibrations/suite.rs"]
mod suite;

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
