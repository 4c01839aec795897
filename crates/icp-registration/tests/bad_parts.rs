//! Every metric with every matching on input that has no answer: a typed one, and never a NaN.

use icp_registration::parts::{
    ClosedForm, Coloured, ErrorMetric, GaussNewton, MaxNormalAngle, Minimiser, NearestPoint, PlaneToPlane,
    PointToPlane, PointToPoint, SymmetricPlanes, Trimmed,
};
use icp_registration::{DegeneracyPolicy, Error, IcpTarget, Registration, RobustKernel, Selection};
use nalgebra::{Isometry3, Point3, Vector3};
use point_cloud::Cloud;
use point_cloud::Error as CloudError;
use proptest::prelude::*;
use rigid_pose::InputError;

/// Clouds that trouble: sizes and shapes by number.
fn nasty(kind: usize, scale: f64, jitter: &[f64]) -> Cloud {
    let jitter = |i: usize| jitter[i % jitter.len()];
    let point = |i: usize| -> [f64; 3] {
        let t = i as f64 / 40.0;
        match kind {
            // One point, equal points, a line, a plane, a curved strip, a blob, two far clusters, a corner.
            0 | 1 => [0.3, 0.2, -1.0],
            2 => [t, 2.0 * t, -1.0],
            3 => [t % 1.0, (i % 7) as f64 / 7.0, -1.0],
            4 => [t.cos(), t.sin(), (i % 5) as f64 / 5.0],
            5 => [jitter(i), jitter(i + 3), jitter(i + 7)],
            6 => [if i.is_multiple_of(2) { 0.0 } else { 1e5 }, jitter(i), jitter(2 * i)],
            _ => [[t % 1.0, jitter(i).abs(), 0.0], [0.0, t % 1.0, jitter(i).abs()], [t % 1.0, 0.0, jitter(i).abs()]]
                [i % 3],
        }
    };
    let n = if kind == 0 { 1 } else { 120 };
    let points = (0..n).map(|i| Point3::from(point(i).map(|v| v * scale))).collect();
    let intensity = Some((0..n).map(|i| if i % 11 == 0 { f64::NAN } else { jitter(i) }).collect());
    Cloud { intensity, ..Cloud::new(points) }
}

fn metric(kind: usize, source: &Cloud, target: &IcpTarget) -> Box<dyn ErrorMetric> {
    match kind {
        0 => Box::new(PointToPoint),
        1 => Box::new(PointToPlane),
        2 => Box::new(SymmetricPlanes),
        3 => Box::new(PlaneToPlane::default()),
        _ => Coloured::new(source, target).map_or(Box::new(PointToPlane), |coloured| Box::new(coloured)),
    }
}

