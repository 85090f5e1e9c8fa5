#!/usr/bin/env bash
# Makes sure that Dr.Jit loads and finds an LLVM library that it can work with; asks Dr.Jit itself, in its own process.
set -euo pipefail
cd "$(dirname "$0")/.."

ask() {
    .venv/bin/python -c '
import sys
from mpcam_kernels.llvm import usable
try:
    import drjit
except (ImportError, NameError) as error:  # NameError: Dr.Jit stumbles over its own report of an ImportError
    sys.exit(str(error.__context__ or error))
sys.exit(usable(drjit.detail.llvm_version()))' 2>&1
}

problem=$(ask) && exit 0
if [ -n "${DRJIT_LIBLLVM_PATH:-}" ]; then
    echo "mpcam: DRJIT_LIBLLVM_PATH=$DRJIT_LIBLLVM_PATH does not do (${problem##*$'\n'}): unset it, or name LLVM 17 or newer" >&2
    exit 1
fi
tools/apt_install.sh "Dr.Jit does not work yet (${problem##*$'\n'})" \
    "libllvm19|libllvm20|libllvm21|libllvm18|libllvm17" libatomic1
problem=$(ask) || { echo "mpcam: Dr.Jit still does not work: ${problem##*$'\n'}" >&2; exit 1; }
