"""Two-pass rasterization (Yu et al. 2009, section 4): patches of samples, rendered again as small triangles."""

import functools
from typing import Any

import numpy as np

from mpcam.backend import aligned, exclusive, opaque_numbers, opaque_zero, types
from mpcam.cameras.base import Camera
from mpcam.cameras.linear_pieces import LinearPieces, linear_pieces
from mpcam.checks import whole_number
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.math import PI
from mpcam.rendering import patches
from mpcam.rendering.patches import LinearSampler, PointSampler
from mpcam.rendering.vertex import MOST_TRIANGLES, Subdivision, straight_test
from mpcam.rendering.z_buffer import ZBuffered

MOST_PAIRS = 1 << 22  # of pieces and triangles that are looked at together
_MARGIN = 1.0  # pixels around a piece


class TwoPass(ZBuffered):
    """Frames by patches of patch x patch samples a triangle.

    The first pass interpolates over each triangle what the projection of its corners consists of, and divides sample by
    sample; of general linear cameras these are the entries of two equations, of other cameras the point. Triangles are
    first cut where images run to infinity: in planes of slits and in z = 0. The second pass renders neighboring samples
    as small triangles with straight edges. Neighbors share samples along their edge, so there are no holes. Cameras of
    many pieces take all pairs of a piece and a triangle that may show there, together.
    """

    method = "two_pass"

    @exclusive
    def __init__(self, camera: Camera, mesh: Mesh, patch: int = 10):
        patch = whole_number("patch", patch, 2, 256, hint="each triangle is sampled at patch x patch places")
        self.patch, self.divisions = patch, patch - 1
        self.parts = Subdivision(self.divisions)
        super().__init__(camera, mesh)
        self.corners = self.faces  # of the whole triangles
        self.rows: list[Any] = []

    @exclusive
    def aim(self, camera: Camera) -> None:
        """Another camera, or another pose of it: the scene stays as it is."""
        super().aim(camera)
        self.many, self.areas, self.pieces = False, None, 1
        pieces = linear_pieces(camera)
        if pieces is not None:
            self._aim_pieces(camera, pieces)
        else:
            wide = camera.domain.max_angle
            half = camera.ray_geometry == "central" and camera.domain.image_radius is None
            half = half and wide is not None and wide <= 0.5 * PI
            unbounded = camera.domain.image_radius is None
            self.sampler = _point_sampler(type(camera), half, unbounded)
        self._place_camera()

    def _aim_pieces(self, camera: Any, pieces: LinearPieces) -> None:
        """What is the same for all poses of a camera of general linear pieces."""
        self.pieces = pieces.count
        self.many = self.pieces > 1
        self.sampler = _linear_sampler(self.many)
        if not self.many:
            return
        self.test = "piece_triangle"
        kept = self.device_camera.kept  # the same for every pose
        if "pieces" not in kept:
            x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
            owner = camera.locate(x.ravel(), y.ravel()).astype(np.int64)
            ends = _areas(owner, x.ravel(), y.ravel(), self.pieces)
            areas = [_uploaded(side) for side in ends]
            kept["pieces"] = _named(self.samples, owner, camera.width, camera.height), areas
        self.samples, self.areas = kept["pieces"]

    def _reframed(self) -> None:
        super()._reframed()
        self._place_camera()

    def _place_camera(self) -> None:
        """What the sampler reads: frames of pieces from device vertices, put together in float64, or the camera."""
        pieces, device = linear_pieces(self.camera), self.device
        if pieces is None:
            self.data = (self.device_camera.on_device, self.pose, self.unit)
            return
        pose = np.asarray(self.camera.camera_from_world, np.float64)
        turn = np.stack(np.broadcast_arrays(*pieces.turn)).reshape(3, 3, -1)
        shift = np.stack(np.broadcast_arrays(*pieces.shift)).reshape(3, -1)
        middle = pose[:3, :3] @ device.anchor + pose[:3, 3]
        moved = np.einsum("ijn,j->in", turn, middle) + shift
        turned = device.scale * np.einsum("ijn,jk->ikn", turn, pose[:3, :3])
        linear = np.stack(np.broadcast_arrays(*pieces.linear)).reshape(12, -1)
        tables = np.concatenate([turned.reshape(9, -1), moved, linear])
        if self.many:
            numbers = [_uploaded(row) for row in tables]
        else:
            numbers = opaque_numbers(tables[:, 0].tolist())
        self.data = (numbers, self.unit)

    def test_for(self, camera: Camera) -> str:
        return "screen_triangle" if linear_pieces(camera) is not None else straight_test(camera, self.method)

    def place(self, vertices: Any) -> list[Any]:
        import drjit as dr

        from mpcam_kernels.threads import threads

        t, triangles, points = types(), self.mesh.triangle_count, self.parts.points
        whole, cut = self._sorted_out(vertices)
        parts = self._parts(cut, vertices)
        count = dr.width(whole) + dr.width(parts)
        if count * self.parts.count > MOST_TRIANGLES:
            raise InputError(
                f"patch={self.patch} makes {count * self.parts.count} small triangles of {triangles}: at most "
                f"{MOST_TRIANGLES}"
            )
        if count == 0:
            self.faces, self.rows = t.UInt(), []
            return [t.Float()]
        rows = [dr.empty(t.Float, 4 * count) for _ in range(3 * self.sampler.rows + 2)]
        start = 0
        for pairs, chosen in ((whole, None), (cut, parts)):
            lanes = dr.width(pairs if chosen is None else chosen)
            if lanes:
                set_up = _frozen_set_up(self.sampler, triangles)
                data = (rows, self.data, vertices, self.corners)
                rows = set_up(threads(t, 0, lanes), pairs, chosen, opaque_whole(start), *data)
                start += lanes
        target = dr.empty(t.Float, 4 * points * count)
        sample = _frozen_sample(self.sampler, self.divisions)
        target = sample(threads(t, 0, points * count), target, self.parts.grid, rows, self.data)
        self.faces, self.rows = self._small(count), rows
        return [target]

    def _sorted_out(self, vertices: Any) -> tuple[Any, Any]:
        """Pairs of pieces and triangles, numbered piece * triangles + triangle: those to sample, and those to cut."""
        import drjit as dr

        from mpcam_kernels.threads import threads

        triangles, t = self.mesh.triangle_count, types()
        sort = _frozen_sort(self.sampler, triangles)
        total = self.pieces * triangles
        found: tuple[list[Any], list[Any]] = ([], [])
        for start in range(0, total, MOST_PAIRS):
            numbers = threads(t, start, min(start + MOST_PAIRS, total))
            code = sort(numbers, self.data, self.areas, vertices, self.corners)
            for kind in (1, 2):
                some = t.UInt(dr.compress(code == kind))
                if dr.width(some):
                    found[kind - 1].append(some + start)
        whole, cut = (t.UInt() if not parts else parts[0] if len(parts) == 1 else dr.concat(parts) for parts in found)
        dr.eval(whole, cut)
        return whole, cut

    def _parts(self, cut: Any, vertices: Any) -> Any:
        """Numbers of the parts of pairs that are cut, of those that are there."""
        import drjit as dr

        from mpcam_kernels.threads import threads

        t = types()
        lanes = dr.width(cut) * patches.most_parts(self.sampler)
        if lanes == 0:
            return t.UInt()
        there, scene = _frozen_parts(self.sampler, self.mesh.triangle_count), (vertices, self.corners)
        parts = t.UInt(dr.compress(there(threads(t, 0, lanes), None, cut, self.data, None, *scene)))
        if self.areas is not None and dr.width(parts):
            shown = there(threads(t, 0, dr.width(parts)), parts, cut, self.data, self.areas, *scene)
            shown = t.UInt(dr.compress(shown))
            parts = dr.gather(t.UInt, parts, shown) if dr.width(shown) else t.UInt()
        dr.eval(parts)
        return parts

    def _small(self, count: int) -> Any:
        """Corners of the small triangles of so many patches; as long as their number stays, the same ones."""
        known = getattr(self, "_known", None)
        if known is None or known[0] != count:
            self._known = known = (count, self._faces(count))
        return known[1]

    def _faces(self, count: int) -> Any:
        import drjit as dr

        if self.parts.count > 1:
            return self.parts.faces(None, count)
        faces = dr.arange(types().UInt, 3 * count)
        dr.eval(faces)
        return faces

    def parent(self, triangle: Any) -> Any:
        import drjit as dr

        t = types()
        if not self.rows:
            return triangle
        patch = t.UInt(dr.maximum(triangle, 0)) // self.parts.count
        name = dr.reinterpret_array(t.UInt, dr.gather(t.Array4f, self.rows[-1], patch).w)
        parent = dr.select(triangle >= 0, t.Int(name), -1)
        dr.eval(parent)
        return parent

    def parent_weights(self, triangle: Any, second: Any, third: Any) -> tuple[Any, Any]:
        import drjit as dr

        t = types()
        if not self.rows:
            return second, third
        second, third = self.parts.parent_weights(triangle, second, third)
        patch = t.UInt(dr.maximum(triangle, 0)) // self.parts.count
        first = 1.0 - second - third
        a, b = (dr.gather(t.Array4f, row, patch) for row in self.rows[-2:])
        mixed = (first * a.x + second * a.z + third * b.x, first * a.y + second * a.w + third * b.y)
        return tuple(dr.select(triangle >= 0, dr.clip(part, 0, 1), 0.0) for part in mixed)  # pyright: ignore[reportReturnType]


