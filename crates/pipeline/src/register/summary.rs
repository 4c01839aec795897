//! Every figure of a registration by name; written as `summary.json` and shown as words.

use std::fmt;

use serde::Serialize;

use crate::summary::millimetres;

/// What was registered, and how well each pose is known.
#[derive(Debug, Clone, Default, Serialize)]
pub struct RegisterSummary {
    /// `pairs`, `multi` or `track`.
    pub method: &'static str,
    /// What was named.
    pub inputs: Vec<String>,
    /// Where the start values came from.
    pub start: String,
    /// What fixes the common frame.
    pub datum: String,
    /// All stations with their poses.
    pub stations: Vec<RegisteredStation>,
    /// Pairs of stations that were held together.
    pub pairs: Vec<RegisteredPair>,
    /// Pairs that overlap and were left out, each with its reason.
    pub refused: Vec<String>,
    /// How loops of pairs fail to close.
    pub loops: Vec<RegisteredLoop>,
    /// Parameters that were estimated together with the poses.
    pub parameters: Vec<EstimatedParameter>,
    /// A-posteriori standard deviation of unit weight.
    pub sigma0: Option<f64>,
    /// Redundancy.
    pub redundancy: Option<i64>,
    /// The stream, where one was tracked.
    pub stream: Option<StreamSummary>,
    /// Largest standard deviation of a station's position, metre.
    pub position_sigma_max_m: Option<f64>,
    /// Largest error of a station's position, where the truth is known, metre.
    pub position_error_max_m: Option<f64>,
    /// Largest error of a station's attitude, where the truth is known, degree.
    pub attitude_error_max_deg: Option<f64>,
    /// What a reader should know before the poses are used.
    pub doubts: Vec<String>,
    /// Wall-clock time, second.
    pub seconds: f64,
    /// The output folder.
    pub out: String,
}

/// One station or frame.
#[derive(Debug, Clone, Serialize)]
pub struct RegisteredStation {
    /// Name.
    pub name: String,
    /// Usable points.
    pub points: usize,
    /// Position of the perspective centre (or origin) in the common frame, metre.
    pub position_m: [f64; 3],
    /// omega, phi, kappa, degree.
    pub attitude_deg: [f64; 3],
    /// Standard deviation of the position in space, metre; `None` for the datum or where it is not known.
    pub position_sigma_m: Option<f64>,
    /// Standard deviation of the attitude about all axes, degree.
    pub attitude_sigma_deg: Option<f64>,
    /// Error of the position where the truth is known, metre.
    pub position_error_m: Option<f64>,
    /// Error of the attitude where the truth is known, degree.
    pub attitude_error_deg: Option<f64>,
    /// Motions that the surfaces do not determine.
    pub undetermined: Vec<String>,
}

/// Two stations that see the same surfaces.
#[derive(Debug, Clone, Serialize)]
pub struct RegisteredPair {
    /// The station held.
    pub target: String,
    /// The station moved.
    pub source: String,
    /// Fraction of the source that has partners.
    pub overlap: f64,
    /// Root mean square distance of surfaces seen from both, metre.
    pub rms_m: f64,
    /// Mean signed distance of surfaces seen from both, metre, where it was measured.
    pub mean_m: Option<f64>,
    /// Motions that the pair by itself does not determine.
    pub undetermined: Vec<String>,
}

/// A loop of pairs.
#[derive(Debug, Clone, Serialize)]
pub struct RegisteredLoop {
    /// The stations, from the first back to it.
    pub stations: Vec<String>,
    /// Distance by which it fails to close, metre.
    pub translation_m: f64,
    /// Angle by which it fails to close, degree.
    pub rotation_deg: f64,
}

/// A parameter with its quality.
#[derive(Debug, Clone, Serialize)]
pub struct EstimatedParameter {
    /// Name.
    pub name: String,
    /// Value.
    pub value: f64,
    /// Standard deviation.
    pub sigma: f64,
    /// Whether it differs from its prior value by more than chance (5 %).
    pub significant: bool,
}

/// A tracked stream.
#[derive(Debug, Clone, Default, Serialize)]
pub struct StreamSummary {
    /// Frames given.
    pub frames: usize,
    /// Frames with a pose.
    pub tracked: usize,
    /// Frames lost.
    pub lost: usize,
    /// Times that the pose was found again.
    pub relocalised: usize,
    /// Keyframes made.
    pub keyframes: usize,
    /// Frames tracked in a second of work.
    pub frames_per_second: f64,
    /// Length of the path, metre.
    pub path_m: f64,
    /// Root mean square error of the positions after rigid alignment, where the truth is known, metre.
    pub absolute_error_rms_m: Option<f64>,
}

impl fmt::Display for RegisterSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let points: usize = self.stations.iter().map(|station| station.points).sum();
        writeln!(
            f,
            "{}: {} stations, {} points, in {:.1} s; start: {}; datum: {}",
            self.method,
            self.stations.len(),
            points,
            self.seconds,
            self.start,
            self.datum
        )?;
        if let Some(stream) = &self.stream {
            writeln!(
                f,
                "{} of {} frames tracked, {} lost, {} found again, {} keyframes, path {:.2} m, {:.0} frames a second",
                stream.tracked,
                stream.frames,
                stream.lost,
                stream.relocalised,
                stream.keyframes,
                stream.path_m,
                stream.frames_per_second
            )?;
        } else {
            self.write_stations(f)?;
            self.write_pairs(f)?;
        }
        for parameter in &self.parameters {
            let verdict = if parameter.significant { "significant" } else { "not significant" };
            writeln!(f, "{} = {:.6} +- {:.6}, {verdict}", parameter.name, parameter.value, parameter.sigma)?;
        }
        if let (Some(sigma0), Some(redundancy)) = (self.sigma0, self.redundancy) {
            writeln!(f, "sigma0 {sigma0:.3}, redundancy {redundancy}")?;
        }
        if let (Some(position), Some(attitude)) = (self.position_error_max_m, self.attitude_error_max_deg) {
            writeln!(f, "truth: position error at most {:.2} mm, attitude {attitude:.4} degrees", 1e3 * position)?;
        }
        for doubt in &self.doubts {
            writeln!(f, "doubt: {doubt}")?;
        }
        write!(f, "results in {}", self.out)
    }
}

impl RegisterSummary {
    fn write_stations(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{:<16} {:>9}  {:>28}  {:>10}  {:>10}", "station", "points", "position, m", "sigma", "attitude")?;
        for station in &self.stations {
            let [x, y, z] = station.position_m;
            let attitude =
                station.attitude_sigma_deg.map_or_else(|| "-".to_owned(), |degrees| format!("{degrees:.4}°"));
            writeln!(
                f,
                "{:<16} {:>9}  {x:>8.3}, {y:>8.3}, {z:>8.3}  {:>10}  {attitude:>10}",
                station.name,
                station.points,
                millimetres(station.position_sigma_m)
            )?;
        }
        Ok(())
    }

    fn write_pairs(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for pair in &self.pairs {
            writeln!(
                f,
                "{} onto {}: overlap {:.0} %, rms {}{}",
                pair.source,
                pair.target,
                100.0 * pair.overlap,
                millimetres(Some(pair.rms_m)),
                pair.undetermined.iter().map(|motion| format!("; undetermined: {motion}")).collect::<String>()
            )?;
        }
        for refused in &self.refused {
            writeln!(f, "left out: {refused}")?;
        }
        Ok(())
    }
}
