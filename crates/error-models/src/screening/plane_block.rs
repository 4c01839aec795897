//! Planes through blocks of three by three ranges.

/// The misfit that one of a thousand true planes exceeds, with 1 to 6 degrees of freedom: quantiles 0.999 of chi-squared.
/// With 0.99 instead there are more false flags in rooms, up to 1.5 times as many; with 0.99996 fewer, and fewer right ones.
const LARGEST_MISFIT: [f64; 6] = [10.83, 13.82, 16.27, 18.47, 20.52, 22.46];

/// Columns and rows of a block beside its centre.
pub(crate) const OFFSETS: [[isize; 2]; 9] =
    [[-1, -1], [0, -1], [1, -1], [-1, 0], [0, 0], [1, 0], [-1, 1], [0, 1], [1, 1]];

/// Columns and rows of its corners.
pub(crate) const CORNERS: [[isize; 2]; 4] = [[-1, -1], [1, -1], [-1, 1], [1, 1]];

/// An inverse range with its variance.
#[derive(Clone, Copy)]
pub(crate) struct Inverse {
    pub(crate) value: f64,
    pub(crate) variance: f64,
}

impl Inverse {
    /// Where there is no range, or none whose noise is known.
    pub(crate) const NONE: Self = Self { value: f64::NAN, variance: f64::NAN };

    /// Of a range and its variance.
    pub(crate) fn of([range, variance]: [f64; 2]) -> Self {
        Self { value: 1.0 / range, variance: variance / range.powi(4) }
    }
}

/// The plane of least squares of a block: a plane is straight in `1/ρ` from pixel to pixel.
pub(crate) struct BlockPlane {
    /// Value at the centre, and change by column and row.
    coefficients: [f64; 3],
    /// Their cofactors: `00, 01, 02, 11, 12, 22`.
    cofactors: [f64; 6],
    misfit: f64,
    pixels: usize,
}

/// Part of the product of the diagonal below which a determinant is none: pixels on a line.
const SINGULAR: f64 = 1e-9;

impl BlockPlane {
    /// The plane of what is there of a block, in the order of [`OFFSETS`]; `None` where that gives none. Its misfit is weighted by
    /// the variances. Written out: this is called for each pixel beside an edge.
    pub(crate) fn of(block: &[Option<Inverse>; 9]) -> Option<Self> {
        let level = block.iter().flatten().next()?.value;
        let [mut w, mut wx, mut wy, mut wxx, mut wxy, mut wyy] = [0.0; 6];
        let [mut right, mut right_x, mut right_y, mut squares] = [0.0; 4];
        for (inverse, [dx, dy]) in block.iter().zip(OFFSETS) {
            let Some(Inverse { value, variance }) = inverse else { continue };
            let (weight, x, y, value) = (1.0 / variance, dx as f64, dy as f64, value - level);
            let (weight_x, weight_y) = (weight * x, weight * y);
            w += weight;
            wx += weight_x;
            wy += weight_y;
            wxx += weight_x * x;
            wxy += weight_x * y;
            wyy += weight_y * y;
            right += weight * value;
            right_x += weight_x * value;
            right_y += weight_y * value;
            squares += weight * value * value;
        }
        let minors = [wxx * wyy - wxy * wxy, wxy * wy - wx * wyy, wx * wxy - wxx * wy];
        let determinant = w * minors[0] + wx * minors[1] + wy * minors[2];
        let further = [w * wyy - wy * wy, wx * wy - w * wxy, w * wxx - wx * wx];
        let all = [minors[0], minors[1], minors[2], further[0], further[1], further[2]];
        let cofactors @ [a, b, c, d, e, f] = all.map(|minor| minor / determinant);
        let coefficients = [
            a * right + b * right_x + c * right_y,
            b * right + d * right_x + e * right_y,
            c * right + e * right_x + f * right_y,
        ];
        let explained = coefficients[0] * right + coefficients[1] * right_x + coefficients[2] * right_y;
        let [value, by_col, by_row] = coefficients;
        (determinant > SINGULAR * w * wxx * wyy).then(|| Self {
            coefficients: [value + level, by_col, by_row],
            cofactors,
            misfit: squares - explained,
            pixels: block.iter().flatten().count(),
        })
    }

    /// Whether the block is this plane but for its noise, and has enough pixels to tell.
    pub(crate) fn is_plane(&self) -> bool {
        let limit = self.pixels.checked_sub(4).and_then(|at| LARGEST_MISFIT.get(at));
        limit.is_some_and(|limit| self.misfit <= *limit)
    }

    /// The plane at a step from the block's centre.
    pub(crate) fn at(&self, [dx, dy]: [isize; 2]) -> Inverse {
        let (x, y, [value, by_col, by_row]) = (dx as f64, dy as f64, self.coefficients);
        let [a, b, c, d, e, f] = self.cofactors;
        let variance = a + 2.0 * (b * x + c * y + e * x * y) + d * x * x + f * y * y;
        Inverse { value: value + by_col * x + by_row * y, variance }
    }
}

/// Whether a whole block is sure to be a plane: its misfit to the plane of equal weights, which is not below that of [`BlockPlane`],
/// is small enough. Nearly all blocks of walls are told so, in a fraction of the time.
pub(crate) fn is_surely_plane(block: &[Inverse; 9]) -> bool {
    let [a, b, c, d, e, f, g, h, i] = block.map(|inverse| inverse.value);
    let mean = (a + b + c + d + e + f + g + h + i) / 9.0;
    let (by_col, by_row) = ((c + f + i - a - d - g) / 6.0, (g + h + i - a - b - c) / 6.0);
    let misfit = block.iter().zip(OFFSETS).map(|(inverse, [dx, dy])| {
        (inverse.value - mean - by_col * dx as f64 - by_row * dy as f64).powi(2) / inverse.variance
    });
    misfit.sum::<f64>() <= LARGEST_MISFIT[5]
}

/// Whether the pixel is a corner of a block of nine pixels that is a plane. `range` gives the range and its variance at a step
/// of columns and rows from the pixel, `None` where there is none.
///
/// Not a pixel in the middle of a block: there a mixed one lies halfway between the surfaces at its sides, and the three are
/// as straight as a plane. From a corner no edge runs through the middle of the block but the diagonal one, across which a
/// block has five lines of pixels, two of either surface.
///
/// Ranges are taken along their rays: a plane is then straight but for the squared angle between rays (0.3 per mille of the range
/// at a degree).
pub(crate) fn is_corner_of_a_plane(range: impl Fn(isize, isize) -> Option<[f64; 2]>) -> bool {
    CORNERS.iter().any(|[x, y]| {
        let block = OFFSETS.map(|[dx, dy]| range(x + dx, y + dy).map(Inverse::of));
        block.iter().all(Option::is_some) && BlockPlane::of(&block).is_some_and(|plane| plane.is_plane())
    })
}
