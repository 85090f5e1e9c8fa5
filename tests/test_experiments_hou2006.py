"""The experiments of Hou et al. 2006 in their quick form: scenes as the paper has them, rows, and figures that fit."""

import numpy as np
import pytest
from test_experiments import quick

import mpcam as mp
from mpcam.experiments import hou2006_fig6, hou2006_paper, hou2006_solids
from mpcam.experiments.hou2006_scenes import SHAPES, caustics_scene, light_of, reflection_scene, refraction_scene, sky
from mpcam.experiments.hou2006_teapot import TeapotScene, teapot

# The scenes


def mirror_of(scene: mp.Scene) -> mp.Mirror:
    assert scene.mirror is not None
    return scene.mirror


def test_the_scenes_have_the_papers_triangles():
    made = {"reflection": reflection_scene(), "refraction": refraction_scene(), "caustics": caustics_scene()}
    wanted = {name: row.scene_triangles for (name, _), row in hou2006_paper.TABLE_1.items() if name in made}
    assert {name: scene.mesh.triangle_count for name, scene in made.items()} == wanted
    assert reflection_scene(fine=True).mesh.triangle_count == pytest.approx(20_000, rel=0.01)
    for triangles in (40, 400, 1600):
        assert TeapotScene(triangles).scene.mesh.triangle_count == triangles
    assert light_of(made["caustics"]) in made["caustics"].lights


@pytest.mark.parametrize("shape", SHAPES)
def test_nothing_stands_before_the_mirror_and_much_is_seen_in_it(shape):
    scene = reflection_scene(shape, width=80, height=60)
    seen = mp.Reflection(scene, method="raytrace")
    depth = np.asarray(seen.direct.frame().depth)
    distance = seen.rays.distance.reshape(depth.shape)
    before = (depth < distance) & seen.mask
    assert before.sum() < 0.03 * seen.mask.sum()
    hits = seen.part.prepared.frame()  # pyright: ignore[reportAttributeAccessIssue]
    # Solids, not only the floor, whose faces are the first two.
    assert ((hits.triangle >= 2) & seen.mask).sum() > 0.08 * seen.mask.sum()


def test_the_mirrors_are_bent_as_their_names_say():
    for shape, sign in (("convex", -1), ("concave", 1)):
        mirror = mirror_of(reflection_scene(shape))
        u = np.full(9, 0.25)
        x = np.linspace(0, 1, 9)
        place = mirror.surface.point(u, x) - mirror.surface.point(0.0, 0.0)
        # Towards the eye, at -y, at its rim: hollow.
        assert np.sign(place[-1] @ mirror.surface.normal(0.0, 0.0)) == sign


