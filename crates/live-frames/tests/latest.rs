//! The slot between camera and processor.

use std::time::Duration;

use live_frames::latest_frame;

#[test]
fn the_newest_wins_and_the_rest_is_counted() {
    const FRAMES: u64 = 2000;
    let (mut writer, reader) = latest_frame();
    let reads = std::thread::spawn(move || {
        let (mut last, mut count) = (0, 0);
        while let Some(frame) = reader.read() {
            assert!(frame > last, "frames never go back");
            (last, count) = (frame, count + 1);
        }
        (last, count, reader.dropped())
    });
    let mut replaced = 0;
    for frame in 1..=FRAMES {
        replaced += u64::from(writer.write(frame).is_some());
    }
    assert_eq!(writer.dropped(), replaced);
    drop(writer);
    let (last, count, dropped) = reads.join().unwrap();
    assert_eq!(last, FRAMES, "the newest is never lost");
    assert_eq!(count + dropped, FRAMES);
    assert_eq!(dropped, replaced);
}

#[test]
fn waiting_ends() {
    let (writer, reader) = latest_frame::<u8>();
    assert_eq!(reader.read_within(Duration::from_millis(5)), None);
    assert!(!reader.is_closed());
    drop(writer);
    assert_eq!(reader.read_within(Duration::from_secs(60)), None);
    assert_eq!(reader.read(), None);
    assert!(reader.is_closed());
}
