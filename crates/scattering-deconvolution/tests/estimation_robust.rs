//! What captures of the real world bring: shadows, dim parts, saturation, gaps; captures of two planes; wrong input.
#![cfg(feature = "estimate")]

use crate::captures::{Object, Scene, estimate, round};
use range_image::{ComplexFrame, Flags, RangeFrame, Raster};
use scattering_deconvolution::{
    Ambiguity, Capture, Error, EstimationOptions, ForegroundCapture, Nuisance, Psf, PsfEstimate, TermCount,
    TwoPlaneCapture, Verdict, estimate_psf, object_mask, true_phases,
};

const OBJECT: Object = Object { columns: [0, 18], rows: [26, 48], range_m: 0.8, amplitude: 2000.0 };
const SECOND: Object = Object { columns: [40, 55], rows: [8, 24], range_m: 0.7, amplitude: 2200.0 };

fn psf() -> Psf {
    round(&[(0.05, 10.0)])
}

/// Parameters are right within four standard deviations and a share of their value.
fn assert_close(found: &PsfEstimate, truth: &[f64], share: f64) {
    assert_eq!(found.verdict, Verdict::Determined, "{found:#?}");
    assert_eq!(found.parameters.len(), truth.len(), "{found:#?}");
    for (parameter, truth) in found.parameters.iter().zip(truth) {
        let bound = 4.0 * parameter.sigma + share * truth;
        assert!((parameter.value - truth).abs() < bound, "{parameter:?} for {truth}: {found:#?}");
    }
}

/// An object with a dark part (7 % of its brightness) and a shadow on the wall to its right, half of it a penumbra.
fn with_shadow(scene: &Scene, object: &Object, psf: &Psf, seed: u64) -> (ComplexFrame, ComplexFrame) {
    let light = |col: usize, row: usize| {
        let (amplitude, range) = scene.light(Some(object), col, row);
        let in_rows = (object.rows[0]..object.rows[1]).contains(&row);
        let in_columns = (object.columns[0]..object.columns[1]).contains(&col);
        let beside = col.wrapping_sub(object.columns[1]);
        match (in_rows, in_columns, beside) {
            (true, true, _) if row + 8 > object.rows[1] => (0.07 * amplitude, range),
            (true, false, 0..5) => (0.05 * amplitude, range),
            (true, false, 5..8) => (0.75 * amplitude, range),
            _ => (amplitude, range),
        }
    };
    (scene.frame_with(light, psf, 2 * seed), scene.frame(None, psf, 2 * seed + 1))
}

#[test]
fn shadows_and_dark_parts_do_not_pass_for_scatter() {
    let scene = Scene::small();
    for psf in [psf(), round(&[])] {
        let pairs: Vec<_> =
            [OBJECT, SECOND].iter().zip(0..).map(|(object, seed)| with_shadow(&scene, object, &psf, seed)).collect();
        let found = estimate(&pairs, &EstimationOptions::default());
        if psf.is_empty() {
            assert_eq!(found.verdict, Verdict::NothingToCorrect, "{found:#?}");
        } else {
            // Half-shadowed blocks that are not conspicuous may take some of the weight.
            assert_close(&found, &[0.05, 10.0], 0.02);
            assert!(found.outlier_share > 0.001 && found.outlier_share < 0.2, "{found:#?}");
        }
    }
}

#[test]
fn the_mask_covers_object_and_rim() {
    let scene = Scene::small();
    let (with, without) = scene.pair(&OBJECT, &psf(), 4);
    let mask = object_mask(&with, &without, &EstimationOptions::default()).unwrap();
    for row in 0..48 {
        for col in 0..64 {
            let inside = col < 18 && row >= 26;
            let far = col > 18 + 5 || row < 26 - 5;
            assert!(!inside || mask[(col, row)], "{col} {row}");
            assert!(!far || !mask[(col, row)], "{col} {row}");
        }
    }
}

#[test]
fn a_given_mask_is_used() {
    let scene = Scene::small();
    let (with, without) = scene.pair(&OBJECT, &psf(), 4);
    let object = Raster::from_fn(64, 48, |col, row| col < 18 && row >= 26);
    let capture = ForegroundCapture { with_object: &with, without_object: &without, object: Some(&object) };
    let found = estimate_psf(&[capture], &EstimationOptions::default()).unwrap();
    assert_close(&found, &[0.05, 10.0], 0.002);
    assert_eq!(found.captures[0].source_pixels, 21 * 25);
    let everything = Raster::filled(64, 48, true);
    let capture = ForegroundCapture { object: Some(&everything), ..capture };
    let found = estimate_psf(&[capture], &EstimationOptions::default()).unwrap();
    assert!(matches!(found.verdict, Verdict::Undetermined { what: Ambiguity::NoBackground, .. }));
    let nothing = Raster::filled(64, 48, false);
    let capture = ForegroundCapture { object: Some(&nothing), ..capture };
    let found = estimate_psf(&[capture], &EstimationOptions::default()).unwrap();
    assert!(matches!(found.verdict, Verdict::Undetermined { what: Ambiguity::NoObjectLight, .. }));
}

