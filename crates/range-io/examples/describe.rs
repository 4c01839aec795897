//! Tells what the frames of a survey hold: `cargo run -p range-io --example describe -- FOLDER`.
//!
//! Without a folder it writes a small survey into a temporary one and describes that.
#![allow(clippy::print_stdout)]

use std::path::{Path, PathBuf};

use range_image::Raster;
use range_io::atomic_output::Destination;
use range_io::survey::{InputFrame, Survey, read_frame, write_frame};

fn main() -> Result<(), range_io::Error> {
    let folder = match std::env::args_os().nth(1) {
        Some(folder) => PathBuf::from(folder),
        None => small_survey()?,
    };
    let survey = Survey::read(&folder)?;
    println!("{} x {} pixels, level `{}`", survey.camera.width, survey.camera.height, survey.level.name());
    for (index, entry) in survey.frames.iter().enumerate() {
        let frame = read_frame(&survey, &folder, index)?;
        println!("{} from station {}: {}", entry.file.display(), entry.station, describe(&frame));
    }
    Ok(())
}

fn describe(frame: &InputFrame) -> String {
    match frame {
        InputFrame::Samples(raw) => {
            format!("{} frequencies with {} samples each", raw.modulations().len(), raw.phase_steps())
        }
        InputFrame::Phase(complex) => format!("{} frequencies", complex.channels.len()),
        InputFrame::Range { range, .. } => format!("ranges {}", span(range)),
        InputFrame::Depth { depth, .. } => format!("depths {}", span(depth)),
        _ => "of a kind that this program does not know".to_owned(),
    }
}

/// Number of finite values, smallest and largest.
fn span(plane: &Raster<f32>) -> String {
    let finite: Vec<f32> = plane.as_slice().iter().copied().filter(|value| value.is_finite()).collect();
    let smallest = finite.iter().copied().fold(f32::INFINITY, f32::min);
    let largest = finite.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    format!("{smallest} to {largest} m in {} of {} pixels", finite.len(), plane.len())
}

/// A wall at 2 m seen by a camera of 4 x 3 pixels.
fn small_survey() -> Result<PathBuf, range_io::Error> {
    const TEXT: &str = r#"#![enable(implicit_some)]
(
    camera: (
        width: 4, height: 3, pixel_pitch_mm: (0.04, 0.04),
        principal_distance_mm: 8.0, principal_point_mm: (0.0, 0.0),
    ),
    level: depth,
    frames: [(file: "frames/000_0.npz", station: "S00", timestamp_s: 0.0)],
)"#;
    let target = std::env::temp_dir().join("range-io-describe");
    let output = Destination::new(&target, &[] as &[&Path])?.open()?;
    let depth = Raster::filled(4, 3, 2.0);
    write_frame(output.file("frames/000_0.npz")?, &InputFrame::Depth { depth, amplitude: None, confidence: None })?;
    Survey::parse(Path::new("survey.ron"), TEXT)?.write(output.file(Survey::FILE_NAME)?)?;
    output.commit()?;
    Ok(target)
}
