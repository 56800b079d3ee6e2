#!/usr/bin/env python3
"""Compares the principled material with Mitsuba 3's, lobe by lobe and at the corners of its parameters; see docs/materials.md.

usage: PYTHON tools/principled.py   where PYTHON has the packages mitsuba and numpy
Both are evaluated for the same 1200 pairs of directions. Prints, for every set of parameters, the ratio of the sums of all values, ours over
Mitsuba's, and the largest and the median difference of a value, relative to the larger of the two.
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


def theirs(parameters, wo, wi):
    description = {"type": "principled", "base_color": {"type": "rgb", "value": parameters.get("base_color", COLOR)}}
    for ours_key, key in KEYS.items():
        value = parameters[ours_key]
        # An index of exactly 1 is no interface to Mitsuba.
        description[key] = max(value, 1e-4) if key == "specular" else value
    bsdf = mi.load_dict({k: v if isinstance(v, dict | str) else float(v) for k, v in description.items()})
    context, si = mi.BSDFContext(), mi.SurfaceInteraction3f()
    si.sh_frame = mi.Frame3f([0, 0, 1])
    values = []
    for o, i in zip(wo, wi):
        si.wi = mi.Vector3f(*map(float, o))
        values.append(np.array(bsdf.eval(context, si, mi.Vector3f(*map(float, i)))).ravel()[:3])
    return np.array(values)


def masking(parameters, wo, wi):
    """Mitsuba's product of G1 over the height-correlated G2."""
    aspect = np.sqrt(1 - 0.9 * parameters["anisotropic"])
    a2 = parameters["roughness"] ** 2
    ax, ay = (np.clip(a, 1e-3, 1) for a in (a2 / aspect, a2 * aspect))
    length = lambda w: np.sqrt((ax * w[:, 0]) ** 2 + (ay * w[:, 1]) ** 2 + w[:, 2] ** 2)
    lo, li, zo, zi = length(wo), length(wi), np.abs(wo[:, 2]), np.abs(wi[:, 2])
    return (2 * zo / (zo + lo)) * (2 * zi / (zi + li)) / (2 * zo * zi / (lo * zi + li * zo))


def fresnel(parameters, wo, wi):
    """The exact reflectance of a dielectric over Schlick's approximation."""
    ahead = 0.08 * parameters["specular"]
    ior = 2 / (1 - np.sqrt(ahead)) - 1
    c = np.sqrt(np.clip(0.5 * (1 + (wo * wi).sum(axis=1)), 0, 1))
    t = np.sqrt(1 - (1 - c * c) / ior**2)
    exact = 0.5 * (((ior * c - t) / (ior * c + t)) ** 2 + ((c - ior * t) / (c + ior * t)) ** 2)
    return exact / (ahead + (1 - ahead) * (1 - c) ** 5)


def masking_and_fresnel(parameters, wo, wi):
    return masking(parameters, wo, wi) * fresnel(parameters, wo, wi)


def cosines(_, wo, wi):
    """The denominator of a microfacet model, which Mitsuba's clear coat is without."""
    return np.abs(4 * wo[:, 2] * wi[:, 2])


def luminance(_, wo, wi):
    """Mitsuba divides a tint by the luminance of the colour, we by its largest channel."""
    return np.full(len(wo), max(COLOR) / np.dot([0.212671, 0.715160, 0.072169], COLOR))


def line(name, a, b):
    scale = np.maximum(np.abs(a), np.abs(b))
    # Differences of values carry the rounding of what was subtracted.
    difference = (np.abs(a - b) / np.maximum(scale, 1e-9))[scale > 1e-3 * scale.max(axis=0)]
    print(f"{name:44} {a.sum() / b.sum():8.4f} {difference.max():12.1e} {np.median(difference):10.1e}")


def main():
    os.chdir(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
    wo, wi = pairs()
    black = {"base_color": [0, 0, 0]}
    # Name, parameters, parameters of what is subtracted from both, what ours is multiplied by.
    lobes = [
        ("diffuse", {}, black, None),
        ("diffuse, roughness 1", {"roughness": 1}, {"roughness": 1, **black}, None),
        ("flat", {"subsurface": 1}, {"subsurface": 1, **black}, None),
        ("sheen", {"sheen": 1, **black}, black, None),
        ("sheen, tinted", {"sheen": 1, "sheen_tint": 1}, {}, None),
        ("sheen, tinted, with their luminance", {"sheen": 1, "sheen_tint": 1}, {}, luminance),
        ("clear coat", {"clearcoat": 1, **black}, black, None),
        ("clear coat, without 4 cos cos", {"clearcoat": 1, **black}, black, cosines),
        ("clear coat, gloss 0, without 4 cos cos", {"clearcoat": 1, "clearcoat_gloss": 0, **black}, black, cosines),
        ("metal", {"metallic": 1}, None, None),
        ("metal, with their G", {"metallic": 1}, None, masking),
        ("metal, anisotropic, with their G", {"metallic": 1, "anisotropic": 0.8}, None, masking),
        ("metal, roughness 1, with their G", {"metallic": 1, "roughness": 1}, None, masking),
        ("glass", {"transmission": 1}, None, None),
        ("glass, with their G", {"transmission": 1}, None, masking),
        ("layer", black, None, None),
        ("layer, with their G and F", black, None, masking_and_fresnel),
        ("layer, specular 1, with their G and F", {"specular": 1, **black}, None, masking_and_fresnel),
        ("all of it, by default", {}, None, None),
    ]
    names = ["metallic", "roughness", "anisotropic", "specular", "sheen", "clearcoat", "subsurface", "transmission"]
    corners = [dict(zip(names, bits)) for bits in itertools.product([0, 1], repeat=len(names))]
    for corner in corners:
        # Mitsuba's alpha is not limited to 1.
        corner["roughness"] = 0.3 + 0.4 * corner["roughness"]
        corner["anisotropic"] *= 0.8
        corner["specular"] = 0.5 + 0.5 * corner["specular"]
    sets = [{**BASE, **changes} for lobe in lobes for changes in (lobe[1], lobe[2] or {})] + [{**BASE, **corner} for corner in corners]
    materials = [
        {"type": "principled", "multiscatter": False, "base_color": p.get("base_color", COLOR), **{k: p[k] for k in KEYS}} for p in sets
    ]
    values = ours(materials, wo, wi)
    print(f"{'':44} {'ratio':>8} {'largest':>12} {'median':>10}")
    for i, (name, _, subtracted, factor) in enumerate(lobes):
        p, ours_value, theirs_value = sets[2 * i], values[2 * i], theirs(sets[2 * i], wo, wi)
        if subtracted is not None:
            ours_value, theirs_value = ours_value - values[2 * i + 1], theirs_value - theirs(sets[2 * i + 1], wo, wi)
        line(name, ours_value * factor(p, wo, wi)[:, None] if factor else ours_value, theirs_value)
    ratios = []
    for p, value in zip(sets[2 * len(lobes):], values[2 * len(lobes):]):
        ratios.append((value.sum() / theirs(p, wo, wi).sum(), {k: p[k] for k in names if p[k] != BASE[k]}))
    ratios.sort(key=lambda r: r[0])
    print(f"\n{len(ratios)} corners: ratio of sums from {ratios[0][0]:.3f} {ratios[0][1]}\n    to {ratios[-1][0]:.3f} {ratios[-1][1]}")
    print(f"    median {np.median([r for r, _ in ratios]):.3f}, {sum(0.95 < r < 1.05 for r, _ in ratios)} within 5 %")


if __name__ == "__main__":
    sys.exit(main())
