#!/usr/bin/env bash
# Makes sure that qemu-system-arm is there; takes the newest that apt's configured sources offer.
set -euo pipefail
if ! command -v qemu-system-arm >/dev/null; then
    sudo=$([ "$(id -u)" = 0 ] || echo sudo)
    $sudo apt-get update -qq
    backports="$(. /etc/os-release && echo "$VERSION_CODENAME")-backports"
    $sudo apt-get install -y -qq --no-install-recommends -t "$backports" qemu-system-arm 2>/dev/null ||
        $sudo apt-get install -y -qq --no-install-recommends qemu-system-arm
fi
qemu-system-arm --version | head -1
