//! The `halflight` command: parse, run one command, say what went wrong.

use std::process::ExitCode;

fn main() -> ExitCode {
    halflight::cli::main()
}
