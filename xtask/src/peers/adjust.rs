//! Ceres' dense Schur on a problem of bundle adjustment in the large; OpenCV's calibration on its checkerboard.

use super::environment::{Environment, Example, Figures, capture, text};
use crate::shell::{Outcome, root};

pub(crate) fn run(runs: usize) -> Outcome {
    let environment = Environment::new("adjust")?;
    bundle(&environment, runs)?;
    checkerboard(&environment, runs)
}

fn bundle(environment: &Environment, runs: usize) -> Outcome {
    let Some(problem) = capture("bal/problem-16-22106-pre.txt") else { return Ok(()) };
    let problem = text(&problem);
    let example = Example::build("adjust", "bal")?;
    let (mut ours, mut peer) = (Vec::new(), Vec::new());
    for _ in 0..runs {
        ours.push(example.call(&[&problem])?);
        peer.push(environment.call("adjust_peers.py", &["bal", &problem])?);
    }
    let own = |name| ours.iter().map(|figures: &Figures| figures.get(name, 0)).fold(f64::INFINITY, f64::min);
    let theirs =
        |name: &str| peer.iter().map(|run| run[name].as_f64().unwrap_or(f64::NAN)).fold(f64::INFINITY, f64::min);
    println!("\n| 16 cameras, 22,106 points | cost | iterations | CPU s |\n|---|---|---|---|");
    println!(
        "| Ceres, dense Schur, one thread | {:.6e} | {} | {:.3} |",
        theirs("cost"),
        theirs("iterations"),
        theirs("seconds")
    );
    println!("| `adjust`, one thread | {:.6e} | {} | {:.3} |", own("cost"), own("iterations"), own("cpu_seconds"));
    println!("\nratio {:.2}", own("cpu_seconds") / theirs("seconds"));
    Ok(())
}

fn checkerboard(environment: &Environment, runs: usize) -> Outcome {
    let Some(images) = capture("opencv_left_chess") else { return Ok(()) };
    let table = text(&root().join("target/peers/corners.csv"));
    let opencv = environment.call("adjust_peers.py", &["corners", &text(&images), &table])?;
    let example = Example::build("adjust", "checkerboard")?;
    let mut seconds = f64::INFINITY;
    let mut ours = example.call(&[&table])?;
    for _ in 0..runs {
        seconds = seconds.min(ours.get("seconds", 0));
        ours = example.call(&[&table])?;
    }
    println!(
        "\n| checkerboard | OpenCV | `adjust` | difference / σ | σ, OpenCV | σ, `adjust` |\n|---|---|---|---|---|---|"
    );
    let figure = |name: &str, parameter: &str| opencv[name][parameter].as_f64().unwrap_or(f64::NAN);
    for name in ["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"] {
        let (value, sigma) = (ours.get(name, 0), ours.get(name, 1));
        let (theirs, stated) = (figure("parameters", name), figure("deviations_stated", name));
        println!(
            "| {name} | {theirs:.9} | {value:.9} | {:.1e} | {stated:.9} | {sigma:.9} |",
            (value - theirs).abs() / sigma
        );
    }
    let number = |name: &str| opencv[name].as_f64().unwrap_or(f64::NAN);
    println!("| rms, px | {:.6} | {:.6} | | | |", number("rms"), ours.get("rms", 0));
    println!("| sigma0, px | {:.6} | {:.6} | | | |", number("sigma0"), ours.get("sigma0", 0));
    println!("| CPU ms | {:.1} | {:.1} | | | |", 1e3 * number("seconds"), 1e3 * seconds);
    println!(
        "\nredundancy {}, {} observations with a standardised residual over 3.29",
        ours.get("redundancy", 0),
        ours.count("outlying")
    );
    Ok(())
}
