#!/usr/bin/env bash
# Makes .venv at the root and installs mpcam into it, editable, at the versions of requirements.lock.
# Usage: tools/setup.sh [EXTRA]      EXTRA: test or docs. PYTHON names the interpreter to start from.
set -euo pipefail
cd "$(dirname "$0")/.."
extra=${1:+[$1]}

new_enough() {
    "$1" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null
}

if ! .venv/bin/python -m pip --version >/dev/null 2>&1; then
    python=
    for candidate in "${PYTHON:-python3}" python3.14 python3.13 python3.12 python3.11; do
        if new_enough "$candidate"; then python=$candidate && break; fi
    done
    if [ -z "$python" ]; then
        echo "mpcam: Python 3.11 or newer is needed and was not found; install one, or name it: make PYTHON=/path/to/python3" >&2
        exit 1
    fi
    if ! "$python" -c 'import ensurepip, venv' 2>/dev/null; then
        version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
        tools/apt_install.sh "Python's venv module is missing" "python$version-venv|python3-venv"
    fi
    "$python" -m venv .venv
fi

pip() {
    .venv/bin/python -m pip --disable-pip-version-check "$@"
}

echo "mpcam: installing into .venv (about 1 GB and some minutes at the first time)"
pip install -q --constraint requirements.lock hatchling
pip install -q --constraint requirements.lock --no-build-isolation --editable ".$extra"
