"""`mpcam doctor`: the table of LLVM versions, and that a failing or dying probe ends as a line with a remedy."""

import contextlib
import io
import json
from typing import Any

import pytest

from mpcam import doctor
from mpcam.cli import main
from mpcam.errors import SetupError
from mpcam_kernels.llvm import REMEDY, usable

NAMES = [
    "Python",
    "Dr.Jit",
    "LLVM",
    "CUDA",
    "compile a kernel",
    "Mitsuba",
    "OpenImageIO",
    "jax",
    "mapbox_earcut",
    "optimistix",
]


@pytest.fixture(scope="module")
def here() -> tuple[int, dict[str, Any]]:
    """Exit status and answer of `mpcam doctor --json` on this machine."""
    with contextlib.redirect_stdout(io.StringIO()) as out:
        status = main(["doctor", "--json"])
    return status, json.loads(out.getvalue())


@pytest.mark.parametrize(
    ("version", "said"),
    [
        ((-1, -1, -1), "no LLVM"),
        ((11, 0, 0), "refuses"),
        ((14, 0, 6), "LLVM 14.0.6 is too old: Dr.Jit refuses it"),
        ((15, 0, 6), "fmaximum"),
        ((16, 0, 6), "LLVM 16.0.6 aborts the process"),
    ],
)
def test_llvm_that_does_not_do(version, said):
    assert said in (usable(version) or "")
    check = doctor.llvm_check(version, "")
    assert not check.ok
    assert check.needed
    assert "libllvm19" in check.remedy
    assert "DRJIT_LIBLLVM_PATH" in check.remedy


@pytest.mark.parametrize("version", [(17, 0, 6), (18, 1, 8), (19, 1, 7), (22, 1, 0)])
def test_llvm_that_does(version):
    assert usable(version) is None
    assert doctor.llvm_check(version, "lib/libLLVM.so").found == ".".join(map(str, version)) + " (lib/libLLVM.so)"


@pytest.mark.parametrize("file", ["libLLVM-14.so.1", "libLLVM.so.14.0", "libLLVM-14.0.6.so.1"])
def test_version_of_a_refused_library_is_read_from_its_name(file):
    assert "LLVM 14" in doctor.llvm_check((-1, -1, -1), file).found


def test_chosen_library_is_named_in_the_remedy(monkeypatch):
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", "libLLVM-15.so")
    assert "unset DRJIT_LIBLLVM_PATH" in doctor.llvm_check((15, 0, 6), "libLLVM-15.so").remedy
    monkeypatch.delenv("DRJIT_LIBLLVM_PATH")
    assert "unset" not in doctor.llvm_check((15, 0, 6), "libLLVM-15.so").remedy


def test_this_machine_is_fit(here):
    status, report = here
    assert report["ok"] is True, [check for check in report["checks"] if not check["ok"]]
    assert status == 0
    assert [check["name"] for check in report["checks"]] == NAMES
    assert all(check.keys() == {"name", "ok", "needed", "found", "remedy"} for check in report["checks"])
    assert all(check["found"] for check in report["checks"])


def test_needed_and_optional_parts_count_differently():
    optional = doctor.Check("CUDA", False, False, "none")
    assert doctor.is_fit([optional])
    assert not doctor.is_fit([optional, doctor.Check("LLVM", False, True, "none", REMEDY)])


def test_missing_llvm_is_reported_not_raised(monkeypatch, tmp_path, capsys):
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", str(tmp_path / "libLLVM.so"))
    assert main(["doctor"]) == 1
    lines = capsys.readouterr().out.splitlines()
    rows = {name: line for name in NAMES for line in lines if line.startswith(f"│ {name} ")}
    assert [name for name in NAMES if "FAIL" in rows[name]] == ["LLVM", "compile a kernel", "Mitsuba"]
    assert "libllvm19" in " ".join(lines)


def test_probe_that_dies_is_caught(monkeypatch, tmp_path):
    (tmp_path / "dies.py").write_text(
        "import os, sys\nprint('LLVM ERROR: boom', file=sys.stderr, flush=True)\nos.abort()\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    check = doctor._check_module("dies")
    assert not check.ok
    assert check.found == "killed by signal 6: LLVM ERROR: boom"


def test_missing_library_of_the_system_is_named_before_what_follows_from_it(monkeypatch, tmp_path):
    cause = "raise ImportError('libatomic.so.1: cannot open shared object file')"
    (tmp_path / "lame.py").write_text(f"try:\n    {cause}\nexcept ImportError:\n    unknown\n")
    monkeypatch.syspath_prepend(tmp_path)
    found = doctor._check_module("lame").found
    assert "libatomic.so.1" in found
    assert "apt-get install libatomic1" in doctor._drjit_remedy(found)


def test_missing_package_is_named_as_pip_wants_it():
    check = doctor._check_module("no_such_package")
    assert "No module named" in check.found
    assert check.remedy.endswith("'no_such_package'")
    assert doctor._requirement("OpenImageIO").lower() == "'openimageio<3.3,>=3.2'"


def test_check_llvm_passes_here():
    doctor.check_llvm()


def test_check_llvm_raises_one_line(monkeypatch):
    monkeypatch.setattr(doctor, "_llvm_version", lambda drjit: (15, 0, 6))
    with pytest.raises(SetupError, match=r"LLVM 15\.0\.6 .*libllvm19") as caught:
        doctor.check_llvm()
    assert "\n" not in str(caught.value)
