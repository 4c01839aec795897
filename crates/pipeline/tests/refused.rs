//! Stations that nothing connects, in words.

use multiview_registration::Error;
use pipeline::stations::{Tried, refused};

#[test]
fn stations_of_one_name_are_told_apart_and_each_has_its_reason() {
    let names = ["Y1", "Y1", "Y2"].map(str::to_owned);
    let error = Error::UnconnectedStations {
        stations: vec![1, 2],
        to: 0,
        reasons: vec!["shares 3 tiles".to_owned(), "shares none".to_owned()],
    };
    let words = |tried| refused::of_command(&error, &names, tried).to_string();
    let found = words(Tried::Poses(Some(0.5)));
    assert!(found.contains("brings Y1 (number 2), Y2 into the frame of Y1 (number 1)"), "{found}");
    assert!(found.contains("right to 0.5 m") && found.contains("Y2: shares none"), "{found}");
    assert!(words(Tried::Order).contains("give start poses"));
    let other = refused::of_command(&Error::NoSuchStation { station: 3, count: 2 }, &names, Tried::Order).to_string();
    assert!(!other.contains("nothing brings"), "{other}");
}
