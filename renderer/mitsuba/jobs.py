"""The reference jobs, one function each: exchanged arrays in, arrays out."""

import mitsuba as mi
import numpy as np

import marschner
import rays
import scene as scenes


def camera(arrays, meta):
    """Rays through `pixels` (x, y in pixels) and projections of `points` (mm), by every camera of `cameras`."""
    pixels, points = arrays["pixels"], arrays["points"]
    out = {}
    for index, described in enumerate(meta["cameras"]):
        sensor = mi.load_dict(scenes.sensor(described))
        size = np.array([described["width"], described["height"]], dtype=np.float64)
        origins = np.zeros((len(pixels), 3), np.float32)
        directions = np.zeros((len(pixels), 3), np.float32)
        for i, film in enumerate((pixels / size).tolist()):
            ray, _ = sensor.sample_ray(0.0, 0.5, film, [0.5, 0.5])
            origins[i], directions[i] = first(ray.o), first(ray.d)
        projected = np.full((len(points), 2), np.nan, np.float32)
        for i, point in enumerate(points.tolist()):
            it = mi.SurfaceInteraction3f()
            it.p = point
            sample, weight = sensor.sample_direction(it, [0.5, 0.5])
            if first(sample.pdf) > 0.0:
                # In pixels already: the film's uv times its size.
                projected[i] = first(sample.uv)
        out |= {f"origins.{index}": origins, f"directions.{index}": directions, f"projected.{index}": projected}
    return out


def first(value):
    """A scalar or short vector as numpy, whether the variant is vectorised or not."""
    return np.asarray(value, dtype=np.float64).reshape(-1)


def geometry(arrays, _meta):
    """First hits on linearcurve and, for rays with a finite `tmax`, whether anything lies before it."""
    world = mi.load_dict({"type": "scene", "hair": scenes.curves("linearcurve", scenes.chains(arrays))})
    t, primitive, normal, position = rays.intersect(world, arrays["origins"], arrays["directions"])
    shadow = np.flatnonzero(np.isfinite(arrays["tmax"]))
    blocked = np.full(len(t), 255, np.uint8)
    blocked[shadow] = rays.blocked(
        world, arrays["origins"][shadow], arrays["directions"][shadow], arrays["tmax"][shadow]
    )
    return {"t": t, "primitive": primitive, "normal": normal, "position": position, "blocked": blocked}


def triangles(arrays, _meta):
    """First hits on a triangle mesh by Embree itself."""
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    embree = EmbreeScene()
    corners = arrays["vertices"].astype(np.float32)[arrays["triangles"].astype(np.int64)]
    TriangleMesh(embree, np.ascontiguousarray(corners))
    origins, directions = arrays["origins"], arrays["directions"]
    hit = embree.run(origins, directions, query="INTERSECT", output=1)
    miss = hit["primID"] < 0
    return {
        "t": np.where(miss, np.inf, hit["tfar"]).astype(np.float32),
        "primitive": hit["primID"].astype(np.int32),
        "uv": np.column_stack([hit["u"], hit["v"]]).astype(np.float32),
    }


def chiang(arrays, meta):
    """`hair`'s eval (with its cosine) and pdf for pairs of local directions: x across, y along, z normal."""
    to_camera, to_light = arrays["to_camera"].tolist(), arrays["to_light"].tolist()
    value = np.zeros((len(meta["optics"]), len(to_camera), 3), np.float32)
    density = np.zeros((len(meta["optics"]), len(to_camera)), np.float32)
    context = mi.BSDFContext()
    si = mi.SurfaceInteraction3f()
    si.t = 1.0
    si.sh_frame = mi.Frame3f(mi.Vector3f(0, 0, 1))
    for k, optics in enumerate(meta["optics"]):
        bsdf = mi.load_dict(scenes.hair_bsdf(optics))
        for i, (camera_side, light_side) in enumerate(zip(to_camera, to_light)):
            si.wi = camera_side
            value[k, i] = first(bsdf.eval(context, si, light_side))
            density[k, i] = first(bsdf.pdf(context, si, light_side))[0]
    return {"eval": value, "pdf": density}


def marschner_lobes(arrays, meta):
    """The lobes R, TT, TRT (with the receiver's cosine) in double precision, indexed [optics][pair][lobe][rgb]."""
    out = [
        marschner.lobes(marschner.Optics(**optics), arrays["to_camera"], arrays["to_light"])
        for optics in meta["optics"]
    ]
    return {"lobes": np.stack(out).astype(np.float32)}


def bsdf_of(meta):
    """The scene's fibre, as Mitsuba's own model or as the paper's."""
    optics = meta["optics"]
    if meta["model"] == "chiang":
        return scenes.hair_bsdf(optics)
    flat = {k: v for k, v in optics.items() if k not in ("absorption_rgb", "roots")}
    flat |= {f"absorption_{c}": v for c, v in zip("rgb", optics["absorption_rgb"])}
    return {"type": "marschner_2003", **flat}


