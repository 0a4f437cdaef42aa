//! Writes the JavaScript bindings of a WebAssembly module, like `wasm-bindgen --target web`. Usage:
//! `bindings IN.wasm FOLDER`. The lock file must select the same version of wasm-bindgen as that of the module.

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
