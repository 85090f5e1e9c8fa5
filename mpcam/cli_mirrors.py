"""What mirrors and glass need of the command line: options of `render`; decompose, caustics, surround."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from mpcam.cli_common import angle, check_machine, load, print_json
from mpcam.errors import InputError


@Parameter(name="*")
@dataclass(frozen=True)
class InMirror:
    """How the scene's mirror, or its refractor, is shown.

    Args:
        triangles: Camera triangles that stand for it; the scene's own number if not given.
        image_size: Pixels along a side of environment maps or depth images, for --method environment and depth_image.
        aside: How far around things depth images reach, in radii of the thing; 0 for pinholes.
        bounces: How often rays are reflected, for --method depth_image and raytrace.
        reflectance: Part of the light that the scene's meshes reflect, with more than one bounce.
        own: Show the mirror in itself, with more than one bounce.
        second: How the interface is found at which rays leave a refractor: march, wyman, trace or none.
        inner: Total reflections inside of a refractor that are followed.
        fresnel: Let the outer surface of a refractor reflect.
    """

    triangles: int | None = None
    image_size: int | None = None
    aside: float | None = None
    bounces: int | None = None
    reflectance: float | None = None
    own: bool | None = None
    second: str | None = None
    inner: int | None = None
    fresnel: bool | None = None

    def settings(self) -> dict[str, Any]:
        """What was given, by the names of `mpcam.Reflection` and `mpcam.Refraction`."""
        given = {"size" if name == "image_size" else name: value for name, value in asdict(self).items()}
        return {name: value for name, value in given.items() if value is not None}


def decompose(
    scene: str,
    /,
    *,
    output: Path,
    eye: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None,
    triangles: int | None = None,
    max_angle: str | None = None,
    resolution: int | None = None,
    mode: str | None = None,
    json: bool = False,
) -> None:
    """Cut the scene's mirror into camera triangles, write them as a camera in JSON, and say how far their rays are off.

    Args:
        scene: TOML file with a mirror, or a mesh file that is the mirror.
        output: JSON file for the camera.
        eye: Point x,y,z that looks into the mirror; the scene's camera if not given.
        triangles: How many at most; those of the scene's mirror, or 104.
        max_angle: In place of triangles, as few as leave rays off by at most so much (root mean square): 1mrad, 0.05deg
            or, in radians, 0.001.
        resolution: Pixels along the short sides of each; those of the scene's mirror, or 64.
        mode: How rays run between vertices: normals, directions, general_linear or continuous; that of the scene's
            mirror if not given.
        json: Print the errors as JSON.
    """
    from mpcam.cameras.serialize import camera_to_json
    from mpcam.decomposition.decompose import decompose as cut
    from mpcam.decomposition.ray_error import ray_error
    from mpcam.io.atomic import atomic_path
    from mpcam.io.points import read_point
    from mpcam.scene.mirror import Mirror

    check_machine()
    loaded = load(scene, None).scene
    mirror = loaded.mirror or Mirror(loaded.mesh)
    seen: Any = loaded.camera if eye is None else read_point(eye, "--eye")
    most = None if max_angle is None else angle(max_angle, "--max-angle")
    cams = cut(
        mirror.surface,
        seen,
        triangles or (mirror.triangles if most is None else None),
        max_angle=most,
        resolution=resolution or mirror.resolution,
        index=mirror.index,
        mode=mode or mirror.mode,
    )
    found = ray_error(cams, mirror.surface, seen)
    with atomic_path(output) as file:
        file.write_text(camera_to_json(cams) + "\n", encoding="utf-8")
    if json:
        print_json({"triangles": cams.count, "width": cams.width, "height": cams.height} | asdict(found))
        return
    print(f"{cams.count} camera triangles, {cams.width} x {cams.height} pixels: {output}")
    print(
        f"rays off by {found.angle_rms:.3g} mrad (root mean square); at {found.distance:.3g} scene units by "
        f"{found.rms:.3g}, median {found.median:.3g}, 95 % below {found.p95:.3g}"
    )


def caustics(
    scene: str,
    /,
    *,
    output: Path,
    size: str | None = None,
    triangles: int = 400,
    resolution: int = 64,
    photons: int = 512,
    radius: float = 2.0,
) -> None:
    """Render a scene with the caustics that its mirror, or interface, throws of its first point light.

    Args:
        scene: TOML file with a mirror and a point light.
        output: Image file: .png, .exr and others.
        size: Image size in pixels, as 640x480 or 512.
        triangles: Camera triangles as the light sees the mirror.
        resolution: Pixels along the short sides of each.
        photons: Pixels along a side of the light's view.
        radius: Pixels that a photon is spread over, 0 to 8.
    """
    from rich.console import Console

    from mpcam.effects.caustics import caustics as cast
    from mpcam.io.image_formats import format_of
    from mpcam.io.images import write_image
    from mpcam.scene.scene import PointLight

    format_of(output)
    check_machine()
    loaded = load(scene, size).scene
    light = next((one for one in loaded.lights if isinstance(one, PointLight)), None)
    if loaded.mirror is None or light is None:
        raise InputError(f"{scene}: caustics need a [mirror] and a [[light]] of type point: give the scene both")
    settings: dict[str, Any] = {"triangles": triangles, "resolution": resolution, "photons": photons, "radius": radius}
    mirror = loaded.mirror
    with Console(stderr=True).status(f"caustics of {loaded.name}"):
        found = cast(
            loaded, mirror.surface, light, loaded.camera, index=mirror.index, reflectance=mirror.color, **settings
        )
        write_image(output, found.render())


def surround(
    scene: str,
    /,
    *,
    output: Path,
    center: Annotated[str, Parameter(allow_leading_hyphen=True)] = "0,0,1",
    radius: float = 2.0,
    height: float = 2.0,
    columns: int = 20,
    rows: int = 10,
    resolution: int = 64,
    outward: bool = False,
    slant: float = 0.0,
    shading: str = "light",
) -> None:
    """Show all sides of something in one picture, through a strip of camera triangles around it.

    Args:
        scene: TOML file, mesh file or name of a built-in scene.
        output: Image file: .png, .exr and others.
        center: Middle of the strip, x,y,z.
        radius: Of the strip, scene units.
        height: Of the strip, scene units.
        columns: Cells around, two camera triangles each.
        rows: Cells above each other.
        resolution: Pixels along a cell.
        outward: Look away from the middle.
        slant: Degrees that rays are tilted up.
        shading: light, color, normal or texture.
    """
    import math

    from rich.console import Console

    from mpcam.effects.visualization import surround as strip
    from mpcam.effects.visualization import unrolled
    from mpcam.io.image_formats import format_of
    from mpcam.io.images import write_image
    from mpcam.io.points import read_point
    from mpcam.rendering.methods import rasterize
    from mpcam.rendering.shade import shade

    format_of(output)
    check_machine()
    loaded = load(scene, None).scene
    cams = strip(
        read_point(center, "--center"),
        radius,
        height,
        columns,
        rows,
        inward=not outward,
        slant=math.radians(slant),
        resolution=resolution,
    )
    with Console(stderr=True).status(f"all around in {loaded.name}"):
        write_image(output, unrolled(cams, shade(rasterize(cams, loaded.mesh), loaded, shading)))
