//! Where commands write, and what they leave behind.

use commands::{Error, Failure, Inputs, produce};

fn refused() -> Error {
    let summary = r#"{"refused": "two stations share nothing"}"#.to_owned();
    Error::Refused { summary, source: "two stations share nothing".into(), written: None }
}

#[test]
fn an_output_never_lies_over_an_input() {
    let folder = tempfile::tempdir().unwrap();
    let survey = folder.path().join("survey");
    std::fs::create_dir(&survey).unwrap();
    std::fs::write(survey.join("frame.npy"), "data").unwrap();
    let inputs = Inputs::default().path(&survey);
    for out in [survey.clone(), survey.join("out"), folder.path().to_owned()] {
        let error = inputs.destination(&out).map(drop).unwrap_err();
        assert_eq!(error.failure(), Failure::Usage, "{}: {error}", out.display());
    }
    assert_eq!(std::fs::read(survey.join("frame.npy")).unwrap(), b"data");
    inputs.destination(&folder.path().join("out")).unwrap();
}

#[test]
fn a_refusal_is_written_beside_an_older_result_and_a_failure_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (out, inputs) = (folder.path().join("out"), Inputs::default());
    let usage = produce(&out, &inputs, |_| Err::<(), _>(Error::Camera("none".to_owned()))).unwrap_err();
    assert_eq!(usage.failure(), Failure::Usage);
    assert!(!out.exists());

    produce(&out, &inputs, |_| Err::<(), _>(refused())).unwrap_err();
    assert!(std::fs::read_to_string(out.join("summary.json")).unwrap().contains("share nothing"));

    let write = |destination: &commands::atomic_output::Destination| {
        let folder = destination.open()?;
        std::fs::write(folder.file("cloud.ply")?, "points").unwrap();
        folder.commit()?;
        Ok(())
    };
    produce(&out, &inputs, write).unwrap();
    produce(&out, &inputs, |_| Err::<(), _>(refused())).unwrap_err();
    assert!(out.join("cloud.ply").exists() && out.join("refused.json").exists());
}
