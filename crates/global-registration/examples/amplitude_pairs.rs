//! Pairs of amplitude images matched by their features, simulated and real: how many features there are, how many partners are
//! right, and which poses come of them.
//!
//! `amplitude_pairs [first seed] [pairs]`: a painted wall and floor; two stations of an SR4000; a living room by its colour images.
#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs)]

#[path = "../../point-cloud/tests/common/mod.rs"]
mod common;
#[path = "../../projective-registration/tests/depth_frames/mod.rs"]
mod depth_frames;
#[path = "../tests/painted.rs"]
mod painted;
#[path = "../../projective-registration/tests/sr4000/mod.rs"]
mod sr4000;

use std::io::Cursor;
use std::path::Path;

use common::{Pinhole, disturbance, look_at, pose_error};
use global_registration::{
    AmplitudeFeatureOptions, CoarseOptions, FeatureCloud, Features, SparseIcpOptions, SurfaceDescriptors,
    align_features, align_without_guess, amplitude_features,
};
use nalgebra::Isometry3;
use point_cloud::Cloud;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// Scatter of a simulated amplitude, as a share of it.
const NOISE: f64 = 0.01;
/// Where the second station of the SR4000 stands before the first: from planes through floor and walls, good to 2 cm.
const SR4000_STEP_M: [f64; 3] = [-0.009, 0.045, -0.309];
/// How near a partner must be at the true pose, metre.
const NEAR_M: f64 = 0.05;

/// An image with its points.
struct View {
    amplitude: Vec<f32>,
    points: Vec<[f64; 3]>,
}

fn main() {
    let mut words = std::env::args().skip(1).map(|word| word.parse::<u64>().unwrap());
    let (first, count) = (words.next().unwrap_or(0), words.next().unwrap_or(40));
    let camera = Pinhole::medium();
    let mut table = Table::default();
    for seed in first..first + count {
        let (views, poses) = painted_views(&camera, seed);
        // A wall and a floor say nothing about the motion along their edge.
        let options = CoarseOptions { min_determined: 0.0, min_inside: 0.0, ..by_amplitude() };
        table.add(&views, [camera.width, camera.height], &(poses[0].inverse() * poses[1]), &options, seed);
    }
    table.print("painted wall and floor");
    let mut table = Table::default();
    for (k, j) in (0..16).map(|pair| (pair / 4, pair % 4)) {
        let view = |station: usize, frame: usize| {
            let ([a, b], [p, q]) = (sr4000::amplitudes(frame)?, sr4000::points(&[frame])?);
            Some(if station == 0 { View { amplitude: a, points: p } } else { View { amplitude: b, points: q } })
        };
        let (Some(target), Some(source)) = (view(0, k), view(1, j)) else { continue };
        let [x, y, z] = SR4000_STEP_M;
        let seed = (4 * k + j) as u64;
        table.add(&[target, source], sr4000::SIZE, &Isometry3::translation(x, y, z), &by_amplitude(), seed);
    }
    table.print("SR4000");
    let mut table = Table::default();
    let frames = depth_frames::living_room().map(|sequence| sequence.frames).unwrap_or_default();
    for (j, k) in (0..frames.len()).flat_map(|j| (j + 1..frames.len()).map(move |k| (j, k))) {
        let views = [j, k].map(|k| colour_view(k, &frames[k].points));
        let truth = frames[j].world_from_camera.inverse() * frames[k].world_from_camera;
        table.add(&views, [640, 480], &truth, &by_amplitude(), (10 * j + k) as u64);
    }
    table.print("living room");
}

fn by_amplitude() -> CoarseOptions {
    CoarseOptions { descriptors: SurfaceDescriptors::None, ..CoarseOptions::default() }
}

/// Two views, up to a metre nearer and turned by up to 25 degrees about every axis.
fn painted_views(camera: &Pinhole, seed: u64) -> ([View; 2], [Isometry3<f64>; 2]) {
    let mut random = Pcg64::seed_from_u64(seed);
    // Another place is painted in another way.
    let x = 20.0 * seed as f64;
    let mut about = |middle: f64, half: f64| middle + half * (2.0 * random.random::<f64>() - 1.0);
    let target = look_at([x, -1.0, 1.2], [x + about(0.0, 0.3), 2.0, about(0.8, 0.3)]);
    let aim = [x + about(0.1, 0.3), 2.0, about(0.8, 0.3)];
    let source = look_at([x + about(0.2, 0.4), about(-0.5, 0.5), about(1.2, 0.3)], aim);
    let source = source * Isometry3::rotation(nalgebra::Vector3::z() * about(0.0, 0.4));
    let poses = [target, source];
    let views = poses.map(|pose| {
        let (mut amplitude, points) = painted::frame(camera, &pose);
        for value in &mut amplitude {
            let draw: f64 = StandardNormal.sample(&mut random);
            *value *= (1.0 + NOISE * draw) as f32;
        }
        View { amplitude, points }
    });
    (views, poses)
}

