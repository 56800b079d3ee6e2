#!/usr/bin/python3
"""Writes the OpenVDB and NanoVDB files of tests/regressions/vdb, by the libraries of others, and checks their voxels.

    tools/vdb_files.py FOLDER [PYTHON]

Needs a C++ compiler and Debian's python3-openvdb, libopenvdb-dev, libboost-dev, libtbb-dev and libnanovdb-tools. PYTHON,
if given, is an interpreter whose module `bpy` is Blender 5, which writes one more file with its own library. What the
voxels of the files are is in `smoke`, `tiles` and so on below, and in src/assets/vdb/tests.rs.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pyopenvdb as vdb

CENTRE, RADIUS = np.array([-12, -20, -11]), 9


def value(ijk):
    """A multiple of 1/64, which 16 bits hold."""
    return (ijk @ np.array([7, 13, 29]) % 64) / 64


def active(ijk, centre=CENTRE, radius=RADIUS):
    return np.abs(ijk - centre).sum(axis=-1) <= radius


def coordinates(low, high):
    axes = [np.arange(a, b + 1) for a, b in zip(low, high)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def smoke(name="density", centre=CENTRE, radius=RADIUS):
    """An octahedron."""
    grid = vdb.FloatGrid(0.0)
    grid.name, grid.gridClass = name, vdb.GridClass.FOG_VOLUME
    grid.transform = vdb.createLinearTransform([[0.5, 0, 0, 0], [0, 0.5, 0, 0], [0, 0, 0.5, 0], [1, 2, 3, 1]])
    ijk = coordinates(centre - radius, centre + radius)
    grid.copyFromArray(np.where(active(ijk, centre, radius), value(ijk), 0), ijk=tuple(int(x) for x in centre - radius))
    # Zeros of the formula are active, too.
    accessor = grid.getAccessor()
    for at in ijk[active(ijk, centre, radius)]:
        accessor.setValueOn(tuple(int(x) for x in at), float(value(at)))
    return grid


def check(grid, expected, channels=1):
    """All voxels of the active box, and one more on each side, are those expected."""
    low, high = (np.array(corner) for corner in grid.evalActiveVoxelBoundingBox())
    low, high = low - 1, high + 1
    shape = tuple(high - low + 1) + ((3,) if channels == 3 else ())
    found = np.zeros(shape)
    grid.copyToArray(found, ijk=tuple(int(x) for x in low))
    assert np.array_equal(found, expected(coordinates(low, high))), grid.name


def is_smoke(ijk):
    return np.where(active(ijk), value(ijk), 0)


def in_box(ijk, low, high):
    return np.all((ijk >= low) & (ijk <= high), axis=-1)


def tiles():
    """A box with cubes of 8 and 128 voxels along each edge that the tree has as one value, and an inactive one."""
    grid = vdb.FloatGrid(0.0)
    grid.name = "tiles"
    grid.fill((128, 0, 0), (255, 127, 127), 0.25)
    grid.fill((112, 8, 16), (119, 15, 23), 0.5)
    grid.fill((120, 8, 16), (127, 15, 23), 0.75, active=False)
    grid.getAccessor().setValueOn((110, 9, 17), 1.0)
    return grid


def are_tiles(ijk):
    expected = np.zeros(ijk.shape[:-1])
    expected[in_box(ijk, [128, 0, 0], [255, 127, 127])] = 0.25
    expected[in_box(ijk, [112, 8, 16], [119, 15, 23])] = 0.5
    expected[in_box(ijk, [120, 8, 16], [127, 15, 23])] = 0.75
    expected[in_box(ijk, [110, 9, 17], [110, 9, 17])] = 1
    return expected


# What the inactive voxels of each leaf of `masks` have, in turn; its background is 0.25.
INACTIVE = [[0.25], [-0.25], [0.5], [0.25, -0.25], [0.25, 0.5], [0.5, 0.75], [0.5, 0.75, 1.0]]


def masks():
    """A leaf for each way of leaving out the values of inactive voxels."""
    grid = vdb.FloatGrid(0.25)
    grid.name = "masks"
    accessor = grid.getAccessor()
    for at in coordinates([0, 0, 0], [55, 7, 7]).reshape(-1, 3):
        ijk = tuple(int(x) for x in at)
        if at.sum() % 3 == 0:
            accessor.setValueOn(ijk, float(value(at)))
        else:
            inactive = INACTIVE[at[0] // 8]
            accessor.setValueOff(ijk, inactive[int(at.sum() % len(inactive))])
    return grid


def are_masks(ijk):
    expected = np.full(ijk.shape[:-1], 0.25)
    for at, _ in np.ndenumerate(expected):
        p = ijk[at]
        if in_box(p, [0, 0, 0], [55, 7, 7]):
            inactive = INACTIVE[p[0] // 8]
            expected[at] = value(p) if p.sum() % 3 == 0 else inactive[int(p.sum() % len(inactive))]
    return expected


def colours():
    """The smoke with three numbers a voxel."""
    grid = vdb.Vec3SGrid((0.0, 0.0, 0.0))
    grid.name, grid.transform = "Cd", smoke().transform
    accessor = grid.getAccessor()
    ijk = coordinates(CENTRE - RADIUS, CENTRE + RADIUS)
    for at in ijk[active(ijk)]:
        accessor.setValueOn(tuple(int(x) for x in at), (float(value(at)), float(value(at) / 2), 1.0))
    return grid


def are_colours(ijk):
    v = value(ijk)
    return np.where(active(ijk)[..., None], np.stack([v, v / 2, np.ones_like(v)], axis=-1), 0)


def turned():
    """The smoke with x, y and z turned into each other, of unlike sizes."""
    grid = smoke()
    grid.transform = vdb.createLinearTransform([[0, 0.25, 0, 0], [0, 0, 0.5, 0], [1, 0, 0, 0], [-1, 0, 2, 1]])
    return grid


def several():
    """Two grids of one name, of which one has the tree of the other, beside a warmer and smaller one."""
    first, heat = smoke(), smoke("temperature", CENTRE + 2, 3)
    second = first.copy()
    second.transform = vdb.createLinearTransform(2.0)
    heat.transform = first.transform
    return [first, second, heat]


def fire():
    """The smoke, and a temperature in a part of it."""
    density, heat = smoke(), smoke("temperature", CENTRE + 2, 3)
    heat.transform = density.transform
    return [density, heat]


def half(grid):
    grid.saveFloatAsHalf = True
    return grid


BLENDER = """
import sys
import numpy as np
import bpy
from pathlib import Path
sys.path += map(str, Path(bpy.utils.resource_path("LOCAL")).glob("python/lib/*/site-packages"))
import openvdb as vdb
grid = vdb.FloatGrid(0.0)
grid.name, grid.gridClass = "density", vdb.GridClass.FOG_VOLUME
grid.transform = vdb.createLinearTransform(0.25)
values = np.load(sys.argv[1])
grid.copyFromArray(values, ijk=tuple(int(x) for x in sys.argv[3:6]))
vdb.write(sys.argv[2], grids=[grid])
"""


COMPRESSIONS = ["none.vdb", "active.vdb", "zip.vdb", "zip_all.vdb", "blosc_all.vdb", "half_zip.vdb"]


def run(*command):
    subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL)


def main():
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    read = lambda name, grid: vdb.read(str(folder / name), grid)
    write = lambda name, grids: vdb.write(str(folder / name), grids=grids)

    write("blosc.vdb", [smoke()])
    write("half.vdb", [half(smoke())])
    write("tiles.vdb", [tiles()])
    write("masks.vdb", [masks()])
    write("colours.vdb", [colours()])
    write("turned.vdb", [turned()])
    write("several.vdb", several())
    write("fire.vdb", fire())
    write("empty.vdb", [vdb.FloatGrid(0.0)])
    sphere = vdb.createLevelSetSphere(radius=3.0, center=(20, 20, 20), halfWidth=2.0)
    sphere.name = "surface"
    write("level_set.vdb", [sphere])
    flags = vdb.BoolGrid(False)
    flags.fill((0, 0, 0), (1, 1, 1), True)
    flags.name = "flags"
    write("bool.vdb", [flags])
    with tempfile.TemporaryDirectory() as temporary:
        program = Path(temporary) / "vdb_files"
        source = Path(__file__).with_suffix(".cc")
        run("g++", "-std=c++17", source, "-o", program, "-lopenvdb", "-ltbb", "-lImath")
        run(program, folder / "blosc.vdb", folder)

    for name in ["blosc.vdb", "half.vdb", "turned.vdb", *COMPRESSIONS]:
        check(read(name, "density"), is_smoke)
    check(read("tiles.vdb", "tiles"), are_tiles)
    check(read("masks.vdb", "masks"), are_masks)
    check(read("colours.vdb", "Cd"), are_colours, channels=3)

    convert = ["nanovdb_convert", "-f"]
    for name in ["blosc", "tiles", "colours", "turned", "masks", "several", "fire"]:
        run(*convert, "-z", folder / f"{name}.vdb", folder / f"{name}_zip.nvdb")
    run(*convert, "-b", folder / "blosc.vdb", folder / "blosc.nvdb")
    for bits in ["fp4", "fp8", "fp16", "fpN"]:
        tolerance = ["-a", "0.004"] if bits == "fpN" else []
        run(*convert, "-z", f"--{bits}", *tolerance, folder / "blosc.vdb", folder / f"{bits}.nvdb")
    with tempfile.TemporaryDirectory() as temporary:
        for name in ["blosc", "tiles", "masks"]:
            back = Path(temporary) / f"{name}.vdb"
            run(*convert, folder / f"{name}_zip.nvdb", back)
            expected = {"blosc": is_smoke, "tiles": are_tiles, "masks": are_masks}[name]
            check(vdb.readAll(str(back))[0][0], expected)
        if len(sys.argv) > 2:
            ijk = coordinates(CENTRE - RADIUS, CENTRE + RADIUS)
            np.save(Path(temporary) / "smoke.npy", is_smoke(ijk))
            (Path(temporary) / "write.py").write_text(BLENDER)
            corner = [str(int(x)) for x in CENTRE - RADIUS]
            run(sys.argv[2], Path(temporary) / "write.py", Path(temporary) / "smoke.npy", folder / "blender.vdb", *corner)
            check(read("blender.vdb", "density"), is_smoke)


main()
