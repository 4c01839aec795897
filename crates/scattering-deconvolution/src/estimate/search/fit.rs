//! Adjustment of a given number of Gaussians.

use adjust::{Adjustment, BlockId, Covariance, Kernel, ParameterBlock, Scale, Solution, SolveOptions};
use nalgebra::DMatrix;

use crate::estimate::result::Estimated;
use crate::estimate::search::observation::{BlockObservation, SharedResponse, term_from};
use crate::estimate::search::response::{Source, Term};
use crate::estimate::search::scene::{Row, Scene};
use crate::estimate::{EstimationOptions, Nuisance, TermShape};

/// Widths beyond this many times the longer side of the image are not followed. Over the image such a Gaussian is a
/// constant, and its width is not determined.
const LARGEST_WIDTH: f64 = 2.0;
/// Steps after which an adjustment is given up: those that end at all take some ten.
const MAX_ITERATIONS: usize = 60;

/// A Gaussian to begin with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::estimate) struct StartTerm {
    pub(in crate::estimate) term: Term,
    pub(in crate::estimate) unknown: Unknown,
}

/// What of a term is an unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::estimate) enum Unknown {
    WeightAndWidth,
    Weight,
    Nothing,
}

/// How well one block mean agrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::estimate) struct Agreement {
    /// Place in the list of scenes.
    pub(in crate::estimate) scene: usize,
    pub(in crate::estimate) block: [usize; 2],
    pub(in crate::estimate) numbers: usize,
    /// Modulus of the observed value, of what the model says, and of their difference.
    pub(in crate::estimate) observed: f64,
    pub(in crate::estimate) modelled: f64,
    pub(in crate::estimate) residual: f64,
    /// The difference in standard deviations.
    pub(in crate::estimate) size: f64,
}

/// The adjusted Gaussians.
#[derive(Debug, Clone)]
pub(in crate::estimate) struct Fit {
    pub(in crate::estimate) terms: Vec<Term>,
    /// Prior-scaled covariance of the parameters term by term: weight, then one width or two in pixels.
    pub(in crate::estimate) covariance: DMatrix<f64>,
    /// Sum of what the robust kernel makes of the squared residuals.
    pub(in crate::estimate) objective: f64,
    pub(in crate::estimate) numbers: usize,
    pub(in crate::estimate) unknowns: usize,
    pub(in crate::estimate) redundancy: i64,
    pub(in crate::estimate) sigma0: f64,
    pub(in crate::estimate) agreements: Vec<Agreement>,
    /// Drift and constant of each scene, as far as they were asked for.
    pub(in crate::estimate) nuisances: Vec<Vec<[Estimated; 2]>>,
}

/// Scenes with light and observations, and how they are adjusted.
pub(in crate::estimate) struct Problem<'s> {
    pub(in crate::estimate) scenes: Vec<&'s Scene>,
    pub(in crate::estimate) options: &'s EstimationOptions,
    /// Longer side of the image, pixels.
    pub(in crate::estimate) longer_side: f64,
    /// How many times larger than noise says the residuals of any sum of Gaussians are, at least one: what is an outlier
    /// is measured by it.
    pub(in crate::estimate) scale: f64,
}

impl Fit {
    /// Factor of the standard deviations where residuals are larger than noise says.
    pub(in crate::estimate) fn inflation(&self) -> f64 {
        inflation(self.sigma0)
    }

    /// Schwarz's criterion with an unknown variance factor: noise is never known so well that thousands of residuals do
    /// not show it.
    pub(in crate::estimate) fn bic(&self) -> f64 {
        let n = self.numbers as f64;
        n * (self.objective.max(f64::MIN_POSITIVE) / n).ln() + self.unknowns as f64 * n.ln()
    }

    /// Standard deviation of a parameter.
    pub(in crate::estimate) fn sigma(&self, index: usize) -> f64 {
        self.inflation() * self.covariance[(index, index)].max(0.0).sqrt()
    }
}

