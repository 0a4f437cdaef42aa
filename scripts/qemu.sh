#!/usr/bin/env bash
# Installs a qemu-system-arm that runs both images: 8.2 or newer. Debian 12 has 7.2, whose USART does not send by
# interrupt; its backports, on the same mirror, have a newer one.
set -euo pipefail

# The version as a number: 802 for 8.2.
version() {
    qemu-system-arm --version 2>/dev/null | sed -nE '1s/.*version ([0-9]+)\.([0-9]+).*/\1 \2/p' |
        { read -r major minor && echo $((major * 100 + minor)); } || echo 0
}

if [ "$(version)" -lt 802 ]; then
    # One at a time: two at once leave packages half installed. (apt locks each of its steps, but not all together.)
    exec 9>"${TMPDIR:-/tmp}/debian.$(id -u).lock"
    flock 9
fi
if [ "$(version)" -lt 802 ]; then
    sudo=$([ "$(id -u)" = 0 ] || echo sudo)
    install="apt-get install -y -qq --no-install-recommends -o DPkg::Lock::Timeout=300"
    # Finishes what an interrupted earlier run left half installed.
    $sudo dpkg --configure -a >/dev/null || true
    $sudo apt-get update -qq
    $sudo $install qemu-system-arm >/dev/null
    if [ "$(version)" -lt 802 ]; then
        # Adds the backports suite of this release's mirror, for this command only; apt's settings are not changed.
        release=$(. /etc/os-release && echo "$VERSION_CODENAME")
        mirror=$(apt-get indextargets --format '$(REPO_URI)' \
            'Created-By: Packages' "Release: $release" 'Component: main' | head -1)
        sources=$(mktemp -d)
        trap 'rm -rf "$sources"' EXIT
        chmod 755 "$sources"
        cp /etc/apt/sources.list.d/*.{list,sources} "$sources" 2>/dev/null || true
        echo "deb $mirror $release-backports main" >"$sources/backports.list"
        $sudo apt-get -o Dir::Etc::SourceParts="$sources" update -qq
        $sudo $install -o Dir::Etc::SourceParts="$sources" -t "$release-backports" qemu-system-arm >/dev/null
    fi
fi
qemu-system-arm --version | head -1
