//! Whether residuals as a whole, and those of each group, are as large as the standard deviations let expect.

use adjust::{GlobalTest, GlobalVerdict};

use crate::CalibrationOutcome;

/// Probability that any of the tests of a sound calibration fails. Published adjustments take 0.001 to 0.05; a doubt
/// reaches the exit code, so the rarest of these.
const LEVEL: f64 = 0.001;
/// What is tested as a whole.
pub(crate) const ALL: &str = "all observations";

impl CalibrationOutcome {
    /// The global test of the variance factor: for all observations first, then for every group that has redundancy. One of
    /// them fails by chance in one of a thousand sound calibrations: [`GlobalTest::level`] is the share of each.
    ///
    /// Groups share the redundancy with each other, so that `vᵀPv` of a group varies less than the χ² that it is held
    /// against: a sound group fails more seldom than the level says, and a small one that is not sound may pass. Empty
    /// without redundancy.
    pub fn global_tests(&self) -> Vec<GlobalTest> {
        let groups = self.groups.iter().filter_map(|group| {
            let sigma0 = group.sigma0?;
            Some((group.name.as_str(), sigma0 * sigma0 * group.redundancy, group.redundancy))
        });
        let subjects: Vec<_> = std::iter::once((ALL, self.vtpv, self.redundancy as f64)).chain(groups).collect();
        let level = statistics::bonferroni(LEVEL, subjects.len());
        let test = |(name, vtpv, redundancy)| GlobalTest::new(name, vtpv, redundancy, level).ok();
        subjects.into_iter().filter_map(test).collect()
    }

    /// A sentence for each control point or pose that was rejected, and for each group that fails its global test; for
    /// the whole where no group alone does. What speaks against a sound calibration once in a thousand times.
    pub fn doubts_of_tests(&self) -> Vec<String> {
        let mut doubts = self.doubts_of_control();
        doubts.extend(self.doubts_of_scale());
        doubts
    }

    fn doubts_of_scale(&self) -> Vec<String> {
        let failed = self.global_tests().into_iter().filter(|test| test.verdict != GlobalVerdict::AsStated);
        let (whole, groups): (Vec<_>, Vec<_>) = failed.partition(|test| test.subject == ALL);
        let told = if groups.is_empty() { whole } else { groups };
        told.iter().map(sentence).collect()
    }
}

fn sentence(test: &GlobalTest) -> String {
    let bound = |limit: f64| (limit / test.redundancy).sqrt();
    let why = match test.verdict {
        GlobalVerdict::TooSmall => "its standard deviations are too large, or its values were smoothed",
        _ => "its standard deviations are too small, or a term of the lens or the range error is missing",
    };
    format!(
        "{} scatters {:.3} times as much as stated, where {:.3} to {:.3} is expected (global test at a level of {:.0e}, \
         redundancy {:.0}): {why}; the deviations of all results are as wrong",
        test.subject,
        test.sigma0(),
        bound(test.limits.0),
        bound(test.limits.1),
        test.level,
        test.redundancy
    )
}
