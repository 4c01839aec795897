//! Targets on a page to be printed.

use std::fmt;
use std::path::{Path, PathBuf};

use atomic_output::write_text;
use commands::{Doubt, Judged};
use pipeline::{Error, Result};
use serde::Serialize;
use targets::{
    Code, CodedOptions, INFRARED_NOTE, PaperSize, codes, print_checkerboard, print_circle_grid, print_coded,
};

use crate::kind::{BoardKind, SingleKind, TargetKind};

/// Diameter of printed dots in parts of their distance: a larger one at the origin has room up to three times as large.
const DOT_PARTS: f64 = 0.5;

/// What to print, and where to.
#[derive(Debug, Clone)]
pub struct PrintRequest {
    /// A checkerboard, a grid of discs, or coded rings.
    pub kind: TargetKind,
    /// The paper. What does not fit is refused.
    pub paper: PaperSize,
    /// First and last of the codes of rings; `None`: from 0 on, as many as the paper has room for.
    pub codes: Option<[usize; 2]>,
    /// The file (SVG). An earlier page is replaced, any other file is not.
    pub out: PathBuf,
}

/// What was printed.
#[derive(Debug, Clone, Serialize)]
pub struct PrintSummary {
    /// What it is: `checkerboard 9x6 0.025`.
    pub kind: String,
    /// Names of coded rings; empty for boards.
    pub codes: Vec<String>,
    /// What near infrared makes of ink and toner.
    pub infrared: &'static str,
    /// Where it was written.
    pub out: PathBuf,
}

/// Writes a page of targets, to scale.
///
/// # Errors
/// [`Error::Request`] for what is not printed on paper, does not fit the page or would replace a file that is no such page.
pub fn print_targets(request: &PrintRequest) -> Result<PrintSummary> {
    let refuse = |message: String| Error::Request { command: "targets --print", message };
    let fault = |error: targets::Error| refuse(error.to_string());
    let mut printed = Vec::new();
    let page = match &request.kind {
        TargetKind::Board(BoardKind::Checkerboard(board)) => print_checkerboard(board, request.paper).map_err(fault)?,
        TargetKind::Board(BoardKind::Circles(grid)) => {
            print_circle_grid(grid, DOT_PARTS * grid.spacing_m(), request.paper).map_err(fault)?
        }
        TargetKind::Single(SingleKind::Rings { diameter_m }) => {
            let all = codes(CodedOptions::default().bits).map_err(fault)?;
            let (chosen, page) = rings(request, &all, *diameter_m).map_err(refuse)?;
            printed = chosen.iter().map(ToString::to_string).collect();
            page
        }
        TargetKind::Single(kind) => {
            let message =
                format!("{} are not printed: checkerboard, circles, asymmetric-circles and rings are", kind.noun());
            return Err(refuse(message));
        }
    };
    if let Some(reason) = in_the_way(&request.out) {
        return Err(refuse(format!("{}: {reason}", request.out.display())));
    }
    if let Some(folder) = request.out.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        std::fs::create_dir_all(folder).map_err(|source| Error::Access { path: folder.to_owned(), source })?;
    }
    write_text(&request.out, &page)?;
    let (kind, out) = (request.kind.to_string(), request.out.clone());
    Ok(PrintSummary { kind, codes: printed, infrared: INFRARED_NOTE, out })
}

/// The codes that are asked for, or as many as there is room for, on their page.
fn rings<'a>(
    request: &PrintRequest,
    all: &'a [Code],
    diameter_m: f64,
) -> std::result::Result<(&'a [Code], String), String> {
    let page = |chosen: &'a [Code]| {
        let page = print_coded(chosen, diameter_m, request.paper).map_err(|error| error.to_string());
        page.map(|page| (chosen, page))
    };
    match request.codes {
        Some([first, last]) => {
            let chosen = if first <= last { all.get(first..=last) } else { None };
            let there = all.len().saturating_sub(1);
            page(
                chosen.ok_or_else(|| {
                    format!("--codes {first}-{last}: there are codes 0 to {there}, the smaller first")
                })?,
            )
        }
        None => (1..=all.len()).rev().find_map(|count| page(&all[..count]).ok()).map_or_else(|| page(&all[..1]), Ok),
    }
}

/// Why a file may not be written; `None` where there is none, or an earlier page.
fn in_the_way(path: &Path) -> Option<String> {
    if path.is_dir() {
        return Some("it is a folder: name a file, such as board.svg".to_owned());
    }
    if std::fs::symlink_metadata(path).is_err() {
        return None;
    }
    let is_page =
        std::fs::read_to_string(path).is_ok_and(|text| text.starts_with("<svg") && text.contains(INFRARED_NOTE));
    (!is_page).then(|| "it is there already and no page of targets: it is not replaced".to_owned())
}

impl fmt::Display for PrintSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}, written to {}", self.kind, self.out.display())?;
        if let (Some(first), Some(last)) = (self.codes.first(), self.codes.last()) {
            writeln!(f, "rings {first} to {last}: these are their names in targets.csv")?;
        }
        writeln!(f, "Print at 100 %, measure the bar of 100 mm, and mount it flat.")?;
        f.write_str(self.infrared)
    }
}

impl Judged for PrintSummary {
    fn doubts(&self) -> &[Doubt] {
        &[]
    }
}
