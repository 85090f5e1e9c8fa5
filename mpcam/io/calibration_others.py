"""Files that hold no camera that can be read here, by what they are: each with what to do instead."""

import re

from mpcam.io.calibration_document import Document

_COLMAP = "give cameras.bin or cameras.txt, or the folder that they are in"
_BYTES = (
    (
        b"SQLite format 3",
        "a database, as COLMAP's database.db",
        "export the model: colmap model_converter, or sparse/0",
    ),
    (b"MATLAB 5.0 MAT-file", "MATLAB's .mat", "write K, D and the size as JSON or YAML: read_calibration reads those"),
    (b"\x80\x04", "a Python pickle", "it could run any program: write the numbers as JSON, YAML or .npz"),
    (b"\x80\x03", "a Python pickle", "it could run any program: write the numbers as JSON, YAML or .npz"),
    (b"\x80\x05", "a Python pickle", "it could run any program: write the numbers as JSON, YAML or .npz"),
    (b"\x93NUMPY", "one array of NumPy", "save the matrix and the coefficients with names: numpy.savez(K=..., D=...)"),
    (b"#ROSBAG", "a ROS bag", "write a message of it: rostopic echo -n 1 /camera_info > camera_info.yaml"),
    (b"\x89PNG", "an image", "give the calibration file; mpcam keeps cameras in EXR headers only"),
    (b"\xff\xd8\xff", "an image", "give the calibration file; mpcam keeps cameras in EXR headers only"),
    (b"BLENDER", "a Blender scene", "export transforms.json of its camera"),
)
_TEXTS = (
    (r"# Bundle file v", "Bundler's bundle.out", "convert it to COLMAP's text, or give the camera as OpenCV's YAML"),
    (r"NVM_V\d", "VisualSFM's .nvm", "convert it to COLMAP's text: colmap model_converter"),
    (r"# 3D point list", "COLMAP's points3D.txt", _COLMAP),
    (r"# (Rig|Frame) list", "COLMAP's rigs or frames", _COLMAP),
    (
        r"\{?\s*lensmodel|\{\s*'lensmodel'",
        "mrcal's .cameramodel",
        "write it as LENSMODEL_OPENCV8 numbers in OpenCV's YAML",
    ),
    (r"\[(LEFT|RIGHT)_CAM_", "Stereolabs' .conf", "write fx, fy, cx, cy, k1, k2, p1, p2, k3 of a resolution as YAML"),
    (r"Cameras coefficients|Calibration results", "Kalibr's report", "give its camchain .yaml"),
    (r"(?:Pinhole|RadTan|EquiDistant|FOV|KannalaBrandt)\s+-?[\d.]", "DSO's camera.txt", "write its numbers as YAML"),
    (r"<x:xmpmeta|<\?xpacket", "an XMP file, as RealityCapture writes it", "export COLMAP's text from there"),
    (
        r"#name,x,y,alt|#cameras|label,x,y,z",
        "a table of poses",
        "export COLMAP's text, or OpenCV's calibration, from there",
    ),
)
_SUFFIXES = {
    **dict.fromkeys(
        (".obj", ".ply", ".stl", ".gltf", ".glb", ".off"), ("a mesh", "give a camera's file, and the mesh as SCENE")
    ),
    ".toml": ("a scene file", "give it as SCENE; its camera is used where no other is given"),
    ".db": ("a database, as COLMAP's database.db", "export the model: colmap model_converter, or sparse/0"),
    ".bag": ("a ROS bag", "write a message of it: rostopic echo -n 1 /camera_info > camera_info.yaml"),
}
_KEYS = (
    ({"calibration"}, "Agisoft Metashape's calibration", "export it there as OpenCV's XML (Tools, Camera Calibration)"),
    ({"document"}, "Agisoft Metashape's cameras", "export the calibration as OpenCV's XML, or COLMAP's model"),
    ({"sfm_data_version"}, "OpenMVG's sfm_data.json", "export COLMAP's text: openMVG_main_openMVG2Colmap"),
    ({"views", "intrinsics", "version"}, "AliceVision's or Meshroom's .sfm", "export COLMAP's model there"),
    ({"target_type"}, "Kalibr's description of a target", "give the camchain .yaml"),
    ({"accelerometer_noise_density"}, "Kalibr's description of an IMU", "give the camchain .yaml"),
    ({"imu0"}, "Kalibr's chain of IMUs", "give the camchain .yaml"),
    ({"taylor_coefficient"}, "a Python port of OCamCalib", "give OCamCalib's calib_results.txt"),
    ({"lensmodel"}, "mrcal's .cameramodel", "write it as OpenCV's YAML"),
    ({"model", "width", "height"}, "RealSense's intrinsics", "write fx, fy, cx, cy, width, height and D as YAML"),
    ({"scene", "meshes"}, "a glTF scene", "give its meshes to render; cameras are in calibration files"),
    ({"image_topic"}, "a ROS configuration without a lens", "give the camera_info"),
)


def named(document: Document) -> str | None:
    """What a file is and what to do, as the end of a sentence; None where it is not known."""
    suffix = document.path.suffix.lower()
    if suffix in _SUFFIXES and not document.folder:
        what, advice = _SUFFIXES[suffix]
        return f"is {what}: {advice}"
    if document.folder:
        return f"is a folder without a COLMAP model: {_COLMAP}"
    for start, what, advice in _BYTES:
        if document.data.startswith(start):
            return f"is {what}: {advice}"
    if document.path.name.lower() in ("points3d.bin", "rigs.bin", "frames.bin"):
        return f"is COLMAP's {document.path.name}: {_COLMAP}"
    if document.binary:
        return None
    head = document.text.lstrip()[:3000]
    for pattern, what, advice in _TEXTS:
        if re.match(pattern, head) or (pattern[0] not in "#{" and re.search(rf"^(?:{pattern})", head, re.MULTILINE)):
            return f"is {what}: {advice}"
    keys = {str(key) for key in document.mapping()}
    for wanted, what, advice in _KEYS:
        if wanted <= keys:
            return f"is {what}: {advice}"
    if _opensfm(document):
        return "is OpenSfM's: export COLMAP's model, opensfm export_colmap"
    if keys:
        return f"has the keys {', '.join(sorted(keys))[:120]}, and no camera among them that is known here"
    return None


def _opensfm(document: Document) -> bool:
    try:
        tree = document.tree[0] if isinstance(document.tree, list) and document.tree else document.tree
    except ValueError:
        return False
    cameras = tree.get("cameras", tree) if isinstance(tree, dict) else {}
    entries = list(cameras.values()) if isinstance(cameras, dict) else []
    return bool(entries) and all(isinstance(entry, dict) and "projection_type" in entry for entry in entries)
