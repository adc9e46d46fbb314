//! Depth errors of many settings of the method or of a baseline on rendered folders, as CSV: what stands behind the parameters
//! that the paper leaves out.
//!
//! `sweep --render FOLDER [--render FOLDER ...] [--variant NAME] SETTING [SETTING ...]`, where a setting is
//! `-` (the variant as it is) or `key=value` pairs with commas between. Every setting runs on every folder; the
//! scores are the protocol's A1.

use std::path::PathBuf;
use strandbench_suite::{Method, Setting, Solver};
use strandbench_types::Silent;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (mut folders, mut settings, mut variant) = (Vec::new(), Vec::new(), "luo".to_owned());
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        match arg.as_str() {
            "--render" => folders.push(PathBuf::from(args.next().ok_or("--render needs a folder")?)),
            "--variant" => variant = args.next().ok_or("--variant needs a name")?,
            _ => settings.push(arg),
        }
    }
    println!("setting,scene,median_mm,p90_mm,p95_mm,bias_mm,beyond_10mm,completeness,gap,recon_s");
    for folder in &folders {
        let (rig, frame) = strandbench_io::read_frame(&folder.join("frame"))?;
        let truth = strandbench_io::read_truth(&folder.join("truth"))?;
        let name = folder.parent().and_then(|p| p.file_name()).unwrap_or_default().to_string_lossy();
        for setting in &settings {
            let pairs = setting.split(',').filter(|s| *s != "-");
            let settings: Vec<Setting> =
                pairs.map(|pair| pair.replace('+', ",").parse()).collect::<Result<_, _>>()?;
            let start = std::time::Instant::now();
            let (estimate, gap) = match Method::find(&variant, &settings)?.solver {
                Solver::Variant(v) => {
                    let made = strandbench_recon::reconstruct(&rig, &frame, &v, &Silent)?;
                    (made.estimate, made.diagnostics.gap)
                }
                Solver::Baseline(b) => {
                    let made = strandbench_baselines::reconstruct(&rig, &frame, &b, &Silent)?;
                    eprintln!("{name} {setting}: {:?}", made.account);
                    (made.estimate, None)
                }
                Solver::Outside(_) => return Err("a method from outside has no settings here".into()),
            };
            let wall = start.elapsed().as_secs_f64();
            let sheet = strandbench_score::score(&truth, &estimate, 1, &Silent)?;
            let get = |id: &str| -> Result<String, Box<dyn std::error::Error>> {
                Ok(sheet.get("method", id)?.value.map_or("inf".into(), |v| format!("{v:.4}")))
            };
            println!(
                "\"{setting}\",{name},{},{},{},{},{},{},{:.4},{wall:.2}",
                get("A1.median")?,
                get("A1.p90")?,
                get("A1.p95")?,
                get("A1.bias_mean")?,
                get("A1.over_10mm")?,
                get("A3.completeness")?,
                gap.unwrap_or(f64::NAN),
            );
        }
    }
    Ok(())
}
