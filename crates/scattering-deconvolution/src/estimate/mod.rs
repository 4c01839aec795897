//! Estimation of the point spread function from captures that show what is scattered.

mod report;
mod result;
mod search;
mod views;

pub use result::{Ambiguity, Candidate, CaptureReport, Estimated, NuisanceValues, PsfEstimate, PsfParameter, Verdict};
pub use views::capture::{Capture, ForegroundCapture, TwoPlaneCapture, true_phases};
pub use views::mask::object_mask;
pub use views::options::{EstimationOptions, Nuisance, TermCount, TermShape};

use range_image::Raster;

use crate::{Error, Result};
use search::fit::Problem;
use search::scene::{Blind, Scene, scenes};
use search::selection::choose;
use search::start::Dictionary;
use views::blocks::Blocks;
use views::mask::{dilated, find_object};

/// Fewest block means from which anything is concluded. A choice: fewer leave little to judge the fit by.
const FEWEST_BLOCKS: usize = 30;
/// Rounds of rejecting blocks and adjusting again. A choice; blocks at the limit may go to and fro after that.
const ROUNDS: usize = 3;

/// Estimates the scattered part of the point spread function from captures of one camera, all together.
///
/// Captures are pairs `(&with_object, &without_object)` of averaged frames, [`ForegroundCapture`]s with a mask of their
/// own, [`TwoPlaneCapture`]s, or a mixture of them as [`Capture`]s. Each frequency of each capture is observed; all see
/// the same point spread function.
///
/// # Errors
/// Options out of their domain, no captures, and captures whose planes, sizes or frequencies do not belong together.
/// What the captures do not tell is no error but a [`Verdict`].
pub fn estimate_psf<'a, C>(captures: &[C], options: &EstimationOptions) -> Result<PsfEstimate>
where
    C: Copy + Into<Capture<'a>>,
{
    options.validate()?;
    let captures: Vec<Capture<'a>> = captures.iter().map(|capture| (*capture).into()).collect();
    let blocks = Blocks::new(common_size(&captures)?, options.block_px);
    let mut changed: Vec<Raster<bool>> = captures.iter().map(|capture| first_mask(capture, options)).collect();
    let first_scenes = all_scenes(&captures, blocks, &changed);
    let mut current = first_scenes.clone();
    let mut round = 0;
    loop {
        if let Some(what) = blindness(&current) {
            return Ok(report::blind(&current, what));
        }
        let longer_side = blocks.pixels[0].max(blocks.pixels[1]) as f64;
        let mut problem = Problem { scenes: current.iter().collect(), options, longer_side, scale: 1.0 };
        let dictionary = Dictionary::new(&problem);
        problem.scale = dictionary.scale();
        let choice = choose(&problem, &dictionary)?;
        round += 1;
        if round < ROUNDS && report::reject(&problem, &choice.fit, &mut changed) {
            current = all_scenes(&captures, blocks, &changed);
            continue;
        }
        // What is narrower than the rim about the object is hidden by it.
        let narrowest = options.rim_px.saturating_add(blocks.edge) as f64;
        let limit = options.significance * dictionary.weight_sigma(narrowest) * choice.fit.inflation();
        return Ok(report::estimate(&problem, choice, &first_scenes, limit));
    }
}

fn common_size(captures: &[Capture<'_>]) -> Result<[usize; 2]> {
    let mut size = None;
    for (index, capture) in captures.iter().enumerate() {
        let own = capture.checked_size()?;
        if *size.get_or_insert(own) != own {
            let reason = format!("capture {index} has {own:?} pixels, those before it have {size:?}");
            return Err(Error::Capture { reason });
        }
    }
    size.ok_or_else(|| Error::Capture { reason: "there are no captures".to_owned() })
}

/// Pixels whose own light may have changed.
fn first_mask(capture: &Capture<'_>, options: &EstimationOptions) -> Raster<bool> {
    match capture {
        Capture::Foreground(capture) => capture.object.map_or_else(
            || find_object(capture.with_object, capture.without_object, options),
            |object| dilated(object, options.rim_px),
        ),
        Capture::TwoPlane(capture) => capture.observed.flags.map(|_| false),
    }
}

fn all_scenes(captures: &[Capture<'_>], blocks: Blocks, changed: &[Raster<bool>]) -> Vec<Scene> {
    let parts = captures.iter().zip(changed).enumerate();
    parts.flat_map(|(index, (capture, changed))| scenes(index, capture, blocks, changed)).collect()
}

/// Why nothing can be said, where that is so.
fn blindness(scenes: &[Scene]) -> Option<Ambiguity> {
    let seen = scenes.iter().filter(|scene| scene.source.is_ok());
    let blocks: usize = seen.map(|scene| scene.means.len()).sum();
    let is_blind = |blind: Blind| scenes.iter().any(|scene| scene.source.as_ref().err() == Some(&blind));
    if blocks >= FEWEST_BLOCKS {
        None
    } else if scenes.iter().any(|scene| scene.source.is_ok()) {
        Some(Ambiguity::NoBackground)
    } else if is_blind(Blind::LostLight) {
        Some(Ambiguity::ObjectLightLost)
    } else {
        Some(Ambiguity::NoObjectLight)
    }
}
