"""Papers of the methods, as BibTeX: the register by the names in ``source`` of a method.

Titles and pages follow the references of the methods' docstrings and have not been compared with the journals; ``note``
names data that are known to be incomplete.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from eomgen.base.data import dataclass


@dataclass(frozen=True)
class Paper:
    """Entry of a bibliography.

    Attributes
    ----------
    kind : ``article``, ``book`` or ``inproceedings``
    key : of the entry
    fields : names and values in BibTeX, in their order
    """

    kind: str
    key: str
    fields: Mapping[str, str]

    def bibtex(self) -> str:
        """Return the entry as BibTeX."""
        lines = [f"  {name:9} = {{{value}}}," for name, value in self.fields.items()]
        return "\n".join([f"@{self.kind}{{{self.key},", *lines, "}"])


def _article(key: str, authors: str, title: str, citation: str, **more: str) -> Paper:
    """Return a journal article as a Paper.

    Parameters
    ----------
    citation : journal, volume, first page or number with the last page if known, and year, separated by bars
    more : further fields of BibTeX
    """
    journal, volume, pages, year = citation.split("|")
    fields = {"author": authors, "title": title, "journal": journal, "volume": volume, "pages": pages, "year": year}
    return Paper("article", key, {**fields, **more})


#: By the names in ``source``: authors and year.
PAPERS: Mapping[str, Paper] = {
    "Arnold and Hante 2017": _article(
        "arnold_hante_2017",
        "Arnold, Martin and Hante, Stefan",
        "Implementation Details of a Generalized-$\\alpha$ Differential-Algebraic Equation {Lie} Group Method",
        "Journal of Computational and Nonlinear Dynamics|12|021002|2017",
        doi="10.1115/1.4033441",
    ),
    "Arnold, Bruls and Cardona 2015": _article(
        "arnold_bruls_cardona_2015",
        'Arnold, Martin and Br{\\"u}ls, Olivier and Cardona, Alberto',
        "Error analysis of generalized-$\\alpha$ {Lie} group time integration methods for constrained mechanical"
        " systems",
        "Numerische Mathematik|129|149--179|2015",
        doi="10.1007/s00211-014-0633-1",
    ),
    "Blanes and Moan 2002": _article(
        "blanes_moan_2002",
        "Blanes, S. and Moan, P. C.",
        'Practical symplectic partitioned {Runge--Kutta} and {Runge--Kutta--Nystr{\\"o}m} methods',
        "Journal of Computational and Applied Mathematics|142|313--330|2002",
    ),
    "Blanes, Casas and Sanz-Serna 2014": _article(
        "blanes_casas_sanzserna_2014",
        "Blanes, Sergio and Casas, Fernando and Sanz-Serna, J. M.",
        "Numerical Integrators for the Hybrid {Monte Carlo} Method",
        "SIAM Journal on Scientific Computing|36|A1556--A1580|2014",
    ),
    "Bruls and Cardona 2010": _article(
        "bruls_cardona_2010",
        'Br{\\"u}ls, Olivier and Cardona, Alberto',
        "On the Use of {Lie} Group Time Integrators in Multibody Dynamics",
        "Journal of Computational and Nonlinear Dynamics|5|031002|2010",
        doi="10.1115/1.4001370",
    ),
    "Burrage 1978": _article(
        "burrage_1978",
        "Burrage, Kevin",
        "A special family of {Runge--Kutta} methods for solving stiff differential equations",
        "BIT Numerical Mathematics|18|22--41|1978",
    ),
    "Bursi, Gonzalez-Buelga, Vulcan, Neild and Wagg 2008": _article(
        "bursi_2008",
        "Bursi, O. S. and Gonzalez-Buelga, A. and Vulcan, L. and Neild, S. A. and Wagg, D. J.",
        "Novel coupling {Rosenbrock}-based algorithms for real-time dynamic substructure testing",
        "Earthquake Engineering \\& Structural Dynamics|37|339--360|2008",
    ),
    "Butcher 1979": _article(
        "butcher_1979",
        "Butcher, J. C.",
        "A Transformed Implicit {Runge--Kutta} Method",
        "Journal of the ACM|26|731--738|1979",
    ),
    "Creutz and Gocksch 1989": _article(
        "creutz_gocksch_1989",
        "Creutz, Michael and Gocksch, Andreas",
        "Higher-order hybrid {Monte Carlo} algorithms",
        "Physical Review Letters|63|9--12|1989",
    ),
    "Dormand and Prince 1980": _article(
        "dormand_prince_1980",
        "Dormand, J. R. and Prince, P. J.",
        "A family of embedded {Runge--Kutta} formulae",
        "Journal of Computational and Applied Mathematics|6|19--26|1980",
    ),
    "Griewank and Walther 2008": Paper(
        "book",
        "griewank_walther_2008",
        {
            "author": "Griewank, Andreas and Walther, Andrea",
            "title": "Evaluating Derivatives: Principles and Techniques of Algorithmic Differentiation",
            "publisher": "SIAM",
            "edition": "second",
            "year": "2008",
        },
    ),
    "Hante and Arnold 2021": _article(
        "hante_arnold_2021",
        "Hante, Stefan and Arnold, Martin",
        "{RATTLie}: A variational {Lie} group integration scheme for constrained mechanical systems",
        "Journal of Computational and Applied Mathematics|387|112492|2021",
    ),
    "Hante, Tumiotto and Arnold 2022": _article(
        "hante_tumiotto_arnold_2022",
        "Hante, Stefan and Tumiotto, Denise and Arnold, Martin",
        "A {Lie} group variational integration approach to the full discretization of a constrained geometrically exact"
        " {Cosserat} beam model",
        "Multibody System Dynamics|54|97--123|2022",
    ),
    "Hilber, Hughes and Taylor 1977": _article(
        "hilber_hughes_taylor_1977",
        "Hilber, Hans M. and Hughes, Thomas J. R. and Taylor, Robert L.",
        "Improved numerical dissipation for time integration algorithms in structural dynamics",
        "Earthquake Engineering \\& Structural Dynamics|5|283--292|1977",
    ),
    "Jia, Liu, Li and Liao 2014": Paper(
        "misc",
        "jia_liu_li_liao_2014",
        {
            "author": "Jia and Liu and Li and Liao",
            "year": "2014",
            "note": "Linearly implicit method of one stage for real-time tests; title and journal not checked",
        },
    ),
    "Jorba and Zou 2005": _article(
        "jorba_zou_2005",
        "Jorba, {\\`A}ngel and Zou, Maorong",
        "A Software Package for the Numerical Integration of {ODEs} by Means of High-Order {Taylor} Methods",
        "Experimental Mathematics|14|99--117|2005",
    ),
    "Kahan and Li 1997": _article(
        "kahan_li_1997",
        "Kahan, William and Li, Ren-Cang",
        "Composition constants for raising the orders of unconventional schemes for ordinary differential equations",
        "Mathematics of Computation|66|1089--1099|1997",
    ),
    "Kutta 1901": _article(
        "kutta_1901",
        "Kutta, Wilhelm",
        'Beitrag zur n{\\"a}herungsweisen Integration totaler Differentialgleichungen',
        'Zeitschrift f{\\"u}r Mathematik und Physik|46|435--453|1901',
    ),
    "Munthe-Kaas 1999": _article(
        "munthe_kaas_1999",
        "Munthe-Kaas, Hans",
        "High order {Runge--Kutta} methods on manifolds",
        "Applied Numerical Mathematics|29|115--127|1999",
    ),
    "Nakashima, Kato and Takaoka 1992": _article(
        "nakashima_kato_takaoka_1992",
        "Nakashima, Masayoshi and Kato, Hiroto and Takaoka, Eiji",
        "Development of real-time pseudo dynamic testing",
        "Earthquake Engineering \\& Structural Dynamics|21|79--92|1992",
    ),
    "Newmark 1959": _article(
        "newmark_1959",
        "Newmark, Nathan M.",
        "A Method of Computation for Structural Dynamics",
        "Journal of the Engineering Mechanics Division, ASCE|85|67--94|1959",
    ),
    "Omelyan, Mryglod and Folk 2003": _article(
        "omelyan_mryglod_folk_2003",
        "Omelyan, I. P. and Mryglod, I. M. and Folk, R.",
        "Symplectic analytically integrable decomposition algorithms: classification, derivation, and application to"
        " molecular dynamics, quantum and celestial mechanics simulations",
        "Computer Physics Communications|151|272--314|2003",
    ),
    "Rannacher 1984": _article(
        "rannacher_1984",
        "Rannacher, Rolf",
        "Finite element solution of diffusion problems with irregular data",
        "Numerische Mathematik|43|309--327|1984",
    ),
    "Shampine 1986": _article(
        "shampine_1986",
        "Shampine, Lawrence F.",
        "Some practical {Runge--Kutta} formulas",
        "Mathematics of Computation|46|135--150|1986",
    ),
    "Suzuki 1990": _article(
        "suzuki_1990",
        "Suzuki, Masuo",
        "Fractal decomposition of exponential operators with applications to many-body theories and {Monte Carlo}"
        " simulations",
        "Physics Letters A|146|319--323|1990",
    ),
    "Thompson and Kunthong 2006": Paper(
        "inproceedings",
        "thompson_kunthong_2006",
        {
            "author": "Thompson, Lonny L. and Kunthong, Prapot",
            "title": "Stabilized Time-Discontinuous {Galerkin} Methods with Applications to Structural Acoustics",
            "booktitle": "ASME International Mechanical Engineering Congress and Exposition",
            "year": "2006",
        },
    ),
    "Verlet 1967": _article(
        "verlet_1967",
        "Verlet, Loup",
        "Computer ``Experiments'' on Classical Fluids. {I}. Thermodynamical Properties of {Lennard-Jones} Molecules",
        "Physical Review|159|98--103|1967",
    ),
    "Wehage and Haug 1982": _article(
        "wehage_haug_1982",
        "Wehage, R. A. and Haug, E. J.",
        "Generalized Coordinate Partitioning for Dimension Reduction in Analysis of Constrained Dynamic Systems",
        "Journal of Mechanical Design|104|247--255|1982",
    ),
    "Wood, Bossak and Zienkiewicz 1980": _article(
        "wood_bossak_zienkiewicz_1980",
        "Wood, W. L. and Bossak, M. and Zienkiewicz, O. C.",
        "An alpha modification of {Newmark's} method",
        "International Journal for Numerical Methods in Engineering|15|1562--1566|1980",
    ),
    "Yoshida 1990": _article(
        "yoshida_1990",
        "Yoshida, Haruo",
        "Construction of higher order symplectic integrators",
        "Physics Letters A|150|262--268|1990",
    ),
}


def papers_of(source: str) -> Iterator[Paper]:
    """Yield the papers that a method's ``source`` names, in the order of the text."""
    there = [name for name in PAPERS if name in source]
    yield from (PAPERS[name] for name in sorted(there, key=source.index))
