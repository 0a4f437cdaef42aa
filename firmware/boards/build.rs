//! Linker arguments of a board's images. Set here, so that building from the workspace's root works and the host's
//! crates are not affected.

use std::path::Path;

fn main() {
    let board = Path::new(env!("CARGO_MANIFEST_DIR"));
    let [own, sections] = [board.join("memory.x"), board.with_file_name("link.x")];
    let root = board.ancestors().nth(3).expect("the workspace's root");
    for file in [&own, &sections, &root.join("memory.x")] {
        println!("cargo:rerun-if-changed={}", file.display());
    }
    // The board's own memory map or, without one, that at the workspace's root, which cortex-m-rt's link.x includes.
    let scripts = if own.is_file() {
        [&own, &sections].map(|path| path.display().to_string()).to_vec()
    } else {
        println!("cargo:rustc-link-search={}", root.display());
        vec!["link.x".to_owned()]
    };
    // Sections are not aligned to pages, of which a microcontroller has none.
    println!("cargo:rustc-link-arg-bins=--nmagic");
    for script in scripts.into_iter().chain(["defmt.x".to_owned()]) {
        println!("cargo:rustc-link-arg-bins=-T{script}");
    }
}
