//! Putting the answer together.

use nalgebra::DMatrix;
use range_image::Raster;
use statistics::{CHI_MEDIANS, upper_median};

use super::result::{Ambiguity, CaptureReport, Estimated, NuisanceValues, PsfEstimate, PsfParameter, Verdict};
use super::search::fit::{Agreement, Fit, Problem, StartTerm, Unknown};
use super::search::observation::SMALLEST_SIGMA;
use super::search::response::Term;
use super::search::scene::{Blind, Scene};
use super::search::selection::Choice;
use super::{EstimationOptions, Nuisance, TermShape};
use crate::{GaussianTerm, Psf};

/// Weight of an outlier, in standard deviations: twice the limit of the kernel halves the weight.
const HALF_WEIGHT: f64 = 2.0;

/// An answer without an adjustment.
pub(super) fn blind(scenes: &[Scene], what: Ambiguity) -> PsfEstimate {
    let reports = scenes.iter().map(|scene| CaptureReport { unused: blindness(scene), ..empty_report(scene) });
    PsfEstimate {
        psf: None,
        verdict: Verdict::undetermined(what),
        parameters: Vec::new(),
        covariance: DMatrix::zeros(0, 0),
        sigma0: f64::NAN,
        redundancy: 0,
        outlier_share: 0.0,
        detection_limit: f64::INFINITY,
        candidates: Vec::new(),
        captures: reports.collect(),
    }
}

/// The answer of an adjustment, `first_scenes` being those before blocks were rejected.
pub(super) fn estimate(
    problem: &Problem<'_>,
    choice: Choice,
    first_scenes: &[Scene],
    detection_limit: f64,
) -> PsfEstimate {
    let Choice { mut fit, reduced, ambiguity, candidates } = choice;
    sort_by_width(&mut fit, problem.options);
    let verdict = verdict(&fit, ambiguity, detection_limit, problem.options);
    let known = matches!(verdict, Verdict::Determined | Verdict::NothingToCorrect) || reduced;
    let term = |term: &Term| GaussianTerm { weight: term.weight, sigma_px: term.sigma_px };
    let captures = reports(problem, &fit, first_scenes);
    let observed: usize = captures.iter().map(|report| report.blocks + report.rejected_blocks).sum();
    let rejected: usize = captures.iter().map(|report| report.rejected_blocks).sum();
    let limit = HALF_WEIGHT * problem.scale * problem.options.huber_limit.unwrap_or(f64::INFINITY);
    let light = fit.agreements.iter().filter(|one| one.size > limit).count();
    PsfEstimate {
        psf: known.then(|| Psf::Gaussians(fit.terms.iter().map(term).collect())),
        verdict,
        parameters: parameters(&fit, problem.options),
        covariance: &fit.covariance * fit.inflation().powi(2),
        sigma0: fit.sigma0,
        redundancy: fit.redundancy,
        outlier_share: (rejected + light) as f64 / observed.max(1) as f64,
        detection_limit,
        candidates,
        captures,
    }
}

fn verdict(fit: &Fit, ambiguity: Option<Ambiguity>, detection_limit: f64, options: &EstimationOptions) -> Verdict {
    match ambiguity {
        Some(what) => Verdict::undetermined(what),
        None if !fit.terms.is_empty() => Verdict::Determined,
        None if detection_limit <= options.relevant_weight => Verdict::NothingToCorrect,
        None => Verdict::undetermined(Ambiguity::SignalBelowNoise),
    }
}

/// The narrowest Gaussian first.
fn sort_by_width(fit: &mut Fit, options: &EstimationOptions) {
    let per_term = 1 + options.widths_per_term();
    let mut order: Vec<usize> = (0..fit.terms.len()).collect();
    let area = |index: usize| fit.terms[index].sigma_px.iter().product::<f64>();
    order.sort_by(|&a, &b| area(a).total_cmp(&area(b)));
    let place = |index: usize| order[index / per_term] * per_term + index % per_term;
    let n = fit.covariance.nrows();
    fit.covariance = DMatrix::from_fn(n, n, |i, j| fit.covariance[(place(i), place(j))]);
    fit.terms = order.iter().map(|&index| fit.terms[index]).collect();
}

fn parameters(fit: &Fit, options: &EstimationOptions) -> Vec<PsfParameter> {
    let mut out = Vec::new();
    for (index, term) in fit.terms.iter().enumerate() {
        let [across, down] = term.sigma_px;
        let values = match options.shape {
            TermShape::Round => vec![("weight", term.weight), ("sigma_px", across)],
            TermShape::Elliptic => {
                vec![("weight", term.weight), ("sigma_px across", across), ("sigma_px down", down)]
            }
        };
        for (name, value) in values {
            let sigma = fit.sigma(out.len());
            out.push(PsfParameter { name: format!("{name} {}", index + 1), value, sigma });
        }
    }
    out
}

fn reports(problem: &Problem<'_>, fit: &Fit, first_scenes: &[Scene]) -> Vec<CaptureReport> {
    let held_out = held_out(problem, fit);
    let report = |(index, (scene, first)): (usize, (&&Scene, &Scene))| {
        let own: Vec<&Agreement> = fit.agreements.iter().filter(|one| one.scene == index).collect();
        CaptureReport {
            blocks: own.len(),
            rejected_blocks: first.means.len().saturating_sub(scene.means.len()),
            rms_before: rms(own.iter().map(|one| (one.observed, one.numbers))),
            rms_after: rms(own.iter().map(|one| (one.residual, one.numbers))),
            rms_held_out: held_out[index],
            nuisances: nuisance_values(&fit.nuisances[index], problem.options),
            unused: blindness(scene),
            ..empty_report(scene)
        }
    };
    problem.scenes.iter().zip(first_scenes).enumerate().map(report).collect()
}

