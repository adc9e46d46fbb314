"""Second implementation of C1 to C7 of the protocol, written from its text, by brute force; no thinning.

Reads one sequence as JSON from standard input and prints {metric: value}, null for an infinite value; what is left out
is not there. Figures that the scorer takes from errors kept in single precision are rounded alike.
"""

import json
import sys

import numpy as np

case = json.load(sys.stdin)
RATE, FRAMES = case["rate_hz"], case["frames"]
N = len(FRAMES)
STEP, SPACING, REACH = 0.5, 5.0, 5.0
OUT = {}


def put(name, value):
    OUT[name] = float(value) if np.isfinite(value) else None


def quantile(values, percent):
    ordered = np.sort(values)
    return ordered[max(-(-len(ordered) * percent // 100), 1) - 1] if len(ordered) else np.inf


def single(values):
    return np.array(values, dtype=np.float32).astype(float)


class Strand:
    def __init__(self, points):
        p = np.array(points, dtype=np.float32)
        d = p[1:] - p[:-1]
        steps = np.sqrt((d[:, 0] * d[:, 0] + d[:, 1] * d[:, 1]) + d[:, 2] * d[:, 2]).astype(float)
        self.p, self.arc = p.astype(float), np.concatenate([[0.0], np.cumsum(steps)])
        self.length = self.arc[-1]
        self.samples = int(np.floor(self.length / STEP + 0.5))

    def at(self, s):
        """Place and unit direction at an arc length."""
        k = min(max(int(np.searchsorted(self.arc, s)) - 1, 0), len(self.p) - 2)
        d = self.p[k + 1] - self.p[k]
        along = (s - self.arc[k]) / (self.arc[k + 1] - self.arc[k])
        return self.p[k] + along * d, d / np.linalg.norm(d), k, along


class Pieces:
    """All pieces of a set of strands."""

    def __init__(self, strands):
        use = [(k, s) for k, s in enumerate(strands) if s.samples]
        none = np.zeros((0, 3))
        self.a = np.concatenate([none] + [s.p[:-1] for _, s in use])
        self.b = np.concatenate([none] + [s.p[1:] for _, s in use])
        self.owner = np.concatenate([np.zeros(0, int)] + [np.full(len(s.p) - 1, k) for k, s in use])
        self.rank = np.concatenate([np.zeros(0, int)] + [np.arange(len(s.p) - 1) for _, s in use])

    def distances(self, x):
        u = self.b - self.a
        along = np.clip(((x - self.a) * u).sum(axis=1) / (u * u).sum(axis=1), 0, 1)
        return np.linalg.norm(self.a + along[:, None] * u - x, axis=1), along

    def nearest(self, x, t):
        """Index and distance of the nearest piece; of pieces equally near the one of the smallest angle."""
        if len(self.a) == 0:
            return None, np.inf, 0.0
        d, along = self.distances(x)
        u = self.b - self.a
        sine = np.linalg.norm(np.cross(u, t), axis=1) / np.linalg.norm(u, axis=1)
        i = np.where(d <= d.min() + 1e-9, sine, np.inf).argmin()
        return i, d[i], along[i]


class Frame:
    def __init__(self, f):
        self.true = [Strand(s) for s in f["true"]]
        self.pieces = Pieces(self.true)
        self.seen_by = f["seen_by"]
        self.estimated = [Strand(s) for s in f["estimated"]]
        self.own = Pieces(self.estimated)
        self.names = f["ids"]
        self.of_name = {n: k for k, n in enumerate(self.names or [])}
        self.z_true, self.z = f["z_true"], f["z"]
        # Points on estimated strands: strand, arc length, place, direction.
        self.spots = []
        for k, s in enumerate(self.estimated):
            for i in range(int(np.floor(s.length / SPACING + 0.5))):
                arc = (i + 0.5) * SPACING
                self.spots.append((k, arc, *s.at(arc)[:2]))

    def cameras(self, strand, arc):
        n = len(self.seen_by[strand])
        return self.seen_by[strand][min(int(arc / STEP), n - 1)] if n else 0

    def find(self, name, arc):
        k = self.of_name.get(name)
        if k is None or arc > self.estimated[k].length:
            return None
        return self.estimated[k].at(arc)


frames = [Frame(f) for f in FRAMES]


def material(frame, strand, rank, along):
    p = frames[frame].true[strand].p
    return p[rank] + along * (p[rank + 1] - p[rank])


class Carrier:
    """The true motion at a point of a frame."""

    def __init__(self, frame, x, t):
        f = frames[frame]
        i, distance, along = f.pieces.nearest(x, t)
        self.there = distance <= REACH
        if not self.there:
            return
        self.strand, self.rank, self.along = f.pieces.owner[i], f.pieces.rank[i], along
        arc = f.true[self.strand].arc[self.rank : self.rank + 2]
        self.there = f.cameras(self.strand, arc[0] + along * (arc[1] - arc[0])) != 0
        self.start = self.place(frame)
        d, _ = f.pieces.distances(self.start)
        nearest = []
        for strand in np.unique(f.pieces.owner):
            own = np.flatnonzero(f.pieces.owner == strand)
            k = own[np.flatnonzero(d[own] <= d[own].min() + 1e-9)[0]]
            if d[k] <= 30:
                nearest.append((d[k], strand, f.pieces.rank[k]))
        self.ring = [(strand, rank) for _, strand, rank in sorted(nearest)[:8]]
        self.ends = self.ends_in(frame)

    def place(self, frame):
        return material(frame, self.strand, self.rank, self.along)

    def ends_in(self, frame):
        return np.array([frames[frame].true[s].p[r + e] for s, r in self.ring for e in (0, 1)])

    def turn(self, frame):
        """The rotation of least squares by singular values (Kabsch), with the pull towards none."""
        p, q = self.ends - self.ends.mean(axis=0), self.ends_in(frame)
        q = q - q.mean(axis=0)
        u, _, vt = np.linalg.svd(p.T @ q + 1e-6 * (p * p).sum() * np.eye(3))
        sign = np.diag([1, 1, np.sign(np.linalg.det(vt.T @ u.T))])
        return vt.T @ sign @ u.T

    def local(self, frame, x):
        return self.turn(frame).T @ (x - self.place(frame))

    def carried(self, frame, x):
        return self.place(frame) + self.turn(frame) @ (x - self.start)


jitter, flow, forth, back = [], [], [], []
for t, f in enumerate(frames):
    for k, arc, x, direction in f.spots:
        c = Carrier(t, x, direction)
        if not c.there:
            continue
        name = f.names[k] if f.names else None
        near = [frames[s].find(name, arc) if 0 <= s < N else None for s in (t - 1, t + 1)]
        if t + 1 < N:
            forth.append(frames[t + 1].own.nearest(c.carried(t + 1, x), direction)[1])
        if t > 0:
            back.append(frames[t - 1].own.nearest(c.carried(t - 1, x), direction)[1])
        if near[1] is not None:
            after = c.local(t + 1, near[1][0])
            flow.append(np.linalg.norm(after - (x - c.start)))
            if near[0] is not None:
                before = c.local(t - 1, near[0][0])
                jitter.append(np.linalg.norm(before - 2 * (x - c.start) + after))

mean = lambda v: np.mean(v) if len(v) else np.inf
if N >= 3:
    put("C1.jitter.mean", mean(jitter))
    put("C1.jitter.median", quantile(single(jitter), 50))
    put("C1.jitter.p95", quantile(single(jitter), 95))
    put("C1.acceleration", mean(jitter) * RATE**2)
    put("C1.noise_sd", mean(jitter) / (np.sqrt(6) * np.sqrt(8 / np.pi)))
change = (mean(forth) + mean(back)) / 2
put("C2.regrown.mean", change)
put("C2.regrown.median", quantile(single(forth + back), 50))
if case["floor_mm"] is not None:
    put("C2.above_floor", change - case["floor_mm"])
put("C6.flow.mean", mean(flow))
put("C6.flow.median", quantile(single(flow), 50))
put("C6.flow.p90", quantile(single(flow), 90))

# The envelope, at material points of the first frame's samples.
camera = case["camera"]
errors, depths = [], []
for strand, s in enumerate(frames[0].true):
    for i in range(s.samples):
        _, _, rank, along = s.at((i + 0.5) * STEP)
        e, series = [], []
        for t, f in enumerate(frames):
            arc = f.true[strand].arc[rank : rank + 2]
            x = material(t, strand, rank, along) @ np.array(camera["R"]).reshape(3, 3) + camera["t"]
            px = np.floor(x[:2] / x[2] * camera["focal"] + camera["principal"]).astype(int)
            inside = (px >= 0).all() and px[0] < camera["width"] and px[1] < camera["height"]
            seen = f.cameras(strand, arc[0] + along * (arc[1] - arc[0])) & 1 and inside
            at = px[1] * camera["width"] + px[0]
            wanted = seen and f.z_true[at] is not None
            answered = wanted and f.z is not None and f.z[at] is not None
            if wanted:
                e.append(f.z[at] - f.z_true[at] if answered else None)
            series.append((f.z[at], x[2]) if answered else None)
        errors.append(e)
        depths.append(series)


def deviation(e):
    there = [v for v in e if v is not None]
    return np.std(there, ddof=1) if len(there) >= 2 and 2 * len(there) >= len(e) else np.inf


sd = [deviation(e) for e in errors if len(e) >= max(min(10, N), 2)]
put("C3.flicker.p50", quantile(sd, 50))
put("C3.flicker.p95", quantile(sd, 95))

# Points of the first frame, followed.
followed = []
for k, arc, x, direction in frames[0].spots:
    c = Carrier(0, x, direction)
    if c.there and frames[0].names:
        followed.append((frames[0].names[k], arc, x, c))


def on_strand(frame, strand, found):
    if found is None:
        return False
    s = frames[frame].true[strand]
    own = Pieces([s])
    u = own.b - own.a
    angle = np.abs(u @ found[1]) / np.linalg.norm(u, axis=1) >= np.cos(np.radians(20))
    return bool(((own.distances(found[0])[0] <= 2) & angle).any())


drift, away, alive, paths = [], [], [], [[] for _ in followed]
for t, f in enumerate(frames):
    here = [f.find(name, arc) for name, arc, _, _ in followed]
    drift.append(
        [
            np.inf if h is None else np.linalg.norm(c.local(t, h[0]) - (x - c.start))
            for h, (_, _, x, c) in zip(here, followed)
        ]
    )
    away.append(np.sqrt(np.mean([((c.place(t) - c.start) ** 2).sum() for _, _, _, c in followed])) if followed else np.inf)
    alive.append([on_strand(t, c.strand, h) for h, (_, _, _, c) in zip(here, followed)])
    for path, h, (_, _, _, c) in zip(paths, here, followed):
        path.append(None if h is None else (h[0], c.place(t)))
put("C4.drift.median", quantile(drift[-1], 50))
put("C4.drift.rate", quantile(drift[-1], 50) * RATE / (N - 1))
put("C4.loop.median", quantile(drift[N // 2 + int(np.argmin(away[N // 2 :]))], 50))
good = np.array(alive[0], bool)
for seconds in (1, 2):
    k = round(seconds * RATE)
    if 0 < k < N:
        put(f"C7.survival_{seconds}s", np.array(alive[k])[good].mean() if good.any() else 0.0)


def responses(prefix, series):
    """series: [path][frame] of estimated and true coordinate."""
    if not series:
        return
    s = np.array(series, dtype=float)
    t = np.arange(N)
    w = 0.5 - 0.5 * np.cos(2 * np.pi * (t + 0.5) / N)
    w = w / w.sum()
    centred = s - (w[:, None] * s).sum(axis=1, keepdims=True)
    y = s[:, :, 1]
    mean = (w * y).sum(axis=1, keepdims=True)
    later = np.concatenate([y[:, 1:], y[:, -1:]], axis=1) - mean
    whole = np.sqrt(y.var(axis=1).mean())
    for f in (1, 2, 4, 8):
        ks = [k for k in range(1, N) if f / np.sqrt(2) <= k * RATE / N <= f * np.sqrt(2)]
        if not ks or ks[-1] > N // 2:
            continue
        cross, magnitude, power, advance = 0, 0, 0, 0
        for k in ks:
            wave = w * np.exp(-2j * np.pi * k * t / N)
            X, Y = centred[:, :, 0] @ wave, centred[:, :, 1] @ wave
            C = (X * Y.conj()).sum()
            cross, magnitude, power = cross + C, magnitude + abs(C), power + (abs(Y) ** 2).sum()
            advance += (later @ wave * Y.conj()).sum()
        rms = np.sqrt(2 * power / len(s))
        if rms <= max(0.05, 0.01 * whole):
            continue
        put(f"{prefix}log2_gain_{f}hz", np.log2(magnitude / power))
        put(f"{prefix}lag_{f}hz", -np.angle(cross) / (np.angle(advance) * RATE) * 1000)


kept = [p for p in paths if all(v is not None for v in p)]
responses("C5.", [[(x[a], y[a]) for x, y in p] for p in kept for a in range(3)])


def filled(series):
    there = [t for t, v in enumerate(series) if v is not None]
    both = np.array([series[t] for t in there])
    return np.column_stack([np.interp(np.arange(N), there, both[:, i]) for i in (0, 1)])


responses("C5.depth.", [filled(s) for s in depths if 2 * sum(v is not None for v in s) >= N])
json.dump(OUT, sys.stdout)
