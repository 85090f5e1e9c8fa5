"""Every camera as a Mitsuba sensor, so that Mitsuba renders the truth through it.

    import mitsuba as mi, mpcam as mp
    mi.set_variant("llvm_ad_rgb")
    mp.truth.register()
    sensor = mi.load_dict(mp.truth.sensor(camera, samples=64))

or, in a scene file, `<sensor type="mpcam"><string name="camera" value="camera.json"/> ... </sensor>`, where the string
is a camera's JSON or the name of a file that holds it.
"""

from pathlib import Path
from typing import Any

from mpcam.cameras.base import Camera
from mpcam.cameras.capabilities import Bends
from mpcam.cameras.serialize import camera_from_json, camera_to_json
from mpcam.checks import whole_number
from mpcam.errors import InputError
from mpcam.math.pose import frame_origin

_registered: set[str] = set()
_kept: dict[str, Camera] = {}


def sensor(
    camera: Camera, samples: int = 16, *, centered: bool = False, film: dict[str, Any] | None = None
) -> dict[str, Any]:
    """A Mitsuba dictionary for a camera: the sensor with its film and sampler, to be put into a scene dictionary.

    samples: per pixel. centered: every sample goes through its pixel's center, as the rasterizer's do. film: other
    settings of the high dynamic range film (it has a box filter of one pixel, float32, and no alpha by default).
    Raises InputError for a camera whose rays bend: a sensor gives Mitsuba one straight ray.
    """
    if not isinstance(camera, Camera):
        raise InputError(f"sensor(camera={type(camera).__name__}): give one of mpcam's cameras")
    _check_straight(camera)
    samples = whole_number("samples", samples, 1, of="sensor")
    settings = {
        "type": "hdrfilm",
        "width": camera.width,
        "height": camera.height,
        "rfilter": {"type": "box"},
        "pixel_format": "rgb",
        "component_format": "float32",
    }
    try:
        text = camera_to_json(camera)
    except InputError:  # a user's own function stays in this process
        text = f"kept:{id(camera)}"
        _kept[text] = camera
    return {
        "type": "mpcam",
        "camera": text,
        "centered": centered,
        "film": settings | (film or {}),
        "sampler": {"type": "independent", "sample_count": samples},
    }


def register() -> None:
    """Make the sensor plugin "mpcam" known to the Mitsuba variant in force; once per variant, later calls do nothing.

    Raises InputError when no variant is set yet.
    """
    import mitsuba as mi

    variant = mi.variant()
    if variant is None:
        raise InputError("mpcam.truth.register(): set a Mitsuba variant first, e.g. mitsuba.set_variant('llvm_ad_rgb')")
    if variant in _registered:
        return
    mi.register_sensor("mpcam", _sensor_class(mi))
    _registered.add(variant)


def _read(text: str) -> Camera:
    """A camera from JSON, from a file with JSON, or kept in this process."""
    if text in _kept:
        return _kept[text]
    if text.lstrip().startswith("{"):
        return camera_from_json(text)
    path = Path(text)
    try:
        return camera_from_json(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(
            f"sensor mpcam: camera={text!r} is neither JSON nor a file that can be read ({error})"
        ) from None


def _check_straight(camera: Camera) -> None:
    """See that a sensor can give the rays of a camera."""
    if isinstance(camera, Bends):
        raise InputError(
            f"sensor mpcam: rays of a {type(camera).__name__} bend, and Mitsuba takes one straight ray of each pixel: "
            "use mpcam.rasterize(camera, mesh, method='raytrace'), which has it trace them piece by piece"
        )


def _sensor_class(mi: Any) -> type:
    """The plugin for the variant in force."""
    import drjit as dr

    class MpcamSensor(mi.Sensor):
        def __init__(self, properties: Any):
            super().__init__(properties)
            if "camera" not in properties:
                raise InputError("sensor mpcam: the string 'camera' is missing; see mpcam.truth.sensor(camera)")
            self.camera = _read(str(properties["camera"]))
            _check_straight(self.camera)
            self.centered = bool(properties.get("centered", False))
            size = self.film().size()
            if (int(size[0]), int(size[1])) != (self.camera.width, self.camera.height):
                raise InputError(
                    f"sensor mpcam: the film is {int(size[0])}x{int(size[1])} pixels, the camera "
                    f"{self.camera.width}x{self.camera.height}: give the film the camera's size"
                )

        def _pixel(self, sample: Any) -> Any:
            crop, offset = self.film().crop_size(), self.film().crop_offset()
            u, v = sample.x * float(crop[0]) + float(offset[0]), sample.y * float(crop[1]) + float(offset[1])
            if self.centered:
                u = dr.minimum(dr.floor(u), self.camera.width - 1) + 0.5
                v = dr.minimum(dr.floor(v), self.camera.height - 1) + 0.5
            return mi.Point2f(u, v)

        def _ray(self, pixel: Any) -> tuple[Any, Any, Any]:
            origin, direction, valid = self.camera.ray(mi.Array2f(pixel) if hasattr(mi, "Array2f") else pixel)
            return mi.Point3f(origin), mi.Vector3f(direction), valid

        def sample_ray(
            self, time: Any, sample1: Any, sample2: Any, sample3: Any, active: Any = True
        ) -> tuple[Any, Any]:
            wavelengths, weight = self.sample_wavelengths(dr.zeros(mi.SurfaceInteraction3f), sample1, active)
            origin, direction, valid = self._ray(self._pixel(sample2))
            ray = mi.Ray3f(origin, direction, time, wavelengths)
            return ray, dr.select(valid & active, weight, 0.0)

        def sample_ray_differential(
            self, time: Any, sample1: Any, sample2: Any, sample3: Any, active: Any = True
        ) -> tuple[Any, Any]:
            wavelengths, weight = self.sample_wavelengths(dr.zeros(mi.SurfaceInteraction3f), sample1, active)
            pixel = self._pixel(sample2)
            origin, direction, valid = self._ray(pixel)
            ray = mi.RayDifferential3f(mi.Ray3f(origin, direction, time, wavelengths))
            right, down = self._ray(pixel + mi.Vector2f(1, 0)), self._ray(pixel + mi.Vector2f(0, 1))
            ray.o_x, ray.o_y = right[0], down[0]
            # A neighbor outside of the view has no ray: no differential there.
            ray.d_x = dr.select(right[2], right[1], direction)
            ray.d_y = dr.select(down[2], down[1], direction)
            ray.has_differentials = True
            return ray, dr.select(valid & active, weight, 0.0)

        def bbox(self) -> Any:
            return mi.BoundingBox3f(mi.Point3f([float(x) for x in frame_origin(self.camera.camera_from_world)]))

        def to_string(self) -> str:
            return f"MpcamSensor[camera = {self.camera!r}]"

    return MpcamSensor
