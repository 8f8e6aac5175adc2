"""Dynamics of platforms from their Lagrangian, by differences at 80 digits: nothing here is shared with the controller.

    python3 tests/oracle/lagrangian.py > tests/oracle/dynamics-asymmetric.json
    python3 tests/oracle/lagrangian.py --check VECTORS.json     compare with the reference vectors

Positions are functions of the pose; velocities are their directional derivatives; T is the sum over bodies, M its second
differences in the rates (exact, T is quadratic), C h' = dM/dt h' - grad T, G = grad V, J = dl/dh, f = J^-T (M h'' + C h' + G).
Needs mpmath.
"""
import json
import random
import sys

from mpmath import cos, lu_solve, matrix, mp, mpf, sin, sqrt

mp.dps = 80
STEP = mpf(10) ** -25
GRAVITY = mpf("9.81")


def rotation(angles):
    x, y, z = angles
    rx = matrix([[1, 0, 0], [0, cos(x), -sin(x)], [0, sin(x), cos(x)]])
    ry = matrix([[cos(y), 0, sin(y)], [0, 1, 0], [-sin(y), 0, cos(y)]])
    rz = matrix([[cos(z), -sin(z), 0], [sin(z), cos(z), 0], [0, 0, 1]])
    return rz * ry * rx


def vector(v):
    return matrix([mpf(x) for x in v])


def norm(v):
    return sqrt(sum(x * x for x in v))


