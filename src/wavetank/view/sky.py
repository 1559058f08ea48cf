"""A clear day's sky, as light as a surface needs it.

A. J. Preetham, P. Shirley, B. Smits, "A practical analytic model for daylight", SIGGRAPH 1999,
doi:10.1145/311535.311545: Perez' formula for luminance and chromaticity (Eq. 3, Appendix A.2).

The model asks for six exponentials and an arc cosine for a direction, too much for every pixel of rippled water. Here
it is fitted once for a sun by seven functions of height and of the angle to the sun that need products only
(`radiance.sky` has the same), by least squares over the upper half of all directions, and scaled to what a white
surface shows under it.

    code      symbol   meaning                                     unit
    T                  turbidity: 2 clear, 6 hazy                  1
    up        cos θ    cosine of the angle to the zenith           1
    gamma     γ        angle to the sun                            rad
"""

import functools

import numpy as np

#: A, B, C, D, E of Perez' formula: for Y, x, y, each a line in the turbidity
PEREZ = np.array(
    [
        [(0.1787, -1.4630), (-0.3554, 0.4275), (-0.0227, 5.3251), (0.1206, -2.5771), (-0.0670, 0.3703)],
        [(-0.0193, -0.2592), (-0.0665, 0.0008), (-0.0004, 0.2125), (-0.0641, -0.8989), (-0.0033, 0.0452)],
        [(-0.0167, -0.2608), (-0.0950, 0.0092), (-0.0079, 0.2102), (-0.0441, -1.6537), (-0.0109, 0.0529)],
    ]
)
#: chromaticity of the zenith: powers 2, 1, 0 of the turbidity by powers 3 to 0 of the sun's angle to it
ZENITH = np.array(
    [
        [
            (0.00166, -0.00375, 0.00209, 0.0),
            (-0.02903, 0.06377, -0.03202, 0.00394),
            (0.11693, -0.21196, 0.06052, 0.25886),
        ],
        [
            (0.00275, -0.00610, 0.00317, 0.0),
            (-0.04214, 0.08970, -0.04153, 0.00516),
            (0.15346, -0.26756, 0.06670, 0.26688),
        ],
    ]
)
TO_RGB = np.array([(3.2406, -1.5372, -0.4986), (-0.9689, 1.8758, 0.0415), (0.0557, -0.2040, 1.0570)])
TERMS = 7
BRIGHT = 1.4  # what is seen of the sky over what it lights surfaces with


def preetham(directions: np.ndarray, to_sun: np.ndarray, turbidity: float) -> np.ndarray:
    """Return the radiance of the sky in unit directions [n, 3] above the horizon, linear RGB [n, 3], to a scale."""
    angle = np.arccos(np.clip(to_sun[1], 0.0, 1.0))
    coefficients = PEREZ @ (turbidity, 1.0)  # [3, 5]
    chi = (4.0 / 9.0 - turbidity / 120.0) * (np.pi - 2.0 * angle)
    luminance = (4.0453 * turbidity - 4.9710) * np.tan(chi) - 0.2155 * turbidity + 2.4192
    powers = np.array([angle**3, angle**2, angle, 1.0])
    zenith = np.array([luminance, *(np.array([turbidity**2, turbidity, 1.0]) @ ZENITH @ powers)])
    up = np.maximum(directions[:, 1], 0.02)
    cosine = np.clip(directions @ to_sun, -1.0, 1.0)

    def perez(up: np.ndarray, gamma: np.ndarray, cosine: np.ndarray) -> np.ndarray:
        a, b, c, d, e = coefficients.T[:, :, None]
        return (1.0 + a * np.exp(b / up)) * (1.0 + c * np.exp(d * gamma) + e * cosine**2)

    seen = perez(up, np.arccos(cosine), cosine)
    overhead = perez(np.ones(1), np.array([angle]), np.array([to_sun[1]]))
    luminous, x, y = zenith[:, None] * seen / overhead
    xyz = np.stack([x / y * luminous, luminous, (1.0 - x - y) / y * luminous])
    rgb: np.ndarray = np.maximum(TO_RGB @ xyz, 0.0).T
    return rgb


def terms(directions: np.ndarray, to_sun: np.ndarray) -> np.ndarray:
    """Return the functions that the sky is fitted by, [n, TERMS]; `radiance.sky` is the same on the device."""
    low = (1.0 - np.clip(directions[:, 1], 0.0, 1.0)) ** 2
    near = (0.5 + 0.5 * directions @ to_sun) ** 2
    low4, near4 = low**4, near**4
    return np.stack([np.ones_like(low), low, low4, near, near * low4, near4, near4**8], axis=1)


@functools.cache
def fitted(
    to_sun: tuple[float, ...], white: tuple[float, ...], horizon: tuple[float, ...], turbidity: float
) -> np.ndarray:
    """Return the weight of each function, linear RGB [TERMS, 3].

    The sky is `BRIGHT` times as bright as one under which a white surface shows `white`, and half of its tint is the
    model's; haze takes its lowest degrees to `horizon`, which the floor fades to.
    """
    sun = np.array(to_sun) / np.linalg.norm(to_sun)
    count = 4096  # evenly over the half sphere (a Fibonacci lattice)
    up = (np.arange(count) + 0.5) / count
    around, flat = 2.3999632297 * np.arange(count), np.sqrt(1.0 - up * up)
    directions = np.stack([flat * np.cos(around), up, flat * np.sin(around)], axis=1)
    seen = preetham(directions, sun, turbidity)
    level = 2.0 * (up @ seen) / count
    seen *= BRIGHT * np.sqrt(np.array(white) / level * (np.mean(white) / level.mean()))
    haze = (1.0 - up[:, None]) ** 5
    seen += haze * (np.array(horizon) - seen)
    weights: np.ndarray = np.linalg.lstsq(terms(directions, sun), seen, rcond=None)[0]
    return weights
