//! Files in and out.

use super::{import_options, print_json};
use crate::file_args::{ExportArgs, ImportArgs};
use crate::print::out;
use crate::progress::Show;
use crate::table;
use anyhow::{Result, bail};
use strandbench_suite::Export;

pub(super) fn import(args: &ImportArgs, show: &Show, json: bool) -> Result<bool> {
    if args.out.exists() && !args.force {
        bail!("{}: is there already; choose another name or say --force", args.out.display());
    }
    let options = import_options(&args.options)?;
    let made =
        strandbench_suite::import(&args.file, &args.out, &options, args.options.head.as_deref(), show)?;
    if json {
        return print_json(&serde_json::to_value(&made)?);
    }
    if !show.quiet() {
        out!("{}", table::import(&made));
    }
    Ok(true)
}

pub(super) fn export(args: &ExportArgs, show: &Show, json: bool) -> Result<bool> {
    let what =
        Export { folder: &args.folder, truth: args.truth, strands: &args.strands, mesh: &args.envelope };
    let made = strandbench_suite::export(&what, &args.out, show)?;
    show.clear();
    if json {
        return print_json(&serde_json::to_value(&made)?);
    }
    if !show.quiet() {
        out!("{}", table::exported(&made));
    }
    Ok(true)
}
