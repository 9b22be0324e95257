"""Shape data and frequencies of rotating beams against published digits (dossier 1.10.0)."""

import pytest
from mpmath import mpf, pi, workdps

from tests.oracles.beam_shapes import DIGITS, integral, root_and_ratio, sampled, shape, stiffening
from tests.oracles.rotating_beam import frequencies

CLAMPED_FREE = [
    ("1.8751040687119612", "0.734095513758913", "0.78299175603963", "0.56882574370991", "12.362363368326"),
    ("4.6940911329741746", "1.01846731875922", "0.43393589511072", "0.090766786886387", "485.51881851337"),
    ("7.8547574382376126", "0.999224496517428", "0.25442529686611", "0.032416374369744", "3806.5462663915"),
    ("10.995540734875467", "1.00003355325171"),
    ("14.137168391046471", "0.99999855010865"),
]
FREE_FREE = [
    ("4.730040744862704", "0.982502214576238"),
    ("7.8532046240958376", "1.00077731190727"),
    ("10.995607838001671", "0.999966450125409"),
]
PAIRS = [(1, 1), (1, 2), (1, 3), (2, 2), (2, 3), (3, 3)]
STIFFENING = [
    ["1.570878189994", "-0.4223203891091", "-1.072084834106", "8.647142693561", "1.890054708032", "24.95211330817"],
    ["1.193336374108", "-0.6858552834474", "-0.7923792203096", "6.478224864076", "0.1694078847615", "17.85951987986"],
    ["4.647778318679", "-7.379875269662", "3.941515487127", "32.41739902797", "-22.35244443989", "77.2988908023"],
]
# speed: flap without hub, lag without hub, flap with a hub of radius L, lag with it
ROTATING = {
    0: ("3.51602, 22.03449, 61.69721", "3.51602, 22.03449", "3.51602, 22.03449", "3.51602, 22.03449"),
    2: ("4.13732, 22.61492, 62.27318", "3.62180, 22.52631", "4.83369, 23.36604", "4.40052, 23.28029"),
    4: ("5.58500, 24.27335, 63.96676", "3.89772, 23.94150", "7.47505, 26.95726", "6.31477, 26.65884"),
    6: ("7.36037, 26.80908, 66.68391", "4.26323, 26.12904", "10.44387, 32.02724", "8.54835, 31.46020"),
    8: ("9.25684, 29.99538, 70.29296", "4.65715, 28.90887", "13.50739, 37.95379", "10.88345, 37.10108"),
    10: ("11.20233, 33.64037, 74.64929", "5.04897, 32.11969", "16.60636, 44.36822", "13.25788, 43.22660"),
    12: ("13.17015, 37.60311, 79.61448", "5.42705, 35.63698", "19.72154, 51.07013", "15.65053, 49.64029"),
}


def printed(value: mpf, published: str) -> bool:
    """Say whether a value rounds to what is printed, or to its neighbour in the last digit."""
    decimals = len(published.partition(".")[2])
    with workdps(DIGITS):
        return abs(value - mpf(published)) <= mpf(10) ** -decimals


@pytest.mark.slow_except("1")
@pytest.mark.parametrize("mode", [1, 2, 3, 4, 5])
def test_clamped_free_shapes_are_the_published_ones(mode: int) -> None:
    row, phi = CLAMPED_FREE[mode - 1], shape("clamped-free", mode)
    bend = shape("clamped-free", mode, 2)
    found = [*root_and_ratio("clamped-free", mode), integral(phi), integral(lambda x: x, phi), integral(bend, bend)]
    assert all(printed(value, text) for value, text in zip(found, row, strict=False))
    with workdps(DIGITS):
        assert abs(integral(phi, phi) - 1) < mpf(10) ** -30
        assert abs(phi(mpf(1)) + 2 * (-1) ** mode) < mpf(10) ** -30
        for derivative, end in ((0, 0), (1, 0), (2, 1), (3, 1)):
            assert abs(shape("clamped-free", mode, derivative)(mpf(end))) < mpf(10) ** -28
        assert abs(found[3] * found[0] ** 2 - 2) < mpf(10) ** -30 and abs(found[4] - found[0] ** 4) < mpf(10) ** -25


