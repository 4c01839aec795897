//! Which points belong to the shape.

use nalgebra::{Matrix2, Matrix3, Matrix5, Vector2, Vector3, Vector5};
use statistics::{Distribution, bonferroni, mad_scale};

use super::adjusted::{Adjusted, adjust, open};
use super::expected::{Expected, Sums, Term, Whitened};
use super::observation::{Hit, Observation, observations};
use super::start::start;
use super::surface::{Shape, Surface};
use crate::{Cloud, Error, FitOptions, Result};

/// Most rounds of choosing points; a choice that still changes then is taken as it is.
const MOST_ROUNDS: usize = 20;
/// Largest share of points that belong to something else: the start, a least median, bears less than half.
const LARGEST_SHARE_ELSEWHERE: f64 = 0.5;
/// Largest standard deviation of a radius in parts of itself, and of a direction in radian: first-order covariances are worth little
/// beyond. Larger lets through cylinders of which a narrow strip is seen.
pub(crate) const LARGEST_UNCERTAINTY: f64 = 0.1;
/// Points needed for each parameter: fewer leave too little to judge by.
const POINTS_A_PARAMETER: usize = 5;

/// A surface with the points that it was fitted to.
pub(crate) struct Robust {
    pub(crate) surface: Surface,
    pub(crate) inverse: Matrix5<f64>,
    pub(crate) terms: Vec<Term>,
    pub(crate) hits: Vec<Hit>,
    pub(crate) left_out: Vec<usize>,
    pub(crate) unusable: usize,
    pub(crate) expected: Expected,
}

/// Fits a shape to points of the cloud, leaving out what belongs to something else.
pub(crate) fn robust(cloud: &Cloud<'_>, points: &[usize], shape: Shape, options: &FitOptions) -> Result<Robust> {
    options.validate()?;
    if let Some(index) = points.iter().find(|index| **index >= cloud.points.len()) {
        return Err(Error::NoSuchPoint { index: *index, points: cloud.points.len() });
    }
    let (observations, unusable) = observations(cloud, points);
    let require = |points: usize| {
        let needed = POINTS_A_PARAMETER * shape.parameters();
        if points >= needed { Ok(()) } else { Err(Error::TooFewPoints { shape, points, unusable, needed }) }
    };
    require(observations.len())?;
    if shape == Shape::Plane {
        require_breadth(&observations)?;
    }
    let places: Vec<_> = observations.iter().map(|observation| observation.point).collect();
    let surface = start(shape, &places, options.seed).ok_or_else(|| open(shape))?;
    let whitened = Whitened::new(cloud, observations.iter().map(|observation| observation.index));
    let mut kept = first_choice(&observations, &surface);
    let mut now = surface;
    let mut before: Vec<Vec<bool>> = Vec::new();
    for round in 0..MOST_ROUNDS {
        require_share(shape, &kept)?;
        let adjusted = adjust(&observations, &kept, &now)?;
        let fit = Fit::new(cloud, &observations, &kept, &whitened, adjusted);
        let next = fit.choice(cloud, &observations, &kept, options);
        // Points at the edge of the test may come and go.
        if next == kept || before.contains(&next) || round + 1 == MOST_ROUNDS {
            require(fit.terms.len())?;
            require_determined(&fit)?;
            return Ok(fit.finished(&observations, &kept, unusable));
        }
        require(next.iter().filter(|kept| **kept).count())?;
        now = fit.adjusted.surface;
        before.push(std::mem::replace(&mut kept, next));
    }
    Err(open(shape))
}

/// A fit to one choice of points.
struct Fit {
    adjusted: Adjusted,
    whitened: Whitened,
    hits: Vec<Hit>,
    terms: Vec<Term>,
    sums: Sums,
}

impl Fit {
    fn new(
        cloud: &Cloud<'_>,
        observations: &[Observation],
        kept: &[bool],
        whitened: &Whitened,
        adjusted: Adjusted,
    ) -> Self {
        let used = observations.iter().zip(kept).filter(|(_, kept)| **kept);
        let found = used.filter_map(|(observation, _)| Some((observation.index, observation.hit(&adjusted.surface)?)));
        let (terms, hits): (Vec<Term>, Vec<Hit>) = found.map(|(index, hit)| (term(index, &hit), hit)).unzip();
        let sums = Sums::new(cloud, &terms, whitened, &adjusted.inverse);
        Self { adjusted, whitened: whitened.clone(), hits, terms, sums }
    }

    /// Points whose residual is within what noise, neighbours and common errors allow at the level.
    fn choice(
        &self,
        cloud: &Cloud<'_>,
        observations: &[Observation],
        kept: &[bool],
        options: &FitOptions,
    ) -> Vec<bool> {
        let critical = Distribution::Normal.critical(bonferroni(options.rejection_level, observations.len()));
        let standardised: Vec<Option<f64>> = observations
            .iter()
            .zip(kept)
            .map(|(observation, kept)| {
                let hit = observation.hit(&self.adjusted.surface).filter(|hit| hit.is_clear)?;
                let term = term(observation.index, &hit);
                let row = term.by / term.unit;
                let shift = self.whitened.shift(cloud, term.index, &term.normal) / term.unit;
                let leverage = row.dot(&(self.adjusted.inverse * row));
                let own = if *kept { (1.0 - leverage).max(0.0) } else { 1.0 + leverage };
                let variance = own + self.sums.left_by_common(&row, &shift);
                Some(hit.residual.abs() / (term.unit * variance.sqrt()))
            })
            .collect();
        let mut of_kept: Vec<f64> =
            standardised.iter().zip(kept).filter(|(_, kept)| **kept).filter_map(|(value, _)| *value).collect();
        // Sigmas that are stated too small are told by the verdict; they do not make good points gross errors.
        let scale = mad_scale(&mut of_kept).max(1.0);
        standardised.into_iter().map(|value| value.is_some_and(|value| value <= critical * scale)).collect()
    }

