#!/usr/bin/env python3
"""Packs a folder so that the same files give the same bytes, and writes the archive's SHA-256 beside it.

Names are sorted, owners are 0, and every file has the same time and a mode that depends on its kind alone.
Usage: pack.py FOLDER ARCHIVE SECONDS, where ARCHIVE ends in .tar.gz or .zip and SECONDS are since 1970
"""

import gzip
import hashlib
import sys
import tarfile
import time
import zipfile
from pathlib import Path


def files(folder):
    """Every file of the folder by its name in the archive, sorted, with its mode: a program at the top may be run."""
    for path in sorted(folder.rglob("*"), key=lambda path: path.relative_to(folder).as_posix()):
        if path.is_file():
            runs = path.parent == folder and path.suffix in ("", ".exe") and not path.name.startswith("LICENSE")
            yield f"{folder.name}/{path.relative_to(folder).as_posix()}", path, 0o755 if runs else 0o644


def pack_tar(folder, archive, seconds):
    # The header of gzip would else hold the time and the name of the file.
    with open(archive, "wb") as raw, gzip.GzipFile("", "wb", 9, raw, mtime=0) as packed, \
            tarfile.open(fileobj=packed, mode="w", format=tarfile.USTAR_FORMAT) as tar:
        for name, path, mode in files(folder):
            entry = tarfile.TarInfo(name)
            entry.size, entry.mode, entry.mtime = path.stat().st_size, mode, seconds
            with open(path, "rb") as content:
                tar.addfile(entry, content)


def pack_zip(folder, archive, seconds):
    with zipfile.ZipFile(archive, "w") as packed:
        for name, path, mode in files(folder):
            entry = zipfile.ZipInfo(name, time.gmtime(max(seconds, 315_532_800))[:6])  # ZIP begins in 1980.
            entry.compress_type, entry.create_system, entry.external_attr = zipfile.ZIP_DEFLATED, 3, (0o100000 | mode) << 16
            packed.writestr(entry, path.read_bytes(), compresslevel=9)


def main():
    folder, archive, seconds = Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3])
    pack = pack_zip if archive.suffix == ".zip" else pack_tar
    pack(folder, archive, seconds)
    digest = hashlib.sha256(archive.read_bytes()).hexdigest()
    archive.with_name(f"{archive.name}.sha256").write_bytes(f"{digest}  {archive.name}\n".encode())
    print(f"{archive}: {archive.stat().st_size / 1e6:.1f} MB, SHA-256 {digest}")


if __name__ == "__main__":
    main()
