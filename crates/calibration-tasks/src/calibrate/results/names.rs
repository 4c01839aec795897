//! Names of what was observed, as files and reports write them.

use self_calibration::Verdict;

/// Unit of a component or of the group of its name; control has metres and radians.
pub(crate) fn group_unit(name: &str) -> &'static str {
    match name {
        "col" | "row" | "passive_col" | "passive_row" => "px",
        "control" => "m or rad",
        _ => "m",
    }
}

/// Name of a verdict in tables.
pub(crate) fn verdict_name(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Used => "used",
        Verdict::Rejected => "rejected",
        Verdict::Uncontrolled => "uncontrolled",
        Verdict::LeftOut => "left_out",
    }
}
