//! Where matrices are factorised: normal equations belong to `adjust`, and what solves equations elsewhere says why here.

use std::path::Path;

/// Ways to factorise or invert a matrix.
const WAYS: [&str; 6] = [".cholesky()", "Cholesky::new", "try_inverse()", ".lu()", ".qr()", ".svd("];

/// Files of crates other than those of least squares that do, and what for.
const KNOWN: &[(Use, &[&str])] = &[
    (
        Use::Covariance,
        &[
            "common-errors/src/sensitivity.rs",
            "calibration-network/src/given/check.rs",
            "calibration-network/src/weakness/simulate.rs",
            "calibration-tasks/src/calibrate/planes/pose_test.rs",
            "calibration-tasks/src/calibrate/results/certificate/verdicts.rs",
            "icp-registration/src/icp/prior.rs",
            "inertial/src/sequence/estimate.rs",
            "multiview-registration/src/adjustment/precision.rs",
            "multiview-registration/src/adjustment/simultaneous.rs",
            "multiview-registration/src/adjustment/turns.rs",
            "multiview-registration/src/agreement/loops.rs",
            "multiview-registration/src/pairs_of_frames/frame_pairs.rs",
            "multiview-registration/src/survey/datum.rs",
            "orientation/src/mounting/estimate.rs",
            "projective-registration/src/options.rs",
            "projective-registration/src/partners/track.rs",
            "projective-registration/src/registration/aligner.rs",
            "projective-registration/src/registration/apart.rs",
            "projective-registration/src/registration/quality.rs",
            "range-calibration/src/ranges/amplitude_or_position.rs",
            "residual-tests/src/trends/wald.rs",
            "rigid-pose/src/uncertain.rs",
            "self-calibration/src/choice/auto_terms.rs",
            "self-calibration/src/contradictions/causes/control.rs",
            "self-calibration/src/contradictions/explain/frequency.rs",
            "self-calibration/src/methods/range_step.rs",
            "self-calibration/src/methods/reference.rs",
            "self-calibration/src/outliers/control_test.rs",
            "tracking/src/motion_model/motion.rs",
            "tracking/src/stream/register.rs",
        ],
    ),
    (
        Use::ClosedForm,
        &[
            "camera-model/src/lenses/lens_inverse.rs",
            "camera-model/src/lenses/rational.rs",
            "camera-model/src/observation.rs",
            "error-models/src/screening/plane_block.rs",
            "global-registration/src/description/sift/extrema.rs",
            "icp-registration/src/parts/metric/coloured.rs",
            "icp-registration/src/parts/metric/plane_to_plane.rs",
            "measurement/src/fit/start.rs",
            "orientation/src/mounting/closed_form.rs",
            "orientation/src/relative/five_points.rs",
            "orientation/src/robust_pose.rs",
            "primitives/src/linear_start.rs",
            "range-calibration/src/by_planes/planes_start.rs",
            "rigid-pose/src/absolute_orientation/moments.rs",
            "rigid-pose/src/absolute_orientation/svd.rs",
            "scattering-deconvolution/src/estimate/search/score.rs",
            "scattering-deconvolution/src/estimate/search/start.rs",
            "targets/src/circles/eccentricity.rs",
            "targets/src/sightings/target_range.rs",
            "targets/src/spheres/candidates.rs",
            "targets/src/board/smoothness.rs",
            "warm-up/src/fit.rs",
        ],
    ),
    (
        Use::SmallStep,
        &[
            "fusion/src/surfels/curvature.rs",
            "icp-registration/src/quality/directions.rs",
            "inertial/src/state.rs",
            "measurement/src/fit/adjusted.rs",
            "multipath/src/pixels/refine.rs",
            "multipath/src/scene/bending.rs",
            "multipath/src/scene/patches.rs",
            "multiview-registration/src/places/sought.rs",
            "pose-graph/src/relation.rs",
            "primitives/src/adjustment/plane_step.rs",
            "projective-registration/src/shared_error.rs",
            "rigid-pose/src/centred.rs",
            "stored-values/src/surfaces.rs",
            "targets/src/board/corners/fit.rs",
            "targets/src/circles/rough_fit.rs",
            "tracking/src/motion_model/velocity.rs",
        ],
    ),
    (
        Use::OwnStructure,
        &[
            "fusion/src/common/equations.rs",
            "multiview-registration/src/adjustment/equations.rs",
            "multiview-registration/src/planes/elimination.rs",
            "pose-graph/src/adjustment.rs",
        ],
    ),
];

/// What a matrix is factorised for outside `adjust`.
#[derive(Debug, Clone, Copy)]
enum Use {
    /// A covariance is whitened with, compared with or tested; nothing is estimated.
    Covariance,
    /// Start values and small closed forms, of at most a dozen unknowns that are solved for once.
    ClosedForm,
    /// A step of nine unknowns or fewer in a loop over pixels, corners, pairs or frames.
    SmallStep,
    /// Equations whose blocks are summed up in a hot loop and eliminated there: planes that stations share (a hundred thousand
    /// points to a few thousand planes; fused places to the common errors of all points), and keyframes, whose field of the sensor is a considered parameter.
    OwnStructure,
}

/// A file that factorises and is not known, or is known and does not.
pub(crate) fn complaints(root: &Path, sources: &[(String, String)]) -> Vec<String> {
    let known: Vec<(&str, Use)> =
        KNOWN.iter().flat_map(|(use_, files)| files.iter().map(|file| (*file, *use_))).collect();
    let mut found = Vec::new();
    for (path, text) in sources {
        let Some(file) = path.strip_prefix("crates/").filter(|file| file.contains("/src/")) else { continue };
        let is_engine =
            ["adjust/", "dense-matrices/", "observation-equations/"].iter().any(|name| file.starts_with(name));
        let code = text.split("#[cfg(test)]").next().unwrap_or_default();
        let lines = code.lines().filter(|line| !line.trim_start().starts_with("//"));
        let factorises = lines.into_iter().any(|line| WAYS.iter().any(|way| line.contains(way)));
        if factorises && !is_engine && !file.ends_with("tests.rs") && !known.iter().any(|(name, _)| *name == file) {
            found.push(format!(
                "{path}: factorises a matrix; let `adjust` do it, or say in xtask/src/tidy/factorisations.rs what for"
            ));
        }
    }
    for (name, use_) in known {
        if !root.join("crates").join(name).exists() {
            found.push(format!("xtask/src/tidy/factorisations.rs: there is no crates/{name} any more ({use_:?})"));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_solves_its_own_equations_is_named() {
        let root = crate::shell::root();
        let source = |text: &str| vec![("crates/warm-up/src/new.rs".to_owned(), text.to_owned())];
        assert!(complaints(&root, &source("let f = normal.cholesky()?;")).iter().any(|c| c.contains("new.rs")));
        assert!(!complaints(&root, &source("// normal.cholesky()")).iter().any(|c| c.contains("new.rs")));
    }
}
