#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| qcbus_formats::fuzzing::xqar(bytes));
