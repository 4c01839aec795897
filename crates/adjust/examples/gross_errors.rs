//! A levelling network of twelve marks with two instruments: one reading slipped by a decimetre, and the second
//! instrument is three times worse than stated. Finds the reading, estimates the variance components, says how well the
//! readings check each other, whether a staff constant is significant, and what is hardly determined.
#![allow(clippy::print_stdout)]

use adjust::{
    Adjustment, BlockId, Covariance, LinearObservation, ParameterBlock, ReliabilityOptions, Scale, SnoopingOptions,
    SolveOptions, VarianceComponentOptions, VarianceFactor, WeaknessOptions,
};

const MARKS: usize = 12;
const SIGMA_M: f64 = 0.001;

/// Noise of unit size without a generator: a fixed sequence that is spread like a normal one.
fn noise(index: usize) -> f64 {
    let uniform = |factor: f64| (0.5 + factor * index as f64).fract().max(1e-9);
    (-2.0 * uniform(0.754_877_666).ln()).sqrt() * (std::f64::consts::TAU * uniform(0.569_840_291)).cos()
}

fn main() -> Result<(), adjust::Error> {
    let mut network = Adjustment::new();
    let heights: Vec<BlockId> = (0..MARKS)
        .map(|mark| network.add_block(ParameterBlock::euclidean([0.0]).named(format!("mark {mark}"))))
        .collect();
    let staff = network.add_block(ParameterBlock::euclidean([0.0]).named("staff constant"));
    network.hold(heights[0])?;
    let instruments = [network.add_group("instrument A"), network.add_group("instrument B")];

    let mut readings = 0;
    for from in 0..MARKS {
        for to in (from + 1..MARKS).filter(|to| (from + to) % 3 != 0) {
            let second = readings % 2;
            let error = SIGMA_M * noise(readings) * if second == 1 { 3.0 } else { 1.0 };
            let slip = if readings == 20 { 0.1 } else { 0.0 };
            let difference = 0.2 * (to as f64 - from as f64) + error + slip;
            // The staff constant enters where the two staffs are not the same one.
            let terms = [(heights[to], [1.0]), (heights[from], [-1.0]), (staff, [f64::from((to % 2) as u8)])];
            let reading = LinearObservation::new(difference, terms);
            network.add_observation(instruments[second], reading, &Covariance::from_sigma(SIGMA_M))?;
            readings += 1;
        }
    }

    let options = SolveOptions::default();
    let plain = network.solve(&options)?;
    println!("{readings} readings, sigma0 {:.2} with the slip", plain.sigma0().unwrap_or(f64::NAN));

    // Instrument B is not known well enough for a test at its stated precision: the largest only.
    let largest_only = SnoopingOptions { max_rejections: Some(1), ..SnoopingOptions::default() };
    let found = network.solve_snooping(&options, &largest_only)?;
    for one in &found.rejected {
        println!(
            "rejected: reading {}, w = {:.1} (critical {:.2}), residual {:.1} mm, redundancy number {:.2}",
            one.observation.index(),
            one.statistic,
            one.critical,
            1000.0 * one.residual,
            one.redundancy_number
        );
    }

    let components =
        network.estimate_variance_components(&instruments, &options, &VarianceComponentOptions::default())?;
    for one in &components.components {
        println!(
            "{}: standard deviations are {:.2} times those stated (variance factor {:.2} ± {:.2}, redundancy {:.1})",
            one.name,
            one.factor.sqrt(),
            one.factor,
            one.deviation,
            one.redundancy
        );
    }

    let cleaned = network.solve_snooping(&options, &SnoopingOptions::default())?;
    println!("with these variances {} readings are rejected besides: {:?}", cleaned.rejected.len(), cleaned.end);
    let solution = cleaned.solution;
    let reliability = solution.reliability(&ReliabilityOptions::default())?;
    let worst = reliability.iter().map(|one| one.smallest_detectable).fold(0.0, f64::max);
    println!("a slip of {:.1} mm would be found in any reading (80 %)", 1000.0 * worst);
    let constant = solution.significance(&[(staff, 0)], Scale::Posterior)?;
    let criteria = solution.information_criteria(VarianceFactor::Known)?;
    println!("staff constant: t = {:.2}, p = {:.3}; BIC {:.1}", constant.statistic, constant.p_value, criteria.bic);
    let weak = solution.near_defects(&WeaknessOptions { inflation: 3.0, ..WeaknessOptions::default() })?;
    println!("largest inflation {:.1}", weak.largest_inflation);
    for one in &weak.combinations {
        println!("{one}");
    }
    Ok(())
}
