"""Which stages a picture takes, which are left out, and why."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from mpcam.backend import exclusive
from mpcam.cameras.base import Camera
from mpcam.rendering.buffered import Buffered
from mpcam.rendering.methods import prepare
from mpcam.rendering.shade import attributes, check_shading
from mpcam.scene.scene import PointLight, Scene


@dataclass(frozen=True)
class Step:
    """A stage, whether it runs, and on what, or why it does not."""

    name: str
    ran: bool
    why: str


@dataclass(frozen=True)
class Explanation:
    """The stages of a picture in order; printed, a line each."""

    steps: tuple[Step, ...]

    @property
    def ran(self) -> tuple[str, ...]:
        """Names of the stages that run."""
        return tuple(step.name for step in self.steps if step.ran)

    @property
    def left_out(self) -> dict[str, str]:
        """Names of the stages that are left out, and why."""
        return {step.name: step.why for step in self.steps if not step.ran}

    def __str__(self) -> str:
        wide = max((len(step.name) for step in self.steps), default=0)
        return "\n".join(f"{'runs' if s.ran else 'left out':8}  {s.name:{wide}}  {s.why}" for s in self.steps)


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
    frame = _rasterizing(prepared) if isinstance(prepared, Buffered) else _other(prepared)
    return Explanation((*frame, *_shading(whole, shading, shadows)))


def _rasterizing(prepared: Buffered) -> Iterator[Step]:
    seen: dict[str, Any] = {}
    positions = prepared.place(prepared.vertices) if prepared.mesh.triangle_count else []
    if not positions:
        yield Step("rasterization", False, "the mesh has no triangles")
        return
    prepared.run(positions, seen.__setitem__)
    vertices, triangles = len(positions[0].numpy()) // 4, prepared.triangle_count
    yield Step("vertices", True, f"{vertices:,} brought to the camera")
    outlined = prepared.curved and len(positions) > 1
    lens = f"{vertices:,}: what each knows of the projection, so that triangles need no profile"
    why = lens if outlined else f"the bound {prepared.bound!r} is worked out triangle by triangle"
    yield Step("projection around vertices", outlined, why if prepared.curved else "edges are straight in the image")
    hidden = _hidden(prepared, positions) if outlined else 0
    culled = "" if prepared.cull == "none" else f", and those that show their {prepared.cull}"
    yield Step("triangles", True, f"{triangles - hidden:,} bounded; left out: {hidden:,} that no pixel can see{culled}")
    large = int(seen["triangles"][1].count[0])
    few = f"{large:,} of more pixels than a lane walks by itself"
    yield Step(
        "lists of blocks", "lists" in seen, few if large else "no triangle covers more than a lane walks by itself"
    )
    yield Step("pixels through lists", "pixels" in seen, "nearest of each list" if large else "there are no lists")
    wanted = {"hits": "triangle and depth", "depth": "depth alone", "coverage": "coverage alone"}[prepared.output]
    yield Step("decode", True, f"{wanted} of each pixel")
    yield Step("root finding", False, "a pixel's ray is known in closed form or kept per camera, and is met by a plane")
    yield Step("tree over the triangles", False, "only method='raytrace' needs one")


def _hidden(prepared: Buffered, positions: list[Any]) -> int:
    from mpcam.cameras.outline import HIDDEN

    place = np.asarray(positions[0].numpy()).reshape(-1, 4)[:, 3]
    return int((place[prepared.mesh.faces] >= HIDDEN).all(axis=1).sum())


def _other(prepared: Any) -> Iterator[Step]:
    for name in prepared.stages():
        yield Step(name, True, f"of method {prepared.method!r}")


def _shading(scene: Scene, shading: str, shadows: bool) -> Iterator[Step]:
    mesh, table = scene.mesh, attributes(scene.mesh)
    if mesh.triangle_count == 0:
        yield Step("shading", False, "there is nothing to shade")
        return
    lit, unlit = shading == "light", f"shading={shading!r} needs none"
    yield Step("barycentric weights", True, "for what vertices carry")
    colour = shading != "normal"
    yield Step("materials", colour, f"{len(mesh.materials)}" if colour else unlit)
    yield Step(
        "vertex colours", colour and table.tinted, unlit if not colour else "" if table.tinted else "the mesh has none"
    )
    wants = shading in ("texture", "light")
    has = "the mesh has none" if not table.textured else ""
    yield Step("textures", wants and table.textured, has if wants else unlit)
    normals = shading in ("normal", "light")
    kind = "per vertex" if table.smooth else "per face"
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
