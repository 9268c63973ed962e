//! Plates as TIFF: any bytes are refused, or are a picture of the size and the limits that it claims.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| bansho_fuzz::read_plate(bytes, "tiff"));
