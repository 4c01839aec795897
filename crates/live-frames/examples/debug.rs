//! Debug.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::float_cmp, clippy::panic, clippy::print_stdout, dead_code)]
#[path = "../tests/common/mod.rs"]
mod common;
use common::*;
use live_frames::*;
fn main() {
    let sequence = Sequence { width: 320, height: 240, rays: 1, ..Sequence::default() };
    let mut processors: Vec<_> = [1000, 1].map(|r| Processor::new(sequence.camera(), &sequence.calibration(), stages(r), Limits::default()).unwrap()).into();
    for number in 55..110 {
        let frame = sequence.frame(number);
        for p in &mut processors {
        let found = p.process(frame.raw.samples(), number as f64 * INTERVAL_S).unwrap();
        let mut by: std::collections::BTreeMap<(Option<u32>, i64), (usize, usize, [usize; 4], f64)> = Default::default();
        for i in 0..found.range.len() {
            let (r, t) = (f64::from(found.range.as_slice()[i]), f64::from(frame.truth.range.as_slice()[i]));
            if (r - t).abs() > 2.5 {
                let e = by.entry((frame.truth.object.as_slice()[i], ((r - t) / 5.0).round() as i64)).or_insert((0, 0, [999, 0, 999, 0], 0.0));
                e.0 += 1;
                e.1 += usize::from(!found.flags.as_slice()[i].contains(range_image::Flags::UNWRAP_UNSURE));
                let (c, w) = (i % 320, i / 320);
                e.2 = [e.2[0].min(c), e.2[1].max(c), e.2[2].min(w), e.2[3].max(w)];
                e.3 = t;
            }
        }
        by.retain(|_, e| e.0 > 100);
        let c = found.counts;
        println!("{number} failed {} attached {} checked {} doubted {} mended {} guessed {} {by:?}", c.failed, c.attached, c.checked, c.doubted, c.mended, c.guessed);
        }
    }
}
