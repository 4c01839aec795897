//! Bags of ROS 1.

use std::io::Write;

use recordings::{CameraInfo, Image, Imu, Payload};

use super::{START_NS, messages};

fn counted(bytes: &[u8]) -> Vec<u8> {
    [&(bytes.len() as u32).to_le_bytes()[..], bytes].concat()
}

fn header(fields: &[(&str, &[u8])]) -> Vec<u8> {
    let fields = fields.iter().map(|(name, value)| counted(&[name.as_bytes(), b"=", value].concat()));
    counted(&fields.collect::<Vec<_>>().concat())
}

pub fn record(fields: &[(&str, &[u8])], data: &[u8]) -> Vec<u8> {
    [header(fields), counted(data)].concat()
}

fn connection(id: u32, topic: &str, kind: &str) -> Vec<u8> {
    let inner = header(&[
        ("topic", topic.as_bytes()),
        ("type", kind.as_bytes()),
        ("md5sum", b"*"),
        ("message_definition", b""),
    ]);
    record(&[("op", &[7]), ("conn", &id.to_le_bytes()), ("topic", topic.as_bytes())], &inner[4..])
}

fn time(ns: i64) -> Vec<u8> {
    let [seconds, rest] = [ns / 1_000_000_000, ns % 1_000_000_000].map(|value| (value as u32).to_le_bytes());
    [seconds, rest].concat()
}

fn f64s(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

fn u32s(values: &[u32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// A message as ROS 1 lays it out.
fn serialised(ns: i64, payload: &Payload) -> (&'static str, Vec<u8>) {
    let head = |frame: &str| [u32s(&[7]), time(ns), counted(frame.as_bytes())].concat();
    match payload {
        Payload::Image(image) => ("sensor_msgs/Image", [head(image.frame_id()), of_image(image)].concat()),
        Payload::CameraInfo(info) => ("sensor_msgs/CameraInfo", [head(&info.frame_id), of_camera(info)].concat()),
        Payload::Imu(imu) => ("sensor_msgs/Imu", [head(&imu.frame_id), of_imu(imu)].concat()),
        other => panic!("{other:?}"),
    }
}

fn of_image(image: &Image) -> Vec<u8> {
    let size = u32s(&[image.height() as u32, image.width() as u32]);
    let encoding = counted(image.encoding().name().as_bytes());
    [size, encoding, vec![0], u32s(&[image.step() as u32]), counted(image.data())].concat()
}

fn of_camera(info: &CameraInfo) -> Vec<u8> {
    let model = counted(info.distortion_model.as_bytes());
    let count = u32s(&[info.distortion.len() as u32]);
    let values = [&info.distortion[..], &info.matrix, &info.rectification, &info.projection].concat();
    let rest = u32s(&[info.binning.as_slice(), info.window.as_slice()].concat());
    [u32s(&[info.height, info.width]), model, count, f64s(&values), rest, vec![1]].concat()
}

fn of_imu(imu: &Imu) -> Vec<u8> {
    let mut values = vec![0.0; 4];
    values.extend([-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    for measured in [&imu.angular_velocity, &imu.linear_acceleration].into_iter().flatten() {
        values.extend(measured.value);
        values.extend(measured.covariance);
    }
    f64s(&values)
}

/// A bag with two messages in each chunk.
pub fn recording(compression: &str) -> Vec<u8> {
    let magic = b"#ROSBAG V2.0\n".to_vec();
    let (mut body, mut topics, mut chunks) = (Vec::new(), Vec::<(&str, Vec<u8>)>::new(), Vec::new());
    for pair in messages().chunks(2) {
        let (mut inner, mut counts) = (Vec::new(), Vec::new());
        for (topic, ns, payload) in pair {
            let (kind, bytes) = serialised(START_NS + ns, payload);
            let id = topics.iter().position(|(known, _)| known == topic).unwrap_or_else(|| {
                let record = connection(topics.len() as u32, topic, kind);
                inner.extend(&record);
                topics.push((topic, record));
                topics.len() - 1
            }) as u32;
            let fields: [(&str, &[u8]); 3] =
                [("op", &[2]), ("conn", &id.to_le_bytes()), ("time", &time(START_NS + ns))];
            inner.extend(record(&fields, &bytes));
            counts.extend(u32s(&[id, 1]));
        }
        let compressed = match compression {
            "lz4" => {
                let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
                encoder.write_all(&inner).unwrap();
                encoder.finish().unwrap()
            }
            _ => inner.clone(),
        };
        let fields: [(&str, &[u8]); 3] =
            [("op", &[5]), ("compression", compression.as_bytes()), ("size", &(inner.len() as u32).to_le_bytes())];
        body.extend(record(&fields, &compressed));
        // The index of a chunk's messages, which is passed over.
        body.extend(record(&[("op", &[4]), ("ver", &[1, 0, 0, 0]), ("conn", &[0; 4]), ("count", &[0; 4])], &[]));
        chunks.push(record(&[("op", &[6]), ("ver", &[1, 0, 0, 0]), ("count", &[2, 0, 0, 0])], &counts));
    }
    let head = |place: u64| {
        let counts = [topics.len(), chunks.len()].map(|count| (count as u32).to_le_bytes());
        let fields: [(&str, &[u8]); 4] = [
            ("op", &[3]),
            ("index_pos", &place.to_le_bytes()),
            ("conn_count", &counts[0]),
            ("chunk_count", &counts[1]),
        ];
        record(&fields, &[b' '; 100])
    };
    let place = (magic.len() + head(0).len() + body.len()) as u64;
    let index = [topics.iter().flat_map(|(_, record)| record.clone()).collect(), chunks.concat()].concat();
    [magic, head(place), body, index].concat()
}
