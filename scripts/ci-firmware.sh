#!/usr/bin/env bash
# Everything CI runs for the firmware: both images built and linted for the processor, flown in QEMU, and held to their
# budgets. Installs what is missing. Nothing is skipped.
set -euo pipefail
cd "$(dirname "$0")/.."
export CI=${CI:-true}

FW_TOOLCHAIN=$(scripts/thumb-toolchain.sh)
export FW_TOOLCHAIN
scripts/qemu.sh

# A tool of the firmware's toolchain; the host's own tools stay as they are.
thumb() { RUSTUP_TOOLCHAIN=$FW_TOOLCHAIN "$@"; }
clippy="clippy --release --target thumbv7em-none-eabihf -p firmware"

echo "== firmware: build and lint for the processor"
thumb cargo fw
thumb cargo fw-pil
thumb cargo $clippy --lib --bin flight -- -D warnings
thumb cargo $clippy --lib --bin pil --features pil -- -D warnings

echo "== firmware: lockstep, boot"
cargo test --release -p pil

echo "== firmware: size, stack, panics, instructions"
cargo run --release -p pil --bin budgets -- --check
