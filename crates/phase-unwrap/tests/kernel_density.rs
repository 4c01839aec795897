//! Hypotheses and the choice by kernel density on rendered scenes: shares of right counts, thin objects, confidence.

use crate::frequencies;
use crate::frequencies::{Frame, SETS, SIGMAS, Scene, modulations};
use phase_unwrap::{
    Error, KernelDensityOptions, MultiFrequencyOptions, MultiUnwrapped, MultiUnwrapper, PhaseRow, RowWindow,
    combined_interval_m, hypotheses, unwrap_multi_frequency,
};
use range_image::Raster;

fn unwrap(scene: &Scene, frame: &Frame, kernel: Option<KernelDensityOptions>) -> MultiUnwrapped {
    let options = MultiFrequencyOptions { kernel, ..MultiFrequencyOptions::default() };
    unwrap_multi_frequency(&frame.phases, &scene.modulations, Some(&frame.sigmas), None, &options).unwrap()
}

/// Share of right pixels among those that a test selects, and their number.
fn share(right: &Raster<bool>, selected: impl Fn(usize) -> bool) -> (f64, usize) {
    let chosen: Vec<bool> = (0..right.len()).filter(|&i| selected(i)).map(|i| right.as_slice()[i]).collect();
    let hits = chosen.iter().filter(|right| **right).count();
    (hits as f64 / chosen.len().max(1) as f64, chosen.len())
}

#[test]
fn furnished_rooms_are_right_at_all_levels_of_noise() {
    // What a kernel density over hypotheses reached before, for each noise at the far end; and each pixel alone.
    let kernel_bar = [0.998, 0.991, 0.978];
    let alone_bar = [0.997, 0.98, 0.90];
    for (name, hz) in SETS {
        for (level, sigma) in SIGMAS.into_iter().enumerate() {
            let scene = Scene::furnished(256, 212, hz, 1);
            let frame = scene.capture(sigma, 2);
            let alone = share(&scene.right(&unwrap(&scene, &frame, None).range), |_| true).0;
            let kernel = unwrap(&scene, &frame, Some(KernelDensityOptions::default()));
            let kernel = share(&scene.right(&kernel.range), |_| true).0;
            println!("{name} MHz, far sigma {sigma} rad: alone {alone:.4}, with neighbours {kernel:.4}");
            assert!(alone >= alone_bar[level] && kernel >= kernel_bar[level], "{name} {sigma}: {alone} {kernel}");
        }
    }
}

#[test]
fn confidence_is_calibrated() {
    let kernels = [None, Some(KernelDensityOptions::default()), Some(KernelDensityOptions { radius: 2 })];
    for (name, hz) in SETS {
        for kernel in kernels {
            let mut bins = [(0.0, 0.0, 0.0); 10];
            for (seed, sigma) in [(3, 0.3), (4, 0.6), (5, 0.6), (6, 1.0)] {
                let scene =
                    if seed % 2 == 0 { Scene::furnished(256, 212, hz, seed) } else { Scene::wired(256, 212, hz, seed) };
                let found = unwrap(&scene, &scene.capture(sigma, seed), kernel);
                for (&confidence, &right) in
                    found.confidence.as_slice().iter().zip(scene.right(&found.range).as_slice())
                {
                    let bin = &mut bins[((confidence * 10.0) as usize).min(9)];
                    *bin = (bin.0 + 1.0, bin.1 + f64::from(u8::from(right)), bin.2 + f64::from(1.0 + confidence) / 2.0);
                }
            }
            for (bin, (number, right, expected)) in bins.into_iter().enumerate() {
                println!(
                    "{name}, {kernel:?}: bin {bin}: {number} pixels, right {:.3}, stated {:.3}",
                    right / number,
                    expected / number
                );
            }
            let (number, right, _) = bins[9];
            assert!(right / number >= 0.9 && number > 0.5 * 4.0 * 256.0 * 212.0, "{name} {kernel:?} {bins:?}");
            // Stated probabilities are met: what is said to be right with 80 to 95 % is not much less often.
            for (number, right, expected) in bins.into_iter().skip(6) {
                assert!(right >= expected - 0.08 * number - 20.0, "{name} {kernel:?} {bins:?}");
            }
        }
    }
}

