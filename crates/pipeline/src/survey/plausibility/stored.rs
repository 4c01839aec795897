//! Whether the values of frames are the ranges or depths that they are said to be, told by the frames themselves.

use std::collections::BTreeMap;

use range_image::Raster;
use range_io::survey::Level;
use statistics::quantile;
use stored_values::{Bending, Kind, UnitWitness, bendings, in_words, judge_kind, judge_unit, repeated_values};

use crate::survey::open::OpenSurvey;
use crate::survey::view::{View, ViewData};
use commands::{Doubt, DoubtKind, Tape};

/// Frames that are looked at, evenly over the survey.
const LOOKED_AT: usize = 8;
/// Units that are thought of beside the stated one, metre, and their names.
const UNITS: [(f64, &str); 4] =
    [(1.0, "metres"), (1e-2, "centimetres"), (1e-3, "millimetres"), (1e-4, "tenths of a millimetre")];
/// Probability from which on a unit counts as told.
const UNIT_LEVEL: f64 = 0.99;
/// Two units this close are one.
const SAME_UNIT: f64 = 1e-6;
/// Codes that are named.
const MOST_CODES: usize = 4;

/// What some frames of a survey at level `range` or `depth` show of their values.
#[derive(Debug, Default)]
pub struct StoredWatch {
    surfaces: Vec<Bending>,
    witnesses: Vec<UnitWitness>,
    /// Pixels by the bits of the code, in the unit of the file.
    codes: BTreeMap<u32, usize>,
    pixels: usize,
    empty: usize,
    stated: Option<Stated>,
}

/// What the survey says of its values.
#[derive(Debug, Clone, Copy)]
struct Stated {
    kind: Kind,
    /// Metres of one stored unit.
    scale_m: f64,
    /// Of a camera with one frequency, metre.
    ambiguity_interval_m: Option<f64>,
}

impl StoredWatch {
    /// Looks at a frame as it was read, if its turn has come.
    pub fn look(&mut self, survey: &OpenSurvey, view: &View) {
        let kind = match survey.survey.level {
            Level::Range => Kind::Range,
            Level::Depth => Kind::Depth,
            _ => return,
        };
        let every = survey.survey.frames.len().div_ceil(LOOKED_AT).max(1);
        let turn = view.frames.first().is_some_and(|frame| frame.is_multiple_of(every));
        let (true, ViewData::Range(frame)) = (turn, &view.data) else { return };
        let scale_m = survey.survey.depth.as_ref().map_or(1.0, |depth| depth.scale_m);
        let ambiguity_interval_m = match survey.modulations() {
            [one] => Some(one.ambiguity_interval_m()),
            _ => None,
        };
        self.stated = Some(Stated { kind, scale_m, ambiguity_interval_m });
        let rays = survey.depth_rays();
        let mut values = frame.range.clone();
        if kind == Kind::Depth && rays.range_to_depth_in_place(&mut values).is_err() {
            return;
        }
        self.take(&values, rays, scale_m);
    }

    fn take(&mut self, values: &Raster<f32>, rays: &camera_model::RayTable, scale_m: f64) {
        self.surfaces.extend(bendings(values, rays).unwrap_or_default());
        let stored = values.map(|value| (f64::from(*value) / scale_m) as f32);
        self.witnesses.extend(UnitWitness::of(&stored));
        self.pixels += stored.len();
        self.empty += stored.as_slice().iter().filter(|value| value.is_nan()).count();
        for code in repeated_values(&stored) {
            // Of a code that went through a scale the digits of a file's number are left.
            let value = format!("{:.5e}", code.value).parse().unwrap_or(code.value);
            *self.codes.entry(f32::to_bits(value)).or_default() += code.pixels;
        }
    }

    /// Writes it, or adds what another part of the survey shows.
    pub(crate) fn carry(&mut self, tape: &mut Tape) {
        let blank = || Bending { bending: 0.0, sigma: 0.0, window: [0; 4] };
        tape.list(&mut self.surfaces, blank, |tape, surface| {
            for value in [&mut surface.bending, &mut surface.sigma] {
                tape.number(value);
            }
            for value in &mut surface.window {
                tape.count(value);
            }
        });
        tape.list(&mut self.witnesses, UnitWitness::default, |tape, witness| {
            for value in [&mut witness.median, &mut witness.highest] {
                tape.number(value);
            }
            tape.option(&mut witness.noise, f64::default, Tape::number);
        });
        let mut codes: Vec<(u32, usize)> =
            if tape.is_read() { Vec::new() } else { std::mem::take(&mut self.codes).into_iter().collect() };
        tape.list(&mut codes, Default::default, |tape, (code, pixels)| {
            *code = tape.bits(u64::from(*code)) as u32;
            tape.count(pixels);
        });
        for (code, pixels) in codes {
            *self.codes.entry(code).or_default() += pixels;
        }
        for count in [&mut self.pixels, &mut self.empty] {
            tape.count(count);
        }
        let mut stated = self.stated;
        let blank = || Stated { kind: Kind::Range, scale_m: 0.0, ambiguity_interval_m: None };
        tape.option(&mut stated, blank, |tape, stated| {
            let mut is_depth = stated.kind == Kind::Depth;
            tape.flag(&mut is_depth);
            stated.kind = if is_depth { Kind::Depth } else { Kind::Range };
            tape.number(&mut stated.scale_m);
            tape.option(&mut stated.ambiguity_interval_m, f64::default, Tape::number);
        });
        self.stated = self.stated.or(stated);
    }

