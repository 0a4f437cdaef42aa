# To be sourced: what scripts install.

# Brings the lists of Debian's packages up to date and installs these; one caller at a time, since checks run side by
# side. A package may start a service, which must not inherit the lock.
debian() {
    local sudo
    sudo=$([ "$(id -u)" = 0 ] || echo sudo)
    (
        flock 9
        $sudo apt-get update -qq 9>&-
        $sudo apt-get install -y -qq --no-install-recommends -o DPkg::Lock::Timeout=300 "$@" >/dev/null 9>&-
    ) 9>"${TMPDIR:-/tmp}/debian.$(id -u).lock" >&2
}

# uv, which installs in seconds what takes pip minutes; once, into target/uv.
uv_folder=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)/target/uv
uv() {
    mkdir -p "$(dirname "$uv_folder")"
    (
        flock 9
        if [ ! -x "$uv_folder/bin/uv" ]; then
            python3 -c 'import ensurepip, venv' 2>/dev/null || debian python3-venv
            python3 -m venv --clear "$uv_folder"
            "$uv_folder/bin/pip" install --quiet --disable-pip-version-check uv==0.13.9
        fi
    ) 9>"$uv_folder.lock" >&2
    "$uv_folder/bin/uv" "$@"
}

# Makes the Python environment in the folder $1, with what the other arguments say as pip understands them, unless it
# is there.
python_in() {
    local folder=$1 wanted
    shift
    wanted=$(echo "$*"; for file in "$@"; do [ ! -f "$file" ] || cat "$file"; done)
    [ "$(cat "$folder/whole" 2>/dev/null)" != "$wanted" ] || return 0
    uv venv --quiet --clear --seed --python "$(command -v python3)" "$folder"
    uv pip install --quiet --python "$folder/bin/python" "$@"
    echo "$wanted" >"$folder/whole"
}