#[test]
fn neighbours_do_not_pull_thin_objects() {
    for (name, hz) in SETS {
        for sigma in SIGMAS {
            let scene = Scene::wired(256, 212, hz, 7);
            let frame = scene.capture(sigma, 8);
            let alone = scene.right(&unwrap(&scene, &frame, None).range);
            let kernel = scene.right(&unwrap(&scene, &frame, Some(KernelDensityOptions::default())).range);
            for thickness in 1..=3 {
                let on_wire = |i: usize| scene.wire.as_slice()[i] == thickness;
                let ((alone, number), (kernel, _)) = (share(&alone, on_wire), share(&kernel, on_wire));
                println!("{name} MHz, {sigma} rad, wire of {thickness}: alone {alone:.4}, with neighbours {kernel:.4}");
                // No worse than alone, to two deviations of the count.
                let deviation = (alone * (1.0 - alone) / number as f64).sqrt();
                assert!(number > 1000 && kernel >= alone - 2.0 * deviation, "{name} {sigma} {thickness}");
            }
        }
    }
}

#[test]
fn a_scene_of_single_pixels_loses_little() {
    for (name, hz) in SETS {
        let scene = Scene::scattered(128, 128, hz, 9);
        let frame = scene.capture(0.3, 10);
        let alone = share(&scene.right(&unwrap(&scene, &frame, None).range), |_| true).0;
        let found = unwrap(&scene, &frame, Some(KernelDensityOptions::default()));
        let right = scene.right(&found.range);
        let kernel = share(&right, |_| true).0;
        let (sure_right, sure) = share(&right, |i| found.confidence.as_slice()[i] >= 0.9);
        println!("{name}: alone {alone:.4}, with neighbours {kernel:.4}, of {sure} sure {sure_right:.4}");
        // Neighbours that agree by chance alone cost a hundredth at most.
        assert!(kernel >= alone - 0.01 && sure_right >= 0.9, "{name} {alone} {kernel} {sure_right}");
    }
}

#[test]
fn threads_buffers_and_blocks_leave_no_trace() {
    let scene = Scene::furnished(101, 37, SETS[2].1, 11);
    let frame = scene.capture(0.6, 12);
    let expected = unwrap(&scene, &frame, Some(KernelDensityOptions::default()));
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let found = pool.install(|| unwrap(&scene, &frame, Some(KernelDensityOptions::default())));
        assert_eq!(found, expected);
    }
    let mut unwrapper = MultiUnwrapper::new(&scene.modulations, MultiFrequencyOptions::default()).unwrap();
    let mut out = MultiUnwrapped::default();
    let other = Scene::furnished(64, 50, SETS[2].1, 13);
    let other_frame = other.capture(0.6, 14);
    unwrapper.unwrap_into(&other_frame.phases, None, None, &mut out).unwrap();
    unwrapper.unwrap_into(&frame.phases, Some(&frame.sigmas), None, &mut out).unwrap();
    assert_eq!(out, expected);
    // Alone, a pixel's answer does not depend on its place in the image.
    let column = |plane: &Raster<f32>| Raster::from_vec(1, plane.len(), plane.as_slice().to_vec()).unwrap();
    let upright =
        Frame { phases: frame.phases.iter().map(column).collect(), sigmas: frame.sigmas.iter().map(column).collect() };
    let (alone, line) = (unwrap(&scene, &frame, None), unwrap(&scene, &upright, None));
    assert_eq!((alone.range.as_slice(), alone.wraps[1].as_slice()), (line.range.as_slice(), line.wraps[1].as_slice()));
}

