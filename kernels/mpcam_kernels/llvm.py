"""Which versions of LLVM can compile what the kernels need."""

OLDEST_LOADED = 15
OLDEST_USABLE = 17
REMEDY = (
    f"install LLVM {OLDEST_USABLE} or newer (Debian, Ubuntu: apt-get install libllvm19), "
    "or set DRJIT_LIBLLVM_PATH to its libLLVM file"
)


def usable(version: tuple[int, int, int]) -> str | None:
    """What is wrong with an LLVM version for Dr.Jit 1.5; None if nothing is.

    `version` is `drjit.detail.llvm_version()`, which is (-1, -1, -1) where no library was loaded. The text is one line
    and does not say how to mend it: REMEDY does.
    """
    text = ".".join(str(part) for part in version)
    if version[0] < 0:
        return f"Dr.Jit found no LLVM library, or only one older than {OLDEST_LOADED}, which it refuses"
    if version[0] < OLDEST_LOADED:
        return f"LLVM {text} is too old: Dr.Jit refuses it"
    if version[0] < OLDEST_USABLE:
        return f"LLVM {text} aborts the process at the first maximum of two floats (Cannot select: fmaximum)"
    return None
