"""Components and pairs of components on a tape, with terms that a case does not need left out by its zeros and ones."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace

from eomgen.base.data import dataclass
from eomgen.products.waves.second_order.kernels import KERNELS
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.tape import Ref, Tape

#: Columns of the table of components: wave vector, wave number, unit vector, angular frequency (of a label),
#: the part of the frequency that a current adds at a fixed point, coth k h, 1 / sinh^2 k h, 1 / (1 + exp(-2 k h)), and
#: cosh k (c + h) / sinh k h and sinh k (c + h) / sinh k h at a depth.
COLUMNS = ("kx", "ky", "k", "ex", "ey", "w", "doppler", "C", "s", "N", "Ch", "Sh")
#: Columns of the table of pairs: potential and displacements of the sum and of the difference, the difference
#: of frequencies, and the velocity of drift of pairs that do not move against one another.
ENTRIES = ("Bp", "Xp", "Yp", "Zp", "Bm", "Xm", "Ym", "Zm", "w", "Dx", "Dy")
#: Self-interaction of a component: potential and displacements of twice the phase, lift, and velocity of drift.
OWN = ("Bp", "Xp", "Yp", "Zp", "lift", "Dx", "Dy")


@dataclass(frozen=True)
class WaveNumber:
    """Arguments of a dispersion relation: the wave vector (kx, ky) in rad/m, its length k, gravity g in m/s^2 and the
    water's depth h in m, None for infinite depth."""

    kx: Scalar
    ky: Scalar
    k: Scalar
    g: Scalar
    h: Scalar | None
    _algebra: Algebra

    def sqrt(self, x: Scalar) -> Scalar:
        """Return the square root.

        Parameters
        ----------
        x : Scalar
            Argument.

        Returns
        -------
        Scalar
            On the same tape.
        """
        return self._algebra.call(Op.SQRT, x)

    def tanh(self, x: Scalar) -> Scalar:
        """Return the hyperbolic tangent.

        Parameters
        ----------
        x : Scalar
            Argument.

        Returns
        -------
        Scalar
            On the same tape.
        """
        return self._algebra.call(Op.TANH, x)

    def exp(self, x: Scalar) -> Scalar:
        """Return the exponential.

        Parameters
        ----------
        x : Scalar
            Argument.

        Returns
        -------
        Scalar
            On the same tape.
        """
        return self._algebra.call(Op.EXP, x)

    @property
    def gravity_waves(self) -> Scalar:
        """The angular frequency sqrt(g k tanh k h) of free waves in water at rest."""
        return self.sqrt(self.g * self.k if self.h is None else self.g * self.k * self.tanh(self.k * self.h))


Dispersion = Callable[[WaveNumber], Scalar]


def gravity_waves(wave: WaveNumber) -> Scalar:
    """Return the angular frequency of free waves in water at rest: sqrt(g k tanh k h).

    Parameters
    ----------
    wave : WaveNumber
        Wave vector, gravity and depth.

    Returns
    -------
    Scalar
        In rad/s.
    """
    return wave.gravity_waves


@dataclass(frozen=True)
class Case:
    """Which waves there are.

    Attributes
    ----------
    finite : bool
        Whether the water has a bottom; else every hyperbolic function is an exponential.
    spread : bool
        Whether the components have several directions; else x is along the waves, and y is left out.
    surface : bool
        Whether kernels are taken at c = 0; else at any depth.
    """

    finite: bool
    spread: bool
    surface: bool

    @property
    def entries(self) -> tuple[str, ...]:
        """The entries of a pair that are not zero in this case."""
        if self.spread:
            return ENTRIES
        return ("Bp", "Xp", "Zp", "Bm", "Xm", "Zm", "w") if self.finite else ("Bm", "Xm", "Zm", "w")