#[test]
fn rows_have_the_bits_of_the_frame() {
    let scene = Scene::furnished(53, 20, SETS[2].1, 11);
    let (frame, width, height) = (scene.capture(0.6, 12), 53, 20);
    let mask = Raster::from_fn(width, height, |col, row| (col + row) % 11 != 0);
    for kernel in [None, Some(KernelDensityOptions::default()), Some(KernelDensityOptions { radius: 2 })] {
        let options = MultiFrequencyOptions { kernel, ..MultiFrequencyOptions::default() };
        let mut unwrapper = MultiUnwrapper::new(&scene.modulations, options).unwrap();
        let expected = unwrapper.unwrap(&frame.phases, Some(&frame.sigmas), Some(&mask)).unwrap();
        let (mut window, reach) = (RowWindow::default(), unwrapper.reach());
        // From the middle of the image to its end.
        let first = 7;
        unwrapper.begin_rows(width, &mut window);
        let (mut range, mut confidence, mut wraps) = (vec![0.0; width], vec![0.0; width], vec![0; width]);
        for row in first - reach..height + reach {
            let at = row * width..(row + 1) * width;
            if row < height {
                let of_row = |plane: &Raster<f32>| plane.as_slice()[at.clone()].to_vec();
                let (phases, sigmas): (Vec<_>, Vec<_>) =
                    frame.phases.iter().zip(&frame.sigmas).map(|(phase, sigma)| (of_row(phase), of_row(sigma))).unzip();
                let (phases, sigmas): (Vec<_>, Vec<_>) =
                    (phases.iter().map(Vec::as_slice).collect(), sigmas.iter().map(Vec::as_slice).collect());
                let mask = &mask.as_slice()[at];
                let short = PhaseRow { phases: &phases, sigmas: &sigmas, mask: &mask[1..] };
                assert!(matches!(unwrapper.take_row(&short, &mut window), Err(Error::Raster(_))));
                let few = PhaseRow { phases: &phases, sigmas: &sigmas[1..], mask };
                assert!(matches!(unwrapper.take_row(&few, &mut window), Err(Error::PlaneCount { .. })));
                unwrapper.take_row(&PhaseRow { phases: &phases, sigmas: &sigmas, mask }, &mut window).unwrap();
            } else {
                unwrapper.take_empty_row(&mut window);
            }
            let Some(row) = row.checked_sub(reach).filter(|row| *row >= first) else { continue };
            let at = row * width..(row + 1) * width;
            assert!(unwrapper.choose_row(&window, &mut range[1..], &mut confidence).is_err());
            unwrapper.choose_row(&window, &mut range, &mut confidence).unwrap();
            let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&range), bits(&expected.range.as_slice()[at.clone()]), "row {row}");
            assert_eq!(bits(&confidence), bits(&expected.confidence.as_slice()[at.clone()]), "row {row}");
            for frequency in 0..frame.phases.len() {
                unwrapper.count_wraps(frequency, &range, &frame.phases[frequency].as_slice()[at.clone()], &mut wraps);
                assert_eq!(wraps, expected.wraps[frequency].as_slice()[at.clone()]);
            }
        }
    }
}

#[test]
fn hypotheses_are_listed_with_their_probabilities() {
    let modulations = modulations(SETS[1].1);
    let truth = 2.5;
    let phases: Vec<_> = modulations
        .iter()
        .map(|m| Raster::filled(20, 3, m.phase_from_range(truth).rem_euclid(std::f64::consts::TAU) as f32))
        .collect();
    let options = MultiFrequencyOptions::default();
    let found = hypotheses(&phases, &modulations, None, None, 4, &options).unwrap();
    let list: Vec<_> = found.pixel(19, 2).collect();
    assert!(list.len() == 4 && (f64::from(list[0].range_m) - truth).abs() < 1e-5 && list[0].misfit < 1e-6, "{list:?}");
    // The next counts of 100 MHz are off by one cycle of 20 MHz over both frequencies: 2 pi / 5 rad of 80 MHz at least,
    // that is 1.26 / (0.1 sqrt(1 + 0.64)) deviations, squared.
    let expected = (0.4 * std::f64::consts::PI / 0.1).powi(2) / 1.64;
    assert!((f64::from(list[1].misfit) / expected - 1.0).abs() < 1e-3, "{} {expected}", list[1].misfit);
    assert!(list.is_sorted_by(|a, b| a.misfit <= b.misfit) && list[0].probability > 0.999);
    assert_eq!(found.pixel(20, 0).count(), 0);
    for count in [0, 9] {
        let error = hypotheses(&phases, &modulations, None, None, count, &options).unwrap_err();
        assert!(matches!(error, Error::OutOfDomain { name: "count", .. }));
    }
}