    fn finished(self, observations: &[Observation], kept: &[bool], unusable: usize) -> Robust {
        let expected = self.sums.expected(&self.terms);
        let left_out = observations.iter().zip(kept).filter(|(_, kept)| !**kept);
        Robust {
            surface: self.adjusted.surface,
            inverse: self.adjusted.inverse,
            left_out: left_out.map(|(observation, _)| observation.index).collect(),
            terms: self.terms,
            hits: self.hits,
            unusable,
            expected,
        }
    }
}

fn term(index: usize, hit: &Hit) -> Term {
    Term {
        index,
        normal: hit.normal,
        unit: hit.variance.sqrt(),
        noise: hit.noise,
        sensor: hit.sensor,
        by: Vector5::from(hit.by),
    }
}

/// The half of the points that is nearest to the start, and what lies as near as a robust scale of these allows.
fn first_choice(observations: &[Observation], surface: &Surface) -> Vec<bool> {
    let standardised: Vec<Option<f64>> = observations
        .iter()
        .map(|observation| {
            let hit = observation.hit(surface).filter(|hit| hit.is_clear)?;
            Some(hit.residual.abs() / hit.variance.sqrt())
        })
        .collect();
    let mut known: Vec<f64> = standardised.iter().flatten().copied().collect();
    let scale = mad_scale(&mut known).max(1.0);
    let critical = Distribution::Normal.critical(bonferroni(1.0, observations.len()));
    standardised.into_iter().map(|value| value.is_some_and(|value| value <= critical * scale)).collect()
}

fn require_share(shape: Shape, kept: &[bool]) -> Result<()> {
    let elsewhere = kept.iter().filter(|kept| !**kept).count() as f64 / kept.len() as f64;
    if elsewhere <= LARGEST_SHARE_ELSEWHERE {
        return Ok(());
    }
    let [percent, limit_percent] = [elsewhere, LARGEST_SHARE_ELSEWHERE].map(|share| 100.0 * share);
    Err(Error::NotThatShape { shape, points: kept.len(), percent, limit_percent })
}

fn require_determined(fit: &Fit) -> Result<()> {
    let surface = &fit.adjusted.surface;
    let sigma = |at: usize| fit.adjusted.inverse[(at, at)].sqrt();
    let (shape, limit) = (surface.shape, LARGEST_UNCERTAINTY);
    let direction = sigma(0).hypot(sigma(1));
    let open = match shape {
        Shape::Plane if direction > limit => return Err(collinear(spread_of(&fit.terms), direction)),
        Shape::Plane => return Ok(()),
        Shape::Sphere => [("radius in parts of itself", sigma(3) / surface.radius), ("", 0.0)],
        Shape::Cylinder => {
            [("radius in parts of itself", sigma(4) / surface.radius), ("direction of the axis, radian", direction)]
        }
    };
    match open.into_iter().find(|(_, sigma)| sigma.is_nan() || *sigma > limit) {
        Some((what, sigma)) => Err(Error::NotDetermined { shape, what, sigma, limit }),
        None => Ok(()),
    }
}

/// Points so near to a line that noise chooses the plane's direction about it.
fn require_breadth(observations: &[Observation]) -> Result<()> {
    let count = observations.len() as f64;
    let middle = observations.iter().map(|observation| observation.point).sum::<Vector3<f64>>() / count;
    let mut moments = Matrix3::zeros();
    for observation in observations {
        let way = observation.point - middle;
        moments += way * way.transpose() / count;
    }
    let noise = observations.iter().map(Observation::variance).sum::<f64>() / count;
    let mut spread: Vec<f64> = moments.symmetric_eigenvalues().iter().copied().collect();
    spread.sort_by(f64::total_cmp);
    // Noise widens a line.
    let breadth = (spread[1] - noise).max(0.0);
    let sigma_rad = (noise / (count * breadth)).sqrt();
    let spread = [breadth.sqrt(), spread[2].max(0.0).sqrt()];
    if sigma_rad > LARGEST_UNCERTAINTY { Err(collinear(spread, sigma_rad)) } else { Ok(()) }
}

/// Root mean squares across a line and along it; even along a line of length l, that is l / √12.
fn collinear(spread: [f64; 2], sigma_rad: f64) -> Error {
    let [width_m, length_m] = spread.map(|spread| spread * 12.0_f64.sqrt());
    Error::Collinear { length_m, width_m, sigma_rad, limit_rad: LARGEST_UNCERTAINTY }
}

fn spread_of(terms: &[Term]) -> [f64; 2] {
    let mut moments = Matrix2::zeros();
    for term in terms {
        let way = Vector2::new(term.by[0], term.by[1]);
        moments += way * way.transpose() / terms.len() as f64;
    }
    let mut spread: Vec<f64> = moments.symmetric_eigenvalues().iter().map(|value| value.max(0.0).sqrt()).collect();
    spread.sort_by(f64::total_cmp);
    [spread[0], spread[1]]
}
