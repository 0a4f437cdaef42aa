//! Linker arguments of a board's image. Set here, so that building from the workspace's root works and the host's
//! crates are not affected.

use std::path::Path;

fn main() {
    // The board's own memory map or, without one, the default board's at the workspace's root.
    let board = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folders = [board, board.ancestors().nth(2).expect("the workspace's root")];
    let folder = folders.into_iter().find(|folder| folder.join("memory.x").is_file()).expect("memory.x at the root");
    println!("cargo:rustc-link-search={}", folder.display());
    for folder in folders {
        println!("cargo:rerun-if-changed={}", folder.join("memory.x").display());
    }
    for argument in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
}
