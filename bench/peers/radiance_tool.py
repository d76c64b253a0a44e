"""Radiance: irradiance at points by rtrace -I, with or without its irradiance cache (Ward, Rubinstein & Clear 1988)."""
import os
import pathlib
import signal
import subprocess
import time

import numpy as np
import pyradiance

HOME = pathlib.Path(pyradiance.__file__).parent
OFFSET = 1e-5  # of a point from its surface [m]


def material(room, i):
    rho, emitted = room.rho[i], room.emitted[i]
    if not emitted.any():
        return "plastic", [*rho, 0, 0]
    # A light reflects nothing in Radiance. What this one reflects of its mean irradiance, 0.9 % of its own light in the Cornell
    # box, is added to its emission; the mean is given to it.
    return "light", list((emitted + rho * room.light_irradiance) / np.pi)


def cut(corners, parts):
    """A parallelogram as parts x parts smaller ones."""
    a, u, v = corners[0], (corners[1] - corners[0]) / parts, (corners[3] - corners[0]) / parts
    for i in range(parts):
        for j in range(parts):
            yield np.array([a + x * u + y * v for x, y in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))])


def description(room, light_parts):
    lines = []
    for i, corners in enumerate(room.corners):
        kind, numbers = material(room, i)
        lines.append(f"void {kind} m{i}\n0\n0\n{len(numbers)} {' '.join(repr(float(x)) for x in numbers)}")
        for k, piece in enumerate(cut(corners, light_parts) if kind == "light" else [corners]):
            flat = " ".join(repr(float(x)) for x in piece.ravel())
            lines.append(f"m{i} polygon p{i}.{k}\n0\n0\n{piece.size} {flat}")
    return "\n\n".join(lines) + "\n"


class Tool:
    name = "Radiance"

    def __init__(self, room, cores, folder):
        self.room, self.cores, self.folder = room, cores, pathlib.Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        self.environment = dict(os.environ, RAYPATH=str(HOME / "lib"))
        self.octrees = {}

    def octree(self, light_parts):
        if light_parts not in self.octrees:
            scene = self.folder / f"{self.room.id}-{light_parts}.rad"
            scene.write_text(description(self.room, light_parts))
            octree = scene.with_suffix(".oct")
            with open(octree, "wb") as out:
                subprocess.run([HOME / "bin/oconv", scene], check=True, stdout=out, env=self.environment)
            self.octrees[light_parts] = octree
        return self.octrees[light_parts]

    def command(self, settings, light_parts=1):
        options = [str(x) for option in settings.items() for x in option]
        if settings.get("-aa", 0) > 0:  # the processes share what they keep
            options += ["-af", str(self.folder / "kept.amb")]
        octree = self.octree(light_parts)
        return [HOME / "bin/rtrace", "-I+", "-h-", "-w-", "-fdd", "-n", str(self.cores), *options, octree]

    def call(self, command, rays, limit=None):
        """Irradiance, seconds. None, limit: when it took longer."""
        (self.folder / "kept.amb").unlink(missing_ok=True)
        start = time.perf_counter()
        # A group of its own: its other processes outlive it when it is stopped.
        child = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=self.environment,
                                 stderr=subprocess.DEVNULL, start_new_session=True)
        try:
            out, _ = child.communicate(rays.tobytes(), timeout=limit)
        except subprocess.TimeoutExpired:
            os.killpg(child.pid, signal.SIGTERM)
            child.communicate()
            return None, limit
        if child.returncode:
            raise RuntimeError(f"{command} failed")
        return np.frombuffer(out).reshape(-1, 3), time.perf_counter() - start

    def run(self, points, settings, seed, limit=None):
        """Irradiance, [point][band] [W/m^2], and the seconds that it took, without those that a run takes which asks for
        nothing. `settings`: rtrace's options by name. With "direct": N, direct light is found in a run of its own, the light cut
        into N x N parts (rtrace samples no polygon at more than 64 points, which alone is an error of 1 %), and put in the place
        of that of the main run, as in the five-phase method of daylighting."""
        settings = dict(settings)
        direct = settings.pop("direct", 0)
        commands = [(1, self.command(settings))]
        if direct:
            plain = {**settings, "-ab": 0, "-aa": 0}
            fine = {**plain, "-ds": 0.05 / direct, "-dj": 0.7, "-dt": 0, "-dc": 1}
            commands += [(-1, self.command(plain)), (1, self.command(fine, direct))]
        # rtrace takes no seed; in another order its points get other random numbers.
        order = np.random.default_rng(seed).permutation(len(points.position))
        rays = np.concatenate([points.position + OFFSET * points.normal, points.normal], axis=1)[order]
        total, seconds = 0, 0
        for sign, command in commands:
            _, start_up = self.call(command, rays[:0])
            values, took = self.call(command, rays, limit)
            if values is None:
                return None, limit
            total, seconds = total + sign * values, seconds + max(0.0, took - start_up)
        values = np.empty_like(total)
        values[order] = total
        return values, max(1e-4, seconds)