def _named(planar: Any, owner: np.ndarray, width: int, height: int) -> Any:
    """Samples of the image plane that carry the piece of their pixel, given row by row."""
    import drjit as dr

    from mpcam_kernels import samples

    t = types()
    column, row, exists = samples.pixel_of(t, dr.arange(t.UInt, dr.width(planar.pixels)), width, height)
    name = dr.gather(t.Float, _uploaded(owner), row * width + column, exists)
    pixels = t.Array3f(planar.pixels.x, planar.pixels.y, name)
    dr.eval(pixels)
    return samples.Samples(pixels, planar.coarse, planar.parts)


def _uploaded(table: np.ndarray) -> Any:
    """A table (N,) in Dr.Jit's own memory, as frozen kernels want it."""
    return types().Float(aligned(table)) + opaque_zero()


def opaque_whole(number: int) -> Any:
    """A whole number on the device, so that kernels do not change when it does."""
    import drjit as dr

    found = types().UInt(number)
    dr.make_opaque(found)
    return found


def _areas(owner: np.ndarray, x: np.ndarray, y: np.ndarray, count: int) -> list[np.ndarray]:
    """Left, top, right and bottom of the pixels of each piece, and a margin; nothing where it has none."""
    ends = []
    for values, fold, worst, margin in (
        (x, np.minimum, np.inf, -_MARGIN),
        (y, np.minimum, np.inf, -_MARGIN),
        (x, np.maximum, -np.inf, _MARGIN),
        (y, np.maximum, -np.inf, _MARGIN),
    ):
        table, owned = np.full(count, worst), owner >= 0
        fold.at(table, owner[owned], values[owned])
        ends.append(table + margin)
    return ends


