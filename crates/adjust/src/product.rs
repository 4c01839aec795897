//! Products of small blocks: the inner loops of all sums over observations and eliminated blocks.

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

/// `out[j · stride + i] += factor · Σ_k left[k][i] · right[k][j]` with k below `inner`.
#[inline]
pub(crate) fn add_product(out: &mut [f64], stride: usize, left: Left<'_>, right: Right<'_>, inner: usize, factor: f64) {
    match (left.rows, inner) {
        (3, 2) => fixed::<3, 2>(out, stride, left, right, factor),
        (3, 3) => fixed::<3, 3>(out, stride, left, right, factor),
        (6, 2) => fixed::<6, 2>(out, stride, left, right, factor),
        (6, 3) => fixed::<6, 3>(out, stride, left, right, factor),
        (6, 6) => fixed::<6, 6>(out, stride, left, right, factor),
        (9, 2) => fixed::<9, 2>(out, stride, left, right, factor),
        (9, 3) => fixed::<9, 3>(out, stride, left, right, factor),
        (9, 9) => fixed::<9, 9>(out, stride, left, right, factor),
        _ => general(out, stride, left, right, inner, factor),
    }
}

#[inline]
fn fixed<const R: usize, const K: usize>(
    out: &mut [f64],
    stride: usize,
    left: Left<'_>,
    right: Right<'_>,
    factor: f64,
) {
    let mut rows = [[0.0; R]; K];
    for (k, row) in rows.iter_mut().enumerate() {
        let Some(values) = left.data[k * left.stride..].first_chunk::<R>() else { return };
        *row = *values;
    }
    for j in 0..right.columns {
        let Some(target) = out[j * stride..].first_chunk_mut::<R>() else { return };
        let mut sum = *target;
        for (k, row) in rows.iter().enumerate() {
            let share = factor * right.data[k * right.inner + j * right.column];
            for i in 0..R {
                sum[i] += share * row[i];
            }
        }
        *target = sum;
    }
}

fn general(out: &mut [f64], stride: usize, left: Left<'_>, right: Right<'_>, inner: usize, factor: f64) {
    let n = left.rows;
    for j in 0..right.columns {
        let target = &mut out[j * stride..j * stride + n];
        let share = |k: usize| factor * right.data[k * right.inner + j * right.column];
        let row = |k: usize| &left.data[k * left.stride..k * left.stride + n];
        let mut k = 0;
        // Three at a time: the target is loaded and stored once for them.
        while k + 3 <= inner {
            let (a, b, c) = (share(k), share(k + 1), share(k + 2));
            let rows = row(k).iter().zip(row(k + 1)).zip(row(k + 2));
            target.iter_mut().zip(rows).for_each(|(t, ((x, y), z))| *t += a * x + b * y + c * z);
            k += 3;
        }
        while k < inner {
            let a = share(k);
            target.iter_mut().zip(row(k)).for_each(|(t, x)| *t += a * x);
            k += 1;
        }
    }
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
