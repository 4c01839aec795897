//! Whether walls are bent as light that bounced would bend them: what the ranges themselves say of the risk.
//!
//! The risk is the error that the scene's shape makes likely. Whether the ranges have it, and how much of it, depends on
//! what is not in view and on what has been taken off already. But a wall whose ranges are too long by an amount that
//! changes along it shows as bent. So inverse ranges of each wall are fitted by a plane and, together for all walls, by a
//! common factor times the risk. Patches are the witnesses: the factor's standard deviation comes from how far they
//! disagree, so that pictures on walls, textures and errors of calibration, which bend walls otherwise, weaken the verdict
//! instead of making it.

use range_image::Raster;
use statistics::chi_squared_limit;

use crate::numbers::cholesky::Cholesky;
use crate::numbers::vector::{Vec3, dot, sub};
use crate::scene::patches::{Facet, Patches, Surfaces};

/// Least number of patches of a wall: fewer follow any bend.
const LEAST_PATCHES: usize = 4;
/// Least number of witnesses, as many as are worth equal ones, that tell a common bend from chance. A choice: the bend
/// of so many is known to half of itself where each is known to itself.
const LEAST_WITNESSES: f64 = 5.0;
/// Two patches are of one wall where their normals agree to 18 degrees (cosine) and each lies in the other's plane to this
/// many metres: light that bounced bends by some centimetres a metre, a step of furniture is larger.
const LEAST_COSINE: f64 = 0.95;
const LARGEST_STEP_M: f64 = 0.04;
/// Share of the predicted errors that other reasons may fake, as they are largest at edges too: lens, stray light, frames of
/// pictures. In rooms without any light that bounced, factors of up to 0.12 were seen, in rooms with it 0.4 to 1.4.
const FAKED_FACTOR: f64 = 0.15;

/// What the shape of the walls says of the predicted errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bending {
    /// The errors that walls show are the predicted ones times this; 0 where too few patches tell.
    pub factor: f64,
    /// Its standard deviation, from how far patches of walls disagree; infinite where they are too few.
    pub sigma: f64,
    /// Patches that told something, as many as are worth equal ones.
    pub witnesses: f64,
    /// How far the factor is above what other reasons may fake, as a standard normal deviate.
    pub deviate: f64,
}

impl Bending {
    pub(crate) const UNKNOWN: Self = Self { factor: 0.0, sigma: f64::INFINITY, witnesses: 0.0, deviate: 0.0 };

    /// Whether walls that light did not bend would look so with less than this probability.
    pub fn is_significant(&self, false_alarm: f64) -> bool {
        // The upper tail of a normal deviate is half that of its square.
        self.deviate > 0.0 && self.deviate.powi(2) > chi_squared_limit(1.0, (2.0 * false_alarm).min(1.0))
    }

    /// The part of a predicted error that is there at least, nineteen times of twenty; nothing where the walls are not bent.
    /// What is out of view adds to it, so that a factor above 1 is not relied on.
    pub fn sure_part(&self, false_alarm: f64) -> f64 {
        if self.is_significant(false_alarm) { self.factor.min(1.0) } else { 0.0 }
    }

    /// The common factor of all witnesses.
    fn of(witnesses: &[Witness]) -> Self {
        let sum = |of: fn(&Witness) -> f64| witnesses.iter().map(of).sum::<f64>();
        let squares = sum(|witness| witness.squares);
        let count = squares * squares / sum(|witness| witness.squares.powi(2));
        let factor = sum(|witness| witness.product) / squares;
        if !(factor.is_finite() && count >= LEAST_WITNESSES) {
            return Self::UNKNOWN;
        }
        let freedom = count - 1.0;
        let scatter: f64 = witnesses.iter().map(|witness| (witness.product - factor * witness.squares).powi(2)).sum();
        let sigma = (scatter * count / freedom).sqrt() / squares;
        let deviate = normal_deviate((factor - FAKED_FACTOR) / sigma, freedom);
        Self { factor, sigma, witnesses: count, deviate }
    }
}

/// What a patch says: squares of the predicted bend, and their product with what is seen, both over the variance.
struct Witness {
    squares: f64,
    product: f64,
}

/// A wall: its patches by their positions.
type Wall = Vec<usize>;