#[test]
fn a_missing_highest_frequency_hands_over_to_the_next() {
    let scene = Scene::furnished(96, 40, SETS[2].1, 15);
    let mut frame = scene.capture(0.1, 16);
    // The caller's order is 80, 16, 120 MHz. One in five loses the highest, another one in five the lowest.
    let lost = |index: usize| index % 5;
    for index in 0..scene.range_m.len() {
        match lost(index) {
            0 => frame.phases[2].as_mut_slice()[index] = f32::NAN,
            1 => frame.phases[1].as_mut_slice()[index] = f32::INFINITY,
            2 => (frame.phases[0].as_mut_slice()[index], frame.phases[2].as_mut_slice()[index]) = (f32::NAN, f32::NAN),
            _ => {}
        }
    }
    let found = unwrap(&scene, &frame, Some(KernelDensityOptions::default()));
    let right = scene.right(&found.range);
    // 80 and 16 MHz repeat every 9.4 m, 120 and 80 MHz every 3.75 m: alone a guess, but neighbours know.
    // Three of the five equal hypotheses are kept; where the true one is not, nothing agrees and nothing is sure.
    let sure = |i: usize| found.confidence.as_slice()[i] >= 0.9;
    for (case, bar) in [(0, 0.95), (1, 0.3)] {
        let (all, number) = share(&right, |i| lost(i) == case);
        let (sure_right, sure) = share(&right, |i| lost(i) == case && sure(i));
        println!("lost frequency, case {case}: right {all:.3} of {number}, {sure_right:.3} of {sure} sure");
        assert!(all > bar && (sure == 0 || sure_right > 0.98), "{case}");
    }
    for index in (0..right.len()).filter(|&i| lost(i) == 2) {
        assert!(found.range.as_slice()[index].is_nan() && found.confidence.as_slice()[index] == 0.0);
        assert!(found.sigma.as_slice()[index].is_nan() && found.wraps.iter().all(|w| w.as_slice()[index] == 0));
    }
    assert!(found.unsure(0.5).as_slice()[2]);
}

#[test]
fn ends_of_the_cycle_and_of_the_span_are_in_order() {
    let modulations = modulations(SETS[0].1);
    let combined = combined_interval_m(&modulations).unwrap();
    let tau = std::f32::consts::TAU;
    let unwrap = |values: [f32; 2], options: &MultiFrequencyOptions| {
        let phases = values.map(|value| Raster::filled(1, 1, value));
        let found = unwrap_multi_frequency(&phases, &modulations, None, None, options).unwrap();
        (f64::from(found.range[(0, 0)]), found.confidence[(0, 0)], [found.wraps[0][(0, 0)], found.wraps[1][(0, 0)]])
    };
    let options = MultiFrequencyOptions::default();
    // No phase and a whole cycle are the same: range zero.
    assert_eq!(unwrap([0.0, 0.0], &options), (0.0, 1.0, [0, 0]));
    assert_eq!(unwrap([tau, tau], &options).2, [-1, -1]);
    assert!(unwrap([tau, 0.0], &options).0.abs() < 1e-5 && unwrap([0.0, tau], &options).0.abs() < 1e-5);
    // A little before a full cycle at a range of nearly zero.
    let (range, confidence, wraps) = unwrap([tau - 0.05, 0.08], &options);
    assert!((0.0..0.05).contains(&range) && confidence > 0.9 && wraps == [-1, 0], "{range} {confidence} {wraps:?}");
    // Beyond the combined interval a range comes back less that interval: no phase can tell.
    let at = |range_m: f64| {
        [0, 1].map(|f| modulations[f].phase_from_range(range_m).rem_euclid(std::f64::consts::TAU) as f32)
    };
    assert!((unwrap(at(combined + 1.5), &options).0 - 1.5).abs() < 1e-5);
    // Beyond the searched span, but inside the combined interval, nothing fits: not sure.
    let near = MultiFrequencyOptions { maximum_range_m: Some(4.0), ..options };
    let (range, confidence, _) = unwrap(at(6.1), &near);
    assert!(range < 4.0 && confidence < 0.6, "{range} {confidence}");
    // Two hypotheses that fit equally well: a guess that says so.
    let (_, confidence, _) = unwrap([tau / 6.0, 0.0], &options);
    assert!(confidence < 1e-3, "{confidence}");
}

