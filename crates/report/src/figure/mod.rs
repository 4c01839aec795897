//! Figures: drawings as SVG with a caption; rasters and clouds are PNG pictures inside them.

mod canvas;
mod chart;
mod cloud;
mod colour;
mod density;
mod deviation;
mod heat_map;
mod labels;
mod pictures;
mod station_graph;
mod svg;

pub use canvas::{Axes, Canvas, Drawn, robust_span, span, ticks};
pub use chart::{SIZE as CHART_SIZE, Series, curves, histogram, to_scale};
pub use cloud::{Direction, StationCloud, cloud_figure};
pub use colour::{CATEGORIES, ColourMap, NO_VALUE, hex};
pub use deviation::{LineOfSight, deviation_figure};
pub use heat_map::heat_map;
pub use labels::Labels;
pub use pictures::marks::{Mark, marked_figure};
pub use pictures::pattern::pattern_figures;
pub use pictures::picture::{Scale, raster_figure, rgb_figure};
pub use station_graph::{Edge, Node, station_graph};
pub use svg::{escape, open_svg};

/// A drawing with its caption.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Figure {
    pub(crate) svg: String,
    pub(crate) caption: String,
}

impl Figure {
    /// A whole `<svg>` element, without a caption; its size in pixels stands in it.
    pub fn new(svg: String) -> Self {
        Self { svg, caption: String::new() }
    }

    /// The `<svg>` element and the caption.
    pub fn parts(&self) -> [&str; 2] {
        [&self.svg, &self.caption]
    }

    /// The same with a caption below.
    #[must_use]
    pub fn caption(self, caption: impl Into<String>) -> Self {
        Self { caption: caption.into(), ..self }
    }
}

impl<S: Into<String>> From<(Figure, S)> for Figure {
    fn from((figure, caption): (Figure, S)) -> Self {
        figure.caption(caption)
    }
}
