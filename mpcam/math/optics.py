"""Mirror reflection and refraction of directions, components first, for NumPy, JAX and Dr.Jit arrays alike."""

from mpcam.math.arrays import Array, safe_sqrt, where
from mpcam.math.vectors import Vector, dot, normalize, vector


def reflect(incident: Vector, normal: Vector) -> Vector:
    """Direction of the mirrored ray, not normalized.

    incident: direction of travel, any length. normal: any length, either side. With affine arguments the result,
    (n . n) i - 2 (i . n) n, is a cubic polynomial (Hou et al. 2006, section 3.1).
    """
    squared, across = dot(normal, normal), 2.0 * dot(incident, normal)
    return vector(*(squared * incident[i] - across * normal[i] for i in range(3)))


def refract(incident: Vector, normal: Vector, index: Array) -> tuple[Vector, Array]:
    """Unit direction after an interface (Snell's law), and where there is one: False at total internal reflection.

    incident: direction of travel, any length. normal: any length, either side. index: refractive index behind the
    interface over that in front of it, e.g. 1.5 from air into glass. Hou et al. 2006, section 3.2.
    """
    i, n, eta = normalize(incident), normalize(normal), 1.0 / index
    cosine = dot(i, n)
    side = where(cosine > 0, -1.0, 1.0)  # of the normal that looks back at the light
    cosine = abs(cosine)
    under = 1.0 - eta * eta * (1.0 - cosine * cosine)
    along = side * (eta * cosine - safe_sqrt(under))
    return vector(*(eta * i[k] + along * n[k] for k in range(3))), under >= 0


def fresnel(incident: Vector, normal: Vector, index: Array) -> Array:
    """Part of unpolarized light that an interface reflects, 1 at total internal reflection (Fresnel's equations).

    Arguments as for `refract`.
    """
    eta = 1.0 / index
    before = abs(dot(normalize(incident), normalize(normal)))
    under = 1.0 - eta * eta * (1.0 - before * before)
    after = safe_sqrt(under)
    across, along, tiny = eta * before + after, before + eta * after, 1e-30
    crosswise = (eta * before - after) / where(across > tiny, across, 1.0)
    parallel = (before - eta * after) / where(along > tiny, along, 1.0)
    part = 0.5 * (crosswise * crosswise + parallel * parallel)
    return where((under > 0) & (across > tiny) & (along > tiny), part, 1.0)
