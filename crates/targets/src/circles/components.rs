//! Regions of the level sets that look like ellipses.
//!
//! The level sinks through the image, and pixels that it uncovers join the components beside them (union and find), with their
//! moments. A full ellipse of area A with central moments C has `A = 4 π √det C`; a component for which that holds over a span
//! of levels, the contrast, is a candidate. No threshold over the image is needed, so that shading does no harm.

use range_image::Raster;

use super::ellipse::Ellipse;

/// Largest deviation of `A / 4 π √det C` from 1. A square has 0.955, the triangle 0.83, a ring or a ragged region less.
/// Fifteen percent leave room for the pixels of small discs.
const LARGEST_MOMENT_DEVIATION: f64 = 0.15;
/// Fewest pixels of a candidate: with fewer the moments are those of a few squares.
const FEWEST_PIXELS: f64 = 8.0;
/// A component that becomes so many times larger in one step has joined something else.
const LARGEST_JUMP: f64 = 1.5;
/// Variance of the place within a pixel, square pixel.
const PIXEL_VARIANCE: f64 = 1.0 / 12.0;

/// A span of levels over which a component looks like an ellipse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Candidate {
    /// A pixel of the component at every level of the span, `row * width + col`.
    pub(crate) seed: usize,
    /// First and last level.
    pub(crate) levels: [f32; 2],
}

/// The region of a candidate half-way between its levels.
#[derive(Debug, Clone)]
pub(crate) struct Region {
    pub(crate) level: f32,
    pub(crate) pixels: Vec<usize>,
    pub(crate) ellipse: Ellipse,
}

#[derive(Debug, Clone, Copy, Default)]
struct Moments {
    count: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
    yy: f64,
}

impl Moments {
    fn of_pixel(x: f64, y: f64) -> Self {
        Self { count: 1.0, x, y, xx: x * x, xy: x * y, yy: y * y }
    }

    fn add(&mut self, other: &Self) {
        self.count += other.count;
        self.x += other.x;
        self.y += other.y;
        self.xx += other.xx;
        self.xy += other.xy;
        self.yy += other.yy;
    }

    /// Centre and central moments.
    fn central(&self) -> ([f64; 2], [f64; 3]) {
        let (x, y) = (self.x / self.count, self.y / self.count);
        let own = |sum: f64, product: f64| sum / self.count - product;
        let [xx, xy, yy] = [own(self.xx, x * x), own(self.xy, x * y), own(self.yy, y * y)];
        ([x, y], [xx + PIXEL_VARIANCE, xy, yy + PIXEL_VARIANCE])
    }

    fn is_elliptical(&self, largest_ratio: f64) -> bool {
        let (_, [xx, xy, yy]) = self.central();
        let (determinant, trace) = (xx * yy - xy * xy, xx + yy);
        // The ratio of the axes is that of the roots of the eigenvalues: t²/d = (1 + r²)² / r².
        let square = largest_ratio * largest_ratio;
        self.count >= FEWEST_PIXELS
            && trace * trace * square <= determinant * (1.0 + square) * (1.0 + square)
            && (self.count / (4.0 * std::f64::consts::PI * determinant.sqrt()) - 1.0).abs() <= LARGEST_MOMENT_DEVIATION
    }
}

/// Components while the level sinks; the fields of a component stand at its root.
struct Sweep<'a> {
    image: &'a Raster<f32>,
    parents: Vec<u32>,
    moments: Vec<Moments>,
    /// The levels since which a component looks like an ellipse; NaN where it does not.
    since: Vec<f32>,
    seeds: Vec<u32>,
    largest_ratio: f64,
    smallest_span: f32,
    found: Vec<Candidate>,
}

/// Place of a pixel that the level has not reached.
const COVERED: u32 = u32::MAX;

/// Bright regions that look like ellipses over at least `smallest_span`; NaN belongs to none.
pub(crate) fn elliptical_components(image: &Raster<f32>, largest_ratio: f64, smallest_span: f32) -> Vec<Candidate> {
    let values = image.as_slice();
    let Ok(count) = u32::try_from(values.len()) else { return Vec::new() };
    let mut order: Vec<u32> = (0..count).filter(|place| values[*place as usize].is_finite()).collect();
    // Of equal values the earlier pixel comes first: the same order, whatever the sort does.
    order.sort_unstable_by(|a, b| values[*b as usize].total_cmp(&values[*a as usize]).then(a.cmp(b)));
    let mut sweep = Sweep {
        image,
        parents: vec![COVERED; values.len()],
        moments: vec![Moments::default(); values.len()],
        since: vec![f32::NAN; values.len()],
        seeds: vec![0; values.len()],
        largest_ratio,
        smallest_span,
        found: Vec::new(),
    };
    for place in order {
        sweep.uncover(place as usize);
    }
    sweep.end();
    sweep.found
}

