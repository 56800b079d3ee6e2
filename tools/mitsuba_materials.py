#!/usr/bin/env python3
"""Compares materials with Mitsuba 3's of which they are the import: values for pairs of directions; see docs/materials.md.

usage: PYTHON tools/mitsuba_materials.py   where PYTHON has the packages mitsuba and numpy
Both are evaluated for the same 1200 pairs of directions. Prints, for every material, the ratio of the sums of all values, ours over Mitsuba's,
and the largest and the median difference of a value, relative to the larger of the two.
"""
import itertools
import json
import os
import subprocess
import sys

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
COLOR = [0.5, 0.3, 0.1]
# Our keys and Mitsuba's.
KEYS = {
    "metallic": "metallic", "roughness": "roughness", "anisotropic": "anisotropic", "specular": "specular", "specular_tint": "spec_tint",
    "sheen": "sheen", "sheen_tint": "sheen_tint", "clearcoat": "clearcoat", "clearcoat_gloss": "clearcoat_gloss", "subsurface": "flatness",
    "transmission": "spec_trans",
}
BASE = {
    "metallic": 0, "roughness": 0.5, "anisotropic": 0, "specular": 0.5, "specular_tint": 0, "sheen": 0, "sheen_tint": 0, "clearcoat": 0,
    "clearcoat_gloss": 1, "subsurface": 0, "transmission": 0,
}
DISTRIBUTIONS = {"ggx": "ggx_separable", "beckmann": "beckmann"}


