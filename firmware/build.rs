//! Linker arguments of the two images: here, so that building from the workspace's root works and the host's crates
//! stay clear of them.

use std::path::Path;

fn main() {
    // memory.x lies at the workspace's root.
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace's root");
    println!("cargo:rustc-link-search={}", root.display());
    println!("cargo:rerun-if-changed={}", root.join("memory.x").display());
    for argument in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
}
