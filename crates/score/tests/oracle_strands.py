"""Second implementation of B1 to B6 of the protocol, written from its text alone, by brute force; no thinning, no nulls.

Reads one case as JSON from standard input and prints {metric: value} of the method, null for an infinite value.
"""

import json
import sys
from itertools import product

import numpy as np

case = json.load(sys.stdin)
OUT = {}
STEP = 0.5


def put(name, value):
    OUT[name] = float(value) if np.isfinite(value) else None


def polyline(strand):
    p = np.array(strand, dtype=np.float32)
    d = p[1:] - p[:-1]
    steps = np.sqrt((d[:, 0] * d[:, 0] + d[:, 1] * d[:, 1]) + d[:, 2] * d[:, 2]).astype(float)
    return p.astype(float), np.concatenate([[0.0], np.cumsum(steps)])


def place(p, arc, s):
    return np.column_stack([np.interp(s, arc, p[:, axis]) for axis in range(3)])


class Side:
    """Samples and pieces of a set of strands."""

    def __init__(self, strands):
        self.lines = [polyline(s) for s in strands]
        pos, tan, weight, owner, rank = [], [], [], [], []
        a, b, piece_owner, piece_arc = [], [], [], []
        for k, (p, arc) in enumerate(self.lines):
            n = int(np.floor(arc[-1] / STEP + 0.5))
            if n == 0:
                continue
            s = (np.arange(n) + 0.5) * STEP
            segment = np.clip(np.searchsorted(arc, s) - 1, 0, len(arc) - 2)
            d = p[1:] - p[:-1]
            u = d / np.linalg.norm(d, axis=1)[:, None]
            pos.append(place(p, arc, s))
            tan.append(u[segment])
            w = np.full(n, STEP)
            w[-1] = arc[-1] - (n - 1) * STEP
            weight.append(w)
            owner.append(np.full(n, k))
            rank.append(np.arange(n))
            a.append(p[:-1])
            b.append(p[1:])
            piece_owner.append(np.full(len(d), k))
            piece_arc.append(np.column_stack([arc[:-1], arc[1:]]))
        self.pos, self.tan = np.concatenate(pos), np.concatenate(tan)
        self.weight, self.owner, self.rank = np.concatenate(weight), np.concatenate(owner), np.concatenate(rank)
        self.a, self.b = np.concatenate(a), np.concatenate(b)
        self.piece_owner, self.piece_arc = np.concatenate(piece_owner), np.concatenate(piece_arc)
        self.lo, self.hi = np.zeros(len(self.a)), np.ones(len(self.a))

    def cut(self, keep):
        """The same pieces cut to the stretches for which keep[strand][sample] is true."""
        out = object.__new__(Side)
        rows, lo, hi = [], [], []
        for i, k in enumerate(self.piece_owner):
            start, end = self.piece_arc[i]
            n = len(keep[k])
            for j in np.flatnonzero(keep[k]):
                f, t = STEP * j, self.lines[k][1][-1] if j == n - 1 else STEP * (j + 1)
                f, t = max(f, start), min(t, end)
                if t > f:
                    rows.append(i)
                    lo.append((f - start) / (end - start))
                    hi.append((t - start) / (end - start))
        out.a, out.b = self.a[rows], self.b[rows]
        out.piece_owner, out.piece_arc = self.piece_owner[rows], self.piece_arc[rows]
        out.lo, out.hi = np.array(lo), np.array(hi)
        return out


def against(points, tangents, side):
    """Distance, angle in degrees, position on the piece, by [point][piece]; signed cosine too."""
    u = side.b - side.a
    uu = (u * u).sum(axis=1)
    along = np.clip(((points[:, None] - side.a) * u).sum(axis=2) / uu, side.lo, side.hi)
    distance = np.linalg.norm(side.a + u * along[..., None] - points[:, None], axis=2)
    t = np.broadcast_to(tangents[:, None], (len(points), len(u), 3))
    cross = np.linalg.norm(np.cross(t, u[None]), axis=2)
    dot = (t * u).sum(axis=2)
    return distance, np.degrees(np.arctan2(cross, np.abs(dot))), along, dot


