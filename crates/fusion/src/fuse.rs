//! The whole way from points to surfels.

use nalgebra::DMatrix;
use point_uncertainty::{CommonErrors, PointErrors, Shares, Source};
use rayon::prelude::*;
use statistics::upper_median;

use crate::common::{self, Conditioned, Row, Squares, condition, form, split, variance_factors, without_shared};
use crate::input::{Observation, Observations, Registered};
use crate::options::{CommonErrorUse, FusionOptions};
use crate::outcome::{Fused, Surfel};
use crate::patches::{if_larger, noise_ratio, patches, seeds};
use crate::sight::{self, Scene};
use crate::surfels::{
    self, Alone, Bend, Estimate, FARTHEST, Gathered, Owner, estimate, gather, give_up, is_even, nonempty,
};
use crate::{Error, Result};

/// Points that common errors are estimated from, about, in two passes: the second from points that the first has moved to within what
/// it left. More tell little more than their time. The third is for an error that all frames share: frames that it had set apart meet then.
const POINTS_FOR_COMMON: [usize; 3] = [60_000, 200_000, 200_000];
/// Points that their noise is judged by, about, and how many of them lie together.
const POINTS_FOR_NOISE: usize = 200_000;
const TOGETHER: usize = 1000;
/// Part of the places beyond which those whose frames disagree are brought together once more: of surveys that err as stated 0.02 to 0.1 %
/// are said to, of a Kinect's 4 to 30 %.
const DISPUTED: f64 = 0.01;
/// Common errors, without the nodes of a shared error, beyond which they are not estimated: their dense matrices would take gigabytes.
const MOST_COMMON: usize = 1500;

/// Fuses registered points: each surface once, each fused point with its standard deviation from all sources.
///
/// # Errors
/// See [`Error`]; what was wrong is named with its value.
pub fn fuse(
    input: &Registered<'_>,
    errors: &dyn PointErrors,
    common: &CommonErrors,
    options: &FusionOptions,
) -> Result<Fused> {
    options.check()?;
    input.check()?;
    let common = &without_shared(options.shared_error, common)?;
    let none = vec![0.0; common.errors().len()];
    let nodes = options.shared_error.map_or(0, |grid| grid.columns().len());
    let first = input.observe(errors, common, &none, options.voxel_m)?;
    above_noise(&first, options)?;
    let estimates = options.common_errors == CommonErrorUse::Estimate
        && (nodes > 0 || (0..none.len()).any(|at| common.covariance()[(at, at)] > 0.0))
        && none.len() - nodes <= MOST_COMMON;
    let task = Task { input, errors, options };
    let mut found = Conditioned::nothing(input.centres.len(), common);
    let few = thinned(&first, POINTS_FOR_NOISE, TOGETHER);
    let within = patches(few.as_ref().unwrap_or(&first), errors, common)?.noise_ratio();
    let noise = if_larger(within);
    let noisier = |of: Observations| if noise > 1.0 { of.noisier(|_| noise) } else { of };
    let mut observations = noisier(first);
    if !estimates {
        return task.finish(common, &observations, within, found);
    }
    for (pass, points) in POINTS_FOR_COMMON.into_iter().enumerate() {
        if pass > 1 && found.shared.is_none() {
            break;
        }
        let few = thinned(&observations, points, 1);
        let few = few.as_ref().unwrap_or(&observations);
        let present = common_of(common, &found.posterior.covariance)?;
        let patches = patches(few, errors, &present)?;
        found = condition(&task, &found, few, &patches, common, pass > 0)?;
        observations = noisier(input.observe(errors, common, found.posterior.values.as_slice(), options.voxel_m)?);
    }
    task.finish(&common_of(common, &found.posterior.covariance)?, &observations, within, found)
}

/// What is fused, and how.
pub(crate) struct Task<'a> {
    pub input: &'a Registered<'a>,
    pub errors: &'a dyn PointErrors,
    pub options: &'a FusionOptions,
}

/// The same errors with another covariance.
fn common_of(common: &CommonErrors, covariance: &DMatrix<f64>) -> Result<CommonErrors> {
    CommonErrors::new(common.errors().to_vec(), covariance.clone()).map_err(|_| Error::Decomposition)
}

/// Refuses cells that noise is larger than.
fn above_noise(observations: &Observations, options: &FusionOptions) -> Result<()> {
    let mut variances: Vec<f64> = observations.all.par_iter().map(Observation::variance).collect();
    let sigma_m = upper_median(&mut variances).sqrt();
    let farthest = FARTHEST as f64 - 1.0;
    if options.gate() * sigma_m > farthest * options.voxel_m {
        let least_m = options.gate() * sigma_m / farthest;
        return Err(Error::CellsBelowNoise { voxel_m: options.voxel_m, sigma_m, least_m });
    }
    Ok(())
}

