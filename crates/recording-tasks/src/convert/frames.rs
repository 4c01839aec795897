//! Frames of a survey from images: depths with the light of the same exposure.

use std::collections::VecDeque;

use commands::range_io::survey::{InputFrame, Level};
use range_image::Raster;
use recordings::Image;

/// Images of one exposure have one time, or what a recorder's own clock adds: less than this, which no camera's frames are
/// apart. Larger, images of neighbouring frames could be paired.
const SAME_EXPOSURE_NS: i64 = 2_000_000;

/// Images of light that wait for their depths: more than a recorder writes between the two.
const MOST_WAITING: usize = 8;

/// Depths that wait for their light, for the same reason.
const MOST_PENDING: usize = 4;

/// A frame on its way into the survey.
#[derive(Debug, Clone)]
pub(super) struct Pending {
    pub time_ns: i64,
    pub image: Image,
    pub temperature_c: Option<f64>,
}

/// Pairs images with those of the light of the same exposure, whichever comes first.
#[derive(Default)]
pub(super) struct Pairs {
    /// Whether there is light to wait for.
    has_light: bool,
    pending: VecDeque<Pending>,
    light: VecDeque<(i64, Image)>,
}

impl Pairs {
    /// Nothing yet; `has_light` says whether images of light are to be expected.
    pub fn new(has_light: bool) -> Self {
        Self { has_light, ..Self::default() }
    }

    /// A new image; what is complete by now comes out.
    pub fn add(&mut self, pending: Pending) -> Vec<(Pending, Option<Image>)> {
        self.pending.push_back(pending);
        self.complete(MOST_PENDING)
    }

    /// An image of light.
    pub fn add_light(&mut self, time_ns: i64, image: Image) -> Vec<(Pending, Option<Image>)> {
        self.light.push_back((time_ns, image));
        if self.light.len() > MOST_WAITING {
            self.light.pop_front();
        }
        self.complete(MOST_PENDING)
    }

    /// What is left at the end.
    pub fn finish(&mut self) -> Vec<(Pending, Option<Image>)> {
        self.complete(0)
    }

    /// Frames that have their light, and those before the last `waiting` that will have none any more.
    fn complete(&mut self, waiting: usize) -> Vec<(Pending, Option<Image>)> {
        let mut done = Vec::new();
        while let Some(first) = self.pending.front() {
            let time_ns = first.time_ns;
            let same = |light: &(i64, Image)| light.0.abs_diff(time_ns) <= SAME_EXPOSURE_NS as u64;
            let place = self.light.iter().position(same);
            if place.is_none() && self.has_light && self.pending.len() <= waiting {
                break;
            }
            let light = place.and_then(|place| self.light.remove(place)).map(|(_, image)| image);
            if let Some(first) = self.pending.pop_front() {
                done.push((first, light));
            }
        }
        done
    }
}

/// A frame of a level from an image and its light; in words why it is none.
pub(super) fn frame(
    level: Level,
    image: &Image,
    light: Option<&Image>,
    size: [usize; 2],
) -> Result<InputFrame, &'static str> {
    if [image.width(), image.height()] != size {
        return Err("of another size than the first");
    }
    let values = if level == Level::Intensity { image.values_f32() } else { image.depths_m() };
    let values = values.ok_or("of an encoding that has no one value a pixel")?;
    if values.iter().all(|value| !value.is_finite()) {
        return Err("without any value");
    }
    let plane = |values: Vec<f32>| Raster::from_vec(size[0], size[1], values).ok();
    let plane_of_values = plane(values).ok_or("of another size than its values")?;
    let amplitude = light.filter(|light| [light.width(), light.height()] == size);
    let amplitude = amplitude.and_then(Image::values_f32).and_then(plane);
    Ok(match level {
        Level::Intensity => InputFrame::Intensity(plane_of_values),
        Level::Range => InputFrame::Range { range: plane_of_values, amplitude, confidence: None },
        _ => InputFrame::Depth { depth: plane_of_values, amplitude, confidence: None },
    })
}