def nearest(distance, angle, allowed=None):
    d = distance if allowed is None else np.where(allowed, distance, np.inf)
    least = d.min(axis=1)
    tied = d <= least[:, None] + 1e-9
    return np.where(tied, angle, np.inf).argmin(axis=1), least


true, est = Side(case["true"]), Side(case["estimated"])
cameras = [np.array([bin(b).count("1") for b in s]) for s in case["seen_by"]]
cameras_of_sample = np.concatenate([c for c in cameras if len(c)])
sets = {m: true.cut([c >= m for c in cameras]) for m in (0, 1, 2)}

t2e = against(true.pos, true.tan, est)
e2t = {m: against(est.pos, est.tan, sets[m]) for m in sets}
full = against(est.pos, est.tan, true)
near, near_mm = nearest(full[0], full[1])
index = np.arange(len(near))
near_deg = full[1][index, near]


def cameras_at(piece, along):
    start, end = true.piece_arc[piece].T
    arc = start + along * (end - start)
    owner = true.piece_owner[piece]
    return np.array([cameras[k][min(int(s / STEP), len(cameras[k]) - 1)] for k, s in zip(owner, arc)])


near_cameras = cameras_at(near, full[2][index, near])

# Free space: in front of the first hair or the head in some camera.
free = np.zeros(len(est.pos), bool)
for c in case["cameras"]:
    p = est.pos @ np.array(c["R"]).reshape(3, 3) + c["t"]
    uv = p[:, :2] / p[:, 2:] * c["focal"] + c["principal"]
    seen = (p[:, 2] > 0) & (uv >= 0).all(axis=1) & (uv < (c["width"], c["height"])).all(axis=1)
    first = np.array([np.inf if z is None else z for z in c["first"]]).reshape(c["height"], c["width"])
    px = uv[seen].astype(int)
    free[seen] |= p[seen, 2] < first[px[:, 1], px[:, 0]]


def layer(m):
    return np.ones(len(near), bool) if m == 0 else (near_cameras >= m) & (near_mm <= 5)


def observed(m, d, a):
    other = (near_mm <= d) & (near_deg <= a) & (near_cameras < m)
    return layer(m) | (free & ~other)


def within(q, d, a, mode):
    if mode == "any":
        return ((q[0] <= d) & (q[1] <= a)).any(axis=1)
    i, least = nearest(q[0], q[1])
    return (least <= d) & (q[1][np.arange(len(i)), i] <= a)


def f_score(p, r):
    return 2 * p * r / (p + r) if p + r > 0 else 0.0


def share(hit, weight):
    return weight[hit].sum() / weight.sum() if len(weight) else 0.0


PAIRS = ((1, 10), (2, 20), (3, 30), (4, 40))


def b1(m, mode, d, a):
    wanted = cameras_of_sample >= m
    r = share(within(t2e, d, a, mode)[wanted], true.weight[wanted])
    seen = observed(m, d, a)
    p = share(within(e2t[m], d, a, mode)[seen], est.weight[seen])
    return p, r, f_score(p, r)


for m, name in ((2, ""), (1, "v1."), (0, "full.")):
    for mode, suffix in (("any", ""), ("nearest", "nearest.")):
        for d, a in PAIRS:
            for what, v in zip(("precision", "recall", "f"), b1(m, mode, d, a)):
                put(f"B1.{name}{suffix}{what}_{d}mm", v)
grid = [0.25, 0.5, 1, 2, 3, 4]
f = [b1(2, "any", d, 20)[2] for d in grid]
put("B1.f_auc", sum((f[i] + f[i + 1]) / 2 * (grid[i + 1] - grid[i]) for i in range(5)) / 3.75)
put("B1.unobserved", 1 - est.weight[observed(2, 2, 20)].sum() / est.weight.sum())