/// Some of the points, chosen by their place alone, so many that are next to each other at a time; `None` where all serve.
fn thinned(observations: &Observations, points: usize, together: usize) -> Option<Observations> {
    let step = observations.all.len().div_ceil(points);
    (step > 1).then(|| {
        // The order is that of cells and coordinates: it does not know the caller's.
        let kept = || (0..observations.all.len()).filter(|at| (at / together).is_multiple_of(step));
        Observations {
            all: kept().map(|at| observations.all[at]).collect(),
            keys: kept().map(|at| observations.keys[at]).collect(),
            lattice: observations.lattice,
        }
    })
}

impl Task<'_> {
    /// The fused cloud of points that the common errors which were found have been taken off, and whose noise `within` frames is so many times
    /// as large as stated, and taken so; `common` are the errors that remain.
    fn finish(
        &self,
        common: &CommonErrors,
        observations: &Observations,
        within: f64,
        found: Conditioned,
    ) -> Result<Fused> {
        let Self { input, options, .. } = *self;
        let (mut gathered, mut bends) = self.places(common, observations, &found.layers)?;
        let squares = self.rows(&gathered, observations, common)?.1;
        // Half of the places may be where frames see different things.
        let between = if_larger(noise_ratio(squares.iter().map(|of| (of.sum, of.dof)), 0.5));
        let noisier = (between > 1.0).then(|| observations.noisier(|_| between));
        let observations = noisier.as_ref().unwrap_or(observations);
        if noisier.is_some() {
            (gathered, bends) = self.places(common, observations, &found.layers)?;
        }
        let factors = variance_factors(&gathered, &self.rows(&gathered, observations, common)?.1);
        if factors.iter().filter(|factor| **factor > 1.0).count() as f64 > DISPUTED * factors.len() as f64 {
            gathered = self.places_of_disputed(common, observations, &found.layers, &gathered, &factors)?;
            bends = surfels::bends(&gathered.seeds, &gathered.estimates, options.voxel_m);
        }
        let (mut contradictions, mut outvoted) = (Vec::new(), 0);
        loop {
            nonempty(&gathered, observations)?;
            let (rows, surfels) = self.surfels(&gathered, &bends, observations, common)?;
            let scene = Scene::new(&surfels, input.centres);
            let pairs = sight::contradictions(&scene, options);
            let stays = sight::stay(&surfels, &pairs);
            let staying = stays.iter().filter(|stays| **stays).count();
            if staying < surfels.len() {
                let gone = pairs.iter().filter(|pair| !(stays[pair.front as usize] && stays[pair.behind as usize]));
                contradictions.extend(gone.map(|pair| pair.found));
                outvoted += surfels.len() - staying;
                give_up(&mut gathered, &mut bends, &stays, Owner::Outvoted);
                continue;
            }
            contradictions.extend(pairs.iter().map(|pair| pair.found));
            let mut fronts: Vec<u32> = pairs.iter().map(|pair| pair.front).collect();
            fronts.sort_unstable();
            fronts.dedup();
            let unfused = sight::reasons(&scene, observations, &gathered.owners, options.gate());
            return Ok(Fused {
                surfel_of_point: surfels_of_points(&gathered, observations),
                strongest: gathered.estimates.iter().zip(&bends).map(strongest).collect(),
                surfels,
                unfused,
                contradictions,
                outvoted,
                seen_through: fronts.len(),
                noise_factor: if_larger(within) * between,
                noise_within_frames: within,
                apart: found.apart,
                shared_error: found.shared,
                corrections: found.posterior.values.iter().copied().collect(),
                common: common.clone(),
                rows,
            });
        }
    }

    /// Places whose points lie on planes, and what surfaces do around them.
    fn places(
        &self,
        common: &CommonErrors,
        observations: &Observations,
        layers: &[u32],
    ) -> Result<(Gathered, Vec<Bend>)> {
        let Self { errors, options, .. } = *self;
        let gate = options.gate();
        let patches = patches(observations, errors, common)?;
        let seeds = seeds(&patches, &observations.lattice, layers, gate);
        let mut gathered = gather(observations, &patches, &seeds, layers, gate);
        nonempty(&gathered, observations)?;
        split(&mut gathered, observations, errors, common, options.level)?;
        let mut bends = surfels::bends(&gathered.seeds, &gathered.estimates, options.voxel_m);
        let is_even = is_even(&gathered, &bends, options);
        give_up(&mut gathered, &mut bends, &is_even, Owner::Uneven);
        Ok((gathered, bends))
    }

    /// Places once more, points being as noisy as frames show where they disagree: what stood in layers by what was stated of it becomes one
    /// surface. Estimates are by the noise that is stated: how much larger it is there is in [`Surfel::variance_factor`].
    fn places_of_disputed(
        &self,
        common: &CommonErrors,
        observations: &Observations,
        layers: &[u32],
        before: &Gathered,
        factors: &[f64],
    ) -> Result<Gathered> {
        let noisier = observations.noisier(|at| match before.owners[at] {
            Owner::Place(place) => factors[place as usize],
            _ => 1.0,
        });
        let mut gathered = self.places(common, &noisier, layers)?.0;
        let places = gathered.seeds.par_iter().zip(&gathered.members).zip(&mut gathered.estimates);
        places.with_min_len(64).for_each(|(((_, seed), members), place)| {
            if let Some(stated) = estimate(seed, members, &observations.all, &Alone) {
                *place = stated;
            }
        });
        Ok(gathered)
    }

    /// Derivatives of the heights of places by common errors, and by how much their frames differ.
    fn rows(
        &self,
        gathered: &Gathered,
        observations: &Observations,
        common: &CommonErrors,
    ) -> Result<(Vec<Row>, Vec<Squares>)> {
        let of_place = |place: &Estimate| {
            let rows = common::rows(place, &place.normal, &observations.all, self.errors, common)?;
            let mean = common::mean(place, &rows);
            // Frames of one station show noise, and little of what stations disagree by.
            let squares = match common::by_station(place, &rows) {
                Some((stations, rows)) if stations.frames.len() > 1 => Squares::new(&stations, &rows, common),
                _ => Squares::new(place, &rows, common),
            };
            Ok((mean, squares))
        };
        let all: Vec<_> = gathered.estimates.par_iter().with_min_len(64).map(of_place).collect::<Result<_>>()?;
        Ok(all.into_iter().unzip())
    }

    /// The surfels of places, with the derivatives of their heights by common errors.
    fn surfels(
        &self,
        gathered: &Gathered,
        bends: &[Bend],
        observations: &Observations,
        common: &CommonErrors,
    ) -> Result<(Vec<Row>, Vec<Surfel>)> {
        let (rows, squares) = self.rows(gathered, observations, common)?;
        let factors = variance_factors(gathered, &squares);
        let surfels = (0..rows.len())
            .into_par_iter()
            .with_min_len(64)
            .map(|at| {
                let place = &gathered.estimates[at];
                let amplitude = amplitude(self.input, &gathered.members[at], observations);
                let shares = shares(place, bends[at].left, &rows[at], common);
                surfel(place, self.options.voxel_m, bends[at], shares, factors[at], amplitude)
            })
            .collect();
        Ok((rows, surfels))
    }
}

