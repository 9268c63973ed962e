//! A ZIP writer for stored files, without compression since pictures are already compressed (APPNOTE 6.3, sections 4.3.7 to
//! 4.3.16).
//!
//! Not the crate `zip`, because this is short and streams without seeking. When streaming, that crate (9.4) writes each checksum after its file,
//! which streaming readers do not support for stored files, and it depends on random numbers and system calls.

use std::io::{self, Write};

/// Fields at the start of local headers and central directory entries: version 1.0, UTF-8 names, stored, the constant date 1 January 1980 so
/// that the output is deterministic.
const COMMON_FIELDS: [u8; 10] = [10, 0, 0, 8, 0, 0, 0, 0, 0x21, 0];

/// A ZIP in progress.
#[derive(Debug)]
pub struct ZipWriter<W> {
    out: W,
    /// Bytes written so far.
    length: u64,
    directory: Vec<u8>,
    count: u16,
}

impl<W: Write> ZipWriter<W> {
    /// An empty ZIP, written to `out`.
    pub fn new(out: W) -> Self {
        Self { out, length: 0, directory: Vec::new(), count: 0 }
    }

    /// Adds the file `name`; folders in it are separated by `/`.
    ///
    /// # Errors
    /// Writing fails, or the ZIP would exceed 65,535 files or 4 GiB, the limits of the format without ZIP64.
    pub fn add(&mut self, name: &str, bytes: &[u8]) -> io::Result<()> {
        let start = checked_u32(self.length)?;
        checked_u32(self.length + bytes.len() as u64)?;
        // All limits are checked before anything is written, so that what was written so far can still be finished.
        let fields = header_fields(name, bytes)?;
        let count = self.count.checked_add(1).ok_or_else(too_large)?;
        self.write_all(&[b"PK\x03\x04", fields.as_slice(), name.as_bytes(), bytes])?;
        // Also made by version 1.0; no comment, first disk, no attributes.
        let entry: [&[u8]; 6] = [b"PK\x01\x02", &[10, 0], &fields, &[0; 10], &start.to_le_bytes(), name.as_bytes()];
        self.directory.extend(entry.concat());
        self.count = count;
        Ok(())
    }

    /// Writes the central directory; returns the writer.
    ///
    /// # Errors
    /// Writing fails, or the ZIP exceeds 4 GiB.
    pub fn finish(mut self) -> io::Result<W> {
        let (start, size) = (checked_u32(self.length)?, checked_u32(self.directory.len() as u64)?);
        let directory = std::mem::take(&mut self.directory);
        let counts = [self.count.to_le_bytes(); 2].concat();
        // On this disk and in all: the same number, since there is one disk; no comment.
        let end: [&[u8]; 6] = [b"PK\x05\x06", &[0; 4], &counts, &size.to_le_bytes(), &start.to_le_bytes(), &[0; 2]];
        self.write_all(&[&directory, &end.concat()])?;
        self.out.flush()?;
        Ok(self.out)
    }

    fn write_all(&mut self, slices: &[&[u8]]) -> io::Result<()> {
        for slice in slices {
            self.out.write_all(slice)?;
            self.length += slice.len() as u64;
        }
        Ok(())
    }
}

/// The fields that the local header of a file and its directory entry have in common.
fn header_fields(name: &str, bytes: &[u8]) -> io::Result<Vec<u8>> {
    let size = checked_u32(bytes.len() as u64)?.to_le_bytes();
    let name = u16::try_from(name.len()).map_err(|_| too_large())?.to_le_bytes();
    // Packed and unpacked size, of stored files the same; no extra fields.
    let fields: [&[u8]; 6] = [&COMMON_FIELDS, &crc32fast::hash(bytes).to_le_bytes(), &size, &size, &name, &[0; 2]];
    Ok(fields.concat())
}

fn checked_u32(length: u64) -> io::Result<u32> {
    u32::try_from(length).map_err(|_| too_large())
}

fn too_large() -> io::Error {
    io::Error::new(io::ErrorKind::FileTooLarge, "a ZIP holds up to 65,535 files and 4 GiB")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_stored_with_its_heads() {
        let mut zip = ZipWriter::new(Vec::new());
        zip.add("a.txt", b"123456789").unwrap();
        let bytes = zip.finish().unwrap();
        // The checksum of these nine bytes is the one that every description of CRC-32 gives.
        let head = b"\x0a\0\0\x08\0\0\0\0\x21\0\x26\x39\xf4\xcb\x09\0\0\0\x09\0\0\0\x05\0\0\0";
        let local = [b"PK\x03\x04".as_slice(), head, b"a.txt", b"123456789"].concat();
        assert_eq!(bytes[..local.len()], local);
        let entry = [b"PK\x01\x02\x0a\0".as_slice(), head, &[0; 14], b"a.txt"].concat();
        assert_eq!(bytes[local.len()..][..entry.len()], entry);
        let end = [b"PK\x05\x06\0\0\0\0\x01\0\x01\0".as_slice(), &[51, 0, 0, 0], &[44, 0, 0, 0], &[0; 2]].concat();
        assert_eq!((entry.len(), local.len()), (51, 44));
        assert_eq!(bytes[local.len() + entry.len()..], end);
    }

    #[test]
    fn more_files_than_it_can_count_are_refused() {
        let mut zip = ZipWriter::new(io::sink());
        (0..u16::MAX).for_each(|number| zip.add(&number.to_string(), b"").unwrap());
        assert_eq!(zip.add("one more", b"").unwrap_err().kind(), io::ErrorKind::FileTooLarge);
        zip.finish().unwrap();
    }

    #[test]
    #[ignore = "needs python3"]
    fn other_programs_read_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("frames.zip");
        let mut zip = ZipWriter::new(std::fs::File::create(&path).unwrap());
        zip.add("feuer/0001.png", b"one").unwrap();
        zip.add("fe\u{fc}er/0002.png", &[7; 70_000]).unwrap();
        zip.finish().unwrap();
        let script = "import sys, zipfile\nfile = zipfile.ZipFile(sys.argv[1])\nassert file.testzip() is None\n\
            assert file.namelist() == ['feuer/0001.png', 'fe\u{fc}er/0002.png']\nassert file.read('feuer/0001.png') == b'one'";
        let status = std::process::Command::new("python3").args(["-c", script]).arg(&path).status().unwrap();
        assert!(status.success());
    }
}
