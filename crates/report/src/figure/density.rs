//! Marks of charts of very many values, without those that would not be seen beside the others.

use std::collections::BTreeSet;

/// Marks from which on some are left out: more than a page of figures can have each, and below it every chart stays as it is.
const MANY: usize = 6000;
/// Side of a cell of which one dot is drawn, pixel of the figure: a third of a dot.
const CELL: f64 = 1.0;
/// Width of a column of a line that keeps its first, lowest, highest and last value, pixel of the figure: a quarter of the line.
const COLUMN: f64 = 0.5;

/// Dots, at most one in each cell: the first.
pub(crate) fn thin_dots(places: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    if places.len() <= MANY {
        return places;
    }
    let mut taken = BTreeSet::new();
    places.into_iter().filter(|place| taken.insert(place.map(|x| cell(x, CELL)))).collect()
}

/// The vertices of a line, gaps (NaN) with them: of those that follow each other in one column the first, the lowest, the
/// highest and the last, in their order. What is drawn covers the same pixels.
pub(crate) fn thin_line(places: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    if places.len() <= MANY {
        return places;
    }
    let mut thin = Vec::new();
    let same = |a: &[f64; 2], b: &[f64; 2]| column(a) == column(b);
    for run in places.chunk_by(same) {
        if !is_known(&run[0]) {
            thin.push(run[0]);
            continue;
        }
        let by_height = |a: &usize, b: &usize| run[*a][1].total_cmp(&run[*b][1]);
        let all = 0..run.len();
        let extremes = [all.clone().min_by(by_height), all.clone().max_by(by_height)].into_iter().flatten();
        let mut kept: Vec<usize> = [0, run.len() - 1].into_iter().chain(extremes).collect();
        kept.sort_unstable();
        kept.dedup();
        thin.extend(kept.into_iter().map(|index| run[index]));
    }
    thin
}

fn is_known(place: &[f64; 2]) -> bool {
    place.iter().all(|x| x.is_finite())
}

fn column(place: &[f64; 2]) -> Option<i64> {
    is_known(place).then(|| cell(place[0], COLUMN))
}

fn cell(x: f64, side: f64) -> i64 {
    (x / side).floor() as i64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_marks_stay() {
        let places: Vec<[f64; 2]> = (0..MANY).map(|k| [1e-3 * k as f64, 0.0]).collect();
        assert_eq!(thin_dots(places.clone()), places);
        assert_eq!(thin_line(places.clone()), places);
    }

    #[test]
    fn of_many_the_ends_extremes_and_gaps_are_drawn() {
        // 100,000 values over 500 pixels, one spike, one gap.
        let mut places: Vec<[f64; 2]> = (0..100_000).map(|k| [5e-3 * f64::from(k), 100.0 + f64::from(k % 7)]).collect();
        places[50_001][1] = 7.0;
        places[70_001][1] = f64::NAN;
        let line = thin_line(places.clone());
        assert!(line.len() <= 4 * 1000 + 6, "{}", line.len());
        assert_eq!((line.first(), line.last()), (places.first(), places.last()));
        assert!(line.contains(&places[50_001]));
        assert_eq!(line.iter().filter(|place| place[1].is_nan()).count(), 1);
        let dots = thin_dots(places);
        assert!(dots.len() < 500 * 9, "{}", dots.len());
    }
}
