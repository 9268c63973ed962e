//! Which files a glTF is read from besides itself.

use super::json::{self, Object};

/// Names of the files beside a glTF in text (`.gltf`) in which its buffers lie; none where it cannot be read.
pub fn files_beside(json: &[u8]) -> Vec<String> {
    let Ok(value) = json::parse(json) else { return Vec::new() };
    let Ok(root) = Object::root(&value) else { return Vec::new() };
    let buffers = root.items("buffers").into_iter().flatten().flatten();
    let names = buffers.filter_map(|buffer| buffer.text("uri").ok().flatten().map(str::to_owned));
    names.filter(|name| !name.starts_with("data:")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buffers_in_files_of_their_own_are_named() {
        let json =
            br#"{"buffers": [{"uri": "a.bin"}, {"uri": "data:;base64,AA=="}, {}, {"uri": 7}, {"uri": "deep/b.bin"}]}"#;
        assert_eq!(files_beside(json), ["a.bin", "deep/b.bin"]);
        assert!(files_beside(b"{").is_empty() && files_beside(b"[]").is_empty());
    }
}
