//! The bytes that a glTF's numbers lie in.

use std::{borrow::Cow, collections::BTreeMap};

use bansho_base::assets::AssetProblem;

use super::{base64, json::Object};

/// Most bytes of all buffers together.
const MOST_BYTES: usize = 1 << 30;

/// Gives the bytes of a file that a glTF names.
pub(super) type Beside<'a> = &'a dyn Fn(&str) -> Result<Vec<u8>, AssetProblem>;

/// All buffers. What several of them name is held once.
pub(super) struct Buffers<'a> {
    contents: Vec<Cow<'a, [u8]>>,
    /// Which of the contents each buffer is.
    content_of: Vec<usize>,
}

impl<'a> Buffers<'a> {
    /// Reads them from `binary`, from the JSON itself, and from `beside`.
    pub(super) fn read(root: &Object<'a>, binary: Option<&'a [u8]>, beside: Beside) -> Result<Self, AssetProblem> {
        let (mut contents, mut content_of): (Vec<Cow<[u8]>>, _) = (Vec::new(), Vec::new());
        let (mut known, mut bytes) = (BTreeMap::new(), 0_usize);
        for buffer in root.items("buffers")? {
            let buffer = buffer?;
            let uri = buffer.text("uri")?;
            let slot = match known.get(&uri) {
                Some(&slot) => slot,
                None => {
                    let content = content(&buffer, uri, binary, beside)?;
                    bytes = bytes.saturating_add(content.len());
                    if bytes > MOST_BYTES {
                        let told = format!("have {bytes} bytes or more together; allowed: up to {MOST_BYTES}");
                        return Err(root.fault("buffers", told));
                    }
                    known.insert(uri, contents.len());
                    contents.push(content);
                    contents.len() - 1
                }
            };
            let (claimed, there) = (buffer.needed("byteLength")?, contents[slot].len());
            if claimed > there {
                return Err(buffer.fault("byteLength", format!("says {claimed} bytes, but {there} are there")));
            }
            content_of.push(slot);
        }
        Ok(Self { contents, content_of })
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.content_of.len()
    }

    /// The bytes of one of them.
    pub(super) fn get(&self, index: usize) -> &[u8] {
        &self.contents[self.content_of[index]]
    }
}

fn content<'a>(
    buffer: &Object,
    uri: Option<&'a str>,
    binary: Option<&'a [u8]>,
    beside: Beside,
) -> Result<Cow<'a, [u8]>, AssetProblem> {
    let Some(uri) = uri else {
        let missing = || buffer.fault("uri", "is missing, and there is no binary buffer in the file");
        return binary.map(Cow::Borrowed).ok_or_else(missing);
    };
    let Some(data) = uri.strip_prefix("data:") else { return beside(uri).map(Cow::Owned) };
    let decoded = data.split_once(";base64,").and_then(|(_, text)| base64::decode(text));
    decoded.map(Cow::Owned).ok_or_else(|| buffer.fault("uri", "is not base64; allowed: `data:...;base64,...`"))
}
