//! The `specgen` command.

fn main() -> std::process::ExitCode {
    specgen::cli::run()
}
