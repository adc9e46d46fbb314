"""Depth of the reference camera by OpenCV's semi-global matching: three rectified pairs, median of depths.

usage: python opencv_sgbm.py FRAME_FOLDER ESTIMATE_FOLDER [--block N] [--pairs 1|3]

Reads a frame folder as `strandbench render` writes it (rig.json, NAME.png, NAME_mask.png) and writes an
estimate folder with depth.exr, so that `strandbench score` holds it against the truth like any other method.
"""
import argparse
import json
import pathlib
import time
import warnings

import cv2
import numpy as np
import OpenEXR


def load_rig(folder):
    rig = json.loads((folder / "rig.json").read_text())
    rig = rig.get("rig", rig)
    cameras = []
    for c in rig["cameras"]:
        fx, fy = np.array(c.get("focal_px", [0, 0]), float)
        cx, cy = np.array(c.get("principal_px", [0, 0]), float)
        k = np.array(c["K"], float) if "K" in c else np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])
        if "R" in c:
            r, t = np.array(c["R"], float), np.array(c["t_mm"], float)
        else:
            r = np.array(c["camera_from_world"], float).reshape(3, 3).T
            t = np.array(c["translation_mm"], float)
        # Pixel centres: (0.5, 0.5) is the top-left one here, (0, 0) in OpenCV.
        k[0, 2] -= 0.5
        k[1, 2] -= 0.5
        cameras.append((c["name"], k, r, t))
    return cameras, float(rig["near_mm"]), float(rig["far_mm"])


def load_grey(path):
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise SystemExit(f"{path}: not a readable image")
    image = image.astype(np.float32) / (65535.0 if image.dtype == np.uint16 else 255.0)
    return image if image.ndim == 2 else image[..., 0]


def tone(image, mask):
    """8 bits with the 99.5th percentile of the hair at white and a display gamma, as a display would show it."""
    top = np.percentile(image[mask], 99.5)
    return (np.clip(image / max(top, 1e-6), 0, 1) ** (1 / 2.2) * 255).astype(np.uint8)


def pair_depth(ref, other, near, far, block, size):
    """Depth along +z of the reference camera from one rectified pair; NaN where the matcher has no answer."""
    (_, k0, r0, t0, i0), (_, k1, r1, t1, i1) = ref, other
    h, w = size
    c0, c1 = -r0.T @ t0, -r1.T @ t1
    baseline = np.linalg.norm(c1 - c0)
    x = (c1 - c0) / baseline
    z = r0[2] + r1[2]
    z = z - x * (z @ x)
    z /= np.linalg.norm(z)
    rect = np.stack([x, np.cross(z, x), z])
    f = 0.5 * (k0[0, 0] + k1[0, 0])

    def homography(k, r):
        return np.diag([f, f, 1.0]) @ rect @ r.T @ np.linalg.inv(k)

    corners = np.array([[0, 0, 1], [w, 0, 1], [w, h, 1], [0, h, 1]], float).T
    spans = []
    for k, r in ((k0, r0), (k1, r1)):
        p = homography(k, r) @ corners
        spans.append(p[:2] / p[2])
    lo = np.floor(np.minimum(spans[0].min(1), spans[1].min(1)))
    hi = np.ceil(np.maximum(spans[0].max(1), spans[1].max(1)))
    shift = np.array([[1, 0, -lo[0]], [0, 1, -lo[1]], [0, 0, 1]])
    out = (int(hi[0] - lo[0]) + 1, int(hi[1] - lo[1]) + 1)
    h0, h1 = shift @ homography(k0, r0), shift @ homography(k1, r1)
    a = cv2.warpPerspective(i0, h0, out, flags=cv2.INTER_CUBIC)
    b = cv2.warpPerspective(i1, h1, out, flags=cv2.INTER_CUBIC)
    low = int(np.floor(f * baseline / far)) - 1
    count = int(np.ceil((f * baseline / near - low) / 16 + 1) * 16)
    matcher = cv2.StereoSGBM_create(
        minDisparity=low, numDisparities=count, blockSize=block, P1=8 * block * block, P2=32 * block * block,
        disp12MaxDiff=2, uniquenessRatio=5, speckleWindowSize=100, speckleRange=2, mode=cv2.STEREO_SGBM_MODE_HH)
    disparity = matcher.compute(a, b).astype(np.float32) / 16.0
    disparity[disparity <= low] = np.nan
    v, u = np.mgrid[0:h, 0:w].astype(np.float64)
    p = h0 @ np.stack([u.ravel(), v.ravel(), np.ones(u.size)])
    p = p[:2] / p[2]
    column, row = np.rint(p[0]).astype(int), np.rint(p[1]).astype(int)
    ok = (column >= 0) & (row >= 0) & (column < out[0]) & (row < out[1])
    d = np.full(u.size, np.nan)
    d[ok] = disparity[row[ok], column[ok]]
    depth_rect = f * baseline / d
    rays = np.stack([(p[0] + lo[0]) / f, (p[1] + lo[1]) / f, np.ones(u.size)])
    depth = ((r0 @ rect.T) @ rays)[2] * depth_rect
    depth[(depth < near) | (depth > far)] = np.nan
    return depth.reshape(h, w)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("frame", type=pathlib.Path)
    parser.add_argument("estimate", type=pathlib.Path)
    parser.add_argument("--block", type=int, default=5)
    parser.add_argument("--pairs", type=int, default=3)
    args = parser.parse_args()
    cv2.setNumThreads(1)
    cameras, near, far = load_rig(args.frame)
    views = []
    for name, k, r, t in cameras:
        mask = load_grey(args.frame / f"{name}_mask.png") > 0.5
        views.append((name, k, r, t, tone(load_grey(args.frame / f"{name}.png"), mask), mask))
    mask = views[0][5]
    start, cpu = time.perf_counter(), time.process_time()
    depths = [pair_depth(views[0][:5], v[:5], near, far, args.block, mask.shape) for v in views[1:1 + args.pairs]]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # pixels that no pair answers
        depth = np.nanmedian(np.stack(depths), axis=0)
    depth[~mask] = np.nan
    wall, cpu = time.perf_counter() - start, time.process_time() - cpu
    args.estimate.mkdir(parents=True, exist_ok=True)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"Z": depth.astype(np.float32)}).write(str(args.estimate / "depth.exr"))
    print(f"{np.isfinite(depth).sum()} of {mask.sum()} mask pixels answered; {wall:.2f} s wall, {cpu:.2f} CPU s")


if __name__ == "__main__":
    main()
