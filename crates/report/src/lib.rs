#![doc = include_str!("../README.md")]

mod document;
mod error;
mod figure;

pub use document::{Alignment, Block, Column, Document, Merit, Place, Section, Table, millimetres, rounded};
pub use error::Error;
use error::Result;
pub use figure::{
    Axes, CATEGORIES, CHART_SIZE, Canvas, ColourMap, Direction, Drawn, Edge, Figure, Labels, LineOfSight, Mark,
    NO_VALUE, Node, Scale, Series, StationCloud, cloud_figure, curves, deviation_figure, escape, heat_map, hex,
    histogram, marked_figure, open_svg, pattern_figures, raster_figure, rgb_figure, robust_span, span, station_graph,
    ticks, to_scale,
};
