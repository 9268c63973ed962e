//! Depth in every format: the first byte chooses it. Any bytes are refused, or are a map of the size and the limits that it claims.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| bansho_fuzz::read_depth(bytes));
