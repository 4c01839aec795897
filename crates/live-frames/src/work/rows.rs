//! A frame cut into chunks of whole rows, whatever the threads.

use range_image::Flags;
use rayon::prelude::*;

use crate::error::Result;
use crate::frame::ProcessedFrame;

/// A frame is cut into at most so many chunks.
pub(crate) const MOST_CHUNKS: usize = 64;

/// Some rows of the frame that is made.
pub(crate) struct Chunk<'a> {
    pub(crate) first_row: usize,
    pub(crate) range: &'a mut [f32],
    pub(crate) sigma: &'a mut [f32],
    pub(crate) amplitude: &'a mut [f32],
    pub(crate) flags: &'a mut [Flags],
    pub(crate) points: &'a mut [[f32; 3]],
}

/// A frame in chunks of so many rows, with something of its own for each, which `work` is done on.
pub(crate) fn for_each_chunk<T: Send>(
    frame: &mut ProcessedFrame,
    rows: usize,
    own: impl Iterator<Item = T>,
    work: impl Fn(&mut Chunk<'_>, &mut T) -> Result<()> + Sync,
) -> Result<()> {
    let length = (rows * frame.width()).max(1);
    let ProcessedFrame { range, sigma, amplitude, flags, points, .. } = frame;
    let [range, sigma, amplitude] = [range, sigma, amplitude].map(|plane| plane.as_mut_slice().chunks_mut(length));
    let planes = range.zip(sigma).zip(amplitude).zip(flags.as_mut_slice().chunks_mut(length));
    let chunks = planes.zip(points.chunks_mut(length)).enumerate();
    let mut chunks = chunks.map(|(number, ((((range, sigma), amplitude), flags), points))| Chunk {
        first_row: number * rows,
        range,
        sigma,
        amplitude,
        flags,
        points,
    });
    let mut own = own;
    let mut jobs: [Option<(Chunk<'_>, T, Result<()>)>; MOST_CHUNKS] =
        std::array::from_fn(|_| Some((chunks.next()?, own.next()?, Ok(()))));
    // Those that are there alone: threads share the array by halves, and the empty ones are at its end.
    let count = jobs.iter().flatten().count();
    let jobs = &mut jobs[..count];
    if rayon::current_num_threads() == 1 {
        jobs.iter_mut().flatten().for_each(|(chunk, own, result)| *result = work(chunk, own));
    } else {
        jobs.par_iter_mut().flatten().for_each(|(chunk, own, result)| *result = work(chunk, own));
    }
    jobs.iter_mut().flatten().try_for_each(|(_, _, result)| std::mem::replace(result, Ok(())))
}
