//! Units by distance, noise and ambiguity interval.

use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use range_image::Raster;
use stored_values::{UnitWitness, judge_unit};

const UNITS_M: [f64; 4] = [1.0, 1e-2, 1e-3, 1e-4];

#[test]
fn a_room_in_millimetres_is_none_in_metres() {
    let room = UnitWitness { median: 2400.0, highest: 6000.0, noise: Some(5.0) };
    let judged = judge_unit(&room, None, &UNITS_M);
    assert!(judged[0] < 1e-6 && judged[3] > 1e-4 && judged[2] > 0.95, "{judged:?}");
    assert!((judged.iter().sum::<f64>() - 1.0).abs() < 1e-12);
}

#[test]
fn between_two_units_nothing_is_told() {
    let near = UnitWitness { median: 6000.0, highest: 9000.0, noise: Some(10.0) };
    let [open, bounded] = [None, Some(5.0)].map(|interval| judge_unit(&near, interval, &UNITS_M));
    assert!(open.iter().all(|one| *one < 0.99), "{open:?}");
    // All values within the interval of 5 m as tenths, all beyond it as millimetres.
    assert!(bounded[3] > open[3]);
}

#[test]
fn no_values_have_no_unit() {
    for median in [f64::NAN, 0.0, -1.0, f64::INFINITY] {
        let judged = judge_unit(&UnitWitness { median, ..UnitWitness::default() }, None, &UNITS_M);
        assert!(judged.iter().all(|one| one.is_nan() || *one < 0.99), "{median}: {judged:?}");
    }
    for value in [f32::NAN, 0.0, -1.0] {
        assert_eq!(UnitWitness::of(&Raster::filled(20, 20, value)), None);
    }
}

#[test]
fn a_frame_is_its_own_witness() {
    let mut random = Pcg64::seed_from_u64(1);
    let frame = Raster::from_fn(100, 80, |col, _| {
        let noise: f32 = StandardNormal.sample(&mut random);
        2000.0 + 3.0 * col as f32 + 6.0 * noise
    });
    let witness = UnitWitness::of(&frame).unwrap();
    assert!((witness.median - 2148.0).abs() < 5.0, "{witness:?}");
    assert!((5.5..6.5).contains(&witness.noise.unwrap()), "{witness:?}");
    assert_eq!(UnitWitness::of(&Raster::filled(20, 20, 5.0)).unwrap().noise, None);
    // Whole numbers that were ranges for a while, as depths of files are, differ by roundings of single precision only.
    let stretch = |col: usize| 1.0 + 1e-3 * col as f32;
    let whole = Raster::from_fn(100, 80, |col, row| {
        let millimetre = (1500.0 + 0.2 * col as f32 + 0.1 * row as f32).round();
        let depth = (millimetre * 0.001 * stretch(col)) / stretch(col);
        (f64::from(depth) / 0.001) as f32
    });
    assert!(whole.as_slice().iter().any(|value| value.fract() != 0.0));
    assert_eq!(UnitWitness::of(&whole).unwrap().noise, None);
}
