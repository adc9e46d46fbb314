//! Progress on standard error: bars on a terminal, a line a stage elsewhere, nothing when quiet.

use crate::print::errln;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::io::IsTerminal;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use strandbench_suite::{Done, Progress};
use strandbench_types::Monitor;

static STOP: AtomicBool = AtomicBool::new(false);

/// Lets Ctrl-C (and a polite kill) stop the work at the next check; a second one ends the program at once.
pub fn listen_for_ctrl_c() -> anyhow::Result<()> {
    ctrlc::set_handler(|| {
        if STOP.swap(true, Ordering::SeqCst) {
            std::process::exit(130);
        }
        errln!("strandbench: stopping; once more to stop at once");
    })?;
    Ok(())
}

/// What the program shows while it works.
pub struct Show {
    bar: Mutex<ProgressBar>,
    terminal: bool,
    quiet: bool,
}

impl Show {
    /// Bars if standard error is a terminal.
    pub fn new(quiet: bool) -> Show {
        let terminal = !quiet && std::io::stderr().is_terminal();
        Show { bar: Mutex::new(ProgressBar::hidden()), terminal, quiet }
    }

    fn bar(&self) -> std::sync::MutexGuard<'_, ProgressBar> {
        // A panic while the bar was held leaves it usable: it only draws.
        self.bar.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    /// Whether nothing but errors is wanted.
    pub fn quiet(&self) -> bool {
        self.quiet
    }

    /// Takes the bar off the terminal.
    pub fn clear(&self) {
        self.bar().finish_and_clear();
    }

    /// A line for people.
    pub fn say(&self, text: &str) {
        if !self.quiet {
            self.bar().suspend(|| errln!("{text}"));
        }
    }
}

impl Monitor for Show {
    fn begin(&self, what: &str, total: u64) {
        if !self.terminal {
            return;
        }
        let mut bar = self.bar();
        bar.finish_and_clear();
        let style =
            ProgressStyle::with_template("  {msg:<28} {bar:36} {percent:>3} %  {rate:>8}  {eta:>5} left")
                .unwrap_or_else(|_| ProgressStyle::default_bar())
                .with_key("rate", |state: &ProgressState, text: &mut dyn std::fmt::Write| {
                    // Steps differ in size between stages, so a whole number says all there is to say; a full
                    // terminal line that cannot be written is nobody's loss.
                    let rate = state.per_sec();
                    let _ =
                        if rate < 10.0 { write!(text, "{rate:.1}/s") } else { write!(text, "{rate:.0}/s") };
                });
        *bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr())
            .with_style(style)
            .with_message(what.to_owned());
    }

    fn advance(&self, steps: u64) {
        if self.terminal {
            self.bar().inc(steps);
        }
    }

    fn cancelled(&self) -> bool {
        STOP.load(Ordering::Relaxed)
    }
}

impl Progress for Show {
    fn stage_begins(&self, stage: &str, folder: &Path, reason: &str) {
        self.say(&format!("{stage:<12} {} ({reason})", folder.display()));
    }

    fn stage_done(&self, done: &Done) {
        self.bar().finish_and_clear();
        let (stage, cost) = (&done.record.stage, &done.record.cost);
        if done.reused {
            self.say(&format!("{stage:<12} {} unchanged, re-used", done.folder.display()));
        } else {
            let memory = cost.peak_mib.map_or(String::new(), |m| format!(", at most {m:.0} MiB"));
            self.say(&format!("{:<12} done in {:.1} s{memory}", "", cost.wall_s));
        }
    }
}