impl Sweep<'_> {
    fn uncover(&mut self, place: usize) {
        let (width, height) = (self.image.width(), self.image.height());
        let (col, row) = (place % width, place / width);
        let level = self.image.as_slice()[place];
        self.parents[place] = place as u32;
        self.moments[place] = Moments::of_pixel(col as f64, row as f64);
        self.seeds[place] = place as u32;
        let mut root = place;
        let neighbours = [
            (col > 0).then(|| place - 1),
            (col + 1 < width).then(|| place + 1),
            (row > 0).then(|| place - width),
            (row + 1 < height).then(|| place + width),
        ];
        for neighbour in neighbours.into_iter().flatten() {
            if self.parents[neighbour] != COVERED {
                let other = self.root(neighbour);
                if other != root {
                    root = self.join(root, other, level);
                }
            }
        }
        match (self.moments[root].is_elliptical(self.largest_ratio), self.since[root].is_nan()) {
            (true, true) => self.since[root] = level,
            (false, false) => self.close(root, level),
            _ => {}
        }
    }

    /// The root of a component; the way there becomes shorter.
    fn root(&mut self, mut place: usize) -> usize {
        while self.parents[place] as usize != place {
            let above = self.parents[self.parents[place] as usize];
            self.parents[place] = above;
            place = above as usize;
        }
        place
    }

    /// The larger component takes the smaller, whose span ends; its own ends as well where it grows too much.
    fn join(&mut self, first: usize, second: usize, level: f32) -> usize {
        let is_first = self.moments[first].count >= self.moments[second].count;
        let (root, joined) = if is_first { (first, second) } else { (second, first) };
        self.close(joined, level);
        if self.moments[root].count + self.moments[joined].count > LARGEST_JUMP * self.moments[root].count {
            self.close(root, level);
        }
        let other = self.moments[joined];
        self.moments[root].add(&other);
        self.parents[joined] = root as u32;
        root
    }

    /// Ends the span of a component at a level.
    fn close(&mut self, root: usize, level: f32) {
        let since = std::mem::replace(&mut self.since[root], f32::NAN);
        if since - level >= self.smallest_span {
            self.found.push(Candidate { seed: self.seeds[root] as usize, levels: [since, level] });
        }
    }

    fn end(&mut self) {
        let finite = |value: &&f32| value.is_finite();
        let Some(lowest) = self.image.as_slice().iter().filter(finite).copied().min_by(f32::total_cmp) else { return };
        for place in 0..self.parents.len() {
            if self.parents[place] as usize == place {
                self.close(place, lowest);
            }
        }
    }
}

impl Candidate {
    /// The region about the seed above the level half-way, joined by rows and columns.
    pub(crate) fn region(&self, image: &Raster<f32>, taken: &mut [bool]) -> Region {
        let level = 0.5 * (self.levels[0] + self.levels[1]);
        let (width, height) = (image.width(), image.height());
        let (mut pixels, mut next) = (vec![self.seed], 0);
        taken[self.seed] = true;
        let mut moments = Moments::default();
        while let Some(&place) = pixels.get(next) {
            next += 1;
            let (col, row) = (place % width, place / width);
            moments.add(&Moments::of_pixel(col as f64, row as f64));
            let neighbours = [
                (col > 0).then(|| place - 1),
                (col + 1 < width).then(|| place + 1),
                (row > 0).then(|| place - width),
                (row + 1 < height).then(|| place + width),
            ];
            for neighbour in neighbours.into_iter().flatten() {
                if !taken[neighbour] && image.as_slice()[neighbour] >= level {
                    taken[neighbour] = true;
                    pixels.push(neighbour);
                }
            }
        }
        // Clean for the next candidate.
        for place in &pixels {
            taken[*place] = false;
        }
        let (centre, central) = moments.central();
        Region { level, pixels, ellipse: Ellipse::from_moments(centre, central) }
    }
}
