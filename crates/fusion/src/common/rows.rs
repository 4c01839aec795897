//! Derivatives of heights by common errors, column by column.

use nalgebra::{DMatrix, Vector3};
use point_uncertainty::{CommonErrors, PointErrors};

use crate::Result;
use crate::input::{Observation, derivatives};
use crate::surfels::{Estimate, FrameSums};

/// Column and derivative, in ascending order of the columns.
pub(crate) type Row = Vec<(u32, f64)>;

/// For each frame of a place the derivative of the height that it sees.
///
/// Common errors vary slowly: the point next to the middle stands for all of its frame. Where they are to be found, the `normal` must not be
/// that of the place's own points: its noise, squared, would tell how frames moved along a surface, which nothing tells.
pub(crate) fn rows(
    place: &Estimate,
    normal: &Vector3<f64>,
    all: &[Observation],
    errors: &dyn PointErrors,
    common: &CommonErrors,
) -> Result<Vec<Row>> {
    let mut buffer = Vec::new();
    place
        .frames
        .iter()
        .map(|frame| {
            derivatives(all[frame.stands_for as usize].index as usize, errors, common, &mut buffer)?;
            let mut row: Row = buffer.iter().map(|(column, by)| (*column as u32, by.dot(normal))).collect();
            row.sort_by_key(|(column, _)| *column);
            row.dedup_by(|next, kept| {
                let is_same = next.0 == kept.0;
                if is_same {
                    kept.1 += next.1;
                }
                is_same
            });
            Ok(row)
        })
        .collect()
}

/// The frames of a place that move alike taken as one: what they differ by tells nothing of common errors, and what is wrong with a
/// place is wrong with all of them, which so many independent frames would hide. `None` where no two do.
pub(crate) fn by_station(place: &Estimate, rows: &[Row]) -> Option<(Estimate, Vec<Row>)> {
    let is_same = |a: &Row, b: &Row| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.0 == b.0);
    if !rows.iter().enumerate().any(|(at, row)| rows[..at].iter().any(|other| is_same(other, row))) {
        return None;
    }
    let mut merged: Vec<(FrameSums, Row)> = Vec::new();
    for (frame, row) in place.frames.iter().zip(rows) {
        match merged.iter_mut().find(|(_, other)| is_same(other, row)) {
            Some((first, mean)) => {
                let share = frame.normal[(0, 0)] / (first.normal[(0, 0)] + frame.normal[(0, 0)]);
                mean.iter_mut().zip(row).for_each(|((_, mean), (_, by))| *mean += share * (by - *mean));
                first.include(frame);
            }
            None => merged.push((frame.clone(), row.clone())),
        }
    }
    let (frames, rows) = merged.into_iter().unzip();
    Some((Estimate { frames, ..place.clone() }, rows))
}

/// The derivative of the mean height.
pub(crate) fn mean(place: &Estimate, rows: &[Row]) -> Row {
    let mut all: Vec<(u32, f64)> = Vec::with_capacity(rows.iter().map(Vec::len).sum());
    for (frame, row) in place.frames.iter().zip(rows) {
        let share = frame.normal[(0, 0)] / place.weight;
        all.extend(row.iter().map(|(column, by)| (*column, by * share)));
    }
    summed(all)
}

/// `(a − b) · factor`.
pub(crate) fn difference(a: &Row, b: &Row, factor: f64) -> Row {
    let b = b.iter().map(|(column, by)| (*column, -by * factor));
    summed(a.iter().map(|(column, by)| (*column, by * factor)).chain(b).collect())
}

fn summed(mut all: Row) -> Row {
    all.sort_by_key(|(column, _)| *column);
    all.dedup_by(|next, kept| {
        let is_same = next.0 == kept.0;
        if is_same {
            kept.1 += next.1;
        }
        is_same
    });
    all
}

/// `aᵀ C b`.
pub(crate) fn form(a: &Row, b: &Row, covariance: &DMatrix<f64>) -> f64 {
    a.iter()
        .map(|(row, first)| {
            let with: f64 =
                b.iter().map(|(column, second)| covariance[(*column as usize, *row as usize)] * second).sum();
            first * with
        })
        .sum()
}
