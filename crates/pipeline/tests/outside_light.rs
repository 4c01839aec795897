//! Light from outside the field of view is suspected where it is, and dim light of the scene is not taken for it.

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use pipeline::{Doubt, DoubtKind, Plan, Processed, Silent, process};
use range_image::{Flags, RawFrame, Samples};
use range_io::survey::{InputFrame, Survey, read_frame, write_frame};
use scattering_deconvolution::{GaussianTerm, Psf, Scatterer};

use crate::common::{fixtures, simulated_from};

/// A scene of the fixtures with another light and fewer stations, as a survey; as many frames of each as asked.
fn dimmed(scene: &str, source_power: f64, frames: usize, stations: &[&str], folder: &Path) -> PathBuf {
    let text = std::fs::read_to_string(fixtures().join(format!("scenes/{scene}.ron"))).unwrap();
    let station = |line: &str| line.trim_start().starts_with("(name: \"") && line.contains("position_m");
    let wanted = |line: &&str| !station(line) || stations.iter().any(|name| line.contains(&format!("\"{name}\"")));
    let lines: Vec<&str> = text.lines().filter(wanted).collect();
    let text = lines.join("\n").replace("source_power: 8.0e6", &format!("source_power: {source_power:e}"));
    let text = text.replace("frames_per_station: 4", &format!("frames_per_station: {frames}"));
    let file = folder.join("scene.ron");
    std::fs::write(&file, text).unwrap();
    simulated_from(&file, 23, folder)
}

fn ranges(survey: &Path) -> Processed {
    let stages = "Demodulate(low_amplitude: 20), Average(), Deconvolve(), Unwrap(maximum_range_m: 12), CorrectRange(), \
                  CorrectImagePoint(), PointCloud(), Flag()";
    let plan = Plan::from_ron(&format!("(name: \"test\", stages: [{stages}])"), "test.ron".as_ref()).unwrap();
    process(&plan, survey, None, &Silent).unwrap()
}

fn doubts(outcome: &Processed) -> Vec<&Doubt> {
    outcome.doubts.iter().filter(|doubt| doubt.kind == DoubtKind::OutsideLight).collect()
}

/// Share of a view's pixels flagged `multipath` between two columns.
fn flagged(outcome: &Processed, view: usize, columns: std::ops::Range<usize>) -> f64 {
    let flags = outcome.views[view].flags().unwrap();
    let (width, count) = (flags.width(), columns.len() * flags.height());
    let pixels = flags.as_slice().iter().enumerate().filter(|(index, _)| columns.contains(&(index % width)));
    pixels.filter(|(_, flags)| flags.contains(Flags::MULTIPATH)).count() as f64 / count as f64
}

/// What a board beyond the left border, of this amplitude and at a phase of 0.6, scatters into an image of 132 x 108 pixels.
fn scattered(amplitude: f32) -> Vec<f32> {
    const MARGIN: usize = 60;
    let term = |weight, sigma: f64| GaussianTerm { weight, sigma_px: [sigma, sigma] };
    let psf = Psf::Gaussians(vec![term(0.05, 3.0), term(0.16, 27.0)]);
    let (width, height) = (132 + MARGIN, 108);
    let board = |pixel: usize| (20..MARGIN - 4).contains(&(pixel % width)) && (30..80).contains(&(pixel / width));
    let mut light: Vec<f32> = (0..width * height).map(|pixel| if board(pixel) { amplitude } else { 0.0 }).collect();
    let mut none = vec![0.0; light.len()];
    Scatterer::new(&psf, width, height).unwrap().apply(&mut light, &mut none).unwrap();
    light.chunks(width).flat_map(|row| row[MARGIN..].to_vec()).collect()
}

fn add_light(survey: &Path, light: &[f32]) {
    let listed = Survey::read(survey.join(Survey::FILE_NAME)).unwrap();
    for index in 0..listed.frames.len() {
        let InputFrame::Samples(raw) = read_frame(&listed, survey, index).unwrap() else { unreachable!() };
        let Samples::U16(samples) = raw.samples() else { unreachable!() };
        let added = |(at, sample): (usize, &u16)| {
            let step = TAU * (at / light.len()) as f64 / raw.phase_steps() as f64;
            // Half of the light is modulated: as in the scene, what is not stands in the samples as well.
            let more = f64::from(light[at % light.len()]) * (2.0 + (0.6 + step).cos()) / listed.camera.raw_scale;
            (f64::from(*sample) + more).round().clamp(0.0, 65535.0) as u16
        };
        let samples = Samples::U16(samples.iter().enumerate().map(added).collect());
        let modulations = raw.modulations().to_vec();
        let raw = RawFrame::new(raw.width(), raw.height(), raw.phase_steps(), modulations, samples).unwrap();
        write_frame(survey.join(&listed.frames[index].file), &InputFrame::Samples(raw)).unwrap();
    }
}

#[test]
fn dim_surveys_have_no_light_from_outside() {
    let walls = ["C05", "C07"];
    let rooms = ["S0", "S1", "S2", "S3", "S4", "S5"];
    for (scene, power, stations) in
        [("background", 8e5, &rooms[..]), ("background", 8e3, &rooms), ("wall", 8e6, &walls)]
    {
        let folder = tempfile::tempdir().unwrap();
        let outcome = ranges(&dimmed(scene, power, 4, stations, folder.path()));
        assert_eq!(outcome.views.len(), stations.len());
        let width = outcome.views[0].flags().unwrap().width();
        let shares: Vec<f64> = (0..stations.len()).map(|view| flagged(&outcome, view, 0..width)).collect();
        println!("{scene}, source {power:e}: {shares:.3?} flagged, doubts {:?}", doubts(&outcome));
        assert!(doubts(&outcome).is_empty());
        assert!(shares.iter().all(|share| *share < 0.01), "{shares:?}");
    }
}

#[test]
fn light_from_outside_is_doubted_and_flagged_where_it_is() {
    // A room without light of its own: beside such light, less from outside can be told.
    for (frames, amplitude) in [(1, 400.0), (4, 100.0), (4, 400.0), (4, 1600.0)] {
        let folder = tempfile::tempdir().unwrap();
        let survey = dimmed("background", 8.0, frames, &["S0", "S2", "S5"], folder.path());
        add_light(&survey, &scattered(amplitude));
        let outcome = ranges(&survey);
        let doubts = doubts(&outcome);
        for doubt in &doubts {
            println!("{doubt}");
        }
        let subjects: Vec<_> = doubts.iter().map(|doubt| doubt.subject.as_deref().unwrap()).collect();
        assert_eq!(subjects, ["S0", "S2", "S5"], "{frames} frames, amplitude {amplitude}");
        for view in 0..3 {
            let [near, far] = [0..20, 112..132].map(|columns| flagged(&outcome, view, columns));
            println!("{near:.3} flagged at the left border, {far:.3} at the right one");
            assert!(near > if amplitude > 100.0 { 0.9 } else { 0.4 } && far < 0.05, "{near} {far}");
        }
    }
}
