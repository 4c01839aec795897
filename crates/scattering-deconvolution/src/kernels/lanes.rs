//! Inner loops over pixels, compiled for the widest registers that the machine has. Products and sums stay separate
//! operations in a fixed order, so that all machines give the same bits.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use fourier_transforms::num_complex::Complex;

/// Values that are worked side by side.
pub(crate) const LANES: usize = 8;

/// Three weighted sums of rows that lie one after the other, each `width` long; one after the other in `sums`. Four rows
/// are taken at a time, to write the sums less often.
#[inline(always)]
pub(crate) fn sum_rows(rows: &[f32], weights: &[[f32; 3]], width: usize, sums: &mut [f32]) {
    sums.fill(0.0);
    for (rows, weights) in rows.chunks(4 * width).zip(weights.chunks(4)) {
        for (tap, sums) in sums.chunks_exact_mut(width).enumerate() {
            if let (&[a, b, c, d], true) = (weights, rows.len() == 4 * width) {
                add_four(rows, [a[tap], b[tap], c[tap], d[tap]], sums);
            } else {
                for (row, weights) in rows.chunks_exact(width).zip(weights) {
                    for (sum, value) in sums.iter_mut().zip(row) {
                        *sum += weights[tap] * value;
                    }
                }
            }
        }
    }
}

/// Adds four weighted rows to a line.
#[inline(always)]
fn add_four(rows: &[f32], [a, b, c, d]: [f32; 4], sums: &mut [f32]) {
    let width = sums.len();
    let (upper, lower) = rows.split_at(2 * width);
    let ((first, second), (third, fourth)) = (upper.split_at(width), lower.split_at(width));
    for (sum, (((first, second), third), fourth)) in
        sums.iter_mut().zip(first.iter().zip(second).zip(third).zip(fourth))
    {
        *sum += (a * first + b * second) + (c * third + d * fourth);
    }
}

/// Sum of up to three lines, as many as there are.
#[inline(always)]
pub(crate) fn add_lines(lines: [Option<&[f32]>; 3], sum: &mut [f32]) {
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
    out.fill(Complex::new(0.0, 0.0));
    for (out, row) in out.chunks_exact_mut(columns).zip(matrix.chunks_exact(columns)) {
        for (diagonal, weights) in band.iter().enumerate() {
            let skipped = 2_usize.saturating_sub(diagonal).min(columns);
            let values = row.iter().skip(diagonal.saturating_sub(2));
            for ((out, weight), value) in out[skipped..].iter_mut().zip(&weights[skipped..]).zip(values) {
                *out += value * weight;
            }
        }
    }
}

/// The same for the columns of a matrix.
#[inline(always)]
pub(crate) fn band_across(matrix: &[Complex<f32>], band: &[Vec<f32>; 5], columns: usize, out: &mut [Complex<f32>]) {
    out.fill(Complex::new(0.0, 0.0));
    for (row, out) in out.chunks_exact_mut(columns).enumerate() {
        for (diagonal, weights) in band.iter().enumerate() {
            let source = (row + diagonal).checked_sub(2).map(|source| source * columns);
            let Some(source) = source.and_then(|start| matrix.get(start..start + columns)) else { continue };
            for (out, value) in out.iter_mut().zip(source) {
                *out += value * weights[row];
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