impl Problem<'_> {
    pub(in crate::estimate) fn nuisance_rows(&self) -> Vec<fn(&Row) -> [f64; 2]> {
        let mut rows: Vec<fn(&Row) -> [f64; 2]> = Vec::new();
        if self.options.has(Nuisance::Drift) {
            rows.push(|row| row.drift);
        }
        if self.options.has(Nuisance::Constant) {
            rows.push(|row| row.constant);
        }
        rows
    }

    /// Adjusts the terms from these starts.
    pub(in crate::estimate) fn fit(&self, starts: &[StartTerm]) -> Result<Fit, adjust::Error> {
        self.fit_with(self.huber_limit().map_or(Kernel::LeastSquares, Kernel::Huber), starts)
    }

    /// Adjusts the nuisances alone. Where scattering is all that there is to see, most observations are outliers, and
    /// where a robust adjustment finds no end, least squares does: it is only compared with others.
    pub(in crate::estimate) fn fit_nothing(&self) -> Result<Fit, adjust::Error> {
        self.fit(&[]).or_else(|_| self.fit_with(Kernel::LeastSquares, &[]))
    }

    fn huber_limit(&self) -> Option<f64> {
        self.options.huber_limit.map(|limit| limit * self.scale)
    }

    fn fit_with(&self, kernel: Kernel, starts: &[StartTerm]) -> Result<Fit, adjust::Error> {
        let largest = LARGEST_WIDTH * self.longer_side;
        let sources: Vec<(usize, &Source)> =
            self.scenes.iter().enumerate().filter_map(|(i, scene)| Some((i, scene.source.as_ref().ok()?))).collect();
        let shared: Vec<SharedResponse<'_>> =
            sources.iter().map(|(_, source)| SharedResponse::new(source, largest)).collect();
        let nuisances = self.nuisance_rows();
        let mut ids = Vec::with_capacity(sources.len());
        let mut network = Adjustment::new();
        let terms = self.add_terms(&mut network, starts)?;
        for (index, _) in &sources {
            ids.push(self.add_nuisances(&mut network, *index, &terms)?);
        }
        for (((index, _), shared), ids) in sources.iter().zip(&shared).zip(&ids) {
            let group = network.add_group(format!("scene {index}"));
            network.set_kernel(group, kernel)?;
            for mean in &self.scenes[*index].means {
                let (rows, block) = (mean.rows.as_slice(), mean.block);
                let observation =
                    BlockObservation { shared, rows, block, ids, terms: terms.len(), nuisances: &nuisances };
                let covariance = Covariance::from_sigmas(&vec![mean.sigma; mean.rows.len()]);
                network.add_observation(group, observation, &covariance)?;
            }
        }
        let options = SolveOptions { max_iterations: MAX_ITERATIONS, ..SolveOptions::default() };
        let solution = network.solve(&options)?;
        let used: Vec<usize> = sources.iter().map(|(index, _)| *index).collect();
        self.read(&solution, &terms, &used, &ids)
    }

    fn add_terms(&self, network: &mut Adjustment<'_>, starts: &[StartTerm]) -> Result<Vec<BlockId>, adjust::Error> {
        let mut out = Vec::with_capacity(starts.len());
        for (index, start) in starts.iter().enumerate() {
            let [across, down] = start.term.sigma_px.map(f64::ln);
            let (values, names) = match self.options.shape {
                TermShape::Round => (vec![start.term.weight, 0.5 * (across + down)], &["weight", "ln sigma"][..]),
                TermShape::Elliptic => {
                    (vec![start.term.weight, across, down], &["weight", "ln sigma across", "ln sigma down"][..])
                }
            };
            let named = names.iter().map(|name| format!("{name} {}", index + 1));
            let count = values.len();
            let block = network.add_block(ParameterBlock::euclidean(values).with_parameter_names(named));
            match start.unknown {
                Unknown::WeightAndWidth => {}
                Unknown::Weight => (1..count).try_for_each(|component| network.hold_parameter(block, component))?,
                Unknown::Nothing => network.hold(block)?,
            }
            out.push(block);
        }
        Ok(out)
    }

    /// The blocks on which the observations of a scene depend.
    fn add_nuisances(
        &self,
        network: &mut Adjustment<'_>,
        scene: usize,
        terms: &[BlockId],
    ) -> Result<Vec<BlockId>, adjust::Error> {
        let mut ids = terms.to_vec();
        for (nuisance, name) in [(Nuisance::Drift, "drift"), (Nuisance::Constant, "constant")] {
            if !self.options.has(nuisance) {
                continue;
            }
            let names = ["real", "imaginary"].map(|part| format!("{name} {scene} {part}"));
            let block = network.add_block(ParameterBlock::euclidean([0.0, 0.0]).with_parameter_names(names));
            if nuisance == Nuisance::Drift && !self.scenes[scene].sees_amplitude {
                network.hold_parameter(block, 0)?;
            }
            ids.push(block);
        }
        Ok(ids)
    }

    fn read(
        &self,
        solution: &Solution,
        terms: &[BlockId],
        used: &[usize],
        ids: &[Vec<BlockId>],
    ) -> Result<Fit, adjust::Error> {
        let (adjusted, covariance) = natural_parameters(solution, terms)?;
        let sigma0 = solution.sigma0().unwrap_or(f64::NAN);
        let inflation = inflation(sigma0);
        let mut nuisances = vec![Vec::new(); self.scenes.len()];
        for (scene, ids) in used.iter().zip(ids) {
            for &id in &ids[terms.len()..] {
                let sigma = solution.standard_deviations(id, Scale::Prior)?;
                let mut pairs = solution.values(id)?.iter().zip(sigma);
                let mut next = || {
                    let (value, sigma) = pairs.next().unwrap_or((&f64::NAN, f64::NAN));
                    Estimated { value: *value, sigma: sigma * inflation }
                };
                nuisances[*scene].push([next(), next()]);
            }
        }
        let agreements = self.agreements(solution.residuals(), used);
        let limit = self.huber_limit().unwrap_or(f64::INFINITY);
        let huber = |s: f64| if s <= limit { s * s } else { limit * (2.0 * s - limit) };
        Ok(Fit {
            terms: adjusted,
            covariance,
            objective: agreements.iter().map(|one| huber(one.size)).sum(),
            numbers: solution.observations(),
            unknowns: solution.unknowns(),
            redundancy: solution.redundancy(),
            sigma0,
            agreements,
            nuisances,
        })
    }

    fn agreements(&self, residuals: &[f64], used: &[usize]) -> Vec<Agreement> {
        let mut rest = residuals;
        let mut out = Vec::with_capacity(residuals.len());
        for &scene in used {
            for mean in &self.scenes[scene].means {
                let numbers = mean.rows.len().min(rest.len());
                let (own, others) = rest.split_at(numbers);
                rest = others;
                let modulus = |values: &mut dyn Iterator<Item = f64>| values.map(|v| v * v).sum::<f64>().sqrt();
                let residual = modulus(&mut own.iter().copied());
                let observed = modulus(&mut mean.rows.iter().map(|row| row.observed));
                let modelled = modulus(&mut mean.rows.iter().zip(own).map(|(row, v)| row.observed - v));
                let size = residual / mean.sigma;
                out.push(Agreement { scene, block: mean.block, numbers, observed, modelled, residual, size });
            }
        }
        out
    }
}

