//! From samples to complex images, and the light that was scattered into them.

use range_image::{ComplexFrame, Flags, RawView};
use rayon::prelude::*;
use scattering_deconvolution::OutsideLightDetector;

use crate::calibration::{PreparedCalibration, Scattering};
use crate::error::{Error, Result};

/// Demodulates samples and finds scattered light, which is to be taken off row by row.
pub(crate) fn demodulated(
    raw: &RawView<'_>,
    calibration: &mut PreparedCalibration,
    most_missing: f64,
    complex: &mut ComplexFrame,
) -> Result<()> {
    calibration.demodulator.demodulate_view_into(raw, complex)?;
    let (missing, pixels) = (without_data(complex.flags.as_slice()), complex.flags.len());
    if missing as f64 > most_missing * pixels as f64 || missing == pixels {
        return Err(Error::Missing { missing, pixels, most: most_missing });
    }
    let Some(Scattering { restorer, outside }) = &mut calibration.scattering else { return Ok(()) };
    let may_detect = |detector: &&OutsideLightDetector| {
        complex.channels.iter().any(|channel| detector.may_detect(channel, &complex.flags))
    };
    // Light from outside is sought in whole images.
    let Some(detector) = outside.as_ref().filter(may_detect) else {
        return Ok(restorer.find_in_frame(complex, |_| ())?);
    };
    restorer.restore_frame_with(complex, |_| ())?;
    for channel in &complex.channels {
        detector.detect(channel, &mut complex.flags)?;
    }
    Ok(())
}

/// Number of pixels without data.
fn without_data(flags: &[Flags]) -> usize {
    // Counts of a block fit into the width of a flag, so that many are compared at once.
    let of_block = |block: &[Flags]| {
        let count = block.iter().fold(0_u16, |sum, flags| sum.wrapping_add(flags.bits() >> 7 & 1));
        usize::from(count)
    };
    flags.par_chunks(1 << 12).with_min_len(8).map(of_block).sum()
}
