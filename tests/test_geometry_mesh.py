"""Meshes, materials, lights and scenes: checks on input, derived arrays, transforms, concatenation."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mpcam import DirectionalLight, InputError, Material, Mesh, PointLight, Scene

TETRA = Mesh(
    [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
    [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
)


def rotation(seed: int) -> np.ndarray:
    q, r = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else q[:, [1, 0, 2]]


def affine(linear, offset=(0, 0, 0)) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3] = linear
    matrix[:3, 3] = offset
    return matrix


def volume(mesh: Mesh) -> float:
    a, b, c = mesh.corners.transpose(1, 0, 2)
    return float((np.cross(a, b) * c).sum() / 6)


def test_lists_become_arrays_of_the_documented_types():
    assert TETRA.vertices.dtype == np.float64 and TETRA.vertices.shape == (4, 3)
    assert TETRA.faces.dtype == np.int32 and TETRA.faces.shape == (4, 3)
    assert TETRA.triangle_count == 4
    assert TETRA.corners.shape == (4, 3, 3)
    np.testing.assert_array_equal(TETRA.corners[1], [[0, 0, 0], [1, 0, 0], [0, 0, 1]])
    np.testing.assert_array_equal(TETRA.bounds, [[0, 0, 0], [1, 1, 1]])


def test_arrays_are_copies_that_cannot_be_written():
    points = np.zeros((3, 3))
    mesh = Mesh(points, np.array([[0, 1, 2]]))
    points[0] = 7
    assert mesh.vertices[0, 0] == 0
    with pytest.raises(ValueError):
        mesh.vertices[0, 0] = 1
    with pytest.raises(ValueError):
        mesh.faces[0, 0] = 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (dict(vertices=[[0, 0, 0]], faces=[[0, 0, 1]]), ["0 to 1", "there are 1"]),
        (dict(vertices=[[0, 0, 0]], faces=[[0, 0, -1]]), ["-1 to 0"]),
        (dict(vertices=[], faces=[[0, 0, 0]]), ["there are 0"]),
        (dict(vertices=[[0, 0, 0]], faces=[[0.0, 0.0, 0.0]]), ["float64", "integers"]),
        (dict(vertices=[[0, 0, 0]], faces=[[True, False, False]]), ["bool", "integers"]),
        (dict(vertices=[[0, 0, 0]], faces=[[0, 0, 0, 0]]), ["(1, 4)", "(F, 3)"]),
        (dict(vertices=[[0, 0, 0]], faces=[[0, 0, 0], [0]]), ["different lengths"]),
        (dict(vertices=[[0, 0]], faces=[]), ["(1, 2)", "(V, 3)"]),
        (dict(vertices=[["a", "b", "c"]], faces=[]), ["vertices", "numbers"]),
        (dict(vertices=[[0, 0, 0]], faces=[], uv=[[0, 0], [1, 1]]), ["uv has 2 rows", "vertices 1"]),
        (dict(vertices=[[0, 0, 0]], faces=[], colors=[[0, 0]]), ["colors", "(V, 3)"]),
        (dict(vertices=[[0, 0, 0]], faces=[[0, 0, 0]], face_material=[1]), ["materials 1 to 1"]),
        (dict(vertices=[[0, 0, 0]], faces=[[0, 0, 0]], face_material=[0, 0]), ["face_material", "(1,)"]),
        (dict(vertices=[[0, 0, 0]], faces=[[0, 0, 0]], materials=("red",)), ["Material"]),
    ],
)
def test_wrong_input_is_told_in_one_line(arguments, words):
    with pytest.raises(InputError) as caught:
        Mesh(**arguments)
    message = str(caught.value)
    assert "\n" not in message
    for word in words:
        assert word in message


def test_empty_and_broken_meshes_are_allowed():
    empty = Mesh([], [])
    assert empty.triangle_count == 0 and empty.corners.shape == (0, 3, 3)
    np.testing.assert_array_equal(empty.bounds, np.zeros((2, 3)))
    assert empty.smooth_normals().shape == (0, 3)
    assert empty.transformed(np.eye(4)).triangle_count == 0
    broken = Mesh([[np.nan, 0, 0], [np.inf, 1, 0], [1, 1, 2], [3, 0, 0]], [[0, 1, 2], [2, 2, 3]])
    np.testing.assert_array_equal(broken.bounds, [[1, 0, 0], [3, 1, 2]])
    np.testing.assert_array_equal(broken.face_normals, [[0, 0, 1], [0, 0, 1]])
    assert np.isfinite(broken.smooth_normals()).all()


@pytest.mark.parametrize("scale", [1e-160, 1e-8, 1.0, 1e8, 1e160])
def test_normals_at_every_scale(scale):
    mesh = TETRA.transformed(affine(np.eye(3) * scale))
    expected = np.array([[0, 0, -1], [0, -1, 0], [-1, 0, 0], [3**-0.5] * 3])
    np.testing.assert_allclose(mesh.face_normals, expected, atol=1e-15)
    # vertex 3 meets two faces of area 1/2 and one of area sqrt(3)/2
    summed = 0.5 * (expected[1] + expected[2]) + 3**0.5 / 2 * expected[3]
    expected_smooth = summed / np.linalg.norm(summed) if np.linalg.norm(summed) > 1e-12 else None
    assert expected_smooth is not None
    np.testing.assert_allclose(mesh.smooth_normals()[3], expected_smooth, atol=1e-14)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), mirror=st.booleans())
def test_transform_keeps_the_outside_outside(seed, mirror):
    rng = np.random.default_rng(seed)
    linear = rotation(seed) @ np.diag(rng.uniform(0.2, 5.0, 3)) @ rotation(seed + 1)
    if mirror:
        linear[:, 0] *= -1
    base = Mesh(TETRA.vertices, TETRA.faces, normals=TETRA.smooth_normals()).flat()
    moved = base.transformed(affine(linear, rng.uniform(-9, 9, 3)))
    assert volume(moved) == pytest.approx(volume(base) * abs(np.linalg.det(linear)), rel=1e-9)
    assert moved.normals is not None
    np.testing.assert_allclose(moved.normals.reshape(-1, 3, 3)[:, 0], moved.face_normals, atol=1e-9)


def test_transform_refuses_what_is_not_affine():
    perspective = np.eye(4)
    perspective[3, 2] = 1
    for matrix in (perspective, np.eye(3), np.full((4, 4), np.nan), "turn"):
        with pytest.raises(InputError, match="matrix"):
            TETRA.transformed(matrix)


def test_concatenation_keeps_order_attributes_and_materials():
    red, green = Material((1, 0, 0), name="red"), Material((0, 1, 0), name="green")
    first = Mesh(TETRA.vertices, TETRA.faces, materials=(red, green), face_material=[0, 1, 0, 1])
    second = Mesh(TETRA.vertices + 5, TETRA.faces, uv=np.ones((4, 2)), materials=(green,))
    both = Mesh.concatenate([first, second])
    np.testing.assert_array_equal(both.corners, np.concatenate([first.corners, second.corners]))
    assert [m.name for m in both.materials] == ["red", "green"]
    assert both.face_material is not None
    np.testing.assert_array_equal(both.face_material, [0, 1, 0, 1, 1, 1, 1, 1])
    assert both.uv is not None
    np.testing.assert_array_equal(both.uv, [[0, 0]] * 4 + [[1, 1]] * 4)
    assert both.normals is None and both.colors is None


def test_concatenation_does_not_smooth_what_was_flat():
    smooth = Mesh(TETRA.vertices, TETRA.faces, normals=TETRA.smooth_normals())
    both = Mesh.concatenate([TETRA, smooth])
    assert both.normals is not None
    assert len(both.vertices) == 2 * len(TETRA.vertices) and not both.normals[both.faces[:4]].any()
    np.testing.assert_array_equal(both.normals[both.faces[4:]], TETRA.smooth_normals()[TETRA.faces])
    assert Mesh.concatenate([]).triangle_count == 0
    with pytest.raises(InputError, match="concatenate"):
        Mesh.concatenate([TETRA, "mesh"])


def test_material_checks():
    assert Material().color == (0.8, 0.8, 0.8)
    texture = Material(texture=np.ones((2, 3, 3))).texture
    assert texture is not None and texture.dtype == np.float32
    for color in ((1, 2), (1, -1, 0), (np.nan, 0, 0), "red"):
        with pytest.raises(InputError, match="color"):
            Material(color)  # pyright: ignore[reportArgumentType]
    for texture in (np.zeros((2, 2, 3), np.uint8), np.zeros((2, 2)), np.zeros((0, 2, 3)), np.zeros((2, 2, 4))):
        with pytest.raises(InputError, match="texture"):
            Material(texture=texture)


def test_lights():
    light = DirectionalLight((0, 0, -3e-200), (1, 2, 3))
    assert light.direction == (0, 0, -1) and light.radiance == (1, 2, 3)
    assert PointLight((1, 2, 3)).intensity == (1, 1, 1)
    for make in (
        lambda: DirectionalLight((0, 0, 0)),
        lambda: DirectionalLight((0, 0, 1), (-1, 0, 0)),
        lambda: DirectionalLight((0, np.inf, 1)),
        lambda: PointLight((0, 0)),  # pyright: ignore[reportArgumentType]
        lambda: PointLight("here"),  # pyright: ignore[reportArgumentType]
    ):
        with pytest.raises(InputError, match="light"):
            make()


def test_scene_joins_its_meshes_once():
    light = DirectionalLight((0, 0, -1))
    scene = Scene((TETRA, TETRA.transformed(affine(np.eye(3), (5, 0, 0)))), lights=(light,))
    assert scene.mesh.triangle_count == 8
    assert scene.mesh is scene.mesh
    assert Scene.of(scene) is scene
    assert Scene.of(TETRA).meshes == (TETRA,)
    assert Scene.of([TETRA, TETRA]).mesh.triangle_count == 8
    assert Scene.of([]).mesh.triangle_count == 0


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda: Scene.of("cow"), "str"),
        (lambda: Scene.of([TETRA, 1]), "Mesh"),
        (lambda: Scene((TETRA,), lights=("sun",)), "DirectionalLight"),  # pyright: ignore[reportArgumentType]
        (lambda: Scene((TETRA,), ambient=(1, 2)), "ambient"),  # pyright: ignore[reportArgumentType]
        (lambda: Scene((TETRA,), background=(-1, 0, 0)), "background"),
    ],
)
def test_scene_refuses_other_things(make, word):
    with pytest.raises(InputError, match=word):
        make()