fn check(registration: &Registration<'_>, source: &Cloud, guess: &Isometry3<f64>) -> Result<(), TestCaseError> {
    match registration.align(source, guess) {
        Ok(result) => {
            let pose = result.target_from_source;
            prop_assert!(pose.translation.vector.iter().chain(pose.rotation.coords.iter()).all(|v| v.is_finite()));
            prop_assert!(result.covariance.iter().all(|v| v.is_finite()), "{}", result.covariance);
            prop_assert!(result.rms_m.is_finite() && (0.0..=1.0).contains(&result.overlap));
            prop_assert!(result.degenerate.iter().all(|m| m.axis.iter().all(|v| v.is_finite())));
        }
        Err(error) => prop_assert!(!error.to_string().is_empty()),
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(80))]
    #[test]
    fn there_is_always_an_answer(
        kinds in (0usize..8, 0usize..8, 0usize..5, 0usize..2, 0usize..2),
        exponent in -6i32..7, jitter in prop::collection::vec(-1.0..1.0_f64, 17),
        shift in prop::array::uniform3(-0.5..0.5_f64), turn in prop::array::uniform3(-0.5..0.5_f64), extras in 0u32..8,
    ) {
        #[cfg_attr(not(feature = "mesh"), allow(unused_variables))]
        let (source_kind, target_kind, metric_kind, matching_kind, minimiser_kind) = kinds;
        let scale = 10.0_f64.powi(exponent);
        let (source, target) = (nasty(source_kind, scale, &jitter), nasty(target_kind, scale, &jitter));
        let target = IcpTarget::new(target).unwrap();
        let guess = Isometry3::new(Vector3::from(shift) * scale, Vector3::from(turn));
        let metric = metric(metric_kind, &source, &target);
        let minimisation: Box<dyn Minimiser> = match minimiser_kind {
            0 => Box::new(GaussNewton),
            _ => Box::new(ClosedForm::default()),
        };
        #[cfg(feature = "mesh")]
        let mesh = {
            let corners = target.cloud().len() as u32;
            let triangles: Vec<[u32; 3]> = (0..corners.saturating_sub(2)).map(|i| [i, i + 1, i + 2]).collect();
            icp_registration::parts::TriangleMesh::new(&target.cloud().points, &triangles)
        };
        let mut registration = Registration { metric, minimisation, ..Registration::new(NearestPoint::new(&target)) };
        #[cfg(feature = "mesh")]
        if let (1, Ok(mesh)) = (matching_kind, &mesh) {
            registration.matching = Box::new(icp_registration::parts::ClosestOnMesh::new(mesh));
        }
        registration.max_iterations = 30;
        if extras & 1 != 0 { registration.kernel = RobustKernel::Tukey; }
        if extras & 2 != 0 { registration.rejection.push(Box::new(Trimmed(0.8))); }
        if extras & 4 != 0 { registration.degeneracy = DegeneracyPolicy::HoldAtGuess; }
        check(&registration, &source, &guess)?;
        registration.selection = Box::new(Selection::Stability(50));
        check(&registration, &source, &guess)?;
    }
}

#[test]
fn empty_and_nan_clouds_are_named() {
    let good = nasty(7, 1.0, &[0.1, 0.5, 0.9, 0.3]);
    let target = IcpTarget::new(good.clone()).unwrap();
    let nan = Cloud::new(vec![Point3::new(f64::NAN, 0.0, 0.0); 30]);
    let far = good.transformed(&Isometry3::translation(0.0, 1e6, 0.0));
    for kind in 0..4 {
        let metric = metric(kind, &good, &target);
        let registration = Registration { metric, ..Registration::new(NearestPoint::new(&target)) };
        let run = |cloud: &Cloud| registration.align(cloud, &Isometry3::identity());
        assert!(matches!(
            run(&Cloud::default()),
            Err(Error::Cloud(CloudError::Input(InputError::Empty { what: "the source cloud" })))
        ));
        assert!(matches!(run(&nan), Err(Error::Cloud(CloudError::Input(InputError::NonFinite { index: 0, .. })))));
        assert!(matches!(run(&far), Err(Error::Input(InputError::TooFewCorrespondences { .. }))), "{:?}", run(&far));
    }
    assert!(matches!(
        Coloured::new(&Cloud::new(good.points.clone()), &target),
        Err(Error::Input(InputError::Empty { .. }))
    ));
}

#[test]
fn parts_outside_their_domain_are_refused() {
    let good = nasty(7, 1.0, &[0.1, 0.5, 0.9, 0.3]);
    let target = IcpTarget::new(good.clone()).unwrap();
    let with = |change: &dyn Fn(&mut Registration<'_>)| {
        let mut registration = Registration::new(NearestPoint::new(&target));
        change(&mut registration);
        registration.align(&good, &Isometry3::identity())
    };
    let changes: [&dyn Fn(&mut Registration<'_>); 8] = [
        &|r| r.selection = Box::new(Selection::EveryNth(0)),
        &|r| r.selection = Box::new(Selection::NormalSpace(0)),
        &|r| r.selection = Box::new(Selection::Stability(0)),
        &|r| r.rejection = vec![Box::new(Trimmed(f64::NAN))],
        &|r| r.rejection = vec![Box::new(MaxNormalAngle(0.0))],
        &|r| r.metric = Box::new(PlaneToPlane { flatness: 0.0 }),
        &|r| r.levels.points = 0,
        &|r| r.min_correspondences = 0,
    ];
    for (k, change) in changes.iter().enumerate() {
        assert!(matches!(with(change), Err(Error::Input(InputError::InvalidOption { .. }))), "{k}");
    }
}
