//! Lengths in the cloud of a result: from files to files.

use std::fmt::Write;
use std::time::Instant;

use atomic_output::{Destination, write_text};
use commands::{Doubt, DoubtKind, Error, Inputs, Progress, Result, json, produce};
use point_uncertainty::Source;
use report::rounded;

use crate::document;
use crate::figures::Pictures;
use crate::measured::{AllFound, Found, Measured, fit, known, measure_length, region_summary, select};
use crate::plan::{MeasurePlan, NamedRegion, request};
use crate::request::MeasureRequest;
use crate::result::ResultCloud;
use crate::summary::{MeasureSummary, RegionSummary};

/// Measures lengths in regions of a result's cloud, and writes `lengths.csv`, `summary.json` and `report.html`.
///
/// A length that its points do not show is refused by itself; the others stand.
///
/// # Errors
/// [`Error::Refused`] where no length could be measured; [`Error::Request`] where the plan or the result means nothing, with the
/// name and value that are wrong. Every error leaves what was there.
pub fn measure(request: &MeasureRequest, progress: &dyn Progress) -> Result<MeasureSummary> {
    let inputs = Inputs::default().path(&request.result).path(&request.lengths);
    produce(&request.out, &inputs, |destination| work(request, destination, progress))
}

fn work(asked: &MeasureRequest, destination: &Destination, progress: &dyn Progress) -> Result<MeasureSummary> {
    let clock = Instant::now();
    let plan = MeasurePlan::read(&asked.lengths)?;
    progress.begin("measure", plan.regions.len() + plan.lengths.len());
    let cloud = ResultCloud::read(&asked.result)?;
    let mut summary = MeasureSummary {
        result: asked.result.display().to_string(),
        plan: asked.lengths.display().to_string(),
        calibration: cloud.calibration.clone(),
        common_errors: cloud.common.errors().len(),
        points: cloud.points.len(),
        flagged_points: cloud.points.len() - cloud.usable.len(),
        out: asked.out.clone(),
        ..MeasureSummary::default()
    };
    summary.doubts.extend(left_out(&cloud));
    let found = regions(&plan, &cloud, &mut summary, progress)?;
    let mut pictures = Pictures::default();
    for length in &plan.lengths {
        let measured = measure_length(&length.name, &length.quantity, &found, &cloud);
        pictures.add(&measured, &length.quantity, &found, &cloud);
        take(&mut summary, measured);
        progress.advance(1);
    }
    progress.finish();
    summary.seconds = commands::made::seconds_since(clock);
    let refused = summary.lengths.iter().filter_map(|length| Some((&length.name, length.refused.as_ref()?)));
    if refused.clone().count() == summary.lengths.len() {
        let first = refused.map(|(name, reason)| format!("`{name}`: {reason}")).next().unwrap_or_default();
        let source = format!("no length could be measured; {first}").into();
        return Err(Error::Refused { summary: json(&summary)?, source, written: None });
    }
    let page = document::document(&summary, pictures.finish(&summary));
    let folder = destination.open()?;
    write_text(folder.file("lengths.csv")?, &table(&summary))?;
    write_text(folder.file("summary.json")?, &json(&summary)?)?;
    write_text(folder.file("report.html")?, &page.html())?;
    folder.commit()?;
    Ok(summary)
}

/// What the standard deviations leave out.
pub(crate) fn left_out(cloud: &ResultCloud) -> Vec<Doubt> {
    let alone = "has no common_errors.ron: standard deviations are those of noise alone, in all directions alike, and leave out \
                 calibration, drift and poses";
    let missing = (!cloud.has_common).then(|| match &cloud.fused_from {
        Some(result) => format!("a fused cloud {alone}; measure in the result that it was fused from, {result}"),
        None => format!("the result {alone}; run the pipeline again to have it written"),
    });
    let named = cloud.not_in_it.iter().map(|words| format!("standard deviations leave out {words}"));
    missing.into_iter().chain(named).map(|words| Doubt::new(DoubtKind::Calibration, words)).collect()
}

