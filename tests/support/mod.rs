//! Shared code of the process tests: a separate farm for every test, a broker to start and kill,
//! files with a known verdict, processes to inspect, and a watchdog instead of sleeping.

#![allow(dead_code, reason = "each test target uses a different part of it")]

pub mod asam;
pub mod asam_venv;
pub mod broker;
pub mod cli;
pub mod content;
pub mod dice;
pub mod farm;
pub mod inside;
pub mod judge;
pub mod processes;
pub mod programs;
pub mod reports;
pub mod tracer;
pub mod watchdog;
