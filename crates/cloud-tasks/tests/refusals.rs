//! What is refused, by itself or as a whole.

use cloud_tasks::commands::{Failure, Judged, Verdict};

use crate::results::{Folder, PLAN};

fn plan(regions: &str, lengths: &str) -> String {
    format!("(regions: {{{regions}}}, lengths: [{lengths}])")
}

#[test]
fn a_length_that_points_do_not_show_leaves_the_others() {
    let folder = Folder::new(8);
    let regions = r#""ball": sphere(sphere(centre_m: (0.2, 0.6, 0.3), radius_m: 0.2)),
        "nothing": plane(box(from_m: (5.0, 5.0, 5.0), to_m: (6.0, 6.0, 6.0)))"#;
    let lengths =
        r#"(name: "d", quantity: diameter(of: "ball")), (name: "n", quantity: distance(from: "ball", to: "nothing"))"#;
    let summary = folder.measure(&plan(regions, lengths)).unwrap();
    assert_eq!(summary.verdict(), Verdict::Partial);
    assert!(summary.lengths[0].value.is_some() && summary.lengths[1].value.is_none());
    assert!(summary.lengths[1].refused.as_ref().unwrap().contains("0 points for a plane"), "{:?}", summary.lengths[1]);
    assert!(folder.read("lengths.csv").contains("n,distance,,,,,"));

    let lengths = r#"(name: "n", quantity: distance(from: "ball", to: "nothing"))"#;
    let error = folder.measure(&plan(regions, lengths)).unwrap_err();
    assert_eq!(error.failure(), Failure::Refused);
    // The older result stays.
    assert!(folder.read("refused.json").contains("0 points") && !folder.read("lengths.csv").is_empty());
}

#[test]
fn plans_that_mean_nothing_are_told_by_name() {
    let folder = Folder::new(9);
    let ball =
        r#""ball": sphere(sphere(centre_m: (0.2, 0.6, 0.3), radius_m: 0.2)), "up": direction(along: (0.0, 0.0, 1.0))"#;
    let said = |lengths: &str| {
        let error = folder.measure(&plan(ball, lengths)).unwrap_err();
        assert_eq!(error.failure(), Failure::Usage, "{error}");
        error.to_string()
    };
    assert!(said("").contains("`lengths` is empty"));
    let found = said(r#"(name: "a", quantity: radius(of: "pipe"))"#);
    assert!(found.contains("needs region `pipe`, there are ball, up"), "{found}");
    let found = said(r#"(name: "a", quantity: flatness(of: "ball"))"#);
    assert!(found.contains("flatness is that of a plane, found sphere"), "{found}");
    let found = said(r#"(name: "a", quantity: distance(from: "ball", to: "up"))"#);
    assert!(found.contains("found sphere and direction"), "{found}");
    let radius = r#"(name: "a", quantity: radius(of: "ball"))"#;
    assert!(said(&format!("{radius}, {radius}")).contains("two lengths are called `a`"));
    let found = said(r#"(name: "a", quantity: radius(of: "ball", at: 3))"#);
    assert!(found.contains("at"), "{found}");
    let flat = r#""flat": plane(box(from_m: (0.0, 0.0, 0.0), to_m: (0.0, 1.0, 1.0)))"#;
    let found = folder.measure(&plan(flat, r#"(name: "a", quantity: flatness(of: "flat"))"#)).unwrap_err().to_string();
    assert!(found.contains("region `flat`") && found.contains("to_m - from_m"), "{found}");
}

#[test]
fn common_errors_that_mean_nothing_are_told_by_field() {
    let folder = Folder::new(10);
    let said = |change: &dyn Fn(&mut cloud_tasks::CommonErrorsFile)| {
        let mut errors = folder.common_errors();
        change(&mut errors);
        folder.write_errors(&errors);
        let error = folder.measure(PLAN).unwrap_err();
        assert_eq!(error.failure(), Failure::Usage, "{error}");
        error.to_string()
    };
    assert!(said(&|errors| errors.format_version = 7).contains("`format_version` is 7"));
    assert!(said(&|errors| errors.covariance[3].truncate(2)).contains("`covariance[3]` has 2 values, expected 4"));
    assert!(said(&|errors| errors.covariance[1][0] = 1.0).contains("covariance of"));
    assert!(said(&|errors| errors.frames.truncate(2)).contains("there are 2"));
    assert!(said(&|errors| errors.frames[1].quaternion_xyzw = [0.0; 4]).contains("frames[1] (S1): `quaternion_xyzw`"));
    assert!(
        said(&|errors| errors.frames[0].range_model = Some(4)).contains("`range_model` is 4, the calibration has 1")
    );
    assert!(said(&|errors| errors.frames[0].columns.pose = Some(900)).contains("column 905"));
    assert!(said(&|errors| errors.calibration = None).contains("`calibration` names no file"));
}

#[test]
fn the_plan_of_the_guide_is_read() {
    let guide = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/formats.md")).unwrap();
    let section = guide.split("## Regions and lengths").nth(1).unwrap();
    let plan = section.split("```ron").nth(1).unwrap().split("```").next().unwrap();
    // Its heap and table are elsewhere; what it asks for is understood.
    let found = Folder::new(11).measure(plan);
    assert!(found.is_ok_and(|summary| summary.lengths.len() == 5));
}