def cross(a, b):
    return matrix([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def moved(h, direction, step):
    return [a + step * b for a, b in zip(h, direction)]


def derivative(function, h, direction):
    return (function(moved(h, direction, STEP)) - function(moved(h, direction, -STEP))) / (2 * STEP)


class Machine:
    """`h` is absolute: P_C in {B}."""

    def __init__(self, p):
        self.base = [vector(b) for b in p["base_joints"]]
        self.platform = [vector(b) for b in p["platform_joints"]]
        self.mass = mpf(p["mass"])
        self.inertia = matrix([[mpf(x) for x in row] for row in p["inertia"]])
        self.com = vector(p["center_of_mass"])
        self.ms, self.me, self.i_s, self.i_e, self.ls, self.le = (
            mpf(p[k]) for k in ("m_s", "m_e", "I_s", "I_e", "l_s", "l_e")
        )

    def leg(self, h, i):
        return vector(h[:3]) + rotation(h[3:]) * self.platform[i] - self.base[i]

    def lengths(self, h):
        return matrix([norm(self.leg(h, i)) for i in range(6)])

    def centers(self, h):
        """(mass, position) of every mass centre."""
        out = [(self.mass, vector(h[:3]) + rotation(h[3:]) * self.com)]
        for i in range(6):
            r = self.leg(h, i)
            s = r / norm(r)
            out.append((self.ms, self.base[i] + self.ls * s))
            out.append((self.me, self.base[i] + (norm(r) - self.le) * s))
        return out

    def potential(self, h):
        return sum(m * GRAVITY * x[2] for m, x in self.centers(h))

    def kinetic(self, h, rate):
        ahead, behind = self.centers(moved(h, rate, STEP)), self.centers(moved(h, rate, -STEP))
        energy = mpf(0)
        for (m, a), (_, b) in zip(ahead, behind):
            v = (a - b) / (2 * STEP)
            energy += m * sum(x * x for x in v) / 2
        turn = rotation(h[3:])
        spin = turn.T * derivative(lambda q: rotation(q[3:]), h, rate)
        omega = matrix([spin[2, 1], spin[0, 2], spin[1, 0]])
        energy += (omega.T * self.inertia * omega)[0] / 2
        for i in range(6):
            r = self.leg(h, i)
            swing = cross(r, derivative(lambda q: self.leg(q, i), h, rate)) / (r.T * r)[0]
            energy += (self.i_s + self.i_e) * (swing.T * swing)[0] / 2
        return energy

    def mass_matrix(self, h):
        unit = [[mpf(int(i == j)) for j in range(6)] for i in range(6)]
        single = [self.kinetic(h, u) for u in unit]
        m = matrix(6, 6)
        for i in range(6):
            for j in range(i, 6):
                pair = [a + b for a, b in zip(unit[i], unit[j])]
                m[i, j] = m[j, i] = self.kinetic(h, pair) - single[i] - single[j]
        return m

    def gradient(self, function, h):
        unit = [[mpf(int(i == j)) for j in range(6)] for i in range(6)]
        return matrix([derivative(function, h, u) for u in unit])

    def fields(self, h, hd, hdd):
        h, hd, hdd = ([mpf(x) for x in v] for v in (h, hd, hdd))
        m = self.mass_matrix(h)
        drift = derivative(self.mass_matrix, h, hd) if any(hd) else matrix(6, 6)
        coriolis = drift * matrix(hd) - self.gradient(lambda q: self.kinetic(q, hd), h)
        gravity = self.gradient(self.potential, h)
        jacobian = matrix(6, 6)
        for k in range(6):
            column = derivative(self.lengths, h, [mpf(int(k == j)) for j in range(6)])
            for i in range(6):
                jacobian[i, k] = column[i]
        force = m * matrix(hdd) + coriolis + gravity
        return {
            "leg_lengths": self.lengths(h),
            "J": jacobian,
            "M": m,
            "Cv": coriolis,
            "G": gravity,
            "F": force,
            "leg_forces": lu_solve(jacobian.T, force),
        }


def plain(value):
    if value.cols == 1:
        return [float(x) for x in value]
    return [[float(value[i, j]) for j in range(value.cols)] for i in range(value.rows)]


ASYMMETRIC = {
    "base_joints": [
        [0.081, 0.127, 0.006], [0.061, 0.141, -0.004], [-0.149, 0.012, 0.011],
        [-0.139, -0.023, -0.008], [0.071, -0.133, 0.003], [0.093, -0.118, 0.009],
    ],
    "platform_joints": [
        [0.098, 0.007, -0.013], [-0.041, 0.092, 0.008], [-0.055, 0.077, -0.006],
        [-0.057, -0.084, 0.012], [-0.043, -0.090, -0.009], [0.103, -0.011, 0.004],
    ],
    "height": 0.19,
    "mass": 1.4,
    "inertia": [[0.031, 0.0042, -0.0027], [0.0042, 0.037, 0.0031], [-0.0027, 0.0031, 0.0124]],
    "center_of_mass": [0.011, -0.017, 0.023],
    "m_s": 0.12, "m_e": 0.08, "I_s": 1.3e-4, "I_e": 7.1e-5, "l_s": 0.061, "l_e": 0.043,
}


def asymmetric():
    machine = Machine(ASYMMETRIC)
    generator = random.Random(20261121)
    vectors = []
    for index in range(12):
        reach, tilt = (0.0, 0.0) if index == 0 else ((5e-5, 6e-4) if index < 4 else ((0.01, 0.09) if index < 8 else (0.02, 0.5)))
        draw = lambda size: [generator.uniform(-size, size) for _ in range(3)]
        h = draw(reach) + draw(tilt)
        h[2] += ASYMMETRIC["height"]
        hd = [0.0] * 6 if index == 1 else draw(0.5) + draw(3.0)
        hdd = [0.0] * 6 if index == 2 else draw(5.0) + draw(30.0)
        state = {"id": f"asymmetric/{index:02}", "h": h, "hd": hd, "hdd": hdd}
        state.update({key: plain(value) for key, value in machine.fields(h, hd, hdd).items()})
        vectors.append(state)
    json.dump({"parameters": ASYMMETRIC, "vectors": vectors}, sys.stdout, indent=1)
    print()


def check(path):
    document = json.load(open(path))
    p = document["parameters"]
    pi = mp.pi
    angle = mpf(p["alpha_B_over_pi"]) * pi, mpf(p["alpha_P_over_pi"]) * pi
    joints = lambda radius, angles: [[mpf(radius) * cos(a), mpf(radius) * sin(a), 0] for a in angles]
    b, q = angle[0] / 2, angle[1] / 2
    base = [pi / 3 - b, pi / 3 + b, pi - b, pi + b, 5 * pi / 3 - b, 5 * pi / 3 + b]
    top = [q, 2 * pi / 3 - q, 2 * pi / 3 + q, 4 * pi / 3 - q, 4 * pi / 3 + q, -q]
    machine = Machine({
        "base_joints": joints(p["r_B"], base), "platform_joints": joints(p["r_P"], top), "mass": p["m_p"],
        "inertia": [[p["I_p"][i] if i == j else 0 for j in range(3)] for i in range(3)],
        "center_of_mass": p["com_offset"], **{k: p[k] for k in ("m_s", "m_e", "I_s", "I_e", "l_s", "l_e")},
    })
    worst = {}
    flat = lambda v: [y for x in v for y in flat(x)] if isinstance(v, list) else [v]
    for state in document["vectors"]:
        for key, value in machine.fields(state["h"], state["hd"], state["hdd"]).items():
            ours, theirs = flat(plain(value)), flat(state[key])
            size = sum(x * x for x in theirs) ** 0.5
            error = sum((x - y) ** 2 for x, y in zip(ours, theirs)) ** 0.5 / (size or 1)
            worst[key] = max(worst.get(key, 0), error)
    print(worst)


if __name__ == "__main__":
    check(sys.argv[2]) if sys.argv[1:2] == ["--check"] else asymmetric()
