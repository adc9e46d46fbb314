//! Runs the live check and prints every figure: `live LEVELS [full]`, for example `live 01`.

use strandbench_crosscheck::{Options, Size, run};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let levels = std::env::args().nth(1).ok_or("usage: live LEVELS [full]")?;
    let full = std::env::args().nth(2).is_some_and(|a| a == "full");
    let options = Options {
        levels: levels.bytes().map(|b| b - b'0').collect(),
        size: if full { Size::Full } else { Size::Quick },
        out: std::env::temp_dir().join("strandbench-crosscheck"),
        python: None,
        required: true,
    };
    let outcome = run(&options, &strandbench_types::Silent)?;
    println!("{}", strandbench_crosscheck::write_report(&outcome, &options.out)?.display());
    for j in &outcome.judged {
        for g in &j.gates {
            println!("{g}\n{:>20}{}", "", g.note);
        }
        println!("witness {:.1} s, ours {:.1} s", j.witness_s, j.ours_s);
    }
    Ok(())
}
