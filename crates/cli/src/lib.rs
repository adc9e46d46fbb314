//! The command line: arguments in, a call into the suite, words or JSON out.

#![warn(clippy::print_stdout, clippy::print_stderr)]

mod args;
mod bench;
mod commands;
mod crosscheck;
mod file_args;
mod judge_args;
mod measure_args;
mod print;
mod progress;
mod stage_args;
mod table;
mod workflow_args;

use crate::print::errln;
use clap::Parser;
use std::process::ExitCode;
use strandbench_crosscheck::CrossError;
use strandbench_suite::SuiteError;

/// Entry point; returns the exit code: 0 for success, 1 for a failure, 2 for wrong arguments, 130 when stopped.
pub fn main() -> ExitCode {
    let args = args::Args::parse();
    match commands::run(&args) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            let cancelled = error
                .downcast_ref::<SuiteError>()
                .is_some_and(|e| matches!(e, SuiteError::Cancelled))
                || error.downcast_ref::<CrossError>().is_some_and(|e| matches!(e, CrossError::Cancelled(_)));
            errln!("strandbench: {error:#}");
            ExitCode::from(if cancelled { 130 } else { 1 })
        }
    }
}
