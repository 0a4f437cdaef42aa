# To be sourced: what scripts install.

# Brings the lists of Debian's packages up to date and installs these; one caller at a time, since checks run side by
# side.
debian() {
    local sudo
    sudo=$([ "$(id -u)" = 0 ] || echo sudo)
    (
        flock 9
        $sudo apt-get update -qq
        $sudo apt-get install -y -qq --no-install-recommends -o DPkg::Lock::Timeout=300 "$@" >/dev/null
    ) 9>"${TMPDIR:-/tmp}/debian.$(id -u).lock" >&2
}

# Makes the Python environment in the folder $1, with what pip installs by the other arguments, unless it is there.
python_in() {
    local folder=$1 wanted
    shift
    wanted=$(echo "$*"; for file in "$@"; do [ ! -f "$file" ] || cat "$file"; done)
    [ "$(cat "$folder/whole" 2>/dev/null)" != "$wanted" ] || return 0
    python3 -c 'import ensurepip, venv' 2>/dev/null || debian python3-venv
    python3 -m venv --clear "$folder"
    "$folder/bin/pip" install --quiet --disable-pip-version-check "$@"
    echo "$wanted" >"$folder/whole"
}