fn nuisance_values(values: &[[Estimated; 2]], options: &EstimationOptions) -> NuisanceValues {
    let mut values = values.iter().copied();
    NuisanceValues {
        drift: if options.has(Nuisance::Drift) { values.next() } else { None },
        constant: if options.has(Nuisance::Constant) { values.next() } else { None },
    }
}

/// Residuals of each capture with the parameters of the others, its own nuisances being fitted.
fn held_out(problem: &Problem<'_>, fit: &Fit) -> Vec<Option<f64>> {
    let with_unknowns = |unknown: Unknown| -> Vec<StartTerm> {
        fit.terms.iter().map(|term| StartTerm { term: *term, unknown }).collect()
    };
    let mut out = vec![None; problem.scenes.len()];
    let captures = problem.scenes.iter().map(|scene| scene.capture).max().unwrap_or(0);
    if captures == 0 || fit.terms.is_empty() {
        return out;
    }
    for capture in 0..=captures {
        let (own, others): (Vec<&Scene>, Vec<&Scene>) = problem.scenes.iter().partition(|s| s.capture == capture);
        let part = |scenes| Problem { scenes, ..*problem };
        let Ok(trained) = part(others).fit(&with_unknowns(Unknown::WeightAndWidth)) else { continue };
        let held = trained.terms.iter().map(|term| {
            let term = Term { sigma_px: term.sigma_px.map(|sigma| sigma.max(SMALLEST_SIGMA)), ..*term };
            StartTerm { term, unknown: Unknown::Nothing }
        });
        let own_places = problem.scenes.iter().enumerate().filter(|(_, scene)| scene.capture == capture);
        let Ok(checked) = part(own).fit(&held.collect::<Vec<_>>()) else { continue };
        for (local, (place, _)) in own_places.enumerate() {
            let residuals = checked.agreements.iter().filter(|one| one.scene == local);
            out[place] = Some(rms(residuals.map(|one| (one.residual, one.numbers)))).filter(|rms| rms.is_finite());
        }
    }
    out
}

fn empty_report(scene: &Scene) -> CaptureReport {
    CaptureReport {
        capture: scene.capture,
        channel: scene.channel,
        source_pixels: scene.source_pixels,
        blocks: scene.means.len(),
        rejected_blocks: 0,
        rms_before: f64::NAN,
        rms_after: f64::NAN,
        rms_held_out: None,
        nuisances: NuisanceValues::default(),
        unused: None,
    }
}

fn blindness(scene: &Scene) -> Option<Ambiguity> {
    match &scene.source {
        Err(Blind::NoLight) => Some(Ambiguity::NoObjectLight),
        Err(Blind::LostLight) => Some(Ambiguity::ObjectLightLost),
        Ok(_) if scene.means.is_empty() => Some(Ambiguity::NoBackground),
        Ok(_) => None,
    }
}

/// Root mean square of numbers, from moduli and how many numbers each stands for. NaN without any.
fn rms(moduli: impl Iterator<Item = (f64, usize)>) -> f64 {
    let (sum, count) = moduli.fold((0.0, 0), |(sum, count), (modulus, n)| (sum + modulus * modulus, count + n));
    (sum / count as f64).sqrt()
}

/// Adds the blocks to `changed` (one raster for each capture) where something other than scattering happened. Whether
/// there were any.
pub(super) fn reject(problem: &Problem<'_>, fit: &Fit, changed: &mut [Raster<bool>]) -> bool {
    /// In robust standard deviations of the scene's residuals. A choice: one normal residual in two million is as far.
    const FAR: f64 = 5.0;
    /// As a share of the scattered light: a point spread function that is no sum of Gaussians misses less than that. A
    /// choice: a smaller share refuses lenses whose spread has other tails.
    const MISFIT: f64 = 0.3;
    /// Where so large a share of the blocks changed, what is seen is scattering that no Gaussians describe. A choice; a
    /// larger share lets an estimate pass that leaves most of what changed.
    const MOST: f64 = 0.15;
    let mut any = false;
    for (index, scene) in problem.scenes.iter().enumerate() {
        let own: Vec<&Agreement> = fit.agreements.iter().filter(|one| one.scene == index).collect();
        let scale = robust_scale(&own);
        let Ok(source) = &scene.source else { continue };
        let is_far = |one: &&&Agreement| one.size > FAR * scale && one.residual > MISFIT * one.modelled;
        if own.iter().filter(is_far).count() as f64 > MOST * own.len() as f64 {
            continue;
        }
        for one in own.iter().filter(is_far) {
            let plane = changed[scene.capture].as_mut_slice();
            // Its neighbours are touched by the same thing.
            for row in one.block[1].saturating_sub(1)..=one.block[1] + 1 {
                for col in one.block[0].saturating_sub(1)..=one.block[0] + 1 {
                    source.blocks.pixels_of([col, row]).for_each(|pixel| plane[pixel] = true);
                }
            }
            any = true;
        }
    }
    any
}

/// How much larger than stated the residuals are, at least one; from their median.
fn robust_scale(agreements: &[&Agreement]) -> f64 {
    let mut sizes: Vec<f64> = agreements.iter().map(|one| one.size).collect();
    let expected = CHI_MEDIANS[usize::from(agreements.iter().any(|one| one.numbers != 1))];
    (upper_median(&mut sizes) / expected).max(1.0)
}
