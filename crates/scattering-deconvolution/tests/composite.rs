//! Point spread functions that change over the field, and ghosts.

use std::f64::consts::TAU;

use crate::common::{channel, frame, modulation, range_errors, scene};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use range_image::Modulation;
use scattering_deconvolution::{
    CompositePsf, Error, FieldPolynomial, FieldTerm, GaussianTerm, Ghost, GhostDelay, GhostPlace, GridSpacing, Psf,
    Refinement, RestorationOptions, Restorer, Scatterer, restore,
};

fn gaussian(weight: f64, across: f64, down: f64) -> GaussianTerm {
    GaussianTerm { weight, sigma_px: [across, down] }
}

fn polynomial(constant: f64, linear: [f64; 2], quadratic: [f64; 3]) -> FieldPolynomial {
    FieldPolynomial { constant, linear, quadratic }
}

fn ghost(weight: f64, place: GhostPlace, sigma: f64, delay: GhostDelay) -> Ghost {
    Ghost { weight, place, sigma_px: [sigma, sigma], delay }
}

/// All kinds of light at once, `weight` in all, for images of about `size`; no Gaussian narrower than `width`.
fn all_kinds(weight: f64, size: [usize; 2], width: f64) -> CompositePsf {
    let [columns, rows] = size.map(|count| count as f64);
    let share = weight / 6.0;
    CompositePsf {
        stationary: vec![gaussian(2.0 * share, 2.0 * width, 1.5 * width)],
        field_terms: vec![
            FieldTerm {
                gaussian: gaussian(share, width, 2.0 * width),
                received: polynomial(0.5, [0.4, 0.0], [0.3, -0.2, 0.1]),
                sent: polynomial(1.0, [-0.3, 0.5], [0.0; 3]),
            },
            FieldTerm { sent: polynomial(0.2, [0.0; 2], [1.0, 0.0, 1.0]), ..field_term(share, 3.0 * width) },
        ],
        ghosts: vec![
            ghost(share, GhostPlace::Mirrored([0.52 * columns, 0.45 * rows]), width, GhostDelay::Phase(0.8)),
            ghost(share, GhostPlace::Shifted([-0.21 * columns, 0.13 * rows]), 1.3 * width, GhostDelay::Phase(-2.0)),
        ],
    }
}

fn field_term(weight: f64, sigma: f64) -> FieldTerm {
    FieldTerm {
        gaussian: gaussian(weight, sigma, sigma),
        received: FieldPolynomial::default(),
        sent: FieldPolynomial::default(),
    }
}

/// What pixels `p` of a line get of a Gaussian about `centre(q)`, `p + q count`; far out it has ended.
fn along(count: usize, sigma: f64, centre: impl Fn(f64) -> f64) -> Vec<f64> {
    let profile = |p: f64, centre: f64| {
        let value = |at: f64| (-0.5 * ((at - centre) / sigma).powi(2)).exp();
        let sum: f64 = (-200..=200).map(|i| value(centre.round() + f64::from(i))).sum();
        if (p - centre).abs() <= (4.0 * sigma).ceil() { value(p) / sum } else { 0.0 }
    };
    (0..count * count).map(|i| profile((i % count) as f64, centre((i / count) as f64))).collect()
}

/// `z + psf * z` pixel by pixel, as the types define it.
fn scattered_directly(psf: &CompositePsf, size: [usize; 2], re: &[f32], im: &[f32]) -> Vec<[f64; 2]> {
    let [columns, rows] = size;
    let normalised = |pixel: usize| {
        let [col, row] = [(pixel % columns) as f64, (pixel / columns) as f64];
        [(2.0 * col + 1.0) / columns as f64 - 1.0, 1.0 - (2.0 * row + 1.0) / rows as f64]
    };
    let mut out: Vec<[f64; 2]> = re.iter().zip(im).map(|(re, im)| [f64::from(*re), f64::from(*im)]).collect();
    let mut add = |sigma: [f64; 2],
                   across: &dyn Fn(f64) -> f64,
                   down: &dyn Fn(f64) -> f64,
                   factor: &dyn Fn(usize, usize) -> [f64; 2]| {
        let (across, down) = (along(columns, sigma[0], across), along(rows, sigma[1], down));
        for (p, sum) in out.iter_mut().enumerate() {
            for q in 0..columns * rows {
                let light = across[p % columns + q % columns * columns] * down[p / columns + q / columns * rows];
                let [c, d] = factor(p, q).map(|factor| factor * light);
                let (a, b) = (f64::from(re[q]), f64::from(im[q]));
                sum[0] += c * a - d * b;
                sum[1] += c * b + d * a;
            }
        }
    };
    for term in &psf.stationary {
        add(term.sigma_px, &|q| q, &|q| q, &|_, _| [term.weight, 0.0]);
    }
    for term in &psf.field_terms {
        let share = |p, q| term.gaussian.weight * term.received.value(normalised(p)) * term.sent.value(normalised(q));
        add(term.gaussian.sigma_px, &|q| q, &|q| q, &|p, q| [share(p, q), 0.0]);
    }
    for ghost in &psf.ghosts {
        let phase = ghost.delay.phase(None).unwrap();
        let factor = |_, _| [ghost.weight * phase.cos(), ghost.weight * phase.sin()];
        match ghost.place {
            GhostPlace::Shifted([dc, dr]) => add(ghost.sigma_px, &|q| q + dc, &|q| q + dr, &factor),
            GhostPlace::Mirrored([x, y]) => add(ghost.sigma_px, &|q| 2.0 * x - q, &|q| 2.0 * y - q, &factor),
        }
    }
    out
}

