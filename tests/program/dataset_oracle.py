"""Projects points with the calibration of a dataset folder, read by other programs; JSON in, JSON out.

stdin: {"folder": ..., "points": [[x, y, z], ...]} in mm, world.
stdout: {"colmap" | "opencv" | "nerf": {camera: [[u, v], ...]}} in pixels, the top-left pixel's centre at (0.5, 0.5).
"""
import json
import pathlib
import sys

import cv2
import numpy as np
import pycolmap

case = json.load(sys.stdin)
folder, points = pathlib.Path(case["folder"]), np.array(case["points"])
found = {"colmap": {}, "opencv": {}, "nerf": {}}

model = pycolmap.Reconstruction(folder / "colmap")
for image in model.images.values():
    in_camera = np.stack([image.cam_from_world() * p for p in points])
    found["colmap"][image.name.removesuffix(".png")] = image.camera.img_from_cam(in_camera).tolist()

for camera in json.loads((folder / "opencv.json").read_text())["cameras"]:
    k, r, t, d = (np.array(camera[key], float) for key in ("K", "R", "t_mm", "distortion"))
    pixels, _ = cv2.projectPoints(points, cv2.Rodrigues(r)[0], t, k, d)
    found["opencv"][camera["name"]] = (pixels[:, 0] + 0.5).tolist()

for frame in json.loads((folder / "transforms.json").read_text())["frames"]:
    image = cv2.imread(str(folder / frame["file_path"]), cv2.IMREAD_UNCHANGED)
    mask = cv2.imread(str(folder / frame["mask_path"]), cv2.IMREAD_UNCHANGED)
    assert image.shape == mask.shape == (frame["h"], frame["w"]) and image.dtype == np.uint8
    x, y, z, _ = np.linalg.inv(frame["transform_matrix"]) @ np.c_[points, np.ones(len(points))].T
    name = pathlib.Path(frame["file_path"]).stem
    pixels = np.c_[frame["cx"] + frame["fl_x"] * x / -z, frame["cy"] - frame["fl_y"] * y / -z]
    found["nerf"][name] = pixels.tolist()

json.dump(found, sys.stdout)