reference = case["cameras"][0]


def in_reference(points):
    return points @ np.array(reference["R"]).reshape(3, 3) + reference["t"]


def cell_weights(points):
    out = np.zeros(len(points))
    for shift in product((0, 0.5), repeat=3):
        cell = np.floor(in_reference(points) / 5 + shift).astype(int)
        _, where, counts = np.unique(cell, axis=0, return_inverse=True, return_counts=True)
        out += 1 / (len(counts) * counts[where.ravel()]) / 8
    return out


for d, a in PAIRS:
    wanted, seen = cameras_of_sample >= 2, observed(2, d, a)
    r = cell_weights(true.pos[wanted])[within(t2e, d, a, "any")[wanted]].sum()
    p = cell_weights(est.pos[seen])[within(e2t[2], d, a, "any")[seen]].sum()
    for what, v in zip(("precision", "recall", "f"), (p, r, f_score(p, r))):
        put(f"B1.voxel.{what}_{d}mm", v)

for d, a in PAIRS:

    def vertices(of, among):
        u = of.b - of.a
        u = u / np.linalg.norm(u, axis=1)[:, None]
        q = against(of.a, u, among)
        q = (np.linalg.norm(of.a[:, None] - among.a, axis=2),) + q[1:]
        return within(q, d, a, "any").mean()

    p, r = vertices(est, true), vertices(true, est)
    for what, v in zip(("precision", "recall", "f"), (p, r, f_score(p, r))):
        put(f"B1.legacy-vertex.{what}_{d}mm", v)


def quantiles(name, values, weight):
    order = np.argsort(values, kind="stable")
    running = np.cumsum(weight[order]) / weight.sum()
    for label, q in (("median", 0.5), ("p90", 0.9), ("p95", 0.95)):
        put(f"{name}.{label}", values[order][np.searchsorted(running, q - 1e-12)])


wanted = cameras_of_sample >= 2
i, least = nearest(t2e[0], t2e[1])
quantiles("B2.to_estimate.distance", least[wanted], true.weight[wanted])
quantiles("B2.to_estimate.angle", t2e[1][np.arange(len(i)), i][wanted], true.weight[wanted])
taken = layer(2) | free
quantiles("B2.to_truth.distance", near_mm[taken], est.weight[taken])
quantiles("B2.to_truth.angle", near_deg[taken], est.weight[taken])

# Identity.
NT, NE = len(case["true"]), len(case["estimated"])
A, same = np.zeros((NT, NE)), np.zeros((NT, NE))
i, least = nearest(t2e[0], t2e[1], t2e[1] <= 20)
for k in np.flatnonzero(wanted & (least <= 2)):
    j = est.piece_owner[i[k]]
    A[true.owner[k], j] += true.weight[k]
    same[true.owner[k], j] += true.weight[k] * (t2e[3][k, i[k]] > 0)
B, counted = np.zeros((NT, NE)), 0.0
i, least = nearest(full[0], full[1], full[1] <= 20)
hit = least <= 2
at = cameras_at(i, full[2][index, i])
for k in index:
    if hit[k]:
        if at[k] >= 2:
            B[true.piece_owner[i[k]], est.owner[k]] += est.weight[k]
            counted += est.weight[k]
    elif observed(2, 2, 20)[k]:
        counted += est.weight[k]
W = np.round(np.minimum(A, B) * 1000)


