//! What was coloured, by name.

use std::fmt;
use std::path::PathBuf;

use commands::{Doubt, DoubtKind, Judged};
use report::Document;
use serde::Serialize;

use crate::colour::paint::{Colouring, Unseen};
use crate::colour::run::ColourRequest;

/// Seconds between two exposures that state no integration time from which on they are not of one moment: something that walks moves by a
/// centimetre.
const SAME_MOMENT_S: f64 = 0.01;

/// A cloud with the colours of another camera.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ColourSummary {
    /// The rig's folder.
    pub rig: String,
    /// The epoch.
    pub epoch: String,
    /// The range camera.
    pub from: String,
    /// The camera whose image gave the colours.
    pub by: String,
    /// Points with a colour.
    pub coloured: usize,
    /// Points outside the other camera's image.
    pub outside: usize,
    /// Points that something hides from the other camera, or that lie within a pixel of what does.
    pub hidden: usize,
    /// Pixels of the range image without a point on a surface.
    pub no_point: usize,
    /// What speaks against the result.
    pub doubts: Vec<Doubt>,
    /// Time taken, second.
    pub seconds: f64,
    /// The output folder.
    pub out: PathBuf,
}

impl ColourSummary {
    pub(super) fn new(
        request: &ColourRequest,
        [from, by]: &[String; 2],
        colouring: &Colouring,
        apart_s: Option<[f64; 2]>,
    ) -> Self {
        let apart = apart_s.filter(|[apart, longest]| *apart > longest.max(SAME_MOMENT_S));
        let doubt = apart.map(|[apart, _]| {
            let words = format!(
                "cameras {from} and {by} were exposed {apart:.3} s apart: where something moved, colours are those of something else"
            );
            Doubt::about(DoubtKind::Contradiction, request.epoch.as_str(), words)
        });
        Self {
            rig: request.rig.display().to_string(),
            epoch: request.epoch.clone(),
            from: from.clone(),
            by: by.clone(),
            coloured: colouring.count(None),
            outside: colouring.count(Some(Unseen::Outside)),
            hidden: colouring.count(Some(Unseen::Hidden)),
            no_point: colouring.count(Some(Unseen::NoPoint)),
            doubts: doubt.into_iter().collect(),
            seconds: 0.0,
            out: request.out.clone(),
        }
    }

    pub(super) fn nothing_seen(&self) -> String {
        format!(
            "camera {} sees none of the points of camera {}: {} are outside its image, {} hidden",
            self.by, self.from, self.outside, self.hidden
        )
    }
}

impl fmt::Display for ColourSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let lead = format!("Points of camera {} at {} in the colours of camera {}.", self.from, self.epoch, self.by);
        let mut document = Document::new("rangecam: colour", lead);
        document.merits([
            (self.coloured.to_string(), "points with a colour"),
            (self.hidden.to_string(), "hidden from it, or within a pixel of a rim"),
            (self.outside.to_string(), "outside its image"),
            (self.no_point.to_string(), "pixels without a point"),
        ]);
        document.warnings(&self.doubts);
        document.closing(format!(
            "took {:.1} s; written to {}: cloud.ply, uncoloured.ply, summary.json",
            self.seconds,
            self.out.display()
        ));
        document.fmt(f)
    }
}

impl Judged for ColourSummary {
    fn doubts(&self) -> &[Doubt] {
        &self.doubts
    }
}
