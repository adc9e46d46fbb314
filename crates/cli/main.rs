//! The `strandbench` program.

fn main() -> std::process::ExitCode {
    strandbench_cli::main()
}
