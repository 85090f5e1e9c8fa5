"""Rules of the repository that no other tool checks."""

import ast
import os
import re
import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import mpcam

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
TEXT = {
    ".py",
    ".pyi",
    ".md",
    ".toml",
    ".sh",
    ".js",
    ".css",
    ".html",
    ".yaml",
    ".yml",
    ".cff",
    ".lock",
    ".txt",
    ".rst",
    "",
}
GENERATED = {".venv", ".git", "__pycache__", "build", "dist", "out", "_build", "node_modules"}


def text_files() -> list[Path]:
    found = []
    for folder, folders, files in os.walk(ROOT):
        folders[:] = [name for name in folders if name not in GENERATED and not name.endswith("_cache")]
        found += [Path(folder, name) for name in files if Path(name).suffix in TEXT and name not in GENERATED]
    return [path for path in found if path.relative_to(ROOT).parts[0] != ".hypothesis"]


def python_files(*folders: str) -> list[Path]:
    return [path for folder in folders for path in (ROOT / folder).rglob("*.py")]


def imports(path: Path) -> set[str]:
    """Dotted names of the modules that a file imports, anywhere in it."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            names |= {f"{node.module}.{alias.name}" for alias in node.names} | {str(node.module)}
    return names


def requirements(*extras: str) -> list[Requirement]:
    project = PROJECT["project"]
    texts = list(project["dependencies"])
    for extra in extras:
        texts += project["optional-dependencies"][extra]
    return [Requirement(text) for text in texts]


def test_no_path_of_one_machine():
    pattern = re.compile("/(?:" + "|".join(("home", "root", "Users", "work", "workspace")) + r")/[\w.]")
    found = [
        f"{path.relative_to(ROOT)}: {match[0]}"
        for path in text_files()
        for match in pattern.finditer(path.read_text(encoding="utf-8"))
    ]
    assert not found


def test_lock_has_exact_versions_and_no_host():
    lines = (ROOT / "requirements.lock").read_text().splitlines()
    assert all(re.fullmatch(r"[A-Za-z0-9._-]+==[A-Za-z0-9.!+]+", line) for line in lines)
    assert lines == sorted(lines, key=str.upper)  # as sort -f does
    names = [canonicalize_name(line.split("==")[0]) for line in lines]
    assert len(set(names)) == len(names)
    assert {"mpcam", "pip", "setuptools"}.isdisjoint(names)
    assert not [name for name in names if name.startswith(("nvidia-", "cuda-"))]


def test_lock_satisfies_what_the_project_asks():
    lines = (ROOT / "requirements.lock").read_text().splitlines()
    locked = {canonicalize_name(name): version for name, version in (line.split("==") for line in lines)}
    for requirement in requirements("test", "docs"):
        assert requirement.specifier.contains(locked[canonicalize_name(requirement.name)], prereleases=True)


def test_every_bound_has_both_ends():
    for requirement in requirements("test"):
        operators = {specifier.operator for specifier in requirement.specifier}
        assert operators == {">=", "<"}, requirement


def test_third_party_imports_are_declared():
    own = {"mpcam", "mpcam_kernels", "tests", "tools", "conftest"} | {
        path.stem for path in python_files("tests", "experiments")
    }
    homes = {module: set(map(canonicalize_name, names)) for module, names in metadata.packages_distributions().items()}
    for folders, extras in ((("mpcam", "kernels"), ()), (("tests", "experiments"), ("test",))):
        declared = {canonicalize_name(requirement.name) for requirement in requirements(*extras)}
        for path in python_files(*folders):
            for module in {name.split(".")[0] for name in imports(path)} - own - sys.stdlib_module_names:
                assert homes.get(module, {module}) & (declared | {"packaging"}), f"{path}: {module}"


def test_kernels_need_nothing_heavy():
    for path in python_files("kernels/mpcam_kernels"):
        assert {"jax", "mitsuba", "mpcam"}.isdisjoint(imports(path)), path


def test_configured_paths_exist():
    tools = PROJECT["tool"]
    for name in tools["hatch"]["build"]["targets"]["wheel"]["packages"]:
        assert (ROOT / name / "py.typed").is_file()
    for name in (*tools["pytest"]["ini_options"]["testpaths"], *tools["pyright"]["extraPaths"]):
        assert (ROOT / name).is_dir()


def test_pyright_sees_every_folder_with_code():
    code = {path.relative_to(ROOT).parts[0] for path in text_files() if path.suffix == ".py"}
    assert code == set(PROJECT["tool"]["pyright"]["include"])


def test_version_is_the_same_everywhere():
    version = PROJECT["project"]["version"]
    assert mpcam.__version__ == metadata.version("mpcam") == version
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text()
    assert f"\n## [{version}]" in (ROOT / "CHANGELOG.md").read_text()


@pytest.mark.parametrize("script", [".ci/run", "tools/setup.sh", "tools/apt_install.sh", "tools/ensure_llvm.sh"])
def test_scripts_can_run(script):
    assert os.access(ROOT / script, os.X_OK)
    subprocess.run(["bash", "-n", ROOT / script], check=True)


def test_readme_opens_with_targets_that_exist():
    first = (ROOT / "README.md").read_text().split("\n\n")[1].split("\n")
    assert [line.strip() for line in first] == ["make demo", "make test"]
    targets = set(re.findall(r"^([a-z-]+):.* ## ", (ROOT / "Makefile").read_text(), re.MULTILINE))
    assert {"help", "demo", "test", "docs", "lock", "clean"} <= targets


def test_documentation_names_everything_public():
    words = set(re.findall(r"\w+", (ROOT / "docs" / "api.md").read_text()))
    assert set(mpcam.__all__) <= words
