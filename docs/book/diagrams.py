#!/usr/bin/env python3
"""Draws the diagrams of src/accelerators_study.md: the same shapes and the same ray in a list, an octree, a kd-tree and two hierarchies of boxes; and a
plot of the page's table of growth."""

import math
import random
from pathlib import Path

FOLDER = Path(__file__).resolve().parent / "src/diagrams"
SIZE, MARGIN = 400, 12
random.seed(4)
SHAPES = [(random.uniform(20, 380), random.uniform(20, 380), random.uniform(8, 17)) for _ in range(4)]
# Two groups, as objects in a room.
SHAPES += [(random.gauss(120, 34), random.gauss(290, 30), random.uniform(5, 11)) for _ in range(9)]
SHAPES += [(random.gauss(290, 34), random.gauss(110, 30), random.uniform(5, 11)) for _ in range(9)]
RAY = ((6, 372), (394, 60))
LINES = ["#1f6f8b", "#3a8f5c", "#c0672b", "#8a4f9e", "#8a8a8a", "#8a8a8a"]


def bounds(shapes):
    return (min(x - r for x, _, r in shapes), min(y - r for _, y, r in shapes), max(x + r for x, _, r in shapes), max(y + r for _, y, r in shapes))


def area(box):
    """What stands in the plane for the surface of a box."""
    return (box[2] - box[0]) + (box[3] - box[1])


def overlaps(shape, box):
    b = bounds([shape])
    return b[0] < box[2] and b[2] > box[0] and b[1] < box[3] and b[3] > box[1]


def crosses(box):
    """Whether the ray meets a box."""
    (x0, y0), (x1, y1) = RAY
    low, high = 0.0, 1.0
    for start, end, near, far in [(x0, x1, box[0], box[2]), (y0, y1, box[1], box[3])]:
        a, b = sorted(((near - start) / (end - start), (far - start) / (end - start)))
        low, high = max(low, a), min(high, b)
    return low <= high


def octree(box, shapes, depth=0):
    """Cells with what overlaps them; in the plane it is a quadtree."""
    shapes = [s for s in shapes if overlaps(s, box)]
    if len(shapes) <= 2 or depth == 4:
        return [(box, shapes, depth)]
    x, y = (box[0] + box[2]) / 2, (box[1] + box[3]) / 2
    parts = [(box[0], box[1], x, y), (x, box[1], box[2], y), (box[0], y, x, box[3]), (x, y, box[2], box[3])]
    return [cell for part in parts for cell in octree(part, shapes, depth + 1)]


def kdtree(box, shapes, depth=0):
    """Cells split at the plane of least expected cost."""
    shapes = [s for s in shapes if overlaps(s, box)]
    best = (len(shapes) * area(box), None)
    for axis in (0, 1):
        for plane in {edge for s in shapes for edge in (bounds([s])[axis], bounds([s])[axis + 2])}:
            if box[axis] + 1 < plane < box[axis + 2] - 1:
                low, high = cut(box, axis, plane)
                counts = [sum(overlaps(s, part) for s in shapes) for part in (low, high)]
                cost = 0.8 * area(box) + counts[0] * area(low) + counts[1] * area(high)
                best = min(best, (cost, (axis, plane)), key=lambda b: b[0])
    if best[1] is None or depth == 10:
        return [(box, shapes, depth)]
    return [cell for part in cut(box, *best[1]) for cell in kdtree(part, shapes, depth + 1)]


def cut(box, axis, plane):
    low, high = list(box), list(box)
    low[axis + 2], high[axis] = plane, plane
    return tuple(low), tuple(high)


def bvh(shapes, width, depth=0):
    """Boxes of a hierarchy that divides its shapes; wider nodes divide the largest of their parts again."""
    node = [(bounds(shapes), shapes, depth)]
    if len(shapes) <= 2:
        return node
    parts = [shapes]
    while len(parts) < width:
        largest = max(parts, key=lambda part: area(bounds(part)) if len(part) > 2 else 0)
        if len(largest) <= 2:
            break
        parts.remove(largest)
        orders = [sorted(largest, key=lambda s: s[axis]) for axis in (0, 1)]
        halves = [(order[:k], order[k:]) for order in orders for k in range(1, len(order))]
        parts += min(halves, key=lambda h: sum(len(half) * area(bounds(half)) for half in h))
    return node + [box for part in parts for box in bvh(part, width, depth + 1)]


