//! A comparison as lines of text.

use std::fmt;

use super::{CloudComparison, Comparison, PoseComparison, TrajectoryComparison, millimetres_of as mm};

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut lines = Vec::new();
        if let Some(clouds) = &self.clouds {
            clouds.say(&mut lines);
        }
        if let Some(poses) = &self.poses {
            poses.say(&mut lines);
        }
        if let Some(trajectory) = &self.trajectory {
            trajectory.say(&mut lines);
        }
        if let Some(report) = &self.report {
            lines.push(format!("report: {}", report.display()));
        }
        f.write_str(&lines.join("\n"))
    }
}

impl CloudComparison {
    fn say(&self, lines: &mut Vec<String>) {
        let left_out = match (self.left_out, self.beyond) {
            (0, 0) => String::new(),
            (flagged, 0) => format!(" ({flagged} more are flagged or without position)"),
            (flagged, beyond) => format!(" ({flagged} more are flagged or without position, {beyond} too far away)"),
        };
        lines.push(format!("clouds: {} points against {}{left_out}", self.points, self.reference_points));
        if let Some(alignment) = &self.alignment {
            let ([x, y, z], [a, b, c]) = (alignment.translation_m, alignment.rotation_deg);
            lines.push(format!(
                "  registered first: moved by ({x:.4}, {y:.4}, {z:.4}) m, turned by ({a:.3}, {b:.3}, {c:.3}) degrees, overlap \
                 {:.0} %, rms {}",
                100.0 * alignment.overlap,
                mm(alignment.rms_m)
            ));
            lines.extend(alignment.doubts.iter().map(|doubt| format!("  doubt: {doubt}")));
        }
        lines.push(format!(
            "  nearest point: median {}, 95 % below {}, rms {}, at most {}",
            mm(self.distance_median_m),
            mm(self.distance_p95_m),
            mm(self.distance_rms_m),
            mm(self.distance_max_m)
        ));
        if let Some(plane) = &self.plane {
            lines.push(format!(
                "  local plane:   median {}, 95 % below {}, rms {}, at most {}, mean {} ({} points; positive: {})",
                mm(plane.absolute_median_m),
                mm(plane.absolute_p95_m),
                mm(plane.rms_m),
                mm(plane.absolute_max_m),
                mm(plane.mean_m),
                plane.points,
                plane.positive
            ));
        }
    }
}

impl PoseComparison {
    fn say(&self, lines: &mut Vec<String>) {
        let alone = match (self.only_first, self.only_second) {
            (0, 0) => String::new(),
            (a, b) => format!(" ({a} only in the first, {b} only in the second)"),
        };
        lines.push(format!(
            "poses: {} in common{alone}, position rms {}, at most {}, attitude at most {:.4} degrees",
            self.poses,
            mm(self.position_rms_m),
            mm(self.position_max_m),
            self.attitude_max_deg
        ));
    }
}

impl TrajectoryComparison {
    fn say(&self, lines: &mut Vec<String>) {
        let [a, b] = self.poses;
        lines.push(format!("trajectory: {} poses in common of {a} and {b}", self.matched));
        for row in &self.absolute {
            let scale = if row.alignment == "with scale" { format!(", scale {:.5}", row.scale) } else { String::new() };
            lines.push(format!(
                "  absolute, {}: position rms {}, median {}, at most {}; attitude rms {:.3} degrees, at most {:.3}{scale}",
                row.alignment,
                mm(row.position_m.rms),
                mm(row.position_m.median),
                mm(row.position_m.max),
                row.attitude_deg.rms,
                row.attitude_deg.max
            ));
        }
        for row in &self.relative {
            lines.push(format!(
                "  relative, over {}: translation rms {}, at most {}; rotation rms {:.3} degrees, at most {:.3} ({} steps)",
                row.step,
                mm(row.translation_m.rms),
                mm(row.translation_m.max),
                row.rotation_deg.rms,
                row.rotation_deg.max,
                row.steps
            ));
        }
        let worst: Vec<String> =
            self.worst.iter().map(|[time, error]| format!("{} at {time:.3} s", mm(*error))).collect();
        lines.push(format!("  worst: {}", worst.join(", ")));
    }
}
