//! Names of targets without coordinates, checked by the stations that see them.

use orientation::{Error, NameCheckOptions, NameVerdict, check_names};

use crate::surveys::{Kind, Tally};

/// Surveys of each kind: the example `wrong_names` makes hundreds.
const SURVEYS: u64 = 8;

#[test]
fn a_wrong_name_is_found_and_no_right_one_doubted() {
    for (stations, with_ranges, is_nominal) in
        [(2, false, false), (2, true, false), (3, false, false), (4, true, false), (3, true, true)]
    {
        let kind = Kind { stations, with_ranges, is_nominal };
        let Tally { doubted, checked, wrong, found, alone, beside } = Tally::of(kind, SURVEYS, 7);
        eprintln!(
            "{stations} {with_ranges} {is_nominal}: {checked:.2} {found} ({alone}) of {wrong}, {doubted} {beside}"
        );
        assert_eq!((doubted, beside), (0, 0), "{stations} {with_ranges} {is_nominal}");
        assert!(checked > 0.6 && wrong as u64 == SURVEYS);
        // Of two stations without ranges one that lies on its epipolar line by chance is not found.
        let missed = usize::from(stations == 2 && !with_ranges) + usize::from(is_nominal);
        assert!(found + missed >= wrong, "{stations} {with_ranges} {is_nominal}: {found} of {wrong}");
    }
}

#[test]
fn what_cannot_be_checked_is_open() {
    let kind = Kind { stations: 3, with_ranges: false, is_nominal: false };
    let all = kind.survey(3);
    let alone: Vec<_> = all.iter().filter(|seen| seen.station == 0).copied().collect();
    assert!(kind.check(&alone).iter().all(|verdict| *verdict == NameVerdict::Open));
    assert!(kind.check(&[]).is_empty());
    // A station with five of the targets is left out, and the others judge each other.
    let mut few = all.clone();
    let mut kept = 0;
    few.retain(|seen| {
        kept += usize::from(seen.station == 2);
        seen.station != 2 || kept <= 5
    });
    for (seen, verdict) in few.iter().zip(kind.check(&few)) {
        assert!(seen.station != 2 || verdict == NameVerdict::Open);
        assert!(!matches!(verdict, NameVerdict::Contradicts { .. }));
    }
    let mut broken = all;
    broken[3].image.sigma_pixel[0] = f64::NAN;
    let refused = check_names(&kind.camera(), &broken, &NameCheckOptions::default());
    assert!(matches!(refused, Err(Error::InvalidTarget { .. })), "{refused:?}");
}
