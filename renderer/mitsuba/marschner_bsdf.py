"""The paper's model as a Mitsuba BSDF. Directions are drawn uniformly over the sphere: noisy and beyond doubt."""

import drjit as dr
import mitsuba as mi

import marschner

# Halvings when the azimuth is solved for in single precision.
STEPS = 26


class DrJit:
    """The operations that the model needs, on Dr.Jit's types."""

    sin, cos, asin, acos, atan2 = dr.sin, dr.cos, dr.asin, dr.acos, dr.atan2
    sqrt, exp, abs, cbrt = dr.sqrt, dr.exp, dr.abs, dr.cbrt
    select, minimum, maximum, rint = dr.select, dr.minimum, dr.maximum, dr.round


def register():
    """Makes `marschner_2003` known to the variant that is set."""

    class Marschner2003(mi.BSDF):
        def __init__(self, props):
            mi.BSDF.__init__(self, props)
            named = {k: float(props[k]) for k in marschner.Optics.__dataclass_fields__ if k in props and k not in ("absorption_rgb", "roots")}
            absorption = [float(props[f"absorption_{c}"]) for c in "rgb"]
            self.optics = marschner.Optics(**named, absorption_rgb=absorption)
            flags = mi.BSDFFlags.Glossy | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
            self.m_components = [flags]
            self.m_flags = flags

        def sample(self, ctx, si, sample1, sample2, active=True):
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo = mi.warp.square_to_uniform_sphere(sample2)
            bs.pdf = 1.0 / (4.0 * dr.pi)
            bs.eta = 1.0
            bs.sampled_type = mi.UInt32(+mi.BSDFFlags.Glossy)
            bs.sampled_component = mi.UInt32(0)
            return bs, self.eval(ctx, si, bs.wo, active) * (4.0 * dr.pi)

        def eval(self, ctx, si, wo, active=True):
            angles = marschner.angles_of(DrJit, si.wi, wo)
            channels = [
                sum(marschner.lobe(DrJit, p, self.optics, sigma, angles, STEPS) for p in range(3))
                for sigma in self.optics.absorption_rgb
            ]
            return dr.select(active, mi.Color3f(*channels), 0.0)

        def pdf(self, ctx, si, wo, active=True):
            return dr.select(active, mi.Float(1.0 / (4.0 * dr.pi)), 0.0)

        def eval_pdf(self, ctx, si, wo, active=True):
            return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    mi.register_bsdf("marschner_2003", Marschner2003)
