"""Marschner et al. 2003, "Light Scattering from Human Hair Fibers", written from the paper: a witness for the
Rust code, which nothing here was taken from.

Two departures from the print, both from first principles (a smooth dielectric cylinder):
 - the Gaussian in theta_h integrates to 2 over theta_i at fixed theta_r, so each lobe is halved;
 - a chord inside a unit circle is 2 cos gamma_t long, and 2 cos gamma_t / cos theta_t along the tilted path,
   where the paper prints 2 + 2 cos 2 gamma_t.
The print's cubic stand-in for phi(h) is offered as `roots="cubic"`; the default solves phi(h) itself.

Works on numpy arrays (double precision) and, through `Ops`, on Dr.Jit's.
"""

from dataclasses import dataclass, field
from math import radians, sqrt  # Plain floats: numpy's scalars would turn Dr.Jit's arrays into their own.

import numpy as np

PI = float(np.pi)


@dataclass
class Optics:
    """Parameters of the paper's Table 1 and the absorption per fibre radius."""

    index: float = 1.55
    shift_r_deg: float = -7.5
    width_r_deg: float = 7.5
    glint_scale: float = 1.0
    caustic_width_deg: float = 15.0
    fade_range: float = 0.3
    caustic_limit: float = 0.5
    eccentricity: float = 1.0
    absorption_rgb: list = field(default_factory=lambda: [0.0, 0.0, 0.0])
    roots: str = "exact"

    def shift(self, p):
        return radians(self.shift_r_deg) * (1.0, -0.5, -1.5)[p]

    def width(self, p):
        return radians(self.width_r_deg) * (1.0, 0.5, 2.0)[p]


class Numpy:
    """The operations that the model needs, on numpy arrays."""

    sin, cos, asin, acos, atan2 = np.sin, np.cos, np.arcsin, np.arccos, np.arctan2
    sqrt, exp, abs, cbrt = np.sqrt, np.exp, np.abs, np.cbrt
    select, minimum, maximum, rint = np.where, np.minimum, np.maximum, np.rint


def gaussian(ops, width, x):
    return ops.exp(-0.5 * (x / width) * (x / width)) / (sqrt(2 * PI) * width)


def clamped(ops, x, low=-1.0, high=1.0):
    return ops.minimum(ops.maximum(x, low), high)


def bravais(ops, index, theta_d):
    """The two indices of the projected problem, for perpendicular and parallel polarisation (appendix B)."""
    s, c = ops.sin(theta_d), ops.cos(theta_d)
    root = ops.sqrt(index * index - s * s)
    return root / c, index * index * c / root


def refract(ops, index, gamma_i):
    return ops.asin(clamped(ops, ops.sin(gamma_i) / index))


def fresnel(ops, perpendicular, parallel, gamma_i):
    """Reflectance of unpolarised light; both polarisations share the path, which is bent by the first index."""
    ci, ct = ops.cos(gamma_i), ops.cos(refract(ops, perpendicular, gamma_i))
    rs = (ci - perpendicular * ct) / (ci + perpendicular * ct)
    rp = (parallel * ci - ct) / (parallel * ci + ct)
    return 0.5 * (rs * rs + rp * rp)


def attenuation(ops, p, gamma_i, perpendicular, parallel, cos_theta_t, sigma):
    """A(p, h) of equation 8 (one channel)."""
    f = fresnel(ops, perpendicular, parallel, gamma_i)
    if p == 0:
        return f
    # From inside, the reflectance of the same interface along the same path is the same.
    inside = ops.exp(-2.0 * sigma * ops.cos(refract(ops, perpendicular, gamma_i)) / cos_theta_t)
    out = (1.0 - f) * (1.0 - f) * inside
    return out * f * inside if p == 2 else out


def wrap(ops, x):
    """Into [-pi, pi]."""
    return x - 2 * PI * ops.rint(x / (2 * PI))


def exit_azimuth(ops, p, index, gamma_i):
    """phi(p, h) - p pi of equation 6."""
    return 2.0 * p * refract(ops, index, gamma_i) - 2.0 * gamma_i


def caustic_offset(ops, index):
    """h_c >= 0 with d phi / dh = 0 for TRT; 0 once the two caustics have merged (index >= 2)."""
    return ops.sqrt(ops.maximum((4.0 - index * index) / 3.0, 0.0))


def cubic_factors(ops, p, index):
    """(a, b) of the paper's phi(gamma_i) - p pi = a gamma_i - b gamma_i^3 (equation 10)."""
    c = ops.asin(clamped(ops, 1.0 / index))
    return 6.0 * p * c / PI - 2.0, 8.0 * p * c / PI**3


