//! From files to figures.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use commands::{Error, InputDigest, Result};
use serde_json::Value;

use super::read::{Reader, has_result};
use super::{Calibration, Camera, DayCheck, DoubtCount, FailureCount, Fleet, Recorded, RecordingRow, doubts, words_of};

/// The figures, and the files that they come from.
pub(crate) struct Gathered {
    pub(crate) fleet: Fleet,
    pub(crate) read: Vec<InputDigest>,
}

/// Steps without a result, by code.
type Failures = BTreeMap<u8, Vec<String>>;

/// Reads what was recorded of all steps.
pub(crate) fn gather(folder: &Path) -> Result<Gathered> {
    let mut reader = Reader { folder, read: Vec::new() };
    let (mut cameras, mut rows, mut failures) = (Vec::new(), Vec::new(), Failures::new());
    for name in reader.names(Path::new("codes")) {
        if !folder.join("codes").join(&name).is_dir() {
            continue;
        }
        let (camera, of_camera) = camera(&mut reader, &name, &mut failures)?;
        cameras.push(camera);
        rows.extend(of_camera);
    }
    if cameras.is_empty() {
        let message = format!("{}: no step of a workflow is recorded in `codes`", folder.display());
        return Err(Error::Request { command: "fleet", message });
    }
    let failures: Vec<FailureCount> =
        failures.into_iter().map(|(code, steps)| FailureCount { code, words: words_of(code), steps }).collect();
    let fleet = Fleet {
        recordings: rows.len(),
        with_result: rows.iter().filter(|row| has_result(row.code)).count(),
        flags_fraction: mean_flags(&rows),
        doubt_kinds: doubt_kinds(&rows),
        doubts: doubts(&cameras, &failures),
        cameras,
        failures,
        rows,
        out: PathBuf::new(),
    };
    Ok(Gathered { fleet, read: reader.read })
}

fn camera(reader: &mut Reader<'_>, name: &str, failures: &mut Failures) -> Result<(Camera, Vec<RecordingRow>)> {
    let root = PathBuf::from(name);
    let calibration = calibration(reader, &root, failures)?;
    let (mut checks, mut rows) = (Vec::new(), Vec::new());
    for day in reader.names(&Path::new("codes").join(&root)) {
        if !reader.folder.join("codes").join(&root).join(&day).is_dir() {
            continue;
        }
        let check = check(reader, &root, &day, failures)?;
        if let Some(recorded) = reader.code(&root.join(&day).join("warmup"))? {
            note(failures, &recorded, &root.join(&day).join("warmup"));
        }
        let recordings = root.join(&day).join("recordings");
        for file in reader.names(&Path::new("codes").join(&recordings)) {
            let Some(recording) = file.strip_suffix(".code") else { continue };
            let place = [name, &day, recording].map(str::to_owned);
            rows.push(row(reader, place, &recordings.join(recording), check.as_ref(), failures)?);
        }
        checks.extend(check);
    }
    let with_result = rows.iter().filter(|row| has_result(row.code)).count();
    let camera = Camera {
        camera: name.to_owned(),
        calibration,
        checks,
        recordings: [rows.len(), with_result],
        flagged_fraction: mean_flags(&rows).get("any").copied(),
    };
    Ok((camera, rows))
}

fn note(failures: &mut Failures, recorded: &Recorded, step: &Path) {
    if !has_result(recorded.code) {
        let reason = recorded.reason.as_deref().unwrap_or("no reason was written");
        failures.entry(recorded.code).or_default().push(format!("{}: {reason}", step.display()));
    }
}

fn calibration(reader: &mut Reader<'_>, root: &Path, failures: &mut Failures) -> Result<Option<Calibration>> {
    let step = root.join("calibration");
    let Some(recorded) = reader.code(&step)? else { return Ok(None) };
    note(failures, &recorded, &step);
    let summary = summary_of(reader, &step, recorded.code)?;
    let sigma0 = summary.as_ref().and_then(|summary| summary.get("sigma0")).and_then(Value::as_f64);
    let doubts = summary.as_ref().map_or(0, |summary| kinds_in(summary).len());
    Ok(Some(Calibration { recorded, sigma0, doubts }))
}

