//! Color profiles: any bytes as the profile of a small TIFF leave it unchanged, or give colors from 0 to 1.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| bansho_fuzz::read_profile(bytes));
