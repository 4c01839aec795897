//! Recordings that were cut and changed at random.

use std::io::Cursor;

use proptest::prelude::*;
use recordings::Recording;

use crate::common::{adi, bag, mcap, mkv};

fn recordings() -> Vec<Vec<u8>> {
    vec![
        mcap::recording(),
        bag::recording("none"),
        bag::recording("lz4"),
        mkv::recording(),
        adi::bin(),
        adi::adcam(3, 3),
    ]
}

/// Reads to the end, which comes: at most one message for each byte.
fn read(bytes: Vec<u8>) -> usize {
    let length = bytes.len();
    let Ok(mut recording) = Recording::from_reader("hostile", Cursor::new(bytes)) else { return 0 };
    let mut count = 0;
    while recording.next_message().unwrap().is_some() {
        count += 1;
        assert!(count <= 1000 + length);
    }
    assert!(recording.ending().is_some());
    count
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn cut_and_changed_bytes_are_no_panic(
        which in 0..6_usize,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
        cut in any::<prop::sample::Index>(),
        is_cut in any::<bool>(),
    ) {
        let mut bytes = recordings().swap_remove(which);
        for (place, value) in changes {
            let place = place.index(bytes.len());
            bytes[place] = value;
        }
        if is_cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        read(bytes);
    }

    /// Lengths that promise everything, behind a beginning that is right.
    #[test]
    fn lengths_that_promise_everything_are_not_believed(which in 0..6_usize, place in any::<prop::sample::Index>()) {
        let mut bytes = recordings().swap_remove(which);
        let place = place.index(bytes.len().saturating_sub(8));
        bytes[place..place + 8].fill(0xFF);
        read(bytes);
    }
}
