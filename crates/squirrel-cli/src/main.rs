//! The binary `squirrel`; everything is in the library, so that other front ends run the same
//! program.

fn main() -> std::process::ExitCode {
    squirrel_cli::run(std::env::args_os()).into()
}
