"""Camera models: ray, project and bound, each exact, one file per model; `registry` lists them."""

from mpcam.cameras.profiles import Profile as Profile
from mpcam.cameras.profiles import custom_profile as custom_profile
from mpcam.cameras.registry import *  # noqa: F403
from mpcam.cameras.types import Box as Box
from mpcam.cameras.types import Domain as Domain
from mpcam.cameras.types import Projection as Projection
from mpcam.cameras.types import Ray as Ray
