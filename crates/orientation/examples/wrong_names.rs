//! Codes that were read wrongly, found by the stations that see the same targets: `wrong_names [SURVEYS] [SEED]`.
//!
//! Simulated surveys of two to five stations, with and without ranges, with a lens that is known and one that is not. For each kind: in how
//! many surveys without a wrong name one was doubted, and how often one name that another station sees elsewhere was found, told alone
//! or with others of its target.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

#[path = "../tests/common.rs"]
mod common;
#[path = "../tests/surveys.rs"]
mod surveys;

use surveys::{Kind, Tally};

fn main() {
    let mut arguments = std::env::args().skip(1).map(|word| word.parse().unwrap());
    let (surveys, seed): (u64, u64) = (arguments.next().unwrap_or(100), arguments.next().unwrap_or(1));
    println!(
        "| stations | ranges | lens | right surveys doubted | names checked | wrong found | told alone | right names doubted beside |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for stations in 2..=5 {
        for (with_ranges, is_nominal) in [(false, false), (true, false), (false, true), (true, true)] {
            let kind = Kind { stations, with_ranges, is_nominal };
            let tally = Tally::of(kind, surveys, seed);
            let Tally { doubted, checked, found, alone, wrong, beside } = tally;
            println!(
                "| {stations} | {} | {} | {doubted} of {surveys} | {:.1} % | {found} of {wrong} | {alone} | {beside} |",
                if with_ranges { "yes" } else { "no" },
                if is_nominal { "nominal" } else { "known" },
                100.0 * checked,
            );
        }
    }
}
