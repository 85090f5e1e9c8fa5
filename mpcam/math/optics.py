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