/// A colour image of the living room as the amplitude of its own light: grey over squared range.
fn colour_view(frame: usize, points: &[[f64; 3]]) -> View {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/real/redwood_rgbd5/color"));
    let bytes = std::fs::read(folder.join(format!("{frame:05}.jpg"))).unwrap();
    let options = DecoderOptions::default().jpeg_set_out_colorspace(ColorSpace::Luma);
    let grey = JpegDecoder::new_with_options(Cursor::new(bytes), options).decode().unwrap();
    let square = |p: &[f64; 3]| p.iter().map(|v| v * v).sum::<f64>();
    let amplitude = grey.iter().zip(points).map(|(&grey, p)| (f64::from(grey) / square(p)) as f32).collect();
    View { amplitude, points: points.to_vec() }
}

#[derive(Default)]
struct Table {
    pairs: usize,
    features: usize,
    matched: usize,
    right_matches: usize,
    right: usize,
    wrong: usize,
    millimetres: Vec<f64>,
    /// From a guess, by features alone.
    from_guess: Vec<f64>,
}

impl Table {
    fn add(
        &mut self,
        views: &[View; 2],
        [width, height]: [usize; 2],
        truth: &Isometry3<f64>,
        options: &CoarseOptions,
        seed: u64,
    ) {
        self.pairs += 1;
        let features = views.each_ref().map(|view| {
            let options = AmplitudeFeatureOptions::default();
            amplitude_features(&view.amplitude, &view.points, width, height, &options).unwrap()
        });
        let [target, source] = &features;
        self.features += target.len() + source.len();
        for (i, j) in partners(source, target) {
            self.matched += 1;
            self.right_matches += usize::from((truth * source.points()[i] - target.points()[j]).norm() < NEAR_M);
        }
        let guess = disturbance(0.1, 5.0, seed) * truth;
        if let Ok(found) = align_features(source, target, &guess, &SparseIcpOptions::new(0.4, NEAR_M)) {
            self.from_guess.push(pose_error(&found.target_from_source, truth).0);
        }
        let [target, source] = [0, 1].map(|k| {
            let cloud = Cloud::from_frame(&views[k].points, None, None).unwrap();
            FeatureCloud::new(&cloud, options).unwrap().with_features(features[k].clone())
        });
        if let Ok(found) = align_without_guess(&source, &target, options) {
            let (millimetre, degree) = pose_error(&found.target_from_source, truth);
            let right = millimetre < 100.0 && degree < 5.0;
            self.right += usize::from(right);
            self.wrong += usize::from(!right);
            self.millimetres.push(millimetre);
        }
    }

    fn print(self, name: &str) {
        let Self { pairs, features, matched, right_matches, right, wrong, .. } = self;
        let [without, from_guess] = [self.millimetres, self.from_guess].map(|mut values| {
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
        });
        println!(
            "{name}: {} features a frame, {right_matches} of {matched} mutual partners right; without a guess {right} of {pairs} \
             right, {wrong} wrong, {without:.1} mm; by features from 0.1 m and 5 deg {from_guess:.1} mm",
            features / (2 * pairs).max(1)
        );
    }
}

/// Features that are each other's likest.
fn partners(source: &Features, target: &Features) -> Vec<(usize, usize)> {
    let likest = |from: &Features, to: &Features| -> Vec<usize> {
        let like = |i: usize, j: usize| -> f32 {
            from.descriptor(i).unwrap().iter().zip(to.descriptor(j).unwrap()).map(|(a, b)| a * b).sum()
        };
        let best = |i: usize| (0..to.len()).max_by(|&j, &k| like(i, j).total_cmp(&like(i, k))).unwrap_or(0);
        (0..from.len()).map(best).collect()
    };
    let (forth, back) = (likest(source, target), likest(target, source));
    forth.into_iter().enumerate().filter(|&(i, j)| back.get(j) == Some(&i)).collect()
}
