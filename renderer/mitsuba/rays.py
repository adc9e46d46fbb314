"""Rays against Mitsuba scenes, one at a time in scalar variants and all at once in vectorised ones."""

import mitsuba as mi
import numpy as np

# Rays that a vectorised variant gets at once: bounds its memory.
BATCH = 1 << 18


def scalar():
    return mi.variant().startswith("scalar")


def intersect(scene, origins, directions):
    """First hits: distance (inf where there is none), primitive (-1), geometric normal, position."""
    n = len(origins)
    t = np.full(n, np.inf, np.float32)
    primitive = np.full(n, -1, np.int32)
    normal = np.zeros((n, 3), np.float32)
    position = np.zeros((n, 3), np.float32)
    if scalar():
        for i, (o, d) in enumerate(zip(origins.tolist(), directions.tolist())):
            si = scene.ray_intersect(mi.Ray3f(o, d))
            if si.is_valid():
                t[i], primitive[i], normal[i], position[i] = si.t, si.prim_index, si.n, si.p
        return t, primitive, normal, position
    for a in range(0, n, BATCH):
        part = slice(a, min(n, a + BATCH))
        si = scene.ray_intersect(vector_ray(origins[part], directions[part]))
        hit = np.array(si.is_valid())
        t[part] = np.where(hit, np.array(si.t), np.inf)
        primitive[part] = np.where(hit, np.array(si.prim_index).astype(np.int64), -1)
        normal[part] = np.where(hit, np.array(si.n), 0.0).T
        position[part] = np.where(hit, np.array(si.p), 0.0).T
    return t, primitive, normal, position


def blocked(scene, origins, directions, tmax):
    """Whether anything lies before `tmax`."""
    n = len(origins)
    out = np.zeros(n, np.uint8)
    if scalar():
        for i, (o, d, far) in enumerate(zip(origins.tolist(), directions.tolist(), tmax.tolist())):
            out[i] = scene.ray_test(shadow_ray(o, d, far))
        return out
    for a in range(0, n, BATCH):
        part = slice(a, min(n, a + BATCH))
        ray = vector_ray(origins[part], directions[part])
        ray.maxt = mi.Float(tmax[part].astype(np.float32))
        out[part] = np.array(scene.ray_test(ray))
    return out


def shadow_ray(origin, direction, maxt):
    ray = mi.Ray3f(origin, direction)
    ray.maxt = maxt
    return ray


def vector_ray(origins, directions):
    o = mi.Point3f(np.ascontiguousarray(origins.T, dtype=np.float32))
    d = mi.Vector3f(np.ascontiguousarray(directions.T, dtype=np.float32))
    return mi.Ray3f(o, d)
