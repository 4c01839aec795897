//! The adjustment of all cameras at once.

use std::collections::BTreeMap;

use calibration_network::functional_model::{Datum, Setup, Solved, Start, usual_sigmas};
use calibration_network::start_values::calibration_from;
use calibration_network::weakness::Strength;
use self_calibration::{CalibrationOptions, NetworkDatum, TermSelection, solve_rig_rejecting};

use crate::alone::{Alone, has_control, selection};
use crate::mountings::Mountings;
use crate::names::Joined;
use crate::rig::Rig;
use crate::{Error, Result};

/// Inflation from which on the weakest combination of a camera's terms is told although it is accepted.
const WORTH_TELLING: f64 = 100.0;

/// The adjustments of the cameras, which are one.
pub(crate) struct Adjusted<'j> {
    pub(crate) setups: Vec<Setup<'j>>,
    pub(crate) solved: Vec<Solved>,
    pub(crate) diagnosis: Vec<String>,
}

/// Refuses control without the datum that takes it, and the other way round.
pub(crate) fn check_datum(rig: &Rig, options: &CalibrationOptions) -> Result<()> {
    let control: Vec<&str> =
        rig.cameras.iter().filter(|camera| has_control(&camera.network)).map(|camera| camera.name.as_str()).collect();
    match options.datum {
        NetworkDatum::Free if !control.is_empty() => Err(Error::Datum(format!(
            "a free network takes its datum from inner constraints, but targets or stations of {} have standard deviations \
             as control; ask for the datum `control`, or leave the standard deviations out",
            control.join(", ")
        ))),
        NetworkDatum::Control if control.is_empty() => {
            Err(Error::Datum("control was asked for, but no target and no station has standard deviations".to_owned()))
        }
        _ => Ok(()),
    }
}

/// Adjusts all cameras from what was found of each by itself.
pub(crate) fn adjust<'j>(
    rig: &Rig,
    alone: &[Alone],
    mountings: &Mountings,
    joined: &'j Joined,
    options: &CalibrationOptions,
) -> Result<Adjusted<'j>> {
    let datum = if options.datum == NetworkDatum::Control { Datum::Control } else { Datum::Inner };
    let mut setups: Vec<Setup<'j>> = Vec::with_capacity(rig.cameras.len());
    for (index, (camera, alone)) in rig.cameras.iter().zip(alone).enumerate() {
        let (network, mounting) = (&joined.networks[index], mountings.cameras[index]);
        let automatic = selection(camera, options) == TermSelection::Auto;
        setups.push(Setup {
            network,
            start: Start {
                stations: joined.epochs.iter().map(|epoch| epoch * mounting).collect(),
                targets: joined.targets.clone(),
                relative: None,
                mounting: (index > 0).then_some(mounting),
            },
            unused: None,
            calibration: calibration_from(network, alone.camera, &alone.models),
            estimated: alone.estimated.clone(),
            ranged: network.stations.iter().map(|station| !options.without_ranges.contains(&station.name)).collect(),
            passive: false,
            datum,
            geometry_held: false,
            camera_prior: None,
            term_sigmas: if automatic { usual_sigmas(network) } else { BTreeMap::new() },
            excluded: joined.excluded[index].clone(),
        });
    }
    let solved = solve_rig_rejecting(&mut setups, options.rejection_level)?;
    let mut diagnosis = Vec::new();
    for ((camera, setup), solved) in rig.cameras.iter().zip(&setups).zip(&solved) {
        let Some(strength) = setup.strength(solved)? else { continue };
        if strength.inflation > options.largest_inflation {
            return Err(Error::of(&camera.name, strength.error()));
        }
        if strength.inflation > WORTH_TELLING {
            diagnosis.push(format!("camera `{}`: {}", camera.name, Strength::sentence(&strength)));
        }
    }
    Ok(Adjusted { setups, solved, diagnosis })
}
