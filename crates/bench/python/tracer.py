"""Mitsuba or embreex as the tracer that is timed: one JSON command a line in, one JSON answer a line out.

Started as `python tracer.py VARIANT`, where VARIANT is a variant of Mitsuba or `embreex`. Arrays are files of
little-endian 32-bit numbers in the folder that a command names.
"""

import json
import os
import resource
import sys
import time

import numpy as np


def array(folder, name, columns=1, kind="<f4"):
    data = np.fromfile(os.path.join(folder, name), kind)
    return data.reshape(-1, columns) if columns > 1 else data


def clock():
    return np.array([time.perf_counter(), time.process_time()])


def since(start):
    wall, cpu = clock() - start
    return {"wall_s": wall, "cpu_s": cpu}


class Embreex:
    """Triangles only: the module exposes no curves."""

    def hello(self, _):
        import importlib.metadata

        from embreex.rtcore_scene import EmbreeScene  # noqa: F401

        return {"version": "embreex " + importlib.metadata.version("embreex")}

    def load(self, command):
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        folder = command["folder"]
        vertices = array(folder, "vertices", 3)
        triangles = array(folder, "triangles", 3, "<u4")
        start = clock()
        self.scene = EmbreeScene()
        TriangleMesh(self.scene, vertices[triangles])
        # The module commits when the first ray comes.
        self.scene.run(np.zeros((1, 3), "<f4"), np.ones((1, 3), "<f4"))
        return since(start)

    def rays(self, command):
        folder = command["folder"]
        origins, directions = array(folder, "origins", 3), array(folder, "directions", 3)
        start = clock()
        hit = self.scene.run(origins, directions, query="INTERSECT", output=1)
        spent = since(start)
        t = np.where(hit["primID"] < 0, np.inf, hit["tfar"]).astype("<f4")
        t.tofile(os.path.join(folder, "t"))
        return spent


class Mitsuba:
    def __init__(self, variant):
        import drjit
        import mitsuba

        mitsuba.set_variant(variant)
        self.mi, self.dr = mitsuba, drjit
        self.vectorised = variant.startswith("llvm")

    def hello(self, _):
        # Something that runs: an unfit LLVM ends the process here.
        self.mi.load_dict({"type": "scene", "ball": {"type": "sphere"}})
        if self.vectorised:
            self.dr.eval(self.mi.Float([1.0, 2.0]) + 1.0)
        return {"version": "mitsuba " + self.mi.__version__}

    def threads(self, command):
        self.dr.set_thread_count(command["count"])
        return {}

    def load(self, command):
        mi, folder, kind = self.mi, command["folder"], command["curve"]
        # Text, as Mitsuba reads curves, written by the other side.
        shape = {"type": kind, "filename": os.path.join(folder, kind)}
        if "bsdf" in command:
            shape["bsdf"] = command["bsdf"]
            shape["bsdf"]["sigma_a"] = {"type": "rgb", "value": command["absorption_rgb"]}
        # Reading the text is timed apart, and not held against Mitsuba.
        start = clock()
        hair = mi.load_dict(shape)
        reading = since(start)
        world = {"type": "scene", "hair": hair}
        if "camera" in command:
            world |= {"sensor": self.sensor(command["camera"]), "light": self.light(command["light"])}
        start = clock()
        self.scene = mi.load_dict(world)
        if self.vectorised:
            self.dr.eval(self.scene.ray_test(mi.Ray3f(mi.Point3f(0, 0, 9e4), mi.Vector3f(0, 0, 1))))
        return since(start) | {"reading_s": reading["wall_s"]}

    def sensor(self, c):
        mi = self.mi
        to_world = mi.ScalarTransform4f(np.array(c["to_world"], dtype=np.float64))
        return {
            "type": "perspective",
            "fov": c["fov_deg"],
            "fov_axis": "x",
            "near_clip": 1.0,
            "far_clip": 1e5,
            "to_world": to_world,
            "film": {
                "type": "hdrfilm",
                "width": c["width"],
                "height": c["height"],
                "rfilter": {"type": "box"},
                "pixel_format": "rgb",
                "component_format": "float32",
            },
            "sampler": {"type": c["sampler"], "sample_count": 16},
        }

    def light(self, light):
        matrix = np.array(light["to_world"], dtype=np.float64)
        emitter = {"type": "area", "radiance": {"type": "rgb", "value": light["radiance_rgb"]}}
        return {"type": "rectangle", "to_world": self.mi.ScalarTransform4f(matrix), "emitter": emitter}

    def rays(self, command):
        mi, dr, folder = self.mi, self.dr, command["folder"]
        columns = lambda name: [np.ascontiguousarray(c) for c in array(folder, name, 3).T]
        ray = mi.Ray3f(mi.Point3f(*columns("origins")), mi.Vector3f(*columns("directions")))
        ray.maxt = mi.Float(np.minimum(array(folder, "tmax"), np.float32(3e38)))
        dr.eval(ray)
        dr.sync_thread()
        start = clock()
        if command["kind"] == "shadow":
            blocked = self.scene.ray_test(ray)
            dr.eval(blocked)
            dr.sync_thread()
            spent = since(start)
            t = np.where(np.asarray(blocked), 0.0, np.inf)
        else:
            found = self.scene.ray_intersect_preliminary(ray)
            dr.eval(found)
            dr.sync_thread()
            spent = since(start)
            t = np.asarray(found.t)
        t.astype("<f4").tofile(os.path.join(folder, "t"))
        return spent

    def frame(self, command):
        kind = {"type": "direct"} if command["depth"] == 1 else {"type": "path", "max_depth": command["depth"] + 1}
        integrator = self.mi.load_dict(kind)
        start = clock()
        image = self.mi.render(
            self.scene, integrator=integrator, spp=command["spp"], seed=command["seed"]
        )
        pixels = np.array(image, dtype="<f4")[..., :3]
        spent = since(start)
        pixels.tofile(os.path.join(command["folder"], "pixels"))
        return spent


def main():
    variant = sys.argv[1]
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # Whatever libraries print goes where errors go.
    tracer = None
    for line in sys.stdin:
        command = json.loads(line)
        try:
            if tracer is None:
                tracer = Embreex() if variant == "embreex" else Mitsuba(variant)
            if command["do"] == "memory":
                answer = {"peak_bytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024}
            else:
                answer = getattr(tracer, command["do"])(command)
        except Exception as error:  # Told to the other side, which decides.
            answer = {"error": f"{type(error).__name__}: {error}"}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


main()
