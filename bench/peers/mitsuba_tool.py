"""Mitsuba 3: irradiance at points by paths from there."""
import time

import drjit as dr
import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")

WAVE = 1 << 24  # paths at a time: larger ones are no faster and take more memory
OFFSET = 1e-5  # of a point from its surface [m], so that float rounding does not put it behind


def scene_of(room):
    """One mesh for each material, so that no ray has more shapes to tell apart than there are materials."""
    triangles, polygon = room.triangles()
    scene = {"type": "scene"}
    look = np.concatenate([room.rho, room.emitted], axis=1)[polygon]
    for k, one in enumerate(np.unique(look, axis=0)):
        mine = triangles[(look == one).all(axis=1)]
        properties = mi.Properties()
        properties["bsdf"] = mi.load_dict({"type": "diffuse", "reflectance": rgb(one[:3])})
        if one[3:].any():
            properties["emitter"] = mi.load_dict({"type": "area", "radiance": rgb(one[3:] / np.pi)})
        mesh = mi.Mesh(f"material{k}", 3 * len(mine), len(mine), props=properties)
        parameters = mi.traverse(mesh)
        parameters["vertex_positions"] = mine.astype(np.float32).ravel()
        parameters["faces"] = np.arange(3 * len(mine), dtype=np.uint32)
        parameters.update()
        scene[f"mesh{k}"] = mesh
    return mi.load_dict(scene)


def rgb(value):
    return {"type": "rgb", "value": [float(v) for v in value]}


def direct(scene, interaction, normal, sample):
    """Irradiance by one sample of the light."""
    towards, light = scene.sample_emitter_direction(interaction, sample, True)
    return dr.maximum(0, dr.dot(normal, towards.d)) * light


@dr.syntax
def reflected(scene, sampler, ray, roulette):
    """Irradiance that one cosine-distributed ray brings, but for emission of what it hits: reflectance times irradiance
    there, and so on. Paths end by Russian roulette from bounce `roulette` on."""
    ray = mi.Ray3f(ray)
    through = mi.Spectrum(1)
    result = mi.Spectrum(0)
    bounce = mi.UInt32(0)
    active = mi.Bool(True)
    while active:
        si = scene.ray_intersect(ray, active)
        active &= si.is_valid() & (si.wi.z > 0)
        rho = si.bsdf(ray).eval_diffuse_reflectance(si, active)
        through *= rho
        most = dr.max(through)
        goes_on = dr.select(bounce >= roulette, dr.minimum(most, 1), 1.0)
        active &= most > 0
        si.n = dr.select(active, si.n, mi.Normal3f(0, 0, 1))
        towards, light = scene.sample_emitter_direction(si, sampler.next_2d(active), True, active)
        result += dr.select(active, through * dr.maximum(0, dr.dot(si.n, towards.d)) * light, 0)
        turn = mi.warp.square_to_cosine_hemisphere(sampler.next_2d(active))
        ray = si.spawn_ray(mi.Frame3f(si.n).to_world(turn))
        active &= sampler.next_1d(active) < goes_on
        through /= goes_on
        bounce += 1
    return result


class Tool:
    name = "Mitsuba 3"

    def __init__(self, room, cores):
        self.scene = scene_of(room)
        dr.set_thread_count(cores)
        self.integrator = mi.load_dict({"type": "path", "max_depth": -1, "rr_depth": 5})

    def run(self, points, settings, seed, limit=None):
        """Irradiance, [point][band] [W/m^2], and the seconds that it took."""
        start = time.perf_counter()
        count = len(points.position)
        position = mi.Point3f(*np.ascontiguousarray((points.position + OFFSET * points.normal).T, dtype=np.float32))
        normal = mi.Normal3f(*np.ascontiguousarray(points.normal.T, dtype=np.float32))
        total = np.zeros((count, 3))
        samples, rounds = settings["samples"], 1
        while samples * count > WAVE and samples % 4 == 0:  # so that what stratified samplers get stays a square
            samples, rounds = samples // 4, rounds * 4
        for k in range(rounds):
            total += self.wave(position, normal, count, samples, settings, seed * 100000 + k)
        return total / rounds, time.perf_counter() - start

    def wave(self, position, normal, count, samples, settings, seed):
        sampler = mi.load_dict({"type": settings["sampler"], "sample_count": samples})
        sampler.set_samples_per_wavefront(samples)
        sampler.seed(seed, count * samples)
        which = dr.arange(mi.UInt32, count * samples) // samples
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.p = dr.gather(mi.Point3f, position, which)
        si.n = dr.gather(mi.Normal3f, normal, which)
        frame = mi.Frame3f(si.n)
        turn = frame.to_world(mi.warp.square_to_cosine_hemisphere(sampler.next_2d()))
        ray = mi.Ray3f(si.p, turn)
        if settings["strategy"] == "path":
            light, _, _ = self.integrator.sample(self.scene, sampler, mi.RayDifferential3f(ray))
            value = np.pi * light
        else:
            value = mi.Spectrum(0)
            for _ in range(settings["direct"]):
                value += direct(self.scene, si, si.n, sampler.next_2d())
            value = value / settings["direct"] + reflected(self.scene, sampler, ray, settings["roulette"])
        dr.eval(value)  # all bands at once: otherwise each sum would trace the paths anew
        mean = [dr.block_sum(value[band], samples) / samples for band in range(3)]
        dr.eval(mean)
        return np.stack([np.array(m, dtype=float) for m in mean], axis=1)
