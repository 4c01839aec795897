//! Pictures of one view: before and after, errors, corrections, flags.

use range_image::{Flags, Raster};
use report::{CATEGORIES, ColourMap, Figure, NO_VALUE, Scale, raster_figure, rgb_figure};
use statistics::quantile;

use crate::Result;
use crate::run::figures::correction_maps::correction_maps;
use crate::run::kept::{Errors, Values, log_amplitude};
use crate::survey::view::{Snapshot, View};
use commands::Tape;

/// Stations whose pictures are shown; further ones would make the page heavy without telling more.
pub(crate) const PICTURED_STATIONS: usize = 8;

/// What the pictures of a view are made of that have one scale for all views, and those with a scale of their own.
#[derive(Default)]
pub(crate) struct Pictures {
    name: String,
    width: usize,
    before: Option<Snapshot>,
    after: Option<Snapshot>,
    errors: Option<[Vec<f64>; 2]>,
    own: Vec<Figure>,
}

/// One scale for all stations, so that their pictures can be compared.
pub(crate) struct Scales {
    amplitude: Scale,
    range: Scale,
    error_before: Scale,
    error_after: Scale,
}

impl Scales {
    pub(crate) fn of(values: &Values) -> Self {
        let share = |values: &[f64], share: f64| quantile(&mut values.to_vec(), share);
        let errors: Vec<f64> = values.errors_m[0].iter().map(|error| 1e3 * error.abs()).collect();
        let wide = share(&errors, 0.95);
        let symmetric = |limit: f64| Scale { map: ColourMap::Diverging, low: -limit, high: limit, unit: "mm" };
        Self {
            amplitude: Scale {
                map: ColourMap::Grey,
                low: share(&values.log_amplitude, 0.01),
                high: share(&values.log_amplitude, 0.99),
                unit: "lg",
            },
            range: Scale { map: ColourMap::Sequential, low: 0.0, high: share(&values.range_m, 0.995), unit: "m" },
            error_before: symmetric(wide),
            error_after: symmetric((wide / 10.0).max(5.0)),
        }
    }
}

impl Pictures {
    pub(crate) fn new(view: &View, after: Option<Snapshot>, errors: Errors) -> Result<Self> {
        let (width, _) = view.size();
        let errors = errors.0.zip(errors.1).map(|(before, after)| [before, after]);
        let mut own = Vec::new();
        if let (None, Some(before), Some(after)) = (&errors, &view.before, &after) {
            own.push(change(width, before, after)?);
        }
        own.extend(correction_maps(view)?);
        if let Some(risk) = &view.multipath_risk_m {
            own.push(risk_picture(risk)?);
        }
        own.push(flag_picture(view)?.caption("Grey: no flag. Colours as in the table of flags."));
        Ok(Self { name: view.name(), width, before: view.before.clone(), after, errors, own })
    }

    /// Writes it, or takes it over.
    pub(crate) fn carry(&mut self, tape: &mut Tape) {
        tape.text(&mut self.name);
        tape.count(&mut self.width);
        for snapshot in [&mut self.before, &mut self.after] {
            tape.option(snapshot, Snapshot::default, |tape, snapshot| snapshot.carry(tape));
        }
        tape.option(&mut self.errors, Default::default, |tape, errors| {
            for errors in errors {
                tape.numbers(errors);
            }
        });
        tape.list(
            &mut self.own,
            || Figure::new(String::new()),
            |tape, figure| {
                let [mut svg, mut caption] = figure.parts().map(str::to_owned);
                for text in [&mut svg, &mut caption] {
                    tape.text(text);
                }
                *figure = Figure::new(svg).caption(caption);
            },
        );
    }

    /// Name of the view and its figures.
    pub(crate) fn figures(self, scales: &Scales) -> Result<(String, Vec<Figure>)> {
        let mut figures = Vec::new();
        let mut add = |title: &str, values: &[f64], scale: &Scale| -> Result<()> {
            figures.push(raster_figure(title, self.width, values, scale)?);
            Ok(())
        };
        for (snapshot, when) in [(&self.before, "before"), (&self.after, "after")] {
            let Some(Snapshot { range, amplitude }) = snapshot else { continue };
            if amplitude.as_slice().iter().any(|amplitude| amplitude.is_finite()) {
                let values: Vec<f64> = amplitude.as_slice().iter().map(|amplitude| log_amplitude(*amplitude)).collect();
                add(&format!("Amplitude {when}"), &values, &scales.amplitude)?;
            }
            let values: Vec<f64> = range.as_slice().iter().map(|range| f64::from(*range)).collect();
            add(&format!("Range {when}"), &values, &scales.range)?;
        }
        if let Some([before, after]) = &self.errors {
            let in_millimetres = |errors: &[f64]| errors.iter().map(|error| 1e3 * error).collect::<Vec<_>>();
            add("Range error before", &in_millimetres(before), &scales.error_before)?;
            add("Range error after (all pixels)", &in_millimetres(after), &scales.error_after)?;
        }
        figures.extend(self.own);
        Ok((self.name, figures))
    }
}

fn change(width: usize, before: &Snapshot, after: &Snapshot) -> Result<Figure> {
    let change = before.range.as_slice().iter().zip(after.range.as_slice());
    let change: Vec<f64> = change.map(|(b, a)| 1e3 * f64::from(a - b)).collect();
    let limit = quantile(&mut change.iter().map(|c| c.abs()).collect::<Vec<_>>(), 0.95).max(1.0);
    let scale = Scale { map: ColourMap::Diverging, low: -limit, high: limit, unit: "mm" };
    Ok(raster_figure("Range, after minus before", width, &change, &scale)?)
}

fn risk_picture(risk: &Raster<f32>) -> Result<Figure> {
    let values: Vec<f64> = risk.as_slice().iter().map(|risk| 1e3 * f64::from(*risk)).collect();
    let high = quantile(&mut values.clone(), 0.99);
    let high = if high.is_finite() { high.max(1.0) } else { 1.0 };
    let scale = Scale { map: ColourMap::Sequential, low: 0.0, high, unit: "mm" };
    let note =
        "What light that bounced once in the scene is expected to add to the ranges. Grey: part of no flat patch.";
    Ok(raster_figure("Expected multipath error", risk.width(), &values, &scale)?.caption(note))
}

fn flag_picture(view: &View) -> Result<Figure> {
    let (width, _) = view.size();
    let flags = view.flags().map(Raster::as_slice).unwrap_or_default();
    let colour = |flags: &Flags| {
        let first = Flags::NAMED.iter().position(|(flag, _)| flags.contains(*flag));
        first.map_or(NO_VALUE, |k| CATEGORIES[k])
    };
    let rgb: Vec<u8> = flags.iter().flat_map(colour).collect();
    Ok(rgb_figure("Flags", width, &rgb)?)
}
