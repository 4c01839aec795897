//! Bags of ROS 1, version 2.0: records with named fields, most of them in compressed chunks.

mod index;
mod reader;
mod records;

pub(crate) use reader::Bag;

/// What a bag begins with.
pub(crate) const MAGIC: &[u8] = b"#ROSBAG V2.0\n";

/// Kinds of records: the field `op`.
mod op {
    pub const MESSAGE: u8 = 0x02;
    pub const BAG_HEADER: u8 = 0x03;
    pub const CHUNK: u8 = 0x05;
    pub const CHUNK_INFO: u8 = 0x06;
    pub const CONNECTION: u8 = 0x07;
}