def draw(name, boxes, tested, nodes):
    """Boxes, shapes and the ray; `tested` are the shapes that the ray is tested against, in red."""
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {SIZE + 2 * MARGIN} {SIZE + 2 * MARGIN + 26}" width="424" font-family="sans-serif">',
        f'<rect width="100%" height="100%" fill="#fff"/><g transform="translate({MARGIN} {MARGIN})">',
    ]
    for box, _, depth in boxes:
        fill = "#fff3d6" if nodes and crosses(box) and name in ("octree", "kdtree") else "none"
        parts.append(
            f'<rect x="{box[0]:.1f}" y="{box[1]:.1f}" width="{box[2] - box[0]:.1f}" height="{box[3] - box[1]:.1f}" fill="{fill}" '
            f'stroke="{LINES[min(depth, 5)] if name.startswith("bvh") else "#1f6f8b"}" stroke-width="{1.2 if crosses(box) else 0.7}"/>'
        )
    for shape in SHAPES:
        color = "#d4483b" if shape in tested else "#c9ccd1"
        parts.append(f'<circle cx="{shape[0]:.1f}" cy="{shape[1]:.1f}" r="{shape[2]:.1f}" fill="{color}"/>')
    (x0, y0), (x1, y1) = RAY
    parts.append(f'<line x1="{x0}" y1="{y0}" x2="{x1}" y2="{y1}" stroke="#222" stroke-width="2"/></g>')
    label = f"{len(tested)} shapes tested" + (f", {nodes} boxes or cells visited" if nodes else "")
    parts.append(f'<text x="{MARGIN}" y="{SIZE + 2 * MARGIN + 14}" font-size="14">{label}</text></svg>')
    (FOLDER / f"{name}.svg").write_text("\n".join(parts) + "\n")


def growth():
    """The table of the page as a plot with logarithmic axes."""
    lines = (FOLDER.parent / "accelerators_study.md").read_text().splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("| triangles |"))
    cells = [[cell.strip(" `").replace(",", "") for cell in line.strip("|").split("|")] for line in lines[start:] if line.startswith("|")]
    names, rows = cells[0][1:], [[float(cell) for cell in row] for row in cells[2:] if row[0].isdigit()]
    left, top, width, height = 64, 14, 420, 300
    x = lambda n: left + (math.log10(n) - 2) / 3 * width
    y = lambda ns: top + height - (math.log10(ns) - 2) / 6 * height
    parts = [
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 580 360" width="580" font-family="sans-serif" font-size="13">',
        '<rect width="100%" height="100%" fill="#fff"/>',
    ]
    for k in range(2, 9):
        label = {2: "100 ns", 3: "1 µs", 4: "10 µs", 5: "0.1 ms", 6: "1 ms", 7: "10 ms", 8: "0.1 s"}[k]
        parts.append(
            f'<path d="M{left} {y(10 ** k):.1f}h{width}" stroke="#ddd"/><text x="{left - 6}" y="{y(10 ** k) + 4:.1f}" text-anchor="end">{label}</text>'
        )
    for row in rows:
        parts.append(f'<text x="{x(row[0]):.1f}" y="{top + height + 20}" text-anchor="middle">{row[0]:,.0f}</text>')
    parts.append(f'<text x="{left + width / 2}" y="{top + height + 40}" text-anchor="middle">triangles</text>')
    # Labels at the ends of lines keep a distance from each other.
    ends, last = {}, -100.0
    for i in sorted(range(len(names)), key=lambda i: y(rows[-1][i + 1])):
        last = max(y(rows[-1][i + 1]) + 4, last + 14)
        ends[i] = last
    for i, name in enumerate(names):
        points = " ".join(f"{x(row[0]):.1f},{y(row[i + 1]):.1f}" for row in rows)
        color = ["#d4483b", "#c0872b", "#8a4f9e", "#3a8f5c", "#1f6f8b"][i]
        parts.append(
            f'<polyline points="{points}" fill="none" stroke="{color}" stroke-width="2"/><text x="{left + width + 8}" y="{ends[i]:.1f}" fill="{color}">{name}</text>'
        )
    (FOLDER / "growth.svg").write_text("\n".join(parts) + "\n</svg>\n")


def main():
    FOLDER.mkdir(exist_ok=True)
    growth()
    world = (0, 0, SIZE, SIZE)
    draw("linear", [], SHAPES, 0)
    for name, cells in [("octree", octree(world, SHAPES)), ("kdtree", kdtree(world, SHAPES))]:
        met = [cell for cell in cells if crosses(cell[0])]
        draw(name, cells, [s for s in SHAPES if any(s in cell[1] for cell in met)], len(met))
    for name, width in [("bvh", 2), ("bvh_wide", 4)]:
        boxes = bvh(SHAPES, width)
        met = [box for box in boxes if crosses(box[0])]
        leaves = [s for box in met if len(box[1]) <= 2 for s in box[1]]
        draw(name, boxes, leaves, len(met))


main()
