//! The pose of the first frame, which is the datum.

use std::path::Path;

use nalgebra::Isometry3;
use pipeline::{Error, Result};

use crate::register::guess::Guess;
use crate::track::frames::FrameSource;

/// Where the pose of the first frame comes from.
pub(crate) struct Start {
    guess: Option<(String, Guess)>,
}

impl Start {
    pub(crate) fn read(guess: Option<&Path>) -> Result<Self> {
        let Some(path) = guess else { return Ok(Self { guess: None }) };
        let words = path.display().to_string();
        match Guess::read(path)? {
            Guess::Matrix(_) => Err(request_error(format!(
                "{words} holds one matrix, which is a guess for two clouds; for tracking name stations.csv or a \
                 trajectory with the pose of the first frame"
            ))),
            guess => Ok(Self { guess: Some((words, guess)) }),
        }
    }

    /// The pose of a frame; `None` where nothing is known of it.
    pub(crate) fn pose(&self, source: &FrameSource, station: &str, timestamp_s: f64) -> Option<Isometry3<f64>> {
        match &self.guess {
            Some((_, guess)) => guess.pose(station, timestamp_s),
            None => source.approximate_pose(station),
        }
    }

    /// What fixes the world, once it is known from which frame on there is a pose.
    pub(crate) fn datum(&self, pose: Option<Isometry3<f64>>, station: &str, timestamp_s: f64) -> Result<String> {
        match (&self.guess, pose) {
            (Some((words, _)), Some(_)) => Ok(format!("frame {station} held at its pose in {words}")),
            (Some((words, _)), None) => Err(request_error(format!(
                "{words}: has no pose of frame {station} (time {timestamp_s} s), the first that shows surfaces"
            ))),
            (None, Some(_)) => Ok(format!("frame {station} held at its pose in stations.csv")),
            (None, None) => Ok(format!("the camera's axes at frame {station}: x right, y up, looking along -z")),
        }
    }
}

fn request_error(message: String) -> Error {
    Error::Request { command: "register", message }
}
