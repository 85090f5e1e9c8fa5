#!/usr/bin/env bash
# Installs system packages where that may be done, and says what to type where it may not.
# Usage: tools/apt_install.sh WHY PACKAGE...      "a|b|c" stands for the first of a, b, c that the system offers.
set -euo pipefail

why=$1
shift

give_up() {
    echo "mpcam: $why: $1" >&2
    exit 1
}

command -v apt-get >/dev/null || give_up "this system has no apt-get; install the counterpart of these Debian packages by hand: $*"

if [ "$(id -u)" = 0 ]; then
    as_root=()
elif ! command -v sudo >/dev/null; then
    give_up "type this as root, then try again: apt-get update && apt-get install -y ${*%%|*}"
elif [ -t 0 ]; then
    as_root=(sudo)
else
    as_root=(sudo -n) # nobody is there to type a password
fi

offered() {
    [[ $(apt-cache policy "$1" 2>/dev/null) == *"Candidate: "[!\(]* ]]
}

choose() {
    packages=()
    local alternatives name found
    for alternatives in "$@"; do
        found=
        for name in ${alternatives//|/ }; do
            if offered "$name"; then found=$name && break; fi
        done
        [ -n "$found" ] || return 1
        packages+=("$found")
    done
}

install() {
    choose "$@" || return 1
    echo "mpcam: $why: apt-get install ${packages[*]}"
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${packages[@]}" >/dev/null
}

# The first attempt spares the update; the second is for empty or stale package lists.
install "$@" 2>/dev/null && exit 0
"${as_root[@]}" apt-get update -qq || true
install "$@" || give_up "it could not be installed; type this, then try again: sudo apt-get update && sudo apt-get install -y ${*%%|*}"
