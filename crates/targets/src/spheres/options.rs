use crate::error::{Error, Result};

/// How spheres are looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SphereOptions {
    /// Radius, metre. Default: `None`, it is determined as well.
    pub radius_m: Option<f64>,
    /// Radii that are looked for where it is not known, metre. Default: 0.03 to 0.3.
    pub radii_m: [f64; 2],
    /// Standard deviation of ranges where the frame has none, metre. Default: 0.01.
    pub unknown_sigma_m: f64,
    /// Share of the pixels inside the predicted outline that must lie on the sphere. Default: 0.8.
    pub least_share: f64,
    /// Fewest pixels on a sphere. Default: 30, seven pixels across.
    pub least_pixels: usize,
    /// Seed of the random subsets of the fit's start. Same seed, same bits. Default: 1.
    pub seed: u64,
}

impl Default for SphereOptions {
    fn default() -> Self {
        Self {
            radius_m: None,
            radii_m: [0.03, 0.3],
            unknown_sigma_m: 0.01,
            least_share: 0.8,
            least_pixels: 30,
            seed: 1,
        }
    }
}

impl SphereOptions {
    pub(crate) fn validate(&self) -> Result<()> {
        let [small, large] = self.range_m();
        let lengths = [("radius_m", small), ("radius_m", large), ("unknown_sigma_m", self.unknown_sigma_m)];
        for (name, value) in lengths {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::Invalid { name, value, expected: "a length is positive and finite" });
            }
        }
        if small > large {
            return Err(Error::Invalid { name: "radii_m", value: small, expected: "the smaller radius first" });
        }
        let value = self.least_share;
        if !(value > 0.0 && value <= 1.0) {
            return Err(Error::Invalid { name: "least_share", value, expected: "a share above 0, at most 1" });
        }
        Ok(())
    }

    /// Smallest and largest radius.
    pub(crate) fn range_m(&self) -> [f64; 2] {
        self.radius_m.map_or(self.radii_m, |radius| [radius, radius])
    }
}
