//! What the process tests share: a farm of its own for every test, a broker to start and kill,
//! files whose verdict is known, processes to look at, and a watchdog in place of sleeping.

#![allow(dead_code, reason = "every test target uses another part of this")]

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
pub mod reports;
pub mod tracer;
pub mod watchdog;
