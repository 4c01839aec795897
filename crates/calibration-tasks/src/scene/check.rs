//! What a network's scene may say.

use std::collections::BTreeSet;

use commands::plan::{Fault, Rule, check_numbers};

use crate::scene::spec::{FieldSpec, NetworkScene, SightingSpec};

/// Targets of a network: a hundred times the largest test field's.
pub const MOST_TARGETS: usize = 100_000;

/// Targets times stations: what every station would observe if it saw all.
pub const MOST_SIGHTINGS: usize = 1 << 22;

type Check = Result<(), Fault>;

impl NetworkScene {
    /// Refuses numbers that mean nothing, empty and doubled names, and more than can be computed.
    pub(crate) fn check(&self) -> Check {
        let in_field = self.field.as_ref().map_or(Ok(0), FieldSpec::check)?;
        let targets = in_field.saturating_add(self.targets.len());
        require(targets <= MOST_TARGETS, "targets", || format!("are {targets}, expected at most {MOST_TARGETS}"))?;
        require(!self.stations.is_empty(), "stations", || "is empty, expected at least one".to_owned())?;
        let sightings = targets.saturating_mul(self.stations.len());
        require(sightings <= MOST_SIGHTINGS, "stations", || {
            let stations = self.stations.len();
            format!("{stations} stations times {targets} targets are more than {MOST_SIGHTINGS} sightings")
        })?;
        self.check_targets(in_field)?;
        self.check_stations()?;
        let sigmas = self.distances.iter().enumerate();
        check_numbers(sigmas.map(|(index, (_, _, sigma))| (format!("distances[{index}]"), *sigma, Rule::Positive)))?;
        for (index, span) in self.amplitude_span.iter().flatten().enumerate() {
            check_numbers([(format!("amplitude_span[{index}]"), *span, Rule::NotNegative)])?;
        }
        check_numbers(self.truth.iter().map(|(name, value)| (format!("truth.{name}"), *value, Rule::Finite)))?;
        if let Some(passive) = &self.passive {
            let numbers = passive.position_m.iter().map(|value| ("passive.position_m", *value));
            let numbers = numbers.chain(passive.attitude_deg.iter().map(|value| ("passive.attitude_deg", *value)));
            check_numbers(numbers.map(|(field, value)| (field.to_owned(), value, Rule::Finite)))?;
        }
        self.sightings.check()
    }

    fn check_targets(&self, in_field: usize) -> Check {
        let mut names: BTreeSet<String> = (1..=in_field).map(FieldSpec::name).collect();
        for (index, target) in self.targets.iter().enumerate() {
            let path = format!("targets[{index}]");
            check_name(&format!("{path}.name"), &target.name, &mut names)?;
            let position = target.position_m.iter().map(|value| ("position_m", *value, Rule::Finite));
            let sigma = target.sigma_m.iter().flatten().map(|value| ("sigma_m", *value, Rule::Positive));
            check_numbers(position.chain(sigma).map(|(field, value, rule)| (format!("{path}.{field}"), value, rule)))?;
        }
        Ok(())
    }

    fn check_stations(&self) -> Check {
        let mut names = BTreeSet::new();
        for (index, station) in self.stations.iter().enumerate() {
            let path = format!("stations[{index}]");
            check_name(&format!("{path}.name"), &station.name, &mut names)?;
            let angles = [station.aside_deg, station.above_deg, station.roll_deg];
            let angles = ["aside_deg", "above_deg", "roll_deg"].into_iter().zip(angles);
            let finite = angles.chain(station.at_m.iter().map(|value| ("at_m", *value)));
            let numbers = finite
                .map(|(field, value)| (field, value, Rule::Finite))
                .chain([("distance_m", station.distance_m, Rule::NotNegative)])
                .chain(station.integration_time_s.map(|time| ("integration_time_s", time, Rule::Positive)));
            check_numbers(numbers.map(|(field, value, rule)| (format!("{path}.{field}"), value, rule)))?;
        }
        Ok(())
    }
}

impl FieldSpec {
    /// Number of targets.
    fn check(&self) -> Result<usize, Fault> {
        let targets = self.columns.saturating_mul(self.rows);
        require((1..=MOST_TARGETS).contains(&targets), "field", || {
            let (columns, rows) = (self.columns, self.rows);
            format!("has {columns} x {rows} targets, expected 1 to {MOST_TARGETS}")
        })?;
        check_numbers([
            ("field.spacing_m".to_owned(), self.spacing_m, Rule::Positive),
            ("field.relief_m".to_owned(), self.relief_m, Rule::Finite),
        ])?;
        Ok(targets)
    }
}

impl SightingSpec {
    fn check(&self) -> Check {
        let [darkest, brightest] = self.reflectance_span;
        let numbers = [
            ("sigma_pixel", self.sigma_pixel, Rule::Positive),
            ("sigma_range_m", self.sigma_range_m, Rule::Positive),
            ("sigma_passive_pixel", self.sigma_passive_pixel, Rule::Positive),
            ("gross_error_share", self.gross_error_share, Rule::Share),
            ("amplitude_at_1_m", self.amplitude_at_1_m.unwrap_or(1.0), Rule::Positive),
            ("reflectance_span[0]", darkest, Rule::Positive),
            ("reflectance_span[1]", brightest, Rule::Positive),
            ("start_position_m", self.start_position_m, Rule::NotNegative),
            ("start_attitude_deg", self.start_attitude_deg, Rule::NotNegative),
        ];
        check_numbers(numbers.map(|(field, value, rule)| (format!("sightings.{field}"), value, rule)))?;
        require(darkest <= brightest, "sightings.reflectance_span", || {
            format!("is ({darkest}, {brightest}), expected the smaller and the larger end")
        })
    }
}

/// A name goes into tables and onto terminals, and stands for one thing.
fn check_name(field: &str, name: &str, names: &mut BTreeSet<String>) -> Check {
    let sound = !name.trim().is_empty() && !name.contains(char::is_control);
    require(sound, field, || format!("is {name:?}, expected a name"))?;
    require(names.insert(name.to_owned()), field, || format!("`{name}` is given twice"))
}

fn require(holds: bool, field: &str, reason: impl FnOnce() -> String) -> Check {
    if holds { Ok(()) } else { Err((field.to_owned(), reason())) }
}
