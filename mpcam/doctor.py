"""Is this machine fit to run mpcam? Each question is asked in a process of its own, so that one may crash unharmed."""

import importlib
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from importlib import metadata
from typing import TYPE_CHECKING, Any

from mpcam.errors import SetupError
from mpcam_kernels.llvm import REMEDY, usable

if TYPE_CHECKING:
    from rich.table import Table

PROBE_SECONDS = 60
KERNEL, MITSUBA = "compile a kernel", "Mitsuba"
REINSTALL = "python -m pip install --force-reinstall"


@dataclass(frozen=True)
class Check:
    """One answer: whether the thing is `ok`, whether mpcam `needed` it, what was `found`, and what mends it."""

    name: str
    ok: bool
    needed: bool
    found: str
    remedy: str = ""


def check_llvm() -> None:
    """Refuse an LLVM that would fail or abort this process; cheap enough for the first use of Dr.Jit.

    Raises SetupError, whose message names the remedy.
    """
    try:
        import drjit
    except (ImportError, NameError) as error:  # NameError: Dr.Jit stumbles over its own report of an ImportError
        failure = str(error.__context__ or error)
        raise SetupError(f"Dr.Jit does not load, {failure}: {_drjit_remedy(failure)}") from None

    if problem := usable(_llvm_version(drjit)):
        raise SetupError(f"{problem}: {REMEDY}")


def examine() -> list[Check]:
    """Ask everything, which takes some seconds. Nothing that fails here can take the caller down."""
    modules = ("OpenImageIO", "jax", "mapbox_earcut", "optimistix")
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        others = pool.map(_check_module, modules)
        backend = _check_drjit()
        if all(check.ok for check in backend if check.needed):
            backend += [_check_kernel(), _check_mitsuba()]
        else:  # both would only repeat the failure, in words of their own
            why = "not tried, for Dr.Jit or its LLVM does not do"
            backend += [Check(name, False, True, why) for name in (KERNEL, MITSUBA)]
        return [_check_python(), *backend, *others]


def is_fit(checks: list[Check]) -> bool:
    """Whether everything that mpcam needs is in order."""
    return all(check.ok for check in checks if check.needed)


def report(checks: list[Check]) -> dict[str, Any]:
    """The answers as plain data, for `mpcam doctor --json`."""
    return {"ok": is_fit(checks), "checks": [asdict(check) for check in checks]}


def table(checks: list[Check]) -> "Table":
    """The answers as a table for the terminal."""
    from rich.table import Table
    from rich.text import Text

    result = Table("check", "", "found", title="mpcam doctor", title_justify="left", highlight=False)
    for check in checks:
        mark = Text("ok", "green") if check.ok else Text("FAIL", "bold red") if check.needed else Text("no", "yellow")
        found = Text(check.found)
        if check.remedy:
            found.append(f"\n-> {check.remedy}", "bold" if check.needed else "")
        result.add_row(check.name, mark, found)
    return result


def _check_python() -> Check:
    version = ".".join(str(part) for part in sys.version_info[:3])
    ok = sys.version_info >= (3, 11)
    return Check("Python", ok, True, f"{version} ({sys.executable})", "" if ok else "install Python 3.11 or newer")


def _check_drjit() -> list[Check]:
    answer = _ask("drjit")
    if isinstance(answer, str):
        return [Check("Dr.Jit", False, True, answer, _drjit_remedy(answer))]
    return [
        Check("Dr.Jit", True, True, f"{answer['version']}, {answer['threads']} threads"),
        llvm_check(tuple(answer["llvm"]), answer["library"]),
        Check("CUDA", answer["cuda"], False, "available" if answer["cuda"] else "none; kernels run on the CPU"),
    ]


def llvm_check(version: tuple[int, int, int], library: str) -> Check:
    """What to say of an LLVM `version` that Dr.Jit loaded from the file `library` ("" if none)."""
    refused = re.search(r"libLLVM(?:\.so|)[-.](\d+)", library) if version[0] < 0 else None
    if refused:  # Dr.Jit does not tell the version of a library that it refused, but the file's name does
        version = (int(refused[1]), 0, 0)
    problem = usable(version)
    where = f" ({library})" if library else ""
    if problem is None:
        return Check("LLVM", True, True, ".".join(str(part) for part in version) + where)
    chosen = os.environ.get("DRJIT_LIBLLVM_PATH")
    remedy = "unset DRJIT_LIBLLVM_PATH, which chose this, or " + REMEDY if chosen else REMEDY
    return Check("LLVM", False, True, problem + where, remedy)


