"""Second implementation of the protocol (A1, A2, A3, A5, B7), written from its text alone.

Reads one case as JSON from standard input and prints {metric: value}, null for an infinite value.
"""

import json
import sys

import numpy as np

case = json.load(sys.stdin)
W, H = case["width"], case["height"]
FOCAL, PRINCIPAL = np.array(case["focal"]), np.array(case["principal"])
OUT = {}


def plane(name):
    return np.array([np.nan if v is None else v for v in case[name]], dtype=float)


def put(name, value):
    OUT[name] = float(value) if np.isfinite(value) else None


def quantile(values, percent):
    ordered = np.sort(values)
    return ordered[max(-(-len(ordered) * percent // 100), 1) - 1]


mask = np.array(case["mask"]).reshape(H, W)
padded = np.pad(mask, 2)
inner = mask.copy()
for dy in range(-2, 3):
    for dx in range(-2, 3):
        if np.hypot(dx, dy) <= 2:
            inner &= padded[2 + dy : 2 + dy + H, 2 + dx : 2 + dx + W]
mask, inner = mask.ravel(), inner.ravel()
rim = mask & ~inner
z_true, z = plane("c50"), plane("depth")


def a1(prefix, reference, region, px):
    e = z[region] - reference[region]
    there = np.isfinite(e)
    size = np.where(there, np.abs(e), np.inf)
    bias = quantile(e[there], 50)
    put(prefix + ".median", quantile(size, 50))
    put(prefix + ".p90", quantile(size, 90))
    put(prefix + ".p95", quantile(size, 95))
    put(prefix + ".mad", quantile(np.where(there, np.abs(e - bias), np.inf), 50))
    put(prefix + ".bias_mean", e[there].mean())
    put(prefix + ".bias_median", bias)
    for mm in (1, 2, 5, 10):
        put(f"{prefix}.over_{mm}mm", (size > mm).mean())
    if px:
        footprint = z_true[region] / np.sqrt(FOCAL[0] * FOCAL[1])
        for n in ("0.5", "1", "2", "4"):
            put(f"{prefix}.over_{n}px", (size > float(n) * footprint).mean())
    return size


size = a1("A1", z_true, inner, True)
a1("A1.rim", z_true, rim, True)
a1("A1.first", plane("first"), inner, False)
a1("A1.c05", plane("c05"), inner, False)

# Cells of 5 mm in eight shifted grids along the camera's axes.
index = np.flatnonzero(inner)
pixel = np.stack([index % W + 0.5, index // W + 0.5], axis=1)
zi = z_true[index]
points = np.column_stack([(pixel - PRINCIPAL) / FOCAL * zi[:, None], zi])
weight = np.zeros(len(index))
for shift in np.ndindex(2, 2, 2):
    cells = np.floor(points / 5.0 + 0.5 * np.array(shift)).astype(int)
    _, where, counts = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    weight += 1.0 / (len(counts) * counts[where.ravel()]) / 8.0
order = np.argsort(size, kind="stable")
running = np.cumsum(weight[order])
for name, q in (("median", 0.5), ("p90", 0.9), ("p95", 0.95)):
    put("A1.voxel." + name, size[order][np.searchsorted(running, q - 1e-12)])
for mm in (1, 2, 5, 10):
    put(f"A1.voxel.over_{mm}mm", weight[size > mm].sum())
put("A3.completeness", np.isfinite(z[mask]).mean())


def angles(prefix, degrees):
    put(prefix + ".median", quantile(degrees, 50))
    put(prefix + ".p90", quantile(degrees, 90))
    for limit in (10, 20, 30):
        put(f"{prefix}.within_{limit}deg", (degrees <= limit).mean())


t, g = np.array(case["axis"])[mask], np.array(case["true_axis"])[mask]
cross = np.linalg.norm(np.cross(t, g), axis=1)
degrees = np.degrees(np.arctan2(cross, np.abs((t * g).sum(axis=1))))
angles("A5", np.where((t == 0).all(axis=1), np.inf, degrees))

field = np.array(case["re"])[mask] + 1j * np.array(case["im"])[mask]
doubled = np.angle(field * np.exp(-2j * plane("true_line")[mask]))
angles("B7", np.where(field == 0, np.inf, np.degrees(np.abs(doubled) / 2)))

# The pieces of strand that the reference camera sees, one for each half millimetre and polyline segment.
strand_points = np.array(case["points"], dtype=np.float32)
pieces = []
for k in range(len(case["offsets"]) - 1):
    p = strand_points[case["offsets"][k] : case["offsets"][k + 1]]
    d = p[1:] - p[:-1]
    steps = np.sqrt((d[:, 0] * d[:, 0] + d[:, 1] * d[:, 1]) + d[:, 2] * d[:, 2]).astype(float)
    arc = np.concatenate([[0.0], np.cumsum(steps)])
    bits = np.array(case["seen_by"][case["sample_offsets"][k] : case["sample_offsets"][k + 1]])
    p = p.astype(float)
    for i in np.flatnonzero(bits & 1):
        lo, hi = 0.5 * i, arc[-1] if i == len(bits) - 1 else 0.5 * (i + 1)
        cuts = np.concatenate([[lo], arc[(arc > lo) & (arc < hi)], [hi]])
        ends = np.column_stack([np.interp(cuts, arc, p[:, axis]) for axis in range(3)])
        pieces.extend(zip(ends[:-1], ends[1:]))
a, b = np.array([q[0] for q in pieces]), np.array([q[1] for q in pieces])
u = b - a
uu = np.maximum((u * u).sum(axis=1), 1e-300)


def nearest(points):
    out = np.empty(len(points))
    for i, q in enumerate(points):
        along = np.clip(((q - a) * u).sum(axis=1) / uu, 0, 1)
        out[i] = np.sqrt(((a + u * along[:, None] - q) ** 2).sum(axis=1).min())
    return out


N, P = 16384, 1.324717957244746
v = np.array(case["vertices"])[np.array(case["triangles"])]
area = np.linalg.norm(np.cross(v[:, 1] - v[:, 0], v[:, 2] - v[:, 0]), axis=1) / 2
k = np.arange(N)
owner = np.searchsorted(np.cumsum(area), (k + 0.5) / N * area.sum(), side="right")
r, s = np.modf(k / P)[0], np.modf(k / (P * P))[0]
fold = r + s > 1
r, s = np.where(fold, 1 - r, r)[:, None], np.where(fold, 1 - s, s)[:, None]
A, B, C = v[owner, 0], v[owner, 1], v[owner, 2]
samples = A + (B - A) * r + (C - A) * s
rays = samples - np.array(case["eye"])
distance = nearest(samples)
pushed = nearest(samples + 20 * rays / np.linalg.norm(rays, axis=1)[:, None])
put("A2.within_10mm", (distance <= 10).mean())
put("A2.median", quantile(distance, 50))
put("A2.p95", quantile(distance, 95))
put("A2.pushed.within_10mm", (pushed <= 10).mean())
put("A2.pushed.median", quantile(pushed, 50))
json.dump(OUT, sys.stdout)
