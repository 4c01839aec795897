//! How much two threads bring, and what two processors of the machine can bring at all.

use std::path::Path;
use std::time::Instant;

use nalgebra::Isometry3;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::files::Frames;
use crate::frames::Stream;
use crate::pairs::Points;
use crate::{Failure, Outcome};

/// Of so many runs, the least time counts.
const RUNS: usize = 15;

/// Prints how much faster two threads are (elapsed time, all ways alternating, least of some runs), what two one-thread
/// registrations at the same time reach that share nothing but the machine, and how many pairs get the same bits.
pub fn run(folder: &Path) -> Outcome {
    let frames = Frames::open(folder)?;
    let pool = |threads: usize| ThreadPoolBuilder::new().num_threads(threads).build();
    let (one, two, other) = (pool(1)?, pool(2)?, pool(1)?);
    let Some([first, _]) = frames.pairs(2).next() else { return Err("no pairs".into()) };
    let points = frames.points(first)?;
    let mut streams = [Stream::new(&frames, &points)?, Stream::new(&frames, &points)?];
    let (mut same_bits, mut sums) = (0, [0.0; 3]);
    for [target, source] in frames.pairs(2) {
        let points = [frames.points(target)?, frames.points(source)?];
        let mut least = [f64::INFINITY; 3];
        let mut same = true;
        for _ in 0..RUNS {
            let (alone, by_one) = timed(|| on(&one, &mut streams[0], &points))?;
            let (together, by_two) = timed(|| on(&two, &mut streams[0], &points))?;
            let [mine, theirs] = &mut streams;
            let (beside, _) = timed(|| {
                std::thread::scope(|scope| {
                    let others = scope.spawn(|| on(&other, theirs, &points));
                    let own = on(&one, mine, &points)?;
                    others.join().map_err(|_| "the other registration panicked")??;
                    Ok(own)
                })
            })?;
            same &= by_one == by_two;
            for (least, time) in least.iter_mut().zip([alone, together, beside]) {
                *least = least.min(time);
            }
        }
        same_bits += usize::from(same);
        sums.iter_mut().zip(least).for_each(|(sum, least)| *sum += least);
    }
    let [alone, together, beside] = sums;
    println!("faster {}\npossible {}\nsame_bits {same_bits}", alone / together, 2.0 * alone / beside);
    Ok(())
}

fn on(pool: &ThreadPool, stream: &mut Stream, [target, source]: &[Points; 2]) -> Result<Isometry3<f64>, Failure> {
    Ok(pool.install(|| stream.align(target, source))?.target_from_source)
}

/// What comes out, and the seconds it took.
fn timed(work: impl FnOnce() -> Result<Isometry3<f64>, Failure>) -> Result<(f64, Isometry3<f64>), Failure> {
    let start = Instant::now();
    let found = work()?;
    Ok((start.elapsed().as_secs_f64(), found))
}
