//! A survey whose truth is known.

#![allow(dead_code)]

pub mod bent;
pub mod judge;
pub mod scene;
pub mod survey;
pub mod wall;