@pytest.mark.parametrize("name", ["box", "octahedron", "ball", "prism", "cone"])
@pytest.mark.parametrize("soft", [0.0, 0.7])
def test_solids_face_outwards(name, soft):
    make = getattr(hou2006_solids, name)
    solid = make(6) if name in ("prism", "cone") else make()
    part = hou2006_solids.placed(solid, (1.0, 2.0, 3.0), (1.0, 2.0, 0.5), 0.3, 3, soft)
    corners = part.vertices[part.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outward = corners.mean(1) - (1.0, 2.0, 3.0)
    assert part.count == 9 * len(solid[1])
    assert ((normals * outward).sum(-1) > 0).all()
    assert ((part.normals[part.faces] * normals[:, None]).sum(-1) > 0).all()
    np.testing.assert_allclose(np.linalg.norm(part.normals, axis=1), 1, atol=1e-9)


def test_the_table_stands_still_and_all_else_moves():
    whole = TeapotScene(400)
    first, later = whole.vertices(0.0), whole.vertices(1.0)
    np.testing.assert_array_equal(first, whole.scene.mesh.vertices)
    moved = np.linalg.norm(later - first, axis=1)
    assert (moved[:12] == 0).all() and (moved[12:] > 0).all()
    faces = whole.scene.mesh.faces
    sides = [np.linalg.norm(v[faces[:, 0]] - v[faces[:, 1]], axis=1) for v in (first, later)]
    np.testing.assert_allclose(*sides, rtol=1e-9)
    for triangles in (20, 410):
        with pytest.raises(mp.InputError, match="multiple of 20"):
            TeapotScene(triangles)


def test_the_teapot_is_smooth_and_faces_outwards():
    mesh = teapot(24)
    flat, normals = mesh.face_normals, mesh.normals
    assert normals is not None
    assert ((normals[mesh.faces].mean(1) * flat).sum(-1) > 0).mean() > 0.98


def test_wrong_names_are_refused():
    with pytest.raises(mp.InputError, match="mixed, convex, concave"):
        reflection_scene("flat")
    with pytest.raises(mp.InputError, match="PointLight"):
        light_of(reflection_scene())


def test_the_sky_has_no_seam():
    ways = [[np.cos(a), np.sin(a), 0.4] for a in (np.pi - 1e-3, -np.pi + 1e-3)]
    np.testing.assert_allclose(*sky().lookup(ways), atol=0.03)


# The experiments


def test_table1(tmp_path):
    report = quick("hou2006-table1", tmp_path)
    rows = report.table("overdraw").rows
    assert len(rows) == 3 * (len(hou2006_paper.TABLE_1) - 1)
    for row in rows:
        assert row["wrong_percent"] <= 0.1
        assert row["overdraw"] == pytest.approx(row["tests_k"] / row["rendered_k"])
        assert row["paper_camera_triangles"] * 0.9 <= row["camera_triangles"] <= row["paper_camera_triangles"]
    for name, camera_triangles in set(hou2006_paper.TABLE_1) - {("reflection", 416)}:
        mine = [r for r in rows if (r["scene"], r["paper_camera_triangles"]) == (name, camera_triangles)]
        assert [row["bound"] for row in mine] == ["tight", "nine_point", "triangle"]
        # Whatever is tested, the same is rendered; and the box lies within the triangle of the same points, nearly.
        assert len({row["rendered_k"] for row in mine}) == 1
        assert mine[1]["tests_k"] <= 1.05 * mine[2]["tests_k"]
    first = report.table("times").row(scene="reflection", bound="tight")
    assert first["moving_ratio"] == pytest.approx(first["moving_ms"] / first["trace_moving_ms"])


def test_the_papers_table_adds_up():
    printed = {"reflection": (32, 15, 12), "refraction": (23,), "caustics": (2,), "visualization": (1,)}
    for name, values in printed.items():
        found = [row.overdraw for (scene, _), row in hou2006_paper.TABLE_1.items() if scene == name]
        np.testing.assert_allclose(found, values, atol=0.55)


def test_fig6(tmp_path):
    report = quick("hou2006-fig6", tmp_path)
    rows = report.table("quality").rows
    for shape in SHAPES:
        mine = [row for row in rows if row["mirror"] == shape]
        cams = [row for row in mine if row["method"] == "camera triangles"]
        worst_environment = min(row["flip"] for row in mine if row["method"] == "environment map")
        assert mine[0]["flip"] == 0 and len(cams) == 3
        assert all(0 < row["flip"] < worst_environment for row in cams)
        edges, errors = ([row[name] for row in cams] for name in ("edge", "ray_rms"))
        assert edges == sorted(edges, reverse=True) and errors[-1] < errors[0]
        assert any(row["moving_front"] for row in mine)
        straight, halved = (row["flip"] for row in mine if row["method"] == "vertices")
        assert cams[-1]["flip"] < halved < straight


def test_ray_errors_fall_with_the_square_of_the_edge():
    scene = reflection_scene("convex")
    surface = mirror_of(scene).surface
    cams = [mp.decompose(surface, scene.camera, number) for number in (26, 104, 416)]
    edge = np.log([hou2006_fig6.edge_length(one) for one in cams])
    error = np.log([mp.ray_error(one, surface, scene.camera).rms for one in cams])
    assert np.polyfit(edge, error, 1)[0] == pytest.approx(2, abs=0.3)


def test_fig7(tmp_path):
    report = quick("hou2006-fig7", tmp_path)
    rows = report.table("speedup").rows
    assert [row["scene_triangles"] for row in rows] == [400, 800]
    assert rows[1]["paper_speedup"] == pytest.approx(20.1 / 4.5)
    for row in rows:
        assert row["wrong_percent"] <= 0.1
        assert row["tight_speedup"] == pytest.approx(row["tight_none_ms"] / row["tight_both_ms"])
        assert all(row[f"{bound}_{name}_ms"] > 0 for bound in ("tight", "triangle") for name in ("none", "objects"))
