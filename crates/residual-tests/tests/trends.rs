//! Trends in residuals: false alarms at the stated level, power on planted ones, errors that neighbours share.

use std::f64::consts::TAU;

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use residual_tests::{Error, TrendOptions, TrendSample, TrendVariable, TrendVerdict, test_trends};

const SIGMA_M: f64 = 0.005;

/// Frames of 24 x 18 pixels of a wall, 14 of them, with noise that depends on the amplitude and nothing else.
fn frames(seed: u64) -> Vec<TrendSample> {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut samples = Vec::new();
    for frame in 0..14_usize {
        let distance = 0.8 + 0.3 * frame as f64;
        for index in 0..24 * 18_usize {
            let (column, row) = ((index % 24) as f64, (index / 24) as f64);
            let from_centre = ((column - 11.5) / 12.0).powi(2) + ((row - 8.5) / 12.0).powi(2);
            let dark = if (index / 3 + frame) % 4 == 0 { 0.2 } else { 1.0 };
            let amplitude = 4000.0 * dark / (distance * distance * (1.0 + from_centre));
            let sigma_m = SIGMA_M * (1000.0 / amplitude).sqrt();
            let noise: f64 = StandardNormal.sample(&mut random);
            samples.push(TrendSample {
                residual_m: sigma_m * noise,
                sigma_m,
                range_m: distance * (1.0 + 0.1 * from_centre),
                amplitude,
                column,
                row,
                time_s: frame as f64,
                frame,
            });
        }
    }
    samples
}

fn found(samples: &[TrendSample]) -> Vec<TrendVariable> {
    let report = test_trends(samples, &TrendOptions::default()).unwrap();
    report.trends().map(|test| test.variable).collect()
}

#[test]
fn noise_alone_raises_alarms_at_the_stated_level() {
    let runs = 100;
    let options = TrendOptions { level: 0.1, ..TrendOptions::default() };
    let alarms = (0..runs).filter(|seed| test_trends(&frames(*seed), &options).unwrap().trends().next().is_some());
    let alarms = alarms.count();
    println!("{alarms} alarms in {runs} runs at a level of {}", options.level);
    // The variables share the level, which Holm keeps from above as they are not independent. 100 runs at 10 % give
    // 10 alarms with a deviation of 3; three of them above, and not so few that the test sleeps.
    assert!((2..=19).contains(&alarms), "{alarms}");
}

#[test]
fn noise_that_neighbours_share_raises_no_more_alarms() {
    let runs = 30;
    let mut alarms = 0;
    for seed in 0..runs {
        let mut samples = frames(1000 + seed);
        let mut random = Pcg64::seed_from_u64(seed);
        // Each patch of 4 x 3 pixels of a frame has an error of its own, twice as large as the noise of a pixel.
        let patches: Vec<f64> = (0..14 * 6 * 6).map(|_| StandardNormal.sample(&mut random)).collect();
        for sample in &mut samples {
            let patch = sample.frame * 36 + (sample.row as usize / 3) * 6 + sample.column as usize / 4;
            sample.residual_m += 2.0 * SIGMA_M * patches[patch];
        }
        let trends = found(&samples);
        alarms += usize::from(!trends.is_empty());
        println!("{trends:?}");
    }
    println!("{alarms} alarms in {runs} runs with shared errors at a level of 0.01");
    // 0.3 are expected at the level of 1 %. What cells still share, though it is too little to be seen, makes it some
    // percent: by seeing nothing shared the test would call nearly each of these a trend.
    assert!(alarms <= 3, "{alarms}");
}

#[test]
fn an_error_of_whole_frames_is_no_trend_in_the_image() {
    let mut alarms = 0;
    for seed in 0..20 {
        let mut samples = frames(2000 + seed);
        let mut random = Pcg64::seed_from_u64(seed);
        let of_frame: Vec<f64> = (0..14).map(|_| StandardNormal.sample(&mut random)).collect();
        for sample in &mut samples {
            sample.residual_m += 0.01 * of_frame[sample.frame];
        }
        // Frames stand at ranges and times of their own: their errors depend on these.
        let place = [TrendVariable::Column, TrendVariable::Row];
        alarms += found(&samples).iter().filter(|variable| place.contains(variable)).count();
    }
    assert!(alarms <= 1, "{alarms} alarms of 40 tests at a level of 1 % a run");
}

#[test]
fn planted_trends_are_found_and_named() {
    type Trend = fn(&TrendSample) -> f64;
    let planted: [(TrendVariable, Trend); 4] = [
        (TrendVariable::Range, |s| 0.0015 * (TAU * s.range_m / 1.25).sin()),
        (TrendVariable::Amplitude, |s| 0.3 / s.amplitude),
        (TrendVariable::Column, |s| 1.5e-4 * (s.column - 11.5)),
        (TrendVariable::Row, |s| 3.5e-5 * (s.row - 8.5).powi(2)),
    ];
    for (variable, trend) in planted {
        let runs = 8;
        let mut hits = 0;
        for seed in 0..runs {
            let mut samples = frames(3000 + seed);
            for sample in &mut samples {
                sample.residual_m += trend(sample);
            }
            hits += usize::from(found(&samples).contains(&variable));
        }
        // Trends of a fifth to a third of the noise of a pixel, seen in 6000 of them.
        assert!(hits >= runs as usize - 1, "{variable:?}: {hits} of {runs}");
    }
    let mut drift = frames(1);
    for sample in &mut drift {
        sample.residual_m += 2e-4 * sample.time_s;
    }
    let report = test_trends(&drift, &TrendOptions::default()).unwrap();
    let time = report.tests.iter().find(|test| test.variable == TrendVariable::Time).unwrap();
    assert_eq!(time.verdict, TrendVerdict::Trend);
    // A ramp over 14 frames of 0.2 mm has an rms of 0.2 sqrt((14² - 1) / 12) = 0.81 mm; the means know it to 0.2 mm.
    assert!((time.rms_m - 0.81e-3).abs() < 0.3e-3, "{}", time.rms_m);
    assert!(!report.is_random());
}

#[test]
fn what_does_not_vary_is_not_tested_and_bad_input_is_refused() {
    let mut samples = frames(7);
    for sample in &mut samples {
        (sample.time_s, sample.amplitude) = (f64::NAN, 100.0);
    }
    let report = test_trends(&samples, &TrendOptions::default()).unwrap();
    let verdict = |variable| report.tests.iter().find(|test| test.variable == variable).unwrap().verdict;
    assert_eq!(verdict(TrendVariable::Time), TrendVerdict::NotTested("not known of all samples"));
    assert_eq!(verdict(TrendVariable::Amplitude), TrendVerdict::NotTested("it hardly varies"));
    assert_eq!(verdict(TrendVariable::Column), TrendVerdict::Random);
    assert!(report.is_random());
    let refused = |samples: &[TrendSample], options: &TrendOptions| test_trends(samples, options).unwrap_err();
    let options = TrendOptions::default();
    assert!(matches!(refused(&samples[..10], &options), Error::TooFewResiduals { residuals: 10, .. }));
    assert!(matches!(refused(&samples, &TrendOptions { level: 0.0, ..options }), Error::OutOfDomain { .. }));
    assert!(matches!(refused(&samples, &TrendOptions { bins: 2, ..options }), Error::OutOfDomain { .. }));
    samples[3].sigma_m = 0.0;
    assert!(matches!(refused(&samples, &options), Error::OutOfDomain { name: "sigma_m", .. }));
}
