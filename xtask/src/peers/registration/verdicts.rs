//! What is said of a pose: its covariance, and which motions the geometry leaves open.

use super::super::table::{Bars, Least, head, row};
use super::Stage;
use crate::shell::Outcome;

/// Pairs for the statistics of our covariance.
const PAIRS: &str = "200";
const SCENES: [&str; 2] = ["wall", "edge"];

pub(super) fn run(stage: &Stage, least: &mut Least, bars: &mut Bars) -> Outcome {
    println!("── covariance and degeneracy");
    least.note_all("covariance", &stage.peers("covariance", "medium", &[])?);
    let printed = stage.ours(&["covariance"], "medium", &[PAIRS])?;
    head(&["normalised squared error of 224x172 frames, 5.3 expected", "median", "median, scaled by residuals"]);
    for (who, name) in [("gicp_PLANE_ICP", "small_gicp point to plane"), ("gicp_GICP", "small_gicp GICP")] {
        row(name, &["plain", "scaled"].map(|figure| least.get("covariance", who, figure)));
    }
    row("`icp-registration`, frames", &[printed.get("median", 0)]);
    bars.at_least("covariance, mean normalised squared error", 4.0, printed.get("mean", 0));
    bars.at_most("covariance, mean normalised squared error", 8.0, printed.get("mean", 0));
    bars.at_least("covariance, share in ellipses of 95 %", 0.92, printed.get("covered", 0));
    bars.at_most("covariance, share in ellipses of 95 %", 0.98, printed.get("covered", 0));

    least.note_all("degenerate", &stage.peers("degenerate", "degenerate", &[])?);
    let printed = stage.ours(&["degenerate"], "degenerate", &[])?;
    head(&["off in open motions", "one wall: said sure", "mm", "wall and floor: said sure", "mm"]);
    for (who, name) in
        [("GICP", "small_gicp GICP"), ("VGICP", "small_gicp VGICP"), ("PLANE_ICP", "small_gicp point to plane")]
    {
        let figures = SCENES
            .map(|scene| ["converged", "mm"].map(|figure| least.get("degenerate", &format!("{who}_{scene}"), figure)));
        row(name, figures.as_flattened());
    }
    let figures = SCENES.map(|scene| [0, 1].map(|place| printed.get(scene, place)));
    row("`icp-registration`, frames", figures.as_flattened());
    for (scene, open, name) in [("wall", 3.0, "one wall"), ("edge", 1.0, "wall and floor")] {
        bars.at_most(&format!("{name}: motions called open"), open, printed.get(scene, 2));
        bars.at_least(&format!("{name}: motions called open"), open, printed.get(scene, 2));
        bars.at_most(&format!("{name}: mm off along the others"), 1.0, printed.get(scene, 3));
    }
    Ok(())
}
