"""Cameras that calibration files hold, and a chain of them as Kalibr writes it."""

import mpcam as mp

K = (0.0034, 0.0007, -0.002, 0.0002)

PINHOLE = mp.Pinhole(640, 480, 500.1, 501.2, 320.3, 240.4)
FISHEYE = mp.KannalaBrandt(512, 400, 190.97, 190.93, 254.93, 196.89, K)
DOUBLE = mp.DoubleSphere(752, 480, 349.7, 348.7, 365.8, 249.3, -0.24, 0.567)
UNIFIED = mp.UnifiedOmni(752, 480, 460.7, 459.3, 365.8, 249.3, 0.59, 1.1)
MEI = mp.UnifiedOmni.mei(640, 480, 707.1, 706.8, 321.0, 243.5, 1.25)
BROWN = mp.BrownConrady(752, 480, 458.654, 457.296, 367.715, 248.875, (-0.283, 0.074), (2e-4, 1.8e-5))
SIXTH = mp.BrownConrady(752, 480, 458.654, 457.296, 367.715, 248.875, (-0.283, 0.074, -0.01), (2e-4, 1.8e-5))
RATIONAL = mp.BrownConrady(640, 480, 300.1, 301.2, 320.3, 240.4, (9.1, 5.2, 0.19, 9.4, 8.1, 1.1), (1e-4, -2e-4))
SIMPLE = mp.BrownConrady(640, 480, 500.1, 500.1, 320.3, 240.4, (0.11,))

CAMCHAIN = """cam0:
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [0.0034, 0.0007,
    -0.002, 0.0002]
  distortion_model: equidistant
  intrinsics: [190.97, 190.93, 254.43, 196.39]
  resolution: [512, 400]
  rostopic: /cam0/image_raw
cam1:
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, -0.1]
  - - 0.0
    - 1.0
    - 0.0
    - 0.0
  - [0.0, 0.0, 1.0, 0.02]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: ds
  distortion_coeffs: []
  distortion_model: none
  intrinsics: [-0.24, 0.567, 349.7, 348.7, 365.3, 248.8]
  resolution: [752, 480]
cam2:
  T_cn_cnm1: [[0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 0.5], [0, 0, 0, 1]]
  camera_model: omni
  distortion_coeffs: [0, 0, 0, 0]
  distortion_model: radtan
  intrinsics: [1.25, 707.1, 706.8, 320.5, 243.0]
  resolution: [640, 480]
cam3:
  T_cn_cnm1: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
  camera_model: eucm
  distortion_coeffs: []
  distortion_model: none
  intrinsics: [0.59, 1.1, 460.7, 459.3, 365.3, 248.8]
  resolution: [752, 480]
cam4:
  T_cn_cnm1: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
  camera_model: pinhole
  distortion_coeffs: []
  distortion_model: none
  intrinsics: [500.1, 501.2, 319.8, 239.9]
  resolution: [640, 480]
"""