#[test]
fn all_masked_or_all_missing_gives_no_answer_and_no_error() {
    let modulations = modulations(SETS[0].1);
    let missing = [0, 1].map(|_| Raster::filled(5, 1, f32::NAN));
    let present = [0, 1].map(|_| Raster::filled(5, 1, 1.0_f32));
    let nothing = Raster::filled(5, 1, false);
    let options = MultiFrequencyOptions::default();
    for (phases, mask) in [(&missing, None), (&present, Some(&nothing))] {
        let found = unwrap_multi_frequency(phases, &modulations, None, mask, &options).unwrap();
        assert!(found.range.as_slice().iter().chain(found.sigma.as_slice()).all(|value| value.is_nan()));
        assert!(found.confidence.as_slice().iter().all(|&confidence| confidence == 0.0));
        assert!(found.unsure(0.0).as_slice().iter().all(|&unsure| unsure));
    }
}

#[test]
fn bad_options_get_a_typed_answer() {
    let modulations = modulations(SETS[0].1);
    let with = |kernel: KernelDensityOptions| {
        let options = MultiFrequencyOptions { kernel: Some(kernel), ..MultiFrequencyOptions::default() };
        MultiUnwrapper::new(&modulations, options).unwrap_err()
    };
    for radius in [0, 4] {
        assert!(matches!(with(KernelDensityOptions { radius }), Error::OutOfDomain { name: "radius", .. }));
    }
    let nine: Vec<f64> = (0..9).map(|n| 10e6 + 1e6 * f64::from(n)).collect();
    let error = MultiUnwrapper::new(&frequencies::modulations(&nine), MultiFrequencyOptions::default()).unwrap_err();
    assert_eq!(error, Error::TooManyFrequencies { found: 9, limit: 8 });
}

#[test]
fn any_ratio_and_any_number_of_frequencies_works() {
    // Ratios that are no fractions, within a span that they can tell apart; four frequencies, and five.
    let sets: [(&[f64], f64); 4] = [
        (&[75.31e6, 58.07e6], 8.0),
        (&[100e6, 61.803_398e6, 23.1e6], 12.0),
        (&[20e6, 50e6, 80e6, 100e6], 14.0),
        (&[100e6, 90e6, 70e6, 50e6, 20e6], 14.0),
    ];
    for (hz, maximum_range_m) in sets {
        let modulations = modulations(hz);
        let truth =
            Raster::from_fn(40, 30, |col, row| maximum_range_m * (0.05 + 0.02 * (col / 4) as f64 + 0.023 * row as f64));
        let phases: Vec<_> = modulations
            .iter()
            .map(|m| {
                truth.map(|&r| {
                    (m.phase_from_range(r).rem_euclid(std::f64::consts::TAU) as f32).min(std::f32::consts::TAU)
                })
            })
            .collect();
        let options = MultiFrequencyOptions { maximum_range_m: Some(maximum_range_m), ..Default::default() };
        let found = unwrap_multi_frequency(&phases, &modulations, None, None, &options).unwrap();
        for (index, (&range, &truth)) in found.range.as_slice().iter().zip(truth.as_slice()).enumerate() {
            // Phases are rounded to 2e-7 rad, ranges to 1e-6 m.
            assert!((f64::from(range) - truth).abs() < 2e-5, "{hz:?}: {range} {truth}");
            for (wraps, modulation) in found.wraps.iter().zip(&modulations) {
                let expected = (truth / modulation.ambiguity_interval_m()).floor() as i32;
                assert_eq!(wraps.as_slice()[index], expected, "{hz:?} {truth}");
            }
        }
    }
}
