//! What a camera's program does: it writes each frame behind a header, here of a wall that comes nearer at 0.1 m/s, 10 frames a second.
//!
//! `cargo run -p live-tasks --example camera_program 50 | rangecam live - --survey FOLDER`, FOLDER being one whose `survey.ron` states
//! 176 x 144 pixels, one frequency of 20 MHz and four phase steps.

use std::error::Error;
use std::io::{BufWriter, Write, stdout};
use std::thread::sleep;
use std::time::Duration;

use live_tasks::range_image::Modulation;
use live_tasks::{FrameHeader, SampleType, write_live_frame};

const SIZE: [usize; 2] = [176, 144];
const RATE_HZ: f64 = 10.0;

fn main() -> Result<(), Box<dyn Error>> {
    let frames: u32 = std::env::args().nth(1).map_or(Ok(50), |count| count.parse())?;
    let modulation = Modulation::new(20e6)?;
    let mut out = BufWriter::new(stdout().lock());
    for number in 0..frames {
        let timestamp_s = f64::from(number) / RATE_HZ;
        let header = FrameHeader {
            sample_type: SampleType::U16,
            width: SIZE[0],
            height: SIZE[1],
            frequencies: 1,
            phase_steps: 4,
            timestamp_s,
            integration_time_s: None,
            temperature_c: None,
        };
        let phase = modulation.phase_from_range(3.0 - 0.1 * timestamp_s);
        let sample = |step: i32| 2000.0 + 800.0 * (phase + std::f64::consts::FRAC_PI_2 * f64::from(step)).cos();
        let samples: Vec<u16> =
            (0..4).flat_map(|step| std::iter::repeat_n(sample(step).round() as u16, SIZE[0] * SIZE[1])).collect();
        write_live_frame(&mut out, &header, samples.as_slice())?;
        out.flush()?;
        sleep(Duration::from_secs_f64(1.0 / RATE_HZ));
    }
    Ok(())
}
