//! Coded rings as they are printed.

use targets::Code;

use super::render::Pattern;

/// White rings on dark ground.
#[derive(Clone)]
pub struct PrintedCodes {
    /// Codes with the places of their centres, metre.
    pub targets: Vec<(Code, [f64; 2])>,
    /// Radius of the discs, metre.
    pub radius_m: f64,
    pub dark: f64,
    pub bright: f64,
}

impl Pattern for PrintedCodes {
    fn reflectance(&self, [x, y]: [f64; 2], _: [[f64; 2]; 2]) -> Option<f64> {
        let set = |(code, centre): &(Code, [f64; 2])| {
            let (dx, dy) = (x - centre[0], y - centre[1]);
            let parts = (dx * dx + dy * dy).sqrt() / self.radius_m;
            if parts >= 3.0 {
                return false;
            }
            // Clockwise as seen: y is up.
            let turn = (-dy).atan2(dx).rem_euclid(std::f64::consts::TAU) / std::f64::consts::TAU;
            parts < 1.0 || ((2.0..3.0).contains(&parts) && code.is_set((turn * code.bits as f64) as usize))
        };
        Some(if self.targets.iter().any(set) { self.bright } else { self.dark })
    }
}