    /// What was found, by name, for people.
    pub fn in_words(&self) -> Vec<(&'static str, String)> {
        let Some(stated) = self.stated else { return Vec::new() };
        let mut words = vec![("values", judge_kind(&self.surfaces).to_string()), ("unit", self.unit_in_words(stated))];
        let empty = 100.0 * self.empty as f64 / self.pixels.max(1) as f64;
        words.push(("without a value", format!("{empty:.1} % of the pixels")));
        if let Some(codes) = self.codes_in_words() {
            words.push(("no distances", codes));
        }
        words
    }

    /// What speaks against what the survey states.
    pub fn doubts(&self) -> Vec<Doubt> {
        let Some(stated) = self.stated else { return Vec::new() };
        let mut doubts = Vec::new();
        let judged = judge_kind(&self.surfaces);
        if let Some(told) = judged.told().filter(|told| *told != stated.kind) {
            let words = format!(
                "survey.ron states `level: {}`, and the values are {judged}: state `level: {}`",
                level(stated.kind),
                level(told)
            );
            doubts.push(Doubt::new(DoubtKind::RangeOrDepth, words));
        }
        if let Some((unit_m, name, likely)) = self
            .unit(stated)
            .filter(|(unit_m, _, likely)| *likely >= UNIT_LEVEL && (unit_m / stated.scale_m - 1.0).abs() > SAME_UNIT)
        {
            let words = format!(
                "the values are read as {} m each and are probably {name} ({unit_m} m, probability {}): the distances and the \
                 noise are those of no camera of this kind",
                stated.scale_m,
                in_words(likely)
            );
            doubts.push(Doubt::new(DoubtKind::Units, words));
        }
        if let Some(codes) = self.codes_in_words() {
            let words = format!(
                "{codes}, where no surface leads to: a code for pixels that were not measured. Name it in `depth.invalid` of \
                 survey.ron, or leave such pixels empty"
            );
            doubts.push(Doubt::new(DoubtKind::InvalidValues, words));
        }
        doubts
    }

    /// The most probable unit, its name and its probability.
    fn unit(&self, stated: Stated) -> Option<(f64, &'static str, f64)> {
        let of = |value: fn(&UnitWitness) -> Option<f64>| {
            let mut values: Vec<f64> = self.witnesses.iter().filter_map(value).collect();
            (!values.is_empty()).then(|| quantile(&mut values, 0.5))
        };
        let witness =
            UnitWitness { median: of(|w| Some(w.median))?, highest: of(|w| Some(w.highest))?, noise: of(|w| w.noise) };
        let own = (stated.scale_m, "as stated");
        let is_own = |unit: &(f64, &str)| (unit.0 / stated.scale_m - 1.0).abs() <= SAME_UNIT;
        let known = UNITS.into_iter().any(|unit| is_own(&unit));
        let units: Vec<(f64, &str)> = UNITS.into_iter().chain((!known).then_some(own)).collect();
        let lengths: Vec<f64> = units.iter().map(|unit| unit.0).collect();
        let judged = judge_unit(&witness, stated.ambiguity_interval_m, &lengths);
        let best = units.into_iter().zip(judged).max_by(|a, b| a.1.total_cmp(&b.1))?;
        best.1.is_finite().then_some((best.0.0, best.0.1, best.1))
    }

    fn unit_in_words(&self, stated: Stated) -> String {
        match self.unit(stated) {
            Some((_, name, likely)) if likely >= UNIT_LEVEL => format!("{name} (probability {})", in_words(likely)),
            Some((_, name, likely)) => {
                format!("cannot be told; of the likely ones {name} come first (probability {likely:.2})")
            }
            None => "cannot be told: there are no values".to_owned(),
        }
    }

    fn codes_in_words(&self) -> Option<String> {
        let mut codes: Vec<(usize, f32)> =
            self.codes.iter().map(|(bits, pixels)| (*pixels, f32::from_bits(*bits))).collect();
        codes.sort_by_key(|code| std::cmp::Reverse(code.0));
        let named: Vec<String> =
            codes.iter().take(MOST_CODES).map(|(pixels, value)| format!("{value} at {pixels} pixels")).collect();
        (!named.is_empty()).then(|| named.join(", "))
    }
}

/// The level of surveys whose values are of a kind.
fn level(kind: Kind) -> &'static str {
    match kind {
        Kind::Range => Level::Range.name(),
        Kind::Depth => Level::Depth.name(),
    }
}
