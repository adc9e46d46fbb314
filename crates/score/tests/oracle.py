"""Second implementation of the protocol, written from its text alone: all metrics of the method, of NC, N2 and the
ceiling C, and what of N0 and N1 does not hang on random numbers.

Reads one case as JSON from standard input and prints {"subject metric": value}, null for an infinite value.
"""

import json
import sys

import numpy as np

case = json.load(sys.stdin)
W, H = case["width"], case["height"]
FOCAL, PRINCIPAL = np.array(case["focal"]), np.array(case["principal"])
OUT = {}
SUBJECT = "method"


def plane(name):
    return np.array([np.nan if v is None else v for v in case[name]], dtype=float)


def put(name, value):
    OUT[f"{SUBJECT} {name}"] = float(value) if np.isfinite(value) else None


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
z_true = plane("c50")


def a1(z, prefix, reference, region, px):
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


# Cells of 5 mm in eight shifted grids along the camera's axes.
index = np.flatnonzero(inner)
CENTRES = np.stack([np.arange(W * H) % W + 0.5, np.arange(W * H) // W + 0.5], axis=1)


def unprojected(pixels, depth):
    """Points in the reference camera's frame."""
    return np.column_stack([(CENTRES[pixels] - PRINCIPAL) / FOCAL * depth[:, None], depth])


points = unprojected(index, z_true[index])
weight = np.zeros(len(index))
for shift in np.ndindex(2, 2, 2):
    cells = np.floor(points / 5.0 + 0.5 * np.array(shift)).astype(int)
    _, where, counts = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    weight += 1.0 / (len(counts) * counts[where.ravel()]) / 8.0


def depths(z):
    size = a1(z, "A1", z_true, inner, True)
    a1(z, "A1.rim", z_true, rim, True)
    a1(z, "A1.first", plane("first"), inner, False)
    a1(z, "A1.c05", plane("c05"), inner, False)
    order = np.argsort(size, kind="stable")
    running = np.cumsum(weight[order])
    for name, q in (("median", 0.5), ("p90", 0.9), ("p95", 0.95)):
        put("A1.voxel." + name, size[order][np.searchsorted(running, q - 1e-12)])
    for mm in (1, 2, 5, 10):
        put(f"A1.voxel.over_{mm}mm", weight[size > mm].sum())


def completeness(z):
    put("A3.completeness", np.isfinite(z[mask]).mean())


def angles(prefix, degrees):
    put(prefix + ".median", quantile(degrees, 50))
    put(prefix + ".p90", quantile(degrees, 90))
    for limit in (10, 20, 30):
        put(f"{prefix}.within_{limit}deg", (degrees <= limit).mean())


def lines(axis, line):
    """Axes in the world, zero where absent; angles in the image, NaN where absent."""
    t, g = axis[mask], np.array(case["true_axis"])[mask]
    cross = np.linalg.norm(np.cross(t, g), axis=1)
    degrees = np.degrees(np.arctan2(cross, np.abs((t * g).sum(axis=1))))
    angles("A5", np.where((t == 0).all(axis=1), np.inf, degrees))
    doubled = np.angle(np.exp(2j * (line[mask] - plane("true_line")[mask])))
    angles("B7", np.where(np.isnan(line[mask]), np.inf, np.degrees(np.abs(doubled) / 2)))


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
    points, again = np.unique(points, axis=0, return_inverse=True)
    out = np.empty(len(points))
    for i, q in enumerate(points):
        along = np.clip(((q - a) * u).sum(axis=1) / uu, 0, 1)
        out[i] = np.sqrt(((a + u * along[:, None] - q) ** 2).sum(axis=1).min())
    return out[again.ravel()]


N, P = 16384, 1.324717957244746


def equal_parts(weights):
    """Which member holds the middle of each of N equal parts of the total weight."""
    return np.searchsorted(np.cumsum(weights), (np.arange(N) + 0.5) / N * weights.sum(), side="right")


def luo(samples):
    rays = samples - np.array(case["eye"])
    distance = nearest(samples)
    pushed = nearest(samples + 20 * rays / np.linalg.norm(rays, axis=1)[:, None])
    put("A2.within_10mm", (distance <= 10).mean())
    put("A2.median", quantile(distance, 50))
    put("A2.p95", quantile(distance, 95))
    put("A2.pushed.within_10mm", (pushed <= 10).mean())
    put("A2.pushed.median", quantile(pushed, 50))


def envelope_points(vertices, triangles):
    v = vertices[triangles]
    owner = equal_parts(np.linalg.norm(np.cross(v[:, 1] - v[:, 0], v[:, 2] - v[:, 0]), axis=1) / 2)
    k = np.arange(N)
    r, s = np.modf(k / P)[0], np.modf(k / (P * P))[0]
    fold = r + s > 1
    r, s = np.where(fold, 1 - r, r)[:, None], np.where(fold, 1 - s, s)[:, None]
    A, B, C = v[owner, 0], v[owner, 1], v[owner, 2]
    return A + (B - A) * r + (C - A) * s


CAMERAS = [
    {**c, "R": np.array(c["R"]).reshape(3, 3).T, "t": np.array(c["t"]), "mask": np.array(c["mask"]).reshape(H, W)}
    for c in case["cameras"]
]


def project(c, points):
    p = points @ c["R"].T + c["t"]
    return p[:, :2] / p[:, 2:] * c["focal"] + c["principal"]


def silhouettes(vertices, triangles):
    ious = []
    for i, c in enumerate(CAMERAS):
        uv = project(c, vertices)
        covered = np.zeros((H, W), bool)
        for t in triangles:
            q = uv[t]
            x0, y0 = np.floor(q.min(axis=0) - 1).clip(0).astype(int)
            x1, y1 = np.ceil(q.max(axis=0) + 1).clip(0, (W, H)).astype(int)
            px = np.stack(np.meshgrid(np.arange(x0, x1) + 0.5, np.arange(y0, y1) + 0.5), axis=-1)
            inside = np.ones(px.shape[:2], bool)
            e = np.roll(q, -1, axis=0) - q
            turn = np.sign(e[0, 0] * e[1, 1] - e[0, 1] * e[1, 0])
            for k in range(3):
                d = px - q[k]
                length = max(np.hypot(*e[k]), 1e-300)
                inside &= (e[k, 0] * d[..., 1] - e[k, 1] * d[..., 0]) * turn / length >= -1e-3
            covered[y0:y1, x0:x1] |= inside
        both, either = (covered & c["mask"]).sum(), (covered | c["mask"]).sum()
        ious.append(both / either)
        put(f"A4.iou.{i}", ious[-1])
    put("A4.iou.mean", np.mean(ious))
    put("A4.iou.min", np.min(ious))


z = plane("depth")
depths(z)
completeness(z)
field = np.array(case["re"]) + 1j * np.array(case["im"])
lines(np.array(case["axis"]), np.where(field == 0, np.nan, np.angle(field) / 2))
corners, faces = np.array(case["vertices"]), np.array(case["triangles"])
luo(envelope_points(corners, faces))
silhouettes(corners, faces)

# The visual hull along the reference rays.
reference = CAMERAS[0]
hair = np.flatnonzero(mask)
NEAR, FAR = case["near"], case["far"]
to_world = lambda p: (p - reference["t"]) @ reference["R"]


def world_at(pixels, depth):
    return to_world(unprojected(pixels, depth))


def inside_hull(depth):
    allowed = np.ones(len(hair), bool)
    for c in CAMERAS[1:]:
        uv = np.floor(project(c, world_at(hair, depth))).astype(int)
        seen = (uv >= 0).all(axis=1) & (uv < (W, H)).all(axis=1)
        allowed[seen] &= c["mask"][uv[seen, 1], uv[seen, 0]]
    return allowed


axis = lambda depth: to_world(np.array([[0.0, 0.0, depth]]))
travel = [np.hypot(*(project(c, axis(NEAR)) - project(c, axis(FAR)))[0]) for c in CAMERAS[1:]]
steps = int(np.clip(np.ceil(max(travel)), 64, 1024))
step = (FAR - NEAR) / steps
tried = NEAR + (np.arange(steps) + 0.5) * step
member = np.array([inside_hull(np.full(len(hair), d)) for d in tried])
# The nearest depth inside lies between the first probe inside and the one before it, or the nearest depth of all.
at_near = inside_hull(np.full(len(hair), NEAR))
front = tried[member.argmax(axis=0)]
behind = np.where(member[0], NEAR, front - step)
front = np.where(member[0] & at_near, NEAR, front)
for _ in range(8):
    middle = (behind + front) / 2
    inside = inside_hull(middle)
    front, behind = np.where(inside, middle, front), np.where(inside, behind, middle)
rank = member.cumsum(axis=0)
middles = tried[(member & (rank == (rank[-1] - 1) // 2 + 1)).argmax(axis=0)]


def null(name, depth, directions):
    """Directions in the reference camera's frame, one per hair pixel."""
    global SUBJECT
    SUBJECT = name
    axes, angle, z = np.zeros((W * H, 3)), np.full(W * H, np.nan), np.full(W * H, np.nan)
    axes[hair] = directions @ reference["R"]
    ray = (CENTRES[hair] - PRINCIPAL) / FOCAL
    image = FOCAL * (directions[:, :2] - ray * directions[:, 2:])
    angle[hair] = np.arctan2(image[:, 1], image[:, 0])
    if depth is None:
        z[hair] = 1.0
    else:
        z[hair] = np.float32(depth)
        depths(z)
        surface(z)
    completeness(z)
    lines(axes, angle)


def surface(z):
    answered = np.isfinite(z) & mask
    pixels = np.flatnonzero(answered)
    points = world_at(pixels, z[pixels])
    luo(points[equal_parts(z[pixels] ** 2)])
    name = np.cumsum(answered) - 1
    squares = [i for i in range(W * (H - 1)) if i % W + 1 < W and answered[[i, i + 1, i + W, i + W + 1]].all()]
    faces = [t for i in squares for t in ((i, i + W, i + 1), (i + 1, i + W, i + W + 1))]
    silhouettes(np.float32(points).astype(float), name[np.array(faces)])


enters = member.any(axis=0)
constant = np.sort(middles[enters])[(enters.sum() - 1) // 2]
front = np.where(enters, front, constant)
down = np.tile([0.0, 1.0, 0.0], (len(hair), 1))
null("NC", np.full(len(hair), constant), down)

map_of_front = np.full((H, W), np.nan)
map_of_front.ravel()[hair] = front
pad = np.pad(map_of_front, 9, constant_values=np.nan)
window = np.lib.stride_tricks.sliding_window_view(pad, (17, 17))
with np.errstate(invalid="ignore"):
    count = np.isfinite(window).sum(axis=(2, 3))
    smooth = np.nansum(window, axis=(2, 3)) / np.maximum(count, 1)
grid = np.stack(np.meshgrid(np.arange(-1, W + 1) + 0.5, np.arange(-1, H + 1) + 0.5), axis=-1)
grid = np.concatenate([(grid - PRINCIPAL) / FOCAL, np.ones(grid.shape[:2] + (1,))], axis=2) * smooth[..., None]
across, along = grid[1:-1, 2:] - grid[1:-1, :-2], grid[2:, 1:-1] - grid[:-2, 1:-1]
normal = np.cross(along, across).reshape(-1, 3)[hair]
normal /= np.linalg.norm(normal, axis=1)[:, None]
draped = down - normal * normal[:, 1:2]
null("N2", front, draped / np.linalg.norm(draped, axis=1)[:, None])

moments = np.zeros((3, 3))
for k in range(len(case["offsets"]) - 1):
    d = np.diff(strand_points[case["offsets"][k] : case["offsets"][k + 1]], axis=0).astype(float)
    moments += d.T @ (d / np.maximum(np.linalg.norm(d, axis=1), 1e-300)[:, None])
principal = np.linalg.eigh(moments)[1][:, -1]
null("N1", None, np.tile(reference["R"] @ principal, (len(hair), 1)))
SUBJECT = "N0"
completeness(np.where(mask, 1.0, np.nan))

# The ceiling: pixels whose 3x3 surroundings hold samples of which at least half are seen by a second camera.
SUBJECT = "C"
seen, again = np.zeros((H + 2, W + 2)), np.zeros((H + 2, W + 2))
for k in range(len(case["offsets"]) - 1):
    p = strand_points[case["offsets"][k] : case["offsets"][k + 1]]
    d = p[1:] - p[:-1]
    steps = np.sqrt((d[:, 0] * d[:, 0] + d[:, 1] * d[:, 1]) + d[:, 2] * d[:, 2]).astype(float)
    arc = np.concatenate([[0.0], np.cumsum(steps)])
    bits = np.array(case["seen_by"][case["sample_offsets"][k] : case["sample_offsets"][k + 1]])
    at = 0.5 * (np.arange(len(bits)) + 0.5)
    where = np.column_stack([np.interp(at, arc, p[:, axis].astype(float)) for axis in range(3)])
    uv = np.floor(project(reference, where)).astype(int)
    for (x, y), b in zip(uv, bits):
        if b & 1 and 0 <= x < W and 0 <= y < H:
            seen[y + 1, x + 1] += 1
            again[y + 1, x + 1] += bool(b & ~1)
box = lambda m: np.lib.stride_tricks.sliding_window_view(m, (3, 3)).sum(axis=(2, 3)).ravel()
confirmed = (box(seen) > 0) & (2 * box(again) >= box(seen))
z = np.where(confirmed & mask, z_true, np.nan)
depths(z)
completeness(z)
lines(np.where(confirmed[:, None], np.array(case["true_axis"]), 0), np.where(confirmed, plane("true_line"), np.nan))
surface(z)
json.dump(OUT, sys.stdout)