def caustic(ops, index, roots):
    """gamma_c, phi_c and |d^2 phi / dh^2| there: of the same phi(h) whose singularity is to be taken out."""
    if roots == "cubic":
        a, b = cubic_factors(ops, 2, index)
        gamma = ops.sqrt(ops.maximum(a / (3.0 * b), 0.0))
        c = ops.cos(gamma)
        return gamma, a * gamma - b * gamma * gamma * gamma, 6.0 * b * gamma / (c * c)
    h = caustic_offset(ops, index)
    gamma = ops.asin(clamped(ops, h))
    ci, ct = ops.cos(gamma), ops.cos(refract(ops, index, gamma))
    bend = ops.abs(4.0 * h / (index * index * index * ct * ct * ct) - 2.0 * h / (ci * ci * ci))
    return gamma, exit_azimuth(ops, 2, index, gamma), bend


def bisect(ops, p, index, target, low, high, steps):
    """The root of phi(gamma) = target where phi is monotone between `low` and `high`, and whether there is one."""
    f_low = exit_azimuth(ops, p, index, low) - target
    f_high = exit_azimuth(ops, p, index, high) - target
    there = f_low * f_high <= 0.0
    a, b = low + 0.0 * target, high + 0.0 * target
    for _ in range(steps):
        middle = 0.5 * (a + b)
        left = (exit_azimuth(ops, p, index, middle) - target) * f_low <= 0.0
        a, b = ops.select(left, a, middle), ops.select(left, middle, b)
    return 0.5 * (a + b), there


def exact_roots(ops, p, index, phi, steps):
    """All gamma_i with phi(p, h) = phi, each with whether it exists."""
    target = wrap(ops, phi - p * PI)
    if p == 0:
        return [(-0.5 * target, target == target)]
    quarter = 0.5 * PI + 0.0 * target
    if p == 1:
        return [bisect(ops, 1, index, target, -quarter, quarter, steps)]
    turn = ops.asin(clamped(ops, caustic_offset(ops, index))) + 0.0 * target
    spans = [(-quarter, -turn), (-turn, turn), (turn, quarter)]
    roots = [bisect(ops, 2, index, target, a, b, steps) for a, b in spans]
    # The middle span is empty once the caustics have merged.
    roots[1] = (roots[1][0], roots[1][1] & (turn > 0.0))
    # A root at the join of two spans counts once.
    joined = (index >= 2.0) & (target == 0.0)
    roots[2] = (roots[2][0], roots[2][1] & ~joined if isinstance(joined, np.ndarray) else roots[2][1])
    return roots


def cubic_roots(ops, p, index, phi):
    """Roots of the paper's cubic (equation 10), by trigonometry or Cardano."""
    target = wrap(ops, phi - p * PI)
    if p == 0:
        return [(-0.5 * target, target == target)]
    linear, cube = cubic_factors(ops, p, index)
    cube = -cube
    m, n = linear / cube, -target / cube  # x^3 + m x + n = 0
    disc = 0.25 * n * n + m * m * m / 27.0
    root = ops.sqrt(ops.maximum(disc, 0.0))
    single = ops.cbrt(-0.5 * n + root) + ops.cbrt(-0.5 * n - root)
    radius = ops.sqrt(ops.maximum(-m / 3.0, 1e-30))
    angle = ops.acos(clamped(ops, -0.5 * n / (radius * radius * radius))) / 3.0
    out = []
    for k in range(3):
        x = 2.0 * radius * ops.cos(angle - 2.0 * PI * k / 3.0)
        if k == 0:
            x = ops.select(disc > 0.0, single, x)
        there = ops.abs(x) <= 0.5 * PI
        out.append((x, there if k == 0 else there & (disc <= 0.0)))
    return out


def slope(ops, p, index, gamma_i, roots):
    """|d phi / dh|."""
    ci = ops.maximum(ops.cos(gamma_i), 1e-9)
    if roots == "cubic" and p > 0:
        a, b = cubic_factors(ops, p, index)
        return ops.abs(a - 3.0 * b * gamma_i * gamma_i) / ci
    ct = ops.cos(refract(ops, index, gamma_i))
    return ops.abs(2.0 * p / (index * ct) - 2.0 / ci)


def plain_azimuth(ops, p, phi, perpendicular, parallel, cos_theta_t, optics, sigma, steps):
    """N_p of equation 4: the sum over paths of A(p, h) / |2 d phi / dh|."""
    if optics.roots == "cubic":
        roots = cubic_roots(ops, p, perpendicular, phi)
    else:
        roots = exact_roots(ops, p, perpendicular, phi, steps)
    total = 0.0 * phi
    for gamma_i, there in roots:
        a = attenuation(ops, p, gamma_i, perpendicular, parallel, cos_theta_t, sigma)
        n = a / ops.maximum(2.0 * slope(ops, p, perpendicular, gamma_i, optics.roots), 1e-9)
        total = total + ops.select(there, n, 0.0 * phi)
    return total


