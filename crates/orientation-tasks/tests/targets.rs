//! By targets: control, tie points, and what is wrong with them.

use orientation_tasks::pipeline::{DoubtKind, Error, Failure, Judged};
use range_io::tables::read_stations;

use crate::scene::{by_targets, edit, field, stations, target_field};

fn own(fields: &[&str]) -> Vec<String> {
    fields.iter().map(|field| (*field).to_owned()).collect()
}

#[test]
fn stations_of_a_target_field_are_where_they_truly_stand() {
    let folder = tempfile::tempdir().unwrap();
    let survey = field(folder.path());
    let summary = by_targets(&survey).unwrap();
    println!("{summary}");
    assert_eq!((summary.stations.len(), summary.not_oriented.len()), (14, 0));
    // A share of 0.002 of the values is 20 sigmas off or more.
    assert!((1..10).contains(&summary.rejected.len()), "{:?}", summary.rejected);
    assert_eq!(summary.doubts(), [], "{:?}", summary.doubts());
    let truth = read_stations(target_field().join("truth/stations.csv")).unwrap();
    let mut sum = 0.0;
    for (found, truth) in stations(&survey).iter().zip(&truth) {
        assert_eq!(found.station, truth.station);
        let off = found.world_from_camera.translation.vector - truth.world_from_camera.translation.vector;
        let sigma = found.sigma_position_m.unwrap();
        sum += (0..3).map(|axis| (off[axis] / sigma[axis]).powi(2)).sum::<f64>() / (3.0 * truth_count(&summary));
    }
    // Mean of 42 squares that are correlated within each station.
    assert!((0.5..1.7).contains(&sum), "{sum}");
}

fn truth_count(summary: &orientation_tasks::OrientSummary) -> f64 {
    summary.stations.len() as f64
}

#[test]
fn ranges_without_a_calibration_are_doubted() {
    let folder = tempfile::tempdir().unwrap();
    let survey = field(folder.path());
    std::fs::remove_file(survey.join("calibration.ron")).unwrap();
    let summary = by_targets(&survey).unwrap();
    assert!(summary.doubts().iter().any(|doubt| doubt.kind == DoubtKind::Calibration), "{:?}", summary.doubts());
}

#[test]
fn tie_points_alone_orient_all_stations_in_the_frame_of_the_first() {
    let folder = tempfile::tempdir().unwrap();
    let survey = field(folder.path());
    std::fs::remove_file(survey.join("targets.csv")).unwrap();
    let summary = by_targets(&survey).unwrap();
    println!("{summary}");
    let truth = read_stations(target_field().join("truth/stations.csv")).unwrap();
    let distance = |rows: &[range_io::tables::Station], index: usize| {
        let at = |index: usize| rows[index].world_from_camera.translation.vector;
        (at(index) - at(0)).norm()
    };
    for index in 1..14 {
        let [found, true_m] = [distance(&stations(&survey), index), distance(&truth, index)];
        assert!((found - true_m).abs() < 0.02, "{index}: {found} {true_m}");
    }
    // Image points alone: one unit for all.
    edit(&survey.join("observations.csv"), |_, fields| {
        let mut changed = own(fields);
        changed[4].clear();
        Some(changed)
    });
    let summary = by_targets(&survey).unwrap();
    assert!(summary.doubts().iter().any(|doubt| doubt.kind == DoubtKind::Units), "{:?}", summary.doubts());
    let ratio = |index: usize| distance(&stations(&survey), index) / distance(&truth, index);
    assert!((3..14).all(|index| (ratio(index) / ratio(2) - 1.0).abs() < 0.05));
}

#[test]
fn a_station_that_a_few_targets_of_a_plane_do_not_hold_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let survey = field(folder.path());
    // Four targets of the wall around its middle, image points alone, seen by a distant station with noise.
    let kept = ["T022", "T024", "T033", "T040"];
    edit(&survey.join("observations.csv"), |_, fields| {
        let flat = fields[0] != "F07" || kept.contains(&fields[1]);
        let mut changed = own(fields);
        if fields[0] == "F07" {
            changed[4].clear();
            (changed[5], changed[6]) = ("0.5".to_owned(), "0.5".to_owned());
        }
        flat.then_some(changed)
    });
    let summary = by_targets(&survey).unwrap();
    println!("{:?}", summary.not_oriented);
    let missing: Vec<_> = summary.not_oriented.iter().map(|one| one.station.as_str()).collect();
    assert_eq!(missing, ["F07"], "{summary}");
    assert!(summary.doubts().iter().any(|doubt| doubt.subject.as_deref() == Some("F07")));
    assert_eq!(stations(&survey).len(), 13);
}

#[test]
fn slips_in_the_tables_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let survey = field(folder.path());
    let table = survey.join("observations.csv");
    let sound = std::fs::read_to_string(&table).unwrap();
    // A row twice.
    let second = sound.lines().nth(1).unwrap();
    std::fs::write(&table, format!("{sound}{second}\n")).unwrap();
    let error = by_targets(&survey).unwrap_err();
    assert!(error.to_string().contains("row above"), "{error}");
    // No standard deviations.
    std::fs::write(&table, &sound).unwrap();
    edit(&table, |_, fields| {
        let mut changed = own(fields);
        (changed[5], changed[6]) = (String::new(), String::new());
        Some(changed)
    });
    let error = by_targets(&survey).unwrap_err();
    assert!(error.to_string().contains("--sigma-pixel") && error.failure() == Failure::Usage, "{error}");
    // Columns and rows exchanged.
    std::fs::write(&table, &sound).unwrap();
    edit(&table, |_, fields| {
        let mut changed = own(fields);
        changed.swap(2, 3);
        Some(changed)
    });
    match by_targets(&survey) {
        Ok(summary) => assert!(summary.doubts().len() > 3, "{summary}"),
        Err(error) => assert_eq!(error.failure(), Failure::Refused, "{error}"),
    }
    // Coordinates in millimetres.
    std::fs::write(&table, &sound).unwrap();
    edit(&survey.join("targets.csv"), |_, fields| {
        let mut changed = own(fields);
        for field in &mut changed[1..4] {
            *field = (1000.0 * field.parse::<f64>().unwrap()).to_string();
        }
        Some(changed)
    });
    match by_targets(&survey) {
        Ok(summary) => assert!(summary.doubts().len() > 3, "{summary}"),
        Err(error) => assert!(matches!(error, Error::Refused { .. }), "{error}"),
    }
    // Nothing.
    std::fs::write(&table, sound.lines().next().unwrap()).unwrap();
    assert!(by_targets(&survey).unwrap_err().to_string().contains("no rows"));
}

#[test]
fn one_wild_target_is_named_and_takes_no_part() {
    let folder = tempfile::tempdir().unwrap();
    let survey = field(folder.path());
    edit(&survey.join("observations.csv"), |index, fields| {
        let mut changed = own(fields);
        if index == 4 {
            changed[2] = "3.0".to_owned();
        }
        Some(changed)
    });
    let summary = by_targets(&survey).unwrap();
    assert!(summary.rejected.iter().any(|value| value.line == 6), "{:?}", summary.rejected);
    assert_eq!(summary.stations.len(), 14);
}