/// Looks into all regions.
fn regions(
    plan: &MeasurePlan,
    cloud: &ResultCloud,
    summary: &mut MeasureSummary,
    progress: &dyn Progress,
) -> Result<AllFound> {
    let mut all = AllFound::new();
    for (name, region) in &plan.regions {
        let kind = region.kind();
        let slip = |error: measurement::Error| request(format!("region `{name}`: {error}"));
        let points = match region.space() {
            Some(space) => select(cloud, space).map_err(slip)?,
            None => Vec::new(),
        };
        let found = match known(name, region, cloud)? {
            Some(found) => Ok(found),
            None => fit(region, &cloud.cloud(), &points, &plan.options()),
        };
        let points = points.len();
        let row = match &found {
            Ok(found) => region_summary(kind, points, found),
            Err(error) => RegionSummary { kind, points, refused: Some(error.to_string()), ..RegionSummary::default() },
        };
        summary.regions.insert(name.clone(), row);
        summary.doubts.extend(doubts(name, region, found.as_ref().ok(), cloud)?);
        all.insert(name.clone(), found.map_err(|error| error.to_string()));
        progress.advance(1);
    }
    Ok(all)
}

/// What speaks against the shape in a region.
fn doubts(name: &str, region: &NamedRegion, found: Option<&Found>, cloud: &ResultCloud) -> Result<Vec<Doubt>> {
    let (Some(support), Some(space)) = (found.and_then(Found::support), region.space()) else { return Ok(Vec::new()) };
    let slip = |error: measurement::Error| request(format!("region `{name}`: {error}"));
    let cut = support.doubt_of_cut(&cloud.cloud(), space).map_err(slip)?;
    let words = support.scatter.doubt().into_iter().chain(cut);
    Ok(words.map(|words| Doubt::about(DoubtKind::Contradiction, name, words)).collect())
}

fn take(summary: &mut MeasureSummary, measured: Measured) {
    let name = measured.summary.name.clone();
    if let Some(reason) = &measured.summary.refused {
        summary.doubts.push(Doubt::about(DoubtKind::Refused, &name, format!("it was not measured: {reason}")));
    }
    summary.doubts.extend(measured.doubt.map(|words| Doubt::about(DoubtKind::NoPoints, &name, words)));
    let remarks = measured.summary.remarks.iter().map(|remark| format!("{name}: {remark}."));
    summary.findings.extend(remarks);
    summary.lengths.push(measured.summary);
}

/// Rows of `lengths.csv`; what is not known is empty.
fn table(summary: &MeasureSummary) -> String {
    let mut text = "name,quantity,value,unit,sigma,lower,upper".to_owned();
    for source in Source::ALL {
        // Writing to a string can't fail.
        let _ = write!(text, ",{}_share", source.name());
    }
    text.push('\n');
    for length in &summary.lengths {
        let scale = length.sigma.or(length.interval.map(|[low, high]| high - low));
        let number = |value: Option<f64>| value.map_or_else(String::new, |value| document::digits(value, scale, 3));
        let [low, high] = [0, 1].map(|end| number(length.interval.map(|ends| ends[end])));
        let _ = write!(text, "{},{},{},", quoted(&length.name), length.kind, number(length.value));
        let _ = write!(text, "{},{},{low},{high}", length.unit, number(length.sigma));
        for source in Source::ALL {
            let share = length.shares.get(source.name());
            let _ = write!(text, ",{}", share.map_or_else(String::new, |share| rounded(*share, 4)));
        }
        text.push('\n');
    }
    text
}

/// A field of a table; quoted where it holds what parts fields.
fn quoted(field: &str) -> String {
    if field.contains([',', '"']) { format!("\"{}\"", field.replace('"', "\"\"")) } else { field.to_owned() }
}
