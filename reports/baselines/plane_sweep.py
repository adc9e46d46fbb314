"""A method from outside: plane sweep by normalised cross-correlation. usage: python plane_sweep.py DATASET ANSWER

Reads a folder of `strandbench dataset export` and writes depth.npy. Each depth is a plane that maps every other image onto
the reference by a homography; where the surface lies on that plane, they look alike."""
import json
import pathlib
import sys

import cv2
import numpy as np

PLANES, WINDOW = 256, 11  # evenly spaced in 1/z; pixels


def load(folder, frame, camera):
    image = cv2.imread(str(folder / frame["images"] / (camera["name"] + ".png")), cv2.IMREAD_UNCHANGED)
    return np.sqrt(image.astype(np.float32) / 65535), *(np.array(camera[key]) for key in ("K", "R", "t_mm"))


def standardised(image):
    """Mean and 1 / standard deviation in the window about each pixel; 0 where there is no contrast."""
    mean = cv2.blur(image, (WINDOW, WINDOW))
    variance = cv2.blur(image * image, (WINDOW, WINDOW)) - mean * mean
    return mean, np.where(variance > 1e-6, 1 / np.sqrt(np.maximum(variance, 1e-6)), 0)


def sweep(views, near, far):
    (ref, k0, r0, t0), *others = views
    mean, scale = standardised(ref)
    inverse = np.linspace(1 / near, 1 / far, PLANES)
    scores = np.full((3, *ref.shape), -1, np.float32)  # of the last three planes
    best, depth = np.full(ref.shape, -1, np.float32), np.full(ref.shape, np.nan, np.float32)
    for i, w in enumerate(inverse):
        score = np.zeros_like(ref)
        for image, k, r, t in others:
            rotation, shift = r @ r0.T, t - r @ r0.T @ t0
            homography = k @ (rotation + np.outer(shift, [0, 0, w])) @ np.linalg.inv(k0)
            warped = cv2.warpPerspective(image, homography, ref.shape[::-1], flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
            m, s = standardised(warped)
            score += (cv2.blur(ref * warped, (WINDOW, WINDOW)) - mean * m) * scale * s / len(others)
        scores = np.stack([scores[1], scores[2], score])
        before, here, after = scores
        curve = before - 2 * here + after
        peak = (i >= 2) & (here > best) & (here >= before) & (here >= after) & (curve < 0)
        offset = 0.5 * (before - after) / np.where(curve < 0, curve, -1)  # a parabola through three planes
        depth[peak] = (1 / (inverse[i - 1] + offset * (inverse[1] - inverse[0])))[peak]
        best[peak] = here[peak]
    return depth


source, target = map(pathlib.Path, sys.argv[1:3])
dataset = json.loads((source / "dataset.json").read_text())
cameras = json.loads((source / "opencv.json").read_text())["cameras"]
for frame in dataset["frames"]:
    depth = sweep([load(source, frame, c) for c in cameras], dataset["near_mm"], dataset["far_mm"])
    mask = cv2.imread(str(source / frame["masks"] / (cameras[0]["name"] + ".png")), cv2.IMREAD_UNCHANGED)
    depth[mask == 0] = np.nan
    (target / frame["answer"]).mkdir(parents=True, exist_ok=True)
    np.save(target / frame["answer"] / "depth.npy", depth)
