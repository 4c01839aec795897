//! What a run keeps of views whose rasters are gone: their records, counts, thinned pixels, and small pictures of the first.

use std::collections::BTreeMap;

use camera_model::Camera;
use range_image::{Flags, Modulation, Raster};
use statistics::{Thinning, quantile, robust_standard_deviation};

use crate::Result;
use crate::run::figures::pictures::{PICTURED_STATIONS, Pictures};
use crate::run::stream::Before;
use crate::run::summary::ReferenceSummary;
use crate::survey::open::OpenSurvey;
use crate::survey::records::{ViewRecord, usable};
use crate::survey::truth::{TruthTally, range_errors, wrap};
use crate::survey::view::{Snapshot, View, ViewData};
use crate::trends::Residuals;
use commands::Tape;

/// All that summary and report say of pixels.
pub(crate) struct Kept {
    /// Views before those here, which are others' work.
    first: usize,
    pub(crate) views: Vec<ViewRecord>,
    pub(crate) pictures: Vec<Pictures>,
    pub(crate) residuals: Residuals,
    pub(crate) truth: TruthTally,
    pub(crate) values: Values,
    thinning: Thinning,
    /// Differences of unflagged ranges to the reference, metre, and the number of all of them.
    differences: Vec<f64>,
    compared: usize,
    modulation: Option<Modulation>,
    /// Pixels, those with any flag, and those with each of [`Flags::NAMED`].
    pixels: usize,
    flagged: usize,
    flags: [usize; Flags::NAMED.len()],
}

/// Thinned values of all views.
#[derive(Default)]
pub(crate) struct Values {
    /// Standard deviations of the unflagged ranges, metre.
    pub(crate) sigma_m: Vec<f64>,
    /// Errors of the ranges as the camera gives them, of all pixels, and of the unflagged ones in the end, metre.
    pub(crate) errors_m: [Vec<f64>; 2],
    /// Logarithms of the amplitudes as the camera gives them.
    pub(crate) log_amplitude: Vec<f64>,
    /// Ranges in the end, metre.
    pub(crate) range_m: Vec<f64>,
    /// Unflagged points of each view in its camera's frame, metre.
    pub(crate) points: Vec<Vec<[f64; 3]>>,
}

impl Values {
    fn carry(&mut self, tape: &mut Tape) {
        let [before_m, after_m] = &mut self.errors_m;
        let lists = [&mut self.sigma_m, before_m, after_m, &mut self.log_amplitude, &mut self.range_m];
        for list in lists {
            tape.numbers(list);
        }
        tape.list(&mut self.points, Vec::new, |tape, points| {
            tape.list(points, Default::default, |tape, point: &mut [f64; 3]| {
                for x in point {
                    tape.number(x);
                }
            });
        });
    }
}

impl Kept {
    /// For so many views in all, some of them before the first one here, whose rays a camera gives.
    pub(crate) fn new(survey: &OpenSurvey, camera: &Camera, views: usize, before: Before) -> Self {
        Self {
            first: before.views,
            views: Vec::new(),
            pictures: Vec::new(),
            residuals: Residuals::new(survey, camera, views),
            truth: TruthTally::default(),
            values: Values::default(),
            thinning: Thinning::of(views * camera.format.width * camera.format.height).after(before.views),
            differences: Vec::new(),
            compared: 0,
            modulation: survey.modulations().first().copied(),
            pixels: 0,
            flagged: 0,
            flags: [0; Flags::NAMED.len()],
        }
    }

    /// What it takes of so many views, byte: seven numbers of each pixel that is kept, ten where the truth is known, and a record of
    /// each view with all that is said of it.
    pub(crate) fn bytes(survey: &OpenSurvey, camera: &Camera, views: usize) -> u64 {
        const RECORD: u64 = 3000;
        let pixels = views * camera.format.width * camera.format.height;
        let numbers = if survey.has_truth() { 10 } else { 7 };
        8 * numbers * Thinning::of(pixels).kept(pixels) + RECORD * views as u64
    }

    /// Keeps what is wanted of a view that has gone through the stages.
    pub(crate) fn add(&mut self, view: &View, survey: &OpenSurvey) -> Result<()> {
        let after = view.snapshot();
        if let Some(after) = &after {
            self.truth.add(view, &after.range, self.thinning);
        }
        let errors = (errors_before(view), after.as_ref().and_then(|after| range_errors(view, &after.range)));
        self.count_flags(view);
        self.compare(view);
        self.keep_values(view, after.as_ref(), &errors);
        self.residuals.add(view);
        if self.first + self.views.len() < PICTURED_STATIONS {
            self.pictures.push(Pictures::new(view, after, errors)?);
        }
        self.views.push(ViewRecord::new(view, &survey.stated));
        Ok(())
    }

    /// Leaves out views that do not belong to the others; their pixels stay in the figures of all ranges.
    pub(crate) fn leave_out(&mut self, is_left_out: impl Fn(usize) -> bool) {
        let (mut view, mut cloud) = (0.., 0..);
        self.views.retain(|_| view.next().is_some_and(|view| !is_left_out(view)));
        self.values.points.retain(|_| cloud.next().is_some_and(|cloud| !is_left_out(cloud)));
    }

