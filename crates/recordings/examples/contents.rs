//! What a recording holds: `cargo run -p recordings --all-features --example contents -- FILE`.
#![allow(clippy::print_stdout)]

use recordings::{Payload, Recording};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("expected the name of a recording")?;
    let mut recording = Recording::open(path)?;
    let mut counts = Vec::new();
    while let Some(message) = recording.next_message()? {
        counts.resize(recording.streams().len(), [0, 0]);
        counts[message.stream][usize::from(matches!(message.payload, Payload::Unreadable(_)))] += 1;
    }
    counts.resize(recording.streams().len(), [0, 0]);
    println!("{}, {} bytes", recording.format().name(), recording.length());
    for (stream, [good, bad]) in recording.streams().iter().zip(counts) {
        println!(
            "{:<40} {:<12} {good:>8} messages, {bad} unreadable ({})",
            stream.name,
            stream.kind.name(),
            stream.type_name
        );
    }
    for fault in recording.faults() {
        println!("fault at byte {}: {}", fault.at_byte, fault.reason);
    }
    println!("{:?}", recording.ending());
    Ok(())
}
