//! Intervals against the truth; `examples/lengths.rs` does the same at length.

use crate::{scene, statistics};

/// Surveys: normalised squared errors of so many lie in 0.36 to 2.2 with odds of one to 10,000 each side (χ² of 30).
const SURVEYS: u64 = 30;

#[test]
fn intervals_hold_the_truth_and_lie_without_the_calibration() {
    let tallies = statistics::run(SURVEYS, 1000);
    for (name, tally) in &tallies {
        // Of 30 intervals, 24 or fewer hold the truth once in 300,000 times.
        assert!(tally.inside() >= 25.0 / 30.0, "{name}: {} inside", tally.inside());
        if !name.starts_with("flatness") {
            assert!((0.36..2.2).contains(&tally.nse()), "{name}: {}", tally.nse());
        }
    }
    let lied = &tallies["sphere to sphere"];
    assert!(lied.nse_without() > lied.nse());
}

#[test]
fn scatter_of_good_planes_is_as_expected() {
    // Three stations whose poses differ by millimetres see one wall; the sum of squares must know that.
    let (mut sum, mut exceeding) = (0.0, 0);
    let surveys = 40;
    for seed in 0..surveys {
        let survey = scene::survey(&scene::Setting::default(), 2000 + seed);
        let cloud = survey.cloud();
        let points = scene::wall_region().select(cloud.points).unwrap();
        let wall = measurement::fit_plane(&cloud, &points, &measurement::FitOptions::default()).unwrap();
        let scatter = wall.support.scatter;
        assert!(scatter.degrees_of_freedom < wall.support.kept.len() as f64);
        sum += scatter.sigma0.powi(2) / surveys as f64;
        exceeding += u32::from(scatter.exceeds());
    }
    assert!((sum - 1.0).abs() < 0.15, "mean variance factor {sum}");
    assert!(exceeding <= 3, "{exceeding} of {surveys} at one in a hundred");
}