def smoothstep(ops, low, high, x):
    u = clamped(ops, (x - low) / (high - low), 0.0, 1.0)
    return u * u * (3.0 - 2.0 * u)


def trt_azimuth(ops, phi, perpendicular, parallel, cos_theta_t, optics, sigma, steps):
    """N_TRT with the caustics taken out and put back with a finite width (the procedure of section 5.2.2)."""
    index = perpendicular
    width = radians(optics.caustic_width_deg)
    gamma_c, phi_c, bend = caustic(ops, index, optics.roots)
    two = index < 2.0
    span = ops.minimum(optics.caustic_limit, 2.0 * ops.sqrt(2.0 * width / ops.maximum(bend, 1e-9)))
    span = ops.select(two, span, optics.caustic_limit + 0.0 * phi)
    # Full strength as long as there are two caustics, then fading over the fade range.
    fade = ops.select(two, 1.0 + 0.0 * phi, 1.0 - smoothstep(ops, 2.0, 2.0 + optics.fade_range, index))
    phi_c = ops.select(two, phi_c, 0.0 * phi)
    plain = plain_azimuth(ops, 2, phi, perpendicular, parallel, cos_theta_t, optics, sigma, steps)
    peak = gaussian(ops, width, 0.0 * phi)
    right = gaussian(ops, width, wrap(ops, phi - phi_c))
    left = gaussian(ops, width, wrap(ops, phi + phi_c))
    smooth = plain * (1.0 - fade * right / peak) * (1.0 - fade * left / peak)
    a_c = attenuation(ops, 2, gamma_c, perpendicular, parallel, cos_theta_t, sigma)
    return smooth + fade * optics.glint_scale * a_c * span * (right + left)


def trt_index(ops, optics, cos_2phi_h):
    """The index that stands for an elliptical cross-section in TRT (section 5.2.3)."""
    n, a = optics.index, optics.eccentricity
    first = 2.0 * (n - 1.0) * a * a - n + 2.0
    second = 2.0 * (n - 1.0) / (a * a) - n + 2.0
    return 0.5 * ((first + second) + cos_2phi_h * (first - second))


def lobe(ops, p, optics, sigma, angles, steps):
    """M_p N_p / cos^2 theta_d times the receiver's cosine (one channel)."""
    theta_i, theta_r, phi, cos_2phi_h = angles
    theta_d, theta_h = 0.5 * (theta_r - theta_i), 0.5 * (theta_r + theta_i)
    index = optics.index + 0.0 * phi
    if p == 2 and optics.eccentricity != 1.0:
        index = trt_index(ops, optics, cos_2phi_h)
    perpendicular, parallel = bravais(ops, index, theta_d)
    sin_t = ops.sin(theta_d) / index
    cos_theta_t = ops.sqrt(1.0 - sin_t * sin_t)
    along = 0.5 * gaussian(ops, optics.width(p), theta_h - optics.shift(p))
    if p == 2:
        across = trt_azimuth(ops, phi, perpendicular, parallel, cos_theta_t, optics, sigma, steps)
    else:
        across = plain_azimuth(ops, p, phi, perpendicular, parallel, cos_theta_t, optics, sigma, steps)
    cos_d = ops.cos(theta_d)
    return along * across / (cos_d * cos_d) * ops.cos(theta_i)


def angles_of(ops, to_camera, to_light):
    """Inclinations, the azimuth between, and cos 2 phi_h, of local directions as (x, y, z) components: y is the
    fibre's tangent, x the cross-section's major axis."""
    theta_r, theta_i = ops.asin(clamped(ops, to_camera[1])), ops.asin(clamped(ops, to_light[1]))
    phi_r, phi_i = ops.atan2(to_camera[2], to_camera[0]), ops.atan2(to_light[2], to_light[0])
    return theta_i, theta_r, wrap(ops, phi_r - phi_i), ops.cos(phi_r + phi_i)


def lobes(optics, to_camera, to_light):
    """R, TT and TRT for pairs of local unit directions, indexed [pair][lobe][rgb]."""
    camera_side, light_side = to_camera.astype(np.float64).T, to_light.astype(np.float64).T
    angles = angles_of(Numpy, camera_side, light_side)
    with np.errstate(all="ignore"):
        channels = [
            [lobe(Numpy, p, optics, sigma, angles, 56) for sigma in optics.absorption_rgb] for p in range(3)
        ]
    return np.moveaxis(np.array(channels), 2, 0)