def direct(arrays, meta):
    """Light from point lights that leaves the first hits, without random numbers: hits, per-light visibility
    and their sum. Shadow rays leave as Mitsuba's own do (spawn_ray_to), but are tested against linearcurve: open
    cones let light in and out through the seams between them, of which our fibres have none."""
    chiang_model = meta["model"] == "chiang"
    bsdf = scenes.hair_bsdf(meta["optics"]) if chiang_model else {"type": "diffuse"}
    shape = scenes.curves("bsplinecurve", scenes.open_cones(arrays), bsdf)
    world = mi.load_dict({"type": "scene", "hair": shape})
    blockers = mi.load_dict({"type": "scene", "hair": scenes.curves("linearcurve", scenes.chains(arrays))})
    if not rays.scalar():
        raise RuntimeError("job direct runs in scalar_rgb")
    n, lights = len(arrays["origins"]), list(zip(arrays["light_mm"].tolist(), arrays["intensity"].tolist()))
    t = np.full(n, np.inf, np.float32)
    primitive = np.full(n, -1, np.int32)
    tangent = np.zeros((n, 3), np.float32)
    visible = np.zeros((n, len(lights)), np.uint8)
    scattered = np.zeros((n, len(lights), 3))
    irradiance = np.zeros((n, len(lights), 3))
    to_camera = np.zeros((n, len(lights), 3))
    to_light = np.zeros((n, len(lights), 3))
    context = mi.BSDFContext()
    for i, (o, d) in enumerate(zip(arrays["origins"].tolist(), arrays["directions"].tolist())):
        si = world.ray_intersect(mi.Ray3f(o, d))
        if not si.is_valid():
            continue
        t[i], primitive[i] = si.t, si.prim_index
        # The frame's second axis, which hair models take for the fibre's direction.
        tangent[i] = first(si.sh_frame.t)
        model, at = si.bsdf(), first(si.p)
        for k, (place, power) in enumerate(lights):
            to = np.array(place) - at
            distance = np.linalg.norm(to)
            visible[i, k] = not blockers.ray_test(si.spawn_ray_to(place))
            local = si.to_local(mi.Vector3f((to / distance).tolist()))
            irradiance[i, k] = np.array(power) / distance**2
            if chiang_model:
                scattered[i, k] = first(model.eval(context, si, local))
            else:
                to_camera[i, k], to_light[i, k] = first(si.wi), first(local)
    if not chiang_model:
        hit = primitive >= 0
        optics = marschner.Optics(**meta["optics"])
        lobes = marschner.lobes(optics, to_camera[hit].reshape(-1, 3), to_light[hit].reshape(-1, 3))
        scattered[hit] = lobes.sum(axis=1).reshape(-1, len(lights), 3)
    radiance = (scattered * irradiance * visible[:, :, None]).sum(axis=1)
    return {
        "t": t,
        "primitive": primitive,
        "tangent": tangent,
        "visible": visible,
        "radiance": radiance.astype(np.float32),
    }


def image(arrays, meta):
    """Images of one view, one a seed: [seed][row][column][rgb]. With `beyond` the light of so many scatterings and
    fewer is taken off: same seeds, same paths."""
    described = {
        "type": "scene",
        "sensor": scenes.sensor(meta["camera"], meta["samples_per_pixel"]),
        "hair": scenes.curves("bsplinecurve", scenes.open_cones(arrays), bsdf_of(meta)),
    }
    emitters = zip(*(arrays[f"light_{name}"] for name in ("centre", "half_u", "half_v", "radiance")))
    for k, light in enumerate(emitters):
        described[f"light{k}"] = scenes.rectangle(*light)
    world = mi.load_dict(described)

    def render(scatterings, seed):
        # The light itself counts as one. No Russian roulette within the depths asked for; lights are invisible to
        # the camera, as ours are.
        depth = scatterings + 1
        integrator = mi.load_dict({"type": "path", "max_depth": depth, "rr_depth": 1000, "hide_emitters": True})
        return np.array(mi.render(world, integrator=integrator, seed=int(seed)), dtype=np.float32)

    images = []
    for seed in meta["seeds"]:
        whole = render(meta["scatterings"], seed)
        images.append(whole - render(meta["beyond"], seed) if meta["beyond"] else whole)
    return {"images": np.stack(images)}


JOBS = {
    "camera": camera,
    "geometry": geometry,
    "triangles": triangles,
    "chiang": chiang,
    "marschner": marschner_lobes,
    "direct": direct,
    "image": image,
}
