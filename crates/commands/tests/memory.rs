//! How much may be done at once in how much memory.

use commands::memory::{Amount, FrameBytes, Memory, Work, bounded, keeping};
use commands::range_io::survey::Survey;
use commands::{Error, Failure};

const WORK: Work<'static> = Work { what: "reading frames", kept: 100_000_000, each: 10_000_000, most: 8 };

#[test]
fn amounts_have_units() {
    for (text, bytes) in [
        ("2GB", 2_000_000_000),
        ("500 MB", 500_000_000),
        ("1.5GiB", 3 << 29),
        (" 64MiB ", 1 << 26),
        ("0.5GB", 500_000_000),
    ] {
        assert_eq!(text.parse(), Ok(Memory::stated(bytes)), "{text}");
    }
    for text in ["", "2", "GB", "two GB", "2gb", "2TB", "-1GB", "0MB", "NaNGB", "infGB", "1e300GB", "2GB more"] {
        let error = text.parse::<Memory>().unwrap_err().to_string();
        assert!(error.contains(&format!("{text:?}")) && error.contains("MB, GB, MiB or GiB"), "{error}");
    }
}

#[test]
fn what_fits_is_done_at_once_and_what_does_not_says_what_it_needs() {
    // Beside the program's 50 MB.
    let at_once = |megabytes: u64| Memory::stated(megabytes * 1_000_000).at_once(&WORK);
    for (megabytes, units) in [(160, 1), (169, 1), (170, 2), (229, 7), (10_000, 8)] {
        assert_eq!(at_once(megabytes).unwrap(), units, "{megabytes} MB");
    }
    let error = at_once(159).unwrap_err();
    assert_eq!(error.failure(), Failure::Usage);
    assert!(matches!(&error, Error::Memory { needed: Amount(160_000_000), allowed: Amount(159_000_000), .. }));
    let words = error.to_string();
    assert!(words.contains("reading frames: needs 160MB") && words.contains("--memory 160MB"), "{words}");
    // What it says is enough.
    let needed = words.rsplit("--memory ").next().unwrap().split(',').next().unwrap();
    assert_eq!(needed.parse::<Memory>().unwrap().at_once(&WORK).unwrap(), 1);
}

#[test]
fn what_the_caller_keeps_counts() {
    let inside = || Memory::present().at_once(&WORK);
    let memory = Some(Memory::stated(200_000_000));
    assert_eq!(bounded(memory, inside).unwrap(), 5);
    assert_eq!(bounded(memory, || keeping(30_000_000, inside)).unwrap(), 2);
    assert!(bounded(memory, || keeping(50_000_000, inside)).is_err());
    assert_eq!(bounded(memory, || (keeping(50_000_000, || ()), inside()).1).unwrap(), 5, "kept for that work alone");
    // A default gives way.
    assert_eq!(keeping(u64::MAX, inside).unwrap(), 1);
}

#[test]
fn a_frame_takes_what_its_planes_take() {
    let text = |level: &str| {
        format!(
            "#![enable(implicit_some)]\n(camera: (width: 640, height: 480, pixel_pitch_mm: (0.01, 0.01), principal_distance_mm: 8.0, \
             principal_point_mm: (0.0, 0.0), modulation_hz: [2e7], phase_steps: 4), level: {level}, \
             frames: [(file: \"a.npz\", station: \"S\")])"
        )
    };
    let bytes = |level: &str| FrameBytes::of(&Survey::parse("survey.ron".as_ref(), &text(level)).unwrap());
    let (samples, range) = (bytes("samples"), bytes("range"));
    assert_eq!(samples.pixels, 640 * 480);
    // 64 complex images: 350 MB, as the averaging of so many was measured.
    assert_eq!(64 * samples.waiting, 353_894_400);
    assert!(samples.read > range.read && samples.staged > range.staged);
}
