"""Depth of the reference camera by constrained pyramid stereo and refinement, after Beeler, Bickel, Beardsley, Sumner and
Gross, High-Quality Single-Shot Capture of Facial Geometry (SIGGRAPH 2010), sections 4.2 and 4.3.

usage: python beeler_ncc.py DATASET ANSWER [--window N] [--smooth W]

Each rectified pair with the reference camera is matched by normalised cross-correlation from a coarse image to the full
one, a level searching about what the level before found; a match must agree with its neighbours and with the match from
the other image, and what does not is searched again about its neighbours' disparities. Each level then refines: a pixel
moves towards the minimum of its matching error (a parabola through three disparities) and towards its neighbours,
weighted by how sure either is. Depths of pairs are fused by the median. Left out is the mesoscopic step, which reads
pores off shading and holds for skin alone.
"""
import argparse

import cv2
import numpy as np

import dataset

COARSEST_PX = 150  # shorter side of the first level's image
STEPS = 60  # of refinement a level
AGREE_PX = 1.0  # two disparities farther apart disagree


class Errors:
    """(1 - NCC) / 2 of one image's windows with the other's, at whole disparities from `low`, indexed [disparity, v, u]."""

    def __init__(self, low, volume):
        self.low, self.volume = low, volume

    @staticmethod
    def both(a, b, low, high, window):
        """Of the two images: where `a` has x, `b` has x - disparity."""
        blur = lambda i: cv2.blur(i, (window, window))
        mean = blur(a), blur(b)
        variance = [np.maximum(blur(i * i) - m * m, 4) for i, m in zip((a, b), mean)]
        disparities = range(low, high + 1)
        of_a, of_b = (np.ones((len(disparities), *a.shape), np.float32) for _ in range(2))
        for k, d in enumerate(disparities):
            if 0 < d < a.shape[1]:
                here, there = np.s_[:, d:], np.s_[:, :-d]
                product = blur(a[here] * b[there]) - mean[0][here] * mean[1][there]
                e = (1 - product / np.sqrt(variance[0][here] * variance[1][there])) / 2
                of_a[k][here] = of_b[k][there] = e
        return Errors(low, of_a), Errors(low, of_b)

    def at(self, whole):
        """At a whole disparity a pixel; 1 outside those there are."""
        k = whole.astype(np.int32) - self.low
        inside = (k >= 0) & (k < len(self.volume))
        found = np.take_along_axis(self.volume, np.clip(k, 0, len(self.volume) - 1)[None], 0)[0]
        return np.where(inside, found, 1)

    def search(self, start, reach):
        """The disparity of least error among whole ones up to `reach` about `start`."""
        start = np.rint(start)
        errors = np.stack([self.at(start + step) for step in range(-reach, reach + 1)])
        return (start + errors.argmin(0) - reach).astype(np.float32)


def median(disparity, mask, size=5):
    """The median of the known neighbours inside the mask, in boxes; NaN where there is none."""
    pad = size // 2
    known = np.pad(np.where(mask, disparity, np.nan), pad, constant_values=np.nan)
    windows = np.lib.stride_tricks.sliding_window_view(known, (size, size)).reshape(*disparity.shape, -1)
    out = np.full(disparity.shape, np.nan, np.float32)
    some = np.isfinite(windows).any(-1)
    out[some] = np.nanmedian(windows[some], axis=-1)
    return out


def fill(disparity, mask):
    """Unknown pixels take the median of their neighbours, from the border of the known inwards."""
    filled = np.where(mask, disparity, np.nan)
    for _ in range(200):
        holes = mask & ~np.isfinite(filled)
        if not holes.any():
            break
        around = median(filled, mask)
        if not (holes & np.isfinite(around)).any():
            break
        filled[holes] = around[holes]
    middle = np.nanmedian(filled) if np.isfinite(filled).any() else 0
    return np.where(np.isfinite(filled), filled, middle).astype(np.float32)