def pairs():
    """Directions on both sides for light, on the upper side for the viewer; half of the pairs near the mirror direction."""
    rng = np.random.default_rng(1)
    n = 1200
    z = rng.uniform(0.05, 0.999, (2, n))
    phi = rng.uniform(0, 2 * np.pi, (2, n))
    z[1, ::2] = np.clip(z[0, ::2] + rng.normal(0, 0.05, n // 2), 0.05, 0.999)
    phi[1, ::2] = phi[0, ::2] + np.pi + rng.normal(0, 0.1, n // 2)
    z[1, 3::4] *= -1
    s = np.sqrt(1 - z * z)
    w = np.stack([s * np.cos(phi), s * np.sin(phi), z], -1)
    return w[0], w[1]


def ours(materials, wo, wi):
    request = {"materials": materials, "pairs": np.stack([wo, wi], 1).tolist()}
    command = os.environ.get("EVAL", "cargo xtask eval_materials").split()
    out = subprocess.run(command, input=json.dumps(request), stdout=subprocess.PIPE, text=True, check=True).stdout
    return np.array(json.loads(out))[..., :3]


def theirs(plugin, wo, wi):
    bsdf = mi.load_dict(plugin)
    context, si = mi.BSDFContext(), mi.SurfaceInteraction3f()
    si.sh_frame = mi.Frame3f([0, 0, 1])
    values = []
    for o, i in zip(wo, wi):
        si.wi = mi.Vector3f(*map(float, o))
        values.append(np.array(bsdf.eval(context, si, mi.Vector3f(*map(float, i)))).ravel()[:3])
    return np.array(values)


def rgb(color):
    return {"type": "rgb", "value": color}


def principled(changes):
    p = {**BASE, **changes}
    # An index of exactly 1 is no interface to Mitsuba.
    plugin = {key: float(max(p[k], 1e-4) if k == "specular" else p[k]) for k, key in KEYS.items()}
    return {"type": "principled", "model": "mitsuba", "base_color": COLOR, **p}, {"type": "principled", "base_color": rgb(COLOR), **plugin}


def pane(changes):
    p = {"roughness": 0.5, "anisotropic": 0.0, "specular_tint": 0.0, "ior": 1.5, **changes}
    ours = {"type": "principled", "model": "mitsuba", "base_color": COLOR, "thin": True, "transmission": 1, **p}
    plugin = {"type": "principledthin", "base_color": rgb(COLOR), "spec_trans": 1.0, "roughness": p["roughness"], "anisotropic": p["anisotropic"]}
    return ours, {**plugin, "spec_tint": p["specular_tint"], "eta": p["ior"]}


def sheet(changes):
    p = {"roughness": 0.5, "sheen": 0.0, "sheen_tint": 0.0, "subsurface": 0.0, "diffuse_transmission": 0.0, **changes}
    ours = {"type": "principled", "model": "mitsuba", "base_color": COLOR, "thin": True, "ior": 1, **p}
    plugin = {"type": "principledthin", "base_color": rgb(COLOR), "roughness": p["roughness"], "sheen": p["sheen"], "sheen_tint": p["sheen_tint"]}
    return ours, {**plugin, "flatness": p["subsurface"], "diff_trans": 2 * p["diffuse_transmission"]}


def plastic(alpha, distribution, nonlinear):
    ours = {"type": "plastic", "albedo": COLOR, "ior": 1.5, "coat_tint": [1, 0.8, 0.6], "nonlinear": nonlinear}
    plugin = {"int_ior": 1.5, "ext_ior": 1.0, "diffuse_reflectance": rgb(COLOR), "specular_reflectance": rgb([1, 0.8, 0.6]), "nonlinear": nonlinear}
    if alpha is None:
        return ours, {"type": "plastic", **plugin}
    rough = {"type": "roughplastic", "alpha": alpha, "distribution": distribution, **plugin}
    return {**ours, "alpha": alpha, "distribution": DISTRIBUTIONS[distribution]}, rough


def conductor(alpha, distribution):
    ours = {"type": "conductor", "eta": [0.2, 0.9, 1.1], "k": [3.9, 2.5, 2.1], "alpha": alpha, "distribution": DISTRIBUTIONS[distribution]}
    u, v = alpha
    plugin = {"type": "roughconductor", "eta": rgb([0.2, 0.9, 1.1]), "k": rgb([3.9, 2.5, 2.1]), "alpha_u": u, "alpha_v": v}
    return ours, {**plugin, "distribution": distribution}


def dielectric(alpha, distribution):
    ours = {"type": "dielectric", "ior": 1.5, "alpha": alpha, "distribution": DISTRIBUTIONS[distribution]}
    ours |= {"reflection_tint": [1, 0.8, 0.6], "transmission_tint": [0.5, 0.7, 0.9]}
    plugin = {"type": "roughdielectric", "int_ior": 1.5, "ext_ior": 1.0, "alpha": alpha, "distribution": distribution}
    return ours, {**plugin, "specular_reflectance": rgb([1, 0.8, 0.6]), "specular_transmittance": rgb([0.5, 0.7, 0.9])}


def materials():
    """Name, our description, Mitsuba's."""
    lobes = {
        "default": {}, "roughness 1": {"roughness": 1}, "flat": {"subsurface": 1}, "sheen, tinted": {"sheen": 1, "sheen_tint": 0.5},
        "clear coat": {"clearcoat": 1}, "clear coat, gloss 0": {"clearcoat": 1, "clearcoat_gloss": 0}, "metal": {"metallic": 1},
        "metal, anisotropic": {"metallic": 1, "anisotropic": 0.8}, "glass": {"transmission": 1}, "tinted layer": {"specular": 1, "specular_tint": 0.5},
    }
    for name, changes in lobes.items():
        yield f"principled, {name}", *principled(changes)
    for name, changes in {"": {}, ", anisotropic, tinted": {"anisotropic": 0.8, "specular_tint": 0.7}, ", rough, index 1.2": {"roughness": 0.9, "ior": 1.2}}.items():
        yield f"thin, pane{name}", *pane(changes)
    for name, changes in {"": {}, ", sheen": {"sheen": 1.0, "sheen_tint": 0.5}, ", flat, half passes": {"subsurface": 1.0, "diffuse_transmission": 0.25}}.items():
        yield f"thin, sheet{name}", *sheet(changes)
    for alpha, distribution, nonlinear in itertools.product([0.05, 0.3, 0.7], DISTRIBUTIONS, [False, True]):
        yield f"plastic, {distribution} {alpha}{', nonlinear' if nonlinear else ''}", *plastic(alpha, distribution, nonlinear)
    for nonlinear in [False, True]:
        yield f"plastic, smooth{', nonlinear' if nonlinear else ''}", *plastic(None, None, nonlinear)
    for alpha, distribution in itertools.product([0.1, 0.5], DISTRIBUTIONS):
        yield f"conductor, {distribution} {alpha}", *conductor([alpha, alpha], distribution)
        yield f"conductor, {distribution} {alpha} and {alpha / 2}", *conductor([alpha, alpha / 2], distribution)
        yield f"dielectric, {distribution} {alpha}", *dielectric(alpha, distribution)


def corners():
    names = ["metallic", "roughness", "anisotropic", "specular", "sheen", "clearcoat", "subsurface", "transmission"]
    for bits in itertools.product([0, 1], repeat=len(names)):
        corner = dict(zip(names, bits))
        # Alpha is limited to 1 here, and not in Mitsuba.
        corner |= {"roughness": 0.3 + 0.4 * corner["roughness"], "anisotropic": 0.8 * corner["anisotropic"], "specular": 0.5 + 0.5 * corner["specular"]}
        yield principled(corner)


def main():
    os.chdir(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
    wo, wi = pairs()
    listed, cornered = list(materials()), list(corners())
    values = ours([m for _, m, _ in listed] + [m for m, _ in cornered], wo, wi)
    print(f"{'':44} {'ratio':>8} {'largest':>12} {'median':>10}")
    for (name, _, plugin), a in zip(listed, values):
        b = theirs(plugin, wo, wi)
        scale = np.maximum(np.abs(a), np.abs(b))
        difference = (np.abs(a - b) / np.maximum(scale, 1e-9))[scale > 1e-3 * scale.max(axis=0)]
        print(f"{name:44} {a.sum() / b.sum():8.4f} {difference.max():12.1e} {np.median(difference):10.1e}")
    ratios = np.sort([value.sum() / theirs(plugin, wo, wi).sum() for (_, plugin), value in zip(cornered, values[len(listed):])])
    print(f"\n{len(ratios)} corners of principled: ratio of sums from {ratios[0]:.4f} to {ratios[-1]:.4f}, median {np.median(ratios):.4f}")


if __name__ == "__main__":
    sys.exit(main())