@pytest.mark.long_except_every(2)
@pytest.mark.slow_except("pair0")
@pytest.mark.parametrize("pair", PAIRS)
def test_stiffening_integrals_are_the_published_ones(pair: tuple[int, int]) -> None:
    found = stiffening("clamped-free", *pair)
    assert all(printed(value, row[PAIRS.index(pair)]) for value, row in zip(found, STIFFENING, strict=True))


@pytest.mark.slow_except("1")
@pytest.mark.parametrize("mode", [1, 2, 3])
def test_free_free_shapes_are_the_published_ones(mode: int) -> None:
    phi = shape("free-free", mode)
    assert all(printed(*pair) for pair in zip(root_and_ratio("free-free", mode), FREE_FREE[mode - 1], strict=True))
    with workdps(DIGITS):
        assert abs(phi(mpf(0)) - 2) < mpf(10) ** -30
        assert printed(phi(mpf(1) / 2), ("-1.21564445883", "0.00000000000", "1.42238121418")[mode - 1])
        assert abs(integral(phi, phi) - 1) < mpf(10) ** -30
        assert max(abs(integral(phi)), abs(integral(lambda x: x, phi))) < mpf(10) ** -30
        for derivative, end in ((2, 0), (3, 0), (2, 1), (3, 1)):
            assert abs(shape("free-free", mode, derivative)(mpf(end))) < mpf(10) ** -28
        assert mode > 1 or abs(phi(mpf("0.2241575227"))) < mpf(10) ** -9


@pytest.mark.slow_except("2")
@pytest.mark.parametrize("mode", [1, 2, 3])
def test_sines_have_their_closed_integrals(mode: int) -> None:
    phi, slope, bend = (shape("pinned-pinned", mode, derivative) for derivative in range(3))
    with workdps(DIGITS):
        z, root = mode * pi, mpf(2) ** 0.5
        wanted = [1, root * (1 - (-1) ** mode) / z, -root * (-1) ** mode / z, z**2, z**4]
        found = [
            integral(phi, phi),
            integral(phi),
            integral(lambda x: x, phi),
            integral(slope, slope),
            integral(bend, bend),
        ]
        assert all(
            abs(value - exact) < mpf(10) ** -27 * (1 + abs(exact)) for value, exact in zip(found, wanted, strict=True)
        )


def test_samples_are_the_shapes() -> None:
    assert sampled("clamped-free", 5, [0.0, 1.0])[:, 1] == pytest.approx([2, -2, 2, -2, 2], abs=1e-15)
    assert sampled("free-free", 2, [0.25], 3)[1, 0] == pytest.approx(
        float(shape("free-free", 2, 3)(mpf("0.25"))), rel=1e-14
    )


@pytest.mark.long_except_every(2)
@pytest.mark.slow_except("0")
@pytest.mark.parametrize("speed", list(ROTATING))
def test_rotating_beam_has_the_published_frequencies(speed: int) -> None:
    columns = ((0, False), (0, True), (1, False), (1, True))
    for text, (hub, in_plane) in zip(ROTATING[speed], columns, strict=True):
        wanted = text.split(", ")
        found = frequencies(len(wanted), speed, hub, in_plane=in_plane)
        assert all(printed(value, digits) for value, digits in zip(found, wanted, strict=True)), (text, found)
        assert len(found) == len(wanted)


def test_beam_at_rest_has_the_squared_roots_of_its_shapes() -> None:
    for mode, value in enumerate(frequencies(3, 0.0), 1):
        with workdps(DIGITS):
            assert abs(value - root_and_ratio("clamped-free", mode)[0] ** 2) < mpf(10) ** -25
