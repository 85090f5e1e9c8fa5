"""Camera models: ray, project and bound, each exact, one file per model."""

from mpcam.cameras.base import Camera as Camera
from mpcam.cameras.brown_conrady import BrownConrady as BrownConrady
from mpcam.cameras.camera_triangles import CameraTriangles as CameraTriangles
from mpcam.cameras.double_sphere import DoubleSphere as DoubleSphere
from mpcam.cameras.kannala_brandt import KannalaBrandt as KannalaBrandt
from mpcam.cameras.orthographic import Orthographic as Orthographic
from mpcam.cameras.pinhole import Pinhole as Pinhole
from mpcam.cameras.pose import look_at as look_at
from mpcam.cameras.profiles import Profile as Profile
from mpcam.cameras.profiles import custom_profile as custom_profile
from mpcam.cameras.radial import Radial as Radial
from mpcam.cameras.types import Box as Box
from mpcam.cameras.types import Domain as Domain
from mpcam.cameras.types import Projection as Projection
from mpcam.cameras.types import Ray as Ray
from mpcam.cameras.unified_omni import UnifiedOmni as UnifiedOmni