fn surfel(place: &Estimate, voxel_m: f64, bend: Bend, shares: Shares, variance_factor: f64, amplitude: f64) -> Surfel {
    let mut frames: Vec<u32> = place.frames.iter().map(|frame| frame.frame).collect();
    frames.sort_unstable();
    Surfel {
        position: place.position - place.normal * bend.above_m,
        normal: place.normal,
        radius_m: place.radius_m(voxel_m),
        amplitude,
        points: place.count,
        frames,
        shares,
        shape_variance: bend.variance,
        variance_factor,
    }
}

/// The variance of a place's height by sources, with the part of its own that tests have left; of what two have in common each takes half.
fn shares(place: &Estimate, left: f64, row: &Row, common: &CommonErrors) -> Shares {
    let mut shares = Shares::default();
    shares.parts[Source::Noise as usize] = place.noise_variance * left;
    shares.parts[Source::Sensor as usize] = place.sensor_variance * left;
    for (column, by) in row {
        let source = common.errors()[*column as usize].source;
        shares.parts[source as usize] += form(&vec![(*column, *by)], row, common.covariance());
    }
    shares
}

/// The neighbourhood with the largest part of a place's variance, and its shift, of which tests have left as much as of the variance.
fn strongest((place, bend): (&Estimate, &Bend)) -> (u64, f64) {
    let (neighbourhood, shift) = place.strongest;
    (neighbourhood, shift * bend.left.sqrt())
}

fn amplitude(input: &Registered<'_>, members: &[u32], observations: &Observations) -> f64 {
    let Some(amplitudes) = input.amplitudes else { return f64::NAN };
    let values = members.iter().map(|at| amplitudes[observations.all[*at as usize].index as usize]);
    let (sum, count) =
        values.filter(|value| value.is_finite()).fold((0.0, 0.0), |(sum, count), v| (sum + v, count + 1.0));
    if count > 0.0 { sum / count } else { f64::NAN }
}

fn surfels_of_points(gathered: &Gathered, observations: &Observations) -> Vec<Option<u32>> {
    let mut of_point = vec![None; observations.all.len()];
    for (observation, owner) in observations.all.iter().zip(&gathered.owners) {
        if let Owner::Place(place) = owner {
            of_point[observation.index as usize] = Some(*place);
        }
    }
    of_point
}
