"""``eomgen sample``: samples of fields on a mesh from the posterior that a file describes."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import click

from eomgen.base.progress import terminal_bar
from eomgen.base.text import counted
from eomgen.cli import INTERRUPTED
from eomgen.cli.options import debug_option, folder_option, json_option
from eomgen.cli.printing import print_json, say
from eomgen.cli.tables import print_table

if TYPE_CHECKING:
    from eomgen.products.fields.sampling import FieldSamples


@click.command()
@click.argument("file", metavar="FILE")
@folder_option
@click.option("--method", default=None, help="minimum_norm2, omf4, suzuki4, leapfrog ...; the file's by default.")
@click.option("--mass", default=None, metavar="CHOICE", help="fisher, prior or unit; the file's by default.")
@click.option("--step", type=float, default=None, help="Of trajectories; 0: found by the warm-up.")
@click.option("--duration", type=float, default=None, help="Of a trajectory; 1.5 by default.")
@click.option("--first", default=None, metavar="PART", help="First part of trajectories: random, drift or kick.")
@click.option("--jitter", type=float, default=None, help="Part by which steps vary, 0 to 1.")
@click.option("--guard", type=float, default=None, help="Part of the largest stable step that steps may have.")
@click.option("--chains", type=int, default=None, metavar="N", help="Number of chains.")
@click.option("--start", default=None, metavar="WHERE", help="mode, prior, zero, or a .npy file of white fields.")
@click.option("--warm-up", type=int, default=None, metavar="N", help="Trajectories of each chain before samples.")
@click.option("--samples", type=int, default=None, metavar="N", help="Of each chain.")
@click.option("--seed", type=int, default=None, help="Of all random numbers of the chains.")
@click.option("--field", default=None, metavar="NAME", help="Whose samples are looked at.")
@click.option("--watched", type=int, default=None, metavar="N", help="Cells whose values are kept.")
@click.option("--bins", type=int, default=None, metavar="N", help="Of wave numbers.")
@click.option("--transforms", default=None, metavar="LIBRARY", help="scipy, or fftw by the package pyfftw.")
@click.option("--precision", default=None, metavar="KIND", help="Of gradients: double or single.")
@click.option("--resume", is_flag=True, help="Go on from the checkpoint of the folder, to the same bits.")
@click.option("--plots/--no-plots", default=True, show_default=True, help="Draw slices, power spectra and chains.")
@json_option
@debug_option
def sample(file: str, folder: str, resume: bool, plots: bool, as_json: bool, **options: Any) -> int:
    """Sample the fields of a FILE of kind "hamiltonian" with a [mesh] by Hamiltonian Monte Carlo.

    Writes samples.npz, trajectories.csv, scales.csv, summary.json, pictures, and checkpoint.npz, renewed once a minute.
    Ctrl-C keeps the samples drawn so far; the exit code is then 130, and --resume goes on.
    """
    from eomgen.products.fields.sampling import draw  # noqa: PLC0415
    from eomgen.products.fields.sampling import sample as sampled  # noqa: PLC0415  # imported when the arguments are known to be fine

    given = {name: value for name, value in options.items() if value is not None}
    with terminal_bar(file) as bar:
        result = sampled(file, folder=folder, resume=resume, progress=bar, **given)
    files = result.save(folder) + (draw(result, folder) if plots else [])
    if as_json:
        print_json({**result.to_dict(), "folder": folder, "files": [path.name for path in files]})
    else:
        _print(result)
    say(f"{result.message}\nwritten to {folder}: {', '.join(path.name for path in files)}")
    return INTERRUPTED if result.interrupted else 0


def _print(samples: FieldSamples) -> None:
    told, mesh = samples.summary(), samples.problem.mesh
    unit = samples.problem.system.unit
    box = " x ".join(f"{length:.6g}" for length in mesh.lengths)
    rows = [
        ("mesh", f"{' x '.join(map(str, mesh.cells))} cells, {box}{' ' + unit if unit else ''}"),
        ("memory", f"{told['memory'] / 2**20:.4g} MiB at most"),
        ("method", f"{samples.settings.method}, mass {samples.mass}, trajectories of {samples.settings.duration:.4g}"),
        ("steps", ", ".join(f"{step:.4g}" for step in told["steps"][:6]) + f"; at most {samples.largest_step:.4g}"),
        ("largest frequency", f"{samples.frequency:.4g}"),
        ("gradients", f"{samples.gradients} in {samples.seconds:.3g} s"),
    ]
    if samples.count:
        rows += [
            ("acceptance", f"{told['acceptance']:.3f}, {told['expected_acceptance']:.3f} by the mean of errors"),
            (
                "energy errors",
                f"mean {told['mean_energy_error']:.4g}, half variance {told['half_variance_of_energy_errors']:.4g}",
            ),
            ("mean of exp(-error)", f"{told['mean_weight']:.4f} +- {told['mean_weight_error']:.4f}, to be 1"),
        ]
    if "r_hat_of_cells" in told:
        worst = told["gradients_per_independent_sample_of_worst_scale"]
        rows += [
            (
                "split R-hat",
                f"{told['r_hat_of_cells']:.4f} of the worst of {counted(samples.samples.cells.shape[2], 'cell')},"
                f" {told['r_hat_of_scales']:.4f} of the worst scale",
            ),
            (
                "autocorrelation time",
                f"{told['autocorrelation_of_cells']:.3g} trajectories in cells,"
                f" {told['autocorrelation_of_worst_scale']:.3g} of the worst scale",
            ),
            (
                "gradients per independent sample",
                f"{told['gradients_per_independent_sample_of_cells']:.3g} in cells,"
                f" {worst:.3g} +- {worst * told['autocorrelation_error']:.2g} of the worst scale",
            ),
        ]
    if "truth_over_deviation" in told:
        z = told["truth_over_deviation"]
        rows += [("(truth - mean)/deviation", f"mean {z['mean']:.4f}, deviation {z['deviation']:.4f}, to be 0 and 1")]
    print_table(f"{samples.name}: {samples.problem.watched}", ("", ""), rows)
    heads = ("k", "prior", "truth", "samples", "deviation", "of the mean", "correlation", "R-hat", "autocorrelation")
    table = [
        tuple("-" if math.isnan(value) else f"{value:.4g}" for value in vars(scale).values())
        for scale in samples.scales()
    ]
    if table:
        print_table("scales: power of a mode", heads, table, numeric=tuple(range(len(heads))))
