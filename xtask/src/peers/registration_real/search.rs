//! The peers' best settings on pairs that nobody is judged by.

use super::judge::Runs;
use super::{Pair, Stage};

/// Down-sampling, m.
const VOXELS: [&str; 5] = ["0.025", "0.05", "0.08", "0.12", "0.16"];
/// Farthest neighbours, m; for VGICP, the cells.
const REACHES: [&str; 4] = ["0.1", "0.3", "0.5", "1.0"];
const CELLS: [&str; 4] = ["0.1", "0.15", "0.25", "0.4"];
/// Open3D's finest of three scales, m.
const SCALES: [&str; 3] = ["0.02", "0.03", "0.05"];
pub(super) const PROJECTIVE: &str = "projective";

/// By name and in words: of `small_gicp` the setting that is most often right and the fastest that is as often right; of
/// Open3D's scales those most often right; Open3D's odometry.
pub(super) fn settings(stage: &Stage, pairs: &[Pair]) -> Result<Vec<(String, String)>, String> {
    println!("── settings");
    let (grid, scales) = (grid(), SCALES.map(|scale| format!("multi:{scale}")));
    let asked: Vec<&str> = grid.iter().chain(&scales).map(String::as_str).collect();
    let runs = stage.align("dense_kitchen", pairs, &asked, false)?;
    for who in &asked {
        println!("{who}: {} of {} right, {:.1} ms", runs.right(who), pairs.len(), runs.mean_ms(who));
    }
    let [best, fastest] = best_and_fastest(&runs, &grid);
    let [scale, _] = best_and_fastest(&runs, &scales);
    let mut chosen = vec![(best.clone(), format!("{}, most often right", words(&best)))];
    if fastest == best {
        chosen[0].1.push_str(", and the fastest as often right");
    } else {
        chosen.push((fastest.clone(), format!("{}, fastest as often right", words(&fastest))));
    }
    chosen.push((scale.clone(), words(&scale)));
    chosen.push((PROJECTIVE.to_owned(), "Open3D projective, 10-15-30 iterations (never in doubt)".to_owned()));
    Ok(chosen)
}

fn grid() -> Vec<String> {
    let of = |kind: &'static str, lengths: [&'static str; 4]| {
        let settings = move |voxel| lengths.map(|length| format!("{kind}:{voxel}:{length}"));
        VOXELS.into_iter().flat_map(settings)
    };
    of("gicp", REACHES).chain(of("plane", REACHES)).chain(of("vgicp", CELLS)).collect()
}

/// Most often right, of equals the fastest; and the fastest that is as often right but for the standard deviation of
/// such a count.
fn best_and_fastest(runs: &Runs, names: &[String]) -> [String; 2] {
    let faster = |a: &&String, b: &&String| runs.mean_ms(a).total_cmp(&runs.mean_ms(b));
    let by_right = |a: &&String, b: &&String| runs.right(a).cmp(&runs.right(b)).then_with(|| faster(b, a));
    let best = names.iter().max_by(by_right).cloned().unwrap_or_default();
    let (right, all) = (runs.right(&best) as f64, runs.of(&best).len() as f64);
    let least = right - (right * (1.0 - right / all)).sqrt();
    let fastest = names.iter().filter(|name| runs.right(name) as f64 >= least).min_by(faster).cloned();
    [best.clone(), fastest.unwrap_or(best)]
}

/// A setting as people read it.
fn words(setting: &str) -> String {
    let centimetres = |metres: &str| metres.parse().map_or(f64::NAN, |metres: f64| 100.0 * metres);
    match setting.split(':').collect::<Vec<_>>().as_slice() {
        ["vgicp", voxel, cell] => {
            format!("small_gicp VGICP, {:.1} cm, cells {:.0} cm", centimetres(voxel), centimetres(cell))
        }
        ["gicp", voxel, reach] => {
            format!("small_gicp GICP, {:.1} cm, reach {:.0} cm", centimetres(voxel), centimetres(reach))
        }
        ["plane", voxel, reach] => {
            format!("small_gicp point to plane, {:.1} cm, reach {:.0} cm", centimetres(voxel), centimetres(reach))
        }
        ["multi", voxel] => format!("Open3D multi-scale point to plane, down to {:.0} cm", centimetres(voxel)),
        _ => setting.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fastest_within_the_counts_scatter_is_found() {
        let rows = |right: usize, ms: f64| -> Vec<[f64; 6]> {
            (0..100).map(|k| [ms, 0.1, if k < right { 1.0 } else { 900.0 }, 1.0, 1.0, 10.0]).collect()
        };
        let told = serde_json::json!({"slow": rows(90, 80.0), "quick": rows(88, 20.0), "poor": rows(70, 5.0), "slower": rows(90, 90.0)});
        let mut runs = Runs::default();
        runs.add_peers(&told);
        let names = ["slow", "quick", "poor", "slower"].map(str::to_owned);
        assert_eq!(best_and_fastest(&runs, &names), ["slow", "quick"]);
    }

    #[test]
    fn settings_are_put_into_words() {
        assert_eq!(grid().len(), 60);
        assert_eq!(words("gicp:0.08:0.3"), "small_gicp GICP, 8.0 cm, reach 30 cm");
        assert_eq!(words("vgicp:0.025:0.15"), "small_gicp VGICP, 2.5 cm, cells 15 cm");
        assert_eq!(words("multi:0.03"), "Open3D multi-scale point to plane, down to 3 cm");
    }
}
