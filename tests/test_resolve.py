"""Resolving: the eye's picture of a reflector from the atlas of its camera triangles."""

import numpy as np
import pytest

import mpcam as mp
from mpcam.decomposition.decompose import decompose, directions_at_vertices
from mpcam.decomposition.resolve import Resolver, resolve, texel_weights
from mpcam.errors import InputError
from mpcam.geometry.surfaces import Surface

EYE = np.array([3.0, 1.0, 2.5])
SHAPES = {"sphere": Surface.sphere(), "torus": Surface.torus(1.0, 0.4), "bowl": Surface.paraboloid(1.0, 0.3)}


def camera(size: int = 96, focal: float = 1.1) -> mp.Pinhole:
    half = size / 2
    return mp.Pinhole(size, size, focal * size, focal * size, half, half, camera_from_world=mp.look_at(EYE, (0, 0, 0)))


def rays(cams):
    v, u = np.mgrid[: cams.height, : cams.width]
    return cams.ray(np.stack([u + 0.5, v + 0.5], axis=-1))


def colored(cams) -> np.ndarray:
    """Each texel has its ray's direction as its color; the gutter holds NaN."""
    found = rays(cams)
    return np.where(found.valid[..., None], found.direction, np.nan)


@pytest.mark.parametrize("name", SHAPES)
def test_directions_converge_to_those_of_the_mirror(name):
    eye, errors = camera(), []
    for triangles, side in ((104, 16), (416, 16)):
        cams = decompose(SHAPES[name], eye, triangles, resolution=side)
        one = Resolver(cams, SHAPES[name], eye)
        picture = one(colored(cams))
        assert np.isfinite(picture).all()
        errors.append(np.sqrt((np.linalg.norm(picture - one.direction, axis=-1)[one.mask] ** 2).mean()))
    assert errors[1] < 0.4 * errors[0]
    assert errors[1] < 0.04


def test_true_directions_are_those_of_a_sphere():
    """Against the reflection at the exact hit of each pixel's ray with the unit sphere."""
    eye = camera()
    one = Resolver(decompose(SHAPES["sphere"], eye, 26), SHAPES["sphere"], eye)
    v, u = np.mgrid[: eye.height, : eye.width]
    d = eye.ray(np.stack([u + 0.5, v + 0.5], axis=-1)).direction
    across = d @ EYE
    inner = across**2 - EYE @ EYE + 1
    hit = inner > 0.02  # away from the outline, where mesh and sphere differ
    x = EYE + (-across - np.sqrt(np.maximum(inner, 0)))[..., None] * d
    true = d - 2 * (d * x).sum(-1, keepdims=True) * x
    assert (one.mask >= hit).all() and one.mask.sum() < (inner > -0.02).sum()
    assert np.abs(one.points - x)[hit].max() < 5e-3
    assert np.abs(np.linalg.norm(one.points[one.mask], axis=-1) - 1).max() < 1e-12
    assert np.linalg.norm(one.direction - true, axis=-1)[hit].max() < 2e-2
    assert (one.direction[~one.mask] == 0).all() and (one.triangle[~one.mask] == -1).all()


def test_linear_colors_are_met_exactly():
    """Weights of the corners are linear over each triangle: both rules of interpolation give them back."""
    eye = camera(64)
    cams = decompose(SHAPES["sphere"], eye, 26, resolution=7)
    v, u = np.mgrid[: cams.height, : cams.width]
    face, second, third, inside = cams.atlas.locate(u + 0.5, v + 0.5)
    image = np.where(inside[..., None], np.stack([face, second, third], axis=-1), np.nan)
    one = Resolver(cams, SHAPES["sphere"], eye)
    found = one(image, background=(-1, 0, 0))
    assert np.allclose(found[..., 0], one.triangle, atol=1e-4)  # no other triangle, no gutter
    place = one._place
    assert np.abs(found[one.mask][:, 1] - place.second).max() < 1e-5
    assert np.abs(found[one.mask][:, 2] - place.third).max() < 1e-5


@pytest.mark.parametrize("filter", ["linear", "nearest"])
@pytest.mark.parametrize("side", [2, 3, 4, 9])
def test_texels_never_leave_their_triangle(filter, side):
    weights = np.random.default_rng(0).dirichlet((0.3, 0.3, 0.3), 20_000)
    weights = np.concatenate([weights, np.eye(3), [[0, 0.5, 0.5], [0.5, 0.5, 0], [0.5, 0, 0.5], [1 / 3, 1 / 3, 1 / 3]]])
    second, third = weights[:, 1], weights[:, 2]
    column, row, more = texel_weights(second, third, np.full(len(weights), side), filter)
    last = side - 1
    assert (column >= 0).all() and (row >= 0).all() and (column + row <= last).all()
    if filter == "nearest":
        gap = np.hypot(column - second * last, row - third * last)
        assert gap.max() <= np.sqrt(0.5) + 1e-9
        return
    right, down, both = more
    assert min(part.min() for part in more) >= 0 and (right + down + both).max() <= 1
    assert (column + row)[(right > 0) | (down > 0)].max() < last
    assert both[column + row + 2 > last].max(initial=0.0) == 0
    assert np.allclose(column + right + both, second * last, atol=1e-9)
    assert np.allclose(row + down + both, third * last, atol=1e-9)


