//! Inner loops over pixels, compiled for the widest registers that the machine has. Products and sums stay separate
//! operations in a fixed order, so that all machines give the same bits.
// Only what is inlined is compiled for wide registers; loops over lines read as their formulas.
#![allow(clippy::inline_always, clippy::needless_range_loop)]

use fourier_transforms::num_complex::Complex;

/// Values that are worked side by side.
pub(crate) const LANES: usize = 8;

/// Three weighted sums of rows that lie one after the other, each `width` long; one after the other in `sums`, whatever was there. Four
/// rows are taken at a time, to write the sums less often.
#[inline(always)]
pub(crate) fn sum_rows(rows: &[f32], weights: &[[f32; 3]], width: usize, sums: &mut [f32]) {
    let (first, rest) = sums.split_at_mut(width);
    let (second, third) = rest.split_at_mut(width);
    let mut sums = [first, second, &mut third[..width]];
    let (mut begun, done) = (false, rows.len() / (4 * width));
    for (rows, weights) in rows.chunks_exact(4 * width).zip(weights.as_chunks::<4>().0) {
        if begun {
            add_four::<false>(rows, weights, &mut sums)
        } else {
            add_four::<true>(rows, weights, &mut sums)
        }
        begun = true;
    }
    for (row, weights) in rows.chunks_exact(width).zip(weights).skip(4 * done) {
        if begun {
            add_one::<false>(row, weights, &mut sums)
        } else {
            add_one::<true>(row, weights, &mut sums)
        }
        begun = true;
    }
}

/// Adds four rows to three lines, each by its own weights; the first ones take the place of what was there.
#[inline(always)]
fn add_four<const FIRST: bool>(rows: &[f32], weights: &[[f32; 3]; 4], [x, y, z]: &mut [&mut [f32]; 3]) {
    let width = x.len();
    let [a, b, c, d] = [0, 1, 2, 3].map(|row| &rows[row * width..][..width]);
    let (y, z) = (&mut y[..width], &mut z[..width]);
    for i in 0..width {
        let sum = |tap: usize| {
            let [first, second, third, fourth] = weights.map(|weights| weights[tap]);
            (first * a[i] + second * b[i]) + (third * c[i] + fourth * d[i])
        };
        x[i] = if FIRST { sum(0) } else { x[i] + sum(0) };
        y[i] = if FIRST { sum(1) } else { y[i] + sum(1) };
        z[i] = if FIRST { sum(2) } else { z[i] + sum(2) };
    }
}

/// The same with one row.
#[inline(always)]
fn add_one<const FIRST: bool>(row: &[f32], weights: &[f32; 3], [x, y, z]: &mut [&mut [f32]; 3]) {
    let width = x.len();
    let (row, y, z) = (&row[..width], &mut y[..width], &mut z[..width]);
    for i in 0..width {
        let part = weights.map(|weight| weight * row[i]);
        x[i] = if FIRST { part[0] } else { x[i] + part[0] };
        y[i] = if FIRST { part[1] } else { y[i] + part[1] };
        z[i] = if FIRST { part[2] } else { z[i] + part[2] };
    }
}

/// Sum of up to three lines, as many as there are.
#[inline(always)]
pub(crate) fn add_lines(lines: [Option<&[f32]>; 3], sum: &mut [f32]) {
    if let [Some(first), Some(second), Some(third)] = lines {
        for (sum, ((first, second), third)) in sum.iter_mut().zip(first.iter().zip(second).zip(third)) {
            *sum = first + second + third;
        }
        return;
    }
    sum.fill(0.0);
    for line in lines.into_iter().flatten() {
        for (sum, value) in sum.iter_mut().zip(line) {
            *sum += value;
        }
    }
}

/// Sums pixels, `spacing` in a cell, into the three nodes of each cell. The lines go on for [`LANES`] beyond the last cell.
#[inline(always)]
pub(crate) fn collect(lines: [&[f32]; 2], weights: &[[f32; LANES]; 3], spacing: usize, nodes: &mut [Complex<f32>]) {
    nodes.fill(Complex::new(0.0, 0.0));
    let cells = nodes.len() - 2;
    for cell in 0..cells {
        let [Some(re), Some(im)] = lines.map(|line| line[cell * spacing..].first_chunk::<LANES>()) else { return };
        for (node, weights) in nodes[cell..].iter_mut().zip(weights) {
            *node += Complex::new(dot(re, weights), dot(im, weights));
        }
    }
}

