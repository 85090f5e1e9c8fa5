"""Which stages a picture takes, which are left out, and why."""

from collections.abc import Iterator
from typing import Any

from mpcam.backend import exclusive
from mpcam.cameras.base import Camera
from mpcam.rendering.explanation import Explanation, Step
from mpcam.rendering.methods import prepare
from mpcam.rendering.shade import attributes, check_shading
from mpcam.scene.scene import PointLight, Scene


@exclusive
def explain(
    camera: Camera,
    scene: Any,
    method: str = "invert",
    *,
    shading: str = "light",
    shadows: bool = False,
    **settings: Any,
) -> Explanation:
    """What `render` does with the same arguments. Takes one frame to find out. Raises InputError as `render` does."""
    whole = Scene.of(scene)
    check_shading(shading)
    prepared = prepare(camera, whole.mesh, method, **settings)
    return Explanation((*prepared.explain(), *_shading(whole, shading, shadows), *_reliefs(whole)))


def _reliefs(scene: Scene) -> Iterator[Step]:
    for one in scene.reliefs:
        yield Step("relief", len(one) > 0, f"{len(one)} copies of {one.relief}, followed ray by ray within their boxes")


def _shading(scene: Scene, shading: str, shadows: bool) -> Iterator[Step]:
    mesh, table = scene.mesh, attributes(scene.mesh)
    if mesh.triangle_count == 0:
        yield Step("shading", False, "there is nothing to shade")
        return
    lit, unlit = shading == "light", f"shading={shading!r} needs none"
    yield Step("barycentric weights", True, "for what vertices carry")
    color = shading != "normal"
    yield Step("materials", color, f"{len(mesh.materials)}" if color else unlit)
    yield Step(
        "vertex colors", color and table.tinted, unlit if not color else "" if table.tinted else "the mesh has none"
    )
    wants = shading in ("texture", "light")
    has = "the mesh has none" if not table.textured else ""
    yield Step("textures", wants and table.textured, has if wants else unlit)
    normals = shading in ("normal", "light")
    kind = "per face" if mesh.normals is None else "per vertex"
    yield Step("normals", normals, kind if normals else unlit)
    count = len(scene.lights)
    yield Step(
        "lights",
        lit and count > 0,
        unlit if not lit else f"{count}" if count else "the scene has none: one at the viewer",
    )
    points = sum(isinstance(light, PointLight) for light in scene.lights)
    why = f"for {points} point lights" if points else "no light is near enough to need them"
    yield Step("places of the hits", lit and (points > 0 or shadows), why if lit else unlit)
    yield Step("shadow maps", shadows, f"{count}, depth alone" if shadows else "not asked for: shadows=True")
