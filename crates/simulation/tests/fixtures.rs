//! The scenes of `fixtures/scenes` are what their users count on.

use crate::common;
use crate::common::{fixture, quantile, range_error};
use range_image::{ComplexFrame, Flags, average, demodulate};
use scattering_deconvolution::{RestorationOptions, restore};
use simulation::{FrameTruth, SimulationSpec, Simulator, StationImage, simulate};

fn averaged(
    simulator: &Simulator,
    image: &StationImage,
    frames: usize,
) -> (ComplexFrame, std::sync::Arc<simulation::FrameTruth>) {
    let options = simulator.spec().demodulation_options();
    let frames: Vec<_> = (0..frames).map(|frame| simulator.frame(image, frame, 7).unwrap()).collect();
    let complex: Vec<_> = frames.iter().map(|frame| demodulate(&frame.raw, &options).unwrap()).collect();
    (average(&complex).unwrap(), frames[0].truth.clone())
}

#[test]
fn the_small_room_is_the_room_with_fewer_pixels() {
    let (room, small) = (fixture("room"), fixture("room_small"));
    assert_eq!(room.scene, small.scene);
    assert_eq!(room.stations, small.stations);
    assert_eq!(room.errors.range, small.errors.range);
    assert_eq!(room.camera.geometry.lens, small.camera.geometry.lens);
    let size = |spec: &SimulationSpec| {
        let format = spec.camera.geometry.format;
        (format.width as f64 * format.pixel_pitch_mm[0], format.height as f64 * format.pixel_pitch_mm[1])
    };
    let ((width, height), (small_width, small_height)) = (size(&room), size(&small));
    // The pitch of the small room is a repeating decimal.
    assert!((width - small_width).abs() < 1e-12 && (height - small_height).abs() < 1e-12);
    assert!(room.errors.multipath.is_none());
    assert_eq!(room.camera.geometry, fixture("wall").camera.geometry);
    assert_eq!(room.errors, fixture("wall").errors);
}

#[test]
fn raw_ranges_of_the_small_room_are_off_by_five_to_ten_centimetres() {
    let spec = fixture("room_small");
    let simulator = Simulator::new(&spec).unwrap();
    let (mut errors, mut beyond, mut mixed, mut pixels) = (Vec::new(), 0, 0, 0);
    for station in 0..spec.stations.len() {
        let image = simulator.station(station).unwrap();
        let (complex, truth) = averaged(&simulator, &image, spec.exposure.frames_per_station);
        errors.extend(range_error(&complex, 0, &truth.range));
        let interval = common::INTERVAL_M as f32;
        let here = truth.range.as_slice().iter().filter(|range| **range > interval).count();
        assert!(here > 0, "station {station} sees nothing beyond the ambiguity interval");
        assert!(truth.range.as_slice().iter().all(|range| *range > 0.7), "the room is closed and nothing is too near");
        assert!(complex.flags.as_slice().iter().all(|flags| !flags.contains(Flags::SATURATED)));
        beyond += here;
        mixed += truth.mixed.as_slice().iter().filter(|mixed| **mixed).count();
        pixels += truth.range.len();
    }
    let median = quantile(&errors, 0.5);
    assert!((0.05..0.10).contains(&median), "median raw error {median} m");
    let share = |count: usize| count as f64 / pixels as f64;
    assert!((0.1..0.5).contains(&share(beyond)), "{}", share(beyond));
    // Pixels twice as large as the room's are mixed twice as often.
    assert!((0.02..0.12).contains(&share(mixed)), "{}", share(mixed));
}

