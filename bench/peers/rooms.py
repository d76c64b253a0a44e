"""The reference rooms: geometry, points, answers, and what an error is (README.md of the reference; DESIGN section 5)."""
import json
import math
import pathlib

import numpy as np

FILE = pathlib.Path(__file__).resolve().parents[2] / "tests/data/reference/c_scenes_with_occlusion.json"
CELLS = 32  # along each side of a polygon, for the whole scene


class Room:
    """polygons: lists of corners [m], rho and E [W/m^2] per band; light: index of the one that emits."""

    def __init__(self, case):
        self.id = case["id"]
        scene = case["scene"]
        self.names = [p["name"] for p in scene]
        self.corners = [np.array(p["vertices"], float) for p in scene]
        self.rho = np.array([p["reflectance"] for p in scene], float)
        self.emitted = np.array([p["emission"] for p in scene], float)
        self.light = int(np.argmax(self.emitted.sum(axis=1)))
        self.normals = [unit(np.cross(c[1] - c[0], c[2] - c[0])) for c in self.corners]
        means = {m["surface"]: m["H_mean"] for m in case["face_means_forward_tracing"]}
        self.light_irradiance = np.array(means[self.names[self.light]], float)
        self.points = Points.of_reference(case)
        self.everywhere = Points.of_surfaces(self)

    def triangles(self):
        """[triangle][corner][axis], and each one's polygon."""
        triangle, polygon = [], []
        for i, c in enumerate(self.corners):
            for k in range(1, len(c) - 1):
                triangle.append([c[0], c[k], c[k + 1]])
                polygon.append(i)
        return np.array(triangle), np.array(polygon)


class Points:
    """Where irradiance is asked for: position [m] and unit normal, [point][axis]; polygon and its parameters (u, v) where
    known. answer: irradiance [point][band] and its standard error; or halves: two independent ones, [half][point][band]."""

    def __init__(self, position, normal, polygon=None, uv=None, answer=None, error=None):
        self.position, self.normal, self.polygon, self.uv = position, normal, polygon, uv
        self.answer, self.error, self.halves = answer, error, None

    @staticmethod
    def of_reference(case):
        def column(key):
            return np.array([p[key] for p in case["points"]], float)

        return Points(column("point"), column("normal"), answer=column("H"), error=column("H_indirect_se"))

    @staticmethod
    def of_surfaces(room):
        """Centres of 32 x 32 cells of equal size in (u, v) on every polygon (of a triangle its 32 x 32 like ones). Those that
        something stands on are left out."""
        position, normal, polygon, uv = [], [], [], []
        for i, c in enumerate(room.corners):
            for u, v in cells(len(c)):
                if len(c) == 4:
                    p = (1 - v) * ((1 - u) * c[0] + u * c[1]) + v * ((1 - u) * c[3] + u * c[2])
                else:
                    p = c[0] + u * (c[1] - c[0]) + v * (c[2] - c[0])
                position.append(p)
                normal.append(room.normals[i])
                polygon.append(i)
                uv.append((u, v))
        position, normal, polygon, uv = map(np.array, (position, normal, polygon, uv))
        free = ~covered(room, position, normal)
        return Points(position[free], normal[free], polygon[free], uv[free])


def unit(v):
    return v / math.sqrt(v @ v)


def cells(corners):
    n = CELLS
    if corners == 4:
        return [((i + 0.5) / n, (j + 0.5) / n) for j in range(n) for i in range(n)]
    upright = [((i + 1 / 3) / n, (j + 1 / 3) / n) for j in range(n) for i in range(n - j)]
    return upright + [((i + 2 / 3) / n, (j + 2 / 3) / n) for j in range(n - 1) for i in range(n - 1 - j)]


def covered(room, position, normal):
    """Points inside a solid that stands on their polygon: what they face is seen from behind."""
    triangles, _ = room.triangles()
    nearest = np.full(len(position), np.inf)
    behind = np.zeros(len(position), bool)
    for a, b, c in triangles:
        n = np.cross(b - a, c - a)
        towards = normal @ n
        with np.errstate(divide="ignore", invalid="ignore"):
            t = ((a - position) @ n) / towards
            hit = position + t[:, None] * normal
        inside = np.isfinite(t) & (t > 1e-9) & (t < nearest)
        for p, q in ((a, b), (b, c), (c, a)):
            with np.errstate(invalid="ignore"):
                inside &= np.cross(q - p, hit - p) @ n >= 0
        nearest[inside], behind[inside] = t[inside], towards[inside] > 0
    return behind


def rooms():
    return [Room(case) for case in json.loads(FILE.read_text())["cases"]]


def rms(values, points):
    """RMS error relative to the mean of the answer, the answer's own chance taken out: by its standard error, in quadrature, or,
    where it is two independent halves A and B, by the mean of (H - A) (H - B), in which it cancels."""
    if points.halves is not None:
        a, b = points.halves
        return math.sqrt(max(0.0, np.mean((values - a) * (values - b)))) / points.halves.mean()
    squares = np.mean((values - points.answer) ** 2) - np.mean(points.error**2)
    return math.sqrt(max(0.0, squares)) / np.mean(points.answer)
