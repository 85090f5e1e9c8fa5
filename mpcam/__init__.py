"""Cameras that are not pinholes: model them, rasterize through them, and measure what each model costs and gains.

Names load on first use: `import mpcam` alone loads NumPy and nothing heavier.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mpcam.cameras import Box as Box
    from mpcam.cameras import Domain as Domain
    from mpcam.cameras import Profile as Profile
    from mpcam.cameras import Projection as Projection
    from mpcam.cameras import Ray as Ray
    from mpcam.cameras import custom_profile as custom_profile
    from mpcam.cameras.graph_portals import Portal as Portal
    from mpcam.cameras.maze_plan import MazePlan as MazePlan
    from mpcam.cameras.registry import *  # noqa: F403
    from mpcam.comparison.driver import compare as compare
    from mpcam.comparison.table import Comparison as Comparison
    from mpcam.decomposition.chained import Chained as Chained
    from mpcam.decomposition.chaining import chained as chained
    from mpcam.decomposition.decompose import decompose as decompose
    from mpcam.decomposition.decompose import subdivided as subdivided
    from mpcam.decomposition.ray_error import RayError as RayError
    from mpcam.decomposition.ray_error import ray_error as ray_error
    from mpcam.decomposition.resolve import Resolver as Resolver
    from mpcam.decomposition.resolve import resolve as resolve
    from mpcam.depth_images.depth_image import DepthImage as DepthImage
    from mpcam.depth_images.intersections import Intersections as Intersections
    from mpcam.depth_images.layered import LayeredDepthImage as LayeredDepthImage
    from mpcam.depth_images.several import intersect as intersect
    from mpcam.effects.caustics import Caustics as Caustics
    from mpcam.effects.caustics import caustics as caustics
    from mpcam.effects.choose_camera import ChosenCamera as ChosenCamera
    from mpcam.effects.choose_camera import choose_occlusion_camera as choose_occlusion_camera
    from mpcam.effects.environment import EnvironmentMap as EnvironmentMap
    from mpcam.effects.horizon_occlusion import screen_occlusion as screen_occlusion
    from mpcam.effects.occlusion import ambient_occlusion as ambient_occlusion
    from mpcam.effects.occlusion import form_factor as form_factor
    from mpcam.effects.reflection import Reflection as Reflection
    from mpcam.effects.reflection import reflection as reflection
    from mpcam.effects.refraction import Refraction as Refraction
    from mpcam.effects.refraction import refraction as refraction
    from mpcam.effects.relief import Relief as Relief
    from mpcam.effects.relief_hits import ReliefHits as ReliefHits
    from mpcam.effects.relief_hits import relief_hits as relief_hits
    from mpcam.effects.relief_instances import ReliefInstances as ReliefInstances
    from mpcam.effects.relief_picture import ReliefPicture as ReliefPicture
    from mpcam.effects.shadows import ShadowMap as ShadowMap
    from mpcam.effects.shadows import shadow_map as shadow_map
    from mpcam.effects.traced_occlusion import traced_occlusion as traced_occlusion
    from mpcam.effects.visualization import Unrolled as Unrolled
    from mpcam.effects.visualization import surround as surround
    from mpcam.effects.visualization import unrolled as unrolled
    from mpcam.errors import InputError as InputError
    from mpcam.errors import SetupError as SetupError
    from mpcam.fitting.choose import choose_decomposition as choose_decomposition
    from mpcam.fitting.fit import fit as fit
    from mpcam.fitting.general_linear import GeneralLinearFit as GeneralLinearFit
    from mpcam.fitting.general_linear import fit_general_linear as fit_general_linear
    from mpcam.fitting.result import Fit as Fit
    from mpcam.geometry.builtin import builtin_mesh as builtin_mesh
    from mpcam.geometry.load import load_mesh as load_mesh
    from mpcam.geometry.mesh import Material as Material
    from mpcam.geometry.mesh import Mesh as Mesh
    from mpcam.geometry.surfaces import Surface as Surface
    from mpcam.io.calibration import read_calibration as read_calibration
    from mpcam.io.calibration import write_calibration as write_calibration
    from mpcam.io.fits import read_fit as read_fit
    from mpcam.io.fits import write_fit as write_fit
    from mpcam.io.images import read_camera as read_camera
    from mpcam.io.images import read_channels as read_channels
    from mpcam.io.images import read_image as read_image
    from mpcam.io.images import read_ray_map as read_ray_map
    from mpcam.io.images import write_image as write_image
    from mpcam.io.images import write_ray_map as write_ray_map
    from mpcam.io.scenes import load_scene as load_scene
    from mpcam.math.pose import look_at as look_at
    from mpcam.pictures.environment import environment_map as environment_map
    from mpcam.pictures.explain import explain as explain
    from mpcam.pictures.render import render as render
    from mpcam.rendering.explanation import Explanation as Explanation
    from mpcam.rendering.hits import Hits as Hits
    from mpcam.rendering.hits import interpolate as interpolate
    from mpcam.rendering.maps import CoverageMap as CoverageMap
    from mpcam.rendering.maps import DepthMap as DepthMap
    from mpcam.rendering.methods import coverage_map as coverage_map
    from mpcam.rendering.methods import depth_map as depth_map
    from mpcam.rendering.methods import prepare as prepare
    from mpcam.rendering.methods import rasterize as rasterize
    from mpcam.rendering.shade import shade as shade
    from mpcam.scene.builtin import builtin_scene as builtin_scene
    from mpcam.scene.mirror import Mirror as Mirror
    from mpcam.scene.occlusion import Occlusion as Occlusion
    from mpcam.scene.refractor import Refractor as Refractor
    from mpcam.scene.scene import DirectionalLight as DirectionalLight
    from mpcam.scene.scene import PointLight as PointLight
    from mpcam.scene.scene import Scene as Scene

__version__ = "0.1.0"

_HOMES = {
    "mpcam.cameras": "Box Camera Domain Profile Projection Ray custom_profile",
    "mpcam.cameras.maze_plan": "MazePlan",
    "mpcam.cameras.graph_portals": "Portal",
    "mpcam.comparison.driver": "compare",
    "mpcam.comparison.table": "Comparison",
    "mpcam.decomposition.chained": "Chained",
    "mpcam.decomposition.chaining": "chained",
    "mpcam.decomposition.decompose": "decompose subdivided",
    "mpcam.decomposition.ray_error": "RayError ray_error",
    "mpcam.decomposition.resolve": "Resolver resolve",
    "mpcam.depth_images.depth_image": "DepthImage",
    "mpcam.depth_images.intersections": "Intersections",
    "mpcam.depth_images.layered": "LayeredDepthImage",
    "mpcam.depth_images.several": "intersect",
    "mpcam.effects.caustics": "Caustics caustics",
    "mpcam.effects.choose_camera": "ChosenCamera choose_occlusion_camera",
    "mpcam.effects.environment": "EnvironmentMap",
    "mpcam.effects.horizon_occlusion": "screen_occlusion",
    "mpcam.effects.occlusion": "ambient_occlusion form_factor",
    "mpcam.effects.reflection": "Reflection reflection",
    "mpcam.effects.refraction": "Refraction refraction",
    "mpcam.effects.relief": "Relief",
    "mpcam.effects.relief_hits": "ReliefHits relief_hits",
    "mpcam.effects.relief_instances": "ReliefInstances",
    "mpcam.effects.relief_picture": "ReliefPicture",
    "mpcam.effects.shadows": "ShadowMap shadow_map",
    "mpcam.effects.traced_occlusion": "traced_occlusion",
    "mpcam.effects.visualization": "Unrolled surround unrolled",
    "mpcam.errors": "InputError SetupError",
    "mpcam.fitting.choose": "choose_decomposition",
    "mpcam.fitting.fit": "fit",
    "mpcam.fitting.general_linear": "GeneralLinearFit fit_general_linear",
    "mpcam.fitting.result": "Fit",
    "mpcam.geometry.builtin": "builtin_mesh",
    "mpcam.geometry.load": "load_mesh",
    "mpcam.geometry.mesh": "Material Mesh",
    "mpcam.geometry.surfaces": "Surface",
    "mpcam.io.calibration": "read_calibration write_calibration",
    "mpcam.io.fits": "read_fit write_fit",
    "mpcam.io.images": "read_camera read_channels read_image read_ray_map write_image write_ray_map",
    "mpcam.io.scenes": "load_scene",
    "mpcam.math.pose": "look_at",
    "mpcam.pictures.environment": "environment_map",
    "mpcam.pictures.explain": "explain",
    "mpcam.pictures.render": "render",
    "mpcam.rendering.explanation": "Explanation",
    "mpcam.rendering.hits": "Hits interpolate",
    "mpcam.rendering.maps": "CoverageMap DepthMap",
    "mpcam.rendering.methods": "coverage_map depth_map prepare rasterize",
    "mpcam.rendering.shade": "shade",
    "mpcam.scene.builtin": "builtin_scene",
    "mpcam.scene.mirror": "Mirror",
    "mpcam.scene.occlusion": "Occlusion",
    "mpcam.scene.refractor": "Refractor",
    "mpcam.scene.scene": "DirectionalLight PointLight Scene",
}
_HOME = {name: module for module, names in _HOMES.items() for name in names.split()}
_SUBPACKAGES = (
    "cameras",
    "comparison",
    "decomposition",
    "effects",
    "geometry",
    "io",
    "math",
    "pictures",
    "rendering",
    "scene",
    "stress",
    "truth",
)


def _models() -> dict[str, Any]:
    """The camera models, which the register names."""
    return import_module("mpcam.cameras.registry").MODELS


def __getattr__(name: str) -> Any:
    if name in _HOME:
        value = getattr(import_module(_HOME[name]), name)
        globals()[name] = value
        return value
    if name in _SUBPACKAGES:
        return import_module(f"mpcam.{name}")
    if name == "__all__":
        return sorted([*_HOME, *_models()])
    if name[:1].isupper() and name in _models():
        return _models()[name]
    raise AttributeError(f"module 'mpcam' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME, *_SUBPACKAGES, *_models()})