#[inline(always)]
fn dot(a: &[f32; LANES], b: &[f32; LANES]) -> f32 {
    let mut products = [0.0; LANES];
    for i in 0..LANES {
        products[i] = a[i] * b[i];
    }
    let pair = |i: usize| products[i] + products[i + 4];
    (pair(0) + pair(2)) + (pair(1) + pair(3))
}

/// Interpolates a row of nodes at its pixels, times `factor`; the inverse way of [`collect`].
#[inline(always)]
pub(crate) fn spread(
    nodes: &[Complex<f32>],
    factor: f32,
    weights: &[[f32; LANES]; 3],
    spacing: usize,
    lines: [&mut [f32]; 2],
) {
    let [re, im] = lines;
    for (cell, nodes) in nodes.windows(3).enumerate() {
        let start = cell * spacing;
        let lanes = [&mut *re, &mut *im].map(|line| line[start..].first_chunk_mut::<LANES>());
        let [Some(re), Some(im)] = lanes else { return };
        let [a, b, c] = [nodes[0] * factor, nodes[1] * factor, nodes[2] * factor];
        for i in 0..LANES {
            re[i] = weights[0][i] * a.re + weights[1][i] * b.re + weights[2][i] * c.re;
            im[i] = weights[0][i] * a.im + weights[1][i] * b.im + weights[2][i] * c.im;
        }
    }
}

/// Adds three weighted lines to a row of pixels.
#[inline(always)]
pub(crate) fn add_weighted(row: &mut [f32], [a, b, c]: [f32; 3], lines: [&[f32]; 3]) {
    let width = row.len();
    let [first, second, third] = lines.map(|line| &line[..width]);
    for col in 0..width {
        row[col] += a * first[col] + b * second[col] + c * third[col];
    }
}

/// Multiplies each row of a matrix, as many values as a diagonal has, by a band matrix of five diagonals.
#[inline(always)]
pub(crate) fn band_along(matrix: &[Complex<f32>], band: &[Vec<f32>; 5], out: &mut [Complex<f32>]) {
    let columns = band[0].len();
    let inner = 2..columns.saturating_sub(2).max(2);
    let weights = band.each_ref().map(|weights| weights.get(inner.clone()).unwrap_or_default());
    for (out, row) in out.chunks_exact_mut(columns).zip(matrix.chunks_exact(columns)) {
        for column in (0..columns).filter(|column| !inner.contains(column)) {
            let values = (0..5).filter_map(|k| Some(row.get((column + k).checked_sub(2)?)? * band[k][column]));
            out[column] = values.fold(Complex::new(0.0, 0.0), |sum, value| sum + value);
        }
        let Some(out) = out.get_mut(inner.clone()) else { continue };
        let count = out.len();
        let [a, b, c, d, e] = [0, 1, 2, 3, 4].map(|k| (&row[k..k + count], &weights[k][..count]));
        for i in 0..count {
            out[i] = a.0[i] * a.1[i] + b.0[i] * b.1[i] + c.0[i] * c.1[i] + d.0[i] * d.1[i] + e.0[i] * e.1[i];
        }
    }
}

/// The same for the columns of a matrix.
#[inline(always)]
pub(crate) fn band_across(matrix: &[Complex<f32>], band: &[Vec<f32>; 5], columns: usize, out: &mut [Complex<f32>]) {
    for (row, out) in out.chunks_exact_mut(columns).enumerate() {
        let source = |diagonal: usize| {
            let start = (row + diagonal).checked_sub(2)? * columns;
            Some((matrix.get(start..start + columns)?, band[diagonal][row]))
        };
        let sources = [0, 1, 2, 3, 4].map(source);
        if let [Some(a), Some(b), Some(c), Some(d), Some(e)] = sources {
            for (i, out) in out.iter_mut().enumerate() {
                *out = a.0[i] * a.1 + b.0[i] * b.1 + c.0[i] * c.1 + d.0[i] * d.1 + e.0[i] * e.1;
            }
            continue;
        }
        out.fill(Complex::new(0.0, 0.0));
        for (source, weight) in sources.into_iter().flatten() {
            for (out, value) in out.iter_mut().zip(source) {
                *out += value * weight;
            }
        }
    }
}