/// Standard deviations are as noise says, or as residuals say where these are larger.
fn inflation(sigma0: f64) -> f64 {
    if sigma0 > 1.0 { sigma0 } else { 1.0 }
}

/// Terms and their covariance, widths in pixels instead of their logarithms.
fn natural_parameters(solution: &Solution, blocks: &[BlockId]) -> Result<(Vec<Term>, DMatrix<f64>), adjust::Error> {
    let (mut terms, mut scale) = (Vec::new(), Vec::new());
    for &block in blocks {
        let values = solution.values(block)?;
        terms.extend(term_from(values));
        scale.push(1.0);
        scale.extend(values.iter().skip(1).map(|width| width.exp()));
    }
    let per_term = scale.len() / blocks.len().max(1);
    let mut covariance = DMatrix::zeros(scale.len(), scale.len());
    for (row, &first) in blocks.iter().enumerate() {
        for (column, &second) in blocks.iter().enumerate() {
            let part = solution.covariance_between(first, second, Scale::Prior)?;
            covariance.view_mut((row * per_term, column * per_term), part.shape()).copy_from(&part);
        }
    }
    let scaled = DMatrix::from_fn(scale.len(), scale.len(), |i, j| covariance[(i, j)] * scale[i] * scale[j]);
    Ok((terms, scaled))
}
