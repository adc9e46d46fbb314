//! Writes the inputs of the fixtures to a folder: `export DIR`. make_fixtures.py in renderer/mitsuba calls it.

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args_os().nth(1).ok_or("usage: export DIR")?;
    for path in strandbench_crosscheck::fixtures::export(folder.as_ref())? {
        println!("{}", path.display());
    }
    Ok(())
}
