//! Lattices among the discs of an image.

use nalgebra::Vector2;

use crate::circles::find::CircleSighting;
use crate::grid::lattice::{Candidates, Lattice, Node};
use crate::grid::nearest::Places;

/// How many of the nearest discs may be the neighbours of a seed: eight are about it, and some clutter.
const NEAR: usize = 12;
/// Sine of the smallest angle between both directions of a seed: 20°, a grid tilted by 70°.
const LEAST_SINE: f64 = 0.34;
/// Largest ratio of the radii of neighbours: perspective and shading change them by a few percent only, noise of the smallest by
/// a fifth.
const LARGEST_RATIO: f64 = 1.35;
/// Largest ratio of the contrasts of neighbours.
const LARGEST_CONTRAST_RATIO: f64 = 2.0;
/// Dots of a lattice that is kept.
const LEAST: usize = 6;
/// Dots that may be missing in a row where a lattice goes on.
const GAP: i32 = 2;

/// The lattices among the sightings, the largest first, their second direction clockwise (as seen) of the first. No sighting is in
/// two. `largest_dot`: diameter of the largest dot in parts of the others.
pub(crate) fn lattices(sightings: &[CircleSighting], largest_dot: f64) -> Vec<Lattice> {
    let points: Vec<Vector2<f64>> = sightings.iter().map(|sighting| sighting.centre.pixel.into()).collect();
    let places = Places::new(&points);
    let mut used = vec![false; sightings.len()];
    let mut found = Vec::new();
    for origin in 0..sightings.len() {
        let alike = |from: usize, to: usize| !used[to] && are_alike(&sightings[from], &sightings[to], largest_dot);
        let seed = if used[origin] { None } else { seed(&points, &places, origin, &alike) };
        let Some([along_u, along_v]) = seed else { continue };
        let candidates = Candidates { points: &points, places: &places };
        let accept = |from: usize, to: usize, _: Node| alike(from, to);
        let mut lattice = Lattice::grow(&candidates, [origin, along_u, along_v], &accept);
        if lattice.nodes.len() < LEAST {
            continue;
        }
        let across_gap = |_: Node, to: usize, _: [Vector2<f64>; 2]| alike(origin, to);
        lattice.bridge(&candidates, GAP, &across_gap);
        lattice.nodes.values().for_each(|&index| used[index] = true);
        found.push(lattice);
    }
    found.sort_by_key(|lattice| std::cmp::Reverse(lattice.nodes.len()));
    found
}

/// The nearest disc and the nearest in another direction, the second clockwise of the first as the image is seen.
fn seed(
    points: &[Vector2<f64>],
    places: &Places<'_>,
    origin: usize,
    alike: &impl Fn(usize, usize) -> bool,
) -> Option<[usize; 2]> {
    let near: Vec<usize> = places.nearest(points[origin], NEAR + 1);
    let mut others = near.into_iter().filter(|&to| to != origin && alike(origin, to));
    let first = others.next()?;
    let u = points[first] - points[origin];
    let sine = |to: usize| {
        let v = points[to] - points[origin];
        u.perp(&v) / (u.norm() * v.norm())
    };
    let second = others.find(|&to| sine(to).abs() >= LEAST_SINE)?;
    Some(if sine(second) > 0.0 { [first, second] } else { [second, first] })
}

/// Whether two discs may be dots of one grid side by side.
fn are_alike(a: &CircleSighting, b: &CircleSighting, largest_dot: f64) -> bool {
    let contrast = b.contrast / a.contrast;
    let radius = a.ellipse.mean_radius_px() / b.ellipse.mean_radius_px();
    let ratio = radius.max(radius.recip());
    let as_large = [1.0, largest_dot].into_iter().any(|dot| (ratio / dot).max(dot / ratio) <= LARGEST_RATIO);
    contrast > 0.0 && contrast.max(contrast.recip()) <= LARGEST_CONTRAST_RATIO && as_large
}
