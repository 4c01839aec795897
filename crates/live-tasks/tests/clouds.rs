//! The stream of clouds.

use live_tasks::LiveSource;
use range_io::clouds::read_any_cloud;

use crate::common::{FRAMES, World};

/// Parts a stream into its files by what their headers say.
fn parts(stream: &[u8]) -> Vec<&[u8]> {
    const END: &[u8] = b"end_header\n";
    let mut rest = stream;
    let mut parts = Vec::new();
    while !rest.is_empty() {
        let header = rest.windows(END.len()).position(|bytes| bytes == END).unwrap() + END.len();
        let text = std::str::from_utf8(&rest[..header]).unwrap();
        let points: usize =
            text.lines().find_map(|line| line.strip_prefix("element vertex ")).unwrap().parse().unwrap();
        let (part, behind) = rest.split_at(header + 22 * points);
        parts.push(part);
        rest = behind;
    }
    parts
}

#[test]
fn each_part_of_the_stream_is_a_file() {
    let world = World::new();
    let (summary, stream) = world.clouds(world.request(LiveSource::Path(world.survey())));
    let parts = parts(&stream);
    assert_eq!(parts.len(), FRAMES);
    let mut points = 0;
    for (part, frame) in parts.iter().zip(world.frames()) {
        let time = format!("comment timestamp_s {}\n", frame.header.timestamp_s);
        assert!(String::from_utf8_lossy(&part[..300]).contains(&time), "{time}");
        let file = world.path("one.ply");
        std::fs::write(&file, part).unwrap();
        let cloud = read_any_cloud(&file).unwrap();
        points += cloud.points.len() as u64;
        let (sigma, flags) = (cloud.sigma.unwrap(), cloud.flags.unwrap());
        let middle = cloud.points.iter().map(|point| point[2]).sum::<f64>() / cloud.points.len() as f64;
        // The wall is 2.1 m away, with a box before it.
        assert!((-2.15..-1.8).contains(&middle), "{middle}");
        assert!(sigma.iter().all(|sigma| (0.0001..0.1).contains(sigma)));
        assert_eq!(flags.len(), cloud.points.len());
        assert!(cloud.intensity.is_some());
    }
    assert_eq!(points, summary.points);
}