def _check_kernel() -> Check:
    with tempfile.TemporaryDirectory() as home:  # Dr.Jit caches kernels in HOME, and a cached one would prove nothing
        answer = _ask("kernel", HOME=home)
    if isinstance(answer, str):
        return Check(KERNEL, False, True, answer, REMEDY)
    return Check(KERNEL, True, True, f"{answer['seconds']:.2f} s")


def _check_mitsuba() -> Check:
    answer = _ask("mitsuba")
    if isinstance(answer, str):
        return Check(MITSUBA, False, True, answer, f"{REINSTALL} {_requirement('mitsuba')}")
    return Check(MITSUBA, True, True, f"{answer['version']}, variant {answer['variant']}")


def _check_module(name: str) -> Check:
    answer = _ask(name)
    if isinstance(answer, str):
        return Check(name, False, True, answer, f"{REINSTALL} {_requirement(name)}")
    return Check(name, True, True, answer["version"])


def _drjit_remedy(failure: str) -> str:
    if "libatomic" in failure:  # the wheel expects it of the system, and small systems lack it
        return "install libatomic (Debian, Ubuntu: apt-get install libatomic1)"
    return f"{REINSTALL} {_requirement('drjit')}"


def _requirement(name: str) -> str:
    """What mpcam's metadata asks of a package, quoted for a shell; the bare name where mpcam is not installed."""
    try:
        wanted = metadata.requires("mpcam") or []
    except metadata.PackageNotFoundError:
        wanted = []
    found = next((text for text in wanted if re.match(rf"{name}\b", text, re.IGNORECASE) and ";" not in text), name)
    return f"'{found}'"


def _ask(probe: str, **environment: str) -> dict[str, Any] | str:
    """Run a probe in a process of its own; its answer, or one line that says how it failed."""
    path = os.pathsep.join(entry for entry in sys.path if entry)
    command = [sys.executable, "-m", "mpcam.doctor", probe]
    try:
        done = subprocess.run(
            command,
            env={**os.environ, "PYTHONPATH": path, **environment},
            capture_output=True,
            text=True,
            timeout=PROBE_SECONDS,
        )
    except subprocess.TimeoutExpired:
        return f"no answer within {PROBE_SECONDS} s"
    if done.returncode == 0:
        return json.loads(done.stdout.splitlines()[-1])
    lines = [line.strip() for line in done.stderr.splitlines() if line.strip()]
    missing = [line for line in lines if "cannot open shared object file" in line]
    if done.returncode < 0:
        return f"killed by signal {-done.returncode}: {lines[0] if lines else 'no message'}"
    return (missing or lines)[-1] if lines else f"exit status {done.returncode}"


def _llvm_version(drjit: Any) -> tuple[int, int, int]:
    return tuple(drjit.detail.llvm_version())


def _loaded_library(pattern: str) -> str:
    """Path of the shared library of this process that matches; "" if none, or if the system does not tell."""
    try:
        with open("/proc/self/maps", encoding="utf-8") as maps:
            paths = {line.split(maxsplit=5)[-1].strip() for line in maps}
    except OSError:
        return ""
    return next((path for path in sorted(paths) if re.search(pattern, os.path.basename(path))), "")


def _probe_drjit() -> dict[str, Any]:
    import drjit

    return {
        "version": metadata.version("drjit"),
        "llvm": _llvm_version(drjit),  # loads the library, so it comes before the next line
        "library": _loaded_library(r"^libLLVM"),
        "threads": drjit.thread_count(),
        "cuda": bool(drjit.has_backend(drjit.JitBackend.CUDA)),
    }


def _probe_kernel() -> dict[str, Any]:
    import drjit
    from drjit.llvm import Float

    start = time.perf_counter()
    total = drjit.sum(drjit.maximum(drjit.arange(Float, 64), Float(3.5)))[0]
    if total != 4 * 3.5 + sum(range(4, 64)):
        raise RuntimeError(f"the kernel ran, but its result {total} is wrong")
    return {"seconds": time.perf_counter() - start}


def _probe_mitsuba() -> dict[str, Any]:
    import mitsuba

    variant = "llvm_ad_rgb"
    mitsuba.set_variant(variant)
    mitsuba.load_dict({"type": "sphere"})
    return {"version": mitsuba.__version__, "variant": variant}


def _probe_module(name: str) -> dict[str, Any]:
    importlib.import_module(name)  # an import tells of missing system libraries, which metadata does not
    return {"version": metadata.version(name)}


def _answer(probe: str) -> dict[str, Any]:
    probes = {"drjit": _probe_drjit, "kernel": _probe_kernel, "mitsuba": _probe_mitsuba}
    return probes[probe]() if probe in probes else _probe_module(probe)


if __name__ == "__main__":
    sys.stdout.write(json.dumps(_answer(sys.argv[1])) + "\n")
