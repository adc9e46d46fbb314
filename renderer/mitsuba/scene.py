"""Mitsuba scenes from exchanged arrays. Millimetres throughout; curve files carry nine digits, which is every
bit of a float32."""

import os
import tempfile

import mitsuba as mi
import numpy as np


def strand_ranges(arrays):
    offsets = arrays["offsets"].astype(np.int64)
    return list(zip(offsets[:-1], offsets[1:]))


def write_curves(path, curves):
    """A curve file from arrays of (x, y, z, radius) rows."""
    with open(path, "w", encoding="ascii") as out:
        for rows in curves:
            out.write("".join("%.9g %.9g %.9g %.9g\n" % tuple(r) for r in rows.tolist()))
            out.write("\n")


def chains(arrays):
    """Each strand as one polyline, for `linearcurve`: chains of round cones."""
    rows = np.column_stack([arrays["points"], arrays["radii"]]).astype(np.float32)
    return [rows[a:b] for a, b in strand_ranges(arrays)]


def open_cones(arrays):
    """Each segment as its own four control points p0-(p1-p0), p0, p1, p1+(p1-p0): a cubic B-spline that is the
    straight segment itself. (linearcurve leaves dp_du at 0, so its shading frame is of no use.)"""
    rows = np.column_stack([arrays["points"], arrays["radii"]]).astype(np.float64)
    out = []
    for a, b in strand_ranges(arrays):
        for i in range(a, b - 1):
            p, q = rows[i], rows[i + 1]
            out.append(np.stack([2 * p - q, p, q, 2 * q - p]))
    return out


def hair_bsdf(optics):
    """Mitsuba's own `hair` (Chiang et al. 2016)."""
    return {
        "type": "hair",
        "longitudinal_roughness": optics["longitudinal_roughness"],
        "azimuthal_roughness": optics["azimuthal_roughness"],
        "scale_tilt": optics["scale_tilt_deg"],
        "int_ior": optics["index"],
        "ext_ior": 1.0,
        "sigma_a": {"type": "rgb", "value": list(optics["absorption_rgb"])},
    }


def curves(kind, rows, bsdf=None):
    """A curve shape; the file is read while the shape is made, so that it need not outlive this call."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "curves.txt")
        write_curves(path, rows)
        shape = {"type": kind, "filename": path}
        if bsdf is not None:
            shape["bsdf"] = bsdf
        return mi.load_dict(shape)


def sensor(camera, samples=1):
    """A camera in OpenCV's convention as a perspective sensor. Mitsuba's camera looks along +z with +x to the
    left and +y up."""
    width, height = camera["width"], camera["height"]
    fx, fy = camera["focal_px"]
    if abs(fx / fy - 1.0) > 1e-9:
        raise ValueError(f"camera {camera['name']}: Mitsuba has square pixels only, fx {fx}, fy {fy}")
    cx, cy = camera["principal_px"]
    rotation = np.array(camera["rotation"], dtype=np.float64)  # rows: camera from world
    translation = np.array(camera["translation_mm"], dtype=np.float64)
    to_world = np.eye(4)
    to_world[:3, :3] = rotation.T
    to_world[:3, 3] = -rotation.T @ translation
    to_world = to_world @ np.diag([-1.0, -1.0, 1.0, 1.0])
    return {
        "type": "perspective",
        "fov": float(np.degrees(2 * np.arctan(width / (2 * fx)))),
        "fov_axis": "x",
        "principal_point_offset_x": (width / 2 - cx) / width,
        "principal_point_offset_y": (height / 2 - cy) / height,
        "near_clip": 1.0,
        "far_clip": 1e5,
        "to_world": mi.ScalarTransform4f(to_world),
        "film": {
            "type": "hdrfilm",
            "width": width,
            "height": height,
            "rfilter": {"type": "box"},
            "pixel_format": "rgb",
            "component_format": "float32",
        },
        "sampler": {"type": "independent", "sample_count": samples},
    }


def rectangle(centre, half_u, half_v, radiance):
    """A one-sided rectangular light that shines along half_u x half_v."""
    normal = np.cross(half_u, half_v)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 3] = half_u, half_v, centre
    matrix[:3, 2] = normal / np.linalg.norm(normal)
    return {
        "type": "rectangle",
        "to_world": mi.ScalarTransform4f(matrix),
        # Black, or the light would scatter light itself.
        "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.0, 0.0, 0.0]}},
        "emitter": {"type": "area", "radiance": {"type": "rgb", "value": [float(r) for r in radiance]}},
    }
