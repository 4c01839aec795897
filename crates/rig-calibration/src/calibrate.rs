//! The entry: a rig in, its calibration or the reason for none out.

use self_calibration::{CalibrationOptions, Error as Cause};

use crate::adjustment::{adjust, check_datum};
use crate::alone::{Alone, alone, placed};
use crate::mountings;
use crate::names::Joined;
use crate::outcome::{RigOutcome, outcome_of};
use crate::rig::Rig;
use crate::world::World;
use crate::{Error, Result};

/// Calibrates all cameras of a rig in one adjustment: lens and range terms of each, the mounting of each on the rig, one
/// unknown for all epochs, poses of the rig, and targets.
///
/// Each range camera is calibrated by itself first; that gives start values, the choice of terms, and finds what contradicts
/// within one camera. Cameras of images alone, and range cameras that are too weak by themselves, are placed among the
/// targets of the others. Mountings follow in closed form from the poses at shared epochs. Then all observations go into one
/// adjustment, whose gross errors are rejected as by [`self_calibration::calibrate`].
///
/// Of the options `method` is not asked: each camera has one step.
///
/// # Errors
/// Whatever is wrong with the rig, or with the network of one camera, by name; [`Error::Contradiction`] where stations of a
/// camera do not fit one mounting, with the epochs that they fit instead.
pub fn calibrate_rig(rig: &Rig, options: &CalibrationOptions) -> Result<RigOutcome> {
    rig.validate()?;
    check_datum(rig, options)?;
    let (alone, world) = all_alone(rig, options)?;
    let mountings = mountings::find(rig, &alone, &world)?;
    let joined = Joined::new(rig, &alone, &mountings, &world);
    let adjusted = adjust(rig, &alone, &mountings, &joined, options)?;
    outcome_of(rig, &alone, &adjusted, &joined.left_out, options)
}

/// Every camera before the adjustment of the rig, in one frame.
fn all_alone(rig: &Rig, options: &CalibrationOptions) -> Result<(Vec<Alone>, World)> {
    let mut found: Vec<Option<Alone>> = vec![None; rig.cameras.len()];
    let mut weak: Option<(usize, Cause)> = None;
    for (index, camera) in rig.cameras.iter().enumerate().filter(|(_, camera)| camera.has_ranges()) {
        match alone(camera, options)? {
            Ok(own) => found[index] = Some(own),
            Err(cause) => weak = weak.or(Some((index, cause))),
        }
    }
    let Some(first) = found.iter().flatten().next() else {
        // Validated: there is a camera with ranges.
        let (index, cause) =
            weak.unwrap_or((0, Cause::MethodNeeds { method: "rig".to_owned(), needs: "it needs ranges".to_owned() }));
        return Err(Error::of(&rig.cameras[index].name, cause));
    };
    let mut world = World::new(first, rig);
    for (camera, own) in rig.cameras.iter().zip(&mut found) {
        if let Some(own) = own {
            world.take(&camera.name, own)?;
        }
    }
    let mut all = Vec::with_capacity(found.len());
    for (camera, own) in rig.cameras.iter().zip(found) {
        if let Some(own) = own {
            all.push(own);
            continue;
        }
        let own = placed(camera, &world, options)?;
        world.add(&own);
        all.push(own);
    }
    Ok((all, world))
}