def heaviest(w):
    """Maximum-weight matching by the Hungarian method in its textbook O(n³) form, on the square padded problem."""
    n = max(w.shape)
    cost = np.zeros((n + 1, n + 1))
    cost[1 : w.shape[0] + 1, 1 : w.shape[1] + 1] = -w
    u, v, match, way = np.zeros(n + 1), np.zeros(n + 1), np.zeros(n + 1, int), np.zeros(n + 1, int)
    for row in range(1, n + 1):
        match[0], j0 = row, 0
        least, used = np.full(n + 1, np.inf), np.zeros(n + 1, bool)
        while True:
            used[j0] = True
            slack = cost[match[j0]] - u[match[j0]] - v
            better = ~used & (slack < least)
            better[0] = False
            least[better], way[better] = slack[better], j0
            j1 = np.where(used, np.inf, np.where(np.arange(n + 1) == 0, np.inf, least)).argmin()
            delta = least[j1]
            u[match[used]] += delta
            v[used] -= delta
            least[~used] -= delta
            j0 = j1
            if match[j0] == 0:
                break
        while j0:
            match[j0] = match[way[j0]]
            j0 = way[j0]
    return [(match[j] - 1, j - 1) for j in range(1, n + 1)]


pairs = [(i, j) for i, j in heaviest(W) if i < NT and j < NE and W[i, j] > 0]
common = sum(min(A[p], B[p]) for p in pairs)
length = true.weight[wanted].sum()
put("B3.idr", common / length)
put("B3.idp", common / counted)
put("B3.idf1", common / ((length + counted) / 2))


def partners(m):
    rows = m[m.sum(axis=1) > 0]
    total = rows.sum(axis=1)
    return (total * total**2 / (rows**2).sum(axis=1)).sum() / total.sum()


put("B3.fragmentation", partners(A))
put("B3.merging", partners(B.T))
put("B4.direction", sum(same[p] for p in pairs) / sum(A[p] for p in pairs))

roots = np.array([s[0] for s in case["estimated"]], dtype=float)
true_roots = np.array([s[0] for s in case["true"]], dtype=float)
error = np.sort(np.linalg.norm(roots[:, None] - true_roots, axis=2).min(axis=1))
at_percent = lambda v, q: v[max(-(-len(v) * q // 100), 1) - 1]
put("B4.root_error.median", at_percent(error, 50))
put("B4.root_error.p90", at_percent(error, 90))


def wasserstein(x, y):
    both = np.sort(np.concatenate([x, y]))
    cdf = lambda v: np.searchsorted(np.sort(v), both[:-1], side="right") / len(v)
    return (np.abs(cdf(x) - cdf(y)) * np.diff(both)).sum()


put("B5.length_w1", wasserstein(np.array([l[1][-1] for l in true.lines]), np.array([l[1][-1] for l in est.lines])))


def curvatures(side):
    out = []
    for p, arc in side.lines:
        q = place(p, arc, np.arange(0, int(arc[-1] // 2.5) + 1) * 2.5)
        x, y, z = q[:-2], q[1:-1], q[2:]
        norm = lambda v: np.linalg.norm(v, axis=1)
        out.append(2000 * norm(np.cross(y - x, z - x)) / (norm(y - x) * norm(z - y) * norm(x - z)))
    return np.concatenate(out)


put("B5.curvature_w1", wasserstein(curvatures(true), curvatures(est)))


def cells(side):
    out = {}
    for key, w in zip(map(tuple, np.floor(in_reference(side.pos) / 5).astype(int)), side.weight):
        out[key] = out.get(key, 0.0) + w
    return out


of_true, of_est = cells(true), cells(est)
visible = set(map(tuple, np.floor(in_reference(true.pos[wanted]) / 5).astype(int)))
with np.errstate(divide="ignore"):
    logs = np.array([np.log2(of_est.get(c, 0.0) / of_true[c]) for c in visible])
put("B6.log2_ratio.median", at_percent(np.sort(logs), 50))
put("B6.log2_ratio.error_median", at_percent(np.sort(np.abs(logs)), 50))
put("B6.log2_ratio.error_p90", at_percent(np.sort(np.abs(logs)), 90))
put("B6.log2_total", np.log2(sum(of_est.values()) / sum(of_true.values())))
put("B6.outside", sum(w for c, w in of_est.items() if c not in of_true) / sum(of_est.values()))
json.dump(OUT, sys.stdout)