/// The summary of a step that has a result.
fn summary_of(reader: &mut Reader<'_>, step: &Path, code: u8) -> Result<Option<Value>> {
    let file = PathBuf::from("results").join(step).join("summary.json");
    if has_result(code) { reader.json(&file) } else { Ok(None) }
}

fn check(reader: &mut Reader<'_>, root: &Path, day: &str, failures: &mut Failures) -> Result<Option<DayCheck>> {
    let step = root.join(day).join("check");
    let Some(recorded) = reader.code(&step)? else { return Ok(None) };
    note(failures, &recorded, &step);
    let found = match recorded.code {
        0 | 1 => reader.json(&PathBuf::from("checks").join(root).join(format!("{day}.json")))?,
        _ => None,
    };
    let flag = |name: &str| found.as_ref().and_then(|found| found.get(name)).and_then(Value::as_bool);
    Ok(Some(DayCheck {
        day: day.to_owned(),
        moved: flag("moved"),
        matters: flag("matters"),
        change_rms_m: found.as_ref().and_then(|found| found.get("change_rms_m")).and_then(Value::as_f64),
        recorded,
    }))
}

fn row(
    reader: &mut Reader<'_>,
    place: [String; 3],
    step: &Path,
    check: Option<&DayCheck>,
    failures: &mut Failures,
) -> Result<RecordingRow> {
    let Some(recorded) = reader.code(step)? else { return Ok(RecordingRow::default()) };
    note(failures, &recorded, step);
    let summary = summary_of(reader, step, recorded.code)?.unwrap_or_default();
    let count = |name: &str| summary.get(name).and_then(Value::as_u64);
    let text = |pointer: &str| summary.pointer(pointer).and_then(Value::as_str).map(str::to_owned);
    let flags = summary.get("flags_fraction").and_then(Value::as_object).into_iter().flatten();
    Ok(RecordingRow {
        place,
        code: recorded.code,
        frames: count("frames"),
        stations: count("stations"),
        points: count("points"),
        sigma_range_median_m: summary.get("sigma_range_median_m").and_then(Value::as_f64),
        flags_fraction: flags.filter_map(|(name, share)| Some((name.clone(), share.as_f64()?))).collect(),
        doubt_kinds: kinds_in(&summary),
        calibration_matters: check.and_then(|check| check.matters),
        calibration_change_m: check.and_then(|check| check.change_rms_m),
        made: [text("/made/version"), text("/made/digest")],
        reason: recorded.reason,
    })
}

/// Kinds of the doubts in a summary, in their order; older summaries have words alone.
fn kinds_in(summary: &Value) -> Vec<String> {
    let doubts = summary.get("doubts").and_then(Value::as_array).into_iter().flatten();
    doubts.map(|doubt| doubt.get("kind").and_then(Value::as_str).unwrap_or("other").to_owned()).collect()
}

/// Mean over the recordings that have a result of the share of each flag; one that a summary does not name is zero there.
fn mean_flags(rows: &[RecordingRow]) -> BTreeMap<String, f64> {
    let counted: Vec<&RecordingRow> = rows.iter().filter(|row| !row.flags_fraction.is_empty()).collect();
    let names: BTreeSet<&String> = counted.iter().flat_map(|row| row.flags_fraction.keys()).collect();
    let share = |name: &String| counted.iter().filter_map(|row| row.flags_fraction.get(name)).sum::<f64>();
    names.into_iter().map(|name| (name.clone(), share(name) / counted.len() as f64)).collect()
}

fn doubt_kinds(rows: &[RecordingRow]) -> Vec<DoubtCount> {
    let mut kinds: BTreeMap<String, usize> = BTreeMap::new();
    for row in rows {
        let once: BTreeSet<&String> = row.doubt_kinds.iter().collect();
        for kind in once {
            *kinds.entry(kind.clone()).or_default() += 1;
        }
    }
    kinds.into_iter().map(|(kind, recordings)| DoubtCount { kind, recordings }).collect()
}