class PairTape:
    """The tape of a case: formulas for a component's row of ``COLUMNS`` and for a pair's row of ``case.entries``.

    Blocks of inputs: ``k`` (kx, ky) of a component; ``p`` (g, h, c); ``i`` and ``j``, rows of components, the first of
    the higher frequency.

    Attributes
    ----------
    component : references of ``COLUMNS``
    pair : references of ``case.entries``
    degenerate : references of ``case.entries`` for a pair of equal frequencies and different directions; empty for
        waves of one direction
    own : references of ``OWN``, of the component in block ``i``
    """

    def __init__(self, case: Case, dispersion: Dispersion = gravity_waves) -> None:
        self.case = case
        self.tape = Tape()
        self._algebra = Algebra(self.tape)
        self._g, self._h, self._c = self._algebra.block("p", 3)
        self.component = self._component(dispersion)
        self.pair = self._pair()
        self.degenerate = self._degenerate() if case.spread else ()
        self.own = self._own()

    # -- components -------------------------------------------------------------------------------------------------

    def _component(self, dispersion: Dispersion) -> tuple[Ref, ...]:
        """Record a component's wave number, frequency and depth functions, and return the references of ``COLUMNS``."""
        call, case = self._algebra.call, self.case
        unity, zero = self._algebra.one, self._algebra.zero
        kx, ky = self._algebra.block("k", 2)
        self.tape.blocks.append((len(self.tape.op), "a component: length and direction of the wave vector"))
        k = call(Op.SQRT, kx * kx + ky * ky)
        h = self._h if case.finite else None
        self.tape.blocks.append((len(self.tape.op), "frequency by the dispersion relation, and the part of a current"))
        forth = dispersion(WaveNumber(kx, ky, k, self._g, h, self._algebra))
        back = dispersion(WaveNumber(-kx, -ky, k, self._g, h, self._algebra))
        half = self._algebra.scalar(0.5)
        w, doppler = half * (forth + back), half * (forth - back)
        if case.finite:
            self.tape.blocks.append((len(self.tape.op), "hyperbolic functions of depth, which do not overflow"))
            small = call(Op.EXP, k * self._h * -2.0)
            N = unity / (unity + small)
            C = unity / call(Op.TANH, k * self._h)
            s = small * 4.0 * (C * N) * (C * N)
            if case.surface:
                Ch, Sh = C, unity
            else:
                Ch = C * self._cosh_ratio(k, N)
                Sh = Ch * call(Op.TANH, k * (self._c + self._h))
        else:
            C, s, N = unity, zero, unity
            Ch = Sh = unity if case.surface else call(Op.EXP, k * self._c)
        return tuple(x.ref for x in (kx, ky, k, kx / k, ky / k, w, doppler, C, s, N, Ch, Sh))

    def _cosh_ratio(self, k: Scalar, N: Scalar) -> Scalar:
        """Return cosh k (c + h) / cosh k h; N is 1 / (1 + exp(-2 k h))."""
        call = self._algebra.call
        return N * (call(Op.EXP, k * self._c) + call(Op.EXP, k * (self._c + self._h * 2.0) * -1.0))

    # -- pairs ------------------------------------------------------------------------------------------------------

    def _rows(self, names: str = "ij") -> tuple[dict[str, Scalar], dict[str, Scalar]]:
        """Return the rows of the two components in the blocks ``names``, each by names of ``COLUMNS``, with values that
        the case determines in place of inputs."""
        rows = []
        for name in names:
            row = dict(zip(COLUMNS, self._algebra.block(name, len(COLUMNS)), strict=True))
            if not self.case.spread:
                row |= {"kx": row["k"], "ky": self._algebra.zero}
            if not self.case.finite:
                row |= {"C": self._algebra.one, "s": self._algebra.zero, "Sh": row["Ch"]}
            if self.case.surface:
                row |= {"Ch": row["C"], "Sh": self._algebra.one}
            rows.append(row)
        return rows[0], rows[1]

    def _kernel_arguments(self, names: str = "ij") -> dict[str, Scalar]:
        """Return, by symbol, the arguments of the kernels of sum and difference for the components in the blocks
        ``names``, with differences of nearly equal numbers in exact form."""
        (i, j), call = self._rows(names), self._algebra.call
        unity, zero = self._algebra.one, self._algebra.zero
        case, values = self.case, {"g": self._g, "one": unity}
        for row, name in ((i, "i"), (j, "j")):
            values |= {f"{key}_{name}": row[key] for key in ("kx", "ky", "k", "w", "C", "s", "Ch", "Sh")}
        if case.spread:
            values["sx"], values["sy"] = i["kx"] + j["kx"], i["ky"] + j["ky"]
            values["dx"], values["dy"] = i["kx"] - j["kx"], i["ky"] - j["ky"]
            values["delta"] = (values["sx"] * values["dx"] + values["sy"] * values["dy"]) / (i["k"] + j["k"])
            x, y = i["ex"] - j["ex"], i["ey"] - j["ey"]
            values["lean"] = (x * x + y * y) * 0.5
        else:
            values |= {"sx": i["k"] + j["k"], "sy": zero, "dx": i["k"] - j["k"], "dy": zero, "lean": zero}
            values["delta"] = values["dx"]
        delta, both = values["delta"], i["C"] * j["C"]
        if case.finite:
            values["q"] = (i["s"] + j["s"] + i["s"] * j["s"]) / (both + unity)
            values["dt"] = call(Op.TANH, delta * self._h) * values["q"] / both
            steep = delta / i["C"] + j["k"] * values["dt"]
        else:
            values["q"] = values["dt"] = zero
            steep = delta
        values["w"] = self._g * steep / (i["w"] + j["w"])
        if not case.finite:
            values["E"] = values["lag"] = zero
        elif case.surface:
            values["E"], values["lag"] = values["q"], values["dt"] * both
        else:
            above = self._c + self._h
            depth = (i["k"] + j["k"]) * self._h
            waves = call(Op.EXP, delta * above - depth) + call(Op.EXP, -(delta * above) - depth)
            values["E"] = waves * 2.0 * (i["C"] * i["N"]) * (j["C"] * j["N"])
            values["lag"] = call(Op.TANH, delta * above) * values["E"]
        return values

    def _vector(self, values: dict[str, Scalar], sign: str) -> dict[str, Scalar]:
        """Return px, py, kT, P and Pc, arguments of a kernel, of the sum (``sign`` s) or difference (d) of both wave
        vectors."""
        call, case = self._algebra.call, self.case
        x, y = values[f"{sign}x"], values[f"{sign}y"]
        k = call(Op.SQRT, x * x + y * y) if case.spread else x
        kT = k * call(Op.TANH, k * self._h) if case.finite else k
        if case.surface:
            P, Pc = self._algebra.one, kT
        elif case.finite:
            N = self._algebra.one / (self._algebra.one + call(Op.EXP, k * self._h * -2.0))
            P = self._cosh_ratio(k, N)
            Pc = k * call(Op.TANH, k * (self._c + self._h)) * P
        else:
            P = call(Op.EXP, k * self._c)
            Pc = k * P
        return {"px": x, "py": y, "kT": kT, "P": P, "Pc": Pc}

    def _pair(self) -> tuple[Ref, ...]:
        self.tape.blocks.append((len(self.tape.op), "a pair: sum and difference of wave vectors and frequencies"))
        values = self._kernel_arguments()
        result = dict(zip(("Bp", "Xp", "Yp", "Zp"), self._kernel("sum", values, "s"), strict=True))
        result |= zip(("Bm", "Xm", "Ym", "Zm"), self._kernel("difference", values, "d"), strict=True)
        result |= {"w": values["w"], "Dx": self._algebra.zero, "Dy": self._algebra.zero}
        return tuple(result[name].ref for name in self.case.entries)

    def _degenerate(self) -> tuple[Ref, ...]:
        self.tape.blocks.append((len(self.tape.op), "a pair of equal frequencies: it drifts, and a part stands still"))
        values = self._kernel_arguments()
        drift_x, drift_y, *still = self._kernel("degenerate", values, "d")
        result = dict(zip(("Bp", "Xp", "Yp", "Zp"), self._kernel("sum", values, "s"), strict=True))
        result |= dict(zip(("Xm", "Ym", "Zm"), still, strict=True))
        result |= {"Bm": self._algebra.zero, "w": self._algebra.zero, "Dx": drift_x, "Dy": drift_y}
        return tuple(result[name].ref for name in self.case.entries)

    def _own(self) -> tuple[Ref, ...]:
        self.tape.blocks.append((len(self.tape.op), "a component with itself: the kernel of a pair counts it twice"))
        values = self._kernel_arguments("ii")
        half = self._algebra.scalar(0.5)
        twice = [half * x for x in self._kernel("sum", values, "s")]
        Ch, Sh, k = values["Ch_i"], values["Sh_i"], values["k_i"]
        drift = half * values["w_i"] * (Ch * Ch + Sh * Sh)
        return tuple(x.ref for x in (*twice, half * k * Ch * Sh, drift * values["kx_i"], drift * values["ky_i"]))

    def _kernel(self, name: str, values: dict[str, Scalar], sign: str) -> list[Scalar]:
        return KERNELS[name](SimpleNamespace(**values | self._vector(values, sign)))