/// Largest absolute value; not finite as soon as one value is not.
///
/// Without its sign the pattern of bits of a float grows with its value, infinity and NaN being largest of all, and the
/// largest of many integers is found in wide registers, which IEEE comparisons do not allow.
#[inline(always)]
pub(crate) fn largest_part(values: &[f32]) -> f32 {
    let magnitude = |value: &f32| (value.to_bits() & 0x7fff_ffff) as i32;
    f32::from_bits(values.iter().map(magnitude).max().unwrap_or(0) as u32)
}

/// Smallest and largest of the finite values, none of which is negative; infinity and zero where there is none. Patterns of bits
/// are compared, as in [`largest_part`].
#[inline(always)]
pub(crate) fn finite_extremes(values: &[f32]) -> [f32; 2] {
    const INFINITE: i32 = f32::INFINITY.to_bits() as i32;
    let (mut least, mut most) = (INFINITE, 0);
    for value in values {
        let magnitude = (value.to_bits() & 0x7fff_ffff) as i32;
        least = least.min(magnitude);
        most = most.max(if magnitude < INFINITE { magnitude } else { 0 });
    }
    [least, most].map(|bits| f32::from_bits(bits as u32))
}

/// Whether a pixel of the row has got more light than it has left: `light² > limit · (re² + im²)`.
#[inline(always)]
pub(crate) fn any_exceeds(light: &[f32], re: &[f32], im: &[f32], limit: f32) -> bool {
    let pixels = light.iter().zip(re).zip(im);
    pixels.fold(0, |any, ((light, re), im)| any | u32::from(light * light > limit * (re * re + im * im))) != 0
}

/// Smallest squared modulus of the pixels.
#[inline(always)]
pub(crate) fn smallest_square(re: &[f32], im: &[f32]) -> f32 {
    let square = |(re, im): (&f32, &f32)| ((re * re + im * im).to_bits() & 0x7fff_ffff) as i32;
    f32::from_bits(re.iter().zip(im).map(square).min().unwrap_or(0) as u32)
}

#[cfg(test)]
mod tests {
    use range_image::with_wide_registers;

    use super::*;

    #[test]
    fn the_largest_part_is_found() {
        assert_eq!(largest_part(&[-3.0, 2.0, -0.0]).to_bits(), 3.0_f32.to_bits());
        assert_eq!(largest_part(&[]).to_bits(), 0);
        assert!(largest_part(&[1.0, f32::NEG_INFINITY]).is_infinite());
        assert!(!largest_part(&[1.0, -f32::NAN, 3e38]).is_finite());
    }

    #[test]
    fn extremes_leave_out_what_is_not_finite() {
        let mut values = vec![5.0; 21];
        (values[3], values[9], values[20], values[14]) = (f32::NAN, f32::INFINITY, 0.5, 7.0);
        assert_eq!(
            with_wide_registers(|| finite_extremes(&values)).map(f32::to_bits),
            [0.5_f32, 7.0].map(f32::to_bits)
        );
        assert_eq!(finite_extremes(&[f32::NAN]).map(f32::to_bits), [f32::INFINITY, 0.0].map(f32::to_bits));
    }

    #[test]
    fn squares_and_limits_are_compared() {
        assert_eq!(smallest_square(&[3.0, 1.0], &[4.0, 2.0]).to_bits(), 5.0_f32.to_bits());
        assert!(any_exceeds(&[0.1, 1.2], &[1.0, 0.0], &[0.0, 1.0], 1.0));
        assert!(!any_exceeds(&[0.1, 0.9], &[1.0, 0.0], &[0.0, 1.0], 1.0));
    }
}
