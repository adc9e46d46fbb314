//! Printing that outlives its reader: `strandbench ... | head` ends as if all had been read.

use std::fmt::Arguments;
use std::io::{ErrorKind, Write};

/// Writes to standard output. Once nobody reads it any more nothing is written, and the program goes on to the exit code
/// that it would have had; what else keeps it from being written (a full disk) ends the program with exit code 1.
pub fn put(text: Arguments<'_>) {
    let mut stdout = std::io::stdout().lock();
    match stdout.write_fmt(text).and_then(|()| stdout.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => {
            drop(stdout);
            complain(format_args!("strandbench: standard output: {e}\n"));
            std::process::exit(1);
        }
        _ => {}
    }
}

/// Writes to standard error, if anybody reads it.
pub fn complain(text: Arguments<'_>) {
    let _ = std::io::stderr().lock().write_fmt(text);
}

/// As `print!`.
macro_rules! out {
    ($($text:tt)*) => { $crate::print::put(format_args!($($text)*)) };
}

/// As `println!`.
macro_rules! outln {
    ($($text:tt)*) => { $crate::print::put(format_args!("{}\n", format_args!($($text)*))) };
}

/// As `eprintln!`.
macro_rules! errln {
    ($($text:tt)*) => { $crate::print::complain(format_args!("{}\n", format_args!($($text)*))) };
}

pub(crate) use {errln, out, outln};
