//! Runs the live check and prints every figure: `live LEVELS [full] [CASE ...]`, for example `live 01` or
//! `live 4 full hairstyle-path`.

use strandbench_crosscheck::{Options, Size, run_where};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let levels = std::env::args().nth(1).ok_or("usage: live LEVELS [full] [CASE ...]")?;
    let mut names: Vec<String> = std::env::args().skip(2).collect();
    let full = names.first().is_some_and(|a| a == "full");
    if full {
        names.remove(0);
    }
    let options = Options {
        levels: levels.bytes().map(|b| b.wrapping_sub(b'0')).collect(),
        size: if full { Size::Full } else { Size::Quick },
        out: std::env::temp_dir().join("strandbench-crosscheck"),
        python: None,
        required: true,
    };
    let wanted = |c: &strandbench_crosscheck::Case| names.is_empty() || names.contains(&c.name);
    let outcome = run_where(&options, wanted, &strandbench_types::Silent)?;
    println!("{}", strandbench_crosscheck::write_report(&outcome, &options.out)?.display());
    for j in &outcome.judged {
        for g in &j.gates {
            println!("{g}\n{:>20}{}", "", g.note);
        }
        println!("witness {:.1} s, ours {:.1} s", j.witness_s, j.ours_s);
    }
    Ok(())
}
