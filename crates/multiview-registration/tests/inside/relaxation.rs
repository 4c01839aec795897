use nalgebra::dvector;

use super::*;

/// Steps of an iteration that multiplies what is off by `slope` each time.
fn off_after(slope: f64, rounds: usize) -> f64 {
    let (mut relaxation, mut off) = (Relaxation::default(), dvector![1.0, -0.5]);
    for _ in 0..rounds {
        let step = (slope - 1.0) * &off;
        off += relaxation.share(step.clone()) * step;
    }
    off.norm()
}

#[test]
fn steps_that_undo_each_other_end_between() {
    assert!(off_after(-1.0, 3) < 1e-12, "{}", off_after(-1.0, 3));
    // Without it, these would grow.
    assert!(off_after(-1.5, 3) < 1e-12, "{}", off_after(-1.5, 3));
}

#[test]
fn steps_that_do_not_turn_back_are_taken_whole() {
    assert!((off_after(0.5, 3) - 0.125 * 1.25_f64.sqrt()).abs() < 1e-12);
    assert!((off_after(1.5, 3) - 1.5_f64.powi(3) * 1.25_f64.sqrt()).abs() < 1e-12);
    // The same step again and again, and none at all.
    let mut relaxation = Relaxation::default();
    for step in [dvector![1.0], dvector![1.0], dvector![0.0], dvector![0.0]] {
        assert!((relaxation.share(step) - 1.0).abs() < 1e-15);
    }
}