#[test]
fn gaps_are_left_out_and_filled() {
    let scene = Scene::small();
    let (mut with, without) = scene.pair(&OBJECT, &psf(), 4);
    for pixel in (0..64 * 48).step_by(37) {
        with.channels[0].real.as_mut_slice()[pixel] = f32::NAN;
    }
    with.flags.as_mut_slice()[5] = Flags::SATURATED;
    with.channels[0].real.as_mut_slice()[5] = 1e9;
    let found = estimate(&[(with, without)], &EstimationOptions::default());
    // A 37th of the object's pixels are filled from neighbours that differ by a fifth.
    assert_close(&found, &[0.05, 10.0], 0.01);
}

#[test]
fn unknown_light_is_said() {
    let scene = Scene::small();
    let (mut with, without) = scene.pair(&OBJECT, &psf(), 4);
    for row in 30..40 {
        (0..10).for_each(|col| with.flags.as_mut_slice()[row * 64 + col] = Flags::SATURATED);
    }
    let found = estimate(&[(with, without)], &EstimationOptions::default());
    assert!(matches!(found.verdict, Verdict::Undetermined { what: Ambiguity::ObjectLightLost, .. }), "{found:#?}");
    assert_eq!(found.captures[0].unused, Some(Ambiguity::ObjectLightLost));
    assert!(found.psf.is_none() && found.parameters.is_empty());
}

#[test]
fn unknown_sigma_is_taken_from_the_image() {
    let scene = Scene { noise: 0.5, ..Scene::small() };
    let (mut with, without) = scene.pair(&OBJECT, &psf(), 4);
    with.channels[0].sigma.as_mut_slice().fill(f32::NAN);
    let found = estimate(&[(with, without)], &EstimationOptions::default());
    assert_close(&found, &[0.05, 10.0], 0.002);
    // Noise is that of the wall, where it is nearly the same everywhere.
    assert!((found.sigma0 - 1.0).abs() < 0.1, "{}", found.sigma0);
}

#[test]
fn frequencies_are_taken_together() {
    let scene = Scene::small();
    let second = Scene { frequency_hz: 31e6, ..scene };
    let (mut with, mut without) = scene.pair(&OBJECT, &psf(), 4);
    let (other_with, other_without) = second.pair(&OBJECT, &psf(), 5);
    let single = estimate(&[(with.clone(), without.clone())], &EstimationOptions::default());
    with.channels.extend(other_with.channels);
    without.channels.extend(other_without.channels);
    let found = estimate(&[(with, without)], &EstimationOptions::default());
    assert_close(&found, &[0.05, 10.0], 0.002);
    assert_eq!(
        found.captures.iter().map(|report| (report.capture, report.channel)).collect::<Vec<_>>(),
        [(0, 0), (0, 1)]
    );
    // Twice the observations: sigma falls by the root of two.
    let ratio = single.parameters[0].sigma / found.parameters[0].sigma;
    assert!((ratio - 2.0_f64.sqrt()).abs() < 0.1, "{ratio}");
}

/// A near board on the left and a wall whose true range is known outside of the rim.
fn two_planes(scene: &Scene, psf: &Psf, seed: u64) -> (ComplexFrame, Vec<Raster<f32>>) {
    let observed = scene.frame(Some(&OBJECT), psf, seed);
    let [width, height] = scene.size;
    let range = Raster::from_fn(width, height, |col, row| {
        let near = col < 18 + 3 && row >= 26 - 3;
        if near { f32::NAN } else { scene.light(None, col, row).1 as f32 }
    });
    let plane = range.map(|_| f32::NAN);
    let truth = RangeFrame { sigma: plane.clone(), amplitude: plane, flags: observed.flags.clone(), range };
    let phases = true_phases(&observed, &truth).unwrap();
    (observed, phases)
}

