//! Frames that cannot be registered: each gets a typed error.

use crate::common::{Pinhole, frame_pair};
use crate::prepared::{pinhole, prepared};
use nalgebra::{Isometry3, Vector3};
use projective_registration::Error;
use projective_registration::{FrameAligner, FrameAlignmentOptions, OrganisedFrame, Projection, align_frames};
use rigid_pose::InputError;

#[test]
fn input_without_an_answer_gets_a_typed_error() {
    let camera = Pinhole::small();
    let (w, h) = (camera.width, camera.height);
    let projection = pinhole(&camera);
    let pair = frame_pair(&camera, 0);
    let good = prepared(&projection, &pair.target);
    let options = FrameAlignmentOptions::default();
    let identity = Isometry3::identity();

    let nothing = OrganisedFrame::new(&projection, &vec![[f64::NAN; 3]; w * h], None).unwrap();
    assert!(nothing.is_empty());
    assert!(matches!(
        align_frames(&nothing, &good, &identity, &options),
        Err(Error::Input(InputError::TooFewPoints { .. }))
    ));
    assert!(matches!(
        align_frames(&good, &nothing, &identity, &options),
        Err(Error::Input(InputError::TooFewPoints { .. }))
    ));
    let mut one = vec![[f64::NAN; 3]; w * h];
    one[w * h / 2] = pair.target.0[w * h / 2];
    let one = OrganisedFrame::new(&projection, &one, None).unwrap();
    assert!(matches!(
        align_frames(&one, &good, &identity, &options),
        Err(Error::Input(InputError::TooFewPoints { .. }))
    ));

    // Collinear: one row of pixels; duplicates: all points at one place, on the ray of one pixel only.
    let row = |k: usize| if k / w == h / 2 { pair.target.0[k] } else { [f64::NAN; 3] };
    let line = OrganisedFrame::new(&projection, &(0..w * h).map(row).collect::<Vec<_>>(), None).unwrap();
    assert!(matches!(
        align_frames(&line, &good, &identity, &options),
        Err(Error::Input(InputError::TooFewPoints { .. }))
    ));
    assert!(matches!(
        align_frames(&good, &line, &identity, &options),
        Err(Error::Input(InputError::TooFewPoints { .. }))
    ));
    let same = OrganisedFrame::new(&projection, &vec![pair.target.0[w * h / 2]; w * h], None);
    assert!(matches!(same, Err(Error::PointsOffRays { .. })));

    let short = OrganisedFrame::new(&projection, &pair.target.0[1..], None);
    assert!(matches!(short, Err(Error::Input(InputError::LengthMismatch { .. }))));
    let short = OrganisedFrame::new(&projection, &pair.target.0, Some(&pair.target.1[1..]));
    assert!(matches!(short, Err(Error::Input(InputError::LengthMismatch { .. }))));
    // The computer-vision frame: z forwards.
    let forwards: Vec<[f64; 3]> = pair.target.0.iter().map(|p| [p[0], -p[1], -p[2]]).collect();
    assert!(matches!(OrganisedFrame::new(&projection, &forwards, None), Err(Error::PointsOffRays { .. })));
    let infinite = OrganisedFrame::new(&projection, &vec![[f64::INFINITY; 3]; w * h], None).unwrap();
    assert!(infinite.is_empty());

    let nan = Isometry3::translation(f64::NAN, 0.0, 0.0);
    assert!(matches!(align_frames(&good, &good, &nan, &options), Err(Error::Input(InputError::NonFinite { .. }))));
    for away in [Isometry3::translation(0.0, 0.0, 1e3), Isometry3::rotation(Vector3::y() * 3.0)] {
        assert!(matches!(
            align_frames(&good, &good, &away, &options),
            Err(Error::Input(InputError::TooFewCorrespondences { .. }))
        ));
    }

    assert!(Projection::pinhole(0, 10, [100.0; 2], [5.0; 2]).is_err());
    assert!(Projection::pinhole(usize::MAX, 10, [100.0; 2], [5.0; 2]).is_err());
    assert!(Projection::pinhole(10, 10, [f64::NAN, 100.0], [5.0; 2]).is_err());
    assert!(Projection::pinhole(10, 10, [100.0; 2], [f64::INFINITY; 2]).is_err());
    let rays = |ray: [f64; 3]| Projection::from_directions(10, 10, &[ray; 100]);
    assert!(matches!(rays([0.0, 0.0, -1.0]), Err(Error::DegenerateRay { .. })));
    assert!(matches!(rays([0.0, 0.0, 1.0]), Err(Error::DegenerateRay { .. })));
    assert!(matches!(rays([0.0; 3]), Err(Error::DegenerateRay { .. })));
    assert!(matches!(rays([f64::NAN; 3]), Err(Error::Input(InputError::NonFinite { .. }))));
    assert!(matches!(Projection::from_directions(10, 10, &[]), Err(Error::Input(InputError::LengthMismatch { .. }))));
    for options in [
        FrameAlignmentOptions { max_iterations: 0, ..options.clone() },
        FrameAlignmentOptions { max_motion_sigma_m: Some(f64::NAN), ..options.clone() },
        FrameAlignmentOptions { noise_fraction: Some(0.0), ..options.clone() },
    ] {
        assert!(FrameAligner::new(options).is_err());
    }
}
