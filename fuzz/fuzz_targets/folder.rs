#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| patchlock_fuzz::folder(data));
