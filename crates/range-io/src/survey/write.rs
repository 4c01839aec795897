use std::path::Path;

use range_image::{ComplexChannel, ComplexFrame, Raster, Samples};

use super::InputFrame;
use crate::Result;
use crate::formats::npz::NpzWriter;
use atomic_output::FileWriter;

/// Writes a frame as the `.npz` of its level.
///
/// Of a frame of level `phase` the phase goes out in the conventions' sense, so the survey must not give another.
pub fn write_frame(path: impl AsRef<Path>, frame: &InputFrame) -> Result<()> {
    let mut writer = NpzWriter::create(path)?;
    match frame {
        InputFrame::Samples(frame) => {
            let shape = [frame.modulations().len(), frame.phase_steps(), frame.height(), frame.width()];
            match frame.samples() {
                Samples::F32(values) => writer.add("samples", &shape, values)?,
                Samples::U16(values) => writer.add("samples", &shape, values)?,
                Samples::I16(values) => writer.add("samples", &shape, values)?,
            }
        }
        InputFrame::Phase(frame) => write_phase(&mut writer, frame)?,
        InputFrame::Range { range, amplitude, confidence } => {
            write_planes(
                &mut writer,
                [("range", Some(range)), ("amplitude", amplitude.as_ref()), ("confidence", confidence.as_ref())],
            )?;
        }
        InputFrame::Depth { depth, amplitude, confidence } => {
            write_planes(
                &mut writer,
                [("depth", Some(depth)), ("amplitude", amplitude.as_ref()), ("confidence", confidence.as_ref())],
            )?;
        }
        InputFrame::Intensity(image) => {
            writer.add("intensity", &[image.height(), image.width()], image.as_slice())?;
        }
    }
    writer.commit()
}

fn write_phase(writer: &mut NpzWriter<FileWriter>, frame: &ComplexFrame) -> Result<()> {
    let shape = [frame.channels.len(), frame.height(), frame.width()];
    let collect = |plane: &dyn Fn(&ComplexChannel) -> Raster<f32>| {
        frame.channels.iter().flat_map(|channel| plane(channel).into_vec()).collect::<Vec<_>>()
    };
    writer.add("phase", &shape, &collect(&ComplexChannel::phase))?;
    writer.add("amplitude", &shape, &collect(&ComplexChannel::amplitude))?;
    let intensity = frame.channels.first().and_then(|channel| channel.offset.as_ref());
    intensity.map_or(Ok(()), |plane| writer.add("intensity", &shape[1..], plane.as_slice()))
}

fn write_planes(writer: &mut NpzWriter<FileWriter>, planes: [(&str, Option<&Raster<f32>>); 3]) -> Result<()> {
    for (name, plane) in planes {
        if let Some(plane) = plane {
            writer.add(name, &[plane.height(), plane.width()], plane.as_slice())?;
        }
    }
    Ok(())
}
