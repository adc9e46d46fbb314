//! strandbench command line.
fn main() {
    strandbench_cli::main()
}