fn plane(pixels: usize, seed: usize) -> Vec<f32> {
    (0..pixels).map(|i| ((i * 7919 + seed * 104_729) % 1009) as f32 - 300.0).collect()
}

#[test]
fn light_scatters_as_defined() {
    for size in [[1, 1], [1, 19], [23, 1], [29, 22]] {
        for width in [0.7, 2.0, 9.0] {
            let psf = all_kinds(0.3, size, width);
            let pixels = size[0] * size[1];
            let (mut re, mut im) = (plane(pixels, 1), plane(pixels, 2));
            let expected = scattered_directly(&psf, size, &re, &im);
            Scatterer::new(&Psf::Composite(psf), size[0], size[1]).unwrap().apply(&mut re, &mut im).unwrap();
            for (pixel, (found, expected)) in re.iter().zip(&im).zip(&expected).enumerate() {
                let difference = (f64::from(*found.0) - expected[0]).hypot(f64::from(*found.1) - expected[1]);
                // Values of 700 in single precision, several convolutions.
                assert!(difference < 2e-3, "{size:?}, width {width}, pixel {pixel}: {difference}");
            }
        }
    }
}

/// Mean range error before and after.
fn run(psf: &Psf, size: [usize; 2], options: &RestorationOptions) -> (f64, f64, String) {
    let (range, amplitude) = scene(size[0], size[1]);
    let mut frame = frame(&range, &amplitude);
    let part = &mut frame.channels[0];
    let seen = psf.at_modulation(&part.modulation);
    let mut scatterer = Scatterer::new(&seen, size[0], size[1]).unwrap();
    scatterer.apply(part.real.as_mut_slice(), part.imaginary.as_mut_slice()).unwrap();
    let (_, before) = range_errors(&frame.channels[0], &range);
    let summary = restore(&mut frame, psf, options).unwrap()[0];
    let (largest, after) = range_errors(&frame.channels[0], &range);
    (before, after, format!("{size:?}: {before} m before, {after} m after, largest {largest} m, {summary:?}"))
}

fn every_pixel() -> RestorationOptions {
    RestorationOptions { grid_spacing: GridSpacing::EveryPixel, ..RestorationOptions::default() }
}

#[test]
fn the_range_error_goes_away_where_the_field_matters() {
    for weight in [0.01, 0.06, 0.15] {
        for width in [3.0, 14.0] {
            let psf = Psf::Composite(all_kinds(weight, [176, 144], width));
            let (before, after, text) = run(&psf, [176, 144], &every_pixel());
            // 1e-5 of the brightest light is 3e-4 of the wall's.
            assert!(before > 0.002 && after < 0.003 * before, "{text}");
            // Factors over the field at the nodes instead of at the pixels.
            let (_, after, text) = run(&psf, [176, 144], &RestorationOptions::default());
            assert!(after < 0.02 * before, "{text}");
        }
    }
}

#[test]
fn a_wide_grid_serves_a_large_image() {
    let psf = Psf::Composite(all_kinds(0.06, [640, 480], 14.0));
    let (before, after, text) = run(&psf, [640, 480], &RestorationOptions::default());
    assert!(text.contains("grid_spacing: [8, 8]"), "{text}");
    assert!(after < 0.01 * before, "{text}");
}

