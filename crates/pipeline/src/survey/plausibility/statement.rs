//! What `survey.ron` and `stations.csv` state, before any frame is looked at.

use nalgebra::Isometry3;
use range_io::survey::SurveyCamera;

use crate::survey::plausibility::FURTHEST_M;
use commands::{Doubt, DoubtKind};

/// Hertz: ambiguity intervals of 150 m and of 0.3 m. Sensors are modulated at 5 to 350 MHz.
const MODULATIONS_HZ: [f64; 2] = [1e6, 500e6];
/// Degree across the image's diagonal: a telescope, and the end of what a plane image can hold.
const FIELD_OF_VIEW_DEG: [f64; 2] = [1.0, 165.0];

/// Doubts about the camera block.
pub fn of_survey(camera: &SurveyCamera) -> Vec<Doubt> {
    let mut doubts = Vec::new();
    let [low, high] = MODULATIONS_HZ;
    let odd = camera.modulation_hz.iter().copied().filter(|hz| !(low..=high).contains(hz));
    let odd: Vec<String> = odd.map(|hz| format!("{} MHz", hz / 1e6)).collect();
    if !odd.is_empty() {
        let words = format!(
            "a modulation of {} is outside the {} to {} MHz of time-of-flight cameras: camera.modulation_hz in survey.ron is \
             in hertz",
            odd.join(", "),
            low / 1e6,
            high / 1e6
        );
        doubts.push(Doubt::new(DoubtKind::Modulation, words));
    }
    let [x, y] = camera.pixel_pitch_mm;
    let half_diagonal = 0.5 * (x * camera.width as f64).hypot(y * camera.height as f64);
    let field_deg = 2.0 * (half_diagonal / camera.principal_distance_mm).atan().to_degrees();
    let [narrow, wide] = FIELD_OF_VIEW_DEG;
    // An image of few pixels is a part of one.
    if field_deg > wide || (field_deg < narrow && camera.width.min(camera.height) >= 32) {
        let words = format!(
            "a principal distance of {} mm and pixels of {x} x {y} mm make a field of view of {field_deg:.2} degrees: \
             camera.principal_distance_mm and camera.pixel_pitch_mm in survey.ron are in millimetres",
            camera.principal_distance_mm
        );
        doubts.push(Doubt::new(DoubtKind::Units, words));
    }
    doubts
}

/// Stations further from their nearest neighbours than a camera can see have nothing in common.
pub fn far_apart(poses: &[Isometry3<f64>]) -> Option<Doubt> {
    let place = |pose: &Isometry3<f64>| pose.translation.vector;
    let nearest = |index: usize| {
        let others = poses.iter().enumerate().filter(|(other, _)| *other != index);
        others.map(|(_, pose)| (place(pose) - place(&poses[index])).norm()).fold(f64::INFINITY, f64::min)
    };
    let closest = (0..poses.len().min(MOST_STATIONS)).map(nearest).fold(f64::INFINITY, f64::min);
    (poses.len() > 1 && closest > FURTHEST_M).then(|| {
        let words = format!(
            "every station lies {closest:.0} m or more from all others, further than a time-of-flight camera sees: positions \
             in stations.csv are in metres"
        );
        Doubt::new(DoubtKind::Units, words)
    })
}

/// Stations that are held against all others; the rest of a long path tells no more.
const MOST_STATIONS: usize = 64;