def test_nearest_takes_texels_as_they_are():
    eye = camera(64)
    cams = decompose(SHAPES["torus"], eye, 60, resolution=6)
    image = np.full((cams.height, cams.width, 2), np.nan)
    v, u = np.mgrid[: cams.height, : cams.width]
    face, _, _, inside = cams.atlas.locate(u + 0.5, v + 0.5)
    image[inside] = np.stack([face, u + cams.width * v], axis=-1)[inside]
    one = Resolver(cams, SHAPES["torus"], eye, filter="nearest")
    found = one(image, background=-1)
    assert np.array_equal(found[..., 0], one.triangle)
    assert np.array_equal(found[..., 1], np.rint(found[..., 1]))


def test_channels_backgrounds_and_repeated_frames():
    eye = camera(48)
    cams = decompose(SHAPES["sphere"], eye, 26, resolution=8)
    one = Resolver(cams, SHAPES["sphere"], eye)
    random = np.random.default_rng(1)
    for channels in (1, 3, 4, 7):
        image = random.uniform(size=(cams.height, cams.width, channels))
        number, several, picture = 0.25, random.uniform(size=channels), random.uniform(size=(48, 48, channels))
        for background in (number, several, picture):
            found = one(image, background)
            assert found.shape == (48, 48, channels) and found.dtype == np.float32
            expected = np.broadcast_to(background, found.shape)
            assert np.allclose(found[~one.mask], expected[~one.mask], atol=1e-7)
            assert np.array_equal(found[one.mask], one(image)[one.mask])
    assert np.array_equal(found, resolve(cams, image, SHAPES["sphere"], eye, picture))


def test_other_cameras_at_the_same_eye():
    """A fisheye and a pinhole at one point see the same reflections."""
    cams = decompose(SHAPES["sphere"], EYE, 416, resolution=16)
    image = colored(cams)
    pose = mp.look_at(EYE, (0, 0, 0))
    for eye in (mp.Radial.equidistant(80, 80, camera_from_world=pose), camera(80, 0.8)):
        one = Resolver(cams, SHAPES["sphere"], eye)
        assert one.mask.sum() > 100
        assert np.percentile(np.linalg.norm(one(image) - one.direction, axis=-1)[one.mask], 95) < 0.02


def test_direct_and_refracting_camera_triangles():
    eye = camera(64)
    cams = decompose(SHAPES["bowl"], eye, 200, resolution=16)
    direct = directions_at_vertices(cams)
    one, other = Resolver(cams, SHAPES["bowl"], eye), Resolver(direct, SHAPES["bowl"], eye)
    assert np.array_equal(one.triangle, other.triangle)
    assert np.percentile(np.abs(other(colored(direct)) - other.direction)[other.mask], 99) < 5e-3
    glass = decompose(SHAPES["sphere"], eye, 200, resolution=16, index=1.5)
    lens = Resolver(glass, SHAPES["sphere"], eye)
    assert np.percentile(np.linalg.norm(lens(colored(glass)) - lens.direction, axis=-1)[lens.mask], 95) < 0.02


def test_a_camera_that_does_not_see_the_reflector_has_the_background():
    cams = decompose(SHAPES["sphere"], EYE, 26, resolution=8)
    away = mp.Pinhole(16, 16, 16, 16, 8, 8, camera_from_world=mp.look_at(EYE, 2 * EYE))
    one = Resolver(cams, SHAPES["sphere"], away)
    assert not one.mask.any()
    assert (one(colored(cams), 0.5) == 0.5).all()


def test_what_cannot_be_resolved_is_refused():
    eye = camera(32)
    cams = decompose(SHAPES["sphere"], eye, 26, resolution=8)
    image = np.zeros((cams.height, cams.width, 3))
    elsewhere = mp.Pinhole(32, 32, 32, 32, 16, 16, camera_from_world=mp.look_at((0, 0, 5), (0, 0, 0)))
    for arguments, words in (
        (("cams", image, SHAPES["sphere"], eye), "CameraTriangles"),
        ((cams, image, "ball", eye), "Mesh or a Surface"),
        ((cams, image, SHAPES["sphere"], "eye"), "cameras"),
        ((cams, image, SHAPES["sphere"], elsewhere), "decompose anew"),
        ((cams, image, SHAPES["sphere"], mp.Orthographic(8, 8, 4.0)), "no common center"),
        ((cams, image[1:], SHAPES["sphere"], eye), "atlas image has shape"),
        ((cams, image[..., 0], SHAPES["sphere"], eye), "atlas image has shape"),
        ((cams, "image", SHAPES["sphere"], eye), "numbers"),
        ((cams, image, SHAPES["sphere"], eye, (1, 2)), "background"),
        ((cams, image, SHAPES["sphere"], eye, np.zeros((4, 4, 3))), "background"),
        ((cams, image, SHAPES["sphere"], eye, 0, "cubic"), "linear, nearest"),
    ):
        with pytest.raises(InputError, match=words):
            resolve(*arguments)