#[test]
fn a_composite_of_gaussians_is_the_sum_of_gaussians() {
    let terms = vec![gaussian(0.03, 12.0, 9.0), gaussian(0.05, 30.0, 30.0)];
    let composite = Psf::Composite(CompositePsf { stationary: terms.clone(), ..CompositePsf::default() });
    let (range, amplitude) = scene(90, 70);
    let mut first = frame(&range, &amplitude);
    first.channels[0].sigma.as_mut_slice().fill(2.0);
    let mut second = first.clone();
    let options = RestorationOptions { regularisation: 1e-3, ..RestorationOptions::default() };
    for options in [options, RestorationOptions::default()] {
        restore(&mut first, &composite, &options).unwrap();
        restore(&mut second, &Psf::Gaussians(terms.clone()), &options).unwrap();
        assert!(first == second);
    }
    assert_eq!(composite.sample([50, 50]).unwrap(), Psf::Gaussians(terms).sample([50, 50]).unwrap());
}

#[test]
fn an_extra_path_is_a_phase_at_each_frequency() {
    let extra_path_m = 0.09;
    let place = GhostPlace::Mirrored([40.0, 30.0]);
    let late = CompositePsf {
        ghosts: vec![ghost(0.05, place, 6.0, GhostDelay::ExtraPath(extra_path_m))],
        ..CompositePsf::default()
    };
    let psf = Psf::Composite(late.clone());
    assert!(psf.depends_on_modulation());
    let frequencies = [20e6, 60e6].map(|frequency| Modulation::new(frequency).unwrap());
    for modulation in frequencies {
        let Psf::Composite(fixed) = psf.at_modulation(&modulation) else { panic!() };
        let phase = fixed.ghosts[0].delay.phase(None).unwrap();
        let expected = TAU * modulation.frequency_hz() * extra_path_m / range_image::SPEED_OF_LIGHT;
        assert!((phase - expected).abs() < 1e-12);
    }
    // A frame of both frequencies, each with its phase.
    let (range, amplitude) = scene(80, 60);
    let mut seen = frame(&range, &amplitude);
    let mut second = seen.channels[0].clone();
    second.modulation = frequencies[1];
    seen.channels.push(second);
    let truth = seen.clone();
    for part in &mut seen.channels {
        let psf = psf.at_modulation(&part.modulation);
        let mut scatterer = Scatterer::new(&psf, 80, 60).unwrap();
        scatterer.apply(part.real.as_mut_slice(), part.imaginary.as_mut_slice()).unwrap();
    }
    restore(&mut seen, &psf, &every_pixel()).unwrap();
    for (found, truth) in seen.channels.iter().zip(&truth.channels) {
        for (a, b) in found.real.as_slice().iter().zip(truth.real.as_slice()) {
            // 1e-5 of the brightest light, 2600.
            assert!((a - b).abs() < 0.03, "{a} {b}");
        }
    }
    let unknown = |error: Error| matches!(error, Error::ModulationNeeded { .. });
    assert!(unknown(Scatterer::new(&psf, 80, 60).map(|_| ()).unwrap_err()));
    let mut restorer = Restorer::new(&psf, 80, 60, &RestorationOptions::default()).unwrap();
    let (mut re, mut im) = (plane(4800, 1), plane(4800, 2));
    assert!(unknown(restorer.restore_planes(&mut re, &mut im).unwrap_err()));
    assert_eq!(re, plane(4800, 1));
    assert!(!psf.without_phases().depends_on_modulation());
}

#[test]
fn what_is_wrong_is_named() {
    let good = all_kinds(0.1, [32, 24], 2.0);
    assert!(Psf::Composite(good.clone()).validate().is_ok());
    let named = |change: &dyn Fn(&mut CompositePsf)| {
        let mut psf = good.clone();
        change(&mut psf);
        match Restorer::new(&Psf::Composite(psf), 32, 24, &RestorationOptions::default()).map(|_| ()).unwrap_err() {
            Error::OutOfDomain { name, .. } => name,
            other => panic!("{other}"),
        }
    };
    assert_eq!(named(&|psf| psf.stationary[0].weight = -1.0), "weight");
    assert_eq!(named(&|psf| psf.field_terms[0].gaussian.sigma_px[1] = 0.0), "sigma_px");
    assert_eq!(named(&|psf| psf.field_terms[0].sent.linear = [0.9, 0.2]), "sent");
    assert_eq!(named(&|psf| psf.field_terms[1].received.constant = f64::NAN), "received");
    assert_eq!(named(&|psf| psf.field_terms[1].received.quadratic = [-1.5, 0.0, 0.0]), "received");
    assert_eq!(named(&|psf| psf.ghosts[0].weight = f64::INFINITY), "weight");
    assert_eq!(named(&|psf| psf.ghosts[0].place = GhostPlace::Mirrored([f64::NAN, 0.0])), "place");
    assert_eq!(named(&|psf| psf.ghosts[0].delay = GhostDelay::ExtraPath(-0.1)), "ExtraPath");
    assert_eq!(named(&|psf| psf.ghosts[1].delay = GhostDelay::Phase(f64::INFINITY)), "Phase");
    let options = RestorationOptions { regularisation: 0.1, ..RestorationOptions::default() };
    let error = Restorer::new(&Psf::Composite(good.clone()), 32, 24, &options).map(|_| ()).unwrap_err();
    assert!(matches!(error, Error::NotStationary { .. }), "{error}");
    let options = RestorationOptions { refinement: Refinement::FilterOnly, ..RestorationOptions::default() };
    let error = Restorer::new(&Psf::Composite(good.clone()), 32, 24, &options).map(|_| ()).unwrap_err();
    assert!(matches!(error, Error::NotStationary { .. }), "{error}");
    assert!(matches!(Psf::Composite(good).sample([3, 3]), Err(Error::NotStationary { .. })));
}

