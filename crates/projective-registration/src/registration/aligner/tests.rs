#![allow(clippy::unwrap_used)]
use std::sync::Arc;

use super::*;
use crate::Projection;

/// A corner of three planes, seen from different places: `shift` along the axis.
fn corner(shift: f64) -> Vec<[f64; 3]> {
    let ray = |k: usize| ((k % 160) as f64 / 160.0 - 0.5, 0.4 - (k / 160) as f64 / 160.0);
    let depth = |(u, v): (f64, f64)| {
        let planes = [(u + 1.0, 2.0), (1.2 - u, 2.2), (1.0 - v, 2.1)];
        planes.map(|(slope, distance)| (distance - shift) / slope.max(0.1)).into_iter().fold(f64::INFINITY, f64::min)
    };
    (0..160 * 120).map(ray).map(|r| [r.0 * depth(r), r.1 * depth(r), -depth(r)]).collect()
}

/// Where the lists begin and how much they hold: another place or size would mean that memory was asked for.
fn memory(aligner: &FrameAligner, frame: &OrganisedFrame) -> Vec<(usize, usize)> {
    let mut memory = frame.memory();
    memory.push((aligner.chunks.as_ptr() as usize, aligner.chunks.capacity()));
    memory.push((aligner.scratch.as_ptr() as usize, aligner.scratch.capacity()));
    memory.push((aligner.cells.as_ptr() as usize, aligner.cells.capacity()));
    memory
}

#[test]
fn memory_is_used_again() {
    let projection = Arc::new(Projection::pinhole(160, 120, [160.0; 2], [80.0, 64.0]).unwrap());
    let mut aligner = FrameAligner::new(FrameAlignmentOptions::default()).unwrap();
    let target = OrganisedFrame::new(&projection, &corner(0.0), None).unwrap();
    let mut source = OrganisedFrame::new(&projection, &corner(0.02), None).unwrap();
    let first = aligner.align(&source, &target, &Isometry3::identity()).unwrap();
    let before = memory(&aligner, &source);
    for shift in [0.01, 0.03, 0.02] {
        source.update(&corner(shift), None).unwrap();
        let again = aligner.align(&source, &target, &Isometry3::identity()).unwrap();
        assert_eq!(memory(&aligner, &source), before);
        if shift.to_bits() == 0.02_f64.to_bits() {
            assert_eq!(again, first);
        }
    }
}