#[test]
fn two_planes_tell_the_same() {
    let scene = Scene { noise: 0.3, ..Scene::small() };
    let (observed, phases) = two_planes(&scene, &psf(), 9);
    let capture = TwoPlaneCapture { observed: &observed, true_phase: &phases };
    for nuisances in [vec![], vec![Nuisance::Drift]] {
        let options = EstimationOptions { nuisances, ..EstimationOptions::default() };
        let found = estimate_psf(&[capture], &options).unwrap();
        assert_close(&found, &[0.05, 10.0], 0.002);
    }
    // Together with a pair, both are better known.
    let pair = scene.pair(&SECOND, &psf(), 3);
    let both: [Capture<'_>; 2] = [capture.into(), (&pair.0, &pair.1).into()];
    let found = estimate_psf(&both, &EstimationOptions::default()).unwrap();
    assert_close(&found, &[0.05, 10.0], 0.002);
    assert!(found.captures.iter().all(|report| report.rms_held_out.is_some()));
    let clean = two_planes(&scene, &round(&[]), 9);
    let capture = TwoPlaneCapture { observed: &clean.0, true_phase: &clean.1 };
    let found = estimate_psf(&[capture], &EstimationOptions::default()).unwrap();
    assert!(found.parameters.is_empty(), "{found:#?}");
}

#[test]
fn captures_that_do_not_belong_together_are_refused() {
    let options = EstimationOptions::default();
    let none: [(&ComplexFrame, &ComplexFrame); 0] = [];
    assert!(matches!(estimate_psf(&none, &options), Err(Error::Capture { .. })));
    let scene = Scene::small();
    let (with, without) = scene.pair(&OBJECT, &psf(), 4);
    let other = Scene { size: [48, 64], ..scene }.pair(&OBJECT, &psf(), 4);
    assert!(matches!(estimate_psf(&[(&with, &other.1)], &options), Err(Error::Frame(_))));
    assert!(matches!(estimate_psf(&[(&with, &without), (&other.0, &other.1)], &options), Err(Error::Capture { .. })));
    let faster = Scene { frequency_hz: 30e6, ..scene }.frame(None, &psf(), 1);
    assert!(matches!(estimate_psf(&[(&with, &faster)], &options), Err(Error::Capture { .. })));
    let empty = ComplexFrame::empty();
    assert!(matches!(estimate_psf(&[(&empty, &empty)], &options), Err(Error::Capture { .. })));
    assert!(matches!(object_mask(&with, &other.1, &options), Err(Error::Frame(_))));
    let capture = TwoPlaneCapture { observed: &with, true_phase: &[] };
    assert!(matches!(estimate_psf(&[capture], &options), Err(Error::Capture { .. })));
}

#[test]
fn options_without_meaning_are_refused() {
    let scene = Scene::small();
    let (with, without) = scene.pair(&OBJECT, &psf(), 4);
    let good = EstimationOptions::default();
    for bad in [
        EstimationOptions { terms: TermCount::AtMost(0), ..good.clone() },
        EstimationOptions { terms: TermCount::Exactly(9), ..good.clone() },
        EstimationOptions { block_px: Some(0), ..good.clone() },
        EstimationOptions { object_share: 1.0, ..good.clone() },
        EstimationOptions { huber_limit: Some(f64::NAN), ..good.clone() },
        EstimationOptions { significance: -1.0, ..good.clone() },
        EstimationOptions { relevant_weight: 0.0, ..good.clone() },
    ] {
        assert!(matches!(estimate_psf(&[(&with, &without)], &bad), Err(Error::OutOfDomain { .. })), "{bad:?}");
    }
    // Any size of block and rim is an answer of some kind.
    for (block_px, rim_px) in [(Some(usize::MAX), 0), (Some(64), 3), (Some(1), usize::MAX), (Some(7), 0)] {
        let options = EstimationOptions { block_px, rim_px, ..good.clone() };
        estimate_psf(&[(&with, &without)], &options).unwrap();
    }
}

#[test]
fn small_and_senseless_images_have_an_answer() {
    for size in [[1, 1], [1, 40], [40, 1], [3, 2], [12, 9]] {
        let scene = Scene { size, ..Scene::small() };
        let object = Object { columns: [0, size[0].div_ceil(3)], rows: [0, size[1].div_ceil(2)], ..OBJECT };
        let (with, without) = scene.pair(&object, &round(&[]), 4);
        let found = estimate(&[(with.clone(), without.clone())], &EstimationOptions::default());
        assert!(matches!(found.verdict, Verdict::Undetermined { .. }), "{size:?}: {found:#?}");
        for value in [f32::NAN, f32::INFINITY, 0.0, f32::MAX] {
            let mut bad = with.clone();
            bad.channels[0].real.as_mut_slice().fill(value);
            let found = estimate(&[(bad, without.clone())], &EstimationOptions::default());
            assert!(matches!(found.verdict, Verdict::Undetermined { .. }), "{size:?} {value}: {found:#?}");
        }
    }
}
