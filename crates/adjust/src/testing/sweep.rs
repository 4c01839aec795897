//! Which gross errors are rejected from one solution.

use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::testing::outlier::Control;
use crate::{ObservationId, Rejection, SnoopingOptions, Solution};

impl Solution {
    /// The components to be rejected from this solution, at most `room`.
    pub(crate) fn batch(
        &self,
        tested: &[bool],
        snooping: &SnoopingOptions,
        room: usize,
        step: usize,
    ) -> Vec<Rejection> {
        let controls = self.controls();
        let rows = self.candidates(tested, snooping, room, &controls);
        if rows.is_empty() {
            return Vec::new();
        }
        let mut sweep = Sweep::new(self, &rows, &controls);
        let mut batch = Vec::new();
        while batch.len() < room {
            let critical = snooping.test.critical(snooping.level, sweep.vtpv, sweep.redundancy);
            let Some((index, w)) = sweep.largest(&rows, &controls, snooping.smallest_control) else { break };
            let statistic = w / critical.sigma0;
            if statistic.is_nan() || critical.value.is_nan() || statistic.abs() <= critical.value {
                break;
            }
            let row = rows[index];
            let observation = self.observation_of(row).unwrap_or_default();
            batch.push(Rejection {
                observation: ObservationId(observation),
                component: row - self.layout.observations[observation].row,
                statistic,
                critical: critical.value,
                residual: self.residuals()[row],
                redundancy_number: controls[row].share(),
                step,
            });
            sweep.remove(index);
        }
        batch
    }

    /// Rows that may be rejected, largest statistic first; none where the largest does not exceed the critical value.
    fn candidates(&self, tested: &[bool], snooping: &SnoopingOptions, room: usize, controls: &[Control]) -> Vec<usize> {
        let critical = snooping.test.critical(snooping.level, self.vtpv(), self.redundancy() as f64);
        // What is inconspicuous by far will hardly become guilty when others go; if so, the next solution shows it.
        let least = 0.5 * critical.value * critical.sigma0.min(1.0);
        let size = |row: usize| controls[row].statistic().abs();
        let testable = |&row: &usize| {
            let used = tested[row] && !self.is_excluded(row);
            used && controls[row].share() > snooping.smallest_control && size(row) > least
        };
        let mut rows: Vec<usize> = (0..controls.len()).filter(testable).collect();
        rows.sort_by(|&a, &b| size(b).total_cmp(&size(a)));
        let conspicuous = rows.partition_point(|&row| size(row) > critical.value * critical.sigma0);
        // Twice as many as may be rejected: the largest need not be the guilty.
        rows.truncate(if snooping.batch == 1 { conspicuous.min(1) } else { 2 * conspicuous.min(room) });
        rows
    }

    /// `P Q_vv P` among some rows.
    fn mutual_information(&self, rows: &[usize], controls: &[Control]) -> DMatrix<f64> {
        let designs: Vec<_> = rows.iter().map(|&row| self.weighted_design(row)).collect();
        let spread: Vec<_> = designs.par_iter().map(|design| self.spread(design)).collect();
        let shared = |i: usize, j: usize| designs[i].iter().map(|&(column, a)| a * spread[j][column]).sum::<f64>();
        let mut out = DMatrix::zeros(rows.len(), rows.len());
        for (i, &first) in rows.iter().enumerate() {
            for (j, &second) in rows.iter().enumerate().skip(i + 1) {
                let element = self.weight_between(first, second) - shared(i, j);
                (out[(i, j)], out[(j, i)]) = (element, element);
            }
            // The same number as in the test itself, to the last bit.
            out[(i, i)] = controls[first].information;
        }
        out
    }

    /// Element of P.
    fn weight_between(&self, first: usize, second: usize) -> f64 {
        let (Some(observation), Some(other)) = (self.observation_of(first), self.observation_of(second)) else {
            return 0.0;
        };
        if observation != other {
            return 0.0;
        }
        let place = &self.layout.observations[observation];
        let whitening = &self.whitening[self.whitening_start[observation]..];
        let element = |row: usize, column: usize| whitening[row * (row + 1) / 2 + column];
        let (a, b) = (first - place.row, second - place.row);
        (a.max(b)..place.dimension).map(|i| element(i, a) * element(i, b)).sum()
    }
}

/// Pulls and information of some components, while one after the other is removed.
struct Sweep {
    pulls: Vec<f64>,
    information: DMatrix<f64>,
    removed: Vec<bool>,
    vtpv: f64,
    redundancy: f64,
}

impl Sweep {
    fn new(solution: &Solution, rows: &[usize], controls: &[Control]) -> Self {
        Self {
            pulls: rows.iter().map(|&row| controls[row].pull).collect(),
            information: solution.mutual_information(rows, controls),
            removed: vec![false; rows.len()],
            vtpv: solution.vtpv(),
            redundancy: solution.redundancy() as f64,
        }
    }

    /// The component with the largest w among those that are still controlled, and its w.
    fn largest(&self, rows: &[usize], controls: &[Control], smallest: f64) -> Option<(usize, f64)> {
        let mut best: Option<(usize, f64)> = None;
        for (index, &row) in rows.iter().enumerate() {
            let information = self.information[(index, index)];
            if self.removed[index] || information <= smallest * controls[row].weight {
                continue;
            }
            let w = self.pulls[index] / information.sqrt();
            if best.is_none_or(|(_, largest)| w.abs() > largest.abs()) {
                best = Some((index, w));
            }
        }
        best
    }

    /// Gives the component an unknown error of its own, which is the same as removing it.
    fn remove(&mut self, index: usize) {
        self.removed[index] = true;
        let own = self.information[(index, index)];
        let column = self.information.column(index).into_owned();
        let pull = self.pulls[index];
        for (pull_of, shared) in self.pulls.iter_mut().zip(column.iter()) {
            *pull_of -= shared * pull / own;
        }
        self.information.ger(-1.0 / own, &column, &column, 1.0);
        self.vtpv -= pull * pull / own;
        self.redundancy -= 1.0;
    }
}
