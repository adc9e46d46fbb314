"""Opens layers with Pixar's USD and prints what it finds there as JSON: usd_reader.py PRIM LAYER [TIME ...]

Without times the values that hold for all time. Numbers of single precision are printed as their bits.
"""

import json
import struct
import sys

from pxr import Gf, Usd, UsdGeom, Vt

prim, path, times = sys.argv[1], sys.argv[2], [float(t) for t in sys.argv[3:]] or [Usd.TimeCode.Default()]
stage = Usd.Stage.Open(path)
geometry = stage.GetPrimAtPath(prim)


def bits(value):
    return struct.unpack("<I", struct.pack("<f", value))[0]


def plain(value):
    if isinstance(value, (str, int, type(None))):
        return value
    if isinstance(value, float):
        return bits(value)
    if isinstance(value, (Gf.Vec3f, Vt.FloatArray, Vt.Vec3fArray, Vt.IntArray, Vt.UInt64Array)):
        return [plain(v) for v in value]
    raise TypeError(f"{type(value)} is not expected here")


def at(time):
    attributes = {a.GetName(): plain(a.Get(time)) for a in geometry.GetAttributes() if a.HasAuthoredValue() or a.ValueMightBeTimeVarying()}
    boundable = UsdGeom.Boundable(geometry)
    own = UsdGeom.Boundable.ComputeExtentFromPlugins(boundable, time)
    return {"attributes": attributes, "computed_extent": plain(own) if own else None}


print(
    json.dumps(
        {
            "default": str(stage.GetDefaultPrim().GetPath()),
            "type": geometry.GetTypeName(),
            "up": UsdGeom.GetStageUpAxis(stage),
            "metres": UsdGeom.GetStageMetersPerUnit(stage),
            "rate": stage.GetTimeCodesPerSecond(),
            "from": stage.GetStartTimeCode(),
            "to": stage.GetEndTimeCode(),
            "interpolation": {p.GetPrimvarName(): p.GetInterpolation() for p in UsdGeom.PrimvarsAPI(geometry).GetPrimvars()},
            "widths": UsdGeom.BasisCurves(geometry).GetWidthsInterpolation() if geometry.IsA(UsdGeom.BasisCurves) else None,
            # Counted before the samples are listed, for which USD opens every layer.
            "values": [at(t) for t in times],
            "layers": len(stage.GetUsedLayers()),
            "samples": geometry.GetAttribute("points").GetTimeSamples(),
        }
    )
)
