//! A candidate brought to its minimum, the pairs that contradict it left out.

use adjust::{Adjustment, Differentiated, Kernel, ObservationId, ParameterBlock, Scale, SnoopingOptions, SolveOptions};
use nalgebra::Isometry3;

use crate::relative::candidates::{CUT, SAMPLE, cost};
use crate::relative::epipolar::{EpipolarCondition, UnitBase};
use crate::relative::rays::Pair;
use crate::{Error, Result};

/// Width of Cauchy's kernel: 95 % efficient for normal errors `[Huber1981]`.
const CAUCHY: f64 = 2.385;
/// Share of the objective below which a step ends the robust descent: what is left moves no pair over a limit.
const SMALL_DECREASE: f64 = 1e-3;
/// Most steps of the robust descent.
const MOST_STEPS: usize = 50;
/// Times pairs that were left out are asked again: the second time few change, the third hardly any.
const ROUNDS: usize = 3;

/// A pose to which nothing nearby is better.
#[derive(Debug, Clone)]
pub(crate) struct Minimum {
    /// Its base has the length one.
    pub(crate) first_from_second: Isometry3<f64>,
    /// Sum of the squares of all pairs, each cut.
    pub(crate) cost: f64,
    /// Which pairs agree.
    pub(crate) used: Vec<bool>,
    /// Their conditions' standardised residuals; NaN where nothing controls them or they are not used.
    pub(crate) standardised: Vec<f64>,
    /// `vᵀPv` of the pairs that agree.
    pub(crate) vtpv: f64,
}

/// Brings a robust start to its minimum.
pub(crate) fn minimum(pairs: &[Pair], start: &Isometry3<f64>, options: &SolveOptions) -> Result<Minimum> {
    let mut pose = *start;
    let fits = |pose: &Isometry3<f64>, i: usize| {
        EpipolarCondition::new(&pairs[i]).standardised(pose).powi(2) <= CUT && !pairs[i].parts(pose)
    };
    let mut used: Vec<bool> = (0..pairs.len()).map(|i| fits(&pose, i)).collect();
    let mut rejected = vec![false; pairs.len()];
    let mut round = 0;
    loop {
        let found = without_gross_errors(pairs, &used, &pose, options)?;
        pose = found.first_from_second;
        for (i, used) in used.iter_mut().enumerate() {
            rejected[i] |= *used && !found.used[i];
            *used = found.used[i];
        }
        let back: Vec<usize> = (0..pairs.len()).filter(|&i| !used[i] && !rejected[i] && fits(&pose, i)).collect();
        round += 1;
        if back.is_empty() || round == ROUNDS {
            return Ok(found);
        }
        for i in back {
            used[i] = true;
        }
    }
}

/// The pose on which gross errors have little hold.
pub(crate) fn robust(pairs: &[Pair], start: &Isometry3<f64>) -> Option<Isometry3<f64>> {
    let (mut adjustment, observations) = conditions(pairs, &vec![true; pairs.len()], start).ok()?;
    let Conditions { pose, group, .. } = observations;
    adjustment.set_kernel(group, Kernel::Cauchy(CAUCHY)).ok()?;
    let options = SolveOptions { max_iterations: MOST_STEPS, ..SolveOptions::default() };
    adjustment.descend(&options, SMALL_DECREASE).ok()?.pose(pose).ok().map(unit)
}

/// Least squares of the pairs that are used, less those that fail the test for gross errors.
fn without_gross_errors(
    pairs: &[Pair],
    used: &[bool],
    start: &Isometry3<f64>,
    options: &SolveOptions,
) -> Result<Minimum> {
    let agreeing = used.iter().filter(|used| **used).count();
    if agreeing < SAMPLE {
        return Err(Error::NoAgreement { agreeing, pairs: pairs.len() });
    }
    let (mut adjustment, Conditions { pose, observations, .. }) = conditions(pairs, used, start)?;
    // Without redundancy there is nothing to test.
    let snooping = SnoopingOptions { max_rejections: Some(agreeing - SAMPLE), ..SnoopingOptions::default() };
    let solution = if agreeing == SAMPLE {
        adjustment.solve(options)?
    } else {
        adjustment.solve_snooping(options, &snooping)?.solution
    };
    let w = solution.standardised_residuals(Scale::Prior)?;
    let (mut kept, mut standardised) = (vec![false; pairs.len()], vec![f64::NAN; pairs.len()]);
    for &(pair, id) in &observations {
        let row = solution.rows(id)?.start;
        kept[pair] = !solution.is_excluded(row);
        standardised[pair] = if kept[pair] { w[row] } else { f64::NAN };
    }
    let first_from_second = unit(solution.pose(pose)?);
    let cost = cost(pairs, &first_from_second);
    Ok(Minimum { first_from_second, cost, used: kept, standardised, vtpv: solution.vtpv() })
}

/// What an adjustment of conditions consists of.
struct Conditions {
    pose: adjust::BlockId,
    group: adjust::GroupId,
    /// Number of the pair, and its condition.
    observations: Vec<(usize, ObservationId)>,
}

/// The conditions of the pairs that are used, and a base of length one.
fn conditions(pairs: &[Pair], used: &[bool], start: &Isometry3<f64>) -> Result<(Adjustment<'static>, Conditions)> {
    let mut adjustment = Adjustment::new();
    let pose = adjustment.add_block(ParameterBlock::pose(start).named("relative pose"));
    let group = adjustment.add_group("conditions");
    let mut observations = Vec::with_capacity(pairs.len());
    for (index, pair) in pairs.iter().enumerate().filter(|(index, _)| used[*index]) {
        observations.push((index, EpipolarCondition::new(pair).add(&mut adjustment, group, pose)?));
    }
    hold_base(&mut adjustment, pose)?;
    Ok((adjustment, Conditions { pose, group, observations }))
}

/// Holds the base of a pose at length one.
pub(crate) fn hold_base(adjustment: &mut Adjustment<'_>, pose: adjust::BlockId) -> Result<()> {
    let base = Differentiated::new(adjustment, [pose], UnitBase).map_err(adjust::Error::from)?;
    Ok(adjustment.add_constraint(base)?)
}

/// The same with a base of length one.
fn unit(mut pose: Isometry3<f64>) -> Isometry3<f64> {
    pose.translation.vector.normalize_mut();
    pose
}
