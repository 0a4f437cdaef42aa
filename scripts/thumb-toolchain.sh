#!/usr/bin/env bash
# Prints the value of RUSTUP_TOOLCHAIN for a Rust toolchain that compiles for thumbv7em-none-eabihf.
#
#   RUSTUP_TOOLCHAIN=$(scripts/thumb-toolchain.sh) cargo fw
#
# 1. The current toolchain, if it has the target or rustup can add it.
# 2. Otherwise, or with FW_FORCE_DEBIAN=1: Debian's rustc, with core and alloc compiled once (2 minutes) from Debian's
#    sources into a separate sysroot, by default ~/.cache/thumb-toolchain (or $1).
set -euo pipefail
target=thumbv7em-none-eabihf
host=x86_64-unknown-linux-gnu
dir=$(realpath -m "${1:-$HOME/.cache/thumb-toolchain}")

# True if rustc $1 finds a core library for the target.
has_target() {
    compgen -G "$("$1" --print target-libdir --target $target)/libcore-*.rlib" >/dev/null
}

if [ -z "${FW_FORCE_DEBIAN:-}" ]; then
    if has_target rustc || { rustup target add $target >&2 && has_target rustc; }; then
        rustup show active-toolchain | cut -d' ' -f1
        exit
    fi
    echo "rustup has no $target; using Debian's compiler" >&2
fi

if [ ! -x /usr/bin/clippy-driver ] || [ ! -x /usr/bin/cargo ] || [ ! -d /usr/lib/rustlib/src/rust/library ]; then
    . "$(dirname "$0")/install.sh"
    debian rustc-web rust-web-src cargo-web rust-web-clippy lld
fi

version=$(/usr/bin/rustc -V)
if [ "$(cat "$dir/version" 2>/dev/null)" = "$version" ]; then
    echo "$dir"
    exit
fi

rm -rf "$dir"
mkdir -p "$dir/bin" "$dir/lib/rustlib/$target/lib" "$dir/lib/rustlib/$host/bin"

# Debian's rustc uses /usr as its sysroot by default; clippy uses SYSROOT.
for tool in rustc rustdoc; do
    printf '#!/bin/sh\nexec /usr/bin/%s --sysroot "%s" "$@"\n' $tool "$dir" >"$dir/bin/$tool"
done
for tool in cargo cargo-clippy clippy-driver; do
    printf '#!/bin/sh\nPATH="%s/bin:$PATH" SYSROOT="%s" exec /usr/bin/%s "$@"\n' "$dir" "$dir" $tool >"$dir/bin/$tool"
done
chmod +x "$dir"/bin/*
ln -s /usr/lib/rustlib/$host/lib "$dir/lib/rustlib/$host/lib"
ln -s /usr/lib/rustlib/etc "$dir/lib/rustlib/etc"
# The target links with a program called rust-lld.
ln -s "$(command -v ld.lld || ls /usr/bin/lld-* | head -1)" "$dir/lib/rustlib/$host/bin/rust-lld"

empty=$(mktemp -d)
trap 'rm -rf "$empty"' EXIT
mkdir "$empty/src"
echo '#![no_std]' >"$empty/src/lib.rs"
cat >"$empty/Cargo.toml" <<'TOML'
[package]
name = "empty"
version = "0.0.0"
edition = "2021"
[workspace]
[profile.release]
panic = "abort"
codegen-units = 1
TOML
(
    cd "$empty"
    # RUSTC_BOOTSTRAP lets a stable compiler build core; nothing else is built with it.
    env -u CARGO_TARGET_DIR -u RUSTC -u RUSTUP_TOOLCHAIN PATH=/usr/bin:/bin \
        RUSTC_BOOTSTRAP=1 RUSTFLAGS=-Cembed-bitcode=yes \
        cargo build -q --release --target $target \
        -Zbuild-std=core,alloc -Zbuild-std-features=compiler-builtins-mem >&2
)
cp "$empty"/target/$target/release/deps/lib{core,alloc,compiler_builtins}-*.rlib "$dir/lib/rustlib/$target/lib/"
echo "$version" >"$dir/version"
echo "$dir"
