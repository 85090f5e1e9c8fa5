"""Textures and extensions of glTF files: where a texture lies, which images are found, and what is refused by name."""

import base64
import io

import numpy as np
import pygltflib as gl
import pytest
from gltf_kit import Writer, triangle
from PIL import Image

from mpcam import InputError, load_mesh

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)


def png(mode: str = "RGB", color=(255, 0, 0)) -> bytes:
    stream = io.BytesIO()
    Image.new(mode, (2, 2), color).save(stream, "PNG")
    return stream.getvalue()


RED = "data:image/png;base64," + base64.b64encode(png()).decode()


def textured(writer: Writer, info=None, uri: str = RED, sets=("TEXCOORD_0",), **more) -> Writer:
    """A triangle with a texture, and texture coordinates of each set: (0,0) (1,0) (0,1), and twice that in the next."""
    attributes = {"POSITION": writer.add(CORNERS)}
    for name in sets:
        attributes[name] = writer.add(CORNERS[:, :2] * (1 + int(name[-1])))
    writer.node(writer.mesh(attributes, material=writer.textured(uri, info, **more)))
    return writer


@pytest.mark.parametrize(
    ("transform", "expected"),
    [
        ({}, [[0, 0], [1, 0], [0, 1]]),
        ({"offset": [0.5, 0.25]}, [[0.5, 0.25], [1.5, 0.25], [0.5, 1.25]]),
        ({"scale": [2, 3]}, [[0, 0], [2, 0], [0, 3]]),
        # the extension's own example: turned a quarter counter-clockwise, which moves (1, 0) to (0, -1)
        ({"rotation": np.pi / 2}, [[0, 0], [0, -1], [1, 0]]),
        ({"offset": [0, 1], "rotation": np.pi / 2, "scale": [0.5, 0.5]}, [[0, 1], [0, 0.5], [0.5, 1]]),
        ({"texCoord": 1}, [[0, 0], [2, 0], [0, 2]]),
    ],
)
def test_texture_transform(tmp_path, transform, expected):
    writer = textured(Writer(), {"extensions": {"KHR_texture_transform": transform}}, sets=("TEXCOORD_0", "TEXCOORD_1"))
    writer.file.extensionsUsed = ["KHR_texture_transform"]
    mesh = load_mesh(writer.save(tmp_path / "a.gltf"))
    u, v = np.array(expected, float).T
    np.testing.assert_allclose(mesh.uv, np.stack([u, 1 - v], axis=1), atol=1e-12)


def test_second_set_of_texture_coordinates(tmp_path):
    writer = textured(Writer(), {"texCoord": 1}, sets=("TEXCOORD_0", "TEXCOORD_1"))
    np.testing.assert_array_equal(load_mesh(writer.save(tmp_path / "a.gltf")).uv, [[0, 1], [2, 1], [0, -1]])
    writer = textured(Writer(), {"texCoord": 1})
    with pytest.warns(UserWarning, match="faces of material 'skin' have no TEXCOORD_1: they are drawn without"):
        assert load_mesh(writer.save(tmp_path / "a.gltf")).materials[0].texture is None


@pytest.mark.parametrize(
    "uri", ["my%20pic.png", "my pic.png", "./my%20pic.png", "gr%C3%BCn.png", "100%25.png", "a%20b.png", RED]
)
def test_names_of_images(tmp_path, uri):
    for name in ("my pic.png", "gr\u00fcn.png", "100%.png", "a%20b.png"):
        (tmp_path / name).write_bytes(png())
    mesh = load_mesh(textured(Writer(), uri=uri).save(tmp_path / "a.gltf"))
    assert mesh.materials[0].texture is not None and mesh.materials[0].texture[0, 0].tolist() == [1, 0, 0]


@pytest.mark.parametrize(
    "uri", ["nowhere.png", "https://example.org/nowhere.png", "a.gltf", "data:image/png;base64,AAAA"]
)
def test_images_that_are_not_there_are_said(tmp_path, uri):
    word = "nowhere.png" if "nowhere" in uri else "not a readable image"
    with pytest.warns(UserWarning, match=f"{word}.*; material skin has no texture"):
        mesh = load_mesh(textured(Writer(), uri=uri).save(tmp_path / "a.gltf"))
    assert mesh.materials[0].texture is None and mesh.uv is not None


