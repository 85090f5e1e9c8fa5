"""glTF files made with pygltflib, from arrays."""

from pathlib import Path
from typing import Any

import numpy as np
import pygltflib as gl

TYPES = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
WIDTHS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class Writer:
    """A file in the making: `add` puts arrays into its buffer, `node` meshes into its scene."""

    def __init__(self):
        self.file: Any = gl.GLTF2(scene=0, scenes=[gl.Scene(nodes=[])], buffers=[gl.Buffer(byteLength=0)])
        self.data = b""

    def view(self, data: bytes, stride: int | None = None) -> int:
        self.data += b"\0" * (-len(self.data) % 4)
        view = gl.BufferView(buffer=0, byteOffset=len(self.data), byteLength=len(data), byteStride=stride)
        self.data += data
        self.file.bufferViews.append(view)
        return len(self.file.bufferViews) - 1

    def add(self, values: Any, kind: str = "f4", normalized: bool = False, padding: int = 0, **more: Any) -> int:
        """An accessor. padding: bytes between rows."""
        rows = np.ascontiguousarray(values, f"<{kind}")
        rows = rows.reshape(len(rows), -1)
        size = rows.dtype.itemsize * rows.shape[1]
        data = b"".join(row.tobytes() + b"\xff" * padding for row in rows) if padding else rows.tobytes()
        accessor = gl.Accessor(
            bufferView=self.view(data, size + padding if padding else None),
            componentType=TYPES[kind],
            count=len(rows),
            type=WIDTHS[rows.shape[1]],
            normalized=normalized,
            **more,
        )
        self.file.accessors.append(accessor)
        return len(self.file.accessors) - 1

    def mesh(self, attributes: dict[str, int], indices: int | None = None, **more: Any) -> int:
        primitive = gl.Primitive(attributes=gl.Attributes(**attributes), indices=indices, **more)
        self.file.meshes.append(gl.Mesh(primitives=[primitive]))
        return len(self.file.meshes) - 1

    def node(self, mesh: int | None = None, root: bool = True, **more: Any) -> int:
        self.file.nodes.append(gl.Node(mesh=mesh, **more))
        number = len(self.file.nodes) - 1
        if root:
            self.file.scenes[0].nodes.append(number)
        return number

    def textured(self, uri: str, info: dict[str, Any] | None = None, **more: Any) -> int:
        """A material with an image. info: more of its texture; more: of the material."""
        self.file.images.append(gl.Image(uri=uri))
        self.file.textures.append(gl.Texture(source=len(self.file.images) - 1))
        texture = gl.TextureInfo(index=len(self.file.textures) - 1, **(info or {}))
        look = gl.PbrMetallicRoughness(baseColorTexture=texture, baseColorFactor=[1, 1, 1, 1])
        self.file.materials.append(gl.Material(pbrMetallicRoughness=look, name="skin", **more))
        return len(self.file.materials) - 1

    def save(self, path: Path, form: str = "data") -> Path:
        """form: "glb", "data" (a data URI) or "bin" (a file beside)."""
        self.file.buffers[0].byteLength = len(self.data)
        self.file.set_binary_blob(self.data)
        if form == "glb":
            self.file.save_binary(str(path))
            return path
        if form == "bin":
            self.file.buffers[0].uri = "the%20data.bin"
            (path.parent / "the data.bin").write_bytes(self.data)
        else:
            self.file.convert_buffers(gl.BufferFormat.DATAURI)
        self.file.save_json(str(path))
        return path


def triangle(writer: Writer, **more: Any) -> int:
    """A mesh of the triangle (0,0,0) (1,0,0) (0,1,0)."""
    return writer.mesh({"POSITION": writer.add([[0, 0, 0], [1, 0, 0], [0, 1, 0]])}, **more)