#[test]
fn scattering_that_outgrows_the_light_is_refused_or_undone() {
    let (mut re, mut im) = (plane(600, 1), plane(600, 2));
    let psf = Psf::Composite(CompositePsf { field_terms: vec![field_term(3.0, 5.0)], ..CompositePsf::default() });
    Scatterer::new(&psf, 30, 20).unwrap().apply(&mut re, &mut im).unwrap();
    let seen = re.clone();
    let mut restorer = Restorer::new(&psf, 30, 20, &every_pixel()).unwrap();
    match restorer.restore_planes(&mut re, &mut im) {
        Err(Error::NotConverged { .. }) => assert_eq!(re, seen),
        Err(other) => panic!("{other}"),
        // Three times the light, amplified at no frequency: 700 times the tolerance.
        Ok(_) => assert!(re.iter().zip(&plane(600, 1)).all(|(a, b)| (a - b).abs() < 0.05)),
    }
}

#[cfg(feature = "serde")]
#[test]
fn ghosts_and_fields_survive_a_file() {
    let psf = Psf::Composite(all_kinds(0.1, [32, 24], 2.0));
    let text = ron::to_string(&psf).unwrap();
    assert_eq!(ron::from_str::<Psf>(&text).unwrap(), psf);
    let short =
        "Composite((ghosts: [(weight: 0.01, place: Mirrored((88, 72)), sigma_px: (4, 4), delay: ExtraPath(0.05))]))";
    let Psf::Composite(read) = ron::from_str::<Psf>(short).unwrap() else { panic!() };
    assert!(read.stationary.is_empty() && read.ghosts[0].delay == GhostDelay::ExtraPath(0.05));
    let old = "Gaussians([(weight: 0.06, sigma_px: (12, 9))])";
    assert_eq!(ron::from_str::<Psf>(old).unwrap(), Psf::Gaussians(vec![gaussian(0.06, 12.0, 9.0)]));
}

#[test]
fn the_same_bits_come_from_any_number_of_threads() {
    let (range, amplitude) = scene(200, 150);
    let psf = Psf::Composite(all_kinds(0.1, [200, 150], 4.0));
    let run = |threads: usize, options: &RestorationOptions| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut frame = frame(&range, &amplitude);
            frame.channels[0].sigma.as_mut_slice().copy_from_slice(amplitude.as_slice());
            restore(&mut frame, &psf, options).unwrap();
            frame
        })
    };
    for options in [RestorationOptions::default(), every_pixel()] {
        assert!(run(1, &options) == run(4, &options));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::with_cases(16) })]

    #[test]
    fn scattering_and_restoring_cancel(
        width in 1_usize..50, height in 1_usize..50, weight in 0.0..0.25_f64, sigma in 0.3..20.0_f64
    ) {
        let psf = Psf::Composite(all_kinds(weight, [width, height], sigma));
        let (mut re, mut im) = (plane(width * height, 1), plane(width * height, 2));
        Scatterer::new(&psf, width, height).unwrap().apply(&mut re, &mut im).unwrap();
        let mut image = channel(width, height, re, im, 1.0);
        image.modulation = modulation();
        Restorer::new(&psf, width, height, &every_pixel()).unwrap().restore(&mut image).unwrap();
        for (found, truth) in image.real.as_slice().iter().zip(&plane(width * height, 1)) {
            // 1e-5 of some 700, over what a contraction of a third leaves, and roundings of single precision.
            prop_assert!((found - truth).abs() < 0.03, "{found} for {truth}");
        }
    }
}