    /// Writes it, or adds another part of the views.
    pub(crate) fn carry(&mut self, tape: &mut Tape, survey: &OpenSurvey) {
        tape.list(&mut self.views, ViewRecord::default, |tape, view| view.carry(tape, survey));
        tape.list(&mut self.pictures, Pictures::default, |tape, pictures| pictures.carry(tape));
        self.residuals.carry(tape);
        self.truth.carry(tape);
        self.values.carry(tape);
        tape.numbers(&mut self.differences);
        for count in [&mut self.compared, &mut self.pixels, &mut self.flagged] {
            tape.count(count);
        }
        for count in &mut self.flags {
            tape.count(count);
        }
    }

    fn count_flags(&mut self, view: &View) {
        for flags in view.flags().iter().flat_map(|flags| flags.as_slice()) {
            self.pixels += 1;
            if flags.is_empty() {
                continue;
            }
            self.flagged += 1;
            for (count, (flag, _)) in self.flags.iter_mut().zip(Flags::NAMED) {
                *count += usize::from(flags.contains(flag));
            }
        }
    }

    /// Fraction of all pixels that carry each flag, and any.
    pub(crate) fn flag_fractions(&self) -> BTreeMap<String, f64> {
        let fraction = |count: usize| count as f64 / self.pixels.max(1) as f64;
        let named = Flags::NAMED.iter().zip(self.flags).map(|((_, name), count)| ((*name).to_owned(), fraction(count)));
        let mut fractions: BTreeMap<String, f64> = named.filter(|(_, fraction)| *fraction > 0.0).collect();
        fractions.insert("any".to_owned(), fraction(self.flagged));
        fractions
    }

    fn compare(&mut self, view: &View) {
        let (Some(reference), ViewData::Range(frame)) = (&view.reference_range, &view.data) else { return };
        let (range, reference, flags) = (frame.range.as_slice(), reference.as_slice(), frame.flags.as_slice());
        let difference = |pixel: usize| {
            let difference = f64::from(range[pixel]) - f64::from(reference[pixel]);
            (flags[pixel].is_empty() && difference.is_finite()).then_some(difference)
        };
        self.compared += (0..range.len()).filter_map(difference).count();
        self.differences.extend(self.thinning.indices(self.views.len(), range.len()).filter_map(difference));
    }

    /// Unflagged ranges against the reference, up to a constant, modulo the ambiguity interval.
    pub(crate) fn reference(&self) -> Option<ReferenceSummary> {
        let mut differences = self.differences.clone();
        if differences.is_empty() {
            return None;
        }
        let mut constant = quantile(&mut differences.clone(), 0.5);
        if let Some(modulation) = self.modulation {
            // The reference may be wrapped where ours is not: differences are brought next to the common constant.
            for difference in &mut differences {
                *difference = constant + wrap(*difference - constant, modulation);
            }
            constant = quantile(&mut differences.clone(), 0.5);
        }
        Some(ReferenceSummary {
            constant_m: constant,
            robust_standard_deviation_m: robust_standard_deviation(&differences),
            pixels: self.compared,
        })
    }

    fn keep_values(&mut self, view: &View, after: Option<&Snapshot>, errors: &Errors) {
        let (number, thinning, values) = (self.views.len(), self.thinning, &mut self.values);
        let (width, height) = view.size();
        let pixels = || thinning.indices(number, width * height);
        if let ViewData::Range(frame) = &view.data {
            let (sigma, flags) = (frame.sigma.as_slice(), frame.flags.as_slice());
            values
                .sigma_m
                .extend(pixels().filter(|pixel| flags[*pixel].is_empty()).map(|pixel| f64::from(sigma[pixel])));
        }
        let [before_m, after_m] = &mut values.errors_m;
        if let Some(before) = &errors.0 {
            before_m.extend(pixels().map(|pixel| before[pixel]));
        }
        if let (Some(after), Some(flags)) = (&errors.1, view.flags()) {
            let flags = flags.as_slice();
            after_m.extend(pixels().filter(|pixel| flags[*pixel].is_empty()).map(|pixel| after[pixel]));
        }
        if let Some(before) = &view.before {
            values.log_amplitude.extend(pixels().map(|pixel| log_amplitude(before.amplitude.as_slice()[pixel])));
        }
        if let Some(after) = after {
            values.range_m.extend(pixels().map(|pixel| f64::from(after.range.as_slice()[pixel])));
        }
        let taken = view.cloud.as_ref().map_or_else(Vec::new, |cloud| {
            let mut usable = usable(cloud).peekable();
            let taken = pixels().filter(|pixel| {
                while usable.next_if(|point| point < pixel).is_some() {}
                usable.peek() == Some(pixel)
            });
            taken.map(|pixel| cloud.points[pixel]).collect()
        });
        values.points.push(taken);
    }
}

/// Errors of a view's pixels as the camera gives them and in the end, metre.
pub(crate) type Errors = (Option<Vec<f64>>, Option<Vec<f64>>);

/// NaN without light.
pub(crate) fn log_amplitude(amplitude: f32) -> f64 {
    if amplitude > 0.0 { f64::from(amplitude.log10()) } else { f64::NAN }
}

/// Errors of the ranges as the camera alone gives them, modulo the ambiguity interval, metre.
fn errors_before(view: &View) -> Option<Vec<f64>> {
    let (truth, before) = (view.truth.as_ref()?, view.before.as_ref()?);
    let error = |(range, truth): (&f32, &f32)| {
        let error = f64::from(*range) - f64::from(*truth);
        view.modulation.map_or(error, |modulation| wrap(error, modulation))
    };
    let planes: [&Raster<f32>; 2] = [&before.range, &truth.range];
    Some(planes[0].as_slice().iter().zip(planes[1].as_slice()).map(error).collect())
}
