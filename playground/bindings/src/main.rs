//! Writes what JavaScript calls a WebAssembly by, as `wasm-bindgen --target web` does: `bindings IN.wasm FOLDER`. From
//! the lock file's own version, which must be that of the crate.

use std::env;
use std::process::ExitCode;
use wasm_bindgen_cli_support::Bindgen;

fn main() -> ExitCode {
    let [Some(input), Some(folder)] = [env::args().nth(1), env::args().nth(2)] else {
        eprintln!("bindings IN.wasm FOLDER");
        return ExitCode::from(2);
    };
    let mut bindgen = Bindgen::new();
    bindgen.input_path(input).typescript(false).remove_name_section(true);
    let written = bindgen.web(true).and_then(|it| it.generate(folder));
    match written {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("bindings: {error:#}");
            ExitCode::FAILURE
        }
    }
}