def consistent(here, there, sign, mask):
    """Smoothness with the neighbours, and the same match from the other image."""
    v, u = np.mgrid[0:here.shape[0], 0:here.shape[1]].astype(np.float32)
    back = cv2.remap(there, u - sign * here, v, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT, borderValue=1e9)
    return mask & (abs(back - here) <= AGREE_PX) & (abs(median(here, mask) - here) <= AGREE_PX)


def refine(errors, disparity, smooth):
    for _ in range(STEPS):
        d = disparity
        whole = np.rint(d)
        before, here, after = (errors.at(whole + s) for s in (-1, 0, 1))
        curve = before + after - 2 * here
        least = (here <= before) & (here <= after)
        offset = np.where(least, 0.5 * (before - after) / np.maximum(curve, 1e-6), np.where(before < after, -0.5, 0.5))
        sure = np.where(least, 0.5 * curve, abs(before - after))  # of the photometric step
        p = np.pad(d, 1, mode="edge")
        left, right, up, down = p[1:-1, :-2], p[1:-1, 2:], p[:-2, 1:-1], p[2:, 1:-1]
        across = np.exp(-((abs(left - d) - abs(right - d)) ** 2))  # little across a step of depth
        along = np.exp(-((abs(up - d) - abs(down - d)) ** 2))
        weight = across + along
        near = (across * (left + right) + along * (up + down)) / (2 * np.maximum(weight, 1e-12))
        surface = np.where(weight > 1e-12, near, d)
        disparity = ((sure * (whole + offset) + smooth * surface) / (sure + smooth)).astype(np.float32)
    return disparity


def pair_depth(pair, window, smooth):
    images, masks, sides = [pair.a.astype(np.float32), pair.b.astype(np.float32)], [pair.mask_a, pair.mask_b], (1, -1)
    levels = max(0, int(np.floor(np.log2(min(images[0].shape) / COARSEST_PX))))
    found = None
    for level in range(levels, -1, -1):
        width, height = (max(8, n >> level) for n in pair.size)
        scale = width / pair.size[0]
        a, b = (cv2.resize(i, (width, height), interpolation=cv2.INTER_AREA) for i in images)
        m = [cv2.resize(i.astype(np.uint8), (width, height), interpolation=cv2.INTER_NEAREST) > 0 for i in masks]
        low, high = int(np.floor(pair.low * scale)) - 2, int(np.ceil(pair.high * scale)) + 2
        errors = Errors.both(a, b, low, high, window)
        if found is None:
            start, reach = [np.full((height, width), 0.5 * (low + high), np.float32)] * 2, (high - low + 1) // 2
        else:
            grow = width / found[0].shape[1]
            start, reach = [cv2.resize(d, (width, height), interpolation=cv2.INTER_LINEAR) * grow for d in found], 2
        found = [e.search(s, reach) for e, s in zip(errors, start)]
        for _ in range(2):  # what does not agree is searched again about its neighbours
            good = [consistent(found[k], found[1 - k], sides[k], m[k]) for k in (0, 1)]
            around = [fill(np.where(g, d, np.nan), i) for g, d, i in zip(good, found, m)]
            found = [np.where(g, d, e.search(r, 1)) for g, d, e, r in zip(good, found, errors, around)]
        good = [consistent(found[k], found[1 - k], sides[k], m[k]) for k in (0, 1)]
        found = [fill(np.where(g, d, np.nan), i) for g, d, i in zip(good, found, m)]
        found = [refine(e, d, smooth) for e, d in zip(errors, found)]
    return pair.depth(np.where(pair.mask_a, found[0], np.nan))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset")
    parser.add_argument("answer")
    parser.add_argument("--window", type=int, default=11)
    parser.add_argument("--smooth", type=float, default=0.5)
    args = parser.parse_args()
    cv2.setNumThreads(1)
    dataset.answer(args.dataset, args.answer, lambda pair: pair_depth(pair, args.window, args.smooth))


if __name__ == "__main__":
    main()
