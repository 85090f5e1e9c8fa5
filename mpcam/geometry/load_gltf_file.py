"""A glTF 2.0 file: its objects, checked for what is read, and the bytes behind them: GLB chunks, data URIs, files."""

import base64
import re
import struct
from pathlib import Path
from typing import Any
from urllib.parse import unquote, unquote_to_bytes

import msgspec

from mpcam.errors import InputError
from mpcam.geometry.load_gltf_parts import Root
from mpcam.geometry.load_text import Say, decode_text, find_file

# Extensions that are decoded, and those of which a mesh with plain colors can do without.
_READ = {"KHR_mesh_quantization", "KHR_texture_transform", "EXT_mesh_gpu_instancing", "KHR_node_visibility"}
_READ |= {"KHR_materials_pbrSpecularGlossiness", "EXT_texture_webp", "EXT_texture_avif"}
_HARMLESS = re.compile(
    r"KHR_materials_\w+|KHR_lights_\w+|KHR_xmp\w*|KHR_animation_pointer|KHR_node_\w+|FB_ngon_encoding"
)
_COMPRESSED = re.compile(r"\w+_(draco_mesh_compression|meshopt_compression)")


class GltfFile:
    """A .gltf or .glb file: its objects (`root`), and the bytes of its buffers and images.

    Raises InputError for versions and required extensions that are not read, ValueError for what is no glTF.
    """

    def __init__(self, path: Path, say: Say):
        self.path, self.say = path, say
        self._chunk: bytes | None = None
        self._buffers: dict[int, bytes] = {}
        text = decode_text(self._json(path.read_bytes()))
        try:
            head = msgspec.json.decode(text, type=dict[str, Any])
        except msgspec.MsgspecError as error:
            raise ValueError(str(error)) from None
        asset = head.get("asset", {})
        version = str(asset.get("minVersion") or asset.get("version", "")) if isinstance(asset, dict) else ""
        if not re.match(r"2\.0$|2$", version):
            raise InputError(f"{path} is of glTF version {version or 'none'}: export it as glTF 2.0")
        try:
            self.root = msgspec.convert(head, Root, strict=False)
        except msgspec.MsgspecError as error:
            raise ValueError(str(error)) from None
        self._check_extensions()

    def _json(self, data: bytes) -> bytes:
        """The JSON of the file; keeps the binary chunk of a GLB."""
        if data[:4] != b"glTF":
            if self.path.suffix.lower() == ".glb" and not data.lstrip().startswith(b"{"):
                raise ValueError("not a GLB header")
            return data
        version, end = struct.unpack_from("<II", data, 4)
        if version != 2:
            raise InputError(f"{self.path} is of glTF version {version}: export it as glTF 2.0")
        if end > len(data):
            raise ValueError("the file was cut off")
        chunks, at = {}, 12
        while at + 8 <= end:
            length, kind = struct.unpack_from("<I4s", data, at)
            chunks.setdefault(kind, data[at + 8 : at + 8 + length])
            at += 8 + length
        self._chunk = chunks.get(b"BIN\0")
        return chunks[b"JSON"]

    def _check_extensions(self) -> None:
        for name in self.root.extensions_required:
            if _COMPRESSED.fullmatch(name):
                raise InputError(f"{self.path} is compressed with {name}: export it again without compression")
            if name not in _READ and not _HARMLESS.fullmatch(name):
                what = "has KTX2 textures" if name == "KHR_texture_basisu" else "requires an extension that is not read"
                raise InputError(f"{self.path} {what}, {name}: export it again without")
        for name in self.root.extensions_used:
            known = name in _READ or _HARMLESS.fullmatch(name) or _COMPRESSED.fullmatch(name)
            if not known and name not in ("KHR_texture_basisu", "MSFT_lod"):
                self.say(f"it uses the extension {name}, which is not read")

    def buffer(self, number: int) -> bytes:
        """All bytes of a buffer."""
        found = self._buffers.get(number)
        if found is None:
            buffer = _at(self.root.buffers, number)
            if buffer.uri is None:
                if any(isinstance(e, dict) and e.get("fallback") for e in buffer.extensions.values()):
                    name = next(iter(buffer.extensions))
                    raise InputError(f"{self.path} is compressed with {name}: export it again without compression")
                if number or self._chunk is None:
                    raise ValueError("a buffer without bytes")
                found = self._chunk
            else:
                found = self.uri(buffer.uri)
                if found is None:
                    raise InputError(
                        f"{self.path} needs {_shown(buffer.uri)}, which is not there: put it beside the file"
                    )
            if len(found) < buffer.byte_length:
                raise ValueError(f"buffer {number} has {len(found)} bytes of {buffer.byte_length}")
            self._buffers[number] = found
        return found

    def view(self, number: int) -> tuple[memoryview, int | None]:
        """The bytes of a buffer view, and its stride."""
        view = _at(self.root.buffer_views, number)
        data = self.buffer(view.buffer)
        end = view.byte_offset + view.byte_length
        if view.byte_offset < 0 or view.byte_length < 0 or end > len(data):
            raise ValueError(f"buffer view {number} ends outside of its buffer")
        return memoryview(data)[view.byte_offset : end], view.byte_stride

    def uri(self, uri: str) -> bytes | None:
        """What a URI names: data in itself, or a file beside this one; None if there is no such file."""
        if uri.startswith("data:"):
            head, _, body = uri.partition(",")
            data = unquote_to_bytes(body)
            return base64.b64decode(data + b"=" * (-len(data) % 4)) if head.endswith(";base64") else data
        if re.match(r"[A-Za-z][A-Za-z0-9+.-]+:", uri):
            return None
        folder = self.path.parent
        found = find_file(folder, unquote(uri)) or find_file(folder, uri)
        return None if found is None else found.read_bytes()

    def image(self, number: int) -> tuple[bytes | None, str]:
        """The bytes of an image, None if they are not there, and what to call it."""
        image = _at(self.root.images, number)
        if image.uri is not None:
            return self.uri(image.uri), _shown(unquote(image.uri))
        if image.buffer_view is None:
            return None, image.name or f"image {number}"
        return bytes(self.view(image.buffer_view)[0]), image.name or f"image {number}"


def _at(items: list, number: int) -> Any:
    if not 0 <= number < len(items):
        raise ValueError(f"object {number} of {len(items)} is named")
    return items[number]


def _shown(uri: str) -> str:
    return uri if len(uri) <= 80 and not uri.startswith("data:") else f"{uri[:40]}..."
