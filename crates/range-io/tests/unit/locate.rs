//! Places in a RON text; a module of `src/text/ron_text/locate.rs`.

use super::*;

const TEXT: &str = "#![enable(implicit_some)]\n(\n  a: 1, // b: 2\n  \"k\": Some(\"x(:\"),\n  list: [\n    (c: (1, 2)), (c: Some((3,\n      4))),\n  ],\n)\n";

#[test]
#[cfg(any(feature = "survey", feature = "calibration"))]
fn fields_are_found_at_their_places() {
    assert_eq!(place_of(TEXT, "a"), (3, 6));
    assert_eq!(place_of(TEXT, "k"), (4, 8));
    assert_eq!(place_of(TEXT, "list[0].c[1]"), (6, 13));
    assert_eq!(place_of(TEXT, "list[1].c[1]"), (7, 7));
    // What is missing is looked for at its parent.
    assert_eq!(place_of(TEXT, "list[1].d"), (6, 18));
    assert_eq!(place_of(TEXT, "z"), (2, 1));
}

#[test]
fn places_tell_their_fields() {
    let field_at = |place| field_between(TEXT, place, place).1;
    assert_eq!(field_at((3, 6)), "a");
    assert_eq!(field_at((7, 7)), "list[1].c[1]");
    assert_eq!(field_at((6, 13)), "list[0].c[1]");
    assert_eq!(field_at((1, 1)), "");
    // The blanks before a value belong to it.
    assert_eq!(field_between(TEXT, (3, 5), (3, 6)), ((3, 6), "a".into()));
    assert_eq!(field_of_group(TEXT, (6, 15), "d"), "list[0].d");
    assert_eq!(field_of_group(TEXT, (9, 1), "d"), "d");
}

#[test]
fn deep_and_long_texts_cost_no_more_than_their_length() {
    let started = std::time::Instant::now();
    let deep = "[".repeat(1 << 20);
    assert_eq!(field_between(&deep, (1, 129), (1, 130)).0, (1, 129));
    assert_eq!(field_of_group(&deep, (1, 1 << 20), "d"), "d");
    // A long key above many values: their paths together would be its length times their number.
    let wide = format!("({}: [{}])", "k".repeat(1 << 18), "1,".repeat(1 << 18));
    let end = wide.len();
    assert!(field_between(&wide, (1, end), (1, end)).1.ends_with(&format!("[{}]", (1 << 18) - 1)));
    #[cfg(any(feature = "survey", feature = "calibration"))]
    {
        assert_eq!(place_of(&deep, "[0][0].a"), (1, 3));
        assert_eq!(place_of(&wide, &format!("{}[7]", "k".repeat(1 << 18))), (1, (1 << 18) + 19));
    }
    // Some hundredths of a second; with a path for each value it takes minutes and gigabytes.
    assert!(started.elapsed().as_secs() < 20, "{:?}", started.elapsed());
}
