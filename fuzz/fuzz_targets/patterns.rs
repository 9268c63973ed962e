//! Names with a place for the frame number: any is refused, or gives each frame a name of its own in the same folder.
//!
//! The first line is how many frames there are, the second a frame number, the rest the name.
#![no_main]

use std::path::Path;

use bansho_media::{
    assets::FileAssets,
    files::naming::{NumberedPath, OutputPattern},
};

libfuzzer_sys::fuzz_target!(|text: &str| {
    let mut lines = text.splitn(3, '\n');
    let count = lines.next().and_then(|count| count.parse().ok()).unwrap_or(2);
    let number = lines.next().and_then(|number| number.parse().ok()).unwrap_or(7);
    let name = lines.next().unwrap_or_default();
    let path = Path::new(name);
    if let Ok(pattern) = OutputPattern::parse(path, count) {
        assert!(pattern.is_numbered() || count == 1 || !pattern.kind().is_sequence());
        check(path, number, pattern.is_numbered(), |number| pattern.path(number));
    }
    if let Ok(numbered) = NumberedPath::parse(path, "ply", count) {
        assert!(numbered.is_numbered() || count == 1);
        check(path, number, numbered.is_numbered(), |number| numbered.path(number));
    }
    if let Ok(resolved) = FileAssets::new("root").resolve(name, number) {
        assert!(resolved.starts_with("root") || name.starts_with('/'), "{resolved:?}");
    }
});

fn check(asked: &Path, number: i64, is_numbered: bool, path: impl Fn(i64) -> std::path::PathBuf) {
    let (one, other) = (path(number), path(number.wrapping_add(1)));
    assert_eq!(one != other, is_numbered, "{one:?} and {other:?}");
    // A placeholder may fill the whole name, but never leads elsewhere.
    assert_eq!(one.parent(), asked.parent().filter(|_| asked.file_name().is_some()), "{one:?}");
    assert_eq!(one.extension(), asked.extension(), "{one:?}");
}
