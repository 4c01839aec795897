//! Normalised squared errors of poses against the reported covariance.

use nalgebra::Isometry3;
use projective_registration::{FrameAligner, FrameAlignmentOptions, OrganisedFrame};
use rigid_pose::pose_difference;

use super::common::{Pinhole, frame_pair};
use super::{median, projection};

/// Quantiles of chi-squared: 95 % with six, three and two degrees of freedom.
const LIMITS: [f64; 3] = [12.592, 7.815, 5.991];

pub fn print() {
    for (name, camera, runs) in
        [("176x144", Pinhole::small(), 200), ("224x172", Pinhole::medium(), 200), ("640x480", Pinhole::large(), 50)]
    {
        let projection = projection(&camera);
        let mut aligner = FrameAligner::new(FrameAlignmentOptions::default()).unwrap();
        let (mut squares, mut inside, mut single) = (vec![], [0; 3], [0.0; 6]);
        let mut undetermined = 0;
        for k in 0..runs {
            let pair = frame_pair(&camera, 1000 + k);
            let target = OrganisedFrame::new(&projection, &pair.target.0, Some(&pair.target.1)).unwrap();
            let source = OrganisedFrame::new(&projection, &pair.source.0, Some(&pair.source.1)).unwrap();
            let result = aligner.align(&source, &target, &Isometry3::identity()).unwrap();
            undetermined += u32::from(!result.is_trustworthy());
            let e = pose_difference(&result.target_from_source, &pair.target_from_source);
            let all = e.dot(&(result.covariance.try_inverse().unwrap() * e));
            let place = e.fixed_rows::<3>(0).into_owned();
            let block = result.covariance.fixed_view::<3, 3>(0, 0).into_owned();
            let of_place = place.dot(&(block.try_inverse().unwrap() * place));
            let plane = e.fixed_rows::<2>(0).into_owned();
            let block = result.covariance.fixed_view::<2, 2>(0, 0).into_owned();
            let of_plane = plane.dot(&(block.try_inverse().unwrap() * plane));
            for (count, is_inside) in
                inside.iter_mut().zip([all <= LIMITS[0], of_place <= LIMITS[1], of_plane <= LIMITS[2]])
            {
                *count += u32::from(is_inside);
            }
            for (s, i) in single.iter_mut().zip(0..6) {
                *s += e[i] * e[i] / result.covariance[(i, i)] / runs as f64;
            }
            squares.push(all);
        }
        let mean = squares.iter().sum::<f64>() / runs as f64;
        let share = inside.map(|n| 100.0 * f64::from(n) / runs as f64);
        println!(
            "{name}: {runs} runs, normalised squared error {mean:.2} (6 expected; median {:.2}, 5.35 expected), inside \
             95 % ellipsoids: pose {:.1} %, position {:.1} %, x-y {:.1} %; single components {single:.2?}; {undetermined} not trusted",
            median(&mut squares),
            share[0],
            share[1],
            share[2]
        );
    }
}
