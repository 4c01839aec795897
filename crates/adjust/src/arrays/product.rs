//! Products of small blocks: the inner loops of all sums over observations and eliminated blocks.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

/// Left factor: `inner` rows of `rows` consecutive elements, `stride` apart; it enters transposed.
#[derive(Clone, Copy)]
pub(crate) struct Left<'m> {
    pub(crate) data: &'m [f64],
    pub(crate) stride: usize,
    pub(crate) rows: usize,
}

/// Right factor: element (k, j) lies at `k · inner + j · column`.
#[derive(Clone, Copy)]
pub(crate) struct Right<'m> {
    pub(crate) data: &'m [f64],
    pub(crate) inner: usize,
    pub(crate) column: usize,
    pub(crate) columns: usize,
}

/// `out[j · stride + i] += factor · Σ_k left[k][i] · right[k][j]` with k below `inner`. Sums run over k in order, so that
/// the width of the machine's registers has no influence on the bits.
#[inline(always)]
pub(crate) fn add_product(out: &mut [f64], stride: usize, left: Left<'_>, right: Right<'_>, inner: usize, factor: f64) {
    if right.columns == 0 || inner == 0 {
        return;
    }
    let mut row = 0;
    while left.rows > row {
        let (out, left) = (&mut out[row..], Left { data: &left.data[row..], ..left });
        row += match left.rows - row {
            1 => strip::<1>(out, stride, left, right, inner, factor),
            2 => strip::<2>(out, stride, left, right, inner, factor),
            3 => strip::<3>(out, stride, left, right, inner, factor),
            4 | 5 => strip::<4>(out, stride, left, right, inner, factor),
            6 | 7 => strip::<6>(out, stride, left, right, inner, factor),
            9 => strip::<9>(out, stride, left, right, inner, factor),
            _ => strip::<8>(out, stride, left, right, inner, factor),
        };
    }
}

/// `R` rows of the product; gives their number.
#[inline(always)]
fn strip<const R: usize>(
    out: &mut [f64],
    stride: usize,
    left: Left<'_>,
    right: Right<'_>,
    inner: usize,
    factor: f64,
) -> usize {
    for j in 0..right.columns {
        let Some(target) = out[j * stride..].first_chunk_mut::<R>() else { return R };
        let mut sum = *target;
        for k in 0..inner {
            let Some(row) = left.data[k * left.stride..].first_chunk::<R>() else { return R };
            let share = factor * right.data[k * right.inner + j * right.column];
            for i in 0..R {
                sum[i] += share * row[i];
            }
        }
        *target = sum;
    }
    R
}

/// Runs a piece of work, with everything in it that is inlined, compiled for the widest registers that the machine has.
/// Products and sums stay separate operations, so that all machines give the same bits.
#[cfg(feature = "faer")]
pub(crate) fn with_wide_registers<R>(work: impl FnOnce() -> R) -> R {
    pulp::Arch::new().dispatch(work)
}

/// The same bits with the registers that every machine has.
#[cfg(not(feature = "faer"))]
#[inline]
pub(crate) fn with_wide_registers<R>(work: impl FnOnce() -> R) -> R {
    work()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_shapes_agree_with_the_definition() {
        for rows in [1, 2, 3, 5, 6, 9, 17] {
            for inner in [1, 2, 3, 4, 6, 9] {
                let columns = 4;
                let data: Vec<f64> = (0..inner * 20).map(|i| (f64::from(i) * 0.7).sin()).collect();
                let right: Vec<f64> = (0..inner * 5).map(|i| (f64::from(i) * 1.3).cos()).collect();
                let inner = inner as usize;
                let mut out = vec![1.0; columns * 21];
                let left = Left { data: &data, stride: 20, rows };
                let factors = Right { data: &right, inner: 5, column: 1, columns };
                add_product(&mut out, 21, left, factors, inner, -0.5);
                for j in 0..columns {
                    for i in 0..21 {
                        let sum: f64 =
                            (0..inner).map(|k| data[(k * 20 + i).min(data.len() - 1)] * right[k * 5 + j]).sum();
                        let expected = if i < rows { 1.0 - 0.5 * sum } else { 1.0 };
                        // Nine products of numbers below one.
                        assert!((out[j * 21 + i] - expected).abs() < 1e-14);
                    }
                }
            }
        }
    }
}
