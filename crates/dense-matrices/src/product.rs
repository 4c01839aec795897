//! Products of small blocks: the inner loops of all sums over observations and eliminated blocks.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

/// Left factor: `inner` rows of `rows` consecutive elements, `stride` apart; it enters transposed.
#[derive(Clone, Copy)]
pub struct Left<'m> {
    /// The elements.
    pub data: &'m [f64],
    /// From row to row.
    pub stride: usize,
    /// Length of a row, which is a column of the transposed.
    pub rows: usize,
}

/// Right factor: element (k, j) lies at `k · inner + j · column`.
#[derive(Clone, Copy)]
pub struct Right<'m> {
    /// The elements.
    pub data: &'m [f64],
    /// From one summand to the next.
    pub inner: usize,
    /// From column to column.
    pub column: usize,
    /// Number of columns.
    pub columns: usize,
}

/// `out[j · stride + i] += factor · Σ_k left[k][i] · right[k][j]` with k below `inner`. Sums run over k in order, so that
/// the width of the machine's registers has no influence on the bits. Where a slice is too short all of `out` becomes NaN.
#[inline(always)]
pub fn add_product(out: &mut [f64], stride: usize, left: Left<'_>, right: Right<'_>, inner: usize, factor: f64) {
    if right.columns == 0 || inner == 0 {
        return;
    }
    if rows_of_product(out, stride, left, right, inner, factor).is_none() {
        out.fill(f64::NAN);
    }
}

/// `None` where a slice ends before the product does.
#[inline(always)]
fn rows_of_product(
    out: &mut [f64],
    stride: usize,
    left: Left<'_>,
    right: Right<'_>,
    inner: usize,
    factor: f64,
) -> Option<()> {
    let mut row = 0;
    while left.rows > row {
        let (out, left) = (out.get_mut(row..)?, Left { data: left.data.get(row..)?, ..left });
        row += match left.rows - row {
            1 => strip::<1>(out, stride, left, right, inner, factor),
            2 => strip::<2>(out, stride, left, right, inner, factor),
            3 => strip::<3>(out, stride, left, right, inner, factor),
            4 | 5 => strip::<4>(out, stride, left, right, inner, factor),
            6 | 7 => strip::<6>(out, stride, left, right, inner, factor),
            9 => strip::<9>(out, stride, left, right, inner, factor),
            _ => strip::<8>(out, stride, left, right, inner, factor),
        }?;
    }
    Some(())
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
) -> Option<usize> {
    for j in 0..right.columns {
        let target = out.get_mut(j * stride..)?.first_chunk_mut::<R>()?;
        let mut sum = *target;
        for k in 0..inner {
            let row = left.data.get(k * left.stride..)?.first_chunk::<R>()?;
            let share = factor * right.data.get(k * right.inner + j * right.column)?;
            for i in 0..R {
                sum[i] += share * row[i];
            }
        }
        *target = sum;
    }
    Some(R)
}

/// Runs a piece of work, with everything in it that is inlined, compiled for the widest registers that the machine has.
/// Products and sums stay separate operations, so that all machines give the same bits.
#[cfg(feature = "faer")]
pub fn with_wide_registers<R>(work: impl FnOnce() -> R) -> R {
    pulp::Arch::new().dispatch(work)
}

/// The same bits with the registers that every machine has.
#[cfg(not(feature = "faer"))]
#[inline]
pub fn with_wide_registers<R>(work: impl FnOnce() -> R) -> R {
    work()
}
