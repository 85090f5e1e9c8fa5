"""The test kit notices: cameras that break one promise each, and the check that says so."""

import kit
import numpy as np
import pytest
from catalog import POSE

import mpcam as mp
from mpcam.cameras.outline import small_outline
from mpcam.math import detach


class Shifted(mp.Pinhole):
    """Its images are a thousandth of a pixel off."""

    def local_project(self, point):
        (image,) = super().local_project(point)
        return (image._replace(pixel=image.pixel + 1e-3),)


class Long(mp.Pinhole):
    """Its directions are not of length 1."""

    def local_ray(self, pixel):
        ray = super().local_ray(pixel)
        return ray._replace(direction=1.001 * ray.direction)


class Narrow(mp.Pinhole):
    """Its boxes leave a part out, and so do the outlines in the kernels."""

    def local_bound(self, a, b, c):
        box = super().local_bound(a, b, c)
        return box._replace(high=0.5 * (box.low + box.high))

    def local_outline(self, points, views):
        return small_outline((self.cx + 9.0, self.cy), (self.fx, self.fy), points, views)


class Bound(mp.Pinhole):
    """Its rays know where in the world it is."""

    def local_ray(self, pixel):
        where = np.asarray(self.camera_from_world)[0, 3]
        return super().local_ray((pixel[0] + where, pixel[1]))


class Rough(mp.Pinhole):
    """Its rays are worked out with large numbers."""

    def local_ray(self, pixel):
        return super().local_ray(((pixel[0] + 1e5) - 1e5, pixel[1]))


class Stopped(mp.Pinhole):
    """No derivative in the focal length."""

    def local_ray(self, pixel):
        return mp.Pinhole(self.width, self.height, detach(self.fx), self.fy, self.cx, self.cy).local_ray(pixel)


class Half(mp.Pinhole):
    """What its constructor derives is lost where JAX puts it together."""

    def __post_init__(self):
        super().__post_init__()
        object.__setattr__(self, "middle", 0.5 * self.width)

    def local_ray(self, pixel):
        return super().local_ray((pixel[0] - vars(self)["middle"] + self.cx, pixel[1]))


BROKEN = [
    (kit.rays_are_rays, Long),
    (kit.points_on_rays_come_back, Shifted),
    (kit.images_lie_on_their_rays, Shifted),
    (kit.boxes_hold_their_triangles, Narrow),
    (kit.moving_everything_changes_nothing, Bound),
    (kit.float32_agrees, Rough),
    (kit.gradients_match_differences, Stopped),
    (kit.is_a_pytree, Half),
    (kit.hits_are_those_of_brute_force, Narrow),
    (kit.hits_are_those_of_embree, Narrow),
]


def test_every_check_is_tried():
    assert [check for check, _ in BROKEN] == [check.run for check in kit.CHECKS]


@pytest.mark.parametrize(("check", "model"), BROKEN)
def test_a_broken_promise_is_noticed(check, model):
    with pytest.raises((AssertionError, KeyError)):
        check(model(64, 48, camera_from_world=POSE))


def test_files_that_lose_a_number_are_noticed(tmp_path, monkeypatch):
    class Forgetful(mp.Pinhole):
        """Its table has no center."""

        def to_table(self):
            return {"focal": [self.fx, self.fy]}

    monkeypatch.setitem(mp.cameras.MODELS, "Forgetful", Forgetful)
    monkeypatch.setitem(globals(), "Forgetful", Forgetful)
    Forgetful.__qualname__ = "Forgetful"
    kit.files_keep_it(Forgetful(64, 48, camera_from_world=POSE), tmp_path)
    with pytest.raises(AssertionError):
        kit.files_keep_it(Forgetful(64, 48, cx=20.0, camera_from_world=POSE), tmp_path)