/// Compares the shape of all walls with the predicted errors.
pub(crate) fn bending(surfaces: &Surfaces, patches: &Patches, directions: &[Vec3], risk_m: &Raster<f32>) -> Bending {
    let pixels = |patch: &usize| {
        let cells = &patches.cells[patches.patches[*patch].1.clone()];
        let pixels = cells.iter().flat_map(|(_, square)| surfaces.pixels(*square));
        pixels.filter_map(|(index, range)| {
            let risk = f64::from(risk_m.as_slice()[index]);
            // In metres of range: an inverse range times the square of the range.
            let column = directions[index].map(|u| u * range * range);
            risk.is_finite().then_some(Pixel { column, range, bend: -risk })
        })
    };
    let walls = walls(patches);
    Bending::of(&walls.iter().flat_map(|wall| witnesses(wall, &pixels)).collect::<Vec<_>>())
}

/// Patches that go on where another ends.
fn walls(patches: &Patches) -> Vec<Wall> {
    let facets: Vec<&Facet> = patches.patches.iter().map(|(facet, _)| facet).collect();
    let mut wall_of: Vec<usize> = (0..facets.len()).collect();
    for (a, one) in facets.iter().enumerate() {
        for (b, other) in facets.iter().enumerate().skip(a + 1) {
            if wall_of[a] != wall_of[b] && continues(one, other) {
                let (kept, joined) = (wall_of[a].min(wall_of[b]), wall_of[a].max(wall_of[b]));
                wall_of.iter_mut().filter(|wall| **wall == joined).for_each(|wall| *wall = kept);
            }
        }
    }
    let mut walls = vec![Wall::new(); facets.len()];
    wall_of.into_iter().enumerate().for_each(|(patch, wall)| walls[wall].push(patch));
    walls.retain(|wall| wall.len() >= LEAST_PATCHES);
    walls
}

fn continues(one: &Facet, other: &Facet) -> bool {
    let way = sub(&other.centre, &one.centre);
    let step_m = dot(&way, &one.normal).abs().max(dot(&way, &other.normal).abs());
    let beside = dot(&way, &way).sqrt() < one.area_m2.sqrt() + other.area_m2.sqrt();
    beside && dot(&one.normal, &other.normal) > LEAST_COSINE && step_m < LARGEST_STEP_M
}

/// A row of the equations of a wall, in metres of range: the plane's three columns, what is seen, the predicted bend.
struct Pixel {
    column: Vec3,
    range: f64,
    bend: f64,
}

/// What each patch of a wall says, once the wall's plane was fitted to ranges and to predicted errors.
fn witnesses<P: Iterator<Item = Pixel>>(wall: &Wall, pixels: &impl Fn(&usize) -> P) -> Vec<Witness> {
    let (mut matrix, mut of_range, mut of_bend) = ([[0.0; 3]; 3], [0.0; 3], [0.0; 3]);
    let mut count = 0.0;
    for Pixel { column, range, bend } in wall.iter().flat_map(pixels) {
        for (i, row) in matrix.iter_mut().enumerate() {
            row.iter_mut().zip(&column).for_each(|(entry, other)| *entry += column[i] * other);
            of_range[i] += column[i] * range;
            of_bend[i] += column[i] * bend;
        }
        count += 1.0;
    }
    let Some(factor) = Cholesky::new(&matrix) else { return Vec::new() };
    let (plane, absorbed) = (factor.solve(&of_range), factor.solve(&of_bend));
    let mut misfit = 0.0;
    let mut found: Vec<Witness> = Vec::new();
    for patch in wall {
        let mut witness = Witness { squares: 0.0, product: 0.0 };
        for Pixel { column, range, bend } in pixels(patch) {
            let (seen, bend) = (range - dot(&plane, &column), bend - dot(&absorbed, &column));
            misfit += seen * seen;
            witness.squares += bend * bend;
            witness.product += bend * seen;
        }
        found.push(witness);
    }
    let weight = (count - 3.0) / misfit;
    if !(weight.is_finite() && weight > 0.0) {
        return Vec::new();
    }
    for witness in &mut found {
        witness.squares *= weight;
        witness.product *= weight;
    }
    found
}

/// The standard normal deviate that is exceeded as often as `t` of Student's distribution: the approximation of Wallace
/// to first order, to 0.02 for 4 degrees of freedom and deviates of up to 3.
fn normal_deviate(t: f64, freedom: f64) -> f64 {
    t * (1.0 - 0.25 / freedom) / (1.0 + t * t / (2.0 * freedom)).sqrt()
}
