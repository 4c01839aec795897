//! Matroska as the Azure Kinect records it: depth, infrared, colour, inertial unit, tags and the factory calibration.
//!
//! A reader of its own: all that is needed of the format is a walk over its elements, which takes recordings whose sizes were
//! left open or that break off.

mod blocks;
mod elements;
mod reader;
mod tags;
mod tracks;

pub(crate) use reader::Matroska;
