//! Sums of weighted products of numbers that belong together.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]
// Lanes lie side by side: with an index, loops read as their formulas and have the same length everywhere.
#![allow(clippy::needless_range_loop)]

/// Numbers of a row.
pub(crate) const ROW: usize = 24;
/// Rows and columns that are summed up at a time: what a thread's registers hold.
const TILE: usize = 8;
/// Rows taken at a time, which then lie in the nearest cache.
const ROWS: usize = 32;

/// `Σ w x xᵀ` over rows x with their weights w.
pub(crate) fn weighted_products(rows: impl Iterator<Item = ([f64; ROW], f64)>) -> [[f64; ROW]; ROW] {
    let mut sums = [[0.0; ROW]; ROW];
    let (mut batch, mut weighted, mut count) = ([[0.0; ROW]; ROWS], [[0.0; ROW]; ROWS], 0);
    for (row, weight) in rows {
        (batch[count], weighted[count]) = (row, row.map(|value| weight * value));
        count += 1;
        if count == ROWS {
            pulp::Arch::new().dispatch(Add { batch: &batch, weighted: &weighted, sums: &mut sums });
            count = 0;
        }
    }
    weighted[count..].fill([0.0; ROW]);
    batch[count..].fill([0.0; ROW]);
    pulp::Arch::new().dispatch(Add { batch: &batch, weighted: &weighted, sums: &mut sums });
    for r in 0..ROW {
        for c in 0..r {
            sums[r][c] = sums[c][r];
        }
    }
    sums
}

struct Add<'a> {
    batch: &'a [[f64; ROW]; ROWS],
    weighted: &'a [[f64; ROW]; ROWS],
    sums: &'a mut [[f64; ROW]; ROW],
}

impl pulp::WithSimd for Add<'_> {
    type Output = ();

    /// Tiles on and above the diagonal.
    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self { batch, weighted, sums } = self;
        for first_row in (0..ROW).step_by(TILE) {
            for first_column in (first_row..ROW).step_by(TILE) {
                let mut tile = [[0.0; TILE]; TILE];
                for k in 0..ROWS {
                    let mut row = [0.0; TILE];
                    row.copy_from_slice(&batch[k][first_column..first_column + TILE]);
                    let factors = &weighted[k][first_row..first_row + TILE];
                    for i in 0..TILE {
                        for j in 0..TILE {
                            tile[i][j] += factors[i] * row[j];
                        }
                    }
                }
                for i in 0..TILE {
                    for j in 0..TILE {
                        sums[first_row + i][first_column + j] += tile[i][j];
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_those_of_a_plain_sum() {
        for count in [0, 1, ROWS, 3 * ROWS + 5] {
            let row = |k: usize| std::array::from_fn(|i| ((k * 31 + i * 7) as f64 * 0.37).sin());
            let rows: Vec<([f64; ROW], f64)> = (0..count).map(|k| (row(k), (k as f64 * 0.1).cos().abs())).collect();
            let found = weighted_products(rows.iter().copied());
            for r in 0..ROW {
                for c in 0..ROW {
                    let expected: f64 = rows.iter().map(|(row, weight)| weight * row[r] * row[c]).sum();
                    assert!((found[r][c] - expected).abs() <= 1e-12 * (1.0 + count as f64), "{r} {c}");
                }
            }
        }
    }
}
