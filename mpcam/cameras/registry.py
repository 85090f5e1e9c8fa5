"""The register of cameras: one import line a model.

From here a model gets its public name (`mpcam.Pinhole`), is written and read as JSON, in scene files and in headers of
images, is a Mitsuba sensor, has stress cases if there is a module of its name, and is tested. What else belongs to a
model lives in its own file.
"""

from mpcam.cameras.base import Camera as Camera

# Messages and tables list the models in this order.
# isort: off
from mpcam.cameras.radial import Radial as Radial
from mpcam.cameras.pinhole import Pinhole as Pinhole
from mpcam.cameras.orthographic import Orthographic as Orthographic
from mpcam.cameras.kannala_brandt import KannalaBrandt as KannalaBrandt
from mpcam.cameras.double_sphere import DoubleSphere as DoubleSphere
from mpcam.cameras.unified_omni import UnifiedOmni as UnifiedOmni
from mpcam.cameras.brown_conrady import BrownConrady as BrownConrady
from mpcam.cameras.angle_polynomial import AnglePolynomial as AnglePolynomial
from mpcam.cameras.scaramuzza import Scaramuzza as Scaramuzza
from mpcam.cameras.field_of_view import FieldOfView as FieldOfView
from mpcam.cameras.panorama import Panorama as Panorama
from mpcam.cameras.general_linear import GeneralLinear as GeneralLinear
from mpcam.cameras.general_linears import GeneralLinears as GeneralLinears
from mpcam.cameras.single_pole import SinglePoleOcclusion as SinglePoleOcclusion
from mpcam.cameras.ray_map import RayMap as RayMap
from mpcam.cameras.camera_triangles import CameraTriangles as CameraTriangles
from mpcam.cameras.graph import GraphCamera as GraphCamera
# isort: on

MODELS: dict[str, type[Camera]] = {
    name: model
    for name, model in list(globals().items())
    if isinstance(model, type) and issubclass(model, Camera) and model is not Camera
}
"""Camera classes by name. A class of your own may be added: `mpcam.cameras.MODELS["Mine"] = Mine`."""


def snake_case(name: str) -> str:
    """The name of a model in scene files, and that of its stress module: "double_sphere" of "DoubleSphere"."""
    return "".join(f"_{letter.lower()}" if letter.isupper() else letter for letter in name).lstrip("_")


def is_registered(camera: Camera) -> bool:
    """Whether a camera's class is in the register, so that files can hold it."""
    return MODELS.get(type(camera).__name__) is type(camera)