def test_webp_and_ktx2_beside_a_plain_image(tmp_path):
    stream = io.BytesIO()
    Image.new("RGB", (2, 2), (0, 255, 0)).save(stream, "WEBP", lossless=True)
    (tmp_path / "a.webp").write_bytes(stream.getvalue())
    writer = textured(Writer())
    writer.file.images.append(gl.Image(uri="a.webp"))
    writer.file.textures[0] = gl.Texture(source=None, extensions={"EXT_texture_webp": {"source": 1}})
    writer.file.extensionsUsed = writer.file.extensionsRequired = ["EXT_texture_webp"]
    texture = load_mesh(writer.save(tmp_path / "a.gltf")).materials[0].texture
    assert texture is not None and texture[0, 0].tolist() == [0, 1, 0]
    writer = textured(Writer())
    writer.file.textures[0].extensions = {"KHR_texture_basisu": {"source": 9}}
    writer.file.extensionsUsed = ["KHR_texture_basisu"]
    assert load_mesh(writer.save(tmp_path / "a.gltf")).materials[0].texture is not None


@pytest.mark.parametrize("wrap", [33071, 33648])
def test_textures_that_do_not_repeat(tmp_path, wrap):
    for scale in (1, 2):
        writer = textured(Writer(), {"extensions": {"KHR_texture_transform": {"scale": [scale, 1]}}})
        writer.file.samplers.append(gl.Sampler(wrapS=wrap))
        writer.file.textures[0].sampler = 0
        writer.save(tmp_path / "a.gltf")
        if scale == 1:
            load_mesh(tmp_path / "a.gltf")
        else:
            with pytest.warns(UserWarning, match="clamped|mirrored"):
                load_mesh(tmp_path / "a.gltf")


def test_transparency_is_said(tmp_path):
    see_through = "data:image/png;base64," + base64.b64encode(png("RGBA", (255, 0, 0, 9))).decode()
    load_mesh(textured(Writer(), uri=see_through).save(tmp_path / "a.gltf"))
    load_mesh(textured(Writer(), alphaMode="BLEND").save(tmp_path / "a.gltf"))
    with pytest.warns(UserWarning, match="material skin is transparent"):
        load_mesh(textured(Writer(), uri=see_through, alphaMode="MASK").save(tmp_path / "a.gltf"))


def test_specular_glossiness(tmp_path):
    writer = textured(Writer())
    gloss = {"diffuseFactor": [0.25, 0.5, 1, 1], "diffuseTexture": {"index": 0}}
    extensions = {"KHR_materials_pbrSpecularGlossiness": gloss}
    writer.file.materials[0] = gl.Material(extensions=extensions, pbrMetallicRoughness=None)
    material = load_mesh(writer.save(tmp_path / "a.gltf")).materials[0]
    assert material.color == (0.25, 0.5, 1) and material.texture is not None


@pytest.mark.parametrize(
    ("name", "said"),
    [
        (
            "KHR_draco_mesh_compression",
            "compressed with KHR_draco_mesh_compression: export it again without compression",
        ),
        ("EXT_meshopt_compression", "compressed with EXT_meshopt_compression"),
        ("KHR_meshopt_compression", "compressed with KHR_meshopt_compression"),
        ("KHR_texture_basisu", "KTX2 textures"),
        ("VENDOR_something_new", "requires an extension that is not read, VENDOR_something_new"),
    ],
)
def test_required_extensions_that_are_not_read(tmp_path, name, said):
    writer = Writer()
    writer.node(triangle(writer))
    writer.file.extensionsUsed = writer.file.extensionsRequired = [name]
    with pytest.raises(InputError, match=said):
        load_mesh(writer.save(tmp_path / "a.gltf"))


def test_extensions_that_are_not_required(tmp_path):
    writer = Writer()
    writer.node(triangle(writer, extensions={"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {}}}))
    writer.file.extensionsUsed = ["KHR_draco_mesh_compression", "KHR_materials_clearcoat", "KHR_lights_punctual"]
    assert load_mesh(writer.save(tmp_path / "a.gltf")).triangle_count == 1
    writer.file.extensionsUsed += ["VENDOR_hair"]
    with pytest.warns(UserWarning, match="uses the extension VENDOR_hair, which is not read"):
        load_mesh(writer.save(tmp_path / "a.gltf"))
    writer.file.extensionsUsed.pop()
    writer.file.accessors[0].bufferView = None
    with pytest.raises(InputError, match="without compression"):
        load_mesh(writer.save(tmp_path / "a.gltf"))
