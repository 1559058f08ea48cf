"""A force of your own: one kernel and one class. Here a geyser, with one of the bundled vortices beside it."""

from PIL import Image

import wavetank as wt


@wt.qd.kernel(fastcache=True)
def lift_up(
    particles: wt.Particles, x: wt.qd.f32, width: wt.qd.f32, strength: wt.qd.f32, dt: wt.qd.f32, count: wt.qd.i32
):
    for i in range(count):
        q = (particles.x[i][0] - x) / width
        particles.v[i][1] += dt * strength * wt.qd.exp(-q * q)


class Geyser(wt.Force):
    """Lifts the water at one place."""

    x: float
    width: float = 0.08
    strength: float = 20.0  # m/s^2

    def apply(self, particles, count, dt, time):
        pulse = self.strength if time % 0.6 < 0.2 else 0.0
        lift_up(particles, self.x, self.width, pulse, dt, count)

    def largest_acceleration(self):
        return self.strength

    def largest_speed(self):
        return 3.0


sim = wt.Simulation(wt.Scene.load("still-tank-2d").changed(spacing=0.02))
sim.forces.append(Geyser(x=0.25))
sim.forces.append(wt.Vortex(center=(0.7, 0.2), radius=0.2, speed=1.0, axis=(0, 0, 1)))
sim.advance(0.5)
Image.fromarray(wt.render(sim, width=480, height=720)).save("geyser.png")
print(f"the highest drop is at {sim.positions[:, 1].max():.2f} m: geyser.png")
