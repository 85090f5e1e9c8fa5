"""The built-in meshes, made by formula: those of Gascuel et al. 2008 and Rosen et al. 2011, and plain shapes."""

from importlib import import_module
from typing import NamedTuple

from mpcam.checks import shown
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh


class _Recipe(NamedTuple):
    """Where a mesh is made, and how many triangles it may have."""

    module: str
    default: int
    fewest: int
    most: int


_RECIPES = {
    "facade": _Recipe("facade", 2_800, 600, 4_900),
    "temple": _Recipe("temple", 4_000, 2_200, 100_000),
    "characters": _Recipe("characters", 177_000, 25_000, 2_000_000),
    "patio": _Recipe("patio", 560_000, 60_000, 3_000_000),
    "sphere": _Recipe("plain", 1_280, 20, 1_310_720),
    "plane": _Recipe("plain", 2, 2, 2_000_000),
    "cube": _Recipe("plain", 12, 12, 1_200_000),
    "quad_room": _Recipe("plain", 12, 12, 1_200_000),
    "knot": _Recipe("knot", 20_000, 200, 2_000_000),
    "teapot": _Recipe("teapot", 20_000, 1_000, 2_000_000),
    "barrel": _Recipe("barrel", 5_000, 1_000, 1_000_000),
    "car": _Recipe("car", 12_000, 4_000, 1_000_000),
    "statue": _Recipe("statue", 60_000, 8_000, 1_000_000),
    "maze": _Recipe("maze", 20_000, 3_000, 1_000_000),
}


class BuiltinMesh:
    """Callable: `builtin_mesh(name, triangles=None) -> Mesh`; `builtin_mesh.names` lists the names."""

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(_RECIPES)

    def __call__(self, name: str, triangles: int | None = None) -> Mesh:
        """A mesh made by formula, the same every time. z is up, meters, around the origin.

        name: "facade" (a street, default 2,800 triangles of 600 to 4,900), "temple" (columns of long thin triangles,
        4,000 of 2,200 to 100,000), "characters" (people on a plain ground, 177,000 of 25,000 to 2,000,000), "patio"
        (a furnished courtyard, 560,000 of 60,000 to 3,000,000): stand-ins for the scenes of Gascuel et al. 2008,
        section 5.1, meant to be seen from (0, 0, 1.6). Or "sphere", "plane", "cube", "quad_room" (seen from inside).
        Or single things, closed all round, after those of Rosen et al. 2011: "knot" and "teapot" (20,000 triangles of
        200 or 1,000 to 2,000,000), "barrel" (5,000), "car" (12,000), "statue" (a dragon, 60,000), "maze" (20,000).
        triangles: the level of detail that comes nearest is made, within 4 %; the plain shapes only come in 20 * 4**k
        (sphere), 2 n**2 (plane) and 12 n**2. Raises InputError for other names and numbers.
        """
        recipe = _recipe(name)
        if triangles is None:
            triangles = recipe.default
        if isinstance(triangles, bool) or not hasattr(triangles, "__index__"):
            raise InputError(
                f"triangles={shown(triangles)}: give a whole number, or leave it out for {recipe.default:,}"
            )
        triangles = int(triangles)
        if not recipe.fewest <= triangles <= recipe.most:
            raise InputError(f"{name} has {recipe.fewest:,} to {recipe.most:,} triangles, not {triangles:,}")
        module = import_module(f"mpcam.geometry.{recipe.module}")
        return getattr(module, name)(triangles)

    def __repr__(self) -> str:
        return "builtin_mesh(name, triangles=None)"


builtin_mesh = BuiltinMesh()


def _recipe(name: str) -> _Recipe:
    recipe = _RECIPES.get(name) if isinstance(name, str) else None
    if recipe is None:
        raise InputError(f"there is no built-in mesh {shown(name)}: choose from {', '.join(_RECIPES)}")
    return recipe
