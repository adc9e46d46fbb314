"""What the baselines share: a dataset folder's views, rectified pairs, and depth from their disparity."""
import json
import pathlib
import warnings

import cv2
import numpy as np


class View:
    """One image of one camera, in OpenCV's convention: the centre of the top-left pixel is (0, 0)."""

    def __init__(self, folder, frame, camera):
        name = camera["name"]
        levels = cv2.imread(str(folder / frame["images"] / f"{name}.png"), cv2.IMREAD_UNCHANGED)
        self.mask = cv2.imread(str(folder / frame["masks"] / f"{name}.png"), cv2.IMREAD_UNCHANGED) > 127
        self.linear = levels.astype(np.float32) / 65535
        self.k, self.r, self.t = (np.array(camera[key]) for key in ("K", "R", "t_mm"))

    def display(self):
        """8 bits with the 99.5th percentile of the hair at white and a display gamma, as a display would show it."""
        top = max(np.percentile(self.linear[self.mask], 99.5), 1e-6) if self.mask.any() else 1.0
        return (np.clip(self.linear / top, 0, 1) ** (1 / 2.2) * 255).astype(np.uint8)


class Pair:
    """Reference and another view, rectified: along a row of `a` and `b` the same points lie `disparity` px apart,
    x_a - x_b, between `low` and `high`."""

    def __init__(self, ref, other, near, far):
        self.ref, (h, w) = ref, ref.mask.shape
        c0, c1 = -ref.r.T @ ref.t, -other.r.T @ other.t
        self.baseline = np.linalg.norm(c1 - c0)
        x = (c1 - c0) / self.baseline
        z = ref.r[2] + other.r[2]
        z = z - x * (z @ x)
        z /= np.linalg.norm(z)
        self.rect = np.stack([x, np.cross(z, x), z])
        self.f = 0.5 * (ref.k[0, 0] + other.k[0, 0])
        self.near, self.far = near, far
        maps = [np.diag([self.f, self.f, 1.0]) @ self.rect @ v.r.T @ np.linalg.inv(v.k) for v in (ref, other)]
        corners = np.array([[0, 0, 1], [w, 0, 1], [w, h, 1], [0, h, 1]], float).T
        spans = [(m @ corners)[:2] / (m @ corners)[2] for m in maps]
        self.origin = np.floor(np.minimum(spans[0].min(1), spans[1].min(1)))
        end = np.ceil(np.maximum(spans[0].max(1), spans[1].max(1)))
        shift = np.array([[1, 0, -self.origin[0]], [0, 1, -self.origin[1]], [0, 0, 1]])
        self.size = tuple(int(n) + 1 for n in end - self.origin)
        self.from_ref, self.from_other = shift @ maps[0], shift @ maps[1]
        self.low, self.high = self.f * self.baseline / far, self.f * self.baseline / near
        self.a = cv2.warpPerspective(ref.display(), self.from_ref, self.size, flags=cv2.INTER_CUBIC)
        self.b = cv2.warpPerspective(other.display(), self.from_other, self.size, flags=cv2.INTER_CUBIC)
        self.mask_a, self.mask_b = (
            cv2.warpPerspective(v.mask.astype(np.uint8), m, self.size, flags=cv2.INTER_NEAREST) > 0
            for v, m in ((ref, self.from_ref), (other, self.from_other)))

    def depth(self, disparity):
        """Depth (mm) along +z of each pixel of the reference image; NaN where `disparity`, over `a`, is."""
        h, w = self.ref.mask.shape
        v, u = np.mgrid[0:h, 0:w].astype(np.float64)
        p = self.from_ref @ np.stack([u.ravel(), v.ravel(), np.ones(u.size)])
        p = p[:2] / p[2]
        column, row = np.rint(p).astype(int)
        ok = (column >= 0) & (row >= 0) & (column < self.size[0]) & (row < self.size[1])
        d = np.full(u.size, np.nan)
        d[ok] = disparity[row[ok], column[ok]]
        rays = np.stack([(p[0] + self.origin[0]) / self.f, (p[1] + self.origin[1]) / self.f, np.ones(u.size)])
        depth = ((self.ref.r @ self.rect.T) @ rays)[2] * self.f * self.baseline / d
        depth[(depth < self.near) | (depth > self.far)] = np.nan
        return depth.reshape(h, w)


def answer(source, target, pair_depth):
    """Writes a depth map for every frame of a dataset: the median over pairs of `pair_depth(Pair)` inside the mask."""
    source, target = pathlib.Path(source), pathlib.Path(target)
    dataset = json.loads((source / "dataset.json").read_text())
    cameras = json.loads((source / "opencv.json").read_text())["cameras"]
    for frame in dataset["frames"]:
        ref, *others = [View(source, frame, c) for c in cameras]
        depths = [pair_depth(Pair(ref, other, dataset["near_mm"], dataset["far_mm"])) for other in others]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # pixels that no pair answers
            depth = np.nanmedian(np.stack(depths), axis=0)
        depth[~ref.mask] = np.nan
        (target / frame["answer"]).mkdir(parents=True, exist_ok=True)
        np.save(target / frame["answer"] / "depth.npy", depth.astype(np.float32))
        print(f"frame {frame['index']}: {np.isfinite(depth).sum()} of {ref.mask.sum()} pixels of the mask answered")
