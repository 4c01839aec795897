//! Critical values of tests at a level of one in a million, and several tests at a time.

use statistics::{Distribution, bonferroni, holm, robust_standard_deviation};

#[allow(clippy::print_stdout)]
fn main() {
    let level = 1e-6;
    for (name, distribution) in [
        ("normal", Distribution::Normal),
        ("chi-squared, 7 degrees of freedom", Distribution::ChiSquared { dof: 7.0 }),
        ("Student, 20 degrees of freedom", Distribution::StudentT { dof: 20.0 }),
    ] {
        println!("{name}: {:.4}", distribution.critical(level));
    }
    let p_values = [0.012, 0.3, 0.004];
    println!("single tests of {p_values:?} at a joint level of 5 %: {:.4}", bonferroni(0.05, p_values.len()));
    println!("after Holm: {:?}", holm(&p_values));
    println!("deviation with a gross error: {:.3}", robust_standard_deviation(&[1.0, 1.2, 0.9, 1.1, 9.0]));
}
