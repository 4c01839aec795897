//! The mountings of a rig in a folder with `rig.ron`: `cargo run -p rig-tasks --example calibrate_rig -- RIG OUT`.
#![allow(clippy::print_stdout)]

use rig_tasks::calibrate_rig;
use rig_tasks::calibration_tasks::pipeline::{DriftTreatment, Silent};
use rig_tasks::calibration_tasks::{
    CalibrateMethod, CalibrateRequest, CalibrationOptions, CertificateRequest, Method, OffsetModel, TableDefaults,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(rig), Some(out)) = (arguments.next(), arguments.next()) else {
        println!("usage: calibrate_rig RIG OUT");
        return Ok(());
    };
    let request = CalibrateRequest {
        survey: rig.into(),
        lens_survey: None,
        calibration: None,
        method: CalibrateMethod::Network(Method::OneStep),
        options: CalibrationOptions::default(),
        offset: OffsetModel::Constant,
        warm_up: DriftTreatment::Apply,
        defaults: TableDefaults::default(),
        certificate: CertificateRequest::default(),
        out: out.into(),
    };
    println!("{}", calibrate_rig(&request, &Silent)?);
    Ok(())
}