/// Errors that are left when the true calibration takes off scattering and range errors, wrap counts given.
fn calibrated_errors(spec: &SimulationSpec, complex: &mut ComplexFrame, truth: &FrameTruth) -> Vec<f64> {
    let psf = spec.errors.scattering.as_ref().unwrap();
    let options = RestorationOptions { tolerance: 1e-7, ..RestorationOptions::default() };
    restore(complex, psf, &options).unwrap();
    let (model, geometry) = (&spec.errors.range.as_ref().unwrap()[0], spec.camera.geometry);
    let (channel, [xp, yp]) = (&complex.channels[0], geometry.interior.principal_point_mm);
    let (phase, amplitude) = (channel.phase(), channel.amplitude());
    let error = |i: usize| {
        let wrapped = channel.modulation.range_from_phase(f64::from(phase.as_slice()[i]));
        let observed = wrapped + f64::from(truth.wraps[0].as_slice()[i]) * common::INTERVAL_M;
        let place = [(i % phase.width()) as f64, (i / phase.width()) as f64];
        let [x, y] = geometry.format.image_from_pixel(place);
        let corrected = model.corrected_range(observed, x - xp, y - yp, f64::from(amplitude.as_slice()[i]));
        common::wrapped(corrected - f64::from(truth.range.as_slice()[i]), common::INTERVAL_M)
    };
    (0..phase.len()).map(error).collect()
}

#[test]
fn the_true_calibration_brings_the_room_to_millimetres() {
    let spec = fixture("room");
    let simulator = Simulator::new(&spec).unwrap();
    // Two of the eight stations, for time.
    for station in [0, 5] {
        let image = simulator.station(station).unwrap();
        let (mut complex, truth) = averaged(&simulator, &image, spec.exposure.frames_per_station);
        let errors = calibrated_errors(&spec, &mut complex, &truth);
        let unmixed: Vec<f64> = (0..errors.len()).filter(|i| !truth.mixed.as_slice()[*i]).map(|i| errors[i]).collect();
        let (median, most) = (quantile(&unmixed, 0.5), quantile(&unmixed, 0.95));
        assert!(median < 0.003 && most < 0.012, "station {station}: median {median} m, 95 % {most} m");
    }
}

#[test]
fn noise_of_the_small_room_is_as_its_model_predicts() {
    let spec = fixture("room_small");
    let mut silent = spec.clone();
    silent.errors.noise = None;
    silent.errors.digitisation = None;
    silent.stations.truncate(1);
    let survey = simulate(&silent, 7, &|_, _| {}).unwrap();
    let clean = demodulate(&survey.frames[0].raw, &silent.demodulation_options()).unwrap();
    let simulator = Simulator::new(&spec).unwrap();
    let (complex, _) = averaged(&simulator, &simulator.station(0).unwrap(), 2);
    let (noisy, clean) = (&complex.channels[0], &clean.channels[0]);
    let square = |i: usize| {
        let off = noisy.real.as_slice()[i] - clean.real.as_slice()[i];
        f64::from(off / noisy.sigma.as_slice()[i]).powi(2)
    };
    let mean = (0..noisy.real.len()).map(square).sum::<f64>() / noisy.real.len() as f64;
    // 6336 squares: known to sqrt(2 / 6336) = 1.8 %; four of these. Rounding to counts of 2.5 units adds 0.52 to
    // variances of 15 and more.
    assert!((mean - 1.0).abs() < 0.10, "{mean}");
}

#[test]
fn neighbouring_stations_share_half_their_view_or_more() {
    let spec = fixture("room_small");
    let simulator = Simulator::new(&spec).unwrap();
    let truths: Vec<_> = (0..spec.stations.len())
        .map(|station| simulator.frame(&simulator.station(station).unwrap(), 0, 1).unwrap().truth)
        .collect();
    let camera = spec.camera.geometry;
    for (index, from) in truths.iter().enumerate() {
        let to = &truths[(index + 1) % truths.len()];
        let shared = |i: usize| {
            let (col, row) = (i % 132, i / 132);
            let range = f64::from(from.range[(col, row)]);
            let point = from.world_from_camera * camera.point([col as f64, row as f64], range);
            let Ok([c, r]) = camera.project(&(to.world_from_camera.inverse() * point)) else { return false };
            let there = if c > -0.5 && r > -0.5 { to.range.get(c.round() as usize, r.round() as usize) } else { None };
            let distance = (point.coords - to.world_from_camera.translation.vector).norm();
            // Within a pixel's slope and 5 cm: the same surface, not one in front of it.
            there.is_some_and(|there| (f64::from(*there) - distance).abs() < 0.05 + 0.02 * distance)
        };
        let overlap = (0..132 * 108).filter(|i| shared(*i)).count() as f64 / (132.0 * 108.0);
        assert!((0.5..0.8).contains(&overlap), "stations {index} and next: {overlap}");
    }
}