@functools.cache
def _linear_sampler(many: bool) -> LinearSampler:
    return LinearSampler(many)


@functools.cache
def _point_sampler(model: type[Camera], half: bool, unbounded: bool) -> PointSampler:
    return PointSampler(model, half, unbounded)


@functools.cache
def _frozen_sort(sampler: Any, triangles: int) -> Any:
    from mpcam_kernels.frozen import frozen

    @frozen
    def sort(pair: Any, data: Any, areas: Any, vertices: Any, faces: Any) -> Any:
        return patches.sorted_out(sampler, pair, data, areas, vertices, faces, triangles)

    return sort


@functools.cache
def _frozen_parts(sampler: Any, triangles: int) -> Any:
    from mpcam_kernels.frozen import frozen

    @frozen
    def there(item: Any, parts: Any, pairs: Any, data: Any, areas: Any, vertices: Any, faces: Any) -> Any:
        return patches.parts_of(sampler, item, parts, pairs, data, areas, vertices, faces, triangles)

    return there


@functools.cache
def _frozen_set_up(sampler: Any, triangles: int) -> Any:
    from mpcam_kernels.frozen import frozen

    @frozen
    def set_up(
        item: Any, pairs: Any, parts: Any, start: Any, rows: list[Any], data: Any, vertices: Any, faces: Any
    ) -> Any:
        return patches.set_up(sampler, item, pairs, parts, start, rows, data, vertices, faces, triangles)

    return set_up


@functools.cache
def _frozen_sample(sampler: Any, divisions: int) -> Any:
    from mpcam_kernels.frozen import frozen

    @frozen
    def sample(number: Any, target: Any, grid: Any, rows: list[Any], data: Any) -> Any:
        return patches.sampled(sampler, number, target, grid, rows, data, divisions)

    return sample
