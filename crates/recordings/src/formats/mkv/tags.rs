//! Tags: what the recorder tells of the device, and attached files.

use super::elements::{children, id, text, unsigned};

/// A tag's name and value, and the track that it is of.
pub(super) struct Tag {
    pub name: String,
    pub value: String,
    pub track_uid: Option<u64>,
}

/// The tags within the data of one.
pub(super) fn tags(data: &[u8]) -> Vec<Tag> {
    let (mut found, mut track_uid) = (Vec::new(), None);
    for (id, data) in children(data) {
        match id {
            id::TARGETS => {
                track_uid = children(data).find(|(id, _)| *id == id::TARGET_TRACK_UID).map(|(_, data)| unsigned(data));
            }
            id::SIMPLE_TAG => {
                let get = |wanted| children(data).find(|(id, _)| *id == wanted).map(|(_, data)| text(data));
                if let (Some(name), Some(value)) = (get(id::TAG_NAME), get(id::TAG_STRING)) {
                    found.push(Tag { name, value, track_uid: None });
                }
            }
            _ => {}
        }
    }
    for tag in &mut found {
        tag.track_uid = track_uid;
    }
    found
}

/// Name and data of an attached file.
pub(super) fn attachment(data: &[u8]) -> (String, Vec<u8>) {
    let (mut name, mut content) = (String::new(), Vec::new());
    for (id, data) in children(data) {
        match id {
            id::FILE_NAME => name = text(data),
            id::FILE_DATA => content = data.to_vec(),
            _ => {}
        }
    }
    (name, content)
}
