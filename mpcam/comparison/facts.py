"""What a reader must know to judge the numbers: the scene, the machine and the versions."""

import datetime
import importlib.metadata
import os
import platform
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mpcam.comparison.numbers import format_number

PACKAGES = ("mpcam", "drjit", "mitsuba", "numpy", "OpenImageIO")


def scene_facts(scene: Any, camera: Any, shading: str) -> dict[str, str]:
    """Name, sizes, camera and light of a scene, as text by name."""
    mesh = scene.mesh
    extent = " x ".join(format_number(float(side)) for side in mesh.bounds[1] - mesh.bounds[0])
    return {
        "scene": scene.name,
        "triangles": f"{mesh.triangle_count:,}",
        "vertices": f"{len(mesh.vertices):,}",
        "meshes": f"{len(scene.meshes):,}",
        "extent": f"{extent} scene units",
        "camera": describe_camera(camera),
        "image": f"{camera.width} x {camera.height} pixels",
        "lights": f"{len(scene.lights)}",
        "shading": shading,
    }


def describe_camera(camera: Any) -> str:
    """The camera's class and its short parameters, e.g. "Radial(profile=paraboloid, fov=3.14)"."""
    center = (("cx", camera.width / 2), ("cy", camera.height / 2))
    parts = []
    for item in fields(camera) if is_dataclass(camera) else ():
        value = getattr(camera, item.name)
        if item.name in ("width", "height") or item.name.startswith("_"):
            continue
        if (item.name, value) in center:
            continue  # goes without saying
        if isinstance(value, (bool, str)):
            parts.append(f"{item.name}={value}")
        elif isinstance(value, (int, float, np.number)):
            parts.append(f"{item.name}={format_number(float(value))}")
        elif isinstance(getattr(value, "name", None), str):
            parts.append(f"{item.name}={value.name}")
    return f"{type(camera).__name__}({', '.join(parts)})"


def machine_facts() -> dict[str, str]:
    """Processor, threads, versions and date, as text by name. Loads Dr.Jit."""
    import drjit as dr

    from mpcam_kernels.backend import backend_name

    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    version = dr.detail.llvm_version() if hasattr(dr.detail, "llvm_version") else None
    return {
        "processor": _processor(),
        "cores": f"{usable} usable of {os.cpu_count()}",
        "threads": f"{dr.thread_count()}",
        "backend": backend_name(),
        "LLVM": ".".join(str(part) for part in version) if version else "unknown",
        "system": f"{platform.system()} {platform.release()} {platform.machine()}",
        "Python": platform.python_version(),
        **{name: _version(name) for name in PACKAGES},
        "date": datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d %H:%M UTC"),
    }


def _processor() -> str:
    listing = Path("/proc/cpuinfo")
    if listing.exists():
        for line in listing.read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine() or "unknown"


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "not installed as a package"
