"""clrad: solves in one process that stays, bench/peers.cpp."""
import json
import subprocess

import numpy as np


class Tool:
    def __init__(self, room, cores, program, folder, name="clrad"):
        self.name, self.room, self.cores = name, room, cores
        self.values = f"{folder}/{name}.values"
        self.child = subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                                      text=True)

    def run(self, points, settings, seed, limit=None):
        """Irradiance, [point][band] [W/m^2], and the seconds that it took. At points of polygons what is displayed there, unless
        settings["gather"]; elsewhere a gather by sensors."""
        settings = dict(settings)
        request = {"case": self.room.id, "cores": self.cores, "seed": seed + 1, "values": self.values}
        if settings.pop("gather", False) or points.polygon is None:
            request["sensors"] = np.concatenate([points.position, points.normal], axis=1).tolist()
        else:
            request["places"] = [[int(p), *uv] for p, uv in zip(points.polygon, points.uv.tolist())]
        request["settings"] = settings
        if limit:
            request["limit"] = limit
        self.child.stdin.write(json.dumps(request) + "\n")
        self.child.stdin.flush()
        answer = json.loads(self.child.stdout.readline())
        if "trouble" in answer:
            raise RuntimeError(f"clrad with {settings}: {answer['trouble']}")
        if answer["stopped"]:
            return None, answer["seconds"]
        return np.fromfile(self.values).reshape(-1, 3), answer["seconds"]

    def close(self):
        self.child.stdin.close()
        self.child.wait()
